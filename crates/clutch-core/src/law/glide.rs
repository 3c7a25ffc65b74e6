//! Glide: friction inverted where an edge-timed filter believes it to be, around a cascade of position and velocity.
//!
//! ```text
//! ω_c = θ̇_d + K_p ẽ, not below the share `floor` of θ̇_d and not above `cap` times it
//! T_a = J (K_d (ω_c − ω̂) + θ̈_d) + C_d ω̂ − T_u,     u: T(u) − μ̂ N(u) sgn θ̇_d = T_a
//! ```
//!
//! `ẽ`, `ω̂` and `μ̂` are those of the [`EdgeTimed`] filter, carried on to the time at which the voltage takes effect. The floor is
//! what keeps a slow shaft smooth: a law that brakes a shaft below it to let the path catch up has it stick, and a stuck
//! shaft says nothing. A shaft that rests is let go, which needs no knowledge of friction; up to
//! the first edge it is then held with less than the believed friction asks for, `optimism` standard deviations: too
//! little voltage costs an overshoot of parts of a count, too much a stick.

use super::micro_step::{MicroStep, MicroStepState, Stepping};
use super::{Beside, Command, ControlLaw, Damping, Limit, Listed, Output, OutputState, Seen, Tick};
use crate::edge_timed::{BesideMap, BesideMapState, EdgeTimedParams, friction_at};
use crate::friction::FrictionModel;
use crate::params::{Range, Table};
use crate::{ActuatorKind, FixedCounts, ParamError, Plant, Real};

crate::params! {
    /// Glide: smooth motion far below the rates at which laws on a difference of counts stick. Friction is inverted where
    /// an edge-timed filter believes it to be, which learns it on the way; one set of gains for all rates.
    ///
    /// `ω_c = θ̇_d + K_p ẽ` between `floor` and `cap` times `θ̇_d`; the voltage gives `θ̈ = K_d (ω_c − ω̂) + θ̈_d` with the
    /// friction of the filter, and drive torque, inertia, damping and actuator of `Model`.
    pub struct GlideParams<T>: Default {
        /// Gain from position to velocity.
        kp: T = 40.0, "kp_1_s" "K_p" PER_S, Range::at_least(0.0);
        /// Gain from velocity to acceleration.
        kd: T = 150.0, "kd_1_s" "K_d" PER_S, Range::above(0.0);
        /// Least velocity that the law asks for, as a share of the path's.
        floor: T = 0.5, "floor" "" NONE, Range::within(0.0, 1.0);
        /// Highest velocity that the law asks for, as a multiple of the path's.
        cap: T = 3.0, "cap" "" NONE, Range::at_least(1.0);
        /// Standard deviations by which friction is taken to be higher than believed, from a rest to the first edge.
        optimism: T = 1.0, "optimism" "" NONE, Range::at_least(0.0).up_to(10.0);
        /// Rate of the path below which the shaft goes in micro-steps, between which it rests; 0 takes none.
        micro: T = 0.0, "micro_below_deg_s" "" DEG_S, Range::at_least(0.0);
    }
    nested {
        /// Filter of velocity and friction.
        filter: EdgeTimedParams<T>, "filter";
    }
    relations(p) {
        /// A shaft at the floor is not taken to rest.
        SEEN_AT_FLOOR: floor, "a share above 1/filter.silence_counts, so that a shaft at the floor is not taken to rest" =>
            p.floor * p.filter.silence > T::ONE;
        /// A brake that lags lets go for too long.
        STEPS_ARE_SMALL: micro, "0 with a filter.lag_s above 0.0005 s, under which micro-steps are no longer small" =>
            p.micro == T::ZERO || p.filter.lag <= T::from_f64(Self::MOST_LAG_OF_STEPS);
    }
}

impl<T> GlideParams<T> {
    /// Longest lag of an actuator under which micro-steps are taken, s: with 0.5 ms they have 0.012°, with 3 ms 0.069°.
    pub const MOST_LAG_OF_STEPS: f64 = 5e-4;
}

/// The law, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glide<T> {
    params: GlideParams<T>,
    /// Gains per period.
    kp: T,
    kd: T,
    filters: BesideMap<T>,
    plant: Plant<T>,
    steps: MicroStep<T>,
    /// Torque for an acceleration, N m per count per period².
    torque: T,
    /// Counts per period² of an acceleration in rad/s².
    acceleration: T,
    output: Output<T>,
}

/// Memory of the law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GlideState<T> {
    filters: BesideMapState<T>,
    /// The sample that the filters see in the next period.
    seen: Seen<T>,
    /// 1 once the filters have begun, else 0.
    begun: T,
    steps: MicroStepState<T>,
    /// Counts that the shaft was to gain on the path in the last period.
    gains: T,
    output: OutputState<T>,
}

/// Share of the believed friction with which a resting shaft is held.
const HELD: f64 = 0.5;
/// Share of the velocity that is asked for with which an edge is waited for behind a rest.
const HURRIED: f64 = 0.7;
/// Multiple of the believed friction at rest with which a motor starts.
const PUSHED: f64 = 1.1;

impl<T: Real> Glide<T> {
    /// Checks gains, filter, the plant that the law believes in, and output stage.
    ///
    /// # Errors
    /// The first parameter out of range; with a brake, a friction that can be 0, by which the law divides.
    #[inline(never)]
    pub fn new(p: &GlideParams<T>, beside: &Beside<'_, T>) -> Result<Self, ParamError<T>> {
        // Before what relates its rows to others: an error names the one that is wrong by itself.
        p.filter.check_rows()?;
        p.check_rows()?;
        let seconds = beside.period.period::<T>()?;
        let plant = Plant::new(beside.model)?;
        plant.check_solvable()?;
        let filters = BesideMap::new(&p.filter, &plant, beside.encoder, beside.period)?;
        let acceleration = seconds * seconds * filters.plain().counts_per_radian();
        let mut law = Glide {
            params: *p,
            kp: p.kp * seconds,
            kd: p.kd * seconds,
            steps: MicroStep::default(),
            filters,
            torque: beside.model.inertia / acceleration,
            acceleration,
            plant,
            output: Output::new(beside.output, beside.period)?,
        };
        law.steps = law.steps_of(p);
        Ok(law)
    }

    /// Micro-steps of the shaft that the law believes in.
    fn steps_of(&self, p: &GlideParams<T>) -> MicroStep<T> {
        let filter = self.filters.plain();
        let only = match self.plant.actuator().kind() {
            ActuatorKind::Brake => self.plant.params().drive_torque.sgn(),
            ActuatorKind::Motor | ActuatorKind::Both => T::ZERO,
        };
        let way = if only == T::ZERO { T::ONE } else { only };
        let (pull, load) = filter.forces(self.stepping(Stepping::first(way)));
        let go = way * pull - load;
        let (pull, load) = filter.forces(self.stepping(Stepping::Hold));
        MicroStep::new(filter.per_period(p.micro), (go, load - way * pull), only, (filter.delay(), filter.lag()))
    }

    /// Voltage of a period in which the shaft goes in steps, V.
    fn stepping(&self, demand: Stepping<T>) -> T {
        match (self.plant.actuator().kind(), demand) {
            (ActuatorKind::Brake, Stepping::Go(_)) => self.output.lowest(),
            (ActuatorKind::Motor | ActuatorKind::Both, Stepping::Go(push)) => {
                let at_rest = push.abs() * self.plant.friction().at_rest() / self.filters.plain().mu();
                self.volts(T::ZERO, at_rest, push.sgn())
            }
            (ActuatorKind::Brake | ActuatorKind::Both, Stepping::Hold) => self.output.highest(),
            (ActuatorKind::Motor, Stepping::Hold) => self.volts(T::ZERO, T::ZERO, T::ZERO),
        }
    }

    /// Demand of a period in which the shaft goes in steps, V, and terms.
    #[inline(never)]
    fn step(&self, state: &mut GlideState<T>, tick: &Tick<T>, begun: bool) -> Command<T, [T; 7]> {
        let filter = self.filters.plain();
        let Seen { position, applied, ref place } = state.seen;
        if !begun {
            self.filters.start_in(&mut state.filters, position, applied, tick.target_velocity);
        }
        let pace = filter.per_period(tick.target_velocity);
        if !state.steps.active() {
            let (driving, belief, here) = self.filters.driving(&state.filters);
            let ahead = driving.ahead_on(belief, here).position;
            state.steps.begin(ahead, filter.delay());
        }
        let moved = self.filters.stand_aside(&mut state.filters, (position, place), applied);
        let (_, belief, place) = self.filters.driving(&state.filters);
        let from_edge = tick.error * filter.counts_per_radian() + belief.fraction();
        let target = from_edge + filter.delay() * pace;
        let demand = self.stepping(self.steps.demand(&mut state.steps, moved, target, pace));
        let error = target - state.steps.position();
        let (friction, variance) = belief.friction();
        let mu = filter.mu() * friction_at(place, state.steps.position());
        let terms = [
            T::ZERO,
            mu * friction,
            mu * mu * variance,
            error * filter.radians_per_count(),
            tick.target_velocity,
            T::from_i32(3),
            state.filters.part(),
        ];
        Command { voltage: demand, limit: Limit::None, terms }
    }

    /// Voltage for a torque on a shaft that goes a way, with a multiple of the model's friction, V.
    fn volts(&self, torque: T, friction: T, way: T) -> T {
        let mu = self.filters.plain().mu() * friction;
        self.plant.actuator().volts_for(torque - self.plant.params().drive_torque, mu, way)
    }

    /// Voltage that lets a shaft at rest go, V.
    fn letting_go(&self, pace: T, friction: T, way: T) -> T {
        if self.plant.actuator().kind() == ActuatorKind::Brake {
            return self.output.lowest();
        }
        let at_rest = T::splat(PUSHED) * friction * self.plant.friction().at_rest() / self.filters.plain().mu();
        let still = way * self.volts(T::ZERO, at_rest, way);
        let moved = way * self.volts(self.torque * pace, friction, way);
        // An actuator that resists above 0 V drives below it.
        let drives = if self.plant.actuator().kind().drives_above_0() { still.max(moved) } else { still.min(moved) };
        way * drives
    }

    /// Voltage that holds a shaft at rest, V.
    fn holding(&self, friction: T) -> T {
        match self.plant.actuator().kind() {
            ActuatorKind::Motor => self.volts(T::ZERO, T::ZERO, T::ZERO),
            ActuatorKind::Brake | ActuatorKind::Both => self.volts(T::ZERO, T::splat(HELD) * friction, T::ONE),
        }
    }

    /// Demand of a period in which the shaft slides, V, and terms.
    #[inline(never)]
    fn slide(&self, state: &mut GlideState<T>, tick: &Tick<T>, begun: bool) -> Command<T, [T; 7]> {
        let Seen { position, applied, ref place } = state.seen;
        let filters = &mut state.filters;
        if begun {
            if state.steps.active() {
                self.leave_steps(&mut state.steps, filters);
            }
            self.filters.update(filters, (position, place), applied, (tick.target_velocity, state.gains));
        } else {
            self.filters.start_in(filters, position, applied, tick.target_velocity);
        }
        self.demand(filters, &mut state.gains, tick)
    }

    /// Steps have ended where they have: the filters go on from there.
    #[cold]
    #[inline(never)]
    fn leave_steps(&self, steps: &mut MicroStepState<T>, filters: &mut BesideMapState<T>) {
        steps.end();
        self.filters.take_over(filters, steps.position(), self.steps.friction(steps));
    }

    /// Demand of a period, V, and terms.
    #[inline(never)]
    fn demand(&self, filters: &mut BesideMapState<T>, gains: &mut T, tick: &Tick<T>) -> Command<T, [T; 7]> {
        let (filter, belief, place) = self.filters.driving(filters);
        let ahead = filter.ahead_on(belief, place);
        let pace = filter.per_period(tick.target_velocity);
        let (way, fast) = (pace.sgn(), pace.abs());
        let from_edge = tick.error * filter.counts_per_radian() + belief.fraction();
        let error = from_edge + filter.delay() * pace - ahead.position;
        // A shaft at rest waits until the path is about to leave its count.
        let half = T::splat(0.5);
        if belief.rests() && fast > T::ZERO && way * error + filter.patience() * fast > half {
            self.filters.let_go(filters, tick.target_velocity);
        }
        let belief = filters.driving();
        let p = &self.params;
        let wanted = way * (fast + self.kp * way * error).limit(p.floor * fast, p.cap * fast);
        // A shaft that has just rested may soon do so again, and is missed the more the farther it is behind.
        let hurried = T::splat(HURRIED) * wanted.abs() - fast;
        *gains = if belief.has_rested() { hurried.max(T::ZERO) } else { T::ZERO };
        let friction = if belief.starts() {
            ahead.friction + p.optimism * ahead.variance.sqrt()
        } else {
            ahead.friction
        };
        let demand = if belief.lets_go() {
            self.letting_go(pace, ahead.friction, way)
        } else if belief.rests() || (way == T::ZERO && ahead.velocity == T::ZERO) {
            self.holding(ahead.friction)
        } else {
            let acceleration = self.kd * (wanted - ahead.velocity) + self.acceleration * tick.target_acceleration;
            let damping = self.plant.params().viscous_damping * filter.rad_per_s(ahead.velocity);
            let going = if way == T::ZERO { ahead.velocity.sgn() } else { way };
            let shape = filter.shape(T::splat(0.5) * (ahead.velocity + wanted));
            let volts = self.volts(self.torque * acceleration + damping, friction * shape, going);
            filter.through_lag(volts, ahead.pad)
        };
        let mu = filter.mu();
        let phase = T::from_i32(i32::from(belief.starts()) + i32::from(belief.rests()));
        let terms = [
            filter.rad_per_s(belief.velocity()),
            mu * ahead.friction,
            mu * mu * ahead.variance,
            error * filter.radians_per_count(),
            filter.rad_per_s(wanted),
            phase,
            filters.part(),
        ];
        Command { voltage: demand, limit: Limit::None, terms }
    }
}

impl<T: Real> ControlLaw<T> for Glide<T> {
    type State = GlideState<T>;
    type Terms = [T; 7];
    const TERMS: &'static [&'static str] =
        &["velocity_rad_s", "mu", "mu_variance", "error_ahead_rad", "wanted_velocity_rad_s", "phase", "map"];

    fn start(&self, tick: &Tick<T>, applied: T) -> GlideState<T> {
        // The first period's demand does not depend on where the shaft is.
        let mut filters = self.filters.start(FixedCounts(0), applied, tick.target_velocity);
        let demand = self.demand(&mut filters, &mut T::default(), tick).voltage;
        let seen = Seen { applied, ..Seen::default() };
        GlideState { seen, output: self.output.start(demand, applied), ..GlideState::default() }
    }

    fn sees(&self, state: &mut GlideState<T>, seen: impl FnOnce() -> Seen<T>) {
        state.seen = seen();
    }

    #[inline(never)] // by itself a board's bound counts a step or a slide, and no other law's frame grows
    fn update(&self, state: &mut GlideState<T>, tick: &Tick<T>) -> Command<T, [T; 7]> {
        let begun = core::mem::replace(&mut state.begun, T::ONE) > T::ZERO;
        let pace = self.filters.plain().per_period(tick.target_velocity);
        let mut command = if self.steps.takes(&state.steps, pace) {
            self.step(state, tick, begun)
        } else {
            self.slide(state, tick, begun)
        };
        (command.voltage, command.limit) = self.output.apply(&mut state.output, command.voltage);
        command
    }
}

impl<T: Real> Listed<T> for Glide<T> {
    type Params = GlideParams<T>;
    const TITLE: &'static str = "glide";

    /// Through the longest line.
    fn busiest() -> GlideParams<T> {
        let filter =
            EdgeTimedParams { delay: 3, lag: T::from_f64(0.002), ..EdgeTimedParams::default() };
        GlideParams { filter, ..GlideParams::default() }
    }

    fn build(p: &GlideParams<T>, beside: &Beside<'_, T>) -> Result<Self, ParamError<T>> {
        Glide::new(p, beside)
    }

    fn output(&self) -> &Output<T> {
        &self.output
    }

    fn filter(p: &GlideParams<T>) -> Option<&EdgeTimedParams<T>> {
        Some(&p.filter)
    }

    fn damping(p: &GlideParams<T>) -> Option<Damping<T>> {
        Some(Damping::Acceleration(p.kd))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::OutputParams;
    use crate::{ActuatorParams, BothActuator, MotorActuator, PlantParams};

    fn glide(p: GlideParams, model: &PlantParams) -> Glide<f64> {
        let two_sided = model.actuator.kind().two_sided();
        let lowest = if two_sided { -10.0 } else { 0.0 };
        let output = OutputParams { lowest, on_invalid: if two_sided { 0.0 } else { 10.0 }, ..OutputParams::default() };
        Glide::new(&p, &Beside::paper(model, &output)).unwrap()
    }

    fn at(rate: f64) -> Tick<f64> {
        Tick { target_velocity: rate.to_radians(), ..Tick::default() }
    }

    #[test]
    fn a_shaft_at_rest_is_let_go_and_then_held_by_less_than_the_friction_believed() {
        let law = glide(GlideParams::default(), &PlantParams::default());
        let tick = at(2.0);
        let mut state = law.start(&tick, 5.0);
        // One period brings it to 1.6 °/s.
        assert_eq!(law.update(&mut state, &tick).voltage, 0.0);
        let after = law.update(&mut state, &tick);
        // 2.24 V with the model's friction, a standard deviation of 29 % fewer.
        assert!(after.voltage > 1.2 && after.voltage < 1.9, "{} V", after.voltage);
        assert_eq!(after.terms[5], 1.0, "started");
    }

    #[test]
    fn micro_steps_are_refused_beside_a_lag_that_makes_them_long() {
        let with = |lag: f64, micro: f64| {
            let filter = EdgeTimedParams { lag, ..EdgeTimedParams::default() };
            let p = GlideParams { micro, filter, ..GlideParams::default() };
            let model = PlantParams::default();
            Glide::new(&p, &Beside::paper(&model, &OutputParams::default())).map(|_| ()).map_err(|e| e.field())
        };
        assert_eq!(with(5e-4, 0.016), Ok(()));
        assert_eq!(with(5.1e-4, 0.0), Ok(()));
        assert_eq!(with(5.1e-4, 0.016), Err("micro"));
    }

    #[test]
    fn a_path_that_stops_while_a_shaft_is_let_go_lets_it_go_no_longer() {
        let law = glide(GlideParams::default(), &PlantParams::default());
        let mut state = law.start(&at(100.0), 5.0);
        for _ in 0..10 {
            assert_eq!(law.update(&mut state, &at(100.0)).voltage, 0.0);
        }
        for tick in [at(0.0), Tick { target_velocity: f64::NAN, ..Tick::default() }] {
            let mut state = state;
            law.update(&mut state, &tick);
            assert!(law.update(&mut state, &tick).voltage > 0.0, "{tick:?}");
        }
    }

    #[test]
    fn a_path_that_rests_is_held_with_twice_the_voltage_that_carries_the_load() {
        let law = glide(GlideParams::default(), &PlantParams::default());
        let mut state = law.start(&at(0.0), 5.0);
        for _ in 0..100 {
            let volts = law.update(&mut state, &at(0.0)).voltage;
            assert!((volts - 2.0 * 2.242286).abs() < 1e-5, "{volts} V");
        }
    }

    /// The first voltage for a shaft that nothing but its actuator drives, and whose path has left its count.
    fn first_volts(actuator: impl Into<ActuatorParams<f64>>, rate: f64) -> f64 {
        let model = PlantParams { actuator: actuator.into(), drive_torque: 0.0, ..PlantParams::default() };
        let law = glide(GlideParams::default(), &model);
        let count = core::f64::consts::TAU / 20_000.0;
        let tick = Tick { error: 2.0 * rate.signum() * count, ..at(rate) };
        law.update(&mut law.start(&tick, 0.0), &tick).voltage
    }

    #[test]
    fn a_motor_starts_against_its_friction_at_rest_either_way() {
        let volts = |rate| first_volts(MotorActuator { gain: 0.05, preload: 0.25, load_share: 0.0 }, rate);
        let (forwards, backwards) = (volts(0.5), volts(-0.5));
        // 1.1 · 0.2 · 0.25 N m / 0.05 N m/V
        assert!((forwards - 1.1).abs() < 0.2, "{forwards} V");
        assert_eq!(backwards, -forwards);
        // Faster than that takes more: 87 rad/s² for 5 °/s in a period.
        assert!((volts(5.0) - (0.0375 + 0.0017 * 87.27) / 0.05).abs() < 0.05, "{} V", volts(5.0));
    }

    #[test]
    fn a_motor_beside_a_brake_starts_as_alone_below_0_volts() {
        let volts = |rate| first_volts(BothActuator { brake_gain: 0.14, motor_gain: 0.05, preload: 0.25 }, rate);
        assert!((volts(0.5) + 1.1).abs() < 0.2, "{} V", volts(0.5));
        assert!((volts(5.0) + (0.0375 + 0.0017 * 87.27) / 0.05).abs() < 0.05, "{} V", volts(5.0));
    }

    #[test]
    fn a_floor_at_which_a_shaft_would_seem_to_rest_is_refused() {
        let (model, output) = (PlantParams::default(), OutputParams::default());
        let p = GlideParams { floor: 0.3, ..GlideParams::default() };
        let e = Glide::<f64>::new(&p, &Beside::paper(&model, &output)).unwrap_err();
        assert_eq!(e.field(), "floor");
    }

    #[test]
    fn the_busiest_glide_has_all_the_delay_that_a_filter_may_have_and_a_lag() {
        let busiest = <Glide<f64> as Listed<f64>>::busiest();
        let (model, output) = (PlantParams::default(), OutputParams::default());
        let built = |filter| Glide::new(&GlideParams { filter, ..busiest }, &Beside::paper(&model, &output)).map(|_| ());
        assert_eq!(built(busiest.filter), Ok(()));
        let more = EdgeTimedParams { delay: busiest.filter.delay + 1, ..busiest.filter };
        assert_eq!(built(more).map_err(|e| e.field()), Err("delay"));
        // An exponential approach costs a product more than a step.
        assert!(busiest.filter.lag > 0.0);
    }

    #[test]
    fn a_law_that_was_asked_without_a_servo_starts_from_the_voltage_that_was_there() {
        let filter = EdgeTimedParams { delay: 2, ..EdgeTimedParams::default() };
        let law = glide(GlideParams { filter, ..GlideParams::default() }, &PlantParams::default());
        let tick = at(2.0);
        let mut state = law.start(&tick, 5.0);
        // Nobody tells it what the converter gave.
        law.update(&mut state, &tick);
        let (filter, belief, place) = law.filters.driving(&state.filters);
        assert_eq!(filter.ahead_on(belief, place).pad, 5.0, "as long as no other voltage has arrived");
    }

    #[test]
    fn in_steps_the_terms_are_friction_as_believed_and_the_way_from_the_end_of_the_step_to_the_path() {
        let count = core::f64::consts::TAU / 20_000.0;
        // Half a thousandth of a count in a period, and the path a quarter of a count ahead of the edge.
        // The error is the sensor's, whose position may be finer than a count.
        for (delay, way, quarters) in [(0, 0.0, 0), (2, 2.0 * 5e-4, 0), (0, 0.0, 1)] {
            let filter = EdgeTimedParams { delay, ..EdgeTimedParams::default() };
            let law = glide(GlideParams { micro: 0.016, filter, ..GlideParams::default() }, &PlantParams::default());
            let tick = Tick { error: 0.25 * count, target_velocity: 5e-4 * count / 1e-3, ..Tick::default() };
            let mut state = law.start(&tick, 5.0);
            let position = FixedCounts(quarters << (FixedCounts::FRACTION_BITS - 2));
            law.sees(&mut state, || Seen { position, applied: 5.0, ..Seen::default() });
            let terms = law.update(&mut state, &tick).terms;
            let way = way + 0.25 * quarters as f64;
            // The shaft is somewhere in its count: in the middle, for all that is known.
            let expected = [
                0.0,
                0.15,
                0.15 * 0.15 * (0.25 * 0.25 + 0.15 * 0.15),
                (0.25 - 0.5 + way) * count,
                tick.target_velocity,
                3.0,
                0.0,
            ];
            for (name, (term, expected)) in Glide::<f64>::TERMS.iter().zip(terms.iter().zip(expected)) {
                assert!((term - expected).abs() <= 1e-9 * expected.abs(), "{name}: {term} for {expected}");
            }
        }
    }
}
