//! The motion of a shaft whose friction has bristles: position, velocity, a deflection of each element; stiff. An element of
//! Maxwell's that begins to slide or to hold is an event, and located; else there are none in the motion itself.
//!
//! ```text
//! θ̇ = ω,   J ω̇ = T − μ(z, ż) N − C ω,   ż = ż(z, ω)
//! ```
//!
//! Each step of the Rosenbrock method holds the error that its embedded pair sees to [`RELATIVE`] of speed and deflection.
//! The model has a corner where the velocity changes its sign: there the steps become short by themselves.
//!
//! Bristles never hold a shaft still, so that sticking is a matter of words: a shaft counts as stuck from the step on at
//! whose end its bristles bend less than [`STICKS_BELOW`] of steady sliding and it is slower than the Stribeck velocity,
//! until they bend by [`SLIDES_FROM`].

use super::rosenbrock::{self, Linear};
use super::{Engine, EngineError, Event, EventKind, Input, Model, Motion, Shaft};
use clutch_core::friction::{Bend, Bristles, ELEMENTS, FrictionModel};

/// Error allowed per step as a share of speed and deflection.
const RELATIVE: f64 = 1e-8;
/// Error allowed per step besides, as a share of the velocity and the deflection that belong to break-away.
const ABSOLUTE: f64 = 1e-9;
/// Share of the deflection of steady sliding below which a shaft counts as stuck, and from which on it does not.
const STICKS_BELOW: f64 = 0.9;
const SLIDES_FROM: f64 = 0.99;
/// Steps in one interval before the engine gives up.
const STEP_LIMIT: u32 = 1_000_000;

/// An event of an element is located to this, as a share of a step.
const INSTANT: f64 = 1e-13;

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

/// The equations over an interval. A state is the position from the start of the interval, the velocity, and the deflection
/// of each element: `D` is 2 more than there are.
struct Equations<'a> {
    model: &'a Model,
    input: &'a Input<'a>,
    bristles: Bristles<f64>,
    origin: f64,
}

/// The begin of a step.
struct Begin<const D: usize> {
    /// Seconds after the sample.
    s: f64,
    state: [f64; D],
    /// Elements that slide.
    slides: [bool; ELEMENTS],
    /// Position, velocity and deflections that belong to break-away.
    scale: [f64; D],
}

/// The bend that a state has, with the elements that slide.
fn bend_of<const D: usize>(state: &[f64; D], slides: [bool; ELEMENTS]) -> Bend<f64> {
    let mut bend = Bend { slides, ..Bend::none() };
    for (z, x) in bend.each.iter_mut().zip(&state[2..]) {
        *z = *x;
    }
    bend
}

impl Equations<'_> {
    fn rate<const D: usize>(&self, s: f64, state: &[f64; D], slides: [bool; ELEMENTS]) -> [f64; D] {
        let (p, velocity) = (self.model.plant.params(), state[1]);
        let position = self.origin + state[0];
        let bend = bend_of(state, slides);
        let bends = self.bristles.rate(&bend, velocity);
        let mu = self.bristles.coefficient(&bend, &bends) * self.model.friction_factor(position);
        let rubs = self.model.plant.actuator().friction(mu, self.input.volts.at(s));
        let torque = self.input.torque(self.model, s, position);
        let turns = (torque - rubs - p.viscous_damping * velocity) / p.inertia;
        core::array::from_fn(|i| match i {
            0 => velocity,
            1 => turns,
            _ => bends[i - 2],
        })
    }

    /// One step; the state at its end and its error over the tolerance.
    fn step<const D: usize>(&self, from: &Begin<D>, h: f64) -> Option<([f64; D], f64)>
    where
        [f64; D]: Linear,
    {
        let Begin { s, state, slides, scale } = from;
        let rate = |s: f64, state: &[f64; D]| self.rate(s, state, *slides);
        let away = core::array::from_fn(|i| if i == 1 { state[1] } else { 1.0 });
        let (to, wrong) = rosenbrock::step(&rate, (*s, state, h), scale, &away)?;
        let wrong = |n: usize, allowed: f64| (wrong[n] / allowed).abs();
        let most = |n: usize| state[n].abs().max(to[n].abs());
        let allowed = |n: usize| ABSOLUTE * scale[n] + RELATIVE * most(n);
        let first = wrong(0, h * allowed(1) + ABSOLUTE * scale[0]);
        Some((to, (1..D).fold(first, |worst, n| worst.max(wrong(n, allowed(n))))))
    }

    /// The end of the shortest step at whose end an element has begun to slide or to hold.
    fn locate<const D: usize>(&self, from: &Begin<D>, h: f64) -> Option<(f64, [f64; D])>
    where
        [f64; D]: Linear,
    {
        let (mut before, mut after) = (0.0, h);
        while after - before > INSTANT * h {
            let middle = 0.5 * (before + after);
            let (to, _) = self.step(from, middle)?;
            if self.settled(&to, from.slides) == from.slides { before = middle } else { after = middle }
        }
        Some((after, self.step(from, after)?.0))
    }

    fn settled<const D: usize>(&self, state: &[f64; D], slides: [bool; ELEMENTS]) -> [bool; ELEMENTS] {
        self.bristles.settled(&bend_of(state, slides), state[1]).slides
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
        let equations = Equations { model, input, bristles, origin: shaft.position };
        match bristles.count() {
            1 => self.advance_states::<3>(&equations, shaft, events),
            2..=4 => self.advance_states::<6>(&equations, shaft, events),
            _ => self.advance_states::<{ 2 + ELEMENTS }>(&equations, shaft, events),
        }
    }
}

impl Bristle {
    fn advance_states<const D: usize>(
        &mut self,
        equations: &Equations<'_>,
        shaft: &mut Shaft,
        events: &mut Vec<Event>,
    ) -> Result<(), EngineError>
    where
        [f64; D]: Linear,
    {
        let Equations { model, input, bristles, .. } = equations;
        let end = input.duration;
        let bent = bristles.deflection();
        let p = model.plant.params();
        // The speed to which break-away lets a shaft come while the bristles bend.
        let stiffness = bristles.stiffness() * model.plant.actuator().normal(input.volts.at(0.0));
        let speed = bent * libm::sqrt((stiffness / p.inertia).max(1e-12));
        let state = core::array::from_fn(|i| match i {
            0 => 0.0,
            1 => shaft.velocity,
            _ => shaft.bend.each[i - 2],
        });
        let scale = core::array::from_fn(|i| if i == 1 { speed } else { bent });
        let mut at = Begin::<D> { s: 0.0, state, slides: shaft.bend.slides, scale };
        let mut steps = 0;
        let mut h = if self.step > 0.0 { self.step } else { 1e-3 * end };
        while at.s < end {
            steps += 1;
            if steps > STEP_LIMIT {
                return Err(EngineError::TooManySteps { time: input.time, limit: STEP_LIMIT });
            }
            let last = at.s + h >= end;
            let length = if last { end - at.s } else { h };
            let tried = equations.step(&at, length);
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
            let happens = equations.settled(&to, at.slides) != at.slides;
            let located = if happens { equations.locate(&at, length) } else { None };
            let before = at.s;
            (at.s, at.state) = match located {
                Some((part, to)) if part < length => (at.s + part, to),
                _ => (if last { end } else { at.s + length }, to),
            };
            if happens {
                at.slides = equations.settled(&at.state, at.slides);
                h = (at.s - before).max(1e-3 * grown);
            } else {
                // A last step cut short says nothing about the step that would have done.
                if !last || grown > self.step {
                    self.step = grown;
                }
                h = grown;
            }
            shaft.position = equations.origin + at.state[0];
            shaft.velocity = at.state[1];
            shaft.bend = bend_of(&at.state, at.slides);
            let (slide, speed) = (
                bristles.bent(&shaft.bend, shaft.velocity),
                shaft.velocity.abs() / bristles.stribeck_velocity(),
            );
            let motion = if slide >= SLIDES_FROM {
                if shaft.velocity < 0.0 { Motion::Backward } else { Motion::Forward }
            } else if slide < STICKS_BELOW && speed < 1.0 {
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
                let torque = input.torque(model, at.s, shaft.position);
                events.push(Event { time: input.time + at.s, kind, position: shaft.position, torque });
            }
        }
        Ok(())
    }
}
