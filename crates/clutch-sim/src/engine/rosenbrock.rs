//! One step of a Rosenbrock method of order 4(3) for stiff equations: A-stable, with Shampine's coefficients and a Jacobian
//! from differences.
//!
//! L. F. Shampine, Implementation of Rosenbrock methods, ACM Trans. Math. Software 8 (1982) 93–113.

use nalgebra::{Const, LU, SMatrix, SVector};

/// Coefficients of the stages, of their times, of the result and of its error.
const GAMMA: f64 = 0.5;
const A: [[f64; 2]; 2] = [[2.0, 0.0], [48.0 / 25.0, 6.0 / 25.0]];
const C: [[f64; 3]; 3] =
    [[-8.0, 0.0, 0.0], [372.0 / 25.0, 12.0 / 5.0, 0.0], [-112.0 / 125.0, -54.0 / 125.0, -0.4]];
const AT: [f64; 2] = [1.0, 0.6];
const TIME: [f64; 4] = [0.5, -1.5, 121.0 / 50.0, 29.0 / 250.0];
const RESULT: [f64; 4] = [19.0 / 9.0, 0.5, 25.0 / 108.0, 125.0 / 108.0];
const ERROR: [f64; 4] = [17.0 / 54.0, 7.0 / 36.0, 0.0, 125.0 / 108.0];

/// States and rates.
type State<const D: usize> = [f64; D];

/// Linear equations of as many unknowns as a state has numbers.
pub trait Linear: Sized {
    /// A matrix in factors.
    type Factors;
    /// The factors of `diagonal` times the identity less a matrix, given by its columns.
    fn factors(diagonal: f64, columns: &[Self]) -> Self::Factors;
    /// The solution; none if there is no one.
    fn solve(factors: &Self::Factors, right: &Self) -> Option<Self>;
}

macro_rules! linear {
    ($($size:literal)+) => {$(
        impl Linear for State<$size> {
            type Factors = LU<f64, Const<$size>, Const<$size>>;
            fn factors(diagonal: f64, columns: &[Self]) -> Self::Factors {
                let matrix = SMatrix::<f64, $size, $size>::from_fn(|i, j| columns[j][i]);
                (SMatrix::<f64, $size, $size>::from_diagonal_element(diagonal) - matrix).lu()
            }
            fn solve(factors: &Self::Factors, right: &Self) -> Option<Self> {
                Some(factors.solve(&SVector::<f64, $size>::from(*right))?.into())
            }
        }
    )+};
}
linear!(3 6 10 12);

/// The Jacobian, by columns, and the derivative by time. Differences are a millionth of `scale` or of the state, towards the
/// sign of `away`: across rest a friction has a corner.
fn jacobian<const D: usize>(
    rate: &impl Fn(f64, &State<D>) -> State<D>,
    (s, at, h): (f64, &State<D>, f64),
    here: &State<D>,
    scale: &State<D>,
    away: &State<D>,
) -> ([State<D>; D], State<D>) {
    let mut columns = [[0.0; D]; D];
    for (j, column) in columns.iter_mut().enumerate() {
        let by = 1e-6 * scale[j].max(at[j].abs()).copysign(away[j]);
        let mut moved = *at;
        moved[j] += by;
        let there = rate(s, &moved);
        for (slot, (a, b)) in column.iter_mut().zip(there.iter().zip(here)) {
            *slot = (a - b) / by;
        }
    }
    let by = 1e-3 * h;
    let later = rate(s + by, at);
    (columns, core::array::from_fn(|i| (later[i] - here[i]) / by))
}

/// One step of the equations `rate` from the state `from` at `s`, of the length `h`: the state at its end and the error of
/// each of its numbers; none where the linear equations of the step have no solution.
pub(crate) fn step<const D: usize>(
    rate: &impl Fn(f64, &State<D>) -> State<D>,
    (s, from, h): (f64, &State<D>, f64),
    scale: &State<D>,
    away: &State<D>,
) -> Option<(State<D>, State<D>)>
where
    State<D>: Linear,
{
    let first = rate(s, from);
    let (jacobian, by_time) = jacobian(rate, (s, from, h), &first, scale, away);
    let factors = State::<D>::factors(1.0 / (GAMMA * h), &jacobian);
    let mut stages = [[0.0; D]; 4];
    let mut slope = first;
    for i in 0..4 {
        // The last stage takes the rate of the third.
        if i == 1 || i == 2 {
            let mut at = *from;
            for (a, stage) in A[i - 1].iter().zip(&stages).take(i) {
                at = core::array::from_fn(|n| at[n] + a * stage[n]);
            }
            slope = rate(s + AT[i - 1] * h, &at);
        }
        let mut right: State<D> = core::array::from_fn(|n| slope[n] + h * TIME[i] * by_time[n]);
        if i > 0 {
            for (c, stage) in C[i - 1].iter().zip(&stages).take(i) {
                right = core::array::from_fn(|n| right[n] + c * stage[n] / h);
            }
        }
        stages[i] = State::<D>::solve(&factors, &right)?;
    }
    let sum = |weights: &[f64; 4], n: usize| weights.iter().zip(&stages).map(|(w, g)| w * g[n]).sum::<f64>();
    let to = core::array::from_fn(|n| from[n] + sum(&RESULT, n));
    Some((to, core::array::from_fn(|n| sum(&ERROR, n))))
}
