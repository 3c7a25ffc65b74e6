//! Findings of recordings on a motor axis, and what they cannot show.

use super::hops::{self, Hop};
use super::passes::{self, Curve, Pass};
use super::slips::{self, Slip};
use crate::Estimate;
use crate::confidence::{DEVIATIONS, FALL};
use crate::profile::{Profile, spaced};
use crate::recording::Recording;
use crate::report::{Finding, refused};
use crate::ride::Place;
use crate::seen::{Rode, Seen};
use serde::Serialize;

/// Fewest break-aways one way, and the share by which the mean of their voltages is off for other reasons: the converter's
/// steps, the time from break-away to the first edge.
const FEWEST_SLIPS: usize = 3;
const CLOCKWORK: f64 = 7e-3;
/// Share by which the time from break-away to the first edge may be another one than reckoned.
const LATER: f64 = 1.0;
/// The same of damping, which a disc without a ripple shows 1 to 3 % too high.
const DRAG: f64 = 1.2e-2;
/// Share of the rest of a ripple in the mean of a stretch by which both ways differ.
const UNLIKE: f64 = 0.5;
/// Stribeck velocities that are looked at, rad/s, and their number.
const VELOCITIES: (f64, f64, usize) = (1e-4, 0.1, 90);
/// Fall of friction from rest to motion, as a share, below which its velocity does not show.
const LEAST_FALL: f64 = 0.05;

/// All that recordings of a motor axis show, in volts: torques over K.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Voltage that breaks the shaft away, forwards and backwards, V.
    pub at_rest: [Finding; 2],
    /// Voltage that keeps a fast shaft at its rate, without viscous drag, forwards and backwards, V.
    pub sliding: [Finding; 2],
    /// Torque that drives forwards by itself, over K, V: half of what backwards takes more.
    pub load: Finding,
    /// C/K, V s/rad.
    pub viscous: Finding,
    /// Stribeck velocity, rad/s.
    pub stribeck: Finding,
    /// J/K, V s²/rad.
    pub inertia: Finding,
    /// Delay from a sample's voltage to its effect, s: dead time and lag together.
    pub delay: Finding,
    /// Root mean square of friction's variation along the way, as a share.
    pub ripple: Finding,
    /// Waves of that ripple per turn, where passes show them.
    pub waves: Option<f64>,
    /// Time constant of the actuator, s.
    pub lag: Finding,
    /// K, J, friction and load one by one.
    pub each: Finding,
    /// Friction along the way over its mean, both ways taken together.
    #[serde(skip)]
    pub map: Vec<Place>,
    /// The most that friction departs from its mean there, as a share.
    #[serde(skip)]
    pub uneven: f64,
    /// Recordings and ticks that the model does not explain.
    pub unexplained: Vec<String>,
    /// Hops, break-aways, and rates of the passes (rad/s, backwards below 0) that were found.
    pub found: (usize, usize, Vec<f64>),
    /// Passes beside what is believed, without Stribeck's fall.
    #[serde(skip)]
    pub seen: Seen,
}

/// Identifies a motor axis from recordings of it.
#[must_use]
pub fn identify(recordings: &[Recording]) -> Report {
    let all: Vec<Hop> = recordings.iter().flat_map(hops::hops).collect();
    let views = views(recordings);
    let slips = views.each_ref().map(|view| {
        view.iter().enumerate().flat_map(|(i, r)| slips::slips(r).into_iter().map(move |s| (i, s))).collect()
    });
    let mut told = Motion { views, slips, passes: Vec::new(), pull: None, delay: None };
    let mut known = hops::guessed(recordings);
    // Friction determines K/J more closely, and that friction.
    for _ in 0..2 {
        let Some((pull, delay)) = hops::estimate(&all, &known) else { break };
        told.passes = passes::passes(&told.views, pull.value, delay.value);
        (told.pull, told.delay) = (Some(pull), Some(delay));
        let Some(better) = told.known() else { break };
        known = better;
    }
    told.report(all.len())
}

/// The recordings as they are, and turned round.
pub(super) fn views(recordings: &[Recording]) -> [Vec<Recording>; 2] {
    [recordings.to_vec(), recordings.iter().map(Recording::turned).collect()]
}

/// Findings of hops and passes.
struct Motion {
    /// The recordings as they are, and turned round.
    views: [Vec<Recording>; 2],
    /// Break-aways each way, with the index of their recording.
    slips: [Vec<(usize, Slip)>; 2],
    passes: Vec<Pass>,
    pull: Option<Estimate>,
    delay: Option<Estimate>,
}

impl Motion {
    /// The curve of friction without Stribeck's fall, as hops have it.
    fn known(&self) -> Option<hops::Known> {
        let curve = Curve::through(&self.passes, [None; 2], 0.0)?;
        let friction = [0, 1].map(|way| (curve.value[way], curve.deviation(way)));
        let share = self.ripple()?.0;
        let mean = 0.5 * (friction[0].0 + friction[1].0);
        let waves = passes::reference(&self.passes, 0)?.told.waves.per_turn;
        Some(hops::Known { friction, ripple: share * mean, waves, viscous: curve.value[4].max(0.0) })
    }

    /// Size of the ripple and its deviation: the mean of both ways.
    fn ripple(&self) -> Option<(f64, f64)> {
        let of: Vec<(f64, f64)> = [0, 1]
            .into_iter()
            .filter_map(|way| passes::reference(&self.passes, way).map(|p| p.told.ripple))
            .collect();
        let n = of.len() as f64;
        let sum = of.iter().fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        (n > 0.0).then(|| (sum.0 / n, sum.1 / n))
    }

    /// Friction at rest one way, V, and its deviation, from break-aways where a map gives the friction there over its mean.
    fn at_rest(&self, way: usize, sliding: [f64; 2]) -> Option<(f64, f64)> {
        let (pull, delay) = (self.pull?.value, self.delay?.value);
        let map = passes::finest(&self.passes, way);
        let load = 0.5 * (sliding[1] - sliding[0]) * [1.0, -1.0][way];
        let mean = 0.5 * (sliding[0] + sliding[1]);
        let volts: Vec<(f64, f64)> = self.slips[way]
            .iter()
            .filter_map(|&(i, slip)| {
                let r = &self.views[way][i];
                let needed = slip.factor(r, &map)? * sliding[way];
                // Friction alone changes along the way; a load does not.
                let factor = (needed + load) / mean;
                let (volts, below) = slip.volts(r, pull, delay, needed);
                Some(((volts + load) / factor - load, below / factor))
            })
            .collect();
        let (volts, deviation) = at_no_ramp(&volts)?;
        Some((volts, deviation.hypot(CLOCKWORK * volts)))
    }

    /// Even passes beside the curve, the slowest first.
    fn seen(&self, fitted: &Fitted) -> Seen {
        let of = |pass: &Pass| {
            let map = &passes::reference(&self.passes, pass.way)?.told.map;
            Some(Rode {
                rate: pass.told.rate * [1.0, -1.0][pass.way],
                seen: pass.friction(map),
                believed: Some(pass.row(fitted.velocity).dot(&fitted.best.value)),
            })
        };
        let mut rides: Vec<Rode> = self.passes.iter().filter(|pass| pass.is_even()).filter_map(of).collect();
        rides.sort_by(|a, b| a.rate.abs().total_cmp(&b.rate.abs()).then(b.rate.total_cmp(&a.rate)));
        Seen { falls: Vec::new(), rides }
    }

    fn report(self, hops: usize) -> Report {
        let even = "even rates both ways, as 5 and 60 °/s to and fro over 20°, and hops for J/K determine it";
        let first = Curve::through(&self.passes, [None; 2], 0.0);
        let rest = first
            .as_ref()
            .map_or([None; 2], |curve| [0, 1].map(|way| self.at_rest(way, [curve.value[0], curve.value[1]])));
        let fitted = Fitted::of(&self.passes, rest);
        let place = passes::reference(&self.passes, 0).map_or(0.0, Pass::left_over);
        let of = |k: usize, common: f64| {
            fitted.as_ref().and_then(|f| f.estimate(k, common)).map_or_else(|| refused(even), Finding::Known)
        };
        let at_rest = |way: usize| match (&fitted, rest[way]) {
            (Some(_), Some(_)) => of(2 + way, place),
            _ => Finding::Refused(format!(
                "{} break-aways {} where rides show friction, of the {FEWEST_SLIPS} that it takes: a crawl at 0.5 °/s \
                 to and fro under a soft law determines it",
                self.slips[way].len(),
                ["forwards", "backwards"][way]
            )),
        };
        let hop = if hops == 0 {
            "no hop: from rest a sudden voltage for some 30 ms determines it"
        } else {
            "the hops do not bound it: rides at even rates both ways, which show friction, beside more of them do"
        };
        // Hops are judged with the friction that rides show.
        let sliding = [of(0, place), of(1, place)];
        let shown = sliding.iter().all(|friction| friction.known().is_some());
        let or_hop = |e: Option<Estimate>| e.filter(|_| shown).map_or_else(|| refused(hop), Finding::Known);
        let inverse = |e: Estimate| Estimate { value: 1.0 / e.value, low: 1.0 / e.high, high: 1.0 / e.low };
        let mut rates: Vec<f64> = self.passes.iter().map(|p| p.told.rate * [1.0, -1.0][p.way]).collect();
        rates.sort_by(|a, b| a.abs().total_cmp(&b.abs()).then(b.total_cmp(a)));
        Report {
            at_rest: [at_rest(0), at_rest(1)],
            sliding,
            load: fitted.as_ref().map_or_else(|| refused(even), |f| Finding::Known(f.load(place))),
            viscous: fitted.as_ref().map_or_else(
                || refused("rates too close together: 60 °/s beside 5 °/s determine it"),
                Fitted::viscous,
            ),
            stribeck: fitted.as_ref().map_or_else(|| refused(even), |f| f.stribeck.clone()),
            inertia: or_hop(self.pull.map(inverse)),
            delay: or_hop(self.delay),
            ripple: self.ripple().map_or_else(
                || refused(even),
                |(share, deviation)| {
                    let off = DEVIATIONS * deviation;
                    Finding::Known(Estimate { value: share, low: (share - off).max(0.0), high: share + off })
                },
            ),
            waves: passes::reference(&self.passes, 0)
                .map(|pass| pass.told.waves)
                .filter(|waves| waves.seen)
                .map(|waves| waves.per_turn),
            lag: refused(
                "the delay holds dead time and lag together, which no experiment of this verb separates; the voltage measured at the motor does. \
                 A lag of 1 ms makes J/K 1 % too high, one of 3 ms 8 % and C/K too high as well, beyond their intervals",
            ),
            each: refused(
                "counts and volts do not determine them, as all of them scaled alike move alike; a known torque at the shaft – a mass on a \
                 lever – or a known inertia added does",
            ),
            map: passes::map(&self.passes),
            uneven: self.passes.iter().map(|p| p.told.uneven).fold(0.0, f64::max),
            // Below that Stribeck's fall is a part of friction along the way, which no filter knows of.
            unexplained: self
                .passes
                .iter()
                .filter(|p| p.told.rate >= passes::FINEST)
                .filter_map(|p| crate::report::edge_off(&p.told))
                .collect(),
            seen: fitted.as_ref().map(|fitted| self.seen(fitted)).unwrap_or_default(),
            found: (hops, self.slips.iter().map(Vec::len).sum(), rates),
        }
    }
}

/// Friction at rest and its deviation, from the voltages of break-aways and those by which each is taken to lie below its first
/// edge. A shaft whose friction falls slowly, or that slips within a count before, is later than reckoned, all alike as a share:
/// slow ramps and fast ones together show by how much.
fn at_no_ramp(slips: &[(f64, f64)]) -> Option<(f64, f64)> {
    let n = slips.len() as f64;
    if slips.len() < FEWEST_SLIPS {
        return None;
    }
    let mean = slips.iter().map(|slip| slip.0).sum::<f64>() / n;
    let mut square = slips.iter().map(|slip| (slip.0 - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let mut found = (mean, 0.0);
    for _ in 0..2 {
        let weight = 1.0 / square.max(f64::MIN_POSITIVE);
        let sum = |of: &dyn Fn(&(f64, f64)) -> f64| weight * slips.iter().map(of).sum::<f64>();
        let (x, xx) = (sum(&|slip| slip.1), sum(&|slip| slip.1 * slip.1) + 1.0 / (LATER * LATER));
        let (y, xy) = (sum(&|slip| slip.0), sum(&|slip| slip.0 * slip.1));
        let d = weight * n * xx - x * x;
        let (volts, later) = ((xx * y - x * xy) / d, (weight * n * xy - x * y) / d);
        found = (volts, (xx / d).sqrt());
        let off = |slip: &(f64, f64)| (slip.0 - volts - later * slip.1).powi(2);
        square = slips.iter().map(off).sum::<f64>() / (n - 2.0).max(1.0);
    }
    Some(found)
}

/// The curve of friction with the Stribeck velocities that go with it.
struct Fitted {
    /// The most likely Stribeck velocity, rad/s, the curve with it, and all that are likely.
    velocity: f64,
    best: Curve,
    likely: Vec<Curve>,
    stribeck: Finding,
}

impl Fitted {
    fn of(passes: &[Pass], rest: [Option<(f64, f64)>; 2]) -> Option<Fitted> {
        let curves: Vec<(f64, Curve)> = spaced(VELOCITIES.0, VELOCITIES.1, VELOCITIES.2)
            .filter_map(|v| Some((v, Curve::through(passes, rest, v)?)))
            .collect();
        let least = curves.iter().map(|(_, c)| c.misfit / c.freedom).fold(f64::INFINITY, f64::min);
        let log = |c: &Curve| -0.5 * c.misfit / least.max(1.0);
        let profile = Profile { points: curves.iter().map(|(v, c)| (libm::log(*v), log(c))).collect() };
        let (_, top) = profile.best();
        let likely: Vec<Curve> =
            curves.iter().filter(|(_, c)| log(c) >= top - FALL).map(|(_, c)| c.clone()).collect();
        let (velocity, best) = curves.into_iter().min_by(|a, b| a.1.misfit.total_cmp(&b.1.misfit))?;
        let (value, low, high) = profile.estimate(FALL);
        let falls =
            |way: usize| rest[way].is_some() && best.value[2 + way] > (1.0 + LEAST_FALL) * best.value[way];
        let stribeck = match high {
            Some(high) if falls(0) || falls(1) => Finding::Known(Estimate {
                value: libm::exp(value),
                low: low.map_or(0.0, libm::exp),
                high: libm::exp(high),
            }),
            _ => refused(
                "friction at the slowest even rate is that of the fast ones, or break-aways are missing: even rides at 1 °/s and \
                 below determine it",
            ),
        };
        Some(Fitted { velocity, best, likely, stribeck })
    }

    /// A number of the curve, `common` the share by which all frictions are off together.
    fn estimate(&self, k: usize, common: f64) -> Option<Estimate> {
        let value = self.best.value[k];
        let ends = |c: &Curve| {
            let off = DEVIATIONS * c.deviation(k).hypot(common * value);
            (c.value[k] - off, c.value[k] + off)
        };
        let (low, high) =
            self.likely.iter().map(ends).fold((value, value), |a, b| (a.0.min(b.0), a.1.max(b.1)));
        (value.is_finite() && low > 0.0).then_some(Estimate { value, low, high })
    }

    fn load(&self, common: f64) -> Estimate {
        let of = |c: &Curve| 0.5 * (c.value[1] - c.value[0]);
        let value = of(&self.best);
        let spread = &self.best.spread;
        let variance = 0.25 * (spread[(0, 0)] + spread[(1, 1)] - 2.0 * spread[(0, 1)]);
        // Stretches of both ways are not quite the same.
        let mean = 0.5 * (self.best.value[0] + self.best.value[1]);
        let off = DEVIATIONS * variance.sqrt().hypot(UNLIKE * common * mean);
        let (low, high) = self.likely.iter().map(of).fold((value, value), |a, x| (a.0.min(x), a.1.max(x)));
        Estimate { value, low: low - off, high: high + off }
    }

    fn viscous(&self) -> Finding {
        let value = self.best.value[4];
        let off = DEVIATIONS * self.best.deviation(4).hypot(DRAG * value);
        let (low, high) =
            self.likely.iter().map(|c| c.value[4]).fold((value, value), |a, x| (a.0.min(x), a.1.max(x)));
        let (low, high) = (low - off, high + off);
        if high <= 0.0 {
            return refused("friction falls with the rate as no drag does: look at the rides at high rates");
        }
        Finding::Known(Estimate { value: value.max(0.0), low: low.max(0.0), high })
    }
}
