//! The shaft (1), as laws, certificates and simulators know it.
//!
//! ```text
//! J θ̈ = T_u − μ(θ̇) K_COF max(v_a, 0) − C_d θ̇,   T_u = M g R_p     (1)
//! ```
//!
//! At rest the shaft stays at rest while `|T_u| ≤ μ_s K_COF v_a`.

use crate::friction::{Friction, FrictionModel, FrictionParams};
use crate::params::{Range, Table};
use crate::{Arithmetic, Each, ParamError, Real};

/// Standard gravity as the paper rounds it, m/s².
pub const GRAVITY: f64 = 9.81;

crate::params! {
    /// The shaft (1) as laws, observers and certificates believe it to be; the defaults are Table 1's, whatever the
    /// rig is.
    pub struct PlantParams<T>: Default {
        /// Total moment of inertia, in (1).
        inertia: T = 0.0017, "inertia_kg_m2" "J" KG_M2, Range::divisor();
        /// Driving torque `T_u = M g R_p` in (1). Either sign for a plant alone.
        drive_torque: T = 0.047088000000000005, "drive_torque_nm" "T_u" NM, Range::ANY;
        /// Viscous damping, in (1).
        viscous_damping: T = 0.001, "viscous_damping_nm_s_rad" "C_d" NM_S_RAD, Range::at_least(0.0);
        /// Brake torque per volt and unit of μ, (18).
        brake_gain: T = 0.14, "brake_gain_nm_v" "K_COF" NM_V, Range::above(0.0);
    }
    nested {
        /// Friction of pad on disc.
        friction: FrictionParams<T>, "friction";
    }
    relations(p) {
        /// Something moves the shaft.
        DRIVES: drive_torque, "a torque above 0 N m: without one a brake moves nothing";
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
    friction: Friction<T>,
    inverse_inertia: T,
}

impl<T: Real> Plant<T> {
    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(p: &PlantParams<T>) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let friction = Friction::build(&p.friction)?;
        let inverse_inertia = T::ONE / p.inertia;
        Ok(Plant { params: *p, friction, inverse_inertia })
    }
}

impl<T: Arithmetic> Plant<T> {
    /// The plants of several lanes as one; none if their frictions are not of one model.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> Option<Plant<L>> {
        let friction = Friction::in_lanes(&|get| each(&|plant| get(&plant.friction)))?;
        let params = PlantParams {
            inertia: each(&|plant| plant.params.inertia),
            drive_torque: each(&|plant| plant.params.drive_torque),
            viscous_damping: each(&|plant| plant.params.viscous_damping),
            brake_gain: each(&|plant| plant.params.brake_gain),
            friction: friction.params(),
        };
        Some(Plant { params, friction, inverse_inertia: each(&|plant| plant.inverse_inertia) })
    }
}

impl<T> Plant<T> {
    /// The parameters it was built from.
    #[must_use]
    pub fn params(&self) -> &PlantParams<T> {
        &self.params
    }

    /// The friction.
    #[must_use]
    pub fn friction(&self) -> &Friction<T> {
        &self.friction
    }
}

impl<T: Real> Plant<T> {
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
        self.friction.at_rest() * self.params.brake_gain * volts.max(T::ZERO)
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
        self.params.drive_torque.abs() / (self.friction.at_rest() * self.params.brake_gain)
    }

    /// Voltage at which the sliding shaft neither gains nor loses speed, V, without viscous
    /// damping: `|T_u| / (μ_d K_COF)`.
    #[must_use]
    pub fn holding_voltage_sliding(&self) -> T {
        self.params.drive_torque.abs() / (self.friction.sliding() * self.params.brake_gain)
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
            assert_eq!(Plant::new(&bad).unwrap_err().field(), field);
        }
    }
}
