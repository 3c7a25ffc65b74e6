//! T/J and the delay, from releases: what explains every count.
//!
//! A brake at 0 V takes nothing. From `τ` after the voltage on the shaft falls freely, `θ = θ₀ + (T/J) f(t − τ)`, with
//! `f(s) = (cs − 1 + e^{−cs})/c²` and `c = C_d/J`; each sample of `n` counts says `n ≤ θ/q < n + 1`. The place `θ₀` within its
//! count drops out of each pair of samples, which leaves bounds of T/J:
//!
//! ```text
//! (n_j − n_i − 1)/(f_j − f_i) < (T/J)/q < (n_j − n_i + 1)/(f_j − f_i)        f_j > f_i
//! ```
//!
//! Nothing here is a matter of chance: a value outside the set contradicts a count.

use crate::Estimate;
use crate::recording::Recording;

/// Shortest release that tells something, periods.
const SHORTEST: usize = 8;
/// Samples of a release that are looked at: its pairs are counted by the million.
const LONGEST: usize = 120;
/// Samples for which the shaft has to have rested before.
const RESTED: usize = 10;
/// Longest delay that is looked for, periods.
const LONGEST_DELAY: f64 = 6.0;
/// Steps of the delay and of C/J, periods and number. [`SLACK`] covers what lies between.
const DELAY_STEP: f64 = 0.025;
const DAMPINGS: usize = 12;
/// Counts by which an edge of the encoder may be off, half a step of the delay among them.
const SLACK: f64 = 0.06;

/// A fall from rest.
#[derive(Clone, Debug)]
pub struct Release {
    /// Its recording, and the first tick with 0 V.
    pub place: (String, u64),
    /// Counts from that tick on, while nothing brakes.
    counts: Vec<f64>,
    /// Sampling period, s; a count, rad.
    units: (f64, f64),
}

/// What the releases tell.
#[derive(Clone, Debug)]
pub struct Fall {
    /// T/J, rad/s².
    pub pull: Estimate,
    /// Delay from a sample's voltage to its effect, s.
    pub delay: Estimate,
}

/// No fall explains all counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Unexplained {
    /// The recording.
    pub name: String,
    /// Tick of the run.
    pub tick: u64,
}

/// The releases in a recording.
#[must_use]
pub fn releases(recording: &Recording) -> Vec<Release> {
    let ticks = &recording.ticks;
    let open = |i: usize| ticks[i].volts.abs() <= 0.5 * recording.step_volts + 1e-9;
    let mut found = Vec::new();
    let mut i = RESTED;
    while i < ticks.len() {
        let begins = open(i) && !open(i - 1);
        let rested = ticks[i - RESTED..=i].windows(2).all(|w| w[0].counts == w[1].counts);
        // A voltage on its way down lets go before it is 0.
        let sudden = ticks[i - RESTED..i].windows(2).all(|w| w[1].volts > 0.9 * w[0].volts);
        if !(begins && rested && sudden) {
            i += 1;
            continue;
        }
        let end = (i..ticks.len()).find(|&j| !open(j)).unwrap_or(ticks.len() - 1);
        if end - i >= SHORTEST {
            let first = ticks[i].counts;
            found.push(Release {
                place: (recording.name.clone(), recording.first_tick + i as u64),
                counts: ticks[i..=end.min(i + LONGEST)].iter().map(|t| (t.counts - first) as f64).collect(),
                units: (recording.period, recording.radians_per_count()),
            });
        }
        i = end + 1;
    }
    found
}

/// Fall from rest in a time at unit acceleration, with damping.
fn flight(time: f64, damping: f64) -> f64 {
    let x = damping * time;
    if x < 1e-3 {
        return time * time * (0.5 - x / 6.0 + x * x / 24.0);
    }
    (x + libm::expm1(-x)) / (damping * damping)
}

impl Release {
    /// Narrows bounds of T/J (rad/s²); the index of the sample at which nothing was left.
    fn narrow(&self, delay: f64, damping: f64, (low, high): &mut (f64, f64)) -> Result<(), usize> {
        let (period, count) = self.units;
        let falls: Vec<f64> =
            (0..self.counts.len()).map(|i| flight((i as f64 * period - delay).max(0.0), damping)).collect();
        for j in 1..falls.len() {
            // The first edge says most together with the last: pairs within a count say nothing.
            for i in 0..j {
                let (way, fall) = (self.counts[j] - self.counts[i], falls[j] - falls[i]);
                let room = 1.0 + SLACK;
                if way + room <= *low * fall / count || way - room >= *high * fall / count {
                    return Err(j);
                }
                if fall > 0.0 {
                    *low = low.max((way - room) * count / fall);
                    *high = high.min((way + room) * count / fall);
                }
            }
            if *low >= *high {
                return Err(j);
            }
        }
        Ok(())
    }
}

/// The set of T/J and delay that explains every count of all releases, with C/J between two values, 1/s.
///
/// # Errors
/// The tick that nothing explains, of the values that explain most.
pub fn fall(releases: &[Release], (least, most): (f64, f64)) -> Result<Fall, Unexplained> {
    let mut set: Option<[f64; 4]> = None;
    // Weight, and sums of T/J and delay over the set.
    let mut sums = [0.0; 3];
    let mut longest = (0, 0, 0);
    let period = releases.first().map_or(1e-3, |r| r.units.0);
    let steps = (LONGEST_DELAY / DELAY_STEP) as usize;
    for step in 0..=steps {
        let delay = step as f64 * DELAY_STEP * period;
        for k in 0..DAMPINGS {
            let damping = least + (most - least) * k as f64 / (DAMPINGS - 1) as f64;
            let mut bounds = (0.0, f64::INFINITY);
            let mut explained = 0;
            let failed = releases.iter().enumerate().find_map(|(n, release)| {
                let failed = release.narrow(delay, damping, &mut bounds).err();
                explained += failed.unwrap_or(release.counts.len());
                failed.map(|at| (n, at))
            });
            if let Some((n, at)) = failed {
                longest = longest.max((explained, n, at));
                continue;
            }
            let (low, high) = bounds;
            let width = high - low;
            let now = set.unwrap_or([f64::INFINITY, 0.0, f64::INFINITY, 0.0]);
            set = Some([now[0].min(low), now[1].max(high), now[2].min(delay), now[3].max(delay)]);
            sums[0] += width;
            sums[1] += width * 0.5 * (low + high);
            sums[2] += width * delay;
        }
    }
    let Some([low, high, soonest, latest]) = set else {
        let (_, n, at) = longest;
        let (name, tick) = releases.get(n).map_or_else(Default::default, |r| r.place.clone());
        return Err(Unexplained { name, tick: tick + at as u64 });
    };
    let half = 0.5 * DELAY_STEP * period;
    Ok(Fall {
        pull: Estimate { value: sums[1] / sums[0], low, high },
        delay: Estimate { value: sums[2] / sums[0], low: (soonest - half).max(0.0), high: latest + half },
    })
}
