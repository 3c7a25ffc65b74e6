//! J/K and the delay of a motor axis, from hops: a shaft that sets off under a sudden voltage.
//!
//! `θ̈ = (K/J) (u − (h + r) − (C/K) θ̇)` with friction `h + r` in volts, which the filter of [`crate::filter`] follows along the way.
//! K/J and delay that explain the times of the edges best: a matter of their density, over all hops.

use crate::Estimate;
use crate::confidence::FALL;
use crate::filter::{Belief, Shaft};
use crate::profile::{Profile, spaced};
use crate::recording::Recording;
use crate::ride;

/// Time for which the shaft has to have rested before, s, and within which its voltage has to have jumped, by a share of it.
const RESTED: f64 = 0.03;
const JUMPED: f64 = 0.02;
const JUMP: f64 = 0.3;
/// Counts that a hop has at least, and s at most.
const FEWEST_COUNTS: i64 = 10;
const LONGEST: f64 = 0.15;
/// Time without an edge that ends it, s, with 20 000 counts: a shaft so slow has Stribeck's friction.
const SILENT: f64 = 0.005;
/// Edges that are passed over at its beginning, for the same reason.
const PASSED: usize = 2;
/// K/J that is looked for at first, rad/s² per volt, and the number of values.
const PULLS: (f64, f64, usize) = (0.1, 1e5, 140);
/// Delays that are looked for, periods.
const LONGEST_DELAY: f64 = 8.0;
/// Most hops that are looked at.
const MOST: usize = 60;
/// Times by which the density of a hop is overrated: a wave's neighbours on a disc are no wave of a filter.
const OVERRATED: f64 = 1.5;

/// A hop: its edges, as tick and counts from the first on, turned so that it goes forwards.
#[derive(Clone, Debug)]
pub struct Hop {
    recording: Recording,
    edges: Vec<(usize, i64)>,
    backwards: bool,
}

/// Friction as known, V, and the rest that a hop does not show.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// Mean friction and its deviation, either way: forwards, backwards.
    pub friction: [(f64, f64); 2],
    /// Root mean square of its ripple.
    pub ripple: f64,
    /// Waves of the ripple per turn.
    pub waves: f64,
    /// C/K, V s/rad.
    pub viscous: f64,
}

/// The hops in a recording, forwards or backwards.
#[must_use]
pub fn hops(recording: &Recording) -> Vec<Hop> {
    let ticks = &recording.ticks;
    let mut found = Vec::new();
    let (mut still, mut i) = (0, 1);
    let [resting, jumping, longest] = [RESTED, JUMPED, LONGEST].map(|time| recording.samples(time));
    let silent = recording.samples(SILENT * recording.coarse());
    while i < ticks.len() {
        let moved = ticks[i].counts - ticks[i - 1].counts;
        if moved == 0 {
            still += 1;
            i += 1;
            continue;
        }
        let rested = std::mem::take(&mut still) >= resting;
        let volts = |k: usize| ticks[i.saturating_sub(k)].volts;
        let jumped =
            (volts(1) - volts(jumping)).abs() > JUMP * volts(1).abs() && volts(1) * moved as f64 > 0.0;
        if !(rested && jumped) {
            i += 1;
            continue;
        }
        let way = moved.signum();
        let mut edges = vec![(i, ticks[i].counts)];
        for j in i + 1..ticks.len().min(i + longest) {
            let step = (ticks[j].counts - ticks[j - 1].counts) * way;
            if step < 0 || j - edges[edges.len() - 1].0 > silent {
                break;
            }
            if step > 0 {
                edges.push((j, ticks[j].counts));
            }
        }
        let (end, last) = edges[edges.len() - 1];
        if (last - ticks[i].counts) * way >= FEWEST_COUNTS && edges.len() > PASSED + 4 {
            let from = i - resting;
            let mut recording = Recording {
                volts_before: ticks[from].volts,
                first_tick: recording.first_tick + from as u64,
                ticks: ticks[from..=end].to_vec(),
                ..recording.clone()
            };
            if way < 0 {
                recording = recording.turned();
                edges.iter_mut().for_each(|e| e.1 = -1 - e.1);
            }
            edges.iter_mut().for_each(|e| e.0 -= from);
            found.push(Hop { recording, edges, backwards: way < 0 });
        }
        i = end + 1;
    }
    found
}

impl Hop {
    /// Logarithm of the density of the edges; `delay` in periods, `friction` the mean and its deviation.
    fn density(&self, shaft: &Shaft, delay: f64, friction: (f64, f64)) -> f64 {
        let r = &self.recording;
        let edges = &self.edges[PASSED..];
        let (first, origin) = edges[0];
        let (later, counts) = edges[2];
        let rate = (counts - origin) as f64 / (later - first) as f64;
        let mut belief = Belief::new(shaft, 0.0, (rate, rate), friction);
        let span = rate.clamp(0.02, 1.0);
        belief.mean[0] = 0.5 * span;
        belief.spread[(0, 0)] = span * span / 12.0;
        let (end, _) = self.edges[self.edges.len() - 1];
        let mut log = 0.0;
        for j in first..end {
            belief.advance(shaft, r.at_pad(j, (0.0, 1.0), delay), 1.0);
            let (before, now) = (r.ticks[j].counts, r.ticks[j + 1].counts);
            if now > before {
                log += belief.cross((now - origin) as f64, 0.0).density;
            }
        }
        log
    }
}

/// Sum over the hops.
fn density(hops: &[Hop], known: &Known, pull: f64, delay: f64) -> f64 {
    let each = hops.iter().map(|hop| {
        let shaft = ride::shaft(&hop.recording, pull, known.viscous * pull, known.ripple, known.waves);
        hop.density(&shaft, delay, known.friction[usize::from(hop.backwards)])
    });
    each.sum::<f64>() / OVERRATED
}

/// K/J and the delay (s) that the hops determine; none without hops, or where these bound one of them on one side alone.
#[must_use]
pub fn estimate(hops: &[Hop], known: &Known) -> Option<(Estimate, Estimate)> {
    let period = hops.first()?.recording.period;
    let hops = &hops[..hops.len().min(MOST)];
    let (mut pull, mut delay) = coarse(hops, known);
    // Ever closer around the peak: first by the coarse grid's own steps.
    let (mut wide, mut long) = (1.1, 0.75);
    let mut found = None;
    for _ in 0..3 {
        let pulls: Vec<f64> = spaced(pull / wide, pull * wide, 25).collect();
        let delays: Vec<f64> =
            (0..25).map(|k| delay + long * (f64::from(k) / 12.0 - 1.0)).filter(|d| *d >= 0.0).collect();
        let grid: Vec<Vec<f64>> =
            delays.iter().map(|d| pulls.iter().map(|p| density(hops, known, *p, *d)).collect()).collect();
        let most = |logs: &mut dyn Iterator<Item = f64>| logs.fold(f64::NEG_INFINITY, f64::max);
        let along = Profile {
            points: (0..pulls.len()).map(|i| (pulls[i], most(&mut grid.iter().map(|row| row[i])))).collect(),
        };
        let across = Profile {
            points: (0..delays.len()).map(|j| (delays[j], most(&mut grid[j].iter().copied()))).collect(),
        };
        (pull, delay) = (along.best().0, across.best().0);
        let (p, low, high) = along.estimate(FALL);
        let (d, soonest, latest) = across.estimate(FALL);
        let open = low.is_none() || high.is_none() || latest.is_none();
        if open {
            // Not narrower, but elsewhere.
            continue;
        }
        let (low, high, latest) = (low?, high?, latest?);
        wide = (3.0 * (high - low) / pull).clamp(0.002, wide - 1.0) + 1.0;
        long = (1.5 * (latest - soonest.unwrap_or(0.0))).clamp(0.02, long);
        found = Some((
            Estimate { value: p, low, high },
            Estimate { value: d, low: soonest.unwrap_or(0.0), high: latest }.times(period),
        ));
    }
    found
}

/// The peak on a coarse grid, over some hops of each way.
fn coarse(hops: &[Hop], known: &Known) -> (f64, f64) {
    let some: Vec<Hop> = hops.iter().step_by(hops.len().div_ceil(8)).cloned().collect();
    let delays = (0..=(2.0 * LONGEST_DELAY) as usize).map(|k| 0.5 * k as f64);
    let mut best = (f64::NEG_INFINITY, 1.0, 0.0);
    for delay in delays {
        for pull in spaced(PULLS.0, PULLS.1, PULLS.2) {
            let log = density(&some, known, pull, delay);
            if log > best.0 {
                best = (log, pull, delay);
            }
        }
    }
    (best.1, best.2)
}

/// J/K, V s²/rad, from hops and nothing else; none without hops.
#[must_use]
pub fn rough(recordings: &[Recording]) -> Option<f64> {
    let all: Vec<Hop> = recordings.iter().flat_map(hops).collect();
    (!all.is_empty()).then(|| 1.0 / coarse(&all, &guessed(recordings)).0)
}

/// Friction as the volts under which a shaft moves have it: known within a half.
#[must_use]
pub fn guessed(recordings: &[Recording]) -> Known {
    let mut volts: Vec<f64> = recordings
        .iter()
        .flat_map(|r| r.ticks.windows(2).filter(|w| w[0].counts != w[1].counts).map(|w| w[1].volts.abs()))
        .collect();
    volts.sort_by(f64::total_cmp);
    let middle = volts.get(volts.len() / 2).copied().unwrap_or(0.0);
    let friction = [(middle, 0.5 * middle); 2];
    Known { friction, ripple: 0.1 * middle, waves: ride::WAVES_PER_TURN, viscous: 0.0 }
}
