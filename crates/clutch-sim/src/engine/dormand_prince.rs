//! Dormand and Prince's 5(4) pair, the solver of the paper, with located events.
//!
//! Error per step is held to [`ABSOLUTE`] and, near rest, to [`RELATIVE`] of the speed, or to a share of both. A step that would carry the velocity
//! through zero is shortened, by root finding on the step itself, until it ends there.
//!
//! J. R. Dormand, P. J. Prince, A family of embedded Runge–Kutta formulae, J. Comp. Appl. Math.
//! 6 (1980) 19–26.

use super::pair::{A, C, E};
use super::{Engine, EngineError, Event, EventKind, Input, Model, Motion, Shaft, break_away};
use crate::lane::Lane;
use crate::ripple::Ripple;
use clutch_core::Plant;
use clutch_core::friction::FrictionModel;

/// Error allowed per step, in rad and rad/s, and as a share of both.
const ABSOLUTE: f64 = 1e-11;
/// Error allowed per step as a share of the larger speed of its ends, and of the way at that speed: where the shaft just
/// breaks away, the layer blows an error up as it does the motion.
const RELATIVE: f64 = 1e-7;
/// Rounding of a position, rad and per rad.
const ROUNDING: f64 = 1e-15;
/// An instant of stopping is located to this, s: below the 1e-9 s that the tests ask for.
const INSTANT: f64 = 1e-13;
/// Steps in one interval before the engine gives up.
const STEP_LIMIT: u32 = 100_000;

/// The reference engine.
#[derive(Clone, Debug)]
pub struct DormandPrince {
    /// Share of the errors allowed per step.
    share: f64,
    /// Step that the last interval ended with, s; 0 before the first.
    step: f64,
    /// First step of the last motion that began at rest, s; 0 before the first.
    from_rest: f64,
}

impl Default for DormandPrince {
    fn default() -> Self {
        DormandPrince { share: 1.0, step: 0.0, from_rest: 0.0 }
    }
}

impl DormandPrince {
    /// An engine that allows each step a share of the default's error: one that checks others, at a cost that grows with
    /// the fifth root of `1/share`. Below 1e-4 the rounding of positions is more.
    #[must_use]
    pub fn with_tolerance(share: f64) -> Self {
        DormandPrince { share, ..DormandPrince::default() }
    }

    /// Steps that it begins with, s: of the next interval, and of the next motion from rest.
    pub(crate) fn steps(&self) -> [f64; 2] {
        [self.step, self.from_rest]
    }

    /// It begins with these steps, s; 0 for one not known.
    pub(crate) fn begin_with(&mut self, [step, from_rest]: [f64; 2]) {
        (self.step, self.from_rest) = (step, from_rest);
    }
}

/// Position and velocity, or their rates.
pub(crate) type State<V> = [V; 2];

/// Torques and voltages on the shaft during an interval, or on several.
pub(crate) trait Push<V> {
    /// Voltage `s` seconds after the sample, V.
    fn volts(&self, s: V) -> V;
    /// Torque of the drive then, N m.
    fn drive(&self, s: V, position: V) -> V;
}

impl Push<f64> for Input<'_> {
    #[inline(always)]
    fn volts(&self, s: f64) -> f64 {
        self.volts.at(s)
    }
    #[inline(always)]
    fn drive(&self, s: f64, position: f64) -> f64 {
        self.drive.torque(self.time + s, position - self.origin) + self.noise
    }
}

/// The equation of motion while slipping one way, of a shaft or of several.
pub(crate) struct Slip<'a, V: Lane, P> {
    pub(crate) plant: &'a Plant<V>,
    pub(crate) ripple: Option<&'a Ripple<V>>,
    pub(crate) push: P,
    pub(crate) sign: V,
    pub(crate) inverse_inertia: V,
    /// Share of the errors allowed per step.
    pub(crate) share: f64,
    /// Rounding of the acceleration, rad/s²: the torques that make it, of which next to nothing may be left.
    pub(crate) rounding: V,
}

/// A step: the state at its end, its error over the tolerance, the length of the next step over its own by that error, and
/// the rate at the end (the pair's last stage, which begins the next step).
pub(crate) struct Step<V> {
    pub(crate) to: State<V>,
    pub(crate) error: V,
    pub(crate) grows: V,
    pub(crate) rate: State<V>,
}

/// The larger of two.
#[inline(always)]
fn larger<V: Lane>(a: V, b: V) -> V {
    V::select(b.less(a), a, b)
}

/// The smaller of two.
#[inline(always)]
fn smaller<V: Lane>(a: V, b: V) -> V {
    V::select(a.less(b), a, b)
}

impl<V: Lane, P: Push<V>> Slip<'_, V, P> {
    #[inline(always)]
    fn rate(&self, s: V, state: State<V>) -> State<V> {
        // Here and below no function takes a closure: it would be called, and leave the vector's instructions behind.
        let factor = match self.ripple {
            Some(ripple) => ripple.at(state[0]),
            None => V::ONE,
        };
        self.rate_at(s, state, factor)
    }

    /// The rate where friction along the disc has a factor.
    #[inline(always)]
    pub(crate) fn rate_at(&self, s: V, [position, velocity]: State<V>, factor: V) -> State<V> {
        // Friction acts against the way the shaft slips, also in the stages of a step that looks
        // beyond the stop: there it keeps its value at rest.
        let speed = larger(self.sign * velocity, V::ZERO);
        let friction = self.plant.friction();
        // Rounding must not lift it above the number that the break-away was compared with.
        let level = smaller(friction.level(speed), larger(friction.at_rest(), friction.sliding()));
        let mu = level * factor;
        let volts = self.push.volts(s);
        let actuator = self.plant.actuator();
        let rubs = actuator.friction(self.sign * mu, volts);
        let torque = self.push.drive(s, position) + actuator.torque(volts);
        let damping = self.plant.params().viscous_damping;
        [velocity, (torque - rubs - damping * velocity) * self.inverse_inertia]
    }

    /// One step of length `h`.
    #[inline(always)]
    #[allow(
        clippy::needless_range_loop,
        reason = "an iterator's closure would leave the vector's instructions behind"
    )]
    pub(crate) fn step(&self, s: V, h: V, from: State<V>, first: State<V>) -> Step<V> {
        let mut k = [first; 7];
        let mut to = from;
        for i in 0..6 {
            to = from;
            for j in 0..=i {
                let share = h * V::splat(A[i][j]);
                to = [to[0] + share * k[j][0], to[1] + share * k[j][1]];
            }
            k[i + 1] = self.rate(s + V::splat(C[i]) * h, to);
        }
        let mut left_out = [V::ZERO; 2];
        for j in 0..7 {
            let e = V::splat(E[j]);
            left_out = [left_out[0] + e * k[j][0], left_out[1] + e * k[j][1]];
        }
        let left_out = [(h * left_out[0]).abs(), (h * left_out[1]).abs()];
        let largest = [larger(from[0].abs(), to[0].abs()), larger(from[1].abs(), to[1].abs())];
        let (absolute, relative) = (V::splat(self.share * ABSOLUTE), V::splat(self.share * RELATIVE));
        let rounding = V::splat(ROUNDING) * (V::ONE + largest[0]);
        let way = smaller(absolute * (V::ONE + largest[0]), relative * h * largest[1] + rounding);
        let speed = smaller(absolute * (V::ONE + largest[1]), relative * largest[1] + self.rounding * h);
        let error = larger(left_out[0] / way, left_out[1] / larger(speed, V::splat(f64::MIN_POSITIVE)));
        Step { to, error, grows: V::splat(0.9) * power(error), rate: k[6] }
    }
}

/// A motion one way, on its way through an interval.
#[derive(Clone, Copy)]
pub(crate) struct Course {
    /// Time since the sample, s.
    pub(crate) s: f64,
    pub(crate) state: State<f64>,
    pub(crate) rate: State<f64>,
    /// Length of the next step, s.
    h: f64,
    at_rest: bool,
    /// Steps tried in the interval.
    steps: u32,
}

impl Course {
    /// Length of the next step, s, and whether it ends the interval.
    #[inline]
    pub(crate) fn next(&self, end: f64) -> (f64, bool) {
        let last = self.s + self.h >= end;
        (if last { end - self.s } else { self.h }, last)
    }
}

/// Outcome of a step.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Outcome {
    /// It stands, or has to be tried again: the motion goes on.
    On,
    /// It would carry the velocity through 0.
    Stops,
}

impl DormandPrince {
    /// A motion that begins so.
    #[inline]
    pub(crate) fn course(&self, s: f64, end: f64, state: State<f64>, rate: State<f64>) -> Course {
        let at_rest = state[1] == 0.0;
        let known = if at_rest { self.from_rest } else { self.step };
        Course { s, state, rate, h: if known > 0.0 { known } else { 1e-3 * end }, at_rest, steps: 0 }
    }

    /// Judges the step that [`Course::next`] asked for.
    ///
    /// # Errors
    /// The interval, which begins at `time`, takes too many steps, or numbers end.
    #[inline]
    pub(crate) fn judge(
        &mut self,
        on: &mut Course,
        step: &Step<f64>,
        sign: f64,
        (time, end): (f64, f64),
    ) -> Result<Outcome, EngineError> {
        on.steps += 1;
        if on.steps > STEP_LIMIT {
            return Err(EngineError::TooManySteps { time, limit: STEP_LIMIT });
        }
        let (length, last) = on.next(end);
        let Step { to, error, grows, rate } = *step;
        if !(error.is_finite() && to[0].is_finite() && to[1].is_finite()) {
            if length < 1e-15 {
                return Err(EngineError::NotFinite { time });
            }
            on.h = 0.1 * length;
            return Ok(Outcome::On);
        }
        if error > 1.0 {
            on.h = length * grows.max(0.2);
            return Ok(Outcome::On);
        }
        if sign * to[1] < 0.0 {
            return Ok(Outcome::Stops);
        }
        let grown = length * grows.clamp(0.2, 5.0);
        if on.at_rest && (!last || grown > self.from_rest) {
            self.from_rest = grown;
        }
        on.at_rest = false;
        on.s = if last { end } else { on.s + length };
        (on.state, on.rate) = (to, rate);
        // A last step cut short says nothing about the step that would have done.
        if !last || grown > self.step {
            self.step = grown;
        }
        on.h = grown;
        Ok(Outcome::On)
    }

    /// Moves `shaft` as [`Engine::advance_smooth`] does. If its motion has begun already, `begun` has its course and the
    /// rounding of its acceleration.
    ///
    /// # Errors
    /// If the motion cannot be followed.
    pub(crate) fn follow(
        &mut self,
        model: &Model,
        input: &Input<'_>,
        shaft: &mut Shaft,
        events: &mut Vec<Event>,
        mut begun: Option<(Course, f64)>,
    ) -> Result<(), EngineError> {
        let end = input.duration;
        let (mut s, mut steps) = (0.0, 0);
        let event = |kind, s: f64, position| Event {
            time: input.time + s,
            kind,
            position,
            torque: input.torque(model, s, position),
        };
        while s < end {
            if shaft.motion == Motion::Stuck {
                let Some(instant) = break_away(model, input, shaft.position, s) else { return Ok(()) };
                s = instant;
                shaft.motion = Motion::along(input.torque(model, s, shaft.position));
                events.push(event(EventKind::BreakAway, s, shaft.position));
            }
            let inverse_inertia = 1.0 / model.plant.params().inertia;
            let mut slip = Slip {
                plant: &model.plant,
                ripple: model.ripple.as_ref(),
                push: *input,
                sign: shaft.motion.sign(),
                inverse_inertia,
                share: self.share,
                rounding: 0.0,
            };
            let mut on = match begun.take() {
                Some((course, rounding)) => {
                    slip.rounding = rounding;
                    course
                }
                None => {
                    let factor = model.friction_factor(shaft.position);
                    let volts = input.volts.at(s);
                    let torques = input.torque(model, s, shaft.position).abs()
                        + model.plant.break_away_torque(volts) * factor;
                    slip.rounding = rounding(torques, inverse_inertia);
                    let state = [shaft.position, shaft.velocity];
                    let rate = slip.rate_at(s, state, factor);
                    Course { steps, ..self.course(s, end, state, rate) }
                }
            };
            while on.s < end {
                let (length, _) = on.next(end);
                let step = slip.step(on.s, length, on.state, on.rate);
                let outcome = self.judge(&mut on, &step, slip.sign, (input.time, end))?;
                [shaft.position, shaft.velocity] = on.state;
                if outcome == Outcome::Stops {
                    let (instant, to) = stop(&slip, on.s, length, on.state, on.rate, step.to[1]);
                    on.s += instant;
                    shaft.position = to[0];
                    shaft.velocity = 0.0;
                    let torque = input.torque(model, on.s, to[0]);
                    if torque.abs() <= model.break_away_torque(to[0], input.volts.at(on.s)) {
                        shaft.motion = Motion::Stuck;
                        events.push(event(EventKind::Stick, on.s, shaft.position));
                    } else {
                        shaft.motion = Motion::along(torque);
                    }
                    break;
                }
            }
            (s, steps) = (on.s, on.steps);
        }
        Ok(())
    }
}

/// Length of the next step over that of the last, to the order of the pair, for the last one's error; a bound of it where
/// 0.9 of it is above 5 or below 0.2, which is all that is asked there.
#[inline(always)]
fn power<V: Lane>(error: V) -> V {
    let (small, large) = (error.less(V::splat(1.8e-4)), V::splat(2e3).less(error));
    let bound = V::select(small, V::splat(6.0), V::splat(0.2));
    let between = !(small | large);
    if !V::any(between) {
        return bound;
    }
    V::select(between, V::select(between, error, V::ONE).powf(V::splat(-0.2)), bound)
}

/// Rounding of an acceleration that torques make, rad/s².
#[inline(always)]
pub(crate) fn rounding<V: Lane>(torques: V, inverse_inertia: V) -> V {
    V::splat(2.0 * f64::EPSILON) * torques * inverse_inertia
}

impl Engine for DormandPrince {
    fn advance_smooth(
        &mut self,
        model: &Model,
        input: &Input<'_>,
        shaft: &mut Shaft,
        events: &mut Vec<Event>,
    ) -> Result<(), EngineError> {
        self.follow(model, input, shaft, events, None)
    }
}

/// The length of the step from `state` at `s` whose end has velocity 0, within `(0, length]`, and that end.
///
/// Newton's method on whole steps, whose last stage is the acceleration, halved where it would leave the bracket: each
/// trial is as accurate as the pair itself.
fn stop(
    slip: &Slip<'_, f64, Input<'_>>,
    s: f64,
    length: f64,
    state: State<f64>,
    rate: State<f64>,
    beyond: f64,
) -> (f64, State<f64>) {
    let (mut before, mut after) = (0.0, length);
    // From rest, which is a root, too, the other one is looked for.
    let mut h = if state[1] == 0.0 { 0.5 * length } else { length * state[1] / (state[1] - beyond) };
    loop {
        let Step { to, rate: end_rate, .. } = slip.step(s, h, state, rate);
        if slip.sign * to[1] > 0.0 {
            before = h
        } else {
            after = h
        }
        let mut next = h - to[1] / end_rate[1];
        if !(next > before && next < after) {
            next = 0.5 * (before + after);
        }
        if (next - h).abs() <= INSTANT || next <= before || next >= after {
            return (h, to);
        }
        h = next;
    }
}
