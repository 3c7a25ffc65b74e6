//! A motion, and the kinds of its pieces.

use super::series::{self, INVERSE};
use super::state::State;
use crate::lane::Lane;

/// Distance from balance, as a share of the speed, that no double shows.
const BALANCED: f64 = 1e-17;
/// Speed above which a fall ends at the edge, in Stribeck velocities.
const FASTEST: f64 = 600.0;
/// Speed below which the layer is never little, in Stribeck velocities.
pub(super) const SLOW: f64 = 4.0;
/// Pieces in one interval before the engine gives up.
pub(crate) const PIECE_LIMIT: u32 = 10_000;

/// The constants of one interval, seen along the motion; speeds are in Stribeck velocities.
#[derive(Clone, Copy)]
pub(crate) struct Flow<V> {
    /// `A`, 1/s.
    pub(crate) drive: V,
    /// `A − K`, 1/s, made of the difference of the torques: near a break-away that of `A` and `K` has lost its digits.
    pub(crate) excess: V,
    /// `G`, 1/s.
    pub(crate) drag: V,
    /// `K`, 1/s.
    pub(crate) stribeck: V,
    /// Speed above which `q` is lost in rounding.
    pub(crate) edge: V,
}

/// Where a linear motion may fall so far within some time. It is never steeper than at first.
#[inline(always)]
fn comes_down<V: Lane>(fall: V, rate: V, rest: V) -> V::Mask {
    fall.less(V::splat(-1.01) * rate * rest)
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
    let mean = -(-x).max(V::splat(-700.0)).near_expm1() / x;
    let second = (V::ONE - mean) / x;
    (V::select(large, mean, means.0), V::select(large, second, means.1))
}

/// What a rate of speed at first adds to speed and way of a linear motion, over some time: s and s².
#[derive(Clone, Copy)]
pub(crate) struct Whole<V> {
    speed: V,
    way: V,
}

impl<V: Lane> Whole<V> {
    #[inline(always)]
    pub(super) fn of(drag: V, time: V) -> Self {
        let (mean, second) = decay_means(drag * time);
        Whole { speed: time * mean, way: time * (time * second) }
    }
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
        V::select(slow, self.excess - self.drag * speed - self.stribeck * (-speed).near_expm1(), fast)
    }

    /// The motion without `q`: to the end, or until it has fallen to a speed.
    #[inline(always)]
    pub(super) fn linear(&self, at: &State<V>, rest: V, to: V) -> State<V> {
        let rate = self.drive - self.drag * at.speed;
        let (mut time, mut reaches) = (rest, V::none());
        if V::any(comes_down(at.speed - to, rate, rest)) {
            // s − to = −rate (1 − e^{−Gt})/G
            let fall = (at.speed - to) / -rate;
            let share = self.drag * fall;
            let falls = rate.less(V::ZERO) & fall.less(rest) & share.less(V::ONE);
            let undamped = self.drag.less_or_equal(V::ZERO);
            let damped = V::select(undamped, V::ZERO, -share);
            let reached = V::select(undamped, fall, -damped.near_log1p() / self.drag);
            reaches = falls & reached.less(rest);
            time = V::select(reaches, reached, rest);
        }
        let whole = Whole::of(self.drag, time);
        let speed = (at.speed + rate * whole.speed).max(V::ZERO);
        State {
            way: at.way + (at.speed * time + rate * whole.way),
            time: at.time + time,
            speed: V::select(reaches, to, speed),
            rate: V::splat(f64::NAN),
        }
    }

    /// Where there is no layer.
    #[inline(always)]
    fn even(&self) -> V::Mask {
        V::same(self.stribeck, V::ZERO)
    }

    /// A whole period from a speed on, where it is sure to end outside of the layer as it begins: the mask, speed and way.
    #[inline(always)]
    pub(crate) fn stays_outside(&self, speed: V, period: V, whole: &Whole<V>) -> (V::Mask, V, V) {
        let to = V::select(self.even(), V::ZERO, self.edge);
        let rate = self.drive - self.drag * speed;
        let stays = to.less(speed) & !comes_down(speed - to, rate, period);
        let after = speed + rate * whole.speed;
        (stays & V::ZERO.less(after), after, speed * period + rate * whole.way)
    }

    /// The motion without a layer, or at a speed above the edge. What falls from there goes on [`Flow::above`] it, unless it is so
    /// fast that no exponential has room for it.
    #[inline(always)]
    fn outside(&self, at: &State<V>, rest: V) -> Piece<V> {
        let even = self.even();
        let rate = self.drive - self.drag * at.speed;
        let stays = !comes_down(at.speed - self.edge, rate, rest) | V::splat(FASTEST).less(at.speed);
        let outside = even | (self.edge.less(at.speed) & stays);
        if !V::any(outside) {
            return Piece { done: outside, stops: outside, state: *at };
        }
        let to = V::select(even, V::ZERO, self.edge);
        let end = V::apart(
            #[inline(always)]
            || self.linear(at, rest, to),
        );
        let stops = even & end.speed.less_or_equal(V::ZERO);
        Piece { done: outside, stops, state: State::select(outside, &end, at) }
    }

    /// `q` and `φ` at a state.
    #[inline(always)]
    pub(crate) fn rates(&self, at: &State<V>) -> (V, V) {
        let slip = self.stribeck * (-at.speed).max(V::splat(-700.0)).near_exp();
        let known = V::same(at.rate, at.rate);
        let rate = if V::all(known) { at.rate } else { V::select(known, at.rate, self.rate(at.speed, slip)) };
        (slip, rate)
    }

    /// True where the next piece is none of [`Flow::easy`].
    #[inline(always)]
    pub(crate) fn is_slow(&self, speed: V) -> V::Mask {
        !self.even() & speed.less(V::splat(SLOW))
    }

    /// The next piece, if it is one outside of the layer or above it; most are.
    #[inline(always)]
    pub(crate) fn easy(&self, at: &State<V>, rest: V) -> Piece<V> {
        let mut piece = self.outside(at, rest);
        if !V::all(piece.done) {
            let (slip, rate) = self.rates(at);
            let (above, along) = self.above(at, rate + slip, slip, rest);
            piece.takes(above, V::none(), &along);
        }
        piece
    }

    /// The next piece that is none of these: in balance, or by quadrature, if its estimate of its own error is small enough.
    #[inline(always)]
    pub(crate) fn inside(&self, at: &State<V>, (slip, rate): (V, V), rest: V) -> Piece<V> {
        let balanced = rate.abs().less_or_equal(V::splat(BALANCED) * at.speed * (self.drag - slip));
        let (through, stops, along) = V::apart(
            #[inline(always)]
            || self.through(at, rate, slip, rest),
        );
        let even = State { time: at.time + rest, way: at.way + at.speed * rest, ..*at };
        let mut piece = Piece { done: balanced, stops: V::none(), state: even };
        piece.takes(through, stops, &along);
        piece
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
    /// The next piece as power series, as far as they go: for what is too steep for a quadrature.
    fn steep(&self, at: &State<f64>, (slip, rate): (f64, f64), rest: f64) -> Piece<f64> {
        let (stops, state) = series::step(at, rate, slip, self.drag, rest);
        Piece { done: true, stops, state }
    }

    /// Follows the motion for `left` seconds since the begin of the interval, or until it stops.
    pub(crate) fn run(&self, mut at: State<f64>, left: f64) -> Option<(State<f64>, bool)> {
        for _ in 0..PIECE_LIMIT {
            let rest = left - at.time;
            // The caller reports what is no number.
            if rest <= 0.0 || !at.speed.is_finite() {
                return Some((at, false));
            }
            // The cheapest way whose estimate of its own error is small enough.
            let mut piece = self.easy(&at, rest);
            if !piece.done {
                let rates = self.rates(&at);
                piece = self.inside(&at, rates, rest);
                if !piece.done {
                    piece = self.steep(&at, rates, rest);
                }
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
