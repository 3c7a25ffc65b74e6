//! Findings of recordings on a shaft, and what they cannot show.

use crate::break_away::{self, BreakAway, Known, break_aways, mean_volts};
use crate::confidence::{DEVIATIONS, FALL};
use crate::recording::{Recording, at_pad};
use crate::release::{self, Fall, Release, Unexplained};
use crate::ride::{Place, Ride, Told, rides, uneven, waves};
use crate::seen::{Rode, Seen};
use crate::{DAMPINGS, Estimate, unlike};
use serde::Serialize;

/// Rates that determine C/J lie this far apart, rad/s.
const RATES_APART: f64 = 0.5;
/// Fewest break-aways that determine μ_s/μ_d.
const FEWEST_SLIPS: usize = 3;
/// Share by which μ_s/μ_d may be off on an even disc, where steps of the converter say as much as friction.
const EVEN: f64 = 0.02;
/// Most releases and break-aways that are looked at: a minute of an experiment has fewer. Of more, those of several experiments, some
/// from each.
const MOST: usize = 60;
/// Share of its rate below which a shaft nearly stops.
const STOPS: f64 = 0.2;
/// Share by which the size of a ripple is off that a ride shows on which the shaft nearly stops.
const ROUGHLY: f64 = 0.1;
/// Ripple that an even disc seems to have: steps of the converter, and a filter that looks for one.
const NOISE: f64 = 5e-3;
/// Ripple that is always reckoned with, as a share.
const LEAST_RIPPLE: f64 = 0.03;
/// Normalised innovation of an edge that no ride has: one in millions.
pub(crate) const UNEXPLAINED: f64 = 7.0;

/// Rides and releases that do not go together.
const CONTRADICTED: &str = "C/J of the rides is none that the releases allow: friction differs between the places of the rides, or the \
     torque between their times; rides over the same whole turns, and releases behind them, show which";

/// The finding on a parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Finding {
    /// A value with its interval.
    Known(Estimate),
    /// Reason why it cannot be found, and the experiment that would find it.
    Refused(String),
}

impl Finding {
    /// The value, if there is one.
    #[must_use]
    pub fn known(&self) -> Option<Estimate> {
        match self {
            Finding::Known(estimate) => Some(*estimate),
            Finding::Refused(_) => None,
        }
    }
}

pub(crate) fn refused(why: &str) -> Finding {
    Finding::Refused(why.to_owned())
}

/// All that recordings show.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// T/J, rad/s².
    pub pull: Finding,
    /// Delay from a sample's voltage to its effect, s: dead time and lag together.
    pub delay: Finding,
    /// `v_hold = T/(μ_d K)`, V: the voltage under which a fast shaft keeps its rate.
    pub hold: Finding,
    /// Root mean square of friction's variation along the disc, as a share.
    pub ripple: Finding,
    /// Waves of that ripple per turn, where rides show them.
    pub waves: Option<f64>,
    /// μ_s/μ_d.
    pub ratio: Finding,
    /// Stribeck velocity, rad/s.
    pub stribeck: Finding,
    /// C/J, 1/s.
    pub damping: Finding,
    /// Time constant of the actuator, s.
    pub lag: Finding,
    /// Inertia, torque, gain and friction one by one.
    pub each: Finding,
    /// Friction along the disc, where the slowest ride went.
    #[serde(skip)]
    pub map: Vec<Place>,
    /// The most that friction departs from its mean there, as a share.
    #[serde(skip)]
    pub uneven: f64,
    /// Recordings and ticks that the model does not explain.
    pub unexplained: Vec<String>,
    /// Releases, break-aways, and rates of the rides (rad/s) that were found.
    pub found: (usize, usize, Vec<f64>),
    /// Releases and rides beside what is believed.
    #[serde(skip)]
    pub seen: Seen,
}

/// So many of a list at most, spread evenly over it.
fn at_most<T>(most: usize, all: Vec<T>) -> Vec<T> {
    let of = all.len();
    let taken = |i: usize| of <= most || i * most / of != (i + 1) * most / of;
    all.into_iter().enumerate().filter(|(i, _)| taken(*i)).map(|(_, one)| one).collect()
}

/// Identifies a shaft from recordings of it.
#[must_use]
pub fn identify(recordings: &[Recording]) -> Report {
    let releases: Vec<Release> = at_most(MOST, recordings.iter().flat_map(release::releases).collect());
    let breaks_away = mean_volts(&at_most(MOST, recordings.iter().flat_map(break_aways).collect()));
    let fall = (!releases.is_empty()).then(|| release::fall(&releases, DAMPINGS, breaks_away));
    let lag = fall.as_ref().and_then(|fall| fall.as_ref().ok()).map_or(0.0, Fall::lags);
    let seen = at_pad(recordings, lag);
    let slips: Vec<BreakAway<'_>> = at_most(MOST, seen.iter().flat_map(break_aways).collect());
    let rides: Vec<Ride<'_>> = seen.iter().flat_map(rides).collect();
    let counted = (releases.len(), slips.len());
    let stretches = seen.iter().flat_map(uneven).collect::<Vec<_>>();
    let closer = |within| release::fall(&releases, within, breaks_away);
    let motion = Motion::of(fall, &closer, rides, &stretches, unlike::sticks(&seen));
    let (ratio, stribeck) = motion.at_rest(&slips);
    let no_ride = motion
        .cause
        .as_deref()
        .unwrap_or("a ride at an even rate, as 5 °/s for 8 s, and releases for T/J determine it");
    let slowest = motion.told.first();
    Report {
        pull: motion.of_fall(|fall| fall.pull),
        delay: motion.of_fall(|fall| fall.delay),
        hold: motion.hold.map_or_else(|| refused(no_ride), Finding::Known),
        ripple: slowest.map_or_else(|| refused(no_ride), |slow| Finding::Known(ripple(slow))),
        waves: slowest.map(|slow| slow.waves).filter(|waves| waves.seen).map(|waves| waves.per_turn),
        ratio,
        stribeck,
        damping: motion.damping.map_or_else(
            || {
                let slow = "it takes a fast ride beside a slow one: 60 °/s beside 20 °/s determine it";
                refused(motion.cause.as_deref().unwrap_or(slow))
            },
            Finding::Known,
        ),
        lag: motion.lag(),
        each: refused(
            "counts and volts do not determine them, as all of them scaled alike move alike; a second experiment with a known mass added \
             does",
        ),
        map: slowest.map(|slow| slow.map.clone()).unwrap_or_default(),
        uneven: slowest.map_or(0.0, |slow| slow.uneven),
        seen: motion.seen(&releases),
        unexplained: motion.unexplained,
        found: (counted.0, counted.1, motion.rates),
    }
}

/// Findings of releases and rides.
struct Motion {
    /// Rates of the rides, rad/s, and what these say, the slowest first.
    rates: Vec<f64>,
    told: Vec<Told>,
    /// None without a release, or if no delay explains them.
    fall: Option<Fall>,
    damping: Option<Estimate>,
    hold: Option<Estimate>,
    /// The way in which the rig is unlike the model, so that its friction is not determined.
    cause: Option<String>,
    unexplained: Vec<String>,
}

impl Motion {
    /// `fall`: of the releases, where there are any; `closer` the same for another range of C/J.
    fn of(
        fall: Option<Result<Fall, Unexplained>>,
        closer: &dyn Fn((f64, f64)) -> Result<Fall, Unexplained>,
        rides: Vec<Ride<'_>>,
        stretches: &[Ride<'_>],
        sticks: Option<String>,
    ) -> Motion {
        let rates = |rides: &[Ride<'_>]| rides.iter().map(|ride| ride.rate).collect::<Vec<_>>();
        let mut found = rates(&rides);
        found.sort_by(f64::total_cmp);
        let unknown = |cause: Option<String>| Motion {
            rates: found.clone(),
            told: Vec::new(),
            fall: None,
            damping: None,
            hold: None,
            unexplained: cause.iter().cloned().collect(),
            cause,
        };
        let mut fall = match fall {
            None => return unknown(None),
            Some(Ok(fall)) => fall,
            Some(Err(at)) => return unknown(Some(unlike::fall_refused(&at))),
        };
        let (told, mut unexplained) = tell(rides, &fall);
        let (rides, mut told): (Vec<_>, Vec<_>) = told.into_iter().unzip();
        // With C/J, releases determine T/J more closely.
        let of_rides = |told: &[Told]| {
            let line = Line::through(told);
            let damping = line.as_ref().and_then(|line| line.damping(&fall));
            let within = damping.map(|c| (c.low.min(DAMPINGS.1), c.high.clamp(0.01, DAMPINGS.1 + 1.0)));
            (line, damping, within.map(closer))
        };
        let mut said = of_rides(&told);
        let close = said.2.as_ref().and_then(|close| close.as_ref().ok()).unwrap_or(&fall);
        let bristles = || told.first().and_then(|slow| unlike::bristles(stretches, slow, close));
        if let Some(cause) = bristles().or(sticks) {
            return Motion { fall: Some(fall), ..unknown(Some(cause)) };
        }
        unexplained.extend(told.iter().filter_map(edge_off));
        if let Some(share) = unlike::runout(&told) {
            for (ride, told) in rides.iter().zip(&mut told) {
                told.hold.1 = told.hold.1.hypot(told.hold.0 * unlike::left_of_runout(share, ride.way()));
            }
            unexplained.push(format!(
                "rides: friction differs by {:.1} % from section to section of the turn, as of a disc that is not square to its \
                 shaft: v_hold and C/J are as wide as that; rides over whole turns determine them more closely",
                100.0 * share
            ));
            said = of_rides(&told);
        }
        let (line, damping, close) = said;
        match close {
            None => {}
            Some(Ok(close)) if close.looser <= fall.looser => fall = close,
            Some(_) => {
                let cause = unknown(Some(CONTRADICTED.to_owned()));
                unexplained.extend(cause.unexplained.clone());
                return Motion { fall: Some(fall), unexplained, ..cause };
            }
        }
        if let Some(slack) = fall.looser.filter(|_| fall.lags() <= 0.0) {
            unexplained.push(format!(
                "releases: no one delay explains their counts; one for each does, edges being off by {slack:.2} counts: a lag of the \
                 actuator, or a torque that varies"
            ));
        }
        let hold = hold(&told, line.as_ref(), Some(&fall));
        let rates = rates(&rides);
        Motion { rates, told, fall: Some(fall), damping, hold, cause: None, unexplained }
    }

    /// μ_s/μ_d and the Stribeck velocity, which take all that motion shows.
    fn at_rest(&self, slips: &[BreakAway<'_>]) -> (Finding, Finding) {
        let (fall, slowest) = (self.fall.as_ref(), self.told.first());
        let known = fall.zip(self.hold).zip(slowest).map(|((fall, hold), slow)| Known {
            pull: fall.pull.value,
            delay: fall.dead_time(),
            damping: self.damping.map_or(0.0, |c| c.value),
            friction: 1.0 / hold.value,
            // No disc is so even that a model holds to the last count.
            ripple: slow.ripple.0.max(LEAST_RIPPLE) / hold.value,
            waves: slow.waves.per_turn,
        });
        if let Some(cause) = &self.cause {
            return (refused(cause), refused(cause));
        }
        let mut ratio = ratio(slips, known.as_ref());
        let even = slowest.is_some_and(|slow| slow.ripple.0 < LEAST_RIPPLE);
        if let (true, Finding::Known(e)) = (even, &mut ratio) {
            (e.low, e.high) = (e.low - EVEN * e.value, e.high + EVEN * e.value);
        }
        let stribeck = match fall.and_then(|f| f.looser) {
            _ if even => refused(
                "on a disc so even a step of the converter says as much; no experiment here determines it",
            ),
            None => stribeck(slips, known.as_ref(), &ratio),
            Some(_) => refused(
                "it shows in parts of a millisecond, and the delay differs from release to release by more: an actuator without a \
                 lag, and a steady torque, would show it",
            ),
        };
        (ratio, stribeck)
    }

    /// The lag, which releases from one voltage do not show.
    fn lag(&self) -> Finding {
        let two = "releases from one voltage hold dead time and lag together: at least three more from a voltage higher or lower by a \
                   third, which stops the shaft, separate them";
        match (&self.fall, &self.cause) {
            (Some(fall), _) => fall.lag.map_or_else(|| refused(two), Finding::Known),
            (None, Some(cause)) => refused(cause),
            (None, None) => refused(two),
        }
    }

    /// Releases and rides, beside what is believed.
    fn seen(&self, releases: &[Release]) -> Seen {
        let any = Estimate { value: 0.0, low: DAMPINGS.0, high: DAMPINGS.1 };
        let damping = self.damping.unwrap_or(any);
        let falls = self.fall.as_ref().map_or_else(Vec::new, |fall| fall.beside(releases, damping));
        let believed = |rate: f64| {
            let drag = damping.value * rate / self.fall.as_ref()?.pull.value;
            Some(self.hold?.value * (1.0 - drag))
        };
        let rode = |t: &Told| Rode { rate: t.rate, seen: t.hold, believed: believed(t.rate) };
        Seen { falls, rides: self.told.iter().map(rode).collect() }
    }

    /// A finding of the releases.
    fn of_fall(&self, value: impl Fn(&Fall) -> Estimate) -> Finding {
        match (&self.fall, &self.cause) {
            (Some(fall), _) => Finding::Known(value(fall)),
            (None, Some(cause)) => refused(cause),
            (None, None) => refused("no release: 0 V for 30 ms from rest determines it"),
        }
    }
}

/// A ride's worst edge, if no ride has such a one.
pub(crate) fn edge_off(told: &Told) -> Option<String> {
    let (name, tick, off) = &told.worst;
    (*off > UNEXPLAINED).then(|| {
        format!(
            "{name}: the edge at tick {tick} lies {off:.1} standard deviations from where the model has it"
        )
    })
}

/// Ripple of a ride, as a share.
fn ripple(slow: &Told) -> Estimate {
    let (share, deviation) = slow.ripple;
    let off = DEVIATIONS * deviation;
    Estimate { value: share, low: (share - off - NOISE).max(0.0), high: share + off }
}

/// Findings of the rides, the slowest first, and the words on those left out. A fast one does not see the ripple, and takes its
/// size from the slowest. One on which the shaft nearly stops shows friction that is not that of sliding, and of a ripple no
/// more than its size.
fn tell<'a>(mut rides: Vec<Ride<'a>>, fall: &Fall) -> (Vec<(Ride<'a>, Told)>, Vec<String>) {
    rides.sort_by(|a, b| a.rate.total_cmp(&b.rate));
    let waves = waves(&rides.iter().collect::<Vec<_>>(), fall.pull.value, fall.dead_time());
    let mut share = None;
    let (mut even, mut left_out) = (Vec::new(), Vec::new());
    for ride in rides {
        let mut told = ride.told(fall.pull.value, fall.dead_time(), waves, share);
        share = share.or(Some(told.ripple.0));
        if told.slowest < STOPS {
            left_out.push(format!(
                "{}: the shaft nearly stops on the way at {:.1} °/s, where friction is not that of sliding: left out",
                ride.recording.name,
                ride.rate.to_degrees()
            ));
            continue;
        }
        if !left_out.is_empty() {
            told.ripple.1 = told.ripple.1.hypot(ROUGHLY * told.ripple.0);
        }
        even.push((ride, told));
    }
    left_out.dedup();
    (even, left_out)
}

/// The straight line `1/h_v = A − B v` through rides, with its covariance.
struct Line {
    value: f64,
    slope: f64,
    variances: (f64, f64),
}

impl Line {
    /// None if the rates are too close for a slope.
    fn through(told: &[Told]) -> Option<Line> {
        let rates = told.iter().map(|t| t.rate);
        let apart = rates.clone().fold(0.0, f64::max) - rates.fold(f64::INFINITY, f64::min);
        if told.len() < 2 || apart < RATES_APART {
            return None;
        }
        let (mut w, mut x, mut y, mut xx, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for Told { rate, hold, .. } in told {
            let weight = 1.0 / (hold.1 * hold.1);
            w += weight;
            x += weight * rate;
            y += weight * hold.0;
            xx += weight * rate * rate;
            xy += weight * rate * hold.0;
        }
        let d = w * xx - x * x;
        let (value, slope) = ((xx * y - x * xy) / d, (w * xy - x * y) / d);
        Some(Line { value, slope: -slope, variances: (xx / d, w / d) })
    }

    /// C/J.
    fn damping(&self, fall: &Fall) -> Option<Estimate> {
        let per = fall.pull.value / self.value;
        let off = DEVIATIONS * self.variances.1.sqrt() * per;
        let value = self.slope * per;
        // Damping does not drive.
        (value + off > 0.0).then(|| Estimate {
            value: value.max(0.0),
            low: (value - off).max(0.0),
            high: value + off,
        })
    }
}

/// `v_hold`: from the line through the rides; without one from the slowest, whatever damping takes.
fn hold(told: &[Told], line: Option<&Line>, fall: Option<&Fall>) -> Option<Estimate> {
    if let Some(line) = line {
        let off = DEVIATIONS * line.variances.0.sqrt();
        return Some(Estimate { value: line.value, low: line.value - off, high: line.value + off });
    }
    let slow = told.first()?;
    let (value, deviation) = slow.hold;
    let most = value / (1.0 - DAMPINGS.1 * slow.rate / fall?.pull.low);
    let off = DEVIATIONS * deviation;
    Some(Estimate { value: 0.5 * (value + most), low: value - off, high: most + off })
}

fn ratio(slips: &[BreakAway<'_>], known: Option<&Known>) -> Finding {
    let Some(known) = known else {
        return refused("it takes T/J and v_hold, which releases and a ride determine");
    };
    if slips.len() < FEWEST_SLIPS {
        return Finding::Refused(format!(
            "{} break-aways of the {FEWEST_SLIPS} that it takes: a crawl at 0.5 °/s under a soft law, \
             or a voltage that falls by one code each 10 ms, determines it",
            slips.len()
        ));
    }
    match break_away::ratio(slips, known, FALL) {
        Some(estimate) => Finding::Known(estimate),
        None => refused("the break-aways do not bound it: more of them, from a slower ramp, determine it"),
    }
}

fn stribeck(slips: &[BreakAway<'_>], known: Option<&Known>, ratio: &Finding) -> Finding {
    let (Some(known), Finding::Known(ratio)) = (known, ratio) else {
        return refused("it takes μ_s/μ_d, and break-aways under slow ramps");
    };
    if ratio.low < 1.1 {
        return refused(
            "friction falls too little from rest to motion (μ_s/μ_d may be below 1.1) for its velocity to show",
        );
    }
    match break_away::stribeck(slips, known, ratio, FALL) {
        Some(estimate) => Finding::Known(estimate),
        None => {
            refused("the break-aways do not bound it: more of them, from a slower ramp, may determine it")
        }
    }
}
