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
//! An actuator with a lag lets go gradually, each release with a delay of its own: `lag.rs`.
//!
//! Nothing here is a matter of chance: a value outside the set contradicts a count.

use crate::Estimate;
use crate::lag::{self, LagLine, Late};
use crate::recording::Recording;
use crate::seen::Fell;

/// Shortest release that shows something, periods.
const SHORTEST: usize = 8;
/// Samples of a release that are looked at: its pairs are counted by the million.
const LONGEST: usize = 120;
/// Samples for which the shaft has to have rested before.
const RESTED: usize = 10;
/// Longest delay that is looked for, periods.
const LONGEST_DELAY: f64 = 16.0;
/// Steps of the delay and of C/J, periods and number. [`SLACK`] covers what lies between.
const DELAY_STEP: f64 = 0.025;
const DAMPINGS: usize = 12;
/// Periods by which delays of releases may be apart: a lag as long as that shows in the falls themselves.
const MOST_APART: f64 = 3.0;
/// Counts by which an edge of the encoder may be off, half a step of the delay among them: of 20 000 counts at 1 ms, and of fewer
/// or shorter ones.
const SLACK: f64 = 0.06;
/// The same where each release has a delay of its own and that explains nothing.
const LOOSER: f64 = 0.5;

/// A fall from rest.
#[derive(Clone, Debug)]
pub struct Release {
    /// Its recording, and the first tick with 0 V.
    pub place: (String, u64),
    /// Voltage before it, V.
    before: f64,
    /// Counts from that tick on, while nothing brakes.
    counts: Vec<f64>,
    /// Sampling period, s; a count, rad.
    units: (f64, f64),
}

/// Findings of the releases.
#[derive(Clone, Debug)]
pub struct Fall {
    /// T/J, rad/s².
    pub pull: Estimate,
    /// Delay from a sample's voltage to its effect, s; of an actuator with a lag that of a voltage that changes slowly.
    pub delay: Estimate,
    /// Lag of the actuator, s; `None` if releases came from one voltage, or a delay for each explains nothing.
    pub lag: Option<Estimate>,
    /// `None` if one delay explains all releases to the last count; else what it took: a delay for each release, and
    /// counts by which edges were off.
    pub looser: Option<f64>,
}

impl Fall {
    /// Lag, s; 0 where there may be none.
    #[must_use]
    pub fn lags(&self) -> f64 {
        self.lag.map_or(0.0, Estimate::if_any)
    }

    /// Delay without that lag, s.
    #[must_use]
    pub fn dead_time(&self) -> f64 {
        self.delay.less(self.lags()).value
    }

    /// Releases beside this fall, with C/J as known, 1/s. Where one delay does not explain them all, each has its own.
    #[must_use]
    pub fn beside(&self, releases: &[Release], damping: Estimate) -> Vec<Fell> {
        let slack = self.looser.unwrap_or(SLACK * coarser(releases));
        let with = (slack, self.lags());
        let shape = Shape { damping: damping.value, lag: self.lags(), slack };
        let of = |release: &Release| {
            let own = || release.delay(&self.pull, (damping.low, damping.high), with);
            let one = self.looser.is_none() && self.lags() <= 0.0;
            Some(release.beside(self.pull.value, if one { self.delay.value } else { own()? }, shape))
        };
        releases.iter().filter_map(of).collect()
    }
}

/// No fall explains all counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Unexplained {
    /// The recording.
    pub name: String,
    /// Tick of the run.
    pub tick: u64,
    /// The way in which releases differ from each other or from a fall, if that is seen.
    pub apart: Option<Apart>,
}

/// Releases that no one torque with one delay explains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Apart {
    /// T/J, rad/s²: one release has at most the first, another at least the second.
    Pulls(f64, f64),
    /// Least and greatest delay with one T/J for all, s.
    Delays(f64, f64),
    /// So many releases are no fall under a steady torque, even by themselves.
    Within(usize),
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
                before: ticks[i - 1].volts,
                counts: ticks[i..=end.min(i + LONGEST)].iter().map(|t| (t.counts - first) as f64).collect(),
                units: (recording.period, recording.radians_per_count()),
            });
        }
        i = end + 1;
    }
    found
}

/// Times the slack that edges of these releases may be off: between two steps a shaft goes the more counts the finer these are,
/// and the longer a period.
fn coarser(releases: &[Release]) -> f64 {
    let finest =
        |release: &Release| release.units.0 / 1e-3 * (core::f64::consts::TAU / 20_000.0) / release.units.1;
    releases.iter().map(finest).fold(1.0, f64::max)
}

/// Fall from rest in a time at unit acceleration, with damping.
fn flight(time: f64, damping: f64) -> f64 {
    let x = damping * time;
    if x < 1e-3 {
        return time * time * (0.5 - x / 6.0 + x * x / 24.0);
    }
    (x + libm::expm1(-x)) / (damping * damping)
}

/// A fall but for T/J and delay: C/J, 1/s; the actuator's lag, s; counts by which edges may be off.
#[derive(Clone, Copy, Debug)]
struct Shape {
    damping: f64,
    lag: f64,
    slack: f64,
}

impl Shape {
    /// Fall from rest in a time at unit acceleration, under what the brake has left behind the break-away.
    fn fall(&self, time: f64) -> f64 {
        let left = if self.lag > 0.0 { lag::left_of_fall(time, self.lag) } else { 0.0 };
        flight(time, self.damping) - left
    }
}

/// Counts of a fall that says something of a delay.
const FEWEST_COUNTS: f64 = 20.0;

impl Release {
    /// `true` if the shaft falls so far that its delay shows.
    fn falls(&self) -> bool {
        self.counts.last().is_some_and(|way| *way >= FEWEST_COUNTS)
    }

    /// The delay with which a T/J explains it, s: the middle of its set.
    fn delay(&self, pull: &Estimate, dampings: (f64, f64), (slack, lag): (f64, f64)) -> Option<f64> {
        let explains = |delay: &f64| {
            (0..DAMPINGS).any(|k| {
                let shape = Shape { damping: between(dampings, k), lag, slack };
                self.narrow(*delay, shape, &mut (pull.low, pull.high)).is_ok()
            })
        };
        let ends = delays(self.units.0).filter(explains).fold(None, |ends: Option<(f64, f64)>, delay| {
            Some(ends.map_or((delay, delay), |(soonest, _)| (soonest, delay)))
        });
        ends.map(|(soonest, latest)| 0.5 * (soonest + latest))
    }

    /// Its way beside a fall's.
    fn beside(&self, pull: f64, delay: f64, shape: Shape) -> Fell {
        let (period, count) = self.units;
        let fall = |i: usize| pull * shape.fall((i as f64 * period - delay).max(0.0));
        let falls: Vec<f64> = (0..self.counts.len()).map(fall).collect();
        // The place within a count that goes with most of them.
        let rest = falls.iter().zip(&self.counts).map(|(fall, n)| n * count - fall);
        let (least, most) =
            rest.fold((f64::INFINITY, f64::NEG_INFINITY), |ends, x| (ends.0.min(x), ends.1.max(x)));
        let start = 0.5 * (least + most + count);
        Fell {
            place: self.place.clone(),
            period,
            seen: self.counts.iter().map(|n| n * count).collect(),
            believed: falls.iter().map(|fall| start + fall).collect(),
        }
    }

    /// Narrows bounds of T/J (rad/s²); the index of the sample at which nothing was left.
    fn narrow(&self, delay: f64, shape: Shape, (low, high): &mut (f64, f64)) -> Result<(), usize> {
        let (period, count) = self.units;
        let falls: Vec<f64> =
            (0..self.counts.len()).map(|i| shape.fall((i as f64 * period - delay).max(0.0))).collect();
        let slack = shape.slack;
        for j in 1..falls.len() {
            // The first edge says most together with the last: pairs within a count say nothing.
            for i in 0..j {
                let (way, fall) = (self.counts[j] - self.counts[i], falls[j] - falls[i]);
                let room = 1.0 + slack;
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

/// The set of T/J and delay that explains every count of all releases, with C/J between two values, 1/s. If there is none
/// with one delay, each release has its own, as with a lag of the actuator; if there is none with sharp edges, they may be
/// off by more. A T/J of its own for each release is a torque that varies, and no T/J at all. `breaks_away`: mean voltage at which
/// the shaft breaks away, V, if it is known.
///
/// # Errors
/// The tick that nothing explains, of the values that explain most, and whether the releases differ.
pub fn fall(
    releases: &[Release],
    dampings: (f64, f64),
    breaks_away: Option<f64>,
) -> Result<Fall, Unexplained> {
    let period = releases.first().map_or(1e-3, |r| r.units.0);
    let [sharp, looser] = [SLACK, LOOSER].map(|slack| slack * coarser(releases));
    let mut at = match with_one_delay(releases, dampings) {
        Ok(fall) => {
            let line = LagLine::through(&late(releases, &fall.pull, dampings, (sharp, 0.0)), 0.0, period);
            return Ok(lagging(releases, fall, line.as_ref(), breaks_away));
        }
        Err(at) => at,
    };
    for (slack, own) in [(sharp, false), (looser, true)] {
        at.apart = match with_a_lag(releases, dampings, slack) {
            Some((fall, line)) if !line.strays(0.5 * MOST_APART * period) => {
                return Ok(lagging(releases, fall, Some(&line), breaks_away));
            }
            Some((fall, _)) => Some(Apart::Delays(fall.delay.low, fall.delay.high)),
            None => match with_own_delays(releases, dampings, (slack, 0.0)) {
                Some(fall) if fall.delay.high - fall.delay.low <= MOST_APART * period => {
                    let late = late(releases, &fall.pull, dampings, (slack, 0.0));
                    let line = LagLine::through(&late, 0.0, period);
                    let most = releases.iter().map(|release| release.before).fold(0.0, f64::max);
                    let delay =
                        breaks_away.map_or(fall.delay, |volts| lag::unseparated(fall.delay, most / volts));
                    return Ok(Fall { delay, lag: line.map(|line| line.lag), ..fall });
                }
                Some(late) => Some(Apart::Delays(late.delay.low, late.delay.high)),
                None => with_own_pulls(releases, dampings, slack, own),
            },
        };
        if at.apart.is_some() {
            return Err(at);
        }
    }
    // One that is no fall by itself may have lost a count.
    let (alone, rest): (Vec<Release>, Vec<Release>) = releases
        .iter()
        .cloned()
        .partition(|r| with_own_delays(std::slice::from_ref(r), dampings, (looser, 0.0)).is_none());
    at.apart = match alone.len() {
        0 => None,
        1 => with_own_delays(&rest, dampings, (looser, 0.0))
            .is_none()
            .then(|| with_own_pulls(&rest, dampings, looser, true))
            .flatten(),
        number => Some(Apart::Within(number)),
    };
    Err(at)
}

/// T/J of releases, each of which has its own, and its own delay or the one that leaves them closest: the least that one of them
/// needs, and the most that another one allows.
fn with_own_pulls(releases: &[Release], dampings: (f64, f64), slack: f64, own_delays: bool) -> Option<Apart> {
    let bounds = |release: &Release, delay: f64, damping: f64| {
        let mut own = (0.0, f64::INFINITY);
        release.narrow(delay, Shape { damping, lag: 0.0, slack }, &mut own).ok().map(|()| own)
    };
    let apart = |of: &dyn Fn(&Release) -> Option<(f64, f64)>| {
        releases.iter().try_fold((0.0_f64, f64::INFINITY), |ends, release| {
            of(release).map(|own| (ends.0.max(own.0), ends.1.min(own.1)))
        })
    };
    let all = (0..DAMPINGS).map(|k| between(dampings, k));
    let found: Vec<(f64, f64)> = if own_delays {
        let union = |release: &Release, damping: f64| {
            let each = delays(release.units.0).filter_map(|delay| bounds(release, delay, damping));
            each.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
        };
        all.filter_map(|damping| apart(&|release| union(release, damping))).collect()
    } else {
        let period = releases.first().map_or(1e-3, |r| r.units.0);
        let grid = all.flat_map(|damping| delays(period).map(move |delay| (delay, damping)));
        grid.filter_map(|(delay, damping)| apart(&|release| bounds(release, delay, damping))).collect()
    };
    let closest = found.into_iter().min_by(|a, b| (a.0 / a.1).total_cmp(&(b.0 / b.1)))?;
    Some(Apart::Pulls(closest.1, closest.0))
}

/// A value between two, of so many.
fn between((least, most): (f64, f64), k: usize) -> f64 {
    least + (most - least) * k as f64 / (DAMPINGS - 1) as f64
}

/// Delays that are tried, s.
fn delays(period: f64) -> impl Iterator<Item = f64> + Clone {
    let step = DELAY_STEP * period;
    (0..=(LONGEST_DELAY / DELAY_STEP) as usize).map(move |k| k as f64 * step)
}

/// The same with the lag that delays show, and the delay of a voltage that changes slowly.
fn lagging(releases: &[Release], fall: Fall, line: Option<&LagLine>, breaks_away: Option<f64>) -> Fall {
    let delay = line.zip(breaks_away).map(|(line, volts)| {
        if line.lag.low <= 0.0 {
            return line.without(fall.delay, volts);
        }
        // With another T/J all are earlier, or later, together: by half as much of a fall, and mostly by half of that.
        let seconds = |r: &Release| r.counts.len() as f64 * r.units.0 / releases.len() as f64;
        let length: f64 = releases.iter().map(seconds).sum();
        line.delay(volts, 0.25 * length * fall.pull.share())
    });
    Fall { delay: delay.unwrap_or(fall.delay), lag: line.map(|line| line.lag), ..fall }
}

/// Lags that are tried at first, and times that a lag is found from the delays of falls with the one before, periods.
const LAGS: [f64; 4] = [0.0, 1.0, 2.0, 3.0];
const PASSES: usize = 4;

/// What explains all releases with one T/J and the delays that a lag gives them; none where their voltages do not tell of a lag,
/// or nothing explains them.
fn with_a_lag(releases: &[Release], dampings: (f64, f64), slack: f64) -> Option<(Fall, LagLine)> {
    let period = releases.first()?.units.0;
    let of = |lag: f64| {
        let fall = with_own_delays(releases, dampings, (slack, lag))?;
        let line = LagLine::through(&late(releases, &fall.pull, dampings, (slack, lag)), lag, period)?;
        (line.lag.low > 0.0).then_some((fall, line))
    };
    LAGS.iter().find_map(|first| {
        let found = of(first * period)?;
        (1..PASSES).try_fold(found, |(_, line), _| of(line.lag.value))
    })
}

/// Of each release the voltage before it and its delay; `with`: the slack and the lag.
fn late(releases: &[Release], pull: &Estimate, dampings: (f64, f64), with: (f64, f64)) -> Vec<Late> {
    let of = |release: &Release| {
        let delay = release.delay(pull, dampings, with)?;
        (release.falls() && release.before > 0.0).then(|| (libm::log(release.before), delay))
    };
    releases.iter().filter_map(of).collect()
}

fn with_own_delays(releases: &[Release], dampings: (f64, f64), (slack, lag): (f64, f64)) -> Option<Fall> {
    let (mut low, mut high, mut soonest, mut latest) = (f64::INFINITY, 0.0_f64, f64::INFINITY, 0.0_f64);
    for k in 0..DAMPINGS {
        let damping = between(dampings, k);
        let mut common = (0.0_f64, f64::INFINITY);
        let mut ends = (f64::INFINITY, 0.0_f64);
        for release in releases {
            let mut own = (f64::INFINITY, 0.0_f64);
            for delay in delays(release.units.0) {
                let mut bounds = (0.0, f64::INFINITY);
                if release.narrow(delay, Shape { damping, lag, slack }, &mut bounds).is_ok() {
                    own = (own.0.min(bounds.0), own.1.max(bounds.1));
                    if release.falls() {
                        ends = (ends.0.min(delay), ends.1.max(delay));
                    }
                }
            }
            common = (common.0.max(own.0), common.1.min(own.1));
        }
        if common.0 < common.1 {
            (low, high) = (low.min(common.0), high.max(common.1));
            (soonest, latest) = (soonest.min(ends.0), latest.max(ends.1));
        }
    }
    let middle = |low: f64, high: f64| Estimate { value: 0.5 * (low + high), low, high };
    (low < high && high.is_finite()).then(|| Fall {
        pull: middle(low, high),
        delay: middle(soonest, latest),
        lag: None,
        looser: Some(slack),
    })
}

fn with_one_delay(releases: &[Release], dampings: (f64, f64)) -> Result<Fall, Unexplained> {
    let mut set: Option<[f64; 4]> = None;
    // Weight, and sums of T/J and delay over the set.
    let mut sums = [0.0; 3];
    let mut longest = (0, 0, 0);
    let period = releases.first().map_or(1e-3, |r| r.units.0);
    let slack = SLACK * coarser(releases);
    for delay in delays(period) {
        for k in 0..DAMPINGS {
            let damping = between(dampings, k);
            let mut bounds = (0.0, f64::INFINITY);
            let mut explained = 0;
            let failed = releases.iter().enumerate().find_map(|(n, release)| {
                let failed = release.narrow(delay, Shape { damping, lag: 0.0, slack }, &mut bounds).err();
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
        return Err(Unexplained { name, tick: tick + at as u64, apart: None });
    };
    let half = 0.5 * DELAY_STEP * period;
    Ok(Fall {
        pull: Estimate { value: sums[1] / sums[0], low, high },
        delay: Estimate { value: sums[2] / sums[0], low: (soonest - half).max(0.0), high: latest + half },
        lag: None,
        looser: None,
    })
}
