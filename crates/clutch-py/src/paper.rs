//! The paper, reproduced.

use crate::background::in_background;
use crate::convert::from_json;
use crate::table::{Column, Table};
use clutch_sim::paper::{FigureData, Outcome};
use clutch_sim::progress::Progress;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Outcome of the paper's runs: claims and Table 3 as lists of dicts, and the figures: number, law,
/// panels (rate in °/s, true for the experiment, time in s and error in °).
#[pyclass(frozen, module = "clutch._clutch")]
pub(crate) struct Paper {
    outcome: Outcome,
}

/// Runs the paper; `progress`, if given, is called with finished and total runs.
#[pyfunction]
#[pyo3(signature = (progress=None))]
pub(crate) fn reproduce(py: Python<'_>, progress: Option<Bound<'_, PyAny>>) -> PyResult<Paper> {
    let (finished, total) = (AtomicU64::new(0), AtomicU64::new(0));
    let work = |stop: &AtomicBool| {
        clutch_sim::paper::reproduce(&|p: Progress| {
            total.store(p.total, Ordering::Relaxed);
            finished.fetch_add(p.finished, Ordering::Relaxed);
            if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
    };
    let tell = || {
        let (f, t) = (finished.load(Ordering::Relaxed), total.load(Ordering::Relaxed));
        progress.as_ref().map_or(Ok(()), |p| p.call1((f, t)).map(drop))
    };
    match in_background(py, work, tell)? {
        Ok(outcome) => Ok(Paper { outcome }),
        Err(e) => Err(PyRuntimeError::new_err(e.to_string())),
    }
}

/// Panels of a figure: rate, true for the experiment, samples.
type Panels = Vec<(f64, bool, Table)>;

fn figure(f: &FigureData) -> (u32, &'static str, Panels) {
    let panels = f.panels.iter().map(|p| {
        let columns =
            [("time_s", Column::own(p.time_s.clone())), ("error_deg", Column::own(p.error_deg.clone()))];
        (p.rate_deg_s, p.experiment, Table::of(columns))
    });
    (f.number, f.law.name(), panels.collect())
}

#[pymethods]
impl Paper {
    /// Statements of the paper and their results: a dict each.
    fn claims<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.outcome.claims)
    }

    /// True if each statement holds, or fails as documented.
    fn as_documented(&self) -> Vec<bool> {
        self.outcome.claims.iter().map(clutch_sim::paper::Claim::as_expected).collect()
    }

    /// Rows of Table 3: a dict each.
    fn table3<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.outcome.table3)
    }

    /// Figures 8, 9, 10: number, law, panels.
    fn figures(&self) -> Vec<(u32, &'static str, Panels)> {
        self.outcome.figures.iter().map(figure).collect()
    }
}

fn to_python<'py>(py: Python<'py>, value: &impl serde::Serialize) -> PyResult<Bound<'py, PyAny>> {
    let json = serde_json::to_value(value).map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
    from_json(py, &json)
}
