//! What is known of the plant: intervals instead of numbers, as (23) of the paper.

use crate::error::{cast, require};
use crate::{ParamError, PlantParams, Real};

/// A closed interval.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Interval<T = f64> {
    /// Lower end.
    pub low: T,
    /// Upper end.
    pub high: T,
}

impl<T: Real> Interval<T> {
    /// `value · (1 ± share)`.
    fn around(value: T, share: T) -> Self {
        let (a, b) = (value * (T::ONE - share), value * (T::ONE + share));
        Interval { low: a.min(b), high: a.max(b) }
    }
}

/// How well each parameter is known, as a share of its value (0.2 = ±20 %); `Default` = exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Tolerances<T = f64> {
    /// Of the inertia.
    pub inertia: T,
    /// Of the driving torque.
    pub drive_torque: T,
    /// Of the viscous damping.
    pub viscous_damping: T,
    /// Of the brake gain `K_COF`.
    pub brake_gain: T,
    /// Of both coefficients of friction.
    pub friction: T,
}

cast!(Interval { low, high });
cast!(Bounds { } nested { inertia, drive_torque, viscous_damping, brake_gain, mu_static, mu_dynamic });
cast!(Tolerances { inertia, drive_torque, viscous_damping, brake_gain, friction });

/// The bounds (23) on the plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds<T = f64> {
    /// `J_0 … J_1` (23a), kg m².
    pub inertia: Interval<T>,
    /// `(M g R_p)_1 … (M g R_p)_2` (23b), N m.
    pub drive_torque: Interval<T>,
    /// Up to `C_d1` (23c), N m s/rad.
    pub viscous_damping: Interval<T>,
    /// `K_COF1 … K_COF2` (23h), N m/V.
    pub brake_gain: Interval<T>,
    /// Of `μ_s` (23e).
    pub mu_static: Interval<T>,
    /// Of `μ_d` (23d).
    pub mu_dynamic: Interval<T>,
}

impl<T: Real> Bounds<T> {
    /// Bounds around a plant. The driving torque must be positive: turn the axis if it is not.
    ///
    /// # Errors
    /// A tolerance negative or so large that its parameter could reach 0; a parameter of the
    /// plant out of range; a driving torque not above 0.
    pub fn around(plant: &PlantParams<T>, tolerance: &Tolerances<T>) -> Result<Self, ParamError<T>> {
        crate::Plant::new(plant)?;
        let share = |field, value: T| {
            let inside = value >= T::ZERO && value < T::ONE;
            require(field, value, inside, "a share of at least 0 and below 1 (0.2 stands for ±20 %)")
        };
        let t = tolerance;
        require(
            "drive_torque",
            plant.drive_torque,
            plant.drive_torque > T::ZERO,
            "a torque above 0 N m: without one a brake moves nothing",
        )?;
        let mu = plant.friction;
        require("mu_static", mu.mu_static, mu.mu_static > T::ZERO, "a number above 0")?;
        require("mu_dynamic", mu.mu_dynamic, mu.mu_dynamic > T::ZERO, "a number above 0")?;
        Ok(Bounds {
            inertia: Interval::around(plant.inertia, share("inertia", t.inertia)?),
            drive_torque: Interval::around(plant.drive_torque, share("drive_torque", t.drive_torque)?),
            viscous_damping: Interval::around(
                plant.viscous_damping,
                share("viscous_damping", t.viscous_damping)?,
            ),
            brake_gain: Interval::around(plant.brake_gain, share("brake_gain", t.brake_gain)?),
            mu_static: Interval::around(mu.mu_static, share("friction", t.friction)?),
            mu_dynamic: Interval::around(mu.mu_dynamic, t.friction),
        })
    }

    /// Least brake torque per volt over all corners and speeds, N m/V.
    #[must_use]
    pub fn weakest_brake(&self) -> T {
        self.mu_static.low.min(self.mu_dynamic.low) * self.brake_gain.low
    }

    /// Greatest brake torque per volt over all corners and speeds, N m/V.
    #[must_use]
    pub fn strongest_brake(&self) -> T {
        self.mu_static.high.max(self.mu_dynamic.high) * self.brake_gain.high
    }
}
