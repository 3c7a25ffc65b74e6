//! Directions of the set: the state's own, a few that the law sees, and the backward orbits of error and voltage under the
//! closed loop, which is where the walls of an invariant set stand.

use crate::coordinates::{E, P, S, Z};
use crate::setup::{Form, Gains};
use crate::units::Units;

/// Typical sizes of error, rate and voltage, by which directions are compared: counts, counts per tick, V.
const ERROR: f64 = 3.0;
const RATE: f64 = 0.5;
const VOLTS: f64 = 6.0;

/// Fineness of the directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fineness {
    /// Steps of each orbit.
    pub(crate) steps: usize,
    /// Directions nearer to one another than this are one.
    pub(crate) apart: f64,
    /// Orbits are of brakes weaker and stronger than the middle one by at least this factor; 1: only of those that there are,
    /// of one where they hardly differ.
    pub(crate) spread: f64,
    /// Orbits also of small shares of the law's gains, which limits leave where a count asks for several times the output.
    pub(crate) saturated: bool,
}

/// The law near its steady voltage: volts per count, and per count per tick.
fn linear(u: &Units) -> (f64, f64) {
    match u.law {
        Gains::Linear { kp, kd, .. } | Gains::Integral { kp, kd, .. } => (kp * u.count, kd * u.speed),
        Gains::Layer { kp, slope, boundary, .. } => {
            (kp * slope / boundary * u.count, kp / boundary * u.speed)
        }
        // As if it went in a straight line from one end to the other.
        Gains::Shell { slope, boundary } => {
            let per = (u.volts[1] - u.volts[0]) / (2.0 * boundary);
            (per * slope * u.count, per * u.speed)
        }
    }
}

/// The integral: volts that it gains per count in a tick, and share of what a limit cuts off that it takes back.
fn integral(u: &Units) -> (f64, f64) {
    match u.law {
        Gains::Integral { ki, tracking, .. } => (ki * u.period * u.count, u.period / tracking),
        _ => (0.0, 0.0),
    }
}

/// `c A` for the closed loop with `b` counts per tick² and volt; `share` is what limits leave of the law's demand, and `of_rate`
/// of its part by the rate. The state may end with the last measured error.
pub(crate) fn back(u: &Units, b: f64, (share, of_rate): (f64, f64), c: &[f64]) -> Vec<f64> {
    let ((kp, kd), (ki, follows)) = (linear(u), integral(u));
    let kd = kd * u.kappa * of_rate;
    let mut out = vec![0.0; c.len()];
    let last = P + u.delay + usize::from(u.memory().is_some());
    out[E] = c[E] + u.kappa * c[Z] + c.get(last).unwrap_or(&0.0);
    out[S] = c[E] + c[S];
    out[Z] = (1.0 - u.kappa) * c[Z];
    let pushed = b * (c[S] + 0.5 * c[E]);
    let mut answer = pushed;
    if u.delay > 0 {
        out[P] += pushed;
        for k in 1..u.delay {
            out[P + k] += c[P + k - 1];
        }
        answer = c[P + u.delay - 1];
    }
    let kept = u.memory().map_or(0.0, |i| c[i]);
    // The demand goes out by its share, and the integral loses what does not.
    let asked = share * answer - follows * (1.0 - share) * kept;
    out[E] -= (kp + kd + ki) * asked + ki * kept;
    out[Z] += kd * asked;
    if let Some(i) = u.memory() {
        out[i] = kept + asked;
    }
    out
}

fn sizes<const N: usize>() -> [f64; N] {
    let mut sizes = [VOLTS; N];
    (sizes[E], sizes[S], sizes[Z], sizes[N - 1]) = (ERROR, RATE, ERROR, ERROR);
    sizes
}

/// Directions of norm 1 in typical sizes, the state's own first; each with its opposite.
pub(crate) fn rows<const N: usize>(u: &Units, form: Form, fineness: Fineness) -> Vec<[f64; N]> {
    let mut rows = Vec::new();
    let unit = |i: usize| -> [f64; N] { std::array::from_fn(|k| f64::from(i == k)) };
    let own = if form == Form::Exact { N } else { N - 1 };
    let mut add = |row: [f64; N], apart: f64| {
        let sizes = sizes::<N>();
        let norm = row.iter().zip(sizes).map(|(x, size)| (x * size) * (x * size)).sum::<f64>().sqrt();
        if norm <= 0.0 || !norm.is_finite() {
            return;
        }
        let row = row.map(|x| x / norm);
        let near = |other: &[f64; N]| {
            let off = (0..N).map(|i| (row[i] - other[i]) * sizes[i]).map(|x| x * x).sum::<f64>();
            off.sqrt() < apart
        };
        if !rows.iter().any(near) {
            rows.push(row);
            rows.push(row.map(|x| -x));
        }
    };
    for i in 0..own {
        add(unit(i), 0.0);
    }
    let ((kp, kd), (ki, _)) = (linear(u), integral(u));
    let mut seeds: Vec<[f64; N]> = vec![unit(E), [0.0; N]];
    (seeds[1][E], seeds[1][Z]) = (kp + kd * u.kappa + ki, -kd * u.kappa);
    if let Some(i) = u.memory() {
        seeds[1][i] = -1.0;
        seeds.push(unit(i));
    }
    let mut plain = seeds.clone();
    for (i, j) in [(E, Z), (N - 1, E), (N - 1, Z)] {
        if i < own {
            let mut row = unit(i);
            row[j] = -1.0;
            plain.push(row);
        }
    }
    // Shares of the gains that a saturated loop, or a steeper part of the law, leaves.
    let mut shares: Vec<f64> = match (u.law, form) {
        (Gains::Layer { .. }, _) if fineness.saturated => vec![1.0, 2.0, 0.5, 0.25],
        (Gains::Layer { .. }, _) => vec![1.0, 2.0, 4.0, 0.5],
        (_, Form::Noise) => vec![1.0, 0.8, 0.65, 0.5, 0.35, 0.25, 0.12],
        (_, Form::Exact) => vec![1.0, 0.7, 0.5, 0.35, 0.25],
    };
    if fineness.saturated {
        shares.extend([0.12, 0.06]);
    }
    // In a saturated loop the slope of (31) by the error and that by the rate are not left alike.
    let of_rate: &[f64] = match u.law {
        Gains::Layer { .. } if fineness.saturated => &[0.0, 0.25, 0.5, 1.0],
        _ => &[1.0],
    };
    let middle = (u.brake[0] * u.brake[1]).sqrt();
    let spread = fineness.spread;
    let wide = u.brake[1] > 1.25 * u.brake[0] || spread > 1.0;
    let ends = [u.brake[0].min(middle / spread), u.brake[1].max(middle * spread)];
    let brakes = if wide { vec![ends[0], middle, ends[1]] } else { vec![middle] };
    let mut orbits: Vec<Vec<[f64; N]>> = vec![plain];
    for _ in 0..fineness.steps {
        orbits.push(Vec::new());
    }
    for b in &brakes {
        for left in shares.iter().flat_map(|share| of_rate.iter().map(move |rate| (*share, *rate))) {
            for seed in &seeds {
                let mut c = *seed;
                for orbit in orbits.iter_mut().skip(1) {
                    let next = back(u, *b, left, &c);
                    c.copy_from_slice(&next);
                    // In the set's coordinates the last measured error is another way to write the error.
                    orbit.push(c);
                }
            }
        }
    }
    for row in orbits.into_iter().flatten() {
        let mut row = row;
        if form == Form::Noise {
            row[N - 1] = 0.0;
            add(row, fineness.apart);
            continue;
        }
        for moved in [0.0, 0.25, 0.5, 1.0] {
            let mut row = row;
            row[N - 1] += moved * row[E];
            row[E] *= 1.0 - moved;
            add(row, fineness.apart);
        }
    }
    rows
}
