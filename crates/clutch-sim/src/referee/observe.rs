//! Observations of a trajectory.

use super::case::{Case, Expect, Model};
use super::trajectory::Trajectory;
use crate::metrics::{Detected, Metrics, figure_columns};
use serde::Deserialize;

/// A way to observe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    /// A quantity at `at_s`; less the one at `since_s`.
    At,
    /// Its highest value between `from_s` and `to_s`.
    Highest,
    /// Its lowest.
    Lowest,
    /// Half of the difference between them.
    Amplitude,
    /// Its first local maximum after `from_s`.
    FirstPeak,
    /// Time of crossing number `number` of `level` upwards, after `from_s`.
    Crosses,
    /// Time between the last two such crossings.
    Period,
    /// Time at which a row begins to hold, for the `number`th time after `from_s`.
    Sticks,
    /// The same of slipping.
    Slips,
    /// Duration of holding number `number` that begins after `from_s`.
    StickTime,
    /// The same of slipping.
    SlipTime,
    /// Number of times that a row begins to hold, after `from_s`.
    StickCount,
    /// A quantity during holding number `number`.
    AtStick,
    /// Its distance from `level` during holding `number + 1` as a share of that during holding `number`.
    StickRatio,
    /// A figure of the run of a scenario.
    Metric,
}

impl Kind {
    /// Keys that it takes beside `kind`: a quantity, and others; those it cannot do without come first.
    fn keys(self) -> (bool, &'static [&'static str], usize) {
        match self {
            Kind::At => (true, &["at_s", "since_s"], 1),
            Kind::Highest | Kind::Lowest | Kind::Amplitude => (true, &["from_s", "to_s"], 0),
            Kind::FirstPeak => (true, &["from_s"], 0),
            Kind::Crosses => (true, &["level", "number", "from_s"], 1),
            Kind::Period => (true, &["level", "from_s"], 1),
            Kind::Sticks | Kind::Slips | Kind::StickTime | Kind::SlipTime => {
                (false, &["row", "number", "from_s"], 0)
            }
            Kind::StickCount => (false, &["row", "from_s"], 0),
            Kind::AtStick => (true, &["row", "number", "from_s"], 0),
            Kind::StickRatio => (true, &["level", "row", "number", "from_s"], 1),
            Kind::Metric => (false, &["metric"], 1),
        }
    }
}

/// An observation.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Observe {
    kind: Kind,
    position: Option<Vec<f64>>,
    velocity: Option<Vec<f64>>,
    torque: Option<Vec<f64>>,
    at_s: Option<f64>,
    since_s: Option<f64>,
    from_s: Option<f64>,
    to_s: Option<f64>,
    level: Option<f64>,
    number: Option<usize>,
    row: Option<usize>,
    metric: Option<String>,
}

/// A measured value beside the expected one.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The expectation's words.
    pub name: String,
    /// Measured; none if the trajectory does not have it.
    pub measured: Option<f64>,
    /// Expected.
    pub expected: f64,
    /// Largest distance that passes.
    pub within: f64,
    /// Unit of all three.
    pub unit: String,
}

impl Verdict {
    /// As near as it has to be.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.measured.is_some_and(|x| (x - self.expected).abs() <= self.within)
    }
}

impl Case {
    /// Holds a trajectory against what the case expects.
    #[must_use]
    pub fn judge(&self, trajectory: &Trajectory) -> Vec<Verdict> {
        self.expect
            .iter()
            .map(|Expect { observe, name, value, within, unit }| Verdict {
                name: name.clone(),
                measured: observe.measure(self, trajectory).filter(|x| x.is_finite()),
                expected: *value,
                within: *within,
                unit: unit.clone(),
            })
            .collect()
    }
}

impl Observe {
    /// Its flaw, for a model of that duration, s.
    pub(super) fn check(&self, model: &Model, duration: f64) -> Result<(), String> {
        let (quantity, keys, needed) = self.kind.keys();
        let weighs = self.position.is_some() || self.velocity.is_some() || self.torque.is_some();
        let given = [
            ("at_s", self.at_s.is_some()),
            ("since_s", self.since_s.is_some()),
            ("from_s", self.from_s.is_some()),
            ("to_s", self.to_s.is_some()),
            ("level", self.level.is_some()),
            ("number", self.number.is_some()),
            ("row", self.row.is_some()),
            ("metric", self.metric.is_some()),
        ];
        let has = |key: &str| given.iter().any(|(k, given)| *k == key && *given);
        if let Some(key) = keys[..needed].iter().find(|key| !has(key)) {
            return Err(format!("{key}: missing; this kind needs it"));
        }
        if let Some((key, _)) = given.iter().find(|(key, given)| *given && !keys.contains(key)) {
            return Err(format!("{key}: this kind takes none"));
        }
        match (quantity, weighs) {
            (true, false) => {
                return Err(
                    "position, velocity, torque: none given; expected weights of what is summed".into()
                );
            }
            (false, true) => return Err("position, velocity, torque: this kind takes none".into()),
            _ => {}
        }
        let times =
            [("at_s", self.at_s), ("since_s", self.since_s), ("from_s", self.from_s), ("to_s", self.to_s)];
        for (key, time) in times {
            if let Some(t) = time.filter(|t| !(0.0..=duration).contains(t)) {
                return Err(format!("{key} = {t}: expected a time from 0 to duration_s = {duration}"));
            }
        }
        if let Some(x) = self.level.filter(|x| !x.is_finite()) {
            return Err(format!("level = {x}: expected a finite number"));
        }
        if self.number == Some(0) {
            return Err("number = 0: expected a whole number of at least 1".into());
        }
        match model {
            Model::Scenario(_) if self.kind != Kind::Metric => {
                Err("kind: a scenario has metrics only".into())
            }
            Model::Scenario(_) => {
                let none = (Metrics::default(), Detected::default());
                let names = figure_columns(&none.0, &none.1).map(|(name, _)| name);
                let name = self.metric.as_deref().unwrap_or_default();
                let names: Vec<&str> = names.collect();
                if names.contains(&name) {
                    return Ok(());
                }
                Err(format!("metric = \"{name}\": expected one of: {}", names.join(", ")))
            }
            Model::Mechanism(_) if self.kind == Kind::Metric => Err("kind: metrics are of scenarios".into()),
            Model::Mechanism(m) => {
                let (joints, rows) = (m.joints(), m.rows.len());
                let weights = [
                    ("position", &self.position, joints),
                    ("velocity", &self.velocity, joints),
                    ("torque", &self.torque, rows),
                ];
                for (key, weights, expected) in weights {
                    let Some(weights) = weights else { continue };
                    if weights.len() != expected {
                        return Err(format!("{key}: {} weights; expected {expected}", weights.len()));
                    }
                    if let Some(x) = weights.iter().find(|x| !x.is_finite()) {
                        return Err(format!("{key}: {x}: expected finite weights"));
                    }
                }
                match self.row.filter(|row| !(1..=rows).contains(row)) {
                    Some(row) => Err(format!("row = {row}: expected the number of a row, 1 to {rows}")),
                    None => Ok(()),
                }
            }
        }
    }

    /// The sum of what it weighs; none if the trajectory does not have it.
    fn curve(&self, trajectory: &Trajectory) -> Option<Curve> {
        let count = trajectory.position.first().map_or(0, Vec::len);
        let mut values = vec![0.0; count];
        let add = |weights: &[f64], lists: &[Vec<f64>], to: &mut Vec<f64>| {
            for (weight, list) in weights.iter().zip(lists).filter(|(w, _)| **w != 0.0) {
                to.iter_mut().zip(list).for_each(|(sum, x)| *sum += weight * x);
            }
        };
        if let Some(weights) = &self.position {
            add(weights, &trajectory.position, &mut values);
        }
        if let Some(weights) = &self.velocity {
            add(weights, &trajectory.velocity, &mut values);
        }
        if let Some(weights) = &self.torque {
            add(weights, trajectory.torque.as_ref()?, &mut values);
        }
        // The slopes of a position are known.
        let slopes = match (&self.position, &self.velocity, &self.torque) {
            (Some(weights), None, None) => {
                let mut slopes = vec![0.0; count];
                add(weights, &trajectory.velocity, &mut slopes);
                slopes
            }
            _ => differences(&values, trajectory.sample),
        };
        Some(Curve { sample: trajectory.sample, values, slopes })
    }

    fn measure(&self, case: &Case, trajectory: &Trajectory) -> Option<f64> {
        if let Some(name) = &self.metric {
            return trajectory.metrics.iter().find(|(n, _)| n == name).map(|(_, x)| *x);
        }
        let curve = self.curve(trajectory)?;
        let (from, number) = (self.from_s.unwrap_or(0.0), self.number.unwrap_or(1) - 1);
        let level = self.level.unwrap_or(0.0);
        let row = self.row.unwrap_or(1) - 1;
        let phases = |holds: bool| Phases { events: trajectory.events_of(case, row), from, holds };
        match self.kind {
            Kind::At => {
                let since = self.since_s.map_or(Some(0.0), |t| curve.at(t));
                Some(curve.at(self.at_s?)? - since?)
            }
            Kind::Highest => curve.extreme(from, self.to_s, 1.0),
            Kind::Lowest => curve.extreme(from, self.to_s, -1.0),
            Kind::Amplitude => {
                Some(0.5 * (curve.extreme(from, self.to_s, 1.0)? - curve.extreme(from, self.to_s, -1.0)?))
            }
            Kind::FirstPeak => curve.first_peak(from),
            Kind::Crosses => curve.crossings(level, from).get(number).copied(),
            Kind::Period => match curve.crossings(level, from).as_slice() {
                [.., a, b] => Some(b - a),
                _ => None,
            },
            Kind::Sticks => phases(true).begin(number),
            Kind::Slips => phases(false).begin(number),
            Kind::StickTime => phases(true).duration(number),
            Kind::SlipTime => phases(false).duration(number),
            Kind::StickCount => Some(phases(true).count() as f64),
            Kind::AtStick => curve.during(phases(true).span(number)?),
            Kind::StickRatio => {
                let away = |n: usize| Some(curve.during(phases(true).span(n)?)? - level);
                Some(away(number + 1)? / away(number)?)
            }
            Kind::Metric => None,
        }
    }
}

/// Times at which a row begins to hold, or to slip.
struct Phases {
    events: Vec<(f64, bool)>,
    from: f64,
    holds: bool,
}

impl Phases {
    fn begins(&self) -> impl Iterator<Item = usize> {
        (0..self.events.len()).filter(|i| self.events[*i].1 == self.holds && self.events[*i].0 >= self.from)
    }

    fn count(&self) -> usize {
        self.begins().count()
    }

    fn begin(&self, number: usize) -> Option<f64> {
        self.begins().nth(number).map(|i| self.events[i].0)
    }

    /// Begin and end; a phase that has no end lasts.
    fn span(&self, number: usize) -> Option<(f64, f64)> {
        let begin = self.begins().nth(number)?;
        let end = self.events[begin + 1..].iter().find(|e| e.1 != self.holds);
        Some((self.events[begin].0, end.map_or(f64::INFINITY, |e| e.0)))
    }

    fn duration(&self, number: usize) -> Option<f64> {
        let (begin, end) = self.span(number)?;
        end.is_finite().then_some(end - begin)
    }
}

/// A quantity over time: samples and their slopes.
struct Curve {
    sample: f64,
    values: Vec<f64>,
    slopes: Vec<f64>,
}

/// Slopes of samples: from four neighbours or, near an end, from one.
fn differences(v: &[f64], sample: f64) -> Vec<f64> {
    let end = v.len().saturating_sub(1);
    let slope = |k: usize| match k {
        _ if k >= 2 && k + 2 <= end => (v[k - 2] - v[k + 2] + 8.0 * (v[k + 1] - v[k - 1])) / 12.0,
        _ if k < end => v[k + 1] - v[k],
        _ => v[k] - v[k.saturating_sub(1)],
    };
    (0..v.len()).map(|k| slope(k) / sample).collect()
}

impl Curve {
    /// The cubic of two samples with their slopes, `share` of the way between them.
    fn between(&self, k: usize, share: f64) -> f64 {
        let (a, b) = (self.values[k], self.values[k + 1]);
        let (da, db) = (self.slopes[k] * self.sample, self.slopes[k + 1] * self.sample);
        let (s, r) = (share, 1.0 - share);
        r * r * ((1.0 + 2.0 * s) * a + s * da) + s * s * ((1.0 + 2.0 * r) * b - r * db)
    }

    fn at(&self, t: f64) -> Option<f64> {
        let place = t / self.sample;
        let k = libm::round(place);
        if (place - k).abs() < 1e-6 {
            return self.values.get(k as usize).copied();
        }
        let k = libm::floor(place) as usize;
        (k + 1 < self.values.len()).then(|| self.between(k, place - k as f64))
    }

    /// The first sample of a time in which something holds; none if that is over before.
    fn during(&self, (begin, end): (f64, f64)) -> Option<f64> {
        let k = libm::ceil(begin / self.sample);
        (k * self.sample <= end).then(|| self.values.get(k as usize).copied())?
    }

    /// The largest, or with −1 the least: the top of the parabola through three samples.
    fn extreme(&self, from: f64, to: Option<f64>, sign: f64) -> Option<f64> {
        let first = libm::ceil(from / self.sample - 1e-6) as usize;
        let last = to.map_or(self.values.len(), |t| libm::floor(t / self.sample + 1e-6) as usize + 1);
        let range = first..last.min(self.values.len());
        let k = range.clone().max_by(|a, b| (sign * self.values[*a]).total_cmp(&(sign * self.values[*b])))?;
        // At the edge of the window there is no top: the curve goes on.
        let inside = k > range.start && k + 1 < range.end;
        Some(if inside { self.top(k) } else { self.values[k] })
    }

    fn first_peak(&self, from: f64) -> Option<f64> {
        let first = libm::ceil(from / self.sample) as usize;
        let v = &self.values;
        let k =
            (first.max(1)..v.len().saturating_sub(1)).find(|k| v[*k] > v[*k + 1] && v[*k] >= v[*k - 1])?;
        Some(self.top(k))
    }

    fn top(&self, k: usize) -> f64 {
        let v = &self.values;
        if k == 0 || k + 1 >= v.len() {
            return v[k];
        }
        let (slope, bend) = (0.5 * (v[k + 1] - v[k - 1]), v[k + 1] - 2.0 * v[k] + v[k - 1]);
        if bend == 0.0 { v[k] } else { v[k] - 0.5 * slope * slope / bend }
    }

    /// Times at which it crosses a level upwards, s.
    fn crossings(&self, level: f64, from: f64) -> Vec<f64> {
        let first = libm::ceil(from / self.sample) as usize;
        (first..self.values.len().saturating_sub(1))
            .filter(|k| self.values[*k] < level && self.values[*k + 1] >= level)
            .map(|k| {
                let (mut low, mut high) = (0.0, 1.0);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if self.between(k, middle) < level { low = middle } else { high = middle }
                }
                (k as f64 + high) * self.sample
            })
            .collect()
    }
}
