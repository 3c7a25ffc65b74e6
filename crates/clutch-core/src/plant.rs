//! The shaft (1), as laws, certificates and simulators know it.
//!
//! ```text
//! J θ̈ = T_u − μ(θ̇) K_COF max(v_a, 0) − C_d θ̇,   T_u = M g R_p     (1)
//! ```
//!
//! At rest the shaft stays at rest while `|T_u| ≤ μ_s K_COF v_a`.

use crate::error::{cast, require};
use crate::friction::{Stribeck, StribeckParams};
use crate::{ParamError, Real};

/// Standard gravity as the paper rounds it, m/s².
pub const GRAVITY: f64 = 9.81;

/// Parameters of (1); `Default` = Table 1.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct PlantParams<T = f64> {
    /// `J` in (1): total moment of inertia, kg m².
    #[doc(alias = "J")]
    pub inertia: T,
    /// `T_u = M g R_p` in (1): driving torque, N m. Either sign.
    #[doc(alias = "T_u")]
    pub drive_torque: T,
    /// `C_d` in (1): viscous damping, N m s/rad.
    #[doc(alias = "C_d")]
    pub viscous_damping: T,
    /// `K_COF` in (18): brake torque per volt and unit of μ, N m/V.
    #[doc(alias = "K_COF")]
    pub brake_gain: T,
    /// The friction law (2).
    pub friction: StribeckParams<T>,
}

cast!(PlantParams { inertia, drive_torque, viscous_damping, brake_gain } nested { friction });

impl<T: Real> Default for PlantParams<T> {
    fn default() -> Self {
        PlantParams {
            inertia: T::from_f64(0.0017),
            drive_torque: T::from_f64(0.2 * GRAVITY * 0.024),
            viscous_damping: T::from_f64(0.001),
            brake_gain: T::from_f64(0.14),
            friction: StribeckParams::default(),
        }
    }
}

/// The plant (1), checked.
///
/// ```
/// use clutch_core::{Plant, PlantParams};
/// let plant = Plant::<f64>::new(&PlantParams::default())?;
/// assert!((plant.holding_voltage_static() - 1.681714).abs() < 1e-6);
/// assert!((plant.holding_voltage_sliding() - 2.242286).abs() < 1e-6);
/// # Ok::<(), clutch_core::ParamError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plant<T> {
    params: PlantParams<T>,
    friction: Stribeck<T>,
    inverse_inertia: T,
}

impl<T: Real> Plant<T> {
    /// Checks the parameters.
    ///
    /// # Errors
    /// `inertia` or `brake_gain` not positive, `viscous_damping` negative, a friction
    /// parameter out of range, any of them not finite.
    pub fn new(p: &PlantParams<T>) -> Result<Self, ParamError<T>> {
        let inverse_inertia = T::ONE / p.inertia;
        require(
            "inertia",
            p.inertia,
            p.inertia > T::ZERO && inverse_inertia.is_finite(),
            "a finite number above 0 kg m²",
        )?;
        require("drive_torque", p.drive_torque, true, "a finite torque, N m")?;
        require(
            "viscous_damping",
            p.viscous_damping,
            p.viscous_damping >= T::ZERO,
            "a finite number of at least 0 N m s/rad",
        )?;
        require("brake_gain", p.brake_gain, p.brake_gain > T::ZERO, "a finite number above 0 N m/V")?;
        let friction = Stribeck::new(&p.friction)?;
        Ok(Plant { params: *p, friction, inverse_inertia })
    }

    /// The parameters it was built from.
    #[must_use]
    pub fn params(&self) -> &PlantParams<T> {
        &self.params
    }

    /// The friction law (2).
    #[must_use]
    pub fn friction(&self) -> &Stribeck<T> {
        &self.friction
    }

    /// Friction torque of the brake at a velocity and a voltage, N m; 0 for a negative voltage.
    #[inline]
    #[must_use]
    pub fn brake_torque(&self, velocity: T, volts: T) -> T {
        self.friction.coefficient(velocity) * self.params.brake_gain * volts.max(T::ZERO)
    }

    /// Largest torque that the brake holds at rest, N m; 0 for a negative voltage.
    #[inline]
    #[must_use]
    pub fn break_away_torque(&self, volts: T) -> T {
        self.params.friction.mu_static * self.params.brake_gain * volts.max(T::ZERO)
    }

    /// `θ̈` of (1) for a shaft in motion, rad/s².
    #[inline]
    #[must_use]
    pub fn acceleration(&self, velocity: T, volts: T) -> T {
        let p = &self.params;
        (p.drive_torque - self.brake_torque(velocity, volts) - p.viscous_damping * velocity)
            * self.inverse_inertia
    }

    /// Lowest voltage that holds the resting shaft, V: `|T_u| / (μ_s K_COF)`.
    #[must_use]
    pub fn holding_voltage_static(&self) -> T {
        self.params.drive_torque.abs() / (self.params.friction.mu_static * self.params.brake_gain)
    }

    /// Voltage at which the sliding shaft neither gains nor loses speed, V, without viscous
    /// damping: `|T_u| / (μ_d K_COF)`.
    #[must_use]
    pub fn holding_voltage_sliding(&self) -> T {
        self.params.drive_torque.abs() / (self.params.friction.mu_dynamic * self.params.brake_gain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_negative_voltage_pushes_no_pad() {
        let plant = Plant::<f64>::new(&PlantParams::default()).unwrap();
        assert_eq!(plant.brake_torque(1.0, -3.0), 0.0);
        assert_eq!(plant.break_away_torque(-3.0), 0.0);
        assert!((plant.acceleration(0.0, -3.0) - 27.69882).abs() < 1e-5);
    }

    #[test]
    fn each_bad_parameter_is_named() {
        let d = PlantParams::<f64>::default();
        for (bad, field) in [
            (PlantParams { inertia: -0.0017, ..d }, "inertia"),
            (PlantParams { drive_torque: f64::NAN, ..d }, "drive_torque"),
            (PlantParams { viscous_damping: -1.0, ..d }, "viscous_damping"),
            (PlantParams { brake_gain: 0.0, ..d }, "brake_gain"),
        ] {
            assert_eq!(Plant::new(&bad).unwrap_err().field, field);
        }
    }
}
