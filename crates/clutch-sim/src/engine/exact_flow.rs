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

use super::{Engine, EngineError, Event, EventKind, Input, Model, Motion, Shaft, Volts};
use crate::lanes::Lane;
use clutch_core::friction::{Exponential, FrictionModel};

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
pub(crate) const PIECE_LIMIT: u32 = 10_000;

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
pub(crate) struct Flow<V> {
    /// `A`, 1/s.
    pub(crate) drive: V,
    /// `A − K`, 1/s: what is left of the torque at rest. The difference of the torques: near a break-away that of `A`
    /// and `K` has lost its digits.
    pub(crate) excess: V,
    /// `G`, 1/s.
    pub(crate) drag: V,
    /// `K`, 1/s.
    pub(crate) stribeck: V,
    /// Speed above which `q` is lost in rounding.
    pub(crate) edge: V,
}

/// A state within an interval.
#[derive(Clone, Copy)]
pub(crate) struct State<V> {
    /// Since the begin of the interval, s.
    pub(crate) time: V,
    /// `s`.
    pub(crate) speed: V,
    /// `φ`, 1/s, as the last piece left it: more than the speed gives. NaN where no piece did.
    pub(crate) rate: V,
    /// `∫ s dt`, s.
    pub(crate) way: V,
}

impl<V: Lane> State<V> {
    /// The begin of an interval.
    #[inline(always)]
    pub(crate) fn at(speed: V) -> Self {
        State { time: V::ZERO, speed, rate: V::splat(f64::NAN), way: V::ZERO }
    }

    /// The state of one lane.
    pub(crate) fn lane(&self, i: usize) -> State<f64> {
        State {
            time: self.time.lane(i),
            speed: self.speed.lane(i),
            rate: self.rate.lane(i),
            way: self.way.lane(i),
        }
    }

    /// `a` where the mask is true, `b` elsewhere.
    #[inline(always)]
    pub(crate) fn select(mask: V::Mask, a: &Self, b: &Self) -> Self {
        State {
            time: V::select(mask, a.time, b.time),
            speed: V::select(mask, a.speed, b.speed),
            rate: V::select(mask, a.rate, b.rate),
            way: V::select(mask, a.way, b.way),
        }
    }
}

/// `(1 − e^{−x})/x` and `(x − 1 + e^{−x})/x²`, for `x ≥ 0`.
#[inline(always)]
fn decay_means<V: Lane>(x: V) -> (V, V) {
    // Σ (−x)^n/(n+2)!
    let mut second = V::ZERO;
    for n in (2..7).rev() {
        second = (V::ONE - x * second) * V::splat(INVERSE[n]);
    }
    let short = x.less(V::splat(1e-3));
    if !V::all(short) {
        let mut longer = V::ZERO;
        for n in (2..12).rev() {
            longer = (V::ONE - x * longer) * V::splat(INVERSE[n]);
        }
        second = V::select(short, second, longer);
    }
    let means = (V::ONE - x * second, second);
    let large = V::splat(0.1).less(x);
    if !V::any(large) {
        return means;
    }
    let mean = -(-x).expm1() / x;
    let second = (V::ONE - mean) / x;
    (V::select(large, mean, means.0), V::select(large, second, means.1))
}

impl<V: Lane> Flow<V> {
    /// `φ` at a speed, where `q` is `slip`.
    #[inline(always)]
    fn rate(&self, speed: V, slip: V) -> V {
        let slow = speed.less(V::ONE);
        let fast = self.drive - self.drag * speed - slip;
        if !V::any(slow) {
            return fast;
        }
        V::select(slow, self.excess - self.drag * speed - self.stribeck * (-speed).expm1(), fast)
    }

    /// The motion without `q`: to the end, or until it has fallen to a speed.
    #[inline(always)]
    fn linear(&self, at: &State<V>, rest: V, to: V) -> State<V> {
        let rate = self.drive - self.drag * at.speed;
        // s − to = −rate (1 − e^{−Gt})/G
        let fall = (at.speed - to) / -rate;
        let share = self.drag * fall;
        // The fall is never steeper than at first.
        let falls = rate.less(V::ZERO) & fall.less(rest) & share.less(V::ONE);
        let (mut time, mut reaches) = (rest, falls & !falls);
        if V::any(falls) {
            let undamped = self.drag.less_or_equal(V::ZERO);
            let damped = V::select(undamped, V::ZERO, -share);
            let reached = V::select(undamped, fall, -damped.log1p() / self.drag);
            reaches = falls & reached.less(rest);
            time = V::select(reaches, reached, rest);
        }
        let (mean, second) = decay_means(self.drag * time);
        let speed = (at.speed + rate * time * mean).max(V::ZERO);
        State {
            way: at.way + (at.speed * time + rate * time * time * second),
            time: at.time + time,
            speed: V::select(reaches, to, speed),
            rate: V::splat(f64::NAN),
        }
    }

    /// The motion at a speed above the edge, or without a layer: where the first mask is true, and in which the state is the
    /// one after it. The second: where it stops.
    #[inline(always)]
    fn outside(&self, at: &State<V>, rest: V) -> (V::Mask, V::Mask, State<V>) {
        let even = self.stribeck.less_or_equal(V::ZERO) & V::ZERO.less_or_equal(self.stribeck);
        let outside = even | self.edge.less(at.speed);
        if !V::any(outside) {
            return (outside, outside, *at);
        }
        let to = V::select(even, V::ZERO, self.edge);
        let end = V::apart(
            #[inline(always)]
            || self.linear(at, rest, to),
        );
        (outside, even & end.speed.less_or_equal(V::ZERO), end)
    }

    /// The outside of the layer, where `q` is below [`FRINGE`] of the rest: linear, and what `q` does beside that to first
    /// order, `δ̇ = −G δ − K e^(−l)` with `l` the linear motion. With `dl = φ dt` its integrals are those of `e^(−l)`
    /// over `φ²`, which is all but constant where `e^(−l)` is not small. Where the mask is true the motion is of this kind,
    /// and the state is the one after it.
    #[inline(always)]
    fn fringe(&self, at: &State<V>, from: V, slip: V, rest: V) -> (V::Mask, State<V>) {
        let magnitude = from.abs();
        let (rises, steep) = (V::ZERO.less(from), self.drag.less_or_equal(V::splat(1e-3) * magnitude));
        let layer = V::ZERO.less(self.stribeck) & steep;
        let fringe = V::splat(FRINGE);
        let outside = layer & rises & slip.less_or_equal(fringe * from);
        let mut falls = layer & !rises;
        let mut to = V::ZERO;
        if V::any(falls) {
            let top = (self.stribeck / (fringe * magnitude)).log().max(V::splat(REACH));
            falls = falls & (top + V::splat(REACH)).less(at.speed);
            to = V::select(rises, V::ZERO, top);
        }
        let kind = outside | falls;
        if !V::any(kind) {
            return (kind, *at);
        }
        let mut end = V::apart(
            #[inline(always)]
            || self.linear(at, rest, to),
        );
        let last = self.drive - self.drag * end.speed;
        let x = (end.speed - at.speed).abs();
        let correction = V::ONE + V::splat(2.0) * self.drag / from;
        let fall = -(-x).expm1();
        let mut deviation = V::ZERO;
        let mut way = V::ZERO;
        if V::any(outside) {
            let share = slip / from * correction;
            (deviation, way) = (-last / from * share * fall, -share / from * (x - fall));
        }
        if V::any(falls) {
            let share = self.stribeck * (-end.speed).exp() / last * correction;
            let lost = -share / -last.abs() * (fall - x * (-x).exp());
            deviation = V::select(rises, deviation, share * fall);
            way = V::select(rises, way, lost);
        }
        end.way = end.way + way;
        end.speed = end.speed + (deviation - V::splat(0.5) * deviation * deviation);
        (kind, end)
    }

    /// The inside of the layer: `t = ∫ ds/φ` and `∫ s ds/φ` from the speed now to one that is guessed. The rest of
    /// the time, a little before or behind the end, is a short series of known terms. Masks: where the state is the one after
    /// it, and where it stops there. Not where the integrand is too steep for [`NODES`], as in a soft break-away.
    #[inline(always)]
    fn quadrature(&self, at: &State<V>, now: V, slip: V, rest: V) -> (V::Mask, V::Mask, State<V>) {
        let s = V::splat;
        let near = (s(1e-2) * now).less(slip) | (s(2.5e-5) * now).less(-slip);
        let reach = V::select(near, s(REACH), s(2.0 * REACH));
        let limits = (-at.speed.min(reach), reach);
        // With the drag as it is now, and then as it is half-way, the motion is in closed form.
        let mut way = guess(now + slip, slip, rest, limits);
        let drags = s(1e-3).less(self.drag * rest) & limits.0.less(way) & way.less(reach);
        if V::any(drags) {
            let better = guess(now + slip - s(0.5) * self.drag * way, slip, rest, limits);
            way = V::select(drags, better, way);
        }
        // The cheaper exponential where the difference keeps its digits.
        let long = s(0.5).less(way.abs());
        let rate = Rate { now, drag: self.drag, slip, long, some: (V::any(long), V::any(!long)) };
        let (mut time, mut moment, mut even, mut odd) = (V::ZERO, V::ZERO, V::ZERO, V::ZERO);
        for [node, weight, sixth, seventh] in NODES {
            let inverse = V::ONE / rate.at(s(node) * way);
            time = time + s(weight) * inverse;
            moment = moment + s(weight * node) * inverse;
            even = even + s(sixth) * inverse;
            odd = odd + s(seventh) * inverse;
        }
        // The coefficients of a series in Legendre's polynomials fall like those of a power series: what eight nodes
        // leave out is about the square of what the seventh coefficient is. An even integrand has none; its sixth is then
        // some three times as large.
        let last = odd.abs().max(even.abs() / s(3.0)) / time;
        let fits = V::ZERO.less(time * way) & (last * last).less_or_equal(s(TOLERANCE));
        let (time, moment) = (time * way, moment * way * way);
        let stops = way.less_or_equal(-at.speed) & (-at.speed).less_or_equal(way);
        let left = rest - time;
        let end = rate.at(way);
        let to = State {
            time: at.time + time,
            speed: at.speed + way,
            rate: end,
            way: at.way + at.speed * time + moment,
        };
        let slip = slip * (-way).exp();
        let short = (left.abs() * (end.abs() + slip.abs() + self.drag)).less_or_equal(s(SHORT));
        let fits = fits & !(left.less(V::ZERO) & !short);
        let ends = left.less_or_equal(V::ZERO) | (short & !stops);
        if !V::any(fits & ends) {
            return (fits, stops, to);
        }
        let g1 = slip - self.drag;
        let g2 = g1 * g1 - slip * end;
        let g3 = g1 * g1 * g1 - s(4.0) * g1 * slip * end + slip * end * end;
        let way =
            left * (to.speed + left / s(2.0) * end * (V::ONE + left / s(3.0) * (g1 + left / s(4.0) * g2)));
        let more = left * end * (V::ONE + left / s(2.0) * (g1 + left / s(3.0) * (g2 + left / s(4.0) * g3)));
        let ended =
            State { time: at.time + rest, speed: to.speed + more, rate: s(f64::NAN), way: to.way + way };
        // It stops at the very end.
        let fits = fits & !(ends & ended.speed.less(V::ZERO));
        (fits, stops & !ends, State::select(ends, &ended, &to))
    }
}

impl<V: Lane> Flow<V> {
    /// The number of one lane.
    pub(crate) fn lane(&self, i: usize) -> Flow<f64> {
        Flow {
            drive: self.drive.lane(i),
            excess: self.excess.lane(i),
            drag: self.drag.lane(i),
            stribeck: self.stribeck.lane(i),
            edge: self.edge.lane(i),
        }
    }

    /// `q` and `φ` at a state, and where the motion is balanced.
    #[inline(always)]
    fn rates(&self, at: &State<V>) -> (V, V, V::Mask) {
        let slip = self.stribeck * (-at.speed).exp();
        let known = at.rate.less_or_equal(at.rate);
        let rate = if V::all(known) { at.rate } else { V::select(known, at.rate, self.rate(at.speed, slip)) };
        let balanced = rate.abs().less_or_equal(V::splat(BALANCED) * at.speed * (self.drag - slip));
        (slip, rate, balanced)
    }

    /// Where a quadrature's guesses ask exponentials for no more than lanes have.
    #[inline(always)]
    fn within_exponents(&self, drive: V, rest: V) -> V::Mask {
        let most = V::splat(V::EXPONENT);
        // The drag on a way of no more than twice REACH comes on top.
        !most.less((drive * rest).abs()) & !most.less(V::splat(20.0) * self.drag * rest)
    }

    /// The piece from the begin of an interval, if it is one outside of the layer or at its fringe: most are. As
    /// [`Flow::piece`].
    #[inline(always)]
    pub(crate) fn first(&self, at: &State<V>, rest: V) -> Piece<V> {
        let (outside, stops, end) = self.outside(at, rest);
        if V::all(outside) {
            return Piece { done: outside, stops, state: end };
        }
        let (slip, rate, balanced) = self.rates(at);
        let (fringe, along) = self.fringe(at, rate + slip, slip, rest);
        let fringe = fringe & !outside & !balanced;
        let state = State::select(outside, &end, &State::select(fringe, &along, at));
        Piece { done: outside | fringe, stops, state }
    }

    /// The next piece, by the cheapest way whose estimate of its own error is small enough.
    #[inline(always)]
    pub(crate) fn piece(&self, at: &State<V>, rest: V) -> Piece<V> {
        let (outside, stops, end) = self.outside(at, rest);
        if V::all(outside) {
            return Piece { done: outside, stops, state: end };
        }
        let mut piece = Piece { done: outside, stops, state: end };
        let (slip, rate, balanced) = self.rates(at);
        let even = State { time: at.time + rest, way: at.way + at.speed * rest, ..*at };
        let stays = balanced & !outside;
        piece.takes(stays, stays & !stays, &even);
        if V::all(piece.done) {
            return piece;
        }
        let (fringe, along) = self.fringe(at, rate + slip, slip, rest);
        let fringe = fringe & !piece.done;
        piece.takes(fringe, fringe & !fringe, &along);
        if V::all(piece.done) {
            return piece;
        }
        // Neither a quadrature nor a series that a run alone would not take.
        let within = self.within_exponents(rate + slip, rest) & !piece.done;
        let (fits, stops, through) = V::apart(
            #[inline(always)]
            || self.quadrature(at, rate, slip, rest),
        );
        let fits = fits & within;
        piece.takes(fits, stops, &through);
        if V::all(piece.done) {
            return piece;
        }
        let (goes_on, along) = V::apart(
            #[inline(always)]
            || series(at, rate, slip, self.drag, rest),
        );
        let goes_on = goes_on & within & !piece.done;
        piece.takes(goes_on, goes_on & !goes_on, &along);
        piece
    }
}

/// A part of a motion.
pub(crate) struct Piece<V: Lane> {
    /// Where there is one; not where a series would end with a stop.
    pub(crate) done: V::Mask,
    /// Where it ends with a stop.
    pub(crate) stops: V::Mask,
    /// The state after it.
    pub(crate) state: State<V>,
}

impl<V: Lane> Piece<V> {
    #[inline(always)]
    fn takes(&mut self, some: V::Mask, stops: V::Mask, state: &State<V>) {
        self.done = self.done | some;
        self.stops = self.stops | (stops & some);
        self.state = State::select(some, state, &self.state);
    }
}

impl Flow<f64> {
    /// Follows the motion for `left` seconds since the begin of the interval, or until it stops.
    pub(crate) fn run(&self, mut at: State<f64>, left: f64) -> Option<(State<f64>, bool)> {
        for _ in 0..PIECE_LIMIT {
            let rest = left - at.time;
            // The caller reports what is no number.
            if rest <= 0.0 || !at.speed.is_finite() {
                return Some((at, false));
            }
            let Piece { done, stops, state } = self.piece(&at, rest);
            let stops = if done {
                at = state;
                stops
            } else {
                self.stop(&mut at, rest);
                true
            };
            if stops {
                at.speed = 0.0;
                return Some((at, true));
            }
        }
        None
    }

    /// The last piece of a motion that stops, by a series.
    fn stop(&self, at: &mut State<f64>, rest: f64) {
        let (slip, now, _) = self.rates(at);
        let Series { rate, unit, end, step } = Series::of(now, slip, self.drag, rest);
        let begin = at.speed;
        let speed = |t: f64| begin + t * horner(t, |n| rate[n] * INVERSE[n + 1]);
        let step = instant(speed, |t| horner(t, |n| rate[n]), step);
        *at = along(at, &rate, (step, end, unit), rest);
    }
}

/// The way in which a motion with constant drag goes, in Stribeck velocities, within limits.
#[inline(always)]
fn guess<V: Lane>(drive: V, slip: V, rest: V, (lowest, highest): (V, V)) -> V {
    let y = -slip * rest * decay_mean(drive * rest);
    let stops = y.less_or_equal(-V::ONE);
    let way = drive * rest + V::select(stops, V::ZERO, y).log1p();
    let way = V::select(stops | way.less(lowest), lowest, way);
    V::select(highest.less(way), highest, way)
}

/// `φ` along the way from a speed.
struct Rate<V: Lane> {
    now: V,
    drag: V,
    slip: V,
    /// Ways so long that the exponential itself will do; whether there are such, and others.
    long: V::Mask,
    some: (bool, bool),
}

impl<V: Lane> Rate<V> {
    #[inline(always)]
    fn at(&self, way: V) -> V {
        let mut fall = V::ZERO;
        if self.some.1 {
            fall = (-way).expm1();
        }
        if self.some.0 {
            fall = V::select(self.long, (-way).exp() - V::ONE, fall);
        }
        self.now - self.drag * way - self.slip * fall
    }
}

/// `(1 − e^{−x})/x`
#[inline(always)]
fn decay_mean<V: Lane>(x: V) -> V {
    let tiny = x.abs().less(V::splat(1e-300));
    V::select(tiny, V::ONE, -(-x).expm1() / x)
}

/// Power series of the motion, and how far they reach. Time is counted in the motion's own, so that no coefficient leaves the
/// range of numbers.
struct Series<V> {
    rate: [V; TERMS],
    /// Of the motion's own time in a second.
    unit: V,
    /// The rest of the interval.
    end: V,
    /// The step.
    step: V,
}

impl<V: Lane> Series<V> {
    #[inline(always)]
    fn of(now: V, slip: V, drag: V, rest: V) -> Self {
        let unit = now.abs() + slip.abs() + drag;
        let drag = drag / unit;
        let (mut q, mut rate) = ([V::ZERO; TERMS], [V::ZERO; TERMS]);
        (q[0], rate[0]) = (slip / unit, now / unit);
        for n in 1..TERMS {
            let mut product = -V::ZERO;
            for i in 0..n {
                product = product + q[i] * rate[n - 1 - i];
            }
            q[n] = -product * V::splat(INVERSE[n]);
            rate[n] = (product - drag * rate[n - 1]) * V::splat(INVERSE[n]);
        }
        let end = rest * unit;
        let mut step = end.min(V::splat(LONGEST) / rate[0].abs());
        let allowed = V::splat(TOLERANCE) * rate[0].abs();
        for n in [TERMS - 2, TERMS - 1] {
            let last = rate[n].abs();
            let over = allowed.less(last * power(step, n));
            if V::any(over) {
                let (mut bits, share) = (V::bits(over), allowed / last);
                while bits != 0 {
                    let i = bits.trailing_zeros() as usize;
                    step.put(i, libm::pow(share.lane(i), INVERSE[n]));
                    bits &= bits - 1;
                }
            }
        }
        Series { rate, unit, end, step }
    }
}

/// The state after a step of a series. ṡ = φ, so s and ∫ s dt have the coefficients of φ, divided once and twice.
#[inline(always)]
fn along<V: Lane>(at: &State<V>, rate: &[V; TERMS], (step, end, unit): (V, V, V), rest: V) -> State<V> {
    let (mut speed, mut way, mut last) = (V::ZERO, V::ZERO, V::ZERO);
    for n in (0..TERMS).rev() {
        let once = rate[n] * V::splat(INVERSE[n + 1]);
        speed = speed * step + once;
        way = way * step + once * V::splat(INVERSE[n + 2]);
        last = last * step + rate[n];
    }
    let way = at.speed * step + step * step * way;
    State {
        time: at.time + V::select(end.less_or_equal(step), rest, step / unit),
        speed: at.speed + step * speed,
        rate: last * unit,
        way: at.way + way / unit,
    }
}

/// A step in the layer, where `q` is `slip`: to the end, or as far as the series goes. Not where the mask is false: there the
/// motion stops before.
#[inline(always)]
fn series<V: Lane>(at: &State<V>, now: V, slip: V, drag: V, rest: V) -> (V::Mask, State<V>) {
    let Series { rate, unit, end, step } = Series::of(now, slip, drag, rest);
    let to = along(at, &rate, (step, end, unit), rest);
    (!(rate[0].less(V::ZERO) & to.speed.less_or_equal(V::ZERO)), to)
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
#[inline(always)]
fn power<V: Lane>(t: V, n: usize) -> V {
    let mut power = V::ONE;
    for _ in 0..n {
        power = power * t;
    }
    power
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

/// The shaft and its friction, of a run or of several.
#[derive(Clone, Copy)]
pub(crate) struct Bed<V: Lane> {
    curve: Exponential<V>,
    /// Coulomb's friction drops from rest to motion; Stribeck's does not.
    drops: V::Mask,
    /// `J v_s`, kg m² rad/s.
    unit: V,
    /// `G`, 1/s.
    drag: V,
}

/// What acts on the shaft over an interval.
#[derive(Clone, Copy)]
pub(crate) struct Pushed<V> {
    /// Torque of drive and actuator, N m.
    pub(crate) torque: V,
    /// Normal force, as torque per unit of μ, N m.
    pub(crate) normal: V,
    /// Torque up to which friction holds, N m.
    pub(crate) holds: V,
}

impl<V: Lane> Pushed<V> {
    /// Those of one lane.
    pub(crate) fn lane(&self, i: usize) -> Pushed<f64> {
        Pushed { torque: self.torque.lane(i), normal: self.normal.lane(i), holds: self.holds.lane(i) }
    }
}

impl Bed<f64> {
    /// Of a model; none if its friction is of another kind.
    pub(crate) fn of(model: &Model) -> Option<Self> {
        let (p, friction) = (model.plant.params(), model.plant.friction());
        let curve = friction.exponential()?;
        Some(Bed {
            curve,
            drops: curve.at_rest < friction.at_rest(),
            unit: p.inertia * curve.velocity,
            drag: p.viscous_damping / p.inertia,
        })
    }
}

impl<V: Lane> Bed<V> {
    /// Of several runs.
    pub(crate) fn in_lanes(beds: &[Bed<f64>]) -> Self {
        let of = |get: fn(&Bed<f64>) -> f64| V::of(|i| get(&beds[i]));
        Bed {
            curve: Exponential {
                at_rest: of(|b| b.curve.at_rest),
                sliding: of(|b| b.curve.sliding),
                velocity: of(|b| b.curve.velocity),
            },
            drops: V::ZERO.less(of(|b| if b.drops { 1.0 } else { 0.0 })),
            unit: of(|b| b.unit),
            drag: of(|b| b.drag),
        }
    }

    /// Stribeck velocity, rad/s.
    #[inline(always)]
    pub(crate) fn velocity(&self) -> V {
        self.curve.velocity
    }

    /// The constants of the next `left` seconds, seen along a motion whose sign is `sign`.
    #[inline(always)]
    pub(crate) fn flow(&self, pushed: &Pushed<V>, sign: V, left: V) -> Flow<V> {
        let Pushed { torque, normal, holds } = *pushed;
        let Exponential { at_rest, sliding, .. } = self.curve;
        let stribeck = normal * (at_rest - sliding) / self.unit;
        // The number that was compared with.
        let first = V::select(self.drops, normal * at_rest, holds);
        let along = sign * torque;
        let excess = (along - first) / self.unit;
        // Without a layer both are one number, rounded once: the break-away that was seen has to happen.
        let even = stribeck.less_or_equal(V::ZERO) & V::ZERO.less_or_equal(stribeck);
        let drive = V::select(even, excess, (along - normal * sliding) / self.unit);
        let (above, lost) = (V::splat(LINEAR_ABOVE), stribeck.abs() * left);
        let near = lost.less(V::splat(20.0));
        let edge = if V::all(near) { above } else { V::select(near, above, above + lost.log()) };
        Flow { drive, excess, drag: self.drag, stribeck, edge }
    }
}

impl Bed<f64> {
    /// Moves `shaft` over an interval that begins at `time` and lasts for `duration`, s, and adds what happened to `events`.
    /// If the motion has begun already, `begun` has its flow and its state.
    ///
    /// # Errors
    /// If the motion cannot be followed.
    pub(crate) fn advance(
        &self,
        pushed: &Pushed<f64>,
        (time, duration): (f64, f64),
        shaft: &mut Shaft,
        events: &mut Vec<Event>,
        mut begun: Option<(Flow<f64>, State<f64>)>,
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
            let (flow, at) = begun
                .take()
                .unwrap_or_else(|| (self.flow(pushed, sign, left), State::at(sign * shaft.velocity / v_s)));
            let Some((end, stops)) = flow.run(at, left) else {
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
        let volts = input.volts.at(0.0);
        let pushed = Pushed {
            torque: input.torque(model, 0.0, shaft.position),
            normal: model.plant.actuator().normal(volts),
            holds: model.break_away_torque(0.0, volts),
        };
        bed.advance(&pushed, (input.time, input.duration), shaft, events, None)
    }
}
