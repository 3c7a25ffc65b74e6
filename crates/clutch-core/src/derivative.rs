//! The paper's "Kalman filter": a smoothed backward difference.
//!
//! ```text
//! ė_k = (1 − K_Kal) ė_{k−1} + K_Kal (e_k − e_{k−1}) / T            (5)
//! ```
//!
//! It is a first-order low-pass on the backward difference; nothing is estimated. The
//! difference is taken in integers, so it stays exact however far the shaft has turned.

use crate::params::{Range, Table};
use crate::{Arithmetic, Each, Encoder, FixedCounts, Micros, ParamError, Real};

crate::params! {
    /// The smoothed difference (5), which the paper calls a Kalman filter: a first-order low-pass on the backward
    /// difference of the error.
    ///
    /// `ė_k = (1 − K_Kal) ė_{k−1} + K_Kal (e_k − e_{k−1})/T`.
    pub struct SmoothedDerivativeParams<T>: Default {
        /// Share of the newest difference in (5); 1 smooths nothing. The paper gives 0.2 to 1, and 0.2 reproduces its
        /// figures.
        smoothing: T = 0.2, "smoothing" "K_Kal" NONE, Range::above(0.0).up_to(1.0);
    }
}

/// The filter (5), checked.
#[doc(alias = "kalman")]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothedDerivative<T> {
    keep: T,
    scale: T,
    /// For a difference in 2⁻¹⁶ counts.
    fine_scale: T,
}

/// Memory of (5).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DerivativeState<T> {
    previous: FixedCounts,
    rate: T,
}

impl<T: Real> DerivativeState<T> {
    /// At an error that does not change.
    #[must_use]
    pub const fn at(error: FixedCounts) -> Self {
        DerivativeState { previous: error, rate: T::ZERO }
    }
}

impl<T: Real> SmoothedDerivative<T> {
    /// Checks the parameters.
    ///
    /// # Errors
    /// `smoothing` outside ]0, 1]; `period` out of range.
    pub fn new(
        p: &SmoothedDerivativeParams<T>,
        encoder: Encoder,
        period: Micros,
    ) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let period = period.period::<T>()?;
        let scale = p.smoothing * encoder.radians_per_count() / period;
        // By a power of two: a product with it has the same bits.
        Ok(SmoothedDerivative {
            keep: T::ONE - p.smoothing,
            scale,
            fine_scale: FixedCounts(1).minus::<T>(FixedCounts(0)) * scale,
        })
    }

    /// One sample: the error `e_k` in, `ė_k` out, rad/s.
    #[inline]
    pub fn update(&self, state: &mut DerivativeState<T>, error: FixedCounts) -> T {
        let difference = error.0.wrapping_sub(state.previous.0);
        state.previous = error;
        state.rate = self.smooth_fine(state.rate, T::from_i64(difference));
        state.rate
    }

    /// As [`SmoothedDerivative::smooth`], with the difference in 2⁻¹⁶ counts.
    #[inline]
    #[must_use]
    pub fn smooth_fine(&self, rate: T, difference: T) -> T {
        self.keep * rate + self.fine_scale * difference
    }
}

impl<T: Arithmetic> SmoothedDerivative<T> {
    /// The filters of several lanes as one.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> SmoothedDerivative<L> {
        SmoothedDerivative {
            keep: each(&|f| f.keep),
            scale: each(&|f| f.scale),
            fine_scale: each(&|f| f.fine_scale),
        }
    }

    /// The next rate from the last one, rad/s, and the difference of the error, counts.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    #[must_use]
    pub fn smooth(&self, rate: T, difference: T) -> T {
        self.keep * rate + self.scale * difference
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filter(smoothing: f64) -> SmoothedDerivative<f64> {
        SmoothedDerivative::new(&SmoothedDerivativeParams { smoothing }, Encoder::PAPER, Micros(1000))
            .unwrap()
    }

    #[test]
    fn without_smoothing_it_is_the_backward_difference() {
        let mut s = DerivativeState::at(FixedCounts(0));
        let one_count_per_ms = filter(1.0).update(&mut s, FixedCounts::from_counts(1));
        assert!((one_count_per_ms.to_degrees() - 18.0).abs() < 1e-12);
    }

    #[test]
    fn a_step_in_the_slope_is_reached_by_1_minus_0_8_to_the_n() {
        let (f, mut s) = (filter(0.2), DerivativeState::at(FixedCounts(0)));
        for n in 1..50 {
            let rate = f.update(&mut s, FixedCounts::from_counts(n));
            let expected = 18.0_f64.to_radians() * (1.0 - libm::pow(0.8, n as f64));
            assert!((rate - expected).abs() < 1e-12, "sample {n}");
        }
    }

    #[test]
    fn the_rate_is_the_same_after_a_million_turns() {
        let far = FixedCounts::from_counts(20_000_000_000);
        let (f, mut near, mut away) =
            (filter(0.2), DerivativeState::at(FixedCounts(0)), DerivativeState::at(far));
        for n in 1..100 {
            let step = FixedCounts(n * 7282);
            assert_eq!(f.update(&mut near, step), f.update(&mut away, far.plus(step)));
        }
    }

    #[test]
    fn smoothing_outside_its_range_is_named() {
        for bad in [0.0, 1.1, f64::NAN] {
            let e = SmoothedDerivative::<f64>::new(
                &SmoothedDerivativeParams { smoothing: bad },
                Encoder::PAPER,
                Micros(1000),
            );
            assert_eq!(e.unwrap_err().field(), "smoothing");
        }
    }
}
