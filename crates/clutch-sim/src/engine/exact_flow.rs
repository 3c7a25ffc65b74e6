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
//! 1. Where `q` is lost in rounding the motion is linear: velocity, position and the instant of leaving the range are in
//!    closed form; at the fringe of the layer with what `q` does to first order.
//! 2. In the layer `t = ∫ ds/φ` and `∫ s ds/φ` by quadrature to a speed that the motion with frozen drag gives.
//! 3. Where the integrand is too steep, as in a soft break-away, `s`, `φ` and `q` are power series in time; all that the
//!    recurrence of their coefficients needs is one product of two series. The error is relative to the rate even where
//!    that is nearly nothing: the layer blows it up no more than it blows up the motion. `φ` is carried on as a number
//!    of its own and not taken anew as a difference of large ones.
//! 4. Stuck: nothing to integrate; break-away is a comparison.
//!
//! `φ` never changes its sign: until it stops, if it does, the speed only rises or only falls. There is no balance to step
//! over. docs/theory.md has the derivation and the errors that were measured.

use super::{Engine, EngineError, Event, EventKind, Input, Model, Motion, Shaft, Volts, break_away};
use clutch_core::friction::FrictionModel;

/// Terms of a power series.
const TERMS: usize = 18;
/// Part that a piece may leave out, as a share of what it is: of a quadrature the time, of a series the rate of speed.
const TOLERANCE: f64 = 1e-10;
/// Longest step of a series, in Stribeck velocities: beyond, `e^(−s)` would need more terms.
const LONGEST: f64 = 6.0;
/// Share of `q` in the rate of speed below which first order is enough: the second is its square.
const FRINGE: f64 = 1e-5;
/// Way of a quadrature in the middle of the layer, in Stribeck velocities.
const REACH: f64 = 3.0;
/// Time, in the motion's own, that five terms of a series bridge.
const SHORT: f64 = 0.02;
/// Gauss and Legendre's eight points on [0, 1]: place, weight, and the weights that give the sixth and the seventh
/// coefficient of a series in Legendre's polynomials.
const NODES: [[f64; 4]; 8] = [
    [0.019855071751231912, 0.05061426814518853, 0.20989219106703316, -0.11769245644771334],
    [0.10166676129318664, 0.11119051722668721, -0.5591073831433644, 0.37789693708459166],
    [0.2372337950418355, 0.15685332293894344, 0.6166048635025351, -0.6317745531190041],
    [0.4082826787521751, 0.18134189168918083, -0.2673896714262035, 0.7849065579218123],
    [0.5917173212478248, 0.18134189168918083, -0.2673896714262035, -0.7849065579218123],
    [0.7627662049581645, 0.15685332293894344, 0.6166048635025351, 0.6317745531190041],
    [0.8983332387068134, 0.11119051722668721, -0.5591073831433644, -0.37789693708459166],
    [0.9801449282487681, 0.05061426814518853, 0.20989219106703316, 0.11769245644771334],
];
/// Distance from balance, as a share of the speed, that no double shows.
const BALANCED: f64 = 1e-17;
/// Speed, in Stribeck velocities, above which `q` is lost in rounding if `K` times the time left is below 20; else the
/// logarithm of that product comes on top.
const LINEAR_ABOVE: f64 = 40.0;
/// Pieces in one interval before the engine gives up.
const PIECE_LIMIT: u32 = 10_000;

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

/// The constants of one interval, seen along the motion; speeds are in Stribeck velocities.
#[derive(Clone, Copy)]
struct Flow {
    /// `A`, 1/s.
    drive: f64,
    /// `A − K`, 1/s: what is left of the torque at rest. The difference of the torques: near a break-away that of `A`
    /// and `K` has lost its digits.
    excess: f64,
    /// `G`, 1/s.
    drag: f64,
    /// `K`, 1/s.
    stribeck: f64,
    /// Speed above which `q` is lost in rounding.
    edge: f64,
}

/// A state within an interval.
#[derive(Clone, Copy)]
struct State {
    /// Since the begin of the interval, s.
    time: f64,
    /// `s`.
    speed: f64,
    /// `φ`, 1/s, where it is more than the speed gives.
    rate: Option<f64>,
    /// `∫ s dt`, s.
    way: f64,
}

/// `(1 − e^{−x})/x` and `(x − 1 + e^{−x})/x²`, for `x ≥ 0`.
fn decay_means(x: f64) -> (f64, f64) {
    if x > 0.1 {
        let mean = -libm::expm1(-x) / x;
        return (mean, (1.0 - mean) / x);
    }
    // Σ (−x)^n/(n+2)!
    let terms = if x < 1e-3 { 5 } else { 10 };
    let second = (2..2 + terms).rev().fold(0.0, |sum, n| (1.0 - x * sum) * INVERSE[n]);
    (1.0 - x * second, second)
}

impl Flow {
    /// `φ` at a speed, where `q` is `slip`.
    fn rate(&self, speed: f64, slip: f64) -> f64 {
        if speed < 1.0 {
            self.excess - self.drag * speed - self.stribeck * libm::expm1(-speed)
        } else {
            self.drive - self.drag * speed - slip
        }
    }

    /// Follows the motion from a speed for `left` seconds, or until it stops.
    fn run(&self, speed: f64, left: f64) -> Option<(State, bool)> {
        let mut at = State { time: 0.0, speed, rate: None, way: 0.0 };
        for _ in 0..PIECE_LIMIT {
            let rest = left - at.time;
            // The caller reports what is no number.
            if rest <= 0.0 || !at.speed.is_finite() {
                return Some((at, false));
            }
            let stops = if at.speed > self.edge || self.stribeck == 0.0 {
                self.linear(&mut at, rest, if self.stribeck == 0.0 { 0.0 } else { self.edge });
                self.stribeck == 0.0 && at.speed == 0.0
            } else {
                self.layer(&mut at, rest)
            };
            if stops {
                at.speed = 0.0;
                return Some((at, true));
            }
        }
        None
    }

    /// The motion without `q`: to the end, or until it has fallen to a speed.
    fn linear(&self, at: &mut State, rest: f64, to: f64) {
        let rate = self.drive - self.drag * at.speed;
        // s − to = −rate (1 − e^{−Gt})/G
        let fall = (at.speed - to) / -rate;
        let share = self.drag * fall;
        // The fall is never steeper than at first.
        let reached = if rate >= 0.0 || fall >= rest || share >= 1.0 {
            f64::INFINITY
        } else if self.drag == 0.0 {
            fall
        } else {
            -libm::log1p(-share) / self.drag
        };
        let reaches = reached < rest;
        let time = if reaches { reached } else { rest };
        let (mean, second) = decay_means(self.drag * time);
        at.way += at.speed * time + rate * time * time * second;
        at.time += time;
        at.speed = if reaches { to } else { (at.speed + rate * time * mean).max(0.0) };
        at.rate = None;
    }

    /// A piece in the layer, by the cheapest way whose estimate of its own error is small enough; true if it ends with a stop.
    fn layer(&self, at: &mut State, rest: f64) -> bool {
        let slip = self.stribeck * libm::exp(-at.speed);
        let rate = at.rate.unwrap_or_else(|| self.rate(at.speed, slip));
        if rate.abs() <= BALANCED * at.speed * (self.drag - slip) {
            at.way += at.speed * rest;
            at.time += rest;
            return false;
        }
        if self.fringe(at, rate + slip, slip, rest) {
            return false;
        }
        self.quadrature(at, rate, slip, rest).unwrap_or_else(|| series(at, rate, slip, self.drag, rest))
    }

    /// The outside of the layer, where `q` is below [`FRINGE`] of the rest: linear, and what `q` does beside that to first
    /// order, `δ̇ = −G δ − K e^(−l)` with `l` the linear motion. With `dl = φ dt` its integrals are those of `e^(−l)`
    /// over `φ²`, which is all but constant where `e^(−l)` is not small. False where the motion is not of this kind.
    fn fringe(&self, at: &mut State, from: f64, slip: f64, rest: f64) -> bool {
        let to = if from > 0.0 {
            if slip > FRINGE * from {
                return false;
            }
            0.0
        } else {
            libm::log(self.stribeck / (FRINGE * from.abs())).max(REACH)
        };
        let steep = self.drag <= 1e-3 * from.abs();
        if !(steep && self.stribeck > 0.0 && (from > 0.0 || at.speed > to + REACH)) {
            return false;
        }
        let begin = *at;
        self.linear(at, rest, to);
        let end = self.drive - self.drag * at.speed;
        let x = (at.speed - begin.speed).abs();
        let (fall, correction) = (-libm::expm1(-x), 1.0 + 2.0 * self.drag / from);
        let (deviation, way) = if from > 0.0 {
            let share = slip / from * correction;
            (-end / from * share * fall, -share / from * (x - fall))
        } else {
            let share = self.stribeck * libm::exp(-at.speed) / end * correction;
            (share * fall, -share / -end.abs() * (fall - x * libm::exp(-x)))
        };
        at.way += way;
        at.speed += deviation - 0.5 * deviation * deviation;
        true
    }

    /// The inside of the layer: `t = ∫ ds/φ` and `∫ s ds/φ` from the speed now to one that is guessed. The rest of
    /// the time, a little before or behind the end, is a short series of known terms. None where the integrand is too
    /// steep for [`NODES`], as in a soft break-away.
    fn quadrature(&self, at: &mut State, now: f64, slip: f64, rest: f64) -> Option<bool> {
        // With the drag as it is now, and then as it is half-way, the motion is in closed form.
        let guess = |drive: f64| {
            let y = -slip * rest * decay_mean(drive * rest);
            if y <= -1.0 { -f64::INFINITY } else { drive * rest + libm::log1p(y) }
        };
        let reach = if slip > 1e-2 * now || -slip > 2.5e-5 * now { REACH } else { 2.0 * REACH };
        let lowest = -at.speed.min(reach);
        let mut way = guess(now + slip).clamp(lowest, reach);
        if self.drag * rest > 1e-3 && way > lowest && way < reach {
            way = guess(now + slip - 0.5 * self.drag * way).clamp(lowest, reach);
        }
        // The cheaper exponential where the difference keeps its digits.
        let long = way.abs() > 0.5;
        let rate = |way: f64| {
            let fall = if long { libm::exp(-way) - 1.0 } else { libm::expm1(-way) };
            now - self.drag * way - slip * fall
        };
        let (mut time, mut moment, mut even, mut odd) = (0.0, 0.0, 0.0, 0.0);
        for [node, weight, sixth, seventh] in NODES {
            let inverse = 1.0 / rate(node * way);
            time += weight * inverse;
            moment += weight * node * inverse;
            even += sixth * inverse;
            odd += seventh * inverse;
        }
        // The coefficients of a series in Legendre's polynomials fall like those of a power series: what eight nodes
        // leave out is about the square of what the seventh coefficient is. An even integrand has none; its sixth is then
        // some three times as large.
        let last = odd.abs().max(even.abs() / 3.0) / time;
        if !(time * way > 0.0 && last * last <= TOLERANCE) {
            return None;
        }
        let (time, moment) = (time * way, moment * way * way);
        let stops = way == -at.speed;
        let left = rest - time;
        let mut to = State {
            time: at.time + time,
            speed: at.speed + way,
            rate: Some(rate(way)),
            way: at.way + at.speed * time + moment,
        };
        let slip = slip * libm::exp(-way);
        let short = left.abs() * (rate(way).abs() + slip.abs() + self.drag) <= SHORT;
        if left < 0.0 && !short {
            return None;
        }
        if left <= 0.0 || short && !stops {
            let (g1, rate) = (slip - self.drag, rate(way));
            let g2 = g1 * g1 - slip * rate;
            let g3 = g1 * g1 * g1 - 4.0 * g1 * slip * rate + slip * rate * rate;
            to.way += left * (to.speed + left / 2.0 * rate * (1.0 + left / 3.0 * (g1 + left / 4.0 * g2)));
            to.speed += left * rate * (1.0 + left / 2.0 * (g1 + left / 3.0 * (g2 + left / 4.0 * g3)));
            to.rate = None;
            to.time = at.time + rest;
            if to.speed < 0.0 {
                return None; // it stops at the very end
            }
            *at = to;
            return Some(false);
        }
        *at = to;
        Some(stops)
    }
}

/// `(1 − e^{−x})/x`
fn decay_mean(x: f64) -> f64 {
    if x.abs() < 1e-300 { 1.0 } else { -libm::expm1(-x) / x }
}

/// A step in the layer, where `q` is `slip`: to the end, as far as the series goes, or to the stop.
fn series(at: &mut State, now: f64, slip: f64, drag: f64, rest: f64) -> bool {
    // Time is counted in the motion's own, so that no coefficient leaves the range of numbers.
    let unit = now.abs() + slip.abs() + drag;
    let drag = drag / unit;
    let (mut q, mut rate) = ([0.0; TERMS], [0.0; TERMS]);
    (q[0], rate[0]) = (slip / unit, now / unit);
    for n in 1..TERMS {
        let product: f64 = q[..n].iter().zip(rate[..n].iter().rev()).map(|(q, rate)| q * rate).sum();
        q[n] = -product * INVERSE[n];
        rate[n] = (product - drag * rate[n - 1]) * INVERSE[n];
    }
    let end = rest * unit;
    let mut step = end.min(LONGEST / rate[0].abs());
    let allowed = TOLERANCE * rate[0].abs();
    for n in [TERMS - 2, TERMS - 1] {
        let last = rate[n].abs();
        if last * power(step, n) > allowed {
            step = libm::pow(allowed / last, INVERSE[n]);
        }
    }
    // ṡ = φ, so s and ∫ s dt have the coefficients of φ, divided once and twice.
    let speed = |t: f64| at.speed + t * horner(t, |n| rate[n] * INVERSE[n + 1]);
    let stops = rate[0] < 0.0 && speed(step) <= 0.0;
    if stops {
        step = instant(speed, |t| horner(t, |n| rate[n]), step);
    }
    let way = at.speed * step + step * step * horner(step, |n| rate[n] * INVERSE[n + 1] * INVERSE[n + 2]);
    let to = State {
        time: if step >= end { at.time + rest } else { at.time + step / unit },
        speed: speed(step),
        rate: Some(horner(step, |n| rate[n]) * unit),
        way: at.way + way / unit,
    };
    *at = to;
    stops
}

/// `1/n`.
const INVERSE: [f64; TERMS + 2] = {
    let mut all = [0.0; TERMS + 2];
    let mut n = 1;
    while n < all.len() {
        all[n] = 1.0 / n as f64;
        n += 1;
    }
    all
};

/// The sum of a series at `t`.
fn horner(t: f64, coefficient: impl Fn(usize) -> f64) -> f64 {
    (0..TERMS).rev().fold(0.0, |sum, n| sum * t + coefficient(n))
}

/// `t^n`.
fn power(t: f64, n: usize) -> f64 {
    (0..n).fold(1.0, |power, _| power * t)
}

/// The instant at which a falling speed is 0, within `(0, beyond]`: Newton's method, halving where it would leave the
/// bracket.
fn instant(speed: impl Fn(f64) -> f64, rate: impl Fn(f64) -> f64, beyond: f64) -> f64 {
    let (mut before, mut after) = (0.0, beyond);
    let mut t = beyond;
    for _ in 0..100 {
        let s = speed(t);
        if s > 0.0 {
            before = t
        } else {
            after = t
        }
        let mut next = t - s / rate(t);
        if !(next > before && next < after) {
            next = 0.5 * (before + after);
        }
        if (next - t).abs() <= 1e-16 * after || next <= before || next >= after {
            return next;
        }
        t = next;
    }
    t
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
        let (p, torque) = (model.plant.params(), input.torque(model, 0.0, shaft.position));
        let (normal, holds) = (model.plant.actuator().normal(volts), model.break_away_torque(0.0, volts));
        let (v_s, unit) = (friction.velocity, p.inertia * friction.velocity);
        let stribeck = normal * (friction.at_rest - friction.sliding) / unit;
        let event = |kind, s: f64, position| Event { time: input.time + s, kind, position, torque };
        let mut s = 0.0;
        // It stops once at most; then it stays, or rises the other way.
        for _ in 0..3 {
            if shaft.motion == Motion::Stuck {
                if s >= input.duration || break_away(model, input, shaft.position, s).is_none() {
                    return Ok(());
                }
                shaft.motion = Motion::along(torque);
                events.push(event(EventKind::BreakAway, s, shaft.position));
            }
            let (sign, left) = (shaft.motion.sign(), input.duration - s);
            // Coulomb's friction drops from rest to motion; Stribeck's does not, and is the number that was compared with.
            let drops = friction.at_rest < model.plant.friction().at_rest();
            let first = if drops { normal * friction.at_rest } else { holds };
            let excess = (sign * torque - first) / unit;
            let flow = Flow {
                // Without a layer both are one number, rounded once: the break-away that was seen has to happen.
                drive: if stribeck == 0.0 {
                    excess
                } else {
                    (sign * torque - normal * friction.sliding) / unit
                },
                excess,
                drag: p.viscous_damping / p.inertia,
                stribeck,
                edge: if stribeck.abs() * left < 20.0 {
                    LINEAR_ABOVE
                } else {
                    LINEAR_ABOVE + libm::log(stribeck.abs() * left)
                },
            };
            let Some((end, stops)) = flow.run(sign * shaft.velocity / v_s, left) else {
                return Err(EngineError::TooManySteps { time: input.time, limit: PIECE_LIMIT });
            };
            if !(end.way.is_finite() && end.speed.is_finite()) {
                return Err(EngineError::NotFinite { time: input.time });
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
        Err(EngineError::TooManySteps { time: input.time, limit: 3 })
    }
}
