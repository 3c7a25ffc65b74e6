//! A case as its file has it, checked.

use super::mechanism::{Mechanism, Row};
use super::model::{CaseModel, ScenarioCase};
use super::observe::Observe;
use super::signal::Signal;
use crate::tables::{complete, read};
use crate::unposed::unposed;
use clutch_core::Friction;
use clutch_core::friction::{FrictionModel, FrictionParams};
use clutch_core::params::{Choice, Params};
use serde::Deserialize;
use serde_json::json;
use std::fmt;

/// A mistake in a case file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CaseError {
    /// The case, or the file.
    pub origin: String,
    /// Key, value, what is expected.
    pub message: String,
}

impl CaseError {
    pub(super) fn new(origin: &str, message: String) -> Self {
        CaseError { origin: origin.into(), message }
    }
}

impl fmt::Display for CaseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.origin, self.message)
    }
}

impl std::error::Error for CaseError {}

/// A case: a model, what is observed of it, what is expected.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its name, as `A5`.
    pub id: String,
    /// One line that says what it shows.
    pub title: String,
    /// The source of the expected values.
    pub source: String,
    /// The moving part.
    pub model: CaseModel,
    /// Duration, s.
    pub duration: f64,
    /// Time between two samples of a trajectory, s.
    pub sample: f64,
    /// Slip rate below which a row counts as holding for engines without events, rad/s or m/s.
    pub still: Option<f64>,
    /// The expectations.
    pub expect: Vec<Expect>,
}

/// One expectation.
#[derive(Clone, Debug, PartialEq)]
pub struct Expect {
    /// The observation.
    pub observe: Observe,
    /// Its words in a table.
    pub name: String,
    /// Expected value.
    pub value: f64,
    /// Largest distance of a measured one from it.
    pub within: f64,
    /// Unit of both.
    pub unit: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    id: String,
    title: String,
    source: String,
    #[serde(default)]
    duration_s: Option<f64>,
    #[serde(default)]
    sample_s: Option<f64>,
    #[serde(default)]
    still: Option<f64>,
    #[serde(default)]
    mechanism: Option<MechanismFile>,
    #[serde(default)]
    scenario: Option<ScenarioCase>,
    expect: Vec<ExpectFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MechanismFile {
    inertia: Vec<Vec<f64>>,
    #[serde(default)]
    stiffness: Option<Vec<Vec<f64>>>,
    #[serde(default)]
    damping: Option<Vec<Vec<f64>>>,
    #[serde(default)]
    position: Option<Vec<f64>>,
    #[serde(default)]
    velocity: Option<Vec<f64>>,
    #[serde(default)]
    load: Option<Vec<Signal>>,
    row: Vec<RowFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RowFile {
    joints: Vec<f64>,
    #[serde(default)]
    base_velocity: f64,
    normal: Signal,
    friction: toml::Table,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ExpectFile {
    name: String,
    value: f64,
    within: f64,
    #[serde(default)]
    unit: String,
    observe: Observe,
}

/// Joints and rows at most.
const MOST: usize = 4;
/// Waves of a load or a normal force at most.
const MOST_WAVES: f64 = 1e6;
/// Samples of a trajectory at most.
const MOST_SAMPLES: f64 = 5e6;

impl Case {
    /// The built-in case of that name.
    #[must_use]
    pub fn built_in(id: &str) -> Option<Result<Case, CaseError>> {
        super::BUILT_IN.iter().find(|(name, _)| *name == id).map(|(name, text)| Case::parse(name, text))
    }

    /// Reads a case file; `origin` is what errors begin with.
    ///
    /// # Errors
    /// The key, its value, what is expected.
    pub fn parse(origin: &str, text: &str) -> Result<Case, CaseError> {
        let wrong = |message: String| CaseError::new(origin, message);
        let asked = text.parse::<toml::Table>().ok().and_then(|table| unposed(&table));
        if let Some((key, what)) = asked {
            return Err(wrong(format!("{key}: cannot be posed: {what} (docs/systems.md)")));
        }
        let file: File = toml::from_str(text).map_err(|e| wrong(format!("this is no case:\n{e}")))?;
        let positive = |key: &str, x: f64| {
            if x.is_finite() && x > 0.0 {
                Ok(x)
            } else {
                Err(wrong(format!("{key} = {x}: expected a number above 0")))
            }
        };
        let (model, duration, sample) = match (file.mechanism, file.scenario) {
            (Some(m), None) => {
                let missing = |key: &str| wrong(format!("{key}: missing; a mechanism needs it"));
                let duration = positive("duration_s", file.duration_s.ok_or_else(|| missing("duration_s"))?)?;
                let sample = positive("sample_s", file.sample_s.ok_or_else(|| missing("sample_s"))?)?;
                let count = duration / sample;
                if (count - libm::round(count)).abs() > (1e-9 * count).clamp(1e-9, 1e-3)
                    || !(0.5..=MOST_SAMPLES).contains(&count)
                {
                    return Err(wrong(format!(
                        "sample_s = {sample}: expected duration_s = {duration} divided by a whole number of at most \
                         {MOST_SAMPLES}"
                    )));
                }
                let m = mechanism(origin, m)?;
                let fastest = m.signals().fold(0.0_f64, |most, s| most.max(s.fastest()));
                if fastest * duration > MOST_WAVES {
                    return Err(wrong(format!(
                        "frequency_hz = {fastest:e}: expected at most {MOST_WAVES:e} waves in duration_s = {duration}"
                    )));
                }
                (CaseModel::Mechanism(m), duration, sample)
            }
            (None, Some(s)) => {
                if let Some(key) = [("duration_s", file.duration_s), ("sample_s", file.sample_s)]
                    .iter()
                    .find_map(|(key, given)| given.map(|_| key))
                {
                    return Err(wrong(format!("{key}: a scenario has its own; write it into scenario.set")));
                }
                let built_in =
                    crate::scenario::BUILT_IN.iter().find(|b| b.name == s.name).ok_or_else(|| {
                        wrong(format!("scenario.name = \"{}\": expected a built-in scenario", s.name))
                    })?;
                crate::Scenario::parse("scenario", built_in.toml, &s.set)
                    .map_err(|e| wrong(format!("scenario.set: {e}")))?;
                (CaseModel::Scenario(s), 0.0, 0.0)
            }
            (None, None) => return Err(wrong("expected [mechanism] or [scenario]; found none".into())),
            (Some(_), Some(_)) => {
                return Err(wrong("expected [mechanism] or [scenario]; found both".into()));
            }
        };
        let still = file.still.map(|x| positive("still", x)).transpose()?;
        if file.expect.is_empty() {
            return Err(wrong("expect: a case expects something".into()));
        }
        let expect = file
            .expect
            .into_iter()
            .enumerate()
            .map(|(i, e)| {
                let at = format!("expect[{}]", i + 1);
                if !e.value.is_finite() {
                    return Err(wrong(format!("{at}.value = {}: expected a finite number", e.value)));
                }
                if !(e.within.is_finite() && e.within >= 0.0) {
                    return Err(wrong(format!(
                        "{at}.within = {}: expected a number of at least 0",
                        e.within
                    )));
                }
                e.observe.check(&model, duration).map_err(|m| wrong(format!("{at}.observe.{m}")))?;
                let ExpectFile { name, value, within, unit, observe } = e;
                Ok(Expect { observe, name, value, within, unit })
            })
            .collect::<Result<_, _>>()?;
        let (id, title, source) = (file.id, file.title, file.source);
        Ok(Case { id, title, source, model, duration, sample, still, expect })
    }

    /// All that it says, for readers in other languages.
    #[must_use]
    pub fn told(&self) -> serde_json::Value {
        let mechanism = match &self.model {
            CaseModel::Scenario(_) => serde_json::Value::Null,
            CaseModel::Mechanism(m) => json!({
                "inertia": m.inertia, "stiffness": m.stiffness, "damping": m.damping,
                "position": m.position, "velocity": m.velocity,
                "load": m.load.iter().map(Signal::told).collect::<Vec<_>>(),
                "rows": m.rows.iter().map(|row| json!({
                    "joints": row.joints, "base_velocity": row.base_velocity, "normal": row.normal.told(),
                    "friction": row.told.0, "parameters": row.told.1,
                })).collect::<Vec<_>>(),
            }),
        };
        json!({
            "id": self.id, "title": self.title, "source": self.source, "duration_s": self.duration,
            "sample_s": self.sample, "samples": self.samples(), "still": self.still, "mechanism": mechanism,
        })
    }

    /// Samples of a trajectory after the first.
    #[must_use]
    pub fn samples(&self) -> usize {
        libm::round(self.duration / self.sample.max(f64::MIN_POSITIVE)) as usize
    }
}

fn mechanism(origin: &str, file: MechanismFile) -> Result<Mechanism, CaseError> {
    let wrong = |message: String| CaseError::new(origin, message);
    let n = file.inertia.len();
    if !(1..=MOST).contains(&n) {
        return Err(wrong(format!("mechanism.inertia: {n} rows; expected 1 to {MOST}")));
    }
    let matrix = |key: &str, given: Option<Vec<Vec<f64>>>| {
        let m = given.unwrap_or_else(|| vec![vec![0.0; n]; n]);
        if m.len() != n || m.iter().any(|row| row.len() != n) {
            return Err(wrong(format!("mechanism.{key}: expected {n} rows of {n} numbers, as inertia has")));
        }
        match m.iter().flatten().find(|x| !x.is_finite()) {
            Some(x) => Err(wrong(format!("mechanism.{key}: {x}: expected finite numbers"))),
            None => Ok(m),
        }
    };
    let list = |key: &str, given: Option<Vec<f64>>| {
        let v = given.unwrap_or_else(|| vec![0.0; n]);
        if v.len() != n {
            return Err(wrong(format!("mechanism.{key}: {} numbers; expected {n}", v.len())));
        }
        match v.iter().find(|x| !x.is_finite()) {
            Some(x) => Err(wrong(format!("mechanism.{key}: {x}: expected finite numbers"))),
            None => Ok(v),
        }
    };
    let signal = |key: &str, s: &Signal| match s.wrong() {
        Some((term, x, expected)) => Err(wrong(format!("mechanism.{key}.{term} = {x}: expected {expected}"))),
        None => Ok(()),
    };
    if !(1..=MOST).contains(&file.row.len()) {
        return Err(wrong(format!("mechanism.row: {} rows; expected 1 to {MOST}", file.row.len())));
    }
    let load = file.load.unwrap_or_else(|| vec![Signal::default(); n]);
    if load.len() != n {
        return Err(wrong(format!("mechanism.load: {} lists; expected {n}, one for each joint", load.len())));
    }
    for (i, s) in load.iter().enumerate() {
        signal(&format!("load[{}]", i + 1), s)?;
    }
    let mut rows = Vec::new();
    for (i, row) in file.row.into_iter().enumerate() {
        let at = format!("mechanism.row[{}]", i + 1);
        if row.joints.len() != n || row.joints.iter().any(|x| !x.is_finite()) {
            let joints = &row.joints;
            return Err(wrong(format!(
                "{at}.joints = {joints:?}: expected {n} finite numbers, one for each joint"
            )));
        }
        if row.joints.iter().all(|x| *x == 0.0) {
            return Err(wrong(format!(
                "{at}.joints: 0 of each joint: expected a row that one of them moves"
            )));
        }
        if !row.base_velocity.is_finite() {
            return Err(wrong(format!(
                "{at}.base_velocity = {}: expected a finite number",
                row.base_velocity
            )));
        }
        signal(&format!("row[{}].normal", i + 1), &row.normal)?;
        let (friction, told) = friction(origin, &format!("{at}.friction"), row.friction)?;
        let (joints, base_velocity, normal) = (row.joints, row.base_velocity, row.normal);
        rows.push(Row { joints, base_velocity, normal, friction, told });
    }
    let inertia = matrix("inertia", Some(file.inertia))?;
    let mechanism = Mechanism {
        stiffness: matrix("stiffness", file.stiffness)?,
        damping: matrix("damping", file.damping)?,
        position: list("position", file.position)?,
        velocity: list("velocity", file.velocity)?,
        load,
        rows,
        inertia,
    };
    if !mechanism.has_inertia() {
        return Err(wrong("mechanism.inertia: expected a symmetric, positive definite matrix".into()));
    }
    Ok(mechanism)
}

/// A friction model out of a table that names it, with that name and all its parameters.
fn friction(
    origin: &str,
    at: &str,
    mut table: toml::Table,
) -> Result<(Friction<f64>, (String, toml::Table)), CaseError> {
    complete(origin, at, &<FrictionParams as Params<f64>>::INFO, &mut table)
        .map_err(|e| CaseError::new(origin, e.to_string().replacen(&format!("{origin}: "), "", 1)))?;
    let params: FrictionParams = read(&table);
    let name = <FrictionParams as Choice<f64>>::CHOICE.options[params.chosen()].key;
    let friction = Friction::build(&params).map_err(|e| {
        // Files name keys where the core names fields.
        let (field, key) = e.row().map_or(("", ""), |row| (row.field, row.key));
        CaseError::new(origin, format!("{at}.{name}.{}", e.to_string().replacen(field, key, 1)))
    })?;
    let parameters = table.get(name).and_then(toml::Value::as_table).cloned().unwrap_or_default();
    Ok((friction, (name.to_owned(), parameters)))
}
