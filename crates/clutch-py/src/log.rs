//! Logs: their channels as tables, and replay.

use crate::convert::{from_json, log_error, scenario_error};
use crate::run::{go_on, stick_table, unless_interrupted, window_parts};
use crate::scenario::Scenario;
use crate::stepping::PythonLaw;
use crate::table::{Column, Table, pairs};
use clutch_log::{Cells, InChannel, Limits, TIME};
use clutch_loop::picture::pictured;
use clutch_loop::replay;
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::iter;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A log in memory; `clutch.Log` is its public form.
#[pyclass(frozen, module = "clutch._clutch")]
pub(crate) struct Log {
    log: Arc<clutch_log::Log>,
    origin: String,
}

/// Reads a log, even one that was cut.
#[pyfunction]
pub(crate) fn read_log(py: Python<'_>, path: PathBuf) -> PyResult<Log> {
    let log = Arc::new(read_unless_interrupted(py, &path)?);
    Ok(Log { log, origin: path.display().to_string() })
}

/// Reads a log until a signal waits, as Ctrl-C.
pub(crate) fn read_unless_interrupted(py: Python<'_>, path: &Path) -> PyResult<clutch_log::Log> {
    let read = py.detach(|| clutch_log::read_while(path, &Limits::default(), go_on));
    // The signal's exception is set already.
    match PyErr::take(py) {
        Some(e) => Err(e),
        None => read.map_err(|e| log_error(py, &e)),
    }
}

/// Rows of a table between two questions whether a signal waits: milliseconds.
const ASK_EVERY: usize = 1 << 14;

/// The values of a field as a column.
fn column(cells: Cells) -> Column {
    match cells {
        Cells::Whole(all) => Column::own(all),
        Cells::Real(all) => Column::own(all),
        Cells::Flag(all) => Column::own(all),
        Cells::Word(_, all) => Column::text(all),
    }
}

/// The records of a channel: the time, and the channel's fields. `terms` name the last ones of commands. Breaks when a
/// signal waits.
fn table<R: InChannel>(records: &[R], terms: &[String]) -> ControlFlow<(), Table> {
    let mut columns: Vec<(String, Cells)> =
        R::CHANNEL.columns(terms).into_iter().map(|(name, kind)| (name, Cells::of(kind))).collect();
    for (i, record) in records.iter().enumerate() {
        if i.is_multiple_of(ASK_EVERY) {
            go_on()?;
        }
        let mut values = record.values();
        columns.iter_mut().for_each(|(_, cells)| cells.push(values.next()));
    }
    let time = records.iter().map(|r| r.time_ns() as f64 / 1e9).collect::<Vec<f64>>();
    let columns = columns.into_iter().map(|(name, cells)| (name, column(cells)));
    let table = Table::of(iter::once((TIME.to_owned(), Column::own(time))).chain(columns));
    let names = iter::once(TIME).chain(R::CHANNEL.fields.iter().map(|field| field.name));
    ControlFlow::Continue(table.meaning(names.map(|name| (name, R::CHANNEL.label(name)))))
}

/// The result of the work, or the signal's exception.
fn made<T>(py: Python<'_>, work: impl FnOnce() -> ControlFlow<(), T> + Send) -> PyResult<T>
where
    T: Send,
{
    match py.detach(work) {
        ControlFlow::Continue(made) => Ok(made),
        ControlFlow::Break(()) => {
            Err(PyErr::take(py).unwrap_or_else(|| PyKeyboardInterrupt::new_err("interrupted")))
        }
    }
}

impl Log {
    fn tables(&self) -> ControlFlow<(), Vec<(&'static str, Table)>> {
        fn named<R: InChannel>(records: &[R], terms: &[String]) -> ControlFlow<(), (&'static str, Table)> {
            ControlFlow::Continue((R::CHANNEL.topic.trim_start_matches('/'), table(records, terms)?))
        }
        let log = &self.log;
        let terms = &log.header.term_names;
        ControlFlow::Continue(vec![
            named(&log.samples, terms)?,
            named(&log.commands, terms)?,
            named(&log.events, terms)?,
            named(&log.links, terms)?,
            named(&log.changes, terms)?,
            named(&log.truths, terms)?,
        ])
    }

    fn scenario(&self, py: Python<'_>) -> PyResult<Scenario> {
        let origin = format!("{}: its scenario", self.origin);
        let read = clutch_sim::Scenario::of_log(&origin, &self.log.header.scenario_toml, &[]);
        Ok(Scenario(Arc::new(read.map_err(|e| scenario_error(py, &e, None))?)))
    }
}

#[pymethods]
impl Log {
    /// Channels that have records, as tables.
    fn channels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (name, table) in made(py, || self.tables())? {
            if table.rows() > 0 {
                dict.set_item(name, Bound::new(py, table)?)?;
            }
        }
        Ok(dict)
    }

    /// The log's description of itself, as texts.
    #[getter]
    fn metadata<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        pairs(py, &self.log.header.described())
    }

    /// The scenario's file.
    #[getter]
    fn scenario_toml(&self) -> &str {
        &self.log.header.scenario_toml
    }

    /// Finished by its writer and without damage.
    #[getter]
    fn complete(&self) -> bool {
        self.log.complete
    }

    /// Damaged places that were skipped.
    #[getter]
    fn damaged(&self) -> u64 {
        self.log.damaged
    }

    /// The stretch that a picture shows closely, as `Run.window`, and the times at rest, as `Run.sticks`.
    #[allow(clippy::type_complexity, reason = "the parts of a picture")]
    fn pictured(&self, py: Python<'_>) -> PyResult<(Option<(f64, f64, String, bool)>, Table)> {
        let scenario = self.scenario(py)?;
        let found = py.detach(|| pictured(&self.log, &scenario.0));
        let found = found.map_err(|e| PyValueError::new_err(format!("{}: {e}", self.origin)))?;
        Ok((found.window.as_ref().map(window_parts), stick_table(&found.sticks)))
    }

    /// Feeds the recorded counts to the recorded law, to another scenario's, or to one written in Python: commands of the
    /// replay, ticks compared and ticks behind a gap, the first difference (tick, field, logged, replayed), and the drift of
    /// friction over load.
    #[pyo3(signature = (scenario=None, law=None))]
    #[allow(clippy::type_complexity, reason = "the parts of clutch.replay's object")]
    fn replay<'py>(
        &self,
        py: Python<'py>,
        scenario: Option<&Scenario>,
        law: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<(Table, (usize, usize), Option<(u64, String, f64, f64)>, Bound<'py, PyAny>)> {
        let scenario = match scenario {
            Some(other) => other.clone(),
            None => self.scenario(py)?,
        };
        let replayed = match law {
            None => py.detach(|| replay::replay(&self.log, &scenario.0, &unless_interrupted)),
            Some(law) => {
                let law = PythonLaw::new(law, &scenario)?;
                let replayed =
                    py.detach(|| replay::replay_law(&self.log, &scenario.0, &law, &unless_interrupted));
                if let Some(e) = law.failure() {
                    return Err(e);
                }
                replayed
            }
        };
        let failed = |e: replay::ReplayError| match PyErr::take(py) {
            Some(signal) => signal,
            None => PyValueError::new_err(format!("{}: {e}", self.origin)),
        };
        let replayed = replayed.map_err(failed)?;
        let drift =
            py.detach(|| replay::drift(&self.log, &scenario.0, &unless_interrupted)).map_err(failed)?;
        let first = replayed.first.as_ref().map(|d| (d.tick, d.field.clone(), d.logged, d.replayed));
        let terms = &self.log.header.term_names;
        Ok((
            made(py, || table(&replayed.commands, terms))?,
            (replayed.commands.len(), replayed.behind_gap),
            first,
            from_json(py, &drift.to_json())?,
        ))
    }
}
