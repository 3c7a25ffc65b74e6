//! Bounds on the plant: intervals instead of numbers, as (23) of the paper.

use crate::actuator::ActuatorKind;
use crate::friction::FrictionModel;
use crate::params::{Range, Table};
use crate::{Interval, ParamError, PlantParams, Real};

crate::params! {
    /// Accuracy to which each parameter of the model is known, as a share of its value: 20 % stands for ±20 %. The
    /// defaults say exactly.
    pub struct Tolerances<T>: Default {
        /// ± on the inertia `J`, (23a).
        inertia: T = 0.0, "inertia_percent" "" PERCENT, Range::at_least(0.0).below(100.0);
        /// ± on the driving torque `T_u`, (23b).
        drive_torque: T = 0.0, "drive_torque_percent" "" PERCENT, Range::at_least(0.0).below(100.0);
        /// ± on the viscous damping `C_d`, (23c).
        viscous_damping: T = 0.0, "viscous_damping_percent" "" PERCENT, Range::at_least(0.0).below(100.0);
        /// ± on the brake gain `K_COF`, (23h).
        brake_gain: T = 0.0, "brake_gain_percent" "" PERCENT, Range::at_least(0.0).below(100.0);
        /// ± on a motor's gain `k_t`.
        motor_gain: T = 0.0, "motor_gain_percent" "" PERCENT, Range::at_least(0.0).below(100.0);
        /// ± on the friction, in motion (23d) and at rest (23e).
        friction: T = 0.0, "friction_percent" "" PERCENT, Range::at_least(0.0).below(100.0);
    }
}

crate::params! {
    /// The bounds (23) on the plant.
    pub struct Bounds<T> {
        /// Kind of the actuator.
        actuator: ActuatorKind, "actuator" "" NONE, Range::ANY;
        /// Normal force without a voltage, as torque per unit of μ.
        preload: T, "preload_nm" "N_0" NM, Range::at_least(0.0);
        /// Share of a motor's torque that presses, too.
        load_share: T, "load_share" "λ" NONE, Range::at_least(0.0);
    }
    nested {
        /// `J_0 … J_1` (23a), kg m².
        inertia: Interval<T>, "inertia_kg_m2";
        /// `(M g R_p)_1 … (M g R_p)_2` (23b), N m.
        drive_torque: Interval<T>, "drive_torque_nm";
        /// Up to `C_d1` (23c), N m s/rad.
        viscous_damping: Interval<T>, "viscous_damping_nm_s_rad";
        /// `K_COF1 … K_COF2` (23h), N m/V; 0 … 0 of a motor.
        brake_gain: Interval<T>, "brake_gain_nm_v";
        /// `k_t` of a motor, N m/V; 0 … 0 of a brake.
        motor_gain: Interval<T>, "motor_gain_nm_v";
        /// `|μ|` at rest: of `μ_s` (23e).
        friction_at_rest: Interval<T>, "friction_at_rest";
        /// `|μ|` of a fast shaft: of `μ_d` (23d).
        friction_sliding: Interval<T>, "friction_sliding";
        /// All that `|μ|` can be at any speed.
        friction: Interval<T>, "friction";
    }
}

impl<T: Real> Bounds<T> {
    /// Bounds around a plant. With a brake the driving torque must be positive: turn the axis if it is not.
    ///
    /// # Errors
    /// A tolerance negative or so large that its parameter could reach 0; a parameter of the
    /// plant out of range; with a brake, a driving torque not above 0; a motor that friction of its own load could jam.
    pub fn around(plant: &PlantParams<T>, tolerance: &Tolerances<T>) -> Result<Self, ParamError<T>> {
        let checked = crate::Plant::new(plant)?;
        let (actuator, friction) = (checked.actuator(), checked.friction());
        tolerance.check_rows()?;
        let t = tolerance;
        if !actuator.kind().drives_above_0() {
            let still = actuator.kind().two_sided() && plant.drive_torque == T::ZERO;
            PlantParams::DRIVES.require(plant.drive_torque, plant.drive_torque > T::ZERO || still)?;
        }
        checked.check_solvable()?;
        let envelope = friction.envelope().widened(t.friction);
        actuator.check_share(envelope.high)?;
        Ok(Bounds {
            actuator: actuator.kind(),
            preload: actuator.preload(),
            load_share: actuator.load_share(),
            inertia: Interval::around(plant.inertia, t.inertia),
            drive_torque: Interval::around(plant.drive_torque, t.drive_torque),
            viscous_damping: Interval::around(plant.viscous_damping, t.viscous_damping),
            brake_gain: Interval::around(actuator.brake_gain(), t.brake_gain),
            motor_gain: Interval::around(actuator.motor_gain(), t.motor_gain),
            friction_at_rest: Interval::around(friction.at_rest(), t.friction),
            friction_sliding: Interval::around(friction.sliding(), t.friction),
            friction: envelope,
        })
    }

    /// Least brake torque per volt over all corners and speeds, N m/V.
    #[must_use]
    pub fn weakest_brake(&self) -> T {
        self.friction.low * self.brake_gain.low
    }

    /// Greatest brake torque per volt over all corners and speeds, N m/V.
    #[must_use]
    pub fn strongest_brake(&self) -> T {
        self.friction.high * self.brake_gain.high
    }

    /// Least torque that drives, for each volt, where friction of its own load is worst, N m/V: 0 with a brake.
    pub(crate) fn drives_per_volt(&self) -> T {
        self.motor_gain.low * (T::ONE - self.friction.high * self.load_share)
    }

    /// Least torque against a motion forwards for each volt of that side, N m/V: of a brake, or of a motor that drives backwards.
    pub(crate) fn resists_per_volt(&self) -> T {
        if self.actuator.drives_above_0() { self.drives_per_volt() } else { self.weakest_brake() }
    }

    /// Torque that drives at a voltage, over all corners, N m.
    fn driving(&self, volts: T) -> Interval<T> {
        let k = &self.motor_gain;
        match self.actuator {
            ActuatorKind::Brake => Interval::default(),
            ActuatorKind::Motor => {
                let (a, b) = (k.low * volts, k.high * volts);
                Interval { low: a.min(b), high: a.max(b) }
            }
            ActuatorKind::Both => {
                let pulled = (-volts).max(T::ZERO);
                Interval { low: k.low * pulled, high: k.high * pulled }
            }
        }
    }

    /// The part of the authority that drives, friction apart: the torques that the actuator gives by itself at some voltage
    /// of the output, whichever corner is the true one, N m. With a brake 0 … 0, with a motor `−k_t u_max … k_t u_max`.
    #[must_use]
    pub fn drives(&self, lowest: T, highest: T) -> Interval<T> {
        let [a, b, c] = corners(lowest, highest).map(|u| self.driving(u));
        Interval { low: a.high.min(b.high).min(c.high), high: a.low.max(b.low).max(c.low) }
    }

    /// Torque of friction with coefficients in an interval, without its sign, at a voltage, over all corners, N m.
    fn rubbing(&self, mu: &Interval<T>, volts: T) -> Interval<T> {
        let (pressed, loaded) = (volts.max(T::ZERO), self.load_share * volts.abs());
        let normal = |brake: T, motor: T| brake * pressed + (self.preload + motor * loaded);
        Interval {
            low: mu.low * normal(self.brake_gain.low, self.motor_gain.low),
            high: mu.high * normal(self.brake_gain.high, self.motor_gain.high),
        }
    }

    /// Torque that actuator and friction give a shaft that moves forwards or backwards, at a voltage, over all corners,
    /// N m.
    #[must_use]
    pub fn torque(&self, forwards: bool, volts: T) -> Interval<T> {
        let (drive, friction) = (self.driving(volts), self.rubbing(&self.friction, volts));
        if forwards {
            Interval { low: drive.low - friction.high, high: drive.high - friction.low }
        } else {
            Interval { low: drive.low + friction.low, high: drive.high + friction.high }
        }
    }

    /// Authority: the torques that actuator and friction give a shaft that moves forwards or backwards at some voltage of
    /// the output, whichever corner is the true one, N m. With a brake in forward motion `−μ N_max … −μ N_min`, with a
    /// motor without friction `−k_t u_max … k_t u_max`.
    #[must_use]
    pub fn authority(&self, forwards: bool, lowest: T, highest: T) -> Interval<T> {
        let [a, b, c] = corners(lowest, highest).map(|u| self.torque(forwards, u));
        Interval { low: a.high.min(b.high).min(c.high), high: a.low.max(b.low).max(c.low) }
    }

    /// All torques that actuator and friction give some shaft of the bounds at some voltage of the output, N m.
    #[must_use]
    pub fn possible(&self, forwards: bool, lowest: T, highest: T) -> Interval<T> {
        let [a, b, c] = corners(lowest, highest).map(|u| self.torque(forwards, u));
        Interval { low: a.low.min(b.low).min(c.low), high: a.high.max(b.high).max(c.high) }
    }

    /// The same for a shaft at rest, which friction helps to hold, N m.
    #[must_use]
    pub fn authority_at_rest(&self, lowest: T, highest: T) -> Interval<T> {
        let held = |u: T| {
            let (drive, friction) = (self.driving(u), self.rubbing(&self.friction_at_rest, u));
            Interval { low: drive.high - friction.low, high: drive.low + friction.low }
        };
        let [a, b, c] = corners(lowest, highest).map(held);
        Interval { low: a.low.min(b.low).min(c.low), high: a.high.max(b.high).max(c.high) }
    }

    /// Torque that drive and motor leave at a voltage and that friction does not stop, at the worst corner and speed, N m;
    /// at or below 0 the voltage stops and holds the shaft.
    #[must_use]
    pub fn left_over(&self, volts: T) -> T {
        let (drive, motor) = (&self.drive_torque, self.driving(volts));
        let torque = Interval { low: drive.low + motor.low, high: drive.high + motor.high };
        torque.magnitude() - self.rubbing(&self.friction, volts).low
    }
}

/// Voltages between which torque is straight: the output's ends and 0, or the end that is nearest to it.
fn corners<T: Real>(lowest: T, highest: T) -> [T; 3] {
    [lowest, T::ZERO.max(lowest).min(highest), highest]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ActuatorParams, BothActuator, MotorActuator};

    fn near(a: Interval<f64>, low: f64, high: f64) {
        assert!((a.low - low).abs() < 1e-12 && (a.high - high).abs() < 1e-12, "{a:?}: {low} … {high}");
    }

    /// 10 % on the friction, 20 % on the gains, 30 % on the drive.
    fn bounds(actuator: impl Into<ActuatorParams>, drive_torque: f64) -> Bounds<f64> {
        let plant = PlantParams { actuator: actuator.into(), drive_torque, ..PlantParams::default() };
        let t = Tolerances {
            friction: 0.1,
            brake_gain: 0.2,
            motor_gain: 0.2,
            drive_torque: 0.3,
            ..Tolerances::default()
        };
        Bounds::around(&plant, &t).unwrap()
    }

    const MOTOR: MotorActuator = MotorActuator { gain: 0.05, preload: 0.3, load_share: 0.5 };
    const BOTH: BothActuator = BothActuator { brake_gain: 0.14, motor_gain: 0.05, preload: 0.3 };

    #[test]
    fn a_brake_gives_torques_against_the_motion_only() {
        let b = bounds(ActuatorParams::brake(0.14), 0.05);
        // μ 0.135 … 0.22, K 0.112 … 0.168 N m/V.
        near(Interval { low: b.weakest_brake(), high: b.strongest_brake() }, 0.135 * 0.112, 0.22 * 0.168);
        near(b.torque(true, 3.0), -3.0 * b.strongest_brake(), -3.0 * b.weakest_brake());
        near(b.torque(false, 3.0), 3.0 * b.weakest_brake(), 3.0 * b.strongest_brake());
        near(b.torque(true, -3.0), 0.0, 0.0);
        near(b.authority(true, 0.0, 10.0), -10.0 * b.weakest_brake(), 0.0);
        near(b.possible(true, 0.0, 10.0), -10.0 * b.strongest_brake(), 0.0);
        near(b.possible(false, 1.0, 10.0), b.weakest_brake(), 10.0 * b.strongest_brake());
        near(b.drives(0.0, 10.0), 0.0, 0.0);
        // At rest with 10 V the friction holds either way: 0.18 … 0.22 of it.
        let held = 10.0 * 0.18 * 0.112;
        near(b.authority_at_rest(0.0, 10.0), -held, held);
        // 0.05 N m + 30 % on 4 V of the weakest brake.
        assert!((b.left_over(4.0) - (0.065 - 4.0 * b.weakest_brake())).abs() < 1e-12);
    }

    #[test]
    fn a_motor_drives_either_way_against_the_friction_of_its_own_load() {
        let b = bounds(MOTOR, -0.1);
        near(b.drive_torque, -0.13, -0.07);
        // Normal force 0.3 + 0.5 k |u|, k 0.04 … 0.06 N m/V.
        let (low, high) = (0.135 * (0.3 + 0.5 * 0.04 * 2.0), 0.22 * (0.3 + 0.5 * 0.06 * 2.0));
        near(b.torque(true, 2.0), 0.08 - high, 0.12 - low);
        near(b.torque(false, 2.0), 0.08 + low, 0.12 + high);
        near(b.torque(true, -2.0), -0.12 - high, -0.08 - low);
        // Drive and motor leave −0.13 − 0.12 N m on the least friction.
        assert!((b.left_over(-2.0) - (0.25 - low)).abs() < 1e-12);
        assert!((b.left_over(2.0) - (0.05 - low)).abs() < 1e-12);
        near(b.authority(true, -2.0, 2.0), -0.08 - low, 0.08 - high);
        near(b.drives(-1.0, 2.0), -0.04, 0.08);
        // An output that never goes below 0.5 V never drives it backwards.
        near(b.drives(0.5, 2.0), 0.03, 0.08);
        let rest = 0.18 * (0.3 + 0.5 * 0.04 * 2.0);
        near(b.authority_at_rest(-2.0, 2.0), -0.08 - rest, 0.08 + rest);
    }

    #[test]
    fn a_brake_with_a_motor_brakes_above_0_volts_and_drives_below() {
        let b = bounds(BOTH, 0.05);
        let (low, high) = (0.135 * 0.3, 0.22 * 0.3);
        near(b.torque(true, -2.0), 0.08 - high, 0.12 - low);
        near(b.torque(true, 2.0), -0.22 * (0.3 + 0.168 * 2.0), -0.135 * (0.3 + 0.112 * 2.0));
        assert!((b.left_over(-2.0) - (0.065 + 0.12 - low)).abs() < 1e-12);
        near(b.drives(-2.0, 10.0), 0.0, 0.08);
        // It may stand without a drive, and a brake alone may not.
        assert_eq!(bounds(BOTH, 0.0).drive_torque, Interval { low: 0.0, high: 0.0 });
        for (actuator, drive_torque) in [(ActuatorParams::brake(0.14), 0.0), (BOTH.into(), -0.1)] {
            let plant = PlantParams { actuator, drive_torque, ..PlantParams::default() };
            let error = Bounds::around(&plant, &Tolerances::default()).unwrap_err();
            assert_eq!(error.field(), "drive_torque");
        }
    }

    #[test]
    fn an_interval_around_a_negative_value_has_its_ends_in_order() {
        near(Interval::around(-2.0, 0.25), -2.5, -1.5);
        near(Interval::around(2.0, 0.25), 1.5, 2.5);
        assert_eq!(Interval { low: -3.0, high: 2.0 }.magnitude(), 3.0);
        assert_eq!(Interval { low: -1.0, high: 2.0 }.magnitude(), 2.0);
    }
}
