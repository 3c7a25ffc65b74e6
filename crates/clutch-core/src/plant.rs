//! The shaft (1), as laws, certificates and simulators know it.
//!
//! ```text
//! J θ̈ = T_u + T(v_a) − μ(θ̇) N(v_a) − C_d θ̇,   T_u = M g R_p       (1): T = 0, N = K_COF max(v_a, 0)
//! ```
//!
//! At rest the shaft stays at rest while `|T_u + T| ≤ μ_s N`. The effect of a voltage is the [`Actuator`]'s.

use crate::actuator::{Actuator, ActuatorKind, ActuatorParams};
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
    }
    nested {
        /// Effect of a voltage on the shaft.
        actuator: ActuatorParams<T>, "actuator";
        /// Friction of pad on disc.
        friction: FrictionParams<T>, "friction";
    }
    relations(p) {
        /// Something moves the shaft.
        DRIVES: drive_torque, "a torque above 0 N m with a brake, which moves nothing itself, and at least 0 with a brake and a motor (model.actuator): let the drive turn the shaft forwards, or turn the axis round, or take a motor";
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
    actuator: Actuator<T>,
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
        let actuator = Actuator::new(&p.actuator)?;
        let friction = Friction::build(&p.friction)?;
        actuator.check_share(friction.envelope().high)?;
        let inverse_inertia = T::ONE / p.inertia;
        Ok(Plant { params: *p, actuator, friction, inverse_inertia })
    }
}

impl<T: Arithmetic> Plant<T> {
    /// The plants of several lanes as one; none if their actuators are not of one kind, or their frictions not of one
    /// model.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> Option<Plant<L>> {
        let actuator = Actuator::in_lanes(&|get| each(&|plant| get(&plant.actuator)))?;
        let friction = Friction::in_lanes(&|get| each(&|plant| get(&plant.friction)))?;
        let params = PlantParams {
            inertia: each(&|plant| plant.params.inertia),
            drive_torque: each(&|plant| plant.params.drive_torque),
            viscous_damping: each(&|plant| plant.params.viscous_damping),
            actuator: actuator.params(),
            friction: friction.params(),
        };
        Some(Plant { params, actuator, friction, inverse_inertia: each(&|plant| plant.inverse_inertia) })
    }
}

impl<T: Arithmetic> Plant<T> {
    /// Largest torque that friction holds at rest, N m.
    // Always, where lanes call it: a vector's instructions do not pass a call. For boards the compiler chooses.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    #[must_use]
    pub fn break_away_torque(&self, volts: T) -> T {
        self.actuator.friction(self.friction.at_rest(), volts)
    }
}

impl<T> Plant<T> {
    /// The parameters it was built from.
    #[must_use]
    pub fn params(&self) -> &PlantParams<T> {
        &self.params
    }

    /// The actuator.
    #[inline]
    #[must_use]
    pub fn actuator(&self) -> &Actuator<T> {
        &self.actuator
    }

    /// The friction.
    #[must_use]
    pub fn friction(&self) -> &Friction<T> {
        &self.friction
    }
}

impl<T: Real> Plant<T> {
    /// Checks that the equation can be solved for the voltage: that of an actuator which presses is divided by a friction.
    ///
    /// # Errors
    /// With such an actuator, a friction that can be 0.
    pub fn check_solvable(&self) -> Result<(), ParamError<T>> {
        if self.actuator.kind().drives_above_0() { Ok(()) } else { self.friction.check_divisor() }
    }

    /// Torque of friction at a velocity and a voltage, against the motion, N m.
    #[inline]
    #[must_use]
    pub fn friction_torque(&self, velocity: T, volts: T) -> T {
        self.actuator.friction(self.friction.coefficient(velocity), volts)
    }

    /// `θ̈` of (1) for a shaft in motion, rad/s².
    #[inline]
    #[must_use]
    pub fn acceleration(&self, velocity: T, volts: T) -> T {
        let p = &self.params;
        let torque = p.drive_torque + self.actuator.torque(volts);
        (torque - self.friction_torque(velocity, volts) - p.viscous_damping * velocity) * self.inverse_inertia
    }

    /// Voltage at which friction at rest carries the driving torque, V: `|T_u| / (μ_s K_COF)` with a brake that does not
    /// drag, the lowest that holds. With a motor, the voltage that balances the torque.
    #[must_use]
    pub fn holding_voltage_static(&self) -> T {
        self.volts_at(self.friction.at_rest())
    }

    /// Voltage at which the sliding shaft neither gains nor loses speed, V, without viscous damping: `|T_u| / (μ_d K_COF)`
    /// with a brake that does not drag. With a motor, the voltage that balances the torque.
    #[must_use]
    pub fn holding_voltage_sliding(&self) -> T {
        self.volts_at(self.friction.sliding())
    }

    fn volts_at(&self, mu: T) -> T {
        let torque = self.params.drive_torque;
        match self.actuator.kind() {
            ActuatorKind::Motor => self.actuator.volts_for(-torque, T::ZERO, T::ZERO),
            _ => self.actuator.volts_for(-torque.abs(), mu, T::ONE),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_negative_voltage_pushes_no_pad() {
        let plant = Plant::<f64>::new(&PlantParams::default()).unwrap();
        assert_eq!(plant.friction_torque(1.0, -3.0), 0.0);
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
            (PlantParams { actuator: ActuatorParams::brake(0.0), ..d }, "gain"),
        ] {
            assert_eq!(Plant::new(&bad).unwrap_err().field(), field);
        }
    }
}
