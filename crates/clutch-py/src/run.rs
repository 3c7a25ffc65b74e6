//! Simulation: one run, its samples, events and figures.

use crate::convert::{core_error, from_json, os_error};
use crate::scenario::Scenario;
use crate::stepping::{PythonLaw, event_table, native};
use crate::table::{Column, InColumn, Table};
use clutch_core::law::Limit;
use clutch_core::{ParamError, Servo};
use clutch_loop::to_log::{SaveError, save_simulation};
use clutch_sim::engine::EngineKind;
use clutch_sim::metrics::columns;
use clutch_sim::picture::{Around, Envelope, PARTS, Stick, Window, sticks};
use clutch_sim::progress::Progress;
use clutch_sim::rig::Rig;
use clutch_sim::run::Trace;
use clutch_sim::smooth_speed::{self, Trials};
use clutch_sim::{Keep, RunError, SAMPLE_COLUMNS, SampleColumn, ScenarioError, Values, simulate_servo};
use numpy::PyReadonlyArray1;
use pyo3::exceptions::{PyFileExistsError, PyRuntimeError, PyUserWarning};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::ffi::CString;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;

/// A finished run.
#[pyclass(frozen, module = "clutch._clutch")]
pub(crate) struct Run {
    scenario: Scenario,
    run: Arc<clutch_sim::Run>,
    /// Name of the law that ran, if it was written in Python.
    python_law: Option<String>,
}

/// Ends the work when a signal waits, as Ctrl-C.
pub(crate) fn unless_interrupted(_: Progress) -> ControlFlow<()> {
    go_on()
}

/// The same for work that reports no progress.
pub(crate) fn go_on() -> ControlFlow<()> {
    match Python::attach(|py| py.check_signals()) {
        Ok(()) => ControlFlow::Continue(()),
        Err(e) => {
            Python::attach(|py| e.restore(py));
            ControlFlow::Break(())
        }
    }
}

/// Runs a scenario; `law`, a function of a `Tick` or an object with such a method `step`, takes the place of its law.
#[pyfunction]
#[pyo3(signature = (scenario, law=None))]
pub(crate) fn simulate(py: Python<'_>, scenario: &Bound<'_, PyAny>, law: Option<Py<PyAny>>) -> PyResult<Run> {
    let scenario = native(scenario)?;
    let python_law = law.as_ref().map(|law| law_name(law.bind(py))).transpose()?;
    let run = match law {
        None => py.detach(|| scenario.0.run(Keep::Trace, &unless_interrupted)),
        Some(callable) => with_python_law(py, &scenario, callable)?,
    };
    // The signal's exception is set already.
    if let Some(e) = PyErr::take(py) {
        return Err(e);
    }
    let run = Arc::new(run.map_err(|e| scenario.error(py, &e))?);
    let spec = scenario.0.spec();
    let rig = Rig::new(&spec.rig, spec.run.seed).map_err(|e| core_error(py, &e))?;
    let lacks = rig.not_passive(&spec.output).map(|lacks| lacks.to_string());
    let cannot = scenario.0.cannot_follow().map_err(|e| scenario.error(py, &e))?;
    let invalid = run.trace.limit.iter().filter(|limit| **limit == Limit::Invalid).count();
    let not_a_number = python_law.as_ref().filter(|_| invalid > 0).map(|law| {
        format!(
            "{law} answered no finite number in {invalid} of {} periods: the output was output.on_invalid_v there",
            run.trace.limit.len()
        )
    });
    for note in lacks.into_iter().chain(cannot).chain(not_a_number) {
        let note = CString::new(format!("{}: {note}", scenario.0.name()))?;
        // Of the line that asked for the run, not of the package's own.
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &note, 2)?;
    }
    Ok(Run { scenario, run, python_law })
}

/// Name of a law written in Python: of its function, or of its class.
fn law_name(law: &Bound<'_, PyAny>) -> PyResult<String> {
    let named = if law.hasattr("__qualname__")? { law.clone() } else { law.get_type().into_any() };
    let module: String = named.getattr("__module__")?.extract().unwrap_or_default();
    let name: String = named.getattr("__qualname__")?.extract()?;
    Ok(if module.is_empty() { name } else { format!("{module}.{name}") })
}

fn with_python_law(
    py: Python<'_>,
    scenario: &Scenario,
    callable: Py<PyAny>,
) -> PyResult<Result<clutch_sim::Run, ScenarioError>> {
    let spec = scenario.0.spec();
    let wrong = |e: &ParamError| core_error(py, e);
    let law = PythonLaw::new(callable.bind(py), scenario)?;
    let params = spec.servo().map_err(|e| wrong(&e))?;
    let servo = Servo::with_law(&params, law).map_err(|e| wrong(&e))?;
    let watch =
        |p: Progress| if servo.law().failed() { ControlFlow::Break(()) } else { unless_interrupted(p) };
    let run = py.detach(|| simulate_servo(&spec, &servo, Keep::Trace, &watch));
    match servo.law().failure() {
        Some(e) => Err(e),
        None => Ok(run.map_err(|e: RunError| scenario.0.run_error(&e))),
    }
}

/// The lowest smooth rate of a scenario, of these rates or the usual ones: the object that `clutch map --json` has in a
/// cell.
#[pyfunction]
#[pyo3(signature = (scenario, rates, discs))]
pub(crate) fn lowest_smooth_speed<'py>(
    py: Python<'py>,
    scenario: &Bound<'py, PyAny>,
    rates: Option<Vec<f64>>,
    discs: i64,
) -> PyResult<Bound<'py, PyAny>> {
    let scenario = native(scenario)?;
    let rates = rates.as_deref().unwrap_or(&smooth_speed::RATES_DEG_S);
    let wrong = |e: ScenarioError| scenario.error(py, &e);
    let trials = Trials::new("lowest_smooth_speed", rates, discs).map_err(wrong)?;
    let found = py.detach(|| smooth_speed::lowest_smooth_speed(&scenario.0, &trials, &unless_interrupted));
    // The signal's exception is set already.
    if let Some(e) = PyErr::take(py) {
        return Err(e);
    }
    let found = serde_json::to_value(found.map_err(wrong)?);
    from_json(py, &found.map_err(|e| PyRuntimeError::new_err(e.to_string()))?)
}

/// A curve over time in parts of equal length: the middle of each, s, its lowest and highest value, and its mean.
#[pyfunction]
pub(crate) fn envelope(
    time: PyReadonlyArray1<'_, f64>,
    values: PyReadonlyArray1<'_, f64>,
) -> PyResult<Table> {
    let e = Envelope::new(time.as_slice()?, values.as_slice()?, PARTS);
    let columns = [("time_s", e.time), ("low", e.low), ("high", e.high), ("mean", e.mean)];
    Ok(Table::of(columns.map(|(name, values)| (name, Column::own(values)))))
}

/// Times at rest as a table.
pub(crate) fn stick_table(sticks: &[Stick]) -> Table {
    let column = |of: fn(&Stick) -> f64| Column::own(sticks.iter().map(of).collect::<Vec<f64>>());
    Table::of([("from_s", column(|s| s.from)), ("to_s", column(|s| s.to))])
}

/// A window's begin and end, s; what is in its middle, in words; true if that is a stick.
pub(crate) fn window_parts(window: &Window) -> (f64, f64, String, bool) {
    (window.from, window.to, window.words(), matches!(window.around, Around::Stick(_)))
}

/// Samples as columns, the memory shared with the run.
pub(crate) fn sample_columns(run: &Arc<clutch_sim::Run>) -> Vec<(String, Column)> {
    fn part<T: InColumn>(run: &Arc<clutch_sim::Run>, of: impl FnOnce(&Trace) -> Option<&[T]>) -> Column {
        Column::part(run, |r| of(&r.trace).unwrap_or_default())
    }
    let column = |column: &SampleColumn| {
        let of = column.values;
        match of(&run.trace) {
            Values::Real(_) => part(run, |t| if let Values::Real(x) = of(t) { Some(x) } else { None }),
            Values::Counts(_) => part(run, |t| if let Values::Counts(x) = of(t) { Some(x) } else { None }),
            Values::Codes(_) => part(run, |t| if let Values::Codes(x) = of(t) { Some(x) } else { None }),
            Values::Flags(_) => part(run, |t| if let Values::Flags(x) = of(t) { Some(x) } else { None }),
            Values::Limits(x) => Column::own(x.iter().map(|l| *l as u16).collect::<Vec<u16>>()),
        }
    };
    let mut columns: Vec<(String, Column)> =
        SAMPLE_COLUMNS.iter().map(|one| (one.name.to_owned(), column(one))).collect();
    for (i, (name, _)) in run.trace.term_columns().enumerate() {
        columns.push((name, Column::part(run, |r| r.trace.terms[i].1.as_slice())));
    }
    columns
}

#[pymethods]
impl Run {
    /// A row for each sample.
    #[getter]
    fn samples(&self) -> Table {
        Table::of(sample_columns(&self.run))
            .meaning(SAMPLE_COLUMNS.iter().map(|column| (column.name, column.meaning)))
    }

    /// Sticks and break-aways.
    #[getter]
    fn events(&self) -> Table {
        event_table(&self.run.events)
    }

    /// Times at rest: from a stick to its break-away, or to the end of the run.
    #[getter]
    fn sticks(&self) -> Table {
        stick_table(&sticks(&self.run.events, self.scenario.0.spec().run.duration))
    }

    /// The stretch that a picture shows closely: its begin and end, s; what is in its middle, in words; true if that is a
    /// stick.
    #[getter]
    fn window(&self) -> Option<(f64, f64, String, bool)> {
        Window::of(&self.scenario.0, &self.run).as_ref().map(window_parts)
    }

    /// Figures by name.
    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (name, value) in columns(&self.run.metrics, &self.run.detected) {
            dict.set_item(name, value)?;
        }
        Ok(dict)
    }

    /// Name of the engine that ran.
    #[getter]
    fn engine(&self) -> &'static str {
        match self.run.engine {
            EngineKind::ExactFlow => "exact_flow",
            EngineKind::Bristle => "bristle",
            EngineKind::DormandPrince | EngineKind::Auto => "dormand_prince",
        }
    }

    /// Writes the log that `clutch sim --log` writes.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        if path.exists() {
            let text = format!("{}: exists already; a log is never overwritten", path.display());
            return Err(PyFileExistsError::new_err(text));
        }
        let (scenario, run, law) = (&self.scenario.0, &self.run, self.python_law.as_deref());
        let build = clutch_cli::BUILD;
        let written = py.detach(|| save_simulation(&path, scenario, run, build, law, &unless_interrupted));
        // The signal's exception is set already.
        if let Some(e) = PyErr::take(py) {
            return Err(e);
        }
        written.map_err(|e| match e {
            SaveError::Log(e) => crate::convert::log_error(py, &e),
            SaveError::Build(_) | SaveError::Stopped => {
                let source = std::io::Error::other(e.to_string());
                os_error(py, &path, &e.to_string(), &source)
            }
        })
    }
}
