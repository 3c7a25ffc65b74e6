//! A dual simplex for many small programs that differ little.
//!
//! `max c·y` over `A y ≤ b`, `y` free, with 4 to 7 variables and hundreds of constraints. A basis is as many constraints as
//! there are variables, met with equality; it is kept dual feasible (multipliers `λ ≥ 0`, `Σ λ_j A_j = c`), so that its value
//! `Σ λ_j b_j` bounds the maximum from above whatever `b` is. As the set's radii change, a basis stays dual feasible: a program
//! begins where it last ended, and ends as soon as its bound is good enough, mostly before the first pivot.
//!
//! A library's solver would set up and factorise each of these programs anew: the search asks 10⁵ to 10⁷ of them, nearly all of
//! which a dozen multiplications answer, and it needs the multipliers of bounds that are not yet optimal.

/// Constraints that are compared at once: as many as a wide vector holds.
const AT_ONCE: usize = 8;

/// Constraints by column: their products with a vector are sums of few long columns.
#[derive(Clone, Debug)]
pub(crate) struct Constraints<const N: usize> {
    columns: [Vec<f64>; N],
    /// Right sides.
    pub(crate) rhs: Vec<f64>,
}

impl<const N: usize> Constraints<N> {
    pub(crate) fn new() -> Self {
        Constraints { columns: std::array::from_fn(|_| Vec::new()), rhs: Vec::new() }
    }

    pub(crate) fn push(&mut self, row: &[f64; N], rhs: f64) {
        for (column, x) in self.columns.iter_mut().zip(row) {
            column.push(*x);
        }
        self.rhs.push(rhs);
    }

    pub(crate) fn len(&self) -> usize {
        self.rhs.len()
    }

    pub(crate) fn row(&self, j: usize) -> [f64; N] {
        std::array::from_fn(|i| self.columns[i][j])
    }

    /// The constraint that `y` breaks most, the first of equals, and by how much. `compared` counts constraints.
    fn most_broken(&self, y: &[f64; N], compared: &mut u64) -> (usize, f64) {
        *compared += self.len() as u64;
        let whole = self.len() - self.len() % AT_ONCE;
        // The worst of each place of a vector: compared apart, they need no order among each other.
        let (mut places, mut worst) = ([usize::MAX; AT_ONCE], [f64::NEG_INFINITY; AT_ONCE]);
        for begin in (0..whole).step_by(AT_ONCE) {
            let by: [f64; AT_ONCE] = self.broken(y, begin);
            for k in 0..AT_ONCE {
                let more = by[k] > worst[k];
                worst[k] = if more { by[k] } else { worst[k] };
                places[k] = if more { begin + k } else { places[k] };
            }
        }
        let found = places.into_iter().zip(worst);
        let rest = (whole..self.len()).map(|j| (j, self.broken::<1>(y, j)[0]));
        found.chain(rest).fold((usize::MAX, f64::NEG_INFINITY), |(i, a), (j, b)| {
            if b > a || (b == a && j < i) { (j, b) } else { (i, a) }
        })
    }

    /// The amounts by which `y` breaks some constraints, from one on.
    #[inline]
    fn broken<const K: usize>(&self, y: &[f64; N], begin: usize) -> [f64; K] {
        let mut sums = [0.0; K];
        for (sum, b) in sums.iter_mut().zip(&self.rhs[begin..begin + K]) {
            *sum = -b;
        }
        for (column, y) in self.columns.iter().zip(y) {
            for (sum, x) in sums.iter_mut().zip(&column[begin..begin + K]) {
                *sum += x * y;
            }
        }
        sums
    }
}

/// A program: constraints of the set, which all share, and those of a mode.
pub(crate) struct Program<'a, const N: usize> {
    pub(crate) set: &'a Constraints<N>,
    pub(crate) mode: &'a Constraints<N>,
}

/// A dual feasible point: constraints and their multipliers.
#[derive(Clone, Debug)]
pub(crate) struct Dual<const N: usize> {
    pub(crate) basis: [u32; N],
    pub(crate) weights: [f64; N],
    /// The ray that proves the constraints contradictory: a constraint's number and weights of the basis.
    pub(crate) ray: Option<(u32, [f64; N])>,
}

/// Violations below this are none, in units of the rows, whose norm is about 1.
const FEASIBLE: f64 = 1e-9;
const PIVOT: f64 = 1e-9;
/// Weights below this share of a violation come from rounding: the check knows the box that the state lies in.
const ROUNDING: f64 = 1e-11;
const MOST_PIVOTS: usize = 60;

impl<const N: usize> Program<'_, N> {
    fn row(&self, j: u32) -> [f64; N] {
        let j = j as usize;
        if j < self.set.len() { self.set.row(j) } else { self.mode.row(j - self.set.len()) }
    }

    fn rhs(&self, j: u32) -> f64 {
        let j = j as usize;
        if j < self.set.len() { self.set.rhs[j] } else { self.mode.rhs[j - self.set.len()] }
    }

    /// The bound that a dual point gives; `-∞` with a ray that still proves a contradiction.
    pub(crate) fn bound(&self, dual: &Dual<N>) -> f64 {
        if let Some((q, weights)) = &dual.ray {
            let mut sum = self.rhs(*q);
            for (j, w) in dual.basis.iter().zip(weights) {
                sum += w * self.rhs(*j);
            }
            if sum < -FEASIBLE {
                return f64::NEG_INFINITY;
            }
        }
        dual.basis.iter().zip(&dual.weights).map(|(j, w)| w * self.rhs(*j)).sum()
    }

    /// The weights of a dual point's ray, and by how much they contradict themselves.
    pub(crate) fn contradiction(&self, dual: &Dual<N>) -> Option<(f64, Vec<(u32, f64)>)> {
        let (entering, ray) = dual.ray.as_ref()?;
        let mut weights: Vec<(u32, f64)> = dual.basis.iter().copied().zip(*ray).collect();
        weights.push((*entering, 1.0));
        weights.retain(|(_, weight)| *weight > 0.0);
        let sum: f64 = weights.iter().map(|(j, w)| w * self.rhs(*j)).sum();
        let size: f64 = weights.iter().map(|(_, w)| w).sum();
        Some((-sum / size, weights.into_iter().map(|(j, w)| (j, w / size)).collect()))
    }

    /// Multipliers that give at most `enough`, if these do: those of the basis, and as much of the ray as it takes.
    pub(crate) fn weights(&self, dual: &Dual<N>, enough: f64) -> Vec<(u32, f64)> {
        let mut out: Vec<(u32, f64)> = dual.basis.iter().copied().zip(dual.weights).collect();
        let over = out.iter().map(|(j, w)| w * self.rhs(*j)).sum::<f64>() - enough;
        if let (true, Some((by, ray))) = (over > 0.0, self.contradiction(dual))
            && by > 0.0
        {
            out.extend(ray.into_iter().map(|(j, w)| (j, w * over / by)));
        }
        out.retain(|(_, weight)| *weight > 0.0);
        out
    }

    /// Improves a dual point until its bound is at most `enough`, or optimal; the bound. `compared` counts constraints.
    pub(crate) fn improve(&self, c: &[f64; N], dual: &mut Dual<N>, enough: f64, compared: &mut u64) -> f64 {
        let bound = self.bound(dual);
        if bound <= enough {
            return bound;
        }
        dual.ray = None;
        let Some(mut inverse) = self.inverse(&dual.basis) else { return bound };
        let mut weights = times(c, &inverse);
        for _ in 0..MOST_PIVOTS {
            let mut y = [0.0; N];
            for (k, j) in dual.basis.iter().enumerate() {
                let b = self.rhs(*j);
                for i in 0..N {
                    y[i] += inverse[i][k] * b;
                }
            }
            let value: f64 = y.iter().zip(c).map(|(y, c)| y * c).sum();
            if value <= enough {
                break;
            }
            let (a, by_a) = self.set.most_broken(&y, compared);
            let (b, by_b) = self.mode.most_broken(&y, compared);
            let (entering, by) = if by_a >= by_b { (a, by_a) } else { (self.set.len() + b, by_b) };
            if by <= FEASIBLE {
                break;
            }
            let w = times(&self.row(entering as u32), &inverse);
            let mut leaving = None;
            for k in 0..N {
                if w[k] > PIVOT {
                    let ratio = weights[k].max(0.0) / w[k];
                    if leaving.is_none_or(|(_, least)| ratio < least) {
                        leaving = Some((k, ratio));
                    }
                }
            }
            let Some((p, ratio)) = leaving else {
                // For any y the entering constraint and the basis contradict each other, but for rounding.
                if w.iter().any(|w| *w > ROUNDING * by) {
                    break;
                }
                dual.ray = Some((entering as u32, w.map(|w| (-w).max(0.0))));
                dual.weights = weights.map(|w| w.max(0.0));
                return f64::NEG_INFINITY;
            };
            let pivot = w[p];
            for row in &mut inverse {
                let scaled = row[p] / pivot;
                for k in 0..N {
                    row[k] -= w[k] * scaled;
                }
                row[p] = scaled;
            }
            for k in 0..N {
                weights[k] -= w[k] * ratio;
            }
            weights[p] = ratio;
            dual.basis[p] = entering as u32;
        }
        // Pivots leave rounding behind, which the check would find.
        if let Some(inverse) = self.inverse(&dual.basis) {
            weights = times(c, &inverse);
        }
        dual.weights = weights.map(|w| w.max(0.0));
        self.bound(dual)
    }

    /// The inverse of the basis' rows, by Gauss and Jordan; none if they are dependent.
    fn inverse(&self, basis: &[u32; N]) -> Option<[[f64; N]; N]> {
        let mut rows: [[f64; N]; N] = std::array::from_fn(|k| self.row(basis[k]));
        let mut inverse: [[f64; N]; N] = std::array::from_fn(|i| std::array::from_fn(|k| f64::from(i == k)));
        for i in 0..N {
            let best = (i..N).max_by(|a, b| rows[*a][i].abs().total_cmp(&rows[*b][i].abs()))?;
            if rows[best][i].abs() < 1e-12 {
                return None;
            }
            rows.swap(i, best);
            inverse.swap(i, best);
            let pivot = rows[i][i];
            for k in 0..N {
                rows[i][k] /= pivot;
                inverse[i][k] /= pivot;
            }
            for j in 0..N {
                let factor = rows[j][i];
                if j != i && factor != 0.0 {
                    for k in 0..N {
                        rows[j][k] -= factor * rows[i][k];
                        inverse[j][k] -= factor * inverse[i][k];
                    }
                }
            }
        }
        Some(inverse)
    }
}

/// `c M`.
fn times<const N: usize>(c: &[f64; N], matrix: &[[f64; N]; N]) -> [f64; N] {
    let mut out = [0.0; N];
    for (c, row) in c.iter().zip(matrix) {
        for (out, x) in out.iter_mut().zip(row) {
            *out += c * x;
        }
    }
    out
}
