//! A session of the loop: `clutch.loop`.

use crate::convert::{core_error, from_json, log_error, loop_error};
use crate::scenario::Scenario;
use crate::stepping::native;
use clutch_core::params::Word;
use clutch_live::Live;
use clutch_loop::build_error::BuildError;
use clutch_loop::clearance::ClearanceError;
use clutch_loop::control_loop::{OnDrift, Pace};
use clutch_loop::faults::Fault;
use clutch_loop::onlooker::Onlooker;
use clutch_loop::port::Address;
use clutch_loop::preflight::PreflightError;
use clutch_loop::realtime::{HIGHEST_PRIORITY, RealtimeOptions, Wait};
use clutch_loop::session::{Board, Event, Release, Session, SessionError, SessionOptions};
use pyo3::exceptions::{PyFileExistsError, PyOSError, PyValueError};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Values of `clutch.loop` unless others are given.
pub(crate) use clutch_loop::realtime::{DEFAULT_PRIORITY, SPIN_US};
pub(crate) use clutch_loop::release::WAY_DEG as RELEASE_DEG;

fn parsed<T: std::str::FromStr<Err: std::fmt::Display>>(text: &str) -> PyResult<T> {
    text.parse().map_err(|e: T::Err| PyValueError::new_err(e.to_string()))
}

/// One of some words.
fn chosen<T>(name: &str, word: &str, named: fn(&str) -> Option<T>, words: &[Word]) -> PyResult<T> {
    named(word).ok_or_else(|| {
        let expected: Vec<String> = words.iter().map(|word| format!("{:?}", word.name)).collect();
        PyValueError::new_err(format!("{name} = {word:?}: expected {}", expected.join(" or ")))
    })
}

fn error(py: Python<'_>, scenario: &Scenario, e: &SessionError) -> PyErr {
    match e {
        SessionError::Scenario(e)
        | SessionError::Clearance(ClearanceError::Scenario(e))
        | SessionError::Build(BuildError::Scenario(e))
        | SessionError::Preflight(PreflightError::Build(BuildError::Scenario(e))) => scenario.error(py, e),
        SessionError::Build(BuildError::Param(e))
        | SessionError::Preflight(PreflightError::Build(BuildError::Param(e))) => core_error(py, e),
        SessionError::Log(e) => log_error(py, e),
        SessionError::Clearance(ClearanceError::LogExists { .. }) => {
            PyFileExistsError::new_err(e.to_string())
        }
        SessionError::Clearance(ClearanceError::NotCertified { .. }) => loop_error(
            py,
            &format!("{e}\n`scenario.certificate()` says why; uncertified=True runs it all the same."),
        ),
        _ => loop_error(py, &e.to_string()),
    }
}

/// Runs a session; its summary, the same in words, what it had said it would do, and the scenario's text if that was
/// changed for the board's sake.
#[pyfunction]
#[pyo3(signature = (
    scenario, *, port, board, baud, log, uncertified, certificate, release_test, release_deg,
    on_drift, patient, faults, fault_seed, strict, pace, wait, spin_us, thread_priority,
    lock_memory, cpu_affinity, live
))]
#[allow(
    clippy::too_many_arguments,
    reason = "those of clutch.loop, which gives them their names and defaults"
)]
pub(crate) fn run_loop<'py>(
    py: Python<'py>,
    scenario: &Bound<'py, PyAny>,
    port: Option<&str>,
    board: Option<&str>,
    baud: Option<u32>,
    log: Option<PathBuf>,
    uncertified: bool,
    certificate: Option<PathBuf>,
    release_test: &str,
    release_deg: f64,
    on_drift: &str,
    patient: bool,
    faults: Vec<String>,
    fault_seed: u64,
    strict: bool,
    pace: &str,
    wait: &str,
    spin_us: u32,
    thread_priority: u8,
    lock_memory: bool,
    cpu_affinity: Option<usize>,
    live: Option<u16>,
) -> PyResult<(Bound<'py, PyAny>, String, String, Option<String>)> {
    let scenario = native(scenario)?;
    if thread_priority > HIGHEST_PRIORITY {
        let refusal = format!("thread_priority = {thread_priority}: expected 0 to {HIGHEST_PRIORITY}");
        return Err(PyValueError::new_err(refusal));
    }
    let given = [port.is_some(), board.is_some(), strict || !faults.is_empty()];
    if given.into_iter().filter(|given| *given).count() > 1 {
        return Err(PyValueError::new_err(
            "expected one of: port; board; strict and faults, which are the simulated board's",
        ));
    }
    let faults = faults.iter().map(|text| parsed::<Fault>(text)).collect::<PyResult<_>>()?;
    let stop = Arc::new(AtomicBool::new(false));
    let options = SessionOptions {
        board: match (port, board) {
            (Some(port), _) => Board::Daq(parsed::<Address>(port)?),
            (None, Some(port)) => Board::Controller(parsed::<Address>(port)?),
            (None, None) => Board::Simulated { faults, seed: fault_seed, strict },
        },
        baud,
        log,
        patient,
        uncertified,
        certificate,
        release: chosen("release_test", release_test, Release::named, Release::WORDS)?,
        release_way: release_deg.to_radians(),
        realtime: RealtimeOptions {
            thread_priority,
            lock_memory,
            cpu_affinity,
            wait: chosen("wait", wait, Wait::named, Wait::WORDS)?.mode(spin_us),
        },
        on_drift: chosen("on_drift", on_drift, OnDrift::named, OnDrift::WORDS)?,
        pace: chosen("pace", pace, Pace::named, Pace::WORDS)?,
        version: clutch_cli::BUILD.to_owned(),
    };
    let session = Session::new((*scenario.0).clone(), options).map_err(|e| error(py, &scenario, &e))?;
    let session = session.looked_at(live.map(|port| view(py, port, &stop)).transpose()?);
    let (mut announced, mut interrupt) = (String::new(), None);
    let ran = py.detach(|| {
        session.run(&stop, &mut |event| match event {
            Event::Announced(announcement) => announced = clutch_cli::plan(&announcement),
            // A signal waits, as Ctrl-C: the run ends in the safe state, and then the exception is raised.
            Event::Progress(_) => {
                if interrupt.is_none()
                    && let Err(e) = Python::attach(|py| py.check_signals())
                {
                    interrupt = Some(e);
                    stop.store(true, Ordering::Relaxed);
                }
            }
            Event::LogEnded | Event::Drift(_) => {}
        })
    });
    if let Some(interrupt) = interrupt {
        if let Ok(summary) = &ran {
            interrupt.value(py).call_method1("add_note", (summary.last_line(),))?;
        }
        return Err(interrupt);
    }
    let summary = ran.map_err(|e| error(py, &scenario, &e))?;
    let ran_as = session.scenario();
    let changed = (ran_as.scalar() != scenario.0.scalar()).then(|| ran_as.canonical());
    Ok((from_json(py, &summary.to_json())?, clutch_cli::summary(&summary), announced, changed))
}

/// A live view, whose address is printed as Python prints.
fn view(py: Python<'_>, port: u16, stop: &Arc<AtomicBool>) -> PyResult<Arc<dyn Onlooker>> {
    let mut live = Live::default();
    let address = live.page(port, stop.clone()).map_err(|e| {
        PyOSError::new_err(format!("live = {port}: no view can be served at this port of 127.0.0.1: {e}"))
    })?;
    py.import("builtins")?.call_method1("print", (format!("live view: {address}"),))?;
    Ok(Arc::new(live))
}
