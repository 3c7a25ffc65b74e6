//! Dormand and Prince's 5(4) pair, the solver of the paper, with located events.
//!
//! Error per step is held to [`ABSOLUTE`] and, near rest, to [`RELATIVE`] of the speed, or to a share of both. A step that would carry the velocity
//! through zero is shortened, by root finding on the step itself, until it ends there.
//!
//! J. R. Dormand, P. J. Prince, A family of embedded Runge–Kutta formulae, J. Comp. Appl. Math.
//! 6 (1980) 19–26.

use super::pair::{A, C, E};
use super::{Engine, EngineError, Event, EventKind, Input, Model, Motion, Shaft, break_away};
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

type State = [f64; 2];

/// The equation of motion while slipping one way.
struct Slip<'a> {
    model: &'a Model,
    input: &'a Input<'a>,
    sign: f64,
    inverse_inertia: f64,
    /// Share of the errors allowed per step.
    share: f64,
    /// Rounding of the acceleration, rad/s²: the torques that make it, of which next to nothing may be left.
    rounding: f64,
}

impl Slip<'_> {
    #[inline]
    fn rate(&self, s: f64, [position, velocity]: State) -> State {
        let p = self.model.plant.params();
        // Friction acts against the way the shaft slips, also in the stages of a step that looks
        // beyond the stop: there it keeps its value at rest.
        let speed = (self.sign * velocity).max(0.0);
        let friction = self.model.plant.friction();
        // Rounding must not lift it above the number that the break-away was compared with.
        let level = friction.level(speed).min(friction.at_rest().max(friction.sliding()));
        let mu = level * self.model.friction_factor(position);
        let rubs = self.model.plant.actuator().friction(self.sign * mu, self.input.volts.at(s));
        let torque = self.input.torque(self.model, s, position);
        [velocity, (torque - rubs - p.viscous_damping * velocity) * self.inverse_inertia]
    }

    /// One step of length `h`; the state at its end, its error over the tolerance, and the rate
    /// at the end (the pair's last stage, which begins the next step).
    fn step(&self, s: f64, h: f64, from: State, first: State) -> (State, f64, State) {
        let mut k = [first; 7];
        let mut to = from;
        for i in 0..6 {
            to = from;
            for (a, k) in A[i].iter().zip(&k).take(i + 1) {
                to[0] += h * a * k[0];
                to[1] += h * a * k[1];
            }
            k[i + 1] = self.rate(s + C[i] * h, to);
        }
        let left_out = |n: usize| (h * E.iter().zip(&k).map(|(e, k)| e * k[n]).sum::<f64>()).abs();
        let largest = |n: usize| from[n].abs().max(to[n].abs());
        let (absolute, relative) = (self.share * ABSOLUTE, self.share * RELATIVE);
        let rounding = ROUNDING * (1.0 + largest(0));
        let way = (absolute * (1.0 + largest(0))).min(relative * h * largest(1) + rounding);
        let speed = (absolute * (1.0 + largest(1))).min(relative * largest(1) + self.rounding * h);
        let error = (left_out(0) / way).max(left_out(1) / speed.max(f64::MIN_POSITIVE));
        (to, error, k[6])
    }
}

impl Engine for DormandPrince {
    fn advance_smooth(
        &mut self,
        model: &Model,
        input: &Input<'_>,
        shaft: &mut Shaft,
        events: &mut Vec<Event>,
    ) -> Result<(), EngineError> {
        let end = input.duration;
        let mut s = 0.0;
        let mut steps = 0;
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
            let torques = input.torque(model, s, shaft.position).abs()
                + model.break_away_torque(shaft.position, input.volts.at(s));
            let rounding = 2.0 * f64::EPSILON * torques * inverse_inertia;
            let slip = Slip {
                model,
                input,
                sign: shaft.motion.sign(),
                inverse_inertia,
                share: self.share,
                rounding,
            };
            let mut state = [shaft.position, shaft.velocity];
            let mut rate = slip.rate(s, state);
            let mut at_rest = shaft.velocity == 0.0;
            let known = if at_rest { self.from_rest } else { self.step };
            let mut h = if known > 0.0 { known } else { 1e-3 * end };
            while s < end {
                steps += 1;
                if steps > STEP_LIMIT {
                    return Err(EngineError::TooManySteps { time: input.time, limit: STEP_LIMIT });
                }
                let last = s + h >= end;
                let length = if last { end - s } else { h };
                let (to, error, end_rate) = slip.step(s, length, state, rate);
                if !(error.is_finite() && to[0].is_finite() && to[1].is_finite()) {
                    if length < 1e-15 {
                        return Err(EngineError::NotFinite { time: input.time });
                    }
                    h = 0.1 * length;
                    continue;
                }
                if error > 1.0 {
                    h = length * (0.9 * libm::pow(error, -0.2)).max(0.2);
                    continue;
                }
                let grown = length * (0.9 * libm::pow(error.max(1e-10), -0.2)).clamp(0.2, 5.0);
                if slip.sign * to[1] < 0.0 {
                    let (instant, to) = stop(&slip, s, length, state, rate, to[1]);
                    s += instant;
                    shaft.position = to[0];
                    shaft.velocity = 0.0;
                    let torque = input.torque(model, s, to[0]);
                    if torque.abs() <= model.break_away_torque(to[0], input.volts.at(s)) {
                        shaft.motion = Motion::Stuck;
                        events.push(event(EventKind::Stick, s, shaft.position));
                    } else {
                        shaft.motion = Motion::along(torque);
                    }
                    break;
                }
                if at_rest && (!last || grown > self.from_rest) {
                    self.from_rest = grown;
                }
                at_rest = false;
                s = if last { end } else { s + length };
                state = to;
                rate = end_rate;
                shaft.position = state[0];
                shaft.velocity = state[1];
                // A last step cut short says nothing about the step that would have done.
                if !last || grown > self.step {
                    self.step = grown;
                }
                h = grown;
            }
        }
        Ok(())
    }
}

/// The length of the step from `state` at `s` whose end has velocity 0, within `(0, length]`, and that end.
///
/// Newton's method on whole steps, whose last stage is the acceleration, halved where it would leave the bracket: each
/// trial is as accurate as the pair itself.
fn stop(slip: &Slip<'_>, s: f64, length: f64, state: State, rate: State, beyond: f64) -> (f64, State) {
    let (mut before, mut after) = (0.0, length);
    // From rest, which is a root, too, the other one is looked for.
    let mut h = if state[1] == 0.0 { 0.5 * length } else { length * state[1] / (state[1] - beyond) };
    loop {
        let (to, _, end_rate) = slip.step(s, h, state, rate);
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
