//! Dry friction of a pad on a disc.
//!
//! ```text
//! μ(θ̇) = [μ_d + (μ_s − μ_d) exp(−|θ̇/θ̇_s|^δ)] sgn(θ̇)          (2)
//! T_f  = μ(θ̇) K_COF max(v_a, 0)                               the friction term of (1)
//! K_COF = r_i K_t A / (A_lever R_a r_c)                        (18)
//! ```
//!
//! (2) is Stribeck's curve as Lacraru et al. write it. Two readings are settled here:
//! `sgn(0) = 0`, and a pad can only push, so a negative voltage gives no normal force.

use crate::error::{cast, require};
use crate::{ParamError, Real};

/// Parameters of (2); `Default` = Table 1.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct StribeckParams<T = f64> {
    /// `μ_s` in (2): static coefficient of friction.
    #[doc(alias = "mu_s")]
    pub mu_static: T,
    /// `μ_d` in (2): dynamic coefficient of friction.
    #[doc(alias = "mu_d")]
    pub mu_dynamic: T,
    /// `θ̇_s` in (2): Stribeck velocity, rad/s.
    pub stribeck_velocity: T,
    /// `δ` in (2): Stribeck exponent.
    #[doc(alias = "delta")]
    pub stribeck_exponent: T,
}

cast!(StribeckParams { mu_static, mu_dynamic, stribeck_velocity, stribeck_exponent });

impl<T: Real> Default for StribeckParams<T> {
    fn default() -> Self {
        StribeckParams {
            mu_static: T::from_f64(0.2),
            mu_dynamic: T::from_f64(0.15),
            stribeck_velocity: T::from_f64(0.001),
            stribeck_exponent: T::ONE,
        }
    }
}

/// The friction law (2), checked.
///
/// ```
/// use clutch_core::{Stribeck, StribeckParams};
/// let friction = Stribeck::<f64>::new(&StribeckParams::default())?;
/// assert_eq!(friction.coefficient(0.0), 0.0);           // sgn(0) = 0
/// assert_eq!(friction.magnitude(0.0), 0.2);             // what a stuck shaft can hold
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
    /// `mu_static` or `mu_dynamic` negative, `stribeck_velocity` or `stribeck_exponent` not
    /// positive, any of them not finite. A static coefficient below the dynamic one is taken:
    /// such a pair never sticks and slips.
    pub fn new(p: &StribeckParams<T>) -> Result<Self, ParamError<T>> {
        require("mu_static", p.mu_static, p.mu_static >= T::ZERO, "a finite number of at least 0")?;
        require("mu_dynamic", p.mu_dynamic, p.mu_dynamic >= T::ZERO, "a finite number of at least 0")?;
        let inverse_velocity = T::ONE / p.stribeck_velocity;
        require(
            "stribeck_velocity",
            p.stribeck_velocity,
            p.stribeck_velocity > T::ZERO && inverse_velocity.is_finite(),
            "a finite number above 0 rad/s",
        )?;
        require(
            "stribeck_exponent",
            p.stribeck_exponent,
            p.stribeck_exponent > T::ZERO,
            "a finite number above 0",
        )?;
        // Where the exponential's part is ε μ_d / 8: the next number to μ_d is at least ε μ_d / 2 away,
        // and half of that decides how a sum is rounded.
        let drop = p.mu_static - p.mu_dynamic;
        let vanishes_at = (T::from_i32(8) * drop.abs() / (T::EPSILON * p.mu_dynamic)).ln();
        Ok(Stribeck {
            params: *p,
            inverse_velocity,
            exponent_is_one: p.stribeck_exponent == T::ONE,
            drop,
            vanishes_at: vanishes_at.min(T::EXP_NEG_MAX),
        })
    }

    /// The parameters it was built from.
    #[must_use]
    pub fn params(&self) -> &StribeckParams<T> {
        &self.params
    }

    /// `|μ|` at a speed, by the formula without its sign: `μ_s` at rest.
    #[inline]
    #[must_use]
    pub fn magnitude(&self, velocity: T) -> T {
        self.magnitude_without_power(velocity).unwrap_or_else(|| {
            self.falling((velocity.abs() * self.inverse_velocity).powf(self.params.stribeck_exponent))
        })
    }

    /// [`Stribeck::magnitude`] where `δ = 1`, as for most pairs; `None` elsewhere. A power takes
    /// five times as long as the rest.
    #[inline]
    pub(crate) fn magnitude_without_power(&self, velocity: T) -> Option<T> {
        self.exponent_is_one.then(|| self.falling(velocity.abs() * self.inverse_velocity))
    }

    #[inline]
    fn falling(&self, exponent: T) -> T {
        // In steady motion it mostly has vanished, and then costs nothing.
        if exponent >= self.vanishes_at {
            self.params.mu_dynamic
        } else {
            self.params.mu_dynamic + self.drop * exponent.exp_neg()
        }
    }

    /// `μ(θ̇)` of (2), with its sign; 0 at rest.
    #[inline]
    #[must_use]
    pub fn coefficient(&self, velocity: T) -> T {
        self.magnitude(velocity) * velocity.sgn()
    }
}

/// The linkage from motor voltage to friction torque, as Table 1 lists it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct BrakeGeometry<T = f64> {
    /// `r_i`: inner radius of the brake disc, m.
    pub inner_radius: T,
    /// `K_t`: torque constant of the motor, N m/A. Not printed in the paper.
    pub torque_constant: T,
    /// `A`: area of contact between pad and disc, m².
    pub pad_area: T,
    /// `A_lever`: area of the tip of the lever, m².
    pub lever_area: T,
    /// `R_a`: armature resistance, Ω. Not printed in the paper.
    pub armature_resistance: T,
    /// `r_c`: distance from the motor's shaft to the contact on the disc, m.
    pub contact_radius: T,
}

impl<T: Real> BrakeGeometry<T> {
    /// `K_COF = r_i K_t A / (A_lever R_a r_c)` of (18), N m/V per unit of μ.
    ///
    /// # Errors
    /// Names the first field that is not a finite number above 0.
    pub fn brake_gain(&self) -> Result<T, ParamError<T>> {
        let positive = |field, value: T, expected| require(field, value, value > T::ZERO, expected);
        positive("inner_radius", self.inner_radius, "a finite number above 0 m")?;
        positive("torque_constant", self.torque_constant, "a finite number above 0 N m/A")?;
        positive("pad_area", self.pad_area, "a finite number above 0 m²")?;
        positive("lever_area", self.lever_area, "a finite number above 0 m²")?;
        positive("armature_resistance", self.armature_resistance, "a finite number above 0 Ω")?;
        positive("contact_radius", self.contact_radius, "a finite number above 0 m")?;
        let gain = self.inner_radius * self.torque_constant * self.pad_area
            / (self.lever_area * self.armature_resistance * self.contact_radius);
        require("brake_gain", gain, gain > T::ZERO, "a geometry whose K_COF is a finite number above 0 N m/V")
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
    fn the_geometry_gives_the_gain_of_18() {
        // Table 1's lengths and areas, with K_t/R_a chosen so that K_COF = 0.14.
        let ratio = 0.14 * 0.032 * 0.034 / (0.045 * 0.040);
        let g = BrakeGeometry {
            inner_radius: 0.045,
            torque_constant: ratio,
            pad_area: 0.040,
            lever_area: 0.032,
            armature_resistance: 1.0,
            contact_radius: 0.034,
        };
        assert!((g.brake_gain().unwrap() - 0.14).abs() < 1e-15);
        let bad = BrakeGeometry { armature_resistance: 0.0, ..g };
        assert_eq!(bad.brake_gain().unwrap_err().field, "armature_resistance");
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
            assert_eq!(Stribeck::new(&bad).unwrap_err().field, field);
        }
    }

    #[test]
    fn a_velocity_that_is_no_number_gives_no_coefficient() {
        let s = Stribeck::<f32>::new(&StribeckParams::<f64>::default().cast()).unwrap();
        assert!(s.magnitude(f32::NAN).is_nan());
        assert_eq!(s.magnitude(f32::INFINITY), 0.15);
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
            prop_assert!(s.magnitude(v) >= mu_s.min(mu_d) - 1e-15 && s.magnitude(v) <= mu_s.max(mu_d) + 1e-15);
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
                v < s.vanishes_at || s.magnitude(v) == all
            }
            let p = StribeckParams {
                mu_static: mu_s, mu_dynamic: mu_d, stribeck_velocity: 1.0, stribeck_exponent: 1.0,
            };
            prop_assert!(same(&p, far));
            prop_assert!(same(&p.cast::<f32>(), far as f32));
        }
    }
}
