//! The motion between two samples in closed form, where friction follows (2) with δ = 1.
//!
//! With voltage and torque held, and the speed `ω ≥ 0` taken along the motion,
//!
//! ```text
//! J ω̇ = T − b μ_d − C ω − b Δμ exp(−ω/v_s),     b = K_COF v_a,  Δμ = μ_s − μ_d
//! ```
//!
//! 1. `ω > 37 v_s`: the last term is below half an ulp of `μ_d`; the rest is linear, with
//!    velocity, position and the instant of leaving the range in closed form.
//! 2. below: with the viscous drag frozen at the mean velocity of a short interval,
//!    `a = (T − b μ_d − C ω_m)/J`, `k = b Δμ/J` and `z = exp(ω/v_s)`, the equation is
//!    `ż = (a z − k)/v_s`: linear again. Velocity and the instant of stopping cost a logarithm;
//!    the position is a Gauss–Legendre sum over the velocity.
//! 3. stuck: nothing to integrate; break-away is a comparison.

use super::{Engine, EngineError, Event, EventKind, Input, Model, Motion, Shaft, Volts, break_away};

/// Speed, in Stribeck velocities, above which the exponential is lost in rounding.
const LINEAR_ABOVE: f64 = 37.0;
/// Length of an interval of frozen drag against the Stribeck term's own time.
const SHARE: f64 = 0.1;
/// Intervals of frozen drag per sampling period, at most.
const SUB_INTERVALS: f64 = 64.0;
/// Pieces in one interval before the engine gives up.
const PIECE_LIMIT: u32 = 10_000;

/// Gauss–Legendre, five points on [0, 1].
const NODES: [f64; 5] =
    [0.046_910_077_030_668_0, 0.230_765_344_947_158_45, 0.5, 0.769_234_655_052_841_5, 0.953_089_922_969_332];
const WEIGHTS: [f64; 5] = [
    0.118_463_442_528_094_54,
    0.239_314_335_249_683_23,
    0.284_444_444_444_444_44,
    0.239_314_335_249_683_23,
    0.118_463_442_528_094_54,
];

/// The fast engine.
#[derive(Clone, Copy, Debug, Default)]
pub struct ExactFlow;

impl ExactFlow {
    /// Why this engine cannot take a rig; `None` if it can.
    #[must_use]
    pub fn refuses(model: &Model, drive_is_constant: bool, actuator_lags: bool) -> Option<&'static str> {
        #[allow(clippy::float_cmp_const, reason = "the closed form holds for exactly 1")]
        if model.plant.params().friction.stribeck_exponent != 1.0 {
            Some("a Stribeck exponent of 1")
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

/// The constants of one interval, seen along the motion.
#[derive(Clone, Copy)]
struct Flow {
    /// `(T − b μ_d)/J`
    drive: f64,
    /// `C/J`
    drag: f64,
    /// `k = b Δμ/J`
    stribeck: f64,
    v_s: f64,
}

/// One piece of motion.
struct Piece {
    time: f64,
    velocity: f64,
    distance: f64,
    stops: bool,
}

/// `(1 − e^{−x})/x`
fn decay_mean(x: f64) -> f64 {
    if x.abs() < 1e-300 { 1.0 } else { -libm::expm1(-x) / x }
}

impl Flow {
    /// Velocity and distance after `t` where the Stribeck term is nothing.
    fn linear(&self, w0: f64, t: f64) -> (f64, f64) {
        let x = self.drag * t;
        let mean = decay_mean(x);
        // ∫ t·(1−e^{−ct})/(ct) has the closed form below; for small ct the series avoids the
        // cancellation.
        let mean2 = if x.abs() < 1e-3 {
            0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x / 120.0))
        } else {
            (1.0 - mean) / x
        };
        let rate = self.drive - self.drag * w0;
        (w0 + rate * t * mean, w0 * t + rate * t * t * mean2)
    }

    /// Time until the linear motion has speed `to`, if it ever has.
    fn linear_reaches(&self, w0: f64, to: f64) -> Option<f64> {
        let rate = self.drive - self.drag * w0;
        if rate >= 0.0 {
            return None;
        }
        let y = (w0 - to) / -rate;
        if self.drag * y < 1e-12 {
            return Some(y);
        }
        // w0 − to = −rate (1 − e^{−ct})/c
        let share = self.drag * y;
        (share < 1.0).then(|| -libm::log1p(-share) / self.drag)
    }

    /// Velocity after `t` with the drag frozen, where `a` is the acceleration without Stribeck
    /// term; not above 0 where the shaft has stopped before.
    fn layer(&self, w0: f64, a: f64, t: f64) -> f64 {
        let x = a * t / self.v_s;
        let y = -(self.stribeck * t / self.v_s) * libm::exp(-w0 / self.v_s) * decay_mean(x);
        if y <= -1.0 { -1.0 } else { w0 + a * t + self.v_s * libm::log1p(y) }
    }

    /// The instant at which the velocity with the drag frozen reaches 0.
    fn layer_stop(&self, w0: f64, a: f64) -> f64 {
        let e = libm::expm1(w0 / self.v_s); // z0 − 1
        let d = a * (e + 1.0) - self.stribeck;
        let y = a * e / d;
        if y.abs() < 1e-12 { -self.v_s * e / d } else { self.v_s / a * libm::log1p(-y) }
    }

    /// The next piece of motion from speed `w0`, no longer than `left`.
    fn piece(&self, w0: f64, left: f64, period: f64) -> Piece {
        let edge = LINEAR_ABOVE * self.v_s;
        let plain = self.stribeck == 0.0;
        if plain || w0 > edge {
            let to = if plain { 0.0 } else { edge };
            let reached = self.linear_reaches(w0, to).filter(|t| *t < left);
            let time = reached.unwrap_or(left);
            let (velocity, distance) = self.linear(w0, time);
            let velocity = if reached.is_some() { to } else { velocity };
            return Piece { time, velocity, distance, stops: plain && reached.is_some() };
        }
        // Within the layer: short against the time in which the Stribeck term changes at the
        // lowest speed that this interval can see.
        let mut a = self.drive - self.drag * w0;
        let lowest = (w0 - (a.abs() + self.stribeck.abs()) * left).max(0.0);
        let change = self.v_s / (self.stribeck.abs() * libm::exp(-lowest / self.v_s));
        let longest = left.min((SHARE * change).max(period / SUB_INTERVALS)).min(30.0 * self.v_s / a.abs());
        let mut piece = self.frozen(w0, a, longest);
        // The drag's impulse is that of the mean velocity; two rounds settle it.
        for _ in 0..2 {
            a = self.drive - self.drag * piece.distance / piece.time;
            piece = self.frozen(w0, a, longest);
        }
        // Where the velocity changes, drag that is spread evenly acts too early or too late: the
        // leading term of what that does to the position.
        piece.distance += self.drag * (piece.velocity - w0) * piece.time * piece.time / 12.0;
        piece
    }

    /// Motion in the layer at a given acceleration without Stribeck term, until `time` or the
    /// stop.
    fn frozen(&self, w0: f64, a: f64, time: f64) -> Piece {
        let velocity = self.layer(w0, a, time);
        let stops = velocity <= 0.0;
        let time = if stops { self.layer_stop(w0, a).min(time) } else { time };
        let sum: f64 =
            NODES.iter().zip(WEIGHTS).map(|(node, weight)| weight * self.layer(w0, a, node * time)).sum();
        Piece { time, velocity: velocity.max(0.0), distance: time * sum, stops }
    }
}

impl Engine for ExactFlow {
    fn advance(
        &mut self,
        model: &Model,
        input: &Input<'_>,
        shaft: &mut Shaft,
        events: &mut Vec<Event>,
    ) -> Result<(), EngineError> {
        let volts = match input.volts {
            Volts::Held(v) => v,
            Volts::Lag { from, .. } => from, // refused when the run was set up
        };
        let (p, torque) = (model.plant.params(), input.torque(0.0, shaft.position));
        let (brake, holds) = (p.brake_gain * volts.max(0.0), model.break_away_torque(0.0, volts));
        let mut s = 0.0;
        let event = |kind, s: f64, position| Event { time: input.time + s, kind, position, torque };
        for _ in 0..PIECE_LIMIT {
            if s >= input.duration {
                return Ok(());
            }
            if shaft.motion == Motion::Stuck {
                if break_away(model, input, shaft.position, s).is_none() {
                    return Ok(());
                }
                shaft.motion = Motion::along(torque);
                events.push(event(EventKind::BreakAway, s, shaft.position));
            }
            let sign = shaft.motion.sign();
            let flow = Flow {
                drive: (sign * torque - brake * p.friction.mu_dynamic) / p.inertia,
                drag: p.viscous_damping / p.inertia,
                stribeck: brake * (p.friction.mu_static - p.friction.mu_dynamic) / p.inertia,
                v_s: p.friction.stribeck_velocity,
            };
            let piece = flow.piece(sign * shaft.velocity, input.duration - s, input.duration);
            s += piece.time;
            shaft.position += sign * piece.distance;
            shaft.velocity = sign * piece.velocity;
            if !(shaft.position.is_finite() && shaft.velocity.is_finite()) {
                return Err(EngineError::NotFinite { time: input.time });
            }
            if piece.stops {
                shaft.velocity = 0.0;
                if torque.abs() <= holds {
                    shaft.motion = Motion::Stuck;
                    events.push(event(EventKind::Stick, s, shaft.position));
                } else {
                    shaft.motion = Motion::along(torque);
                }
            }
        }
        Err(EngineError::TooManySteps { time: input.time, limit: PIECE_LIMIT })
    }
}
