//! The motion between two samples where friction follows (2) with δ = 1.
//!
//! With voltage and torque held, and the speed `ω = v_s s ≥ 0` taken along the motion,
//!
//! ```text
//! ṡ = φ,   φ = A − G s − q,   q = K e^(−s),        A = (T − N μ_d)/(J v_s),  G = C/J,
//! φ̇ = (q − G) φ,   q̇ = −q φ                        K = N Δμ/(J v_s),  Δμ = μ_s − μ_d
//! ```
//!
//! An interval is cut into pieces, each taken by the cheapest way whose estimate of its own error is small enough:
//!
//! 1. Far above the layer the motion is linear: speed and way are in closed form; above it, the same with what `q` does to
//!    third order.
//! 2. In the layer `t = ∫ ds/φ` and `∫ s ds/φ` by quadrature to a speed that the motion with frozen drag gives; near a
//!    balance, as in a soft break-away, with the pole of `1/φ` taken off.
//! 3. `s`, `φ` and `q` are power series in time where the integrand is too steep all the same; all that the
//!    recurrence of their coefficients needs is one product of two series. The error is relative to the rate even where
//!    that is nearly nothing: the layer blows it up no more than it blows up the motion. `φ` is carried on as a number
//!    of its own and not taken anew as a difference of large ones.
//! 4. Stuck: nothing to integrate; break-away is a comparison.
//!
//! `φ` never changes its sign: until it stops, if it does, the speed only rises or only falls. There is no balance to step
//! over. docs/theory.md has the derivation and the errors that were measured.

mod above;
mod flow;
mod series;
mod state;
mod through;
mod tolerance;

pub(crate) use flow::{Flow, PIECE_LIMIT, Piece, Whole};
pub(crate) use state::State;

use super::{Engine, EngineError, Event, EventKind, Input, Model, Motion, Shaft, Volts};
use crate::lane::Lane;
use clutch_core::friction::{Exponential, FrictionModel};

/// Speed, in Stribeck velocities, above which `q` adds less than 1e-14 of it, if `K` times the time left is 20; else the logarithm
/// of that over 20 comes on top.
pub(crate) const LINEAR_ABOVE: f64 = 32.0;
/// Speed, in Stribeck velocities, above which a motion in lanes goes on alone if the layer reaches as far.
pub(crate) const HIGHEST_EDGE: f64 = 700.0;

/// The fast engine.
#[derive(Clone, Copy, Debug, Default)]
pub struct ExactFlow;

impl ExactFlow {
    /// The reason that this engine cannot take a rig; `None` if it can.
    #[must_use]
    pub fn refuses(model: &Model, drive_is_constant: bool, actuator_lags: bool) -> Option<&'static str> {
        if model.plant.friction().exponential().is_none() {
            Some(
                "friction that falls exponentially with the speed (Coulomb's, or Stribeck's with an exponent of 1)",
            )
        } else if model.ripple.is_some() {
            Some("friction that does not vary along the disc")
        } else if !drive_is_constant {
            Some("a driving torque that is constant between samples (a weight)")
        } else if actuator_lags {
            Some("an actuator without lag")
        } else {
            None
        }
    }
}

/// The shaft and its friction, of a run or of several.
#[derive(Clone, Copy)]
pub(crate) struct Bed<V: Lane> {
    curve: Exponential<V>,
    /// Coulomb's friction drops from rest to motion; Stribeck's does not.
    drops: V::Mask,
    /// `1/v_s`, s/rad, and `1/(J v_s)`, 1/(kg m² rad/s); `Δμ` times that.
    per_velocity: V,
    per_unit: V,
    drop: V,
    /// `G`, 1/s.
    drag: V,
}

/// Torque and friction that act on the shaft over an interval.
#[derive(Clone, Copy)]
pub(crate) struct Pushed<V> {
    /// Torque of drive and actuator, N m.
    pub(crate) torque: V,
    /// Normal force, as torque per unit of μ, N m.
    pub(crate) normal: V,
    /// Torque up to which friction holds, N m.
    pub(crate) holds: V,
}

impl Pushed<f64> {
    /// Torque and friction under a voltage and a driving torque that stay as they are.
    #[inline]
    pub(crate) fn by(model: &Model, input: &Input<'_>) -> Self {
        let volts = input.volts.at(0.0);
        Pushed {
            torque: input.torque(model, 0.0, 0.0),
            normal: model.plant.actuator().normal(volts),
            holds: model.break_away_torque(0.0, volts),
        }
    }
}

impl<V: Lane> Pushed<V> {
    /// Torque and friction of one lane.
    pub(crate) fn lane(&self, i: usize) -> Pushed<f64> {
        Pushed { torque: self.torque.lane(i), normal: self.normal.lane(i), holds: self.holds.lane(i) }
    }
}

impl Bed<f64> {
    /// The shaft and the friction of a model; none if friction is of another kind.
    pub(crate) fn of(model: &Model) -> Option<Self> {
        let (p, friction) = (model.plant.params(), model.plant.friction());
        let curve = friction.exponential()?;
        Some(Bed {
            curve,
            drops: curve.at_rest < friction.at_rest(),
            per_velocity: 1.0 / curve.velocity,
            per_unit: 1.0 / (p.inertia * curve.velocity),
            drop: (curve.at_rest - curve.sliding) / (p.inertia * curve.velocity),
            drag: p.viscous_damping / p.inertia,
        })
    }
}

impl<V: Lane> Bed<V> {
    /// Shafts and frictions of several runs as one.
    pub(crate) fn in_lanes(beds: &[Bed<f64>]) -> Self {
        let of = |get: fn(&Bed<f64>) -> f64| V::of(|i| get(&beds[i]));
        Bed {
            curve: Exponential {
                at_rest: of(|b| b.curve.at_rest),
                sliding: of(|b| b.curve.sliding),
                velocity: of(|b| b.curve.velocity),
            },
            drops: V::ZERO.less(of(|b| if b.drops { 1.0 } else { 0.0 })),
            per_velocity: of(|b| b.per_velocity),
            per_unit: of(|b| b.per_unit),
            drop: of(|b| b.drop),
            drag: of(|b| b.drag),
        }
    }

    /// Stribeck velocity, rad/s.
    #[inline(always)]
    pub(crate) fn velocity(&self) -> V {
        self.curve.velocity
    }

    /// Speed of a velocity along the motion, in Stribeck velocities.
    #[inline(always)]
    pub(crate) fn speed(&self, along: V) -> V {
        along * self.per_velocity
    }

    /// What a linear motion takes with it over a whole period.
    #[inline(always)]
    pub(crate) fn whole(&self, period: V) -> Whole<V> {
        Whole::of(self.drag, period)
    }

    /// The constants of the next `left` seconds, seen along a motion whose sign is `sign`.
    #[inline(always)]
    pub(crate) fn flow(&self, pushed: &Pushed<V>, sign: V, left: V) -> Flow<V> {
        let Pushed { torque, normal, holds } = *pushed;
        let Exponential { at_rest, sliding, .. } = self.curve;
        let stribeck = normal * self.drop;
        // The number that was compared with.
        let first = V::select(self.drops, normal * at_rest, holds);
        let along = sign * torque;
        let excess = along - first;
        // Without a layer both are one number, rounded once: the break-away that was seen has to happen.
        let even = V::same(stribeck, V::ZERO);
        let drive = V::select(even, excess, along - normal * sliding) * self.per_unit;
        let edge = edge(stribeck.abs() * left);
        Flow { drive, excess: excess * self.per_unit, drag: self.drag, stribeck, edge }
    }
}

/// Speed above which `q` is next to nothing, where `K` times the time left is `lost`.
#[inline(always)]
fn edge<V: Lane>(lost: V) -> V {
    // A tangent of the logarithm is above it.
    let tangent = V::splat(LINEAR_ABOVE - 1.0) + V::splat(0.05) * lost;
    let near = lost.less(V::splat(400.0));
    if V::all(near) {
        return tangent;
    }
    V::select(near, tangent, V::splat(LINEAR_ABOVE) + (lost * V::splat(0.05)).log())
}

impl Bed<f64> {
    /// Moves `shaft` over an interval that begins at `time` and lasts for `duration`, s, and adds what happened to `events`.
    /// If the motion has begun already, `begun` has its flow, its state, and whether it stops there.
    ///
    /// # Errors
    /// If the motion cannot be followed.
    pub(crate) fn advance(
        &self,
        pushed: &Pushed<f64>,
        (time, duration): (f64, f64),
        shaft: &mut Shaft,
        events: &mut Vec<Event>,
        mut begun: Option<(Flow<f64>, State<f64>, bool)>,
    ) -> Result<(), EngineError> {
        let Pushed { torque, holds, .. } = *pushed;
        let v_s = self.curve.velocity;
        let event = |kind, s: f64, position| Event { time: time + s, kind, position, torque };
        let mut s = 0.0;
        // It stops once at most; then it stays, or rises the other way.
        for _ in 0..3 {
            if shaft.motion == Motion::Stuck {
                let breaks_away = torque.abs() > holds;
                if s >= duration || !breaks_away {
                    return Ok(());
                }
                shaft.motion = Motion::along(torque);
                events.push(event(EventKind::BreakAway, s, shaft.position));
            }
            let (sign, left) = (shaft.motion.sign(), duration - s);
            let run = match begun.take() {
                Some((_, end, true)) => Some((State { speed: 0.0, ..end }, true)),
                Some((flow, at, false)) => flow.run(at, left),
                None => {
                    let speed = self.speed(sign * shaft.velocity);
                    self.flow(pushed, sign, left).run(State::at(speed), left)
                }
            };
            let Some((end, stops)) = run else {
                return Err(EngineError::TooManySteps { time, limit: PIECE_LIMIT });
            };
            if !(end.way.is_finite() && end.speed.is_finite()) {
                return Err(EngineError::NotFinite { time });
            }
            shaft.position += sign * v_s * end.way;
            shaft.velocity = sign * v_s * end.speed;
            if !stops {
                return Ok(());
            }
            s += end.time;
            shaft.velocity = 0.0;
            if torque.abs() <= holds {
                shaft.motion = Motion::Stuck;
                events.push(event(EventKind::Stick, s, shaft.position));
                return Ok(());
            }
            shaft.motion = Motion::along(torque);
        }
        Err(EngineError::TooManySteps { time, limit: 3 })
    }
}

impl Engine for ExactFlow {
    fn advance_smooth(
        &mut self,
        model: &Model,
        input: &Input<'_>,
        shaft: &mut Shaft,
        events: &mut Vec<Event>,
    ) -> Result<(), EngineError> {
        let lags = matches!(input.volts, Volts::Lag { .. });
        if let Some(needs) = ExactFlow::refuses(model, input.drive.is_constant(), lags) {
            return Err(EngineError::Refused(needs));
        }
        let Some(bed) = Bed::of(model) else {
            return Err(EngineError::Refused("friction that falls exponentially with the speed"));
        };
        let pushed = Pushed::by(model, input);
        bed.advance(&pushed, (input.time, input.duration), shaft, events, None)
    }
}
