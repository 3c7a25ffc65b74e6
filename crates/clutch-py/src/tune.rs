//! Identification and tuning: `clutch.identify`, `clutch.tune`.

use crate::background::in_background;
use crate::convert::{from_json, log_error, loop_error, os_error, scenario_error};
use crate::log::read_unless_interrupted;
use crate::stepping::native;
use clutch_identify::added::Added;
use clutch_identify::experiment::{ExperimentError, PartRunner, folder_for_logs};
use clutch_identify::recording::{MOST_TABLE_MIB, ReadError, Scale};
use clutch_identify::shown::{MOTOR_ROWS, ROWS};
use clutch_identify::{Consent, Experiment, Identified, Recording, RigFile, believed};
use clutch_log::LogError;
use clutch_sim::Scenario;
use clutch_sim::scenario::read_text_up_to;
use clutch_tune::Options;
use pyo3::exceptions::{PyFileExistsError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

fn read_error(py: Python<'_>, e: &ReadError) -> PyErr {
    match e {
        ReadError::Log(e) => log_error(py, e),
        _ => PyValueError::new_err(e.to_string()),
    }
}

fn experiment_error(py: Python<'_>, e: &ExperimentError) -> PyErr {
    match e {
        ExperimentError::Scenario(e) => scenario_error(py, e, None),
        ExperimentError::Read(e) => read_error(py, e),
        ExperimentError::Log(e) => log_error(py, e),
        // The message begins with the limit, which is an argument here.
        ExperimentError::Limit { key, .. } | ExperimentError::OfMotors(key) => {
            let argument = if *key == "travel" { "travel_deg" } else { "fastest_deg_s" };
            PyValueError::new_err(e.to_string().replacen(key, argument, 1))
        }
        _ => loop_error(py, &e.to_string()),
    }
}

/// The recordings in logs and tables; of a table period and encoder are the scenario's.
fn read(
    py: Python<'_>,
    scenario: &Scenario,
    logs: &[PathBuf],
    columns: &(String, String),
) -> PyResult<Vec<Recording>> {
    let mut recordings = Vec::new();
    for path in logs {
        let name = path.display().to_string();
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
            let text = read_text_up_to(path, MOST_TABLE_MIB)
                .map_err(|e| os_error(py, path, &format!("{name}: {e}"), &e))?;
            let read = Recording::from_csv(&name, &text, (&columns.0, &columns.1), &Scale::of(scenario));
            recordings.push(read.map_err(|e| read_error(py, &e))?);
        } else {
            let whole = read_unless_interrupted(py, path)?;
            recordings.extend(Recording::from_log(&name, &whole).map_err(|e| read_error(py, &e))?);
        }
    }
    Ok(recordings)
}

/// Identifies a rig: the object that `clutch identify --json` prints, and the rig file, or why there is none. Without logs
/// the scenario's simulated board is run, in virtual time. `loaded`: logs with a mass added, the mass (kg), its radius (m).
#[allow(clippy::too_many_arguments, reason = "Python names them")]
#[pyfunction]
#[pyo3(signature = (scenario, logs, columns, loaded, log, travel_deg, fastest_deg_s))]
pub(crate) fn identify<'py>(
    py: Python<'py>,
    scenario: &Bound<'py, PyAny>,
    logs: Vec<PathBuf>,
    columns: (String, String),
    loaded: Option<(Vec<PathBuf>, f64, f64)>,
    log: Option<PathBuf>,
    travel_deg: Option<f64>,
    fastest_deg_s: Option<f64>,
) -> PyResult<(Bound<'py, PyAny>, Option<String>, Option<String>)> {
    let scenario = native(scenario)?;
    let recordings = read(py, &scenario.0, &logs, &columns)?;
    let loaded = match loaded {
        Some((logs, mass, radius)) => {
            let added = Added::on(&scenario.0, mass, radius);
            let added = added.map_err(|e| PyValueError::new_err(e.to_string()))?;
            Some((read(py, &scenario.0, &logs, &columns)?, added))
        }
        None => None,
    };
    if let Some(folder) = &log {
        folder_for_logs(folder).map_err(|e| match &e {
            ExperimentError::Log(LogError::Io { source, .. }) => os_error(py, folder, &e.to_string(), source),
            _ => PyFileExistsError::new_err(e.to_string()),
        })?;
    }
    let found = py.detach(|| {
        let recordings = if logs.is_empty() {
            let mut runner =
                log.map_or_else(PartRunner::default, |folder| PartRunner::logging(folder, clutch_cli::BUILD));
            let experiment = Experiment::of(&scenario.0, &Consent { travel_deg, fastest_deg_s })?;
            experiment.run(&scenario.0, &mut |name, part| runner.run(name, part))?
        } else {
            recordings
        };
        let loaded = match loaded {
            Some((recordings, added)) => Some((Identified::of(&recordings)?, added)),
            None => None,
        };
        Ok((Identified::of(&recordings)?, loaded))
    });
    let (report, loaded) = found.map_err(|e| experiment_error(py, &e))?;
    let separate = loaded.map(|(loaded, added)| report.separate(&loaded, &added)).transpose();
    let separate = separate.map_err(|e| PyValueError::new_err(e.to_string()))?;
    let object = from_json(py, &clutch_cli::identify::object(&report, separate.as_ref()))?;
    let (file, why) = match report.rig_file(&scenario.0) {
        Ok(file) => (Some(file), None),
        Err(why) => (None, Some(why.to_string())),
    };
    Ok((object, file, why))
}

/// Key, name for readers, unit and the factor from SI to it, of each parameter that identification may determine, in the order in
/// which they are shown.
#[pyfunction]
pub(crate) fn identified_rows() -> Vec<(&'static str, &'static str, &'static str, f64)> {
    let brake = ROWS.iter().map(|row| (row.key, row.label, row.unit, row.factor));
    let motor = MOTOR_ROWS.iter().map(|row| (row.key, row.label, row.unit, row.factor));
    let also = motor.filter(|row| ROWS.iter().all(|other| other.key != row.0));
    brake.chain(also).collect()
}

/// A rig file of that name.
fn rig((name, text): (&str, &str)) -> PyResult<RigFile> {
    RigFile::parse(name, text).map_err(|e| PyValueError::new_err(e.to_string()))
}

/// The scenario with the rig that it believes in, as TOML.
#[pyfunction]
pub(crate) fn as_identified(py: Python<'_>, scenario: &Bound<'_, PyAny>, file: &str) -> PyResult<String> {
    let scenario = native(scenario)?;
    let rig = rig(("identified", file))?;
    let found = py.detach(|| believed(&scenario.0, Some(&rig)));
    Ok(found.map_err(|e| scenario_error(py, &e, None))?.scenario.canonical())
}

/// A result, and beside it the scenario of each candidate as TOML, the verdict in words, and the proof as a file has it.
type Found<'py> = (Bound<'py, PyAny>, Vec<Option<String>>, String, Option<String>);

/// Tunes a scenario: the object that `clutch tune --json` prints, and what goes with it.
#[pyfunction]
#[pyo3(signature = (scenario, file, rates_deg_s, candidates, uncertified))]
pub(crate) fn tune<'py>(
    py: Python<'py>,
    scenario: &Bound<'py, PyAny>,
    file: Option<(String, String)>,
    rates_deg_s: Vec<f64>,
    candidates: u32,
    uncertified: bool,
) -> PyResult<Found<'py>> {
    let scenario = native(scenario)?;
    let rig = file.map(|(name, text)| rig((&name, &text))).transpose()?;
    let options = Options { rates_deg_s, candidates, uncertified };
    let work = |stop: &AtomicBool| {
        let go_on =
            |_| if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        clutch_tune::tune(&scenario.0, rig.as_ref(), &options, &go_on)
    };
    let tuned = in_background(py, work, || Ok(()))?.map_err(|e| scenario.error(py, &e))?;
    let object = serde_json::to_value(&tuned).map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
    let files = tuned.candidates.iter().map(|c| c.scenario.as_ref().map(Scenario::canonical)).collect();
    let proof = tuned.certificate.as_ref().map(serde_json::to_string).transpose();
    let proof = proof.map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
    Ok((from_json(py, &object)?, files, clutch_cli::tune::verdict(&tuned), proof))
}
