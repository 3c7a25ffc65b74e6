//! Maps: the lowest smooth rate over two gains, and one gain against rates; on all cores.

use super::{Evidence, Failure, RATE, SmoothSpeed, Trials, check, lowest_smooth_speed};
use crate::pool;
use crate::progress::{Progress, Report};
use crate::scenario::Scenario;
use crate::scenario_error::ScenarioError;
use clutch_core::params::{Choice, Kind};
use rayon::prelude::*;
use serde::Serialize;
use toml::Value;

/// Values of a key.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Axis {
    /// The key, as `law.pd.kp_v_rad`.
    pub key: String,
    /// Its values.
    pub values: Vec<f64>,
}

/// The lowest smooth rate over two keys.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GainMap {
    /// The key across.
    pub x: Axis,
    /// The key down.
    pub y: Axis,
    /// Row by row, a row for each value of `y`.
    pub cells: Vec<Vec<SmoothSpeed>>,
}

/// A rate that was tried on every disc.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tried {
    /// The first failure of each disc that is not smooth, by seed.
    pub failures: Vec<Failure>,
    /// The evidence for a cause, and the causes that hold.
    pub evidence: Evidence,
}

/// One value of a key, at all rates.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Column {
    /// By rate, rising.
    pub rates: Vec<Tried>,
}

/// A key against rates.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RateMap {
    /// The key across.
    pub x: Axis,
    /// The rates down, °/s.
    pub rates_deg_s: Vec<f64>,
    /// Discs that each rate was tried on.
    pub discs: u32,
    /// A column for each value of `x`.
    pub columns: Vec<Column>,
}

/// Numbers of the scenario's law, as dotted keys, with their values in the scenario.
#[must_use]
pub fn law_keys(scenario: &Scenario) -> Vec<(String, f64)> {
    let law = format!("law.{}.", Choice::<f64>::name(&scenario.params().law));
    let number = |(key, value): (String, String)| Some((key, value.parse().ok()?));
    let own = |(key, _): &(String, String)| key.starts_with(&law);
    let real = |key: &str| scenario.row(key).is_some_and(|row| matches!(row.kind, Kind::Real));
    scenario.parameters().into_iter().filter(own).filter_map(number).filter(|(key, _)| real(key)).collect()
}

/// The lowest smooth rate over two keys.
///
/// # Errors
/// As [`lowest_smooth_speed`]; a value that the scenario refuses.
pub fn gain_map(
    scenario: &Scenario,
    (x, y): (Axis, Axis),
    trials: &Trials,
    report: Report<'_>,
) -> Result<GainMap, ScenarioError> {
    check_axes(scenario, &[&x, &y])?;
    let total = (x.values.len() * y.values.len()) as u64;
    let cell = |b: f64, a: f64| {
        let here = scenario.changed(&[set(scenario, &x, a), set(scenario, &y, b)])?;
        let cell = lowest_smooth_speed(&here, trials, &|_| report(Progress { total, finished: 0 }));
        told(report, total, cell)
    };
    let row = |b: &f64| x.values.par_iter().map(|a| cell(*b, *a)).collect::<Result<Vec<_>, _>>();
    let cells = pool::install(|| y.values.par_iter().map(row).collect::<Result<_, _>>())?;
    Ok(GainMap { x, y, cells })
}

/// A key against rates: all discs at all rates.
///
/// # Errors
/// As [`gain_map`].
pub fn rate_map(
    scenario: &Scenario,
    x: Axis,
    trials: &Trials,
    report: Report<'_>,
) -> Result<RateMap, ScenarioError> {
    check_axes(scenario, &[&x])?;
    let total = (x.values.len() * trials.rates_deg_s().len()) as u64;
    let tried = |a: f64, rate: f64| {
        let here = scenario.changed(&[set(scenario, &x, a), (RATE.to_owned(), Value::Float(rate))])?;
        let run = |seed| here.disc(rate, seed, &|_| report(Progress { total, finished: 0 }));
        let failures: Vec<Option<Failure>> =
            (1..=u64::from(trials.discs())).map(run).collect::<Result<_, _>>()?;
        let failures: Vec<Failure> = failures.into_iter().flatten().collect();
        let patient: Report<'_> = &|_| report(Progress { total, finished: 0 });
        let evidence = Evidence::new(rate, &here)?.with(failures.first(), &here, patient)?;
        told(report, total, Ok(Tried { failures, evidence }))
    };
    let column = |a: &f64| {
        let rates = trials.rates_deg_s().par_iter().map(|rate| tried(*a, *rate)).collect::<Result<_, _>>()?;
        Ok(Column { rates })
    };
    let columns = pool::install(|| x.values.par_iter().map(column).collect::<Result<_, ScenarioError>>())?;
    Ok(RateMap { x, rates_deg_s: trials.rates_deg_s().to_vec(), discs: trials.discs(), columns })
}

/// A key with its value, which is a whole number where the key asks for one.
fn set(scenario: &Scenario, axis: &Axis, value: f64) -> (String, Value) {
    let whole = scenario.takes_whole(&axis.key);
    let value =
        if whole && value.fract() == 0.0 { Value::Integer(value as i64) } else { Value::Float(value) };
    (axis.key.clone(), value)
}

/// Reports a finished cell.
fn told<T>(report: Report<'_>, total: u64, cell: Result<T, ScenarioError>) -> Result<T, ScenarioError> {
    let _ = report(Progress { total, finished: 1 });
    cell
}

/// Everything that a map can be refused for is said before the first run.
fn check_axes(scenario: &Scenario, axes: &[&Axis]) -> Result<(), ScenarioError> {
    check(scenario)?;
    for axis in axes {
        if [RATE, "run.seed"].contains(&axis.key.as_str()) {
            return Err(
                scenario.refuse(&axis.key, "expected another key: a map has rates and seeds of its own")
            );
        }
        if axis.values.is_empty() {
            return Err(scenario.refuse(&axis.key, "expected at least one value"));
        }
        for value in &axis.values {
            scenario.changed(&[set(scenario, axis, *value)])?;
        }
    }
    if let [x, y] = axes
        && x.key == y.key
    {
        return Err(scenario.refuse(&x.key, "named twice: expected two keys"));
    }
    Ok(())
}
