//! The pieces of a motion: linear, at the fringe of the layer, and through it.

use super::series::{self, INVERSE, TOLERANCE};
use super::state::State;
use crate::lane::Lane;

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
/// Pieces in one interval before the engine gives up.
pub(crate) const PIECE_LIMIT: u32 = 10_000;

/// The constants of one interval, seen along the motion; speeds are in Stribeck velocities.
#[derive(Clone, Copy)]
pub(crate) struct Flow<V> {
    /// `A`, 1/s.
    pub(crate) drive: V,
    /// `(A − K) J v_s`, N m: what is left of the torque at rest. The difference of the torques: near a break-away that of
    /// `A` and `K` has lost its digits.
    pub(crate) excess: V,
    /// `J v_s`, kg m² rad/s. The slow alone divide by it.
    pub(crate) unit: V,
    /// `G`, 1/s.
    pub(crate) drag: V,
    /// `K`, 1/s.
    pub(crate) stribeck: V,
    /// Speed above which `q` is lost in rounding.
    pub(crate) edge: V,
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
        let excess = self.excess / self.unit;
        V::select(slow, excess - self.drag * speed - self.stribeck * (-speed).expm1(), fast)
    }

    /// The motion without `q`: to the end, or until it has fallen to a speed.
    #[inline(always)]
    fn linear(&self, at: &State<V>, rest: V, to: V) -> State<V> {
        let rate = self.drive - self.drag * at.speed;
        let (mut time, mut reaches) = (rest, V::none());
        // The fall is never steeper than at first; most never come down so far.
        if V::any((at.speed - to).less(V::splat(-1.01) * rate * rest)) {
            // s − to = −rate (1 − e^{−Gt})/G
            let fall = (at.speed - to) / -rate;
            let share = self.drag * fall;
            let falls = rate.less(V::ZERO) & fall.less(rest) & share.less(V::ONE);
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
        let even = V::same(self.stribeck, V::ZERO);
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
    /// over `φ²`, which is all but constant where `e^(−l)` is not small. The motion is of this kind where the mask is true,
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
        let rates = rate.at_all(NODES.map(
            #[inline(always)]
            |[node, ..]| s(node) * way,
        ));
        for ([node, weight, sixth, seventh], rate) in NODES.into_iter().zip(rates) {
            let inverse = V::ONE / rate;
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
        let stops = V::same(way, -at.speed);
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
    /// The constants of one lane.
    pub(crate) fn lane(&self, i: usize) -> Flow<f64> {
        Flow {
            drive: self.drive.lane(i),
            excess: self.excess.lane(i),
            unit: self.unit.lane(i),
            drag: self.drag.lane(i),
            stribeck: self.stribeck.lane(i),
            edge: self.edge.lane(i),
        }
    }

    /// `q` and `φ` at a state, and where the motion is balanced.
    #[inline(always)]
    fn rates(&self, at: &State<V>) -> (V, V, V::Mask) {
        let slip = self.stribeck * (-at.speed).exp();
        let known = V::same(at.rate, at.rate);
        let rate = if V::all(known) { at.rate } else { V::select(known, at.rate, self.rate(at.speed, slip)) };
        let balanced = rate.abs().less_or_equal(V::splat(BALANCED) * at.speed * (self.drag - slip));
        (slip, rate, balanced)
    }

    /// The next piece, if it is one outside of the layer, at its fringe, or in balance; most are. With it `q` and `φ`, where
    /// there is another.
    #[inline(always)]
    pub(crate) fn easy(&self, at: &State<V>, rest: V) -> (Piece<V>, V, V) {
        let (outside, stops, end) = self.outside(at, rest);
        let mut piece = Piece { done: outside, stops, state: State::select(outside, &end, at) };
        if V::all(outside) {
            return (piece, V::ZERO, V::ZERO);
        }
        let (slip, rate, balanced) = self.rates(at);
        let even = State { time: at.time + rest, way: at.way + at.speed * rest, ..*at };
        piece.takes(balanced, V::none(), &even);
        if !V::all(piece.done) {
            let (fringe, along) = self.fringe(at, rate + slip, slip, rest);
            piece.takes(fringe, V::none(), &along);
        }
        (piece, slip, rate)
    }

    /// The next piece that is none of these, by quadrature, if its estimate of its own error is small enough. In lanes there
    /// is none where a guess would ask more of an exponential than lanes have; the mask is true where it would not.
    #[inline(always)]
    pub(crate) fn inside(&self, at: &State<V>, (slip, rate): (V, V), rest: V) -> (Piece<V>, V::Mask) {
        let most = V::splat(V::EXPONENT);
        // The drag on a way of no more than twice REACH comes on top.
        let beyond = most.less(((rate + slip) * rest).abs()) | most.less(V::splat(20.0) * self.drag * rest);
        let (fits, stops, through) = V::apart(
            #[inline(always)]
            || self.quadrature(at, rate, slip, rest),
        );
        let done = fits & !beyond;
        let state = State::select(done, &through, at);
        (Piece { done, stops: stops & done, state }, !beyond)
    }

    /// The next piece as power series, as far as they go: for what is too steep for a quadrature.
    #[inline(always)]
    pub(crate) fn steep(&self, at: &State<V>, (slip, rate): (V, V), rest: V) -> Piece<V> {
        let (stops, state) = V::apart(
            #[inline(always)]
            || series::step(at, rate, slip, self.drag, rest),
        );
        Piece { done: !V::none(), stops, state }
    }
}

/// A part of a motion.
pub(crate) struct Piece<V: Lane> {
    /// Lanes that have one.
    pub(crate) done: V::Mask,
    /// Lanes that stop at its end.
    pub(crate) stops: V::Mask,
    /// State after it; the one before where there is none.
    pub(crate) state: State<V>,
}

impl<V: Lane> Piece<V> {
    /// Lanes that have no piece yet take this one.
    #[inline(always)]
    fn takes(&mut self, some: V::Mask, stops: V::Mask, state: &State<V>) {
        let some = some & !self.done;
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
            // The cheapest way whose estimate of its own error is small enough.
            let (mut piece, slip, rate) = self.easy(&at, rest);
            if !piece.done {
                piece = self.inside(&at, (slip, rate), rest).0;
            }
            if !piece.done {
                piece = self.steep(&at, (slip, rate), rest);
            }
            at = piece.state;
            if piece.stops {
                at.speed = 0.0;
                return Some((at, true));
            }
        }
        None
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
        let [rate] = self.at_all([way]);
        rate
    }

    /// At several ways.
    #[inline(always)]
    fn at_all<const N: usize>(&self, ways: [V; N]) -> [V; N] {
        let mut falls = [V::ZERO; N];
        if self.some.1 {
            falls = V::expm1_of_each(ways.map(|way| -way));
        }
        if self.some.0 {
            let powers = V::exp_of_each(ways.map(|way| -way));
            for (fall, power) in falls.iter_mut().zip(powers) {
                *fall = V::select(self.long, power - V::ONE, *fall);
            }
        }
        for (fall, way) in falls.iter_mut().zip(ways) {
            *fall = self.now - self.drag * way - self.slip * *fall;
        }
        falls
    }
}

/// `(1 − e^{−x})/x`
#[inline(always)]
fn decay_mean<V: Lane>(x: V) -> V {
    let tiny = x.abs().less(V::splat(1e-300));
    V::select(tiny, V::ONE, -(-x).expm1() / x)
}
