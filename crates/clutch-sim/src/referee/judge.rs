//! Observations measured on a trajectory, beside what the case expects.

use super::case::{Case, Expect};
use super::observe::{Kind, Observe};
use super::trajectory::Trajectory;

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
