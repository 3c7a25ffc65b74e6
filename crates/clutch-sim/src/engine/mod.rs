//! Engines: what moves the shaft from one sample to the next.
//!
//! ```text
//!            |T| > μ_s N(v_a) m(θ)                    ω reaches 0 and
//!           ┌───── break-away ──────► Slip ±1 ──┐     |T| ≤ μ_s N(v_a) m(θ)
//!         Stuck                                 │
//!           └◄──────────── stop ────────────────┘     (else Slip ∓1)
//! ```
//!
//! `T` is the torque of drive and actuator. A stuck shaft has velocity exactly 0 and does not move at all. Stop and break-away are found
//! as roots, not as a threshold on a small velocity. All engines work from one [`Model`] and one
//! [`Input`]; which one runs is chosen by [`EngineKind`].

mod bristle;
pub(crate) mod dormand_prince;
pub(crate) mod exact_flow;
pub(crate) mod pair;
pub(crate) mod rosenbrock;

pub use bristle::Bristle;
pub use dormand_prince::DormandPrince;
pub use exact_flow::ExactFlow;

use crate::drive::Drive;
use crate::ripple::Ripple;
use clutch_core::friction::FrictionModel;
use clutch_core::{Bend, Plant};

/// Motion of the shaft: stuck, or the way in which it slips.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Held by friction: velocity exactly 0.
    Stuck,
    /// Velocity at or above 0, friction torque negative.
    Forward,
    /// Velocity at or below 0, friction torque positive.
    Backward,
}

impl Motion {
    /// Sign of the velocity.
    pub(crate) fn sign(self) -> f64 {
        match self {
            Motion::Stuck => 0.0,
            Motion::Forward => 1.0,
            Motion::Backward => -1.0,
        }
    }

    pub(crate) fn along(torque: f64) -> Motion {
        if torque > 0.0 { Motion::Forward } else { Motion::Backward }
    }
}

/// The state of the shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaft {
    /// `θ`, rad.
    pub position: f64,
    /// `θ̇`, rad/s.
    pub velocity: f64,
    /// Stuck or slipping.
    pub motion: Motion,
    /// Bend of the bristles of a friction that has some.
    pub bend: Bend<f64>,
}

impl Shaft {
    /// A shaft at a position and a velocity; at rest it is stuck until the first check.
    #[must_use]
    pub fn new(position: f64, velocity: f64) -> Self {
        let motion = if velocity == 0.0 { Motion::Stuck } else { Motion::along(velocity) };
        Shaft { position, velocity, motion, bend: Bend::none() }
    }
}

/// The plant (1) that an engine integrates, with friction that may vary along the disc.
#[derive(Clone, Debug)]
pub struct Model {
    /// Inertia, damping, actuator, friction law.
    pub plant: Plant<f64>,
    /// Friction along the disc; none = even.
    pub ripple: Option<Ripple>,
}

impl Model {
    /// Factor on friction at a position.
    #[inline]
    pub(crate) fn friction_factor(&self, position: f64) -> f64 {
        self.ripple.as_ref().map_or(1.0, |r| r.factor(position))
    }

    /// `|T|` that friction holds at rest, N m.
    #[inline]
    pub(crate) fn break_away_torque(&self, position: f64, volts: f64) -> f64 {
        self.plant.break_away_torque(volts) * self.friction_factor(position)
    }
}

/// The voltage between two samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Volts {
    /// Held, V.
    Held(f64),
    /// On the way from one voltage to another through a first-order actuator.
    Lag {
        /// At the sample, V.
        from: f64,
        /// Commanded, V.
        to: f64,
        /// Time constant, s.
        time_constant: f64,
    },
}

impl Volts {
    /// The most that the voltage bends upwards from `s` on, and downwards, V/s².
    fn curvature(self, s: f64) -> (f64, f64) {
        match self {
            Volts::Held(_) => (0.0, 0.0),
            Volts::Lag { from, to, time_constant } => {
                let bends = (from - to) * libm::exp(-s / time_constant) / (time_constant * time_constant);
                (bends.max(0.0), (-bends).max(0.0))
            }
        }
    }

    /// The instant at which the voltage passes 0, on its way for so long; s after the sample.
    fn zero(self, duration: f64) -> Option<f64> {
        match self {
            Volts::Lag { from, to, time_constant } if from * to < 0.0 => {
                let s = time_constant * libm::log1p(-from / to);
                (s > 0.0 && s < duration).then_some(s)
            }
            _ => None,
        }
    }

    /// `s` seconds after the sample, V.
    #[inline]
    pub(crate) fn at(self, s: f64) -> f64 {
        match self {
            Volts::Held(v) => v,
            Volts::Lag { from, to, time_constant } => to + (from - to) * libm::exp(-s / time_constant),
        }
    }
}

/// Inputs that act on the shaft between two samples.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a> {
    /// Time of the sample, s.
    pub time: f64,
    /// Length of the interval, s.
    pub duration: f64,
    /// Position at which the run began, rad: what a spring's angle counts from.
    pub origin: f64,
    /// Voltage of the actuator.
    pub volts: Volts,
    /// Driving torque.
    pub drive: &'a Drive,
    /// Torque noise, held over the interval, N m.
    pub noise: f64,
}

impl Input<'_> {
    /// Torque of drive and actuator `s` seconds after the sample, N m.
    #[inline]
    pub(crate) fn torque(&self, model: &Model, s: f64, position: f64) -> f64 {
        let drive = self.drive.torque(self.time + s, position - self.origin) + self.noise;
        drive + model.plant.actuator().torque(self.volts.at(s))
    }

    /// The part from `from` to `to` seconds after the sample.
    fn part(&self, from: f64, to: f64) -> Self {
        let volts = match self.volts {
            Volts::Held(v) => Volts::Held(v),
            lag @ Volts::Lag { to, time_constant, .. } => {
                Volts::Lag { from: lag.at(from), to, time_constant }
            }
        };
        Input { time: self.time + from, duration: to - from, volts, ..*self }
    }

    /// Voltage and torque stay the same over the interval.
    pub(crate) fn is_constant(&self) -> bool {
        matches!(self.volts, Volts::Held(_)) && self.drive.is_constant()
    }
}

/// An event between two samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Time of the event, s.
    pub time: f64,
    /// Its kind.
    pub kind: EventKind,
    /// Position of the shaft then, rad.
    pub position: f64,
    /// Torque of drive and actuator then, N m.
    pub torque: f64,
}

/// Kinds of events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// The shaft came to rest and is held.
    Stick,
    /// The shaft broke away.
    BreakAway,
}

/// An engine gave up.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum EngineError {
    /// Too many steps or events in one interval.
    #[error(
        "the motion after t = {time} s needs more than {limit} steps in one sampling period: \
         a parameter of the rig is out of all proportion (a tiny inertia or Stribeck velocity, stiff bristles, or a Stribeck exponent far from 1?)"
    )]
    TooManySteps {
        /// Start of the interval, s.
        time: f64,
        /// The limit.
        limit: u32,
    },
    /// The engine cannot take the rig.
    #[error("the exact flow needs {0}")]
    Refused(
        /// Its requirement.
        &'static str,
    ),
    /// The state is no longer a number.
    #[error("the motion after t = {time} s left the range of numbers")]
    NotFinite {
        /// Start of the interval, s.
        time: f64,
    },
}

/// Moves a shaft over an interval.
pub trait Engine {
    /// Moves `shaft` to the end of an interval in which the driving torque has no corner, and
    /// adds what happened to `events`.
    ///
    /// # Errors
    /// If the motion cannot be followed; the shaft is then where it was last sure.
    fn advance_smooth(
        &mut self,
        model: &Model,
        input: &Input<'_>,
        shaft: &mut Shaft,
        events: &mut Vec<Event>,
    ) -> Result<(), EngineError>;

    /// Moves `shaft` to the end of the interval and adds what happened to `events`.
    ///
    /// # Errors
    /// If the motion cannot be followed; the shaft is then where it was last sure.
    fn advance(
        &mut self,
        model: &Model,
        input: &Input<'_>,
        shaft: &mut Shaft,
        events: &mut Vec<Event>,
    ) -> Result<(), EngineError> {
        // No step goes over the instant at which a pad begins to press, or a motor turns its torque round.
        if let Some(s) = input.volts.zero(input.duration) {
            self.advance(model, &input.part(0.0, s), shaft, events)?;
            let after = match input.volts {
                Volts::Lag { to, time_constant, .. } => Volts::Lag { from: 0.0, to, time_constant },
                held @ Volts::Held(_) => held,
            };
            let after = Input { volts: after, ..input.part(s, input.duration) };
            return self.advance(model, &after, shaft, events);
        }
        // Nor over a corner of a torque table: neither the pair's error estimate nor the
        // search for break-away would see a short pulse.
        let end = input.time + input.duration;
        let mut s = 0.0;
        for corner in input.drive.corners(input.time, end) {
            let at = corner - input.time;
            self.advance_smooth(model, &input.part(s, at), shaft, events)?;
            s = at;
        }
        self.advance_smooth(model, &input.part(s, input.duration), shaft, events)
    }
}

clutch_core::words! {
    /// Engine that integrates the motion.
    pub enum EngineKind {
        /// The exact flow where the rig allows it, else Dormand–Prince; the engine of bristles for a friction that has some.
        Auto = "auto" default,
        /// Dormand and Prince's 5(4) pair, the paper's solver, with events: takes every rig whose friction has no bristles.
        DormandPrince = "dormand_prince",
        /// Closed forms, quadrature and series of the motion between samples: for friction that falls exponentially with the
        /// speed and is even along the disc, torque and voltage held between samples.
        ExactFlow = "exact_flow",
        /// A Rosenbrock method for stiff motions: for friction with bristles (LuGre, Dahl, elasto-plastic, Maxwell).
        Bristle = "bristle",
    }
}

/// Halvings of an interval that a search for break-away makes at most: one of a millisecond then is 1e-18 s long.
const HALVINGS: u32 = 50;
/// Halvings after which an instant that no bound excludes is passed over: the excess of torque there is below what its
/// curvature makes in a millionth of the interval.
const EXCLUDED: u32 = 20;

/// The first instant after `s` at which a stuck shaft breaks away, if it does before the end.
///
/// The instant given back is on the far side of the root: there the torque exceeds friction. No root is stepped over:
/// between two instants the excess of torque over friction rises above its ends by an eighth of the time squared times
/// the bound of its curvature, at most; where that is not enough to exclude a root, the time is halved.
fn break_away(model: &Model, input: &Input<'_>, position: f64, s: f64) -> Option<f64> {
    let excess = |s: f64| {
        input.torque(model, s, position).abs() - model.break_away_torque(position, input.volts.at(s))
    };
    let begin = excess(s);
    if begin > 0.0 {
        return Some(s);
    }
    if input.is_constant() {
        return None;
    }
    let actuator = model.plant.actuator();
    let friction = model.plant.friction().at_rest() * model.friction_factor(position);
    let drives = actuator.motor_gain() * (1.0 + friction * actuator.load_share());
    let search = Search { input, excess, presses: friction * actuator.brake_gain(), drives };
    search.first((s, begin), (input.duration, excess(input.duration)), 0)
}

/// A search for the first root of the excess of torque.
struct Search<'a, F> {
    input: &'a Input<'a>,
    excess: F,
    /// Torque that friction holds for each volt on a brake, N m/V.
    presses: f64,
    /// Torque for each volt of a motor, and what its friction holds, N m/V.
    drives: f64,
}

impl<F: Fn(f64) -> f64> Search<'_, F> {
    /// The first instant with an excess after `a`, which has none; `a` and `b` are instants and their excess.
    fn first(&self, a: (f64, f64), b: (f64, f64), halvings: u32) -> Option<f64> {
        let none_at_the_end = b.1 <= 0.0;
        if none_at_the_end {
            let length = b.0 - a.0;
            // |T| bends upwards where T changes its sign: that only lowers it between two ends.
            let (up, down) = self.input.volts.curvature(a.0);
            let bends = self.presses * up + self.drives * up.max(down);
            let curvature = self.input.drive.curvature() + bends;
            if a.1.max(b.1) + 0.125 * curvature * length * length <= 0.0 || halvings >= EXCLUDED {
                return None;
            }
        }
        let middle = 0.5 * (a.0 + b.0);
        if halvings >= HALVINGS || middle <= a.0 || middle >= b.0 {
            return (!none_at_the_end).then_some(b.0);
        }
        let m = (middle, (self.excess)(middle));
        match self.first(a, m, halvings + 1) {
            Some(instant) => Some(instant),
            None if m.1 > 0.0 => Some(m.0),
            None => self.first(m, b, halvings + 1),
        }
    }
}
