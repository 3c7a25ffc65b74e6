//! The observations that a case makes of a trajectory.

use super::model::CaseModel;
use crate::metrics::{Detected, Metrics, figure_columns};
use serde::Deserialize;

/// A way to observe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Kind {
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
    pub(super) kind: Kind,
    pub(super) position: Option<Vec<f64>>,
    pub(super) velocity: Option<Vec<f64>>,
    pub(super) torque: Option<Vec<f64>>,
    pub(super) at_s: Option<f64>,
    pub(super) since_s: Option<f64>,
    pub(super) from_s: Option<f64>,
    pub(super) to_s: Option<f64>,
    pub(super) level: Option<f64>,
    pub(super) number: Option<usize>,
    pub(super) row: Option<usize>,
    pub(super) metric: Option<String>,
}

impl Observe {
    /// Its flaw, for a model of that duration, s.
    pub(super) fn check(&self, model: &CaseModel, duration: f64) -> Result<(), String> {
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
            CaseModel::Scenario(_) if self.kind != Kind::Metric => {
                Err("kind: a scenario has metrics only".into())
            }
            CaseModel::Scenario(_) => {
                let none = (Metrics::default(), Detected::default());
                let names = figure_columns(&none.0, &none.1).map(|(name, _)| name);
                let name = self.metric.as_deref().unwrap_or_default();
                let names: Vec<&str> = names.collect();
                if names.contains(&name) {
                    return Ok(());
                }
                Err(format!("metric = \"{name}\": expected one of: {}", names.join(", ")))
            }
            CaseModel::Mechanism(_) if self.kind == Kind::Metric => {
                Err("kind: metrics are of scenarios".into())
            }
            CaseModel::Mechanism(m) => {
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
}
