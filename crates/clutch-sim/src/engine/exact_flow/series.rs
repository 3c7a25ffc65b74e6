//! A piece of the motion as power series in time.

use super::state::State;
use crate::lane::{Lane, each};

/// Part that a piece may leave out, as a share of what it is: of a quadrature the time, of a series the rate of speed.
pub(super) const TOLERANCE: f64 = 1e-10;
/// Terms of a power series.
const TERMS: usize = 18;
/// Longest step of a series, in Stribeck velocities: beyond, `e^(−s)` would need more terms.
const LONGEST: f64 = 6.0;

/// `1/n`.
pub(super) const INVERSE: [f64; TERMS + 2] = {
    let mut all = [0.0; TERMS + 2];
    let mut n = 1;
    while n < all.len() {
        all[n] = 1.0 / n as f64;
        n += 1;
    }
    all
};

/// A step in the layer, where `φ` is `now` and `q` is `slip`: to the end, as far as the series goes, or to the stop. The mask
/// is true where it stops.
#[inline(always)]
pub(super) fn step<V: Lane>(at: &State<V>, now: V, slip: V, drag: V, rest: V) -> (V::Mask, State<V>) {
    // Time is counted in the motion's own, so that no coefficient leaves the range of numbers.
    let unit = now.abs() + slip.abs() + drag;
    let drag = drag / unit;
    let (mut q, mut rate) = ([V::ZERO; TERMS], [V::ZERO; TERMS]);
    (q[0], rate[0]) = (slip / unit, now / unit);
    for n in 1..TERMS {
        // A sum begins there: 0 would be another number for a product of −0.
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
            // Others' shares may be no numbers.
            let share = V::select(over, allowed / last, V::ONE);
            step = V::select(over, share.powf(V::splat(INVERSE[n])), step);
        }
    }
    let time = |step: V| V::select(end.less_or_equal(step), rest, step / unit);
    let mut to = along(at, &rate, step, (unit, time(step)));
    let stops = rate[0].less(V::ZERO) & to.speed.less_or_equal(V::ZERO);
    if V::any(stops) {
        each(V::bits(stops), |i| {
            let begin = at.speed.lane(i);
            let rate: [f64; TERMS] = std::array::from_fn(|n| rate[n].lane(i));
            let speed = |t: f64| begin + t * horner(t, |n| rate[n] * INVERSE[n + 1]);
            step.put(i, instant(speed, |t| horner(t, |n| rate[n]), step.lane(i)));
        });
        to = along(at, &rate, step, (unit, time(step)));
    }
    (stops, to)
}

/// The state after a step that lasts for `time`, s. ṡ = φ, so s and ∫ s dt have the coefficients of φ, divided once and
/// twice.
#[inline(always)]
fn along<V: Lane>(at: &State<V>, rate: &[V; TERMS], step: V, (unit, time): (V, V)) -> State<V> {
    let (mut speed, mut way, mut last) = (V::ZERO, V::ZERO, V::ZERO);
    for n in (0..TERMS).rev() {
        let once = rate[n] * V::splat(INVERSE[n + 1]);
        speed = speed * step + once;
        way = way * step + once * V::splat(INVERSE[n + 2]);
        last = last * step + rate[n];
    }
    let way = at.speed * step + step * step * way;
    State {
        time: at.time + time,
        speed: at.speed + step * speed,
        rate: last * unit,
        way: at.way + way / unit,
    }
}

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
