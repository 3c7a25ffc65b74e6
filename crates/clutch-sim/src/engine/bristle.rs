//! The motion of a shaft whose friction has bristles: three states, stiff, without events in the motion itself.
//!
//! ```text
//! θ̇ = ω,   J ω̇ = T − μ(z, ż) N − C ω,   ż = ż(z, ω)
//! ```
//!
//! Each step of the Rosenbrock method holds the error that its embedded pair sees to [`RELATIVE`] of speed and deflection.
//! Where the velocity changes its sign the model has a corner: there the steps become short by themselves.
//!
//! Bristles never hold a shaft still, so that sticking is a matter of words: a shaft counts as stuck from the step on at
//! whose end its bristles bend less than [`STICKS_BELOW`] of steady sliding and it is slower than the Stribeck velocity,
//! until they bend by [`SLIDES_FROM`].

use super::{Engine, EngineError, Event, EventKind, Input, Model, Motion, Shaft, rosenbrock};
use clutch_core::friction::{Bristles, FrictionModel};

/// Error allowed per step as a share of speed and deflection.
const RELATIVE: f64 = 1e-8;
/// Error allowed per step besides, as a share of the velocity and the deflection that belong to break-away.
const ABSOLUTE: f64 = 1e-9;
/// Share of the deflection of steady sliding below which a shaft counts as stuck, and from which on it does not.
const STICKS_BELOW: f64 = 0.9;
const SLIDES_FROM: f64 = 0.99;
/// Steps in one interval before the engine gives up.
const STEP_LIMIT: u32 = 1_000_000;

/// Position from the start of the interval, velocity, deflection.
type State = [f64; 3];

/// The engine of bristles.
#[derive(Clone, Debug, Default)]
pub struct Bristle {
    /// Step that the last interval ended with, s; 0 before the first.
    step: f64,
}

impl Bristle {
    /// Step that it begins with, s.
    pub(crate) fn step(&self) -> f64 {
        self.step
    }

    /// An engine that begins with this step.
    pub(crate) fn with_step(step: f64) -> Self {
        Bristle { step }
    }
}

/// The equations over an interval.
struct Equations<'a> {
    model: &'a Model,
    input: &'a Input<'a>,
    bristles: Bristles<f64>,
    origin: f64,
}

impl Equations<'_> {
    fn rate(&self, s: f64, [way, velocity, z]: State) -> State {
        let (p, position) = (self.model.plant.params(), self.origin + way);
        let bends = self.bristles.rate(z, velocity);
        let mu = self.bristles.coefficient(z, bends) * self.model.friction_factor(position);
        let rubs = self.model.plant.actuator().friction(mu, self.input.volts.at(s));
        let torque = self.input.torque(self.model, s, position);
        [velocity, (torque - rubs - p.viscous_damping * velocity) / p.inertia, bends]
    }

    /// One step; the state at its end and its error over the tolerance.
    fn step(&self, s: f64, h: f64, from: State, scale: State) -> Option<(State, f64)> {
        let rate = |s: f64, state: &State| self.rate(s, *state);
        let (to, wrong) = rosenbrock::step(&rate, (s, &from, h), &scale, &[1.0, from[1], 1.0])?;
        let wrong = |n: usize, allowed: f64| (wrong[n] / allowed).abs();
        let most = |n: usize| from[n].abs().max(to[n].abs());
        let speed = ABSOLUTE * scale[1] + RELATIVE * most(1);
        let bent = ABSOLUTE * scale[2] + RELATIVE * most(2);
        let error = wrong(0, h * speed + ABSOLUTE * scale[0]).max(wrong(1, speed)).max(wrong(2, bent));
        Some((to, error))
    }
}

impl Engine for Bristle {
    fn advance_smooth(
        &mut self,
        model: &Model,
        input: &Input<'_>,
        shaft: &mut Shaft,
        events: &mut Vec<Event>,
    ) -> Result<(), EngineError> {
        let Some(bristles) = model.plant.friction().bristles() else {
            return Err(EngineError::Refused("friction with bristles"));
        };
        let end = input.duration;
        let equations = Equations { model, input, bristles, origin: shaft.position };
        let bent = bristles.holding(f64::INFINITY);
        let p = model.plant.params();
        // The speed to which break-away lets a shaft come while the bristles bend.
        let stiffness = bristles.stiffness() * model.plant.actuator().normal(input.volts.at(0.0));
        let speed = bent * libm::sqrt((stiffness / p.inertia).max(1e-12));
        let scale = [bent, speed, bent];
        let mut state = [0.0, shaft.velocity, shaft.deflection];
        let (mut s, mut steps) = (0.0, 0);
        let mut h = if self.step > 0.0 { self.step } else { 1e-3 * end };
        while s < end {
            steps += 1;
            if steps > STEP_LIMIT {
                return Err(EngineError::TooManySteps { time: input.time, limit: STEP_LIMIT });
            }
            let last = s + h >= end;
            let length = if last { end - s } else { h };
            let tried = equations.step(s, length, state, scale);
            let Some((to, error)) = tried.filter(|(to, e)| e.is_finite() && to.iter().all(|x| x.is_finite()))
            else {
                if length < 1e-15 {
                    return Err(EngineError::NotFinite { time: input.time });
                }
                h = 0.1 * length;
                continue;
            };
            let grown = length * (0.9 * libm::pow(error.max(1e-8), -0.25)).clamp(0.2, 4.0);
            if error > 1.0 {
                h = grown.min(0.9 * length);
                continue;
            }
            s = if last { end } else { s + length };
            state = to;
            // A last step cut short says nothing about the step that would have done.
            if !last || grown > self.step {
                self.step = grown;
            }
            h = grown;
            shaft.position = equations.origin + state[0];
            (shaft.velocity, shaft.deflection) = (state[1], state[2]);
            let (slides, speed) =
                (bristles.bent(state[2], state[1]), state[1].abs() / bristles.stribeck_velocity());
            let motion = if slides >= SLIDES_FROM {
                if state[1] < 0.0 { Motion::Backward } else { Motion::Forward }
            } else if slides < STICKS_BELOW && speed < 1.0 {
                Motion::Stuck
            } else {
                shaft.motion
            };
            let kind = match (shaft.motion == Motion::Stuck, motion == Motion::Stuck) {
                (false, true) => Some(EventKind::Stick),
                (true, false) => Some(EventKind::BreakAway),
                _ => None,
            };
            shaft.motion = motion;
            if let Some(kind) = kind {
                let torque = input.torque(model, s, shaft.position);
                events.push(Event { time: input.time + s, kind, position: shaft.position, torque });
            }
        }
        Ok(())
    }
}
