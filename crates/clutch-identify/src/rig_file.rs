//! An identified rig as a file: `[model]` and `[bounds]` for scenarios, and the intervals behind them.

use crate::Estimate;
use crate::report::{Finding, Report};
use crate::shown::{ROWS, Row};
use clutch_core::{Actuator, ActuatorKind};
use clutch_sim::Scenario;
use toml::{Table, Value};

/// Standard deviations of the ripple that friction's bounds hold.
pub(crate) const RIPPLE: f64 = 3.0;
/// More waves per turn than any encoder shows.
const MOST_WAVES: f64 = 1e6;
/// Largest tolerance that a scenario takes, %.
pub(crate) const MOST_PERCENT: f64 = 99.9;

/// A file cannot be written for want of a parameter.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("no rig file: {parameter} is not known: {why}")]
pub struct Lacks {
    /// The parameter.
    pub parameter: &'static str,
    /// Reason why it is not.
    pub why: String,
}

pub(crate) fn need(parameter: &'static str, finding: &Finding) -> Result<Estimate, Lacks> {
    match finding {
        Finding::Known(estimate) => Ok(*estimate),
        Finding::Refused(why) => Err(Lacks { parameter, why: why.clone() }),
    }
}

/// The file. Drive torque and brake gain are those of the scenario's model: counts and volts give the other parameters
/// as ratios to them, and so does all that is calculated from them.
///
/// # Errors
/// A parameter that is not known.
pub fn rig_file(report: &Report, scenario: &Scenario) -> Result<String, Lacks> {
    let pull = need("T/J", &report.pull)?;
    let hold = need("T/(mu_d K)", &report.hold)?;
    let ratio = need("mu_s/mu_d", &report.ratio)?;
    let damping = need("C/J", &report.damping)?;
    let ripple = need("the ripple", &report.ripple)?;
    let model = scenario.spec().model;
    let torque = model.drive_torque;
    let gain = Actuator::new(&model.actuator).map_or(0.0, |a| a.brake_gain());
    let inertia = around(torque / pull.high, torque / pull.low);
    let damping = around(damping.low * inertia.0, damping.high * inertia.0);
    let sliding = torque / (hold.value * gain);
    let at_disc = report.uneven.max(RIPPLE * ripple.value);
    let friction = (1.0 + hold.share()) * (1.0 + ratio.share()) * (1.0 + at_disc) - 1.0;
    let percent = |share: f64| Value::Float((100.0 * share).min(MOST_PERCENT));
    let stribeck = [
        ("mu_static", Some(ratio.value * sliding)),
        ("mu_dynamic", Some(sliding)),
        ("stribeck_velocity_rad_s", report.stribeck.known().map(|v| v.value)),
    ];
    let stribeck: Table = stribeck
        .into_iter()
        .filter_map(|(key, value)| Some((key.to_owned(), Value::Float(value?))))
        .collect();
    let friction_table = Table::from_iter([("stribeck".to_owned(), Value::Table(stribeck))]);
    let model = Table::from_iter([
        ("inertia_kg_m2".to_owned(), Value::Float(inertia.0)),
        ("drive_torque_nm".to_owned(), Value::Float(torque)),
        ("viscous_damping_nm_s_rad".to_owned(), Value::Float(damping.0)),
        ("friction".to_owned(), Value::Table(friction_table)),
    ]);
    let bounds = Table::from_iter([
        ("inertia_percent".to_owned(), percent(inertia.1)),
        ("viscous_damping_percent".to_owned(), percent(damping.1)),
        ("friction_percent".to_owned(), percent(friction)),
        ("ripple_percent".to_owned(), percent(at_disc)),
        ("drive_torque_percent".to_owned(), Value::Float(0.0)),
        ("brake_gain_percent".to_owned(), Value::Float(0.0)),
    ]);
    let file = Table::from_iter([
        ("model".to_owned(), Value::Table(model)),
        ("bounds".to_owned(), Value::Table(bounds)),
        ("identified".to_owned(), Value::Table(identified(&ROWS, report, report.waves))),
    ]);
    Ok(format!(
        "# Findings of `clutch identify` for: {}\n\
         # For `clutch certify`, `clutch loop` and `clutch sim`: --identified THIS_FILE.toml puts [model] and [bounds] into a\n\
         # scenario. Drive torque and brake gain are the scenario's own: only ratios to them can be determined, and matter.\n\n{file}",
        scenario.name().replace(['\n', '\r'], " ")
    ))
}

/// Middle of an interval, and its half width as a share of that.
pub(crate) fn around(low: f64, high: f64) -> (f64, f64) {
    let middle = 0.5 * (low + high);
    (middle, 0.5 * (high - low) / middle.max(f64::MIN_POSITIVE))
}

/// A rig file, read.
#[derive(Clone, Debug, PartialEq)]
pub struct RigFile {
    model: Table,
    bounds: Table,
    /// Delay from a sample's voltage to its effect, s: dead time and lag together.
    pub delay: Option<Estimate>,
    /// Lag of the actuator, s.
    pub lag: Option<Estimate>,
    /// Root mean square of friction's variation along the disc, as a share.
    pub ripple: Option<Estimate>,
    /// Waves of that variation per turn.
    pub waves: Option<f64>,
    /// Stribeck velocity, rad/s.
    pub stribeck: Option<Estimate>,
}

/// A text is no rig file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoRigFile {
    /// It is no TOML.
    #[error("{name}: is no TOML: {error}")]
    Toml {
        /// The file.
        name: String,
        /// Where, and why not.
        error: toml::de::Error,
    },
    /// A table is missing.
    #[error("{name}: has no table [{table}]; expected a file of `clutch identify --out`")]
    Table {
        /// The file.
        name: String,
        /// The table.
        table: &'static str,
    },
}

impl RigFile {
    /// Reads the text of a file of that name.
    ///
    /// # Errors
    /// It is no TOML, or has no table `[model]` or `[bounds]`.
    pub fn parse(name: &str, text: &str) -> Result<RigFile, NoRigFile> {
        let file: Table = text.parse().map_err(|error| NoRigFile::Toml { name: name.to_owned(), error })?;
        let table = |key: &'static str| match file.get(key) {
            Some(Value::Table(table)) => Ok(table.clone()),
            _ => Err(NoRigFile::Table { name: name.to_owned(), table: key }),
        };
        let told = |key: &str| {
            let row = file.get("identified")?.get(key)?;
            let end =
                |end: &str| row.get(end).and_then(Value::as_float).filter(|x| x.is_finite() && *x >= 0.0);
            Some(Estimate { value: end("value")?, low: end("low")?, high: end("high")? })
        };
        let waves = file.get("identified").and_then(|identified| identified.get(RIPPLE_WAVES));
        Ok(RigFile {
            model: table("model")?,
            bounds: table("bounds")?,
            delay: told("delay_s"),
            lag: told("lag_s"),
            ripple: told("ripple_rms"),
            waves: waves.and_then(Value::as_float).filter(|waves| (1.0..=MOST_WAVES).contains(waves)),
            stribeck: told("stribeck_velocity_rad_s"),
        })
    }

    /// The actuator that `rig.actuator` has to be, in words, where it is of another kind than the one that was identified.
    #[must_use]
    pub fn expects_other_than(&self, kind: ActuatorKind) -> Option<String> {
        let motor = self.model.get("actuator").and_then(|actuator| actuator.get("motor")).is_some();
        let own = if motor { ActuatorKind::Motor } else { ActuatorKind::Brake };
        (own != kind).then(|| format!("a {}, as the rig file was identified with", own.name()))
    }

    /// Puts model and bounds into a scenario's table, key by key.
    pub fn put_into(&self, scenario: &mut Table) {
        for (section, from) in [("model", &self.model), ("bounds", &self.bounds)] {
            let to = scenario.entry(section).or_insert_with(|| Value::Table(Table::new()));
            if let Value::Table(to) = to {
                to.extend(from.clone());
            }
        }
    }
}

/// Key of the waves of the ripple per turn, where rides show them.
const RIPPLE_WAVES: &str = "ripple_waves_per_turn";

/// The intervals, each with the unit in its key, and the waves of the ripple.
pub(crate) fn identified<R>(rows: &[Row<R>], report: &R, waves: Option<f64>) -> Table {
    let waves = waves.map(|waves| (RIPPLE_WAVES.to_owned(), Value::Float(waves)));
    rows.iter()
        .map(|row| {
            let value = match row.finding(report) {
                Finding::Refused(why) => Value::String(why.clone()),
                Finding::Known(e) => {
                    let ends = [("value", e.value), ("low", e.low), ("high", e.high)];
                    Value::Table(ends.into_iter().map(|(key, x)| (key.to_owned(), Value::Float(x))).collect())
                }
            };
            (row.key.to_owned(), value)
        })
        .chain(waves)
        .collect()
}
