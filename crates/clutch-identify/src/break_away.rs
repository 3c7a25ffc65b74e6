//! μ_s/μ_d and the Stribeck velocity, from break-aways under a voltage that falls slowly.
//!
//! At break-away `μ_s K m u_b = T`, with the ripple's factor `m` at that place. A moment later the shaft slides at the same
//! place, and `μ_d K m u_b = T μ_d/μ_s`: it sets off with `θ̈ = (T/J)(1 − μ_d/μ_s)`, whatever `m` is. Behind that friction changes
//! along the way, which the filter of [`crate::filter`] follows from there.
//!
//! Nobody knows when the shaft broke away: the time is an unknown of each break-away, and the result is summed over it.
//! By the Stribeck velocity the shaft sets off late: from the step of the voltage that triggered it, one of several, friction
//! first has to fall.

use crate::Estimate;
use crate::filter::{Belief, Shaft};
use crate::profile::{Profile, spaced};
use crate::recording::Recording;
use crate::ride;

/// Conditions of a break-away.
const RESTED: f64 = 0.05; // s
const LONGEST: f64 = 0.08; // s, with 20 000 counts
const SILENT: f64 = 0.014; // s without an edge, after the first, with 20 000 counts
const FEWEST_COUNTS: i64 = 6;
const MOST_COUNTS: i64 = 30;
/// Slope of friction where a shaft rests, as a multiple of the ripple's.
const STEEPER: f64 = 4.0;
/// Step of the time at which it sets off, periods.
const TIME_STEP: f64 = 0.25;
/// Ratios that are tried at first: μ_s/μ_d − 1 from and to, and their number.
const EXCESS: (f64, f64, usize) = (0.02, 3.0, 44);
/// The same for the Stribeck velocity, rad/s.
const VELOCITIES: (f64, f64, usize) = (1e-4, 3e-2, 58);
/// Most steps of the voltage that may have triggered a break-away, and thresholds within each.
const TRIGGERS: usize = 12;
const THRESHOLDS: usize = 6;
/// Ratios over which the Stribeck velocity is looked for, and the blur of the time at which a shaft sets off, periods.
const RATIOS: usize = 7;
const BLUR: f64 = 0.375;
/// Share of break-aways that no Stribeck velocity explains.
const STRAY: f64 = 0.01;

/// A break-away.
#[derive(Clone, Debug)]
pub struct BreakAway<'a> {
    recording: &'a Recording,
    /// Sample of the first edge, and the last one that is looked at.
    ticks: (usize, usize),
}

/// The shaft as known from releases and rides.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// T/J, rad/s².
    pub pull: f64,
    /// Delay, s.
    pub delay: f64,
    /// C/J, 1/s.
    pub damping: f64,
    /// Mean friction `h`, 1/V.
    pub friction: f64,
    /// Root mean square of the ripple, 1/V.
    pub ripple: f64,
    /// Waves of the ripple per turn.
    pub waves: f64,
}

/// The break-aways in a recording.
#[must_use]
pub fn break_aways(recording: &Recording) -> Vec<BreakAway<'_>> {
    let ticks = &recording.ticks;
    let moved = |i: usize| ticks[i].counts != ticks[i - 1].counts;
    let mut found = Vec::new();
    let mut still = 0;
    let resting = recording.samples(RESTED);
    let [longest, silent] = [LONGEST, SILENT].map(|time| recording.samples(time * recording.coarse()));
    for i in 1..ticks.len() {
        if !moved(i) {
            still += 1;
            continue;
        }
        let rested = std::mem::take(&mut still) >= resting;
        // Not let go, but let slip: a voltage that has fallen by little.
        let before = &ticks[i.saturating_sub(resting)..i];
        let slowly = before.windows(2).all(|w| {
            let step = w[0].volts - w[1].volts;
            step.abs() <= (3.0 * recording.step_volts).max(0.01 * w[0].volts) && w[1].volts > 0.0
        });
        if !(rested && slowly) {
            continue;
        }
        let mut end = i;
        for j in i + 1..ticks.len().min(i + longest) {
            if ticks[j].counts < ticks[j - 1].counts || j - end > silent {
                break;
            }
            if moved(j) {
                end = j;
            }
            if ticks[j].counts - ticks[i].counts >= MOST_COUNTS {
                break;
            }
        }
        if ticks[end].counts - ticks[i].counts >= FEWEST_COUNTS {
            found.push(BreakAway { recording, ticks: (i, end) });
        }
    }
    found
}

/// Mean voltage at which a shaft breaks away, V; none without a break-away.
pub(crate) fn mean_volts(slips: &[BreakAway<'_>]) -> Option<f64> {
    let volts = |slip: &BreakAway<'_>| slip.recording.ticks[slip.ticks.0 - 1].volts;
    (!slips.is_empty()).then(|| slips.iter().map(volts).sum::<f64>() / slips.len() as f64)
}

/// Logarithm of a mean of exponentials.
fn log_mean(logs: impl Iterator<Item = f64> + Clone) -> f64 {
    let (n, most) = logs.clone().fold((0_u32, f64::NEG_INFINITY), |(n, most), x| (n + 1, most.max(x)));
    if n == 0 || most == f64::NEG_INFINITY {
        return f64::NEG_INFINITY;
    }
    most + libm::log(logs.map(|x| libm::exp(x - most)).sum::<f64>() / f64::from(n))
}

impl BreakAway<'_> {
    /// Tick of the run of its first edge.
    #[must_use]
    pub fn place(&self) -> (String, u64) {
        (self.recording.name.clone(), self.recording.first_tick + self.ticks.0 as u64)
    }

    /// Times at which it may have set off with an acceleration, periods from the first sample: no later than the first
    /// edge, no earlier than a count before it.
    fn times(&self, acceleration: f64) -> Vec<f64> {
        let first = self.ticks.0 as f64;
        let longest = (2.8 / acceleration.max(1e-4)).sqrt() + 2.0;
        let n = (longest.min(first - 2.0) / TIME_STEP) as usize;
        (1..=n).map(|k| first - k as f64 * TIME_STEP).collect()
    }

    /// Logarithm of the density of the edges, for a ratio and a time at which it sets off.
    fn density(&self, shaft: &Shaft, known: &Known, ratio: f64, time: f64) -> f64 {
        let r = self.recording;
        let (first, last) = self.ticks;
        let delay = known.delay / r.period;
        let i = time.floor() as usize;
        let part = (time - i as f64, 1.0);
        let at_rest = r.at_pad(i, (part.0, (part.0 + 0.01).min(1.0)), delay);
        let friction = 1.0 / (ratio * at_rest);
        let mut belief = Belief::new(shaft, 0.5, (0.0, 0.0), (known.friction, 0.0));
        // A place within its count; friction as known as a step of the converter.
        let step = friction * r.step_volts / at_rest;
        belief.mean[3] = friction - known.friction;
        belief.spread[(0, 0)] = 1.0 / 12.0;
        belief.spread[(3, 3)] = step * step / 12.0;
        // A shaft comes to rest where friction rises: how it goes on from there is not as at any place of the disc.
        belief.spread[(4, 4)] *= STEEPER * STEEPER;
        let origin = r.ticks[first - 1].counts;
        let mut log = 0.0;
        for j in i..last {
            let part = if j == i { part } else { (0.0, 1.0) };
            belief.advance(shaft, r.at_pad(j, part, delay), part.1 - part.0);
            let (before, now) = (r.ticks[j].counts, r.ticks[j + 1].counts);
            if now > before {
                log += belief.cross((now - origin) as f64, 0.0).density;
            }
        }
        log
    }

    /// Logarithm of the density for a ratio, over all times at which it may have set off; and these with theirs.
    fn over_times(&self, known: &Known, ratio: f64) -> (f64, Vec<(f64, f64)>) {
        let shaft = ride::shaft(self.recording, known.pull, known.damping, known.ripple, known.waves);
        let times = self.times(shaft.pull * (1.0 - 1.0 / ratio));
        let logs: Vec<(f64, f64)> =
            times.iter().map(|&time| (time, self.density(&shaft, known, ratio, time))).collect();
        // A sum, not a mean: every time is as likely as another, however many are looked at.
        let total = log_mean(logs.iter().map(|l| l.1)) + libm::log(logs.len().max(1) as f64);
        (total, logs)
    }
}

/// μ_s/μ_d; none where the break-aways do not bound it.
#[must_use]
pub fn ratio(slips: &[BreakAway<'_>], known: &Known, fall: f64) -> Option<Estimate> {
    let profile = |excess: &mut dyn Iterator<Item = f64>| Profile {
        points: excess
            .map(|e| (e, slips.iter().map(|slip| slip.over_times(known, 1.0 + e).0).sum()))
            .collect(),
    };
    let coarse = profile(&mut spaced(EXCESS.0, EXCESS.1, EXCESS.2));
    let (_, low, high) = coarse.estimate(3.0 * fall);
    // A peak may lie anywhere between the neighbours of the highest point.
    let best = coarse.best().0;
    let step = libm::pow(EXCESS.1 / EXCESS.0, 1.0 / (EXCESS.2 - 1) as f64);
    let (low, high) = (low.unwrap_or(EXCESS.0).min(best / step), high?.max(best * step));
    let fine = profile(&mut spaced(0.97 * low, 1.03 * high, 40));
    let (value, low, high) = fine.estimate(fall);
    Some(Estimate { value: 1.0 + value, low: 1.0 + low.unwrap_or(0.0), high: 1.0 + high? })
}

/// Time by which a shaft sets off later than one whose friction falls at once, s: it breaks away at the voltage `threshold`,
/// which sample `from` fell below.
fn late(r: &Recording, known: &Known, ratio: f64, velocity: f64, threshold: f64, from: usize) -> f64 {
    let mut time = 0.0;
    let mut w = 0.0;
    let enough = 8.0 * velocity;
    let longest = 0.06;
    let mut ideal = 0.0;
    while w < enough && time < longest {
        let i = from + (time / r.period) as usize;
        let volts = r.volts(i as isize);
        let drop = libm::exp(-w / velocity);
        let slide = volts / (ratio * threshold);
        let a = known.pull * (1.0 - slide * (1.0 + (ratio - 1.0) * drop));
        let fast = known.pull * (1.0 - slide);
        if a <= 0.0 {
            return f64::INFINITY;
        }
        let dt = (0.05 * (w + 0.05 * velocity) / a).min(r.period / 4.0);
        w += a * dt;
        time += dt;
        ideal = w / fast;
    }
    time - ideal
}

/// The word of a break-away on the time at which it set off: times (periods) with their weights, and the steps of the voltage
/// that may have triggered it.
struct SetOff<'a> {
    recording: &'a Recording,
    times: Vec<(f64, f64)>,
    triggers: Vec<usize>,
}

impl<'a> BreakAway<'a> {
    /// For a ratio; and the logarithm of its density.
    fn set_off(&self, known: &Known, ratio: f64) -> (f64, SetOff<'a>) {
        let r = self.recording;
        let (log, times) = self.over_times(known, ratio);
        let times = times.into_iter().map(|(time, own)| (time, libm::exp(own - log)));
        let falls = (1..self.ticks.0).rev().filter(|&i| r.ticks[i].volts < r.ticks[i - 1].volts);
        let times = times.filter(|t| t.1 > 1e-5).collect();
        (log, SetOff { recording: r, times, triggers: falls.take(TRIGGERS).collect() })
    }
}

impl SetOff<'_> {
    /// Logarithm of the density of a Stribeck velocity.
    fn density(&self, known: &Known, ratio: f64, velocity: f64) -> f64 {
        let r = self.recording;
        let mut density = 0.0;
        for &i in &self.triggers {
            let (above, below) = (r.ticks[i - 1].volts, r.ticks[i].volts);
            for k in 0..THRESHOLDS {
                let part = (k as f64 + 0.5) / THRESHOLDS as f64;
                let late = late(r, known, ratio, velocity, below + part * (above - below), i);
                let sets_off = i as f64 + (known.delay + late) / r.period;
                for &(time, weight) in &self.times {
                    let off = (time - sets_off) / BLUR;
                    density += weight * libm::exp(-0.5 * off * off);
                }
            }
        }
        libm::log(STRAY + density)
    }
}

/// Stribeck velocity, rad/s, over all of the ratio's interval, down to 0 where it is too small to be determined; none where the
/// break-aways do not bound it above.
#[must_use]
pub fn stribeck(slips: &[BreakAway<'_>], known: &Known, ratio: &Estimate, fall: f64) -> Option<Estimate> {
    let ratios = (0..RATIOS).map(|k| ratio.low + (ratio.high - ratio.low) * k as f64 / (RATIOS - 1) as f64);
    let curves: Vec<Vec<f64>> = ratios
        .map(|ratio| {
            let set_off: Vec<_> = slips.iter().map(|slip| slip.set_off(known, ratio)).collect();
            let all: f64 = set_off.iter().map(|s| s.0).sum();
            spaced(VELOCITIES.0, VELOCITIES.1, VELOCITIES.2)
                .map(|velocity| {
                    all + set_off.iter().map(|s| s.1.density(known, ratio, velocity)).sum::<f64>()
                })
                .collect()
        })
        .collect();
    let points = spaced(VELOCITIES.0, VELOCITIES.1, VELOCITIES.2)
        .enumerate()
        .map(|(i, velocity)| (libm::log(velocity), log_mean(curves.iter().map(|curve| curve[i]))))
        .collect();
    let (value, low, high) = Profile { points }.estimate(fall);
    Some(Estimate { value: libm::exp(value), low: low.map_or(0.0, libm::exp), high: libm::exp(high?) })
}
