//! Directions that rows hold together: independent ones, each with the rows that make it up.

use nalgebra::{SMatrix, SVector};

/// Directions that rows span, orthonormal by `M⁻¹`.
pub(super) struct Span<const N: usize, const B: usize> {
    directions: [SVector<f64, N>; N],
    /// Shares of the rows whose sum is that direction.
    shares: [SVector<f64, B>; N],
    count: usize,
}

impl<const N: usize, const B: usize> Span<N, B> {
    /// Of rows with a weight above 0, those that can hold most by it first.
    pub(super) fn of(
        inverse: &SMatrix<f64, N, N>,
        rows: &SMatrix<f64, B, N>,
        weight: &SVector<f64, B>,
    ) -> Self {
        let mut span = Span { directions: [SVector::zeros(); N], shares: [SVector::zeros(); N], count: 0 };
        let mut rest: [SVector<f64, N>; B] = std::array::from_fn(|i| rows.row(i).transpose());
        let mut share: [SVector<f64, B>; B] =
            std::array::from_fn(|i| SVector::from_fn(|j, _| f64::from(u8::from(i == j))));
        let length = |x: &SVector<f64, N>| x.dot(&(inverse * x)).max(0.0).sqrt();
        let whole: [f64; B] = std::array::from_fn(|i| length(&rest[i]));
        let mut open: [bool; B] = std::array::from_fn(|i| weight[i] > 0.0 && whole[i] > 0.0);
        while span.count < N {
            let strength = |i: usize| weight[i] * length(&rest[i]);
            let Some(next) = (0..B).filter(|i| open[*i]).max_by(|i, j| strength(*i).total_cmp(&strength(*j)))
            else {
                break;
            };
            open[next] = false;
            let unit = length(&rest[next]);
            // A row in the span of the others holds nothing more.
            if unit <= 1e-9 * whole[next] {
                continue;
            }
            let (direction, shares) = (rest[next] / unit, share[next] / unit);
            let turned = inverse * direction;
            for i in (0..B).filter(|i| open[*i]) {
                // Twice: once leaves what rounding puts in.
                for _ in 0..2 {
                    let along = turned.dot(&rest[i]);
                    rest[i] -= direction * along;
                    share[i] -= shares * along;
                }
            }
            span.directions[span.count] = direction;
            span.shares[span.count] = shares;
            span.count += 1;
        }
        span
    }

    /// Of rows that are stuck.
    pub(super) fn of_stuck(
        inverse: &SMatrix<f64, N, N>,
        rows: &SMatrix<f64, B, N>,
        stuck: &[bool; B],
    ) -> Self {
        Span::of(inverse, rows, &SVector::from_fn(|i, _| f64::from(u8::from(stuck[i]))))
    }

    /// Number of directions.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    fn each(&self) -> impl Iterator<Item = (&SVector<f64, N>, &SVector<f64, B>)> {
        self.directions.iter().zip(&self.shares).take(self.count)
    }

    /// Torques of the rows that take up a load, of the acceleration that it would make.
    pub(super) fn torque(&self, acceleration: &SVector<f64, N>) -> SVector<f64, B> {
        self.each().fold(SVector::zeros(), |sum, (d, shares)| sum + shares * d.dot(acceleration))
    }

    /// A velocity, or an acceleration, with the rates that its rows have to have.
    pub(super) fn project(
        &self,
        inverse: &SMatrix<f64, N, N>,
        x: &SVector<f64, N>,
        rates: &SVector<f64, B>,
    ) -> SVector<f64, N> {
        if self.count == 0 {
            return *x;
        }
        if self.count == N && self.each().all(|(_, shares)| shares.dot(rates) == 0.0) {
            return SVector::zeros();
        }
        let mut y = *x;
        for _ in 0..2 {
            for (d, shares) in self.each() {
                y -= inverse * d * (d.dot(&y) - shares.dot(rates));
            }
        }
        // A rest that is rounding of a number that is gone is 0.
        let least = 8.0 * f64::EPSILON * x.amax();
        if !least.is_finite() {
            return y;
        }
        y.map(|v| if v.abs() <= least { 0.0 } else { v })
    }
}
