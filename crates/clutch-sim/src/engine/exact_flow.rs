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
//! 2. below: with the viscous drag frozen at a velocity `ω_m`, `a = (T − b μ_d − C ω_m)/J`,
//!    `k = b Δμ/J` and `z = exp(ω/v_s)`, the equation is `ż = (a z − k)/v_s`: linear again.
//!    Velocity, and the instant at which it has a given value, cost a logarithm. What the drag
//!    does beyond its frozen value is a perturbation, `δω̇ = −(C/J)(ω − ω_m) + (k/v_s) e^{−ω/v_s}
//!    δω`, which the same quadrature integrates that gives the position: Gauss–Legendre on pieces
//!    that end at fixed multiples of `v_s`, where the curve bends.
//! 3. stuck: nothing to integrate; break-away is a comparison.

use super::{Engine, EngineError, Event, EventKind, Input, Model, Motion, Shaft, Volts, break_away};
use clutch_core::friction::FrictionModel;

/// Speed, in Stribeck velocities, above which the exponential is lost in rounding.
const LINEAR_ABOVE: f64 = 37.0;
/// Speeds, in Stribeck velocities, at which pieces end: above the first the curve is nearly
/// straight, below the second it bends most.
const BORDERS: [f64; 2] = [8.0, 2.5];
/// Error of the velocity from which a piece is taken a second time, rad/s.
const SQUARE: f64 = 1e-10;
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
        if model.plant.friction().exponential().is_none() {
            Some("friction that falls exponentially with the speed (Stribeck's with an exponent of 1)")
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

/// Motion in the layer with the drag frozen.
#[derive(Clone, Copy)]
struct Frozen {
    w0: f64,
    /// `exp(−w0/v_s)`
    inverse_z0: f64,
    a: f64,
    k: f64,
    v_s: f64,
}

impl Frozen {
    /// Velocity after `t`; negative where the shaft has stopped before.
    fn velocity(&self, t: f64) -> f64 {
        let y = -(self.k * t / self.v_s) * self.inverse_z0 * decay_mean(self.a * t / self.v_s);
        if y <= -1.0 { -1.0 } else { self.w0 + self.a * t + self.v_s * libm::log1p(y) }
    }

    /// The instant at which the velocity is `to`; meaningful only if it ever is.
    fn reaches(&self, to: f64) -> f64 {
        // z(t) = z1 where e^{at/v} = (a z1 − k)/(a z0 − k).
        let d = self.a - self.k * self.inverse_z0;
        let rise = libm::expm1((to - self.w0) / self.v_s);
        let y = self.a * rise / d;
        if y.abs() < 1e-12 {
            self.v_s * rise / d
        } else if y.abs() < 0.5 {
            self.v_s / self.a * libm::log1p(y)
        } else {
            // The same with ln(z1/z0) taken out: y near −1 has lost its digits.
            let fall = -self.k * self.inverse_z0 * libm::expm1((self.w0 - to) / self.v_s);
            ((to - self.w0) + self.v_s * libm::log1p(fall / d)) / self.a
        }
    }

    /// How much a deviation of the velocity at `t` has grown when the velocity is `w1` at `t1`.
    fn growth(&self, t: f64, w: f64, t1: f64, w1: f64) -> f64 {
        libm::exp((w - w1 + self.a * (t1 - t)) / self.v_s)
    }
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

    /// The next piece of motion from speed `w0`, no longer than `left`.
    fn piece(&self, w0: f64, left: f64) -> Piece {
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
        // In the layer. With frozen drag the velocity rises or falls throughout.
        let inverse_z0 = libm::exp(-w0 / self.v_s);
        let frozen = |at: f64| Frozen {
            w0,
            inverse_z0,
            a: self.drive - self.drag * at,
            k: self.stribeck,
            v_s: self.v_s,
        };
        let longest = left.min(30.0 * self.v_s / (self.drive - self.drag * w0).abs());
        let guess = frozen(w0).velocity(longest);
        let rising = guess > w0;
        let border = if rising {
            BORDERS.iter().rev().map(|b| b * self.v_s).find(|b| *b > w0 && *b < guess)
        } else {
            BORDERS.iter().map(|b| b * self.v_s).find(|b| *b < w0 && *b > guess)
        };
        let to = border.unwrap_or(guess.max(0.0));
        let middle = 0.5 * (w0 + to);
        let (piece, better) = self.frozen_piece(frozen(middle), middle, longest, border, left);
        // Where the layer blows the drag's deviation up, its square counts: freeze the drag at the
        // velocity at which nothing deviates, to first order, by the end.
        if better.1 > SQUARE {
            self.frozen_piece(frozen(better.0), better.0, longest, border, left).0
        } else {
            piece
        }
    }

    /// A piece with the drag frozen at `middle` and the rest of it as a perturbation; the velocity
    /// at which freezing leaves no deviation at the end, and what the square of the deviation
    /// does to the velocity.
    fn frozen_piece(
        &self,
        flow: Frozen,
        middle: f64,
        longest: f64,
        border: Option<f64>,
        left: f64,
    ) -> (Piece, (f64, f64)) {
        let w0 = flow.w0;
        let mut time = longest;
        let mut velocity = flow.velocity(time);
        let mut stops = false;
        match border {
            Some(border) if (velocity > border) == (border > w0) => {
                (time, velocity) = (flow.reaches(border).clamp(0.0, time), border);
            }
            _ if velocity <= 0.0 => {
                (time, velocity) = (flow.reaches(0.0).clamp(0.0, time), 0.0);
                stops = true;
            }
            _ => {}
        }
        let (mut mean, mut deviation, mut shift, mut total) = (0.0, 0.0, 0.0, 0.0);
        for (node, weight) in NODES.iter().zip(WEIGHTS) {
            let t = node * time;
            let w = flow.velocity(t);
            let growth = flow.growth(t, w, time, velocity);
            mean += weight * w;
            total += weight * growth;
            deviation += weight * (w - middle) * growth;
            // Simpson over what is left of the piece; half-way the growth is near its root.
            let sum = 1.0 + 4.0 * libm::sqrt(growth) + growth;
            shift += weight * (w - middle) * (time - t) * sum / 6.0;
        }
        let better = middle + deviation / total;
        let deviation = -self.drag * time * deviation;
        let square = deviation * deviation / self.v_s;
        let distance = time * (mean - self.drag * shift);
        let piece = if stops {
            // A deviation at the end is a stop a little later or earlier.
            let time = (time - deviation / (flow.a - flow.k)).clamp(0.0, left);
            Piece { time, velocity: 0.0, distance, stops }
        } else {
            Piece { time, velocity: (velocity + deviation).max(0.0), distance, stops }
        };
        (piece, (better, square))
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
        let volts = input.volts.at(0.0);
        let Some(friction) = model.plant.friction().exponential() else {
            return Err(EngineError::Refused("friction that falls exponentially with the speed"));
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
                drive: (sign * torque - brake * friction.sliding) / p.inertia,
                drag: p.viscous_damping / p.inertia,
                stribeck: brake * (friction.at_rest - friction.sliding) / p.inertia,
                v_s: friction.velocity,
            };
            let piece = flow.piece(sign * shaft.velocity, input.duration - s);
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
