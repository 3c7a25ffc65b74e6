//! A piece of the motion as power series in time.

use super::state::State;
use super::tolerance::TOLERANCE;

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

/// A step in the layer, where `φ` is `now` and `q` is `slip`: to the end, as far as the series goes, or to the stop; true if it
/// stops.
pub(super) fn step(at: &State<f64>, now: f64, slip: f64, drag: f64, rest: f64) -> (bool, State<f64>) {
    // Time is counted in the motion's own, so that no coefficient leaves the range of numbers.
    let unit = now.abs() + slip.abs() + drag;
    let drag = drag / unit;
    let (mut q, mut rate) = ([0.0; TERMS], [0.0; TERMS]);
    (q[0], rate[0]) = (slip / unit, now / unit);
    for n in 1..TERMS {
        let product: f64 = (0..n).map(|i| q[i] * rate[n - 1 - i]).sum();
        q[n] = -product * INVERSE[n];
        rate[n] = (product - drag * rate[n - 1]) * INVERSE[n];
    }
    let end = rest * unit;
    let mut step = end.min(LONGEST / rate[0].abs());
    let allowed = TOLERANCE * rate[0].abs();
    for n in [TERMS - 2, TERMS - 1] {
        let last = rate[n].abs();
        if last * libm::pow(step, n as f64) > allowed {
            step = libm::pow(allowed / last, INVERSE[n]);
        }
    }
    // ṡ = φ, so s and ∫ s dt have the coefficients of φ, divided once and twice.
    let once: [f64; TERMS] = std::array::from_fn(|n| rate[n] * INVERSE[n + 1]);
    let twice: [f64; TERMS] = std::array::from_fn(|n| once[n] * INVERSE[n + 2]);
    let speed = |t: f64| at.speed + t * horner(t, &once);
    let stops = rate[0] < 0.0 && speed(step) <= 0.0;
    if stops {
        step = instant(speed, |t| horner(t, &rate), step);
    }
    let time = if step >= end { rest } else { step / unit };
    let way = at.speed * step + step * step * horner(step, &twice);
    let to = State {
        time: at.time + time,
        speed: speed(step),
        rate: horner(step, &rate) * unit,
        way: at.way + way / unit,
    };
    (stops, to)
}

/// The sum of a series at `t`.
fn horner(t: f64, coefficients: &[f64; TERMS]) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c)
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
