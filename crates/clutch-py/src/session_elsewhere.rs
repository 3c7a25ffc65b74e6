//! `clutch.loop` where there is no real time: it says so.

use crate::convert::loop_error;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// The priority that a control thread has here: none of its own.
pub(crate) const DEFAULT_PRIORITY: u8 = 0;
/// Nothing is tested, and nothing waits.
pub(crate) const RELEASE_DEG: f64 = 0.0;
pub(crate) const SPIN_US: u32 = 0;

/// Refuses: ports and real time are those of Linux.
#[pyfunction]
#[pyo3(signature = (*_args, **_options))]
pub(crate) fn run_loop(
    py: Python<'_>,
    _args: &Bound<'_, PyTuple>,
    _options: Option<&Bound<'_, PyDict>>,
) -> PyResult<()> {
    Err(loop_error(
        py,
        "clutch.loop runs on Linux; simulate, sweep, certify, identify, tune and replay run everywhere",
    ))
}
