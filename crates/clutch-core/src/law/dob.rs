//! Proportional–derivative control with a disturbance observer.
//!
//! ```text
//! T(u) = J (θ̈_d + K_d ė + K_p e) + d̂
//! d̂ = Q(s) [T(u) − J θ̈],     Q(s) = g/(s + g)
//! ```
//!
//! `T(u)` is the torque of a voltage as the model has it: what drives, less friction at the speed of a sliding shaft. The
//! difference from the model's inertia, friction and load is a disturbance; the observer (Ohnishi, Shibata and Murakami 1996)
//! finds it from voltage and velocity, and the law adds it to its demand. Neither load nor friction has to be known.
//!
//! The observer gets the voltage that went out, so that a limit winds nothing up. A run begins with the disturbance at
//! which the law demands the voltage that the brake has.

use super::{Beside, Command, ControlLaw, Damping, Listed, Output, OutputState, Seen, Tick};
use crate::friction::FrictionModel;
use crate::params::{Range, Table};
use crate::{Arithmetic, Each, ParamError, Plant, Real};

crate::params! {
    /// Proportional–derivative control with a disturbance observer: whatever torque the model does not explain is found from
    /// voltage and velocity, and given back.
    ///
    /// `T(u) = J (θ̈_d + K_d ė + K_p e) + d̂`, `d̂ = g/(s + g) [T(u) − J θ̈]` with inertia and `T(u)`, friction of a sliding
    /// shaft included, as `Model` has them. A start is bumpless, and nothing winds up at a limit.
    pub struct DobParams<T>: Default {
        /// Gain from position to acceleration.
        kp: T = 10000.0, "kp_1_s2" "K_p" PER_S2, Range::at_least(0.0);
        /// Gain from velocity to acceleration.
        kd: T = 250.0, "kd_1_s" "K_d" PER_S, Range::at_least(0.0);
        /// Bandwidth of the observer. Delay and the velocity's filter bound it from above.
        bandwidth: T = 33.0, "bandwidth_rad_s" "g" RAD_S, Range::above(0.0);
    }
}

/// The law, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dob<T> {
    params: DobParams<T>,
    plant: Plant<T>,
    /// `μ` of a sliding shaft.
    mu: T,
    /// Share of a new disturbance in the observed one.
    newest: T,
    /// `J/T`: torque for a change of the velocity in a period, N m s/rad.
    per_change: T,
    output: Output<T>,
}

/// Memory of the law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DobState<T> {
    /// `d̂`, N m.
    disturbance: T,
    /// Velocity one period ago, rad/s.
    velocity: T,
    /// Voltage since then, V.
    applied: T,
    output: OutputState<T>,
}

super::list::selected! { DobState: disturbance velocity applied }

impl<T: Real> Dob<T> {
    /// Checks gains, the plant that the law believes in, and output stage.
    ///
    /// # Errors
    /// The first parameter out of range; with a brake, a friction that can be 0, by which the law divides.
    pub fn new(p: &DobParams<T>, beside: &Beside<'_, T>) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let seconds = beside.period.period::<T>()?;
        let plant = Plant::new(beside.model)?;
        plant.check_solvable()?;
        Ok(Dob {
            params: *p,
            mu: plant.friction().sliding(),
            newest: T::ONE - (-(p.bandwidth * seconds)).exp(),
            per_change: beside.model.inertia / seconds,
            plant,
            output: Output::new(beside.output, beside.period)?,
        })
    }
}

impl<T: Arithmetic> Dob<T> {
    /// The laws of several lanes as one; none if actuators or frictions that they believe in are not of one kind.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> Option<Dob<L>> {
        let params = DobParams {
            kp: each(&|law| law.params.kp),
            kd: each(&|law| law.params.kd),
            bandwidth: each(&|law| law.params.bandwidth),
        };
        Some(Dob {
            params,
            plant: Plant::in_lanes(&|get| each(&|law| get(&law.plant)))?,
            mu: each(&|law| law.mu),
            newest: each(&|law| law.newest),
            per_change: each(&|law| law.per_change),
            output: Output::in_lanes(&|get| each(&|law| get(&law.output))),
        })
    }

    /// `T(u)` of a shaft that goes a way, N m.
    // Always, where lanes call it: a vector's instructions do not pass a call. For boards the compiler chooses.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn torque(&self, volts: T, way: T) -> T {
        let actuator = self.plant.actuator();
        actuator.torque(volts) - way * actuator.friction(self.mu, volts)
    }

    /// `J (θ̈_d + K_d ė + K_p e)`, N m.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn tracking(&self, tick: &Tick<T>) -> T {
        let p = &self.params;
        let acceleration = tick.target_acceleration + (p.kd * tick.error_rate + p.kp * tick.error);
        self.plant.params().inertia * acceleration
    }
}

impl<T: Arithmetic> ControlLaw<T> for Dob<T> {
    type State = DobState<T>;
    type Terms = [T; 2];
    const TERMS: &'static [&'static str] = &["tracking_nm", "disturbance_nm"];

    fn start(&self, tick: &Tick<T>, applied: T) -> DobState<T> {
        let (tracking, way) = (self.tracking(tick), self.plant.actuator().way(tick.target_velocity));
        let disturbance = self.torque(applied, way) - tracking;
        let disturbance = T::select(disturbance.is_finite(), disturbance, T::ZERO);
        let demand = self.plant.actuator().volts_for(tracking + disturbance, self.mu, way);
        DobState { disturbance, velocity: tick.velocity(), applied, output: self.output.start(demand, applied) }
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn sees(&self, state: &mut DobState<T>, seen: impl FnOnce() -> Seen<T>) {
        state.applied = seen().applied;
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn update(&self, state: &mut DobState<T>, tick: &Tick<T>) -> Command<T, [T; 2]> {
        let (tracking, way) = (self.tracking(tick), self.plant.actuator().way(tick.target_velocity));
        let disturbance = state.disturbance;
        let demand = self.plant.actuator().volts_for(tracking + disturbance, self.mu, way);
        let (voltage, limit) = self.output.apply(&mut state.output, demand);
        // After the demand: a start is bumpless so, and a bandwidth far below 1/T does not feel the period.
        let velocity = tick.velocity();
        let found = self.torque(state.applied, way) - self.per_change * (velocity - state.velocity);
        let next = disturbance + self.newest * (found - disturbance);
        T::put_where(next.is_finite(), &mut state.disturbance, || {
            // No more than the output can answer.
            let ends = (self.torque(self.output.lowest(), way), self.torque(self.output.highest(), way));
            next.limit(ends.0.min(ends.1), ends.0.max(ends.1))
        });
        T::put_where(velocity.is_finite(), &mut state.velocity, || velocity);
        Command { voltage, limit, terms: [tracking, disturbance] }
    }
}

impl<T: Real> Listed<T> for Dob<T> {
    type Params = DobParams<T>;
    const TITLE: &'static str = "PD with a disturbance observer";

    fn build(p: &DobParams<T>, beside: &Beside<'_, T>) -> Result<Self, ParamError<T>> {
        Dob::new(p, beside)
    }

    fn output(&self) -> &Output<T> {
        &self.output
    }

    fn damping(p: &DobParams<T>) -> Option<Damping<T>> {
        // Of the observer's bandwidth, too: together they are PID's.
        Some(Damping::Acceleration(p.kd + p.bandwidth))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::{Limit, OutputParams, Pid, PidParams};
    use crate::{MotorActuator, PlantParams};

    /// `μ_d K_COF` of Table 1, N m/V.
    const PER_VOLT: f64 = 0.15 * 0.14;

    fn dob(p: DobParams) -> Dob<f64> {
        Dob::new(&p, &Beside::paper(&PlantParams::default(), &OutputParams::default())).unwrap()
    }

    fn told(law: &Dob<f64>, state: &mut DobState<f64>, tick: &Tick<f64>, applied: f64) -> Command<f64, [f64; 2]> {
        law.sees(state, || Seen { applied, ..Seen::default() });
        law.update(state, tick)
    }

    #[test]
    fn a_disturbance_is_found_with_the_time_constant_of_the_bandwidth() {
        let law = dob(DobParams { kp: 0.0, kd: 0.0, bandwidth: 50.0 });
        // 3 V on a shaft that keeps its speed: what drives it is 63 mN m.
        let tick = Tick { target_velocity: 0.03, ..Tick::default() };
        let mut state = law.start(&tick, 0.0);
        for n in 1..100 {
            told(&law, &mut state, &tick, 3.0);
            let found = -3.0 * PER_VOLT * (1.0 - (-0.05 * f64::from(n)).exp());
            assert!((state.disturbance - found).abs() < 1e-12, "tick {n}");
        }
    }

    #[test]
    fn a_shaft_that_is_faster_by_the_voltage_is_not_disturbed() {
        let law = dob(DobParams { bandwidth: 50.0, ..DobParams::default() });
        let mut tick = Tick { target_velocity: 3.0, ..Tick::default() };
        let mut state = law.start(&tick, 0.0);
        // 1 V brakes Table 1's shaft by 12.35 rad/s².
        for _ in 0..100 {
            tick.error_rate += PER_VOLT / 0.0017 * 1e-3;
            told(&law, &mut state, &tick, 1.0);
            assert!(state.disturbance.abs() < 1e-12, "{} N m", state.disturbance);
        }
    }

    /// Error after `seconds` of a sliding shaft held in place under a load and with a grip that the law does not know, rad.
    fn held(p: DobParams, seconds: f64) -> f64 {
        let law = dob(p);
        let (mut position, mut velocity, mut applied) = (0.0_f64, 0.0_f64, 0.0);
        let mut state = law.start(&Tick::default(), applied);
        for _ in 0..(seconds * 1e3) as u32 {
            let tick = Tick { error: -position, error_rate: -velocity, ..Tick::default() };
            applied = told(&law, &mut state, &tick, applied).voltage;
            velocity += (0.06 - 0.7 * PER_VOLT * applied - 0.001 * velocity) / 0.0017 * 1e-3;
            position += velocity * 1e-3;
        }
        -position
    }

    #[test]
    fn a_load_and_a_friction_that_nobody_told_leave_no_error() {
        let p = DobParams::default();
        let slow = held(DobParams { bandwidth: 1e-9, ..p }, 3.0);
        // PD alone: load over grip and K_p J.
        let offset = -0.06 / 0.7 / (p.kp * 0.0017);
        assert!((slow / offset - 1.0).abs() < 1e-3, "{slow} and {offset} rad");
        assert!(held(p, 3.0).abs() < 1e-6 * offset.abs(), "{} rad", held(p, 3.0));
    }

    #[test]
    fn away_from_limits_it_is_a_pid_of_other_gains() {
        let own = DobParams { bandwidth: 20.0, ..DobParams::default() };
        let DobParams { kp, kd, bandwidth: g } = own;
        let volts = 0.0017 / PER_VOLT;
        let p = PidParams {
            kp: volts * (kp + g * kd),
            ki: volts * g * kp,
            kd: volts * (kd + g),
            acceleration: volts,
            ..PidParams::default()
        };
        let (model, output) = (PlantParams::default(), OutputParams::default());
        let (one, other) = (dob(own), Pid::build(&p, &Beside::paper(&model, &output)).unwrap());
        let path = |k: u32| f64::from(k) * 0.02;
        let tick = |k| Tick {
            error: 2e-4 * path(k).sin(),
            error_rate: 4e-3 * path(k).cos(),
            target_velocity: 0.5,
            target_acceleration: 0.0,
        };
        let (mut a, mut b) = (one.start(&tick(0), 5.0), other.start(&tick(0), 5.0));
        let (mut applied, mut span, mut apart) = (5.0, (10.0_f64, 0.0_f64), 0.0_f64);
        for k in 0..1000 {
            applied = told(&one, &mut a, &tick(k), applied).voltage;
            let volts = other.update(&mut b, &tick(k)).voltage;
            span = (span.0.min(volts), span.1.max(volts));
            apart = apart.max((applied - volts).abs());
        }
        // The observer answers a period later.
        assert!(apart < 0.03 * (span.1 - span.0), "{apart} V of {span:?}");
    }

    #[test]
    fn a_long_time_at_a_limit_winds_nothing_up() {
        let law = dob(DobParams::default());
        let behind = Tick { error: 0.5, ..Tick::default() };
        let mut state = law.start(&Tick::default(), 2.25);
        for _ in 0..10_000 {
            assert_eq!(told(&law, &mut state, &behind, 0.0).limit, Limit::Lowest);
        }
        // A shaft that rests without a voltage: nothing drives it, as far as one sees.
        assert!(state.disturbance.abs() < 1e-6);
        let volts = told(&law, &mut state, &Tick { error: -2e-3, ..Tick::default() }, 0.0).voltage;
        let expected = 2e-3 * DobParams::<f64>::default().kp * 0.0017 / PER_VOLT;
        assert!((volts - expected).abs() < 1e-3, "{volts} and {expected} V");
    }

    #[test]
    fn a_start_takes_over_the_voltage_that_the_brake_has() {
        let tick = Tick { error: 1e-4, error_rate: 0.01, target_velocity: 0.03, target_acceleration: 0.5 };
        let law = dob(DobParams::default());
        let mut state = law.start(&tick, 2.25);
        assert!((told(&law, &mut state, &tick, 2.25).voltage - 2.25).abs() < 1e-12);
    }

    #[test]
    fn a_motor_gives_back_its_friction_the_way_that_the_path_goes() {
        let actuator = MotorActuator { gain: 0.05, preload: 0.25, load_share: 0.2 };
        let model = PlantParams { actuator: actuator.into(), drive_torque: 0.0, ..PlantParams::default() };
        let output = OutputParams { lowest: -10.0, on_invalid: 0.0, ..OutputParams::default() };
        let law = Dob::<f64>::new(&DobParams::default(), &Beside::paper(&model, &output)).unwrap();
        for way in [1.0, -1.0] {
            // 37.5 mN m of friction, and 3 % of the torque more.
            let path = Tick { target_velocity: 0.03 * way, ..Tick::default() };
            let mut state = DobState::default();
            let volts = law.update(&mut state, &path).voltage;
            assert!((volts - way * 0.0375 / (0.05 * 0.97)).abs() < 1e-12, "{volts} V");
            // This voltage moves it, and nothing else does.
            told(&law, &mut state, &path, volts);
            let mut state = DobState { velocity: path.velocity(), ..DobState::default() };
            told(&law, &mut state, &path, volts);
            assert!(state.disturbance.abs() < 1e-12, "{} N m", state.disturbance);
        }
    }

    #[test]
    fn a_measurement_that_is_no_number_spoils_one_tick() {
        let law = dob(DobParams::default());
        let mut state = law.start(&Tick::default(), 3.0);
        let bad = Tick { error: f64::NAN, error_rate: f64::NAN, ..Tick::default() };
        assert_eq!(told(&law, &mut state, &bad, 3.0).limit, Limit::Invalid);
        assert!((told(&law, &mut state, &Tick::default(), 3.0).voltage - 3.0).abs() < 1e-12);
        assert_eq!(law.start(&bad, 3.0).disturbance, 0.0);
    }

    #[test]
    fn a_brake_without_friction_is_refused() {
        let friction = crate::StribeckParams { mu_static: 0.2, mu_dynamic: 0.0, ..crate::StribeckParams::default() };
        let model = PlantParams { friction: friction.into(), ..PlantParams::default() };
        assert!(Dob::<f64>::new(&DobParams::default(), &Beside::paper(&model, &OutputParams::default())).is_err());
        let p = DobParams { bandwidth: 0.0, ..DobParams::default() };
        let e = Dob::<f64>::new(&p, &Beside::paper(&PlantParams::default(), &OutputParams::default())).unwrap_err();
        assert_eq!(e.field(), "bandwidth");
    }
}
