//! Cases of the referee, and trajectories of any make before it.

use crate::convert::{does_not_apply, from_json};
use clutch_sim::referee::{
    BUILT_IN, Case, ENGINES, RefereeEngine, RefereeError, Trajectory, TrajectoryEvent, run,
};
use numpy::{PyArray2, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::collections::HashMap;

/// Names and files of the built-in cases.
#[pyfunction]
pub(crate) fn referee_cases() -> Vec<(&'static str, &'static str)> {
    BUILT_IN.to_vec()
}

/// A case of the referee; `text` is the contents of its file, `origin` what errors begin with.
#[pyclass(frozen, module = "clutch._clutch")]
pub(crate) struct RefereeCase {
    case: Case,
}

/// Lists of one length as an array.
type Array<'py> = Bound<'py, PyArray2<f64>>;

/// Time, row, "it holds".
type Event = (f64, usize, bool);

/// Positions, velocities, torques, events, figures.
type Lists<'py> = (Array<'py>, Array<'py>, Option<Array<'py>>, Option<Vec<Event>>, HashMap<String, f64>);

fn lists(array: &PyReadonlyArray2<'_, f64>) -> Vec<Vec<f64>> {
    array.as_array().rows().into_iter().map(|row| row.to_vec()).collect()
}

/// Name, measured, expected, within, unit.
type Figure = (String, Option<f64>, f64, f64, String);

#[pymethods]
impl RefereeCase {
    #[new]
    fn new(origin: &str, text: &str) -> PyResult<Self> {
        let case = Case::parse(origin, text).map_err(|e| PyValueError::new_err(e.to_string()))?;
        Ok(RefereeCase { case })
    }

    /// All that the case says, as a dict.
    fn told<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        from_json(py, &self.case.told())
    }

    /// Runs it on an engine of this package: positions and velocities (joints × samples), torques (rows × samples), events
    /// of time, row and "it holds", figures.
    #[pyo3(signature = (engine, step=None))]
    fn run<'py>(&self, py: Python<'py>, engine: &str, step: Option<f64>) -> PyResult<Lists<'py>> {
        let engine = RefereeEngine::named(engine).ok_or_else(|| {
            let names: Vec<&str> = ENGINES.iter().map(|e| e.name()).collect();
            PyValueError::new_err(format!("engine = \"{engine}\": expected one of: {}", names.join(", ")))
        })?;
        let t = py.detach(|| run(&self.case, engine, step)).map_err(|e| match e {
            RefereeError::NotForIt(needs) => does_not_apply(py, &needs),
            _ => PyValueError::new_err(format!("{}: {e}", self.case.id)),
        })?;
        let events = t.events.map(|all| all.iter().map(|e| (e.time, e.row, e.holds)).collect());
        let array = |lists: &[Vec<f64>]| PyArray2::from_vec2(py, lists).map_err(PyErr::from);
        let torque = t.torque.as_deref().map(array).transpose()?;
        Ok((array(&t.position)?, array(&t.velocity)?, torque, events, t.metrics.into_iter().collect()))
    }

    /// Holds a trajectory against the case: name, measured, expected, within, unit of each figure.
    #[pyo3(signature = (position, velocity, torque, events, metrics))]
    fn judge(
        &self,
        position: PyReadonlyArray2<'_, f64>,
        velocity: PyReadonlyArray2<'_, f64>,
        torque: Option<PyReadonlyArray2<'_, f64>>,
        events: Option<Vec<Event>>,
        metrics: HashMap<String, f64>,
    ) -> PyResult<Vec<Figure>> {
        let event = |(time, row, holds)| TrajectoryEvent { time, row, holds };
        let events = events.map(|all| all.into_iter().map(event).collect());
        let metrics = metrics.into_iter().collect();
        let (position, velocity) = (lists(&position), lists(&velocity));
        let torque = torque.as_ref().map(lists);
        let t = Trajectory { sample: self.case.sample, position, velocity, torque, events, metrics };
        t.check(&self.case).map_err(|e| PyValueError::new_err(e.to_string()))?;
        let all = self.case.judge(&t).into_iter();
        Ok(all.map(|v| (v.name, v.measured, v.expected, v.within, v.unit)).collect())
    }
}
