//! Feasibility: the check that an actuator can make the shaft follow a path.
//!
//! A path asks the actuator for the torque `J θ̈_d + C_d θ̇_d − T_u`. It can be followed while that torque, at each corner
//! of [`Bounds`], is within the authority of the actuator ([`Bounds::authority`]). For a brake between `u_min` and
//! `u_max`, which only takes torque away, and a shaft that is driven forwards, this is
//!
//! ```text
//! θ̇_d ≥ 0                                                       it cannot drive back
//! θ̈_d ≤ [T_min − C_max θ̇_d − (μK)_max u_min] / J_max             the drive must suffice
//! [T_max − C_min θ̇_d − J θ̈_d] / (μK)_min ≤ u_max                 the brake must suffice
//! ```
//!
//! A jump of the velocity is followed late, never at once; it is
//! reported and not refused, since the paper's own path begins with one.

use crate::actuator::ActuatorKind;
use crate::bounds::Bounds;
use crate::interval::Interval;
use crate::law::Output;
use crate::reference::Reference;
use crate::{Micros, Real};
use core::fmt;

/// Velocity below which a path counts as standing still: rounding of the path, rad/s.
const STANDSTILL: f64 = 1e-6;

/// Requirements of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Envelope<T> {
    /// Highest speed, rad/s: `v_d` of (23g).
    pub velocity: T,
    /// Highest acceleration, rad/s².
    pub acceleration: T,
    /// Highest deceleration, rad/s².
    pub deceleration: T,
    /// Highest acceleration that drive and actuator grant at that moment, rad/s².
    pub available_acceleration: T,
    /// Highest voltage that the path needs at the worst corner, V.
    pub highest_voltage: T,
    /// Lowest voltage that the path needs at the worst corner, V; 0 with a brake.
    pub lowest_voltage: T,
    /// Lowest voltage that holds the resting shaft at the worst corner, V; with a motor, the one that balances the drive.
    pub holding_voltage: T,
    /// Jump from the shaft's velocity to the path's at the start, rad/s.
    pub start_jump: T,
    /// Largest jump of the path's velocity on the way, beyond its own acceleration, rad/s.
    pub velocity_jump: T,
}

impl<T: Real> Envelope<T> {
    /// Largest `|θ̈_d|`, rad/s²: `a_d` of (23g).
    #[must_use]
    pub fn largest_acceleration(&self) -> T {
        self.acceleration.max(self.deceleration)
    }
}

/// The reason that a path cannot be followed.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Obstacle {
    /// The path runs backwards, which nothing drives: velocity, rad/s.
    Reverse,
    /// The drive does not suffice: acceleration, rad/s².
    Acceleration,
    /// Brake or motor do not suffice: voltage, V.
    Voltage,
    /// Motor and friction do not hold the resting shaft: torque, N m.
    Hold,
    /// The path is not a number: its value.
    NotFinite,
}

/// The point at which a path cannot be followed, and the reason.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Infeasible<T> {
    /// The first tick at which it cannot.
    pub tick: u64,
    /// Its time, s.
    pub time: T,
    /// The obstacle in the way.
    pub obstacle: Obstacle,
    /// The amount that the path asks for, in the unit of the obstacle.
    pub asked: T,
    /// The amount that can be had.
    pub available: T,
}

impl<T: Real> fmt::Display for Infeasible<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Infeasible { tick, time, asked, available, .. } = self;
        write!(f, "the path cannot be followed from t = {time} s (tick {tick}) on: ")?;
        match self.obstacle {
            Obstacle::Reverse => {
                write!(f, "it runs backwards at {asked} rad/s, and a brake drives nothing")
            }
            Obstacle::Acceleration => {
                write!(f, "it accelerates at {asked} rad/s², and the drive grants {available} rad/s²")
            }
            Obstacle::Voltage => {
                write!(f, "it needs {asked} V, and the output ends at {available} V")
            }
            Obstacle::Hold => {
                write!(f, "at rest it needs {asked} N m, and motor and friction give {available} N m")
            }
            Obstacle::NotFinite => write!(f, "its velocity or acceleration is not a number there"),
        }
    }
}

impl<T: Real> core::error::Error for Infeasible<T> {}

/// Follows a path for `ticks` ticks and says what it asks of drive and actuator.
///
/// `start_velocity` is the shaft's at tick 0, rad/s.
///
/// # Errors
/// The point at which it cannot be followed, and the reason.
pub fn check_path<T: Real>(
    path: &Reference<'_, T>,
    ticks: u64,
    period: Micros,
    start_velocity: T,
    bounds: &Bounds<T>,
    output: &Output<T>,
) -> Result<Envelope<T>, Infeasible<T>> {
    let period: T = period.seconds();
    let still = T::from_f64(STANDSTILL);
    let limits = (output.lowest(), output.highest());
    let drives = bounds.drives(limits.0, limits.1);
    let reverses = drives.low < T::ZERO;
    // The same at each tick: at rest, forwards, backwards.
    let at_rest = bounds.authority_at_rest(limits.0, limits.1);
    let [onwards, back] = [true, false].map(|forwards| bounds.authority(forwards, limits.0, limits.1));
    let mut envelope = Envelope { holding_voltage: holding_voltage(bounds), ..Envelope::default() };
    let (mut last_velocity, mut last_acceleration) = (start_velocity, T::ZERO);
    for tick in 0..ticks {
        let target = path.at(tick);
        let (v, a) = (target.velocity, target.acceleration);
        let time = T::from_u64(tick) * period;
        let refuse = |obstacle, asked, available| Infeasible { tick, time, obstacle, asked, available };
        if !(v.is_finite() && a.is_finite()) {
            return Err(refuse(Obstacle::NotFinite, if v.is_finite() { a } else { v }, T::ZERO));
        }
        if v < -still && !reverses {
            return Err(refuse(Obstacle::Reverse, v, T::ZERO));
        }
        let resting = v.abs() <= still && a.abs() <= still;
        let needed = needed(bounds, v, a);
        let forwards = v >= -still;
        let authority = match (resting, forwards) {
            (true, _) => &at_rest,
            (false, true) => &onwards,
            (false, false) => &back,
        };
        if resting && reverses {
            if needed.high > authority.high {
                return Err(refuse(Obstacle::Hold, needed.high, authority.high));
            }
            if needed.low < authority.low {
                return Err(refuse(Obstacle::Hold, needed.low, authority.low));
            }
        }
        let volts = if resting {
            // Friction gives what a motor need not.
            let holding = envelope.holding_voltage;
            let holding = if reverses { holding.max(limits.0).min(limits.1) } else { holding };
            Interval { low: holding, high: holding }
        } else {
            volts_for(bounds, &needed, forwards)
        };
        let granted = a + (authority.high - needed.high) / bounds.inertia.high;
        if drives.high <= T::ZERO && needed.high > authority.high {
            return Err(refuse(Obstacle::Acceleration, a, granted));
        }
        if volts.high > limits.1 {
            return Err(refuse(Obstacle::Voltage, volts.high, limits.1));
        }
        if volts.low.min(T::ZERO) < limits.0.min(T::ZERO) {
            return Err(refuse(Obstacle::Voltage, volts.low, limits.0));
        }
        if a >= envelope.acceleration {
            envelope.acceleration = a;
            envelope.available_acceleration = granted;
        }
        envelope.deceleration = envelope.deceleration.max(-a);
        envelope.velocity = envelope.velocity.max(v.abs());
        envelope.highest_voltage = envelope.highest_voltage.max(volts.high);
        envelope.lowest_voltage = envelope.lowest_voltage.min(volts.low);
        let step = (v - last_velocity).abs();
        if tick == 0 {
            envelope.start_jump = step;
        } else {
            // Between samples the acceleration may peak a little higher than at them.
            let explained = a.abs().max(last_acceleration.abs()) * period * T::from_f64(1.1);
            let jump = step - explained;
            if jump > still {
                envelope.velocity_jump = envelope.velocity_jump.max(jump);
            }
        }
        (last_velocity, last_acceleration) = (v, a);
    }
    Ok(envelope)
}

/// Torque that a path asks of actuator and friction, over all corners, N m.
fn needed<T: Real>(bounds: &Bounds<T>, velocity: T, acceleration: T) -> Interval<T> {
    let (j, c, drive) = (&bounds.inertia, &bounds.viscous_damping, &bounds.drive_torque);
    let between = |x: &Interval<T>, by: T| {
        let (a, b) = (x.low * by, x.high * by);
        (a.min(b), a.max(b))
    };
    let ((j0, j1), (c0, c1)) = (between(j, acceleration), between(c, velocity));
    Interval { low: j0 + c0 - drive.high, high: j1 + c1 - drive.low }
}

/// Lowest and highest voltage that give a moving shaft a torque of an interval at all corners, V.
fn volts_for<T: Real>(bounds: &Bounds<T>, needed: &Interval<T>, forwards: bool) -> Interval<T> {
    let mu = &bounds.friction;
    let drag = (mu.low * bounds.preload, mu.high * bounds.preload);
    // Against the motion friction of the load takes a share of each volt; where it helps to slow down, no help is counted.
    let driven = |torque: T, slows: bool| {
        let per_volt = if slows { bounds.motor_gain.low } else { bounds.drives_per_volt() };
        if per_volt > T::ZERO { torque / per_volt } else { T::ZERO }
    };
    if bounds.actuator.drives_above_0() {
        let (low, high) = if forwards {
            (needed.low + drag.0, needed.high + drag.1)
        } else {
            (needed.low - drag.1, needed.high - drag.0)
        };
        return Interval {
            low: driven(low.min(T::ZERO), forwards),
            high: driven(high.max(T::ZERO), !forwards),
        };
    }
    let resisted = (-needed.low - drag.0) / bounds.resists_per_volt();
    let driving = driven((needed.high + drag.1).max(T::ZERO), false);
    Interval { low: T::ZERO - driving, high: resisted.max(T::ZERO) }
}

/// Voltage that holds the resting shaft at the worst corner, V.
fn holding_voltage<T: Real>(bounds: &Bounds<T>) -> T {
    let (drive, drag) = (&bounds.drive_torque, bounds.friction_at_rest.low * bounds.preload);
    match bounds.actuator {
        ActuatorKind::Brake | ActuatorKind::Both => {
            let torque = (drive.high - drag).max(T::ZERO);
            torque / (bounds.friction_at_rest.low * bounds.brake_gain.low)
        }
        ActuatorKind::Motor => {
            let half = T::from_f64(0.5);
            -(half * (drive.low + drive.high)) / (half * (bounds.motor_gain.low + bounds.motor_gain.high))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::OutputParams;
    use crate::reference::{Interpolation, JerkLimited, Knot, ReferenceParams, Sine, Table, Trapezoid};
    use crate::{Encoder, FixedCounts, PlantParams, Tolerances};

    const PERIOD: Micros = Micros(1000);

    fn check(
        p: &ReferenceParams<'_>,
        start: f64,
        tolerance: Tolerances,
    ) -> Result<Envelope<f64>, Infeasible<f64>> {
        let path = Reference::new(p, FixedCounts(0), Encoder::PAPER, PERIOD).unwrap();
        let bounds = Bounds::around(&PlantParams::default(), &tolerance).unwrap();
        let output = Output::new(&OutputParams::default(), PERIOD).unwrap();
        check_path(&path, 5000, PERIOD, start, &bounds, &output)
    }

    #[test]
    fn holding_the_papers_shaft_takes_1_68_volts_and_sliding_it_2_24() {
        let e = check(&ReferenceParams::Hold, 0.0, Tolerances::default()).unwrap();
        assert!((e.holding_voltage - 1.681714).abs() < 1e-6);
        assert!((e.highest_voltage - 1.681714).abs() < 1e-6);
        let v = 2.0_f64.to_radians();
        let e = check(&ReferenceParams::ramp(v), v, Tolerances::default()).unwrap();
        assert!((e.highest_voltage - (0.047088 - 0.001 * v) / 0.021).abs() < 1e-9);
        assert_eq!((e.start_jump, e.velocity_jump), (0.0, 0.0));
    }

    #[test]
    fn a_ramp_from_rest_jumps_at_its_start_and_nowhere_else() {
        let v = 2.0_f64.to_radians();
        let e = check(&ReferenceParams::ramp(v), 0.0, Tolerances::default()).unwrap();
        assert_eq!((e.start_jump, e.velocity_jump), (v, 0.0));
    }

    #[test]
    fn straight_lines_between_points_jump_at_each_point_however_dense() {
        // Twice what the weight can do, in knots a millisecond apart, each with acceleration 0.
        let knot = |k: u64| Knot { time_us: k * 1000, position: FixedCounts((k * k) as i64 * 5_790) };
        let knots: std::vec::Vec<Knot> = (0..20).map(knot).collect();
        let table = |interpolation| ReferenceParams::Table(Table { knots: &knots, interpolation });
        let e = check(&table(Interpolation::Linear), 0.0, Tolerances::default()).unwrap();
        assert!(e.velocity_jump > 0.05, "{e:?}");
        let error = check(&table(Interpolation::Cubic), 0.0, Tolerances::default()).unwrap_err();
        assert_eq!(error.obstacle, Obstacle::Acceleration);
    }

    #[test]
    fn a_weight_accelerates_the_shaft_with_27_7_rad_per_s2_and_not_more() {
        let path = |a| ReferenceParams::Trapezoid(Trapezoid { distance: 1.0, speed: 2.0, acceleration: a });
        let e = check(&path(24.0), 0.0, Tolerances::default()).unwrap();
        assert!((e.acceleration - 24.0).abs() < 1e-9 && e.velocity_jump == 0.0);
        let error = check(&path(27.7), 0.0, Tolerances::default()).unwrap_err();
        assert_eq!(error.obstacle, Obstacle::Acceleration);
        assert!(error.tick == 0 && error.available < 27.7);
        // With a weight that may be 10 % lighter, 24.9 rad/s² are left.
        let error = check(&path(25.5), 0.0, Tolerances { drive_torque: 0.1, ..Tolerances::default() });
        assert_eq!(error.unwrap_err().obstacle, Obstacle::Acceleration);
    }

    #[test]
    fn a_brake_drives_nothing_back() {
        let sine = ReferenceParams::Sine(Sine { rate: 0.1, amplitude: 0.02, frequency: 1.0, phase: -0.25 });
        let error = check(&sine, 0.1, Tolerances::default()).unwrap_err();
        assert_eq!(error.obstacle, Obstacle::Reverse);
        // v = 0.1 + 0.1257 sin(2π t) passes 0 at t = 0.5 + asin(0.1/0.12566)/2π.
        let t = 0.5 + libm::asin(0.1 / (0.02 * core::f64::consts::TAU)) / core::f64::consts::TAU;
        assert!((error.time - t).abs() < 2e-3, "{} s instead of {t} s", error.time);
        let slower =
            ReferenceParams::Sine(Sine { rate: 0.13, amplitude: 0.02, frequency: 1.0, phase: -0.25 });
        assert!(check(&slower, 0.13, Tolerances::default()).is_ok());
    }

    fn motor(preload: f64, drive_torque: f64) -> PlantParams {
        let actuator = crate::MotorActuator { gain: 0.05, preload, load_share: 0.0 };
        PlantParams { actuator: actuator.into(), drive_torque, ..PlantParams::default() }
    }

    fn check_motor(
        plant: &PlantParams,
        p: &ReferenceParams<'_>,
        tolerance: Tolerances,
        limits: (f64, f64),
    ) -> Result<Envelope<f64>, Infeasible<f64>> {
        let path = Reference::new(p, FixedCounts(0), Encoder::PAPER, PERIOD).unwrap();
        let bounds = Bounds::around(plant, &tolerance).unwrap();
        let output =
            OutputParams { lowest: limits.0, highest: limits.1, on_invalid: 0.0, bumpless_time: 0.0 };
        check_path(&path, 5000, PERIOD, 0.0, &bounds, &Output::new(&output, PERIOD).unwrap())
    }

    #[test]
    fn a_motor_goes_both_ways_with_the_voltages_that_inertia_and_friction_take() {
        let path = ReferenceParams::Trapezoid(Trapezoid { distance: -1.0, speed: 1.0, acceleration: 20.0 });
        let e = check_motor(&motor(0.25, 0.0), &path, Tolerances::default(), (-10.0, 10.0)).unwrap();
        // J a + μ_max N_0 to accelerate backwards, with the drag of 1 rad/s at the end of it.
        let most = (0.0017 * 20.0 + 0.2 * 0.25 + 0.001) / 0.05;
        assert!((e.lowest_voltage + most).abs() < 0.02, "{} V instead of {} V", e.lowest_voltage, -most);
        assert!((e.velocity - 1.0).abs() < 1e-9);
        let short = check_motor(&motor(0.25, 0.0), &path, Tolerances::default(), (-1.5, 10.0));
        assert_eq!(short.unwrap_err().obstacle, Obstacle::Voltage);
    }

    #[test]
    fn a_motor_at_rest_is_helped_by_friction_and_held_to_the_worst_corner() {
        let hold = ReferenceParams::Hold;
        // 0.4 N m on friction of 0.5 N m and 2 V of 0.05 N m/V.
        let limits = (-2.0, 2.0);
        assert!(check_motor(&motor(2.5, 0.4), &hold, Tolerances::default(), limits).is_ok());
        // −0.09 N m ± 50 % on a motor that may give 0.07 N m only.
        let loose = Tolerances { drive_torque: 0.5, motor_gain: 0.3, ..Tolerances::default() };
        let error = check_motor(&motor(0.0, -0.09), &hold, loose, limits).unwrap_err();
        assert_eq!(error.obstacle, Obstacle::Hold);
        assert!((error.asked - 0.135).abs() < 1e-12 && (error.available - 0.07).abs() < 1e-12, "{error:?}");
    }

    #[test]
    fn deceleration_costs_voltage_at_the_weakest_brake() {
        let path = |a| {
            ReferenceParams::JerkLimited(JerkLimited {
                distance: 1.0,
                speed: 1.0,
                acceleration: a,
                jerk: 1000.0,
            })
        };
        let e = check(&path(10.0), 0.0, Tolerances::default()).unwrap();
        let at_peak = (0.047088 + 0.0017 * 10.0) / 0.021;
        assert!((e.highest_voltage - at_peak).abs() < 0.05, "{} V instead of {at_peak} V", e.highest_voltage);
        let loose = Tolerances { friction: 0.5, brake_gain: 0.5, ..Tolerances::default() };
        assert_eq!(check(&path(10.0), 0.0, loose).unwrap_err().obstacle, Obstacle::Voltage);
    }

    #[test]
    fn each_obstacle_says_where_and_by_how_much() {
        let told = |obstacle| {
            let text = Infeasible { tick: 7, time: 0.007, obstacle, asked: -2.0, available: 1.5 };
            let text = std::format!("{text}");
            let at = "the path cannot be followed from t = 0.007 s (tick 7) on: ";
            text.strip_prefix(at).map(std::string::ToString::to_string).unwrap()
        };
        assert_eq!(told(Obstacle::Reverse), "it runs backwards at -2 rad/s, and a brake drives nothing");
        let acceleration = "it accelerates at -2 rad/s², and the drive grants 1.5 rad/s²";
        assert_eq!(told(Obstacle::Acceleration), acceleration);
        assert_eq!(told(Obstacle::Voltage), "it needs -2 V, and the output ends at 1.5 V");
        let hold = "at rest it needs -2 N m, and motor and friction give 1.5 N m";
        assert_eq!(told(Obstacle::Hold), hold);
        assert_eq!(told(Obstacle::NotFinite), "its velocity or acceleration is not a number there");
    }

    #[test]
    fn a_load_that_a_motor_cannot_hold_is_refused_from_either_side() {
        // 0.2 N m forwards on 2 V of 0.05 N m/V without friction.
        let error = check_motor(&motor(0.0, 0.2), &ReferenceParams::Hold, Tolerances::default(), (-2.0, 2.0));
        let error = error.unwrap_err();
        assert_eq!(error.obstacle, Obstacle::Hold);
        assert!((error.asked + 0.2).abs() < 1e-12 && (error.available + 0.1).abs() < 1e-12, "{error:?}");
    }

    #[test]
    fn the_largest_acceleration_is_that_of_either_sign() {
        for (acceleration, deceleration) in [(3.0, 2.0), (1.0, 3.0)] {
            let e = Envelope { acceleration, deceleration, ..Envelope::<f64>::default() };
            assert_eq!(e.largest_acceleration(), 3.0);
        }
    }

    #[test]
    fn a_brake_with_a_motor_is_asked_for_volts_of_both_signs() {
        let actuator = crate::BothActuator { brake_gain: 0.14, motor_gain: 0.05, preload: 0.0 };
        let plant = PlantParams { actuator: actuator.into(), drive_torque: 0.0, ..PlantParams::default() };
        let path = ReferenceParams::Trapezoid(Trapezoid { distance: 1.0, speed: 1.0, acceleration: 10.0 });
        let e = check_motor(&plant, &path, Tolerances::default(), (-10.0, 10.0)).unwrap();
        // J a + C_d θ̇ of the motor to accelerate, and J a of the brake to stop.
        assert!((e.lowest_voltage + (0.0017 * 10.0 + 0.001) / 0.05).abs() < 0.02, "{} V", e.lowest_voltage);
        assert!((e.highest_voltage - 0.0017 * 10.0 / 0.021).abs() < 0.02, "{} V", e.highest_voltage);
        let brake = check_motor(&plant, &path, Tolerances::default(), (-0.2, 10.0)).unwrap_err();
        assert_eq!(brake.obstacle, Obstacle::Voltage);
    }

    #[test]
    fn friction_helps_a_motor_to_slow_the_shaft_down() {
        let path = ReferenceParams::Trapezoid(Trapezoid { distance: 1.0, speed: 1.0, acceleration: 20.0 });
        let e = check_motor(&motor(0.1, 0.0), &path, Tolerances::default(), (-10.0, 10.0)).unwrap();
        // J a less the least friction μ_d N_0; the drag of 1 rad/s is gone at the end.
        let least = (0.0017 * 20.0 - 0.15 * 0.1) / 0.05;
        assert!((e.lowest_voltage + least).abs() < 0.03, "{} V instead of {} V", e.lowest_voltage, -least);
        let most = (0.0017 * 20.0 + 0.2 * 0.1 + 0.001) / 0.05;
        assert!((e.highest_voltage - most).abs() < 0.03, "{} V instead of {most} V", e.highest_voltage);
    }
}
