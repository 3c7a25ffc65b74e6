//! Stribeck's curve as Lacraru et al. write it:
//!
//! ```text
//! μ(θ̇) = [μ_d + (μ_s − μ_d) exp(−|θ̇/θ̇_s|^δ)] sgn(θ̇)          (2)
//! ```

use super::{Exponential, Fall, FrictionModel};
use crate::params::{Range, Table};
use crate::{Arithmetic, Each, Interval, ParamError, Real};

crate::params! {
    /// Dry friction of pad on disc, Stribeck's curve (2). The defaults are Table 1's.
    ///
    /// `μ(θ̇) = [μ_d + (μ_s − μ_d) exp(−|θ̇/θ̇_s|^δ)] sgn(θ̇)`. A static coefficient below the dynamic one is
    /// taken: such a pair never sticks and slips.
    pub struct StribeckParams<T>: Default {
        /// Coefficient of friction at rest, in (2).
        mu_static: T = 0.2, "mu_static" "μ_s" NONE, Range::at_least(0.0);
        /// Coefficient of friction of a fast shaft, in (2).
        mu_dynamic: T = 0.15, "mu_dynamic" "μ_d" NONE, Range::at_least(0.0);
        /// Stribeck velocity in (2), at which all but 1/e of the drop from `μ_s` to `μ_d` is done.
        stribeck_velocity: T = 0.001, "stribeck_velocity_rad_s" "θ̇_s" RAD_S, Range::divisor();
        /// Stribeck exponent in (2). Other than 1 needs the engine `dormand_prince`.
        stribeck_exponent: T = 1.0, "stribeck_exponent" "δ" NONE, Range::above(0.0);
    }
    relations(p) {
        /// Something divides by the friction at rest.
        STATIC_DIVIDES: mu_static, "a number above 0 in model.friction, and with a brake in rig.friction: computed torque and bounds divide by it";
        /// Something divides by the friction of a fast shaft.
        DYNAMIC_DIVIDES: mu_dynamic, "a number above 0 in model.friction, and with a brake in rig.friction: computed torque and bounds divide by it";
    }
}

/// The friction law (2), checked.
///
/// ```
/// use clutch_core::friction::{FrictionModel, Stribeck, StribeckParams};
/// let friction = Stribeck::<f64>::new(&StribeckParams::default())?;
/// assert_eq!(friction.coefficient(0.0), 0.0);           // sgn(0) = 0
/// assert_eq!(friction.level(0.0), 0.2);                 // what a stuck shaft can hold
/// assert!((friction.coefficient(-1.0) + 0.15).abs() < 1e-12);
/// # Ok::<(), clutch_core::ParamError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stribeck<T> {
    params: StribeckParams<T>,
    inverse_velocity: T,
    exponent_is_one: bool,
    /// `μ_s − μ_d`.
    drop: T,
    /// From this exponent on, the exponential changes no bit of `μ`, or is no normal number.
    vanishes_at: T,
}

impl<T: Real> Stribeck<T> {
    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(p: &StribeckParams<T>) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        // There the exponential's part is ε μ_d / 8: the next number to μ_d is at least ε μ_d / 2 away,
        // and half of that decides how a sum is rounded.
        let drop = p.mu_static - p.mu_dynamic;
        let vanishes_at = (T::from_i32(8) * drop.abs() / (T::EPSILON * p.mu_dynamic)).ln();
        Ok(Stribeck {
            params: *p,
            inverse_velocity: T::ONE / p.stribeck_velocity,
            exponent_is_one: p.stribeck_exponent == T::ONE,
            drop,
            vanishes_at: vanishes_at.min(T::EXP_NEG_MAX),
        })
    }
}

impl<T: Arithmetic> Stribeck<T> {
    /// The parameters it was built from.
    #[must_use]
    pub fn params(&self) -> &StribeckParams<T> {
        &self.params
    }

    /// The curves of several lanes as one.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> Stribeck<L> {
        let stribeck_exponent = each(&|f| f.params.stribeck_exponent);
        let is_one = stribeck_exponent.less_or_equal(L::ONE) & L::ONE.less_or_equal(stribeck_exponent);
        Stribeck {
            params: StribeckParams {
                mu_static: each(&|f| f.params.mu_static),
                mu_dynamic: each(&|f| f.params.mu_dynamic),
                stribeck_velocity: each(&|f| f.params.stribeck_velocity),
                stribeck_exponent,
            },
            inverse_velocity: each(&|f| f.inverse_velocity),
            // To the power of 1 a number has the same bits.
            exponent_is_one: L::all(is_one),
            drop: each(&|f| f.drop),
            vanishes_at: each(&|f| f.vanishes_at),
        }
    }

    /// True if `δ` = 1, as for most pairs: a power takes five times as long as the rest.
    #[inline]
    pub(crate) fn is_quick(&self) -> bool {
        self.exponent_is_one
    }

    /// The level if `δ` = 1, and else another number.
    // Always, where lanes call it: a vector's instructions do not pass a call. For boards the compiler chooses.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub(crate) fn quick_level(&self, velocity: T) -> T {
        self.falling(velocity.abs() * self.inverse_velocity)
    }

    /// The level with any `δ`: to the power of 1 a number has the same bits.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub(crate) fn level_by_power(&self, velocity: T) -> T {
        self.falling((velocity.abs() * self.inverse_velocity).powf(self.params.stribeck_exponent))
    }

    /// True where that has come down to its sliding level.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub(crate) fn quick_has_vanished(&self, velocity: T) -> T::Mask {
        self.vanishes_at.less_or_equal(velocity.abs() * self.inverse_velocity)
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn falling(&self, exponent: T) -> T {
        let vanished = self.vanishes_at.less_or_equal(exponent);
        // In steady motion it mostly has vanished, and then costs nothing.
        if T::all(vanished) {
            return self.params.mu_dynamic;
        }
        T::select(vanished, self.params.mu_dynamic, self.params.mu_dynamic + self.drop * exponent.exp_neg())
    }
}

impl<T: Arithmetic> FrictionModel<T> for Stribeck<T> {
    type Params = StribeckParams<T>;

    fn build(p: &StribeckParams<T>) -> Result<Self, ParamError<T>> where T: Real {
        Stribeck::new(p)
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn level(&self, velocity: T) -> T {
        if self.exponent_is_one {
            return self.quick_level(velocity);
        }
        self.level_by_power(velocity)
    }

    fn curve(&self) -> Option<Stribeck<T>>
    where
        T: Real,
    {
        Some(*self)
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn at_rest(&self) -> T {
        self.params.mu_static
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn sliding(&self) -> T {
        self.params.mu_dynamic
    }

    fn envelope(&self) -> Interval<T> where T: Real {
        let StribeckParams { mu_static: s, mu_dynamic: d, .. } = self.params;
        Interval { low: s.min(d), high: s.max(d) }
    }

    fn exponential(&self) -> Option<Exponential<T>> where T: Real {
        let StribeckParams { mu_static: at_rest, mu_dynamic: sliding, stribeck_velocity: velocity, .. } = self.params;
        self.exponent_is_one.then_some(Exponential { at_rest, sliding, velocity })
    }

    fn falls(&self) -> Option<Fall<T>> where T: Real {
        Some(Fall { velocity: self.params.stribeck_velocity, exponent: self.params.stribeck_exponent })
    }

    fn check_divisor(&self) -> Result<(), ParamError<T>> where T: Real {
        let StribeckParams { mu_static, mu_dynamic, .. } = self.params;
        StribeckParams::STATIC_DIVIDES.require(mu_static, mu_static > T::ZERO)?;
        StribeckParams::DYNAMIC_DIVIDES.require(mu_dynamic, mu_dynamic > T::ZERO)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn table1() -> Stribeck<f64> {
        Stribeck::new(&StribeckParams::default()).unwrap()
    }

    #[test]
    fn the_curve_falls_by_1_over_e_of_its_drop_at_the_stribeck_velocity() {
        let mu = table1().coefficient(0.001);
        assert!((mu - (0.15 + 0.05 / core::f64::consts::E)).abs() < 1e-15);
    }

    #[test]
    fn exponent_two_gives_the_gaussian_curve() {
        let s = Stribeck::new(&StribeckParams { stribeck_exponent: 2.0, ..Default::default() }).unwrap();
        assert!((s.coefficient(0.002) - (0.15 + 0.05 * libm::exp(-4.0))).abs() < 1e-15);
    }

    #[test]
    fn each_bad_parameter_is_named() {
        let d = StribeckParams::<f64>::default();
        for (bad, field) in [
            (StribeckParams { mu_static: -0.1, ..d }, "mu_static"),
            (StribeckParams { mu_dynamic: f64::NAN, ..d }, "mu_dynamic"),
            (StribeckParams { stribeck_velocity: 0.0, ..d }, "stribeck_velocity"),
            (StribeckParams { stribeck_exponent: f64::INFINITY, ..d }, "stribeck_exponent"),
        ] {
            assert_eq!(Stribeck::new(&bad).unwrap_err().field(), field);
        }
    }

    #[test]
    fn a_velocity_that_is_no_number_gives_no_coefficient() {
        let s = Stribeck::<f32>::new(&StribeckParams::<f64>::default().cast()).unwrap();
        assert!(s.level(f32::NAN).is_nan());
        assert_eq!(s.level(f32::INFINITY), 0.15);
    }

    proptest! {
        #[test]
        fn friction_opposes_motion_and_lies_between_its_two_coefficients(
            v in -100.0_f64..100.0, mu_s in 0.0_f64..2.0, mu_d in 0.0_f64..2.0, delta in 0.1_f64..3.0
        ) {
            let s = Stribeck::new(&StribeckParams {
                mu_static: mu_s, mu_dynamic: mu_d, stribeck_velocity: 0.01, stribeck_exponent: delta,
            }).unwrap();
            let mu = s.coefficient(v);
            prop_assert!(mu * v >= 0.0);
            prop_assert!(s.level(v) >= mu_s.min(mu_d) - 1e-15 && s.level(v) <= mu_s.max(mu_d) + 1e-15);
            prop_assert_eq!(s.coefficient(-v), -mu);
        }

        #[test]
        fn leaving_out_an_exponential_that_has_vanished_changes_no_bit(
            mu_s in 0.0_f64..2.0, mu_d in prop_oneof![Just(0.125), 1e-9_f64..2.0], far in 0.9_f64..1.2
        ) {
            fn same<T: Real>(p: &StribeckParams<T>, far: T) -> bool {
                let s = Stribeck::new(p).unwrap();
                let v = s.vanishes_at.max(T::ZERO) * far;
                let all = p.mu_dynamic + (p.mu_static - p.mu_dynamic) * (-v).exp();
                // An exponential of which a sum shows bits differs in them from another routine's.
                v < s.vanishes_at || s.level(v) == all
            }
            let p = StribeckParams {
                mu_static: mu_s, mu_dynamic: mu_d, stribeck_velocity: 1.0, stribeck_exponent: 1.0,
            };
            prop_assert!(same(&p, far));
            prop_assert!(same(&p.cast::<f32>(), far as f32));
        }
    }
}
