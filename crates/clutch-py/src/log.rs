//! Logs: their channels as tables, and replay.

use crate::convert::{from_json, log_error, scenario_error};
use crate::run::{go_on, stick_table, unless_interrupted, window_parts};
use crate::scenario::Scenario;
use crate::stepping::PythonLaw;
use crate::table::{Column, Table, pairs};
use clutch_core::params::Unit;
use clutch_log::names::{Names, name_of};
use clutch_log::{Field, InChannel, Kind, Limits, TIME, Value};
use clutch_loop::picture::pictured;
use clutch_loop::replay;
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::borrow::Cow;
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

/// A column that grows by a record.
enum Growing {
    Whole(Vec<i64>),
    Real(Vec<f64>),
    Flag(Vec<bool>),
    Name(Names, Vec<Cow<'static, str>>),
}

impl Growing {
    fn of(kind: Kind) -> Growing {
        match kind {
            Kind::Double => Growing::Real(Vec::new()),
            Kind::Bool => Growing::Flag(Vec::new()),
            Kind::Enum(_, names) => Growing::Name(names, Vec::new()),
            Kind::Uint32 | Kind::Uint64 | Kind::Sint32 | Kind::Sint64 | Kind::String => {
                Growing::Whole(Vec::new())
            }
        }
    }

    /// Appends a value; NaN for a term that the record does not have.
    fn push(&mut self, value: Option<Value>) {
        match (self, value) {
            (Growing::Name(names, all), Some(Value::Whole(x))) => {
                all.push(match u8::try_from(x).map_or("?", |x| name_of(names, x)) {
                    "?" => x.to_string().into(), // of a later version
                    name => name.into(),
                });
            }
            (Growing::Whole(all), Some(Value::Whole(x))) => all.push(x),
            (Growing::Flag(all), Some(Value::Flag(x))) => all.push(x),
            (Growing::Real(all), Some(Value::Real(x))) => all.push(x),
            (Growing::Real(all), _) => all.push(f64::NAN),
            (Growing::Name(_, _) | Growing::Whole(_) | Growing::Flag(_), _) => {
                unreachable!("a field's value is of its kind: both are made from one row")
            }
        }
    }

    fn column(self) -> Column {
        match self {
            Growing::Whole(all) => Column::own(all),
            Growing::Real(all) => Column::own(all),
            Growing::Flag(all) => Column::own(all),
            Growing::Name(_, all) => Column::text(all),
        }
    }
}

/// The records of a channel: the time, and the channel's fields. `terms` name the last ones of commands. Breaks when a
/// signal waits.
fn table<R: InChannel>(records: &[R], terms: &[String]) -> ControlFlow<(), Table> {
    let mut columns: Vec<(String, Growing)> =
        R::CHANNEL.columns(terms).into_iter().map(|(name, kind)| (name, Growing::of(kind))).collect();
    for (i, record) in records.iter().enumerate() {
        if i.is_multiple_of(ASK_EVERY) {
            go_on()?;
        }
        let mut values = record.values();
        columns.iter_mut().for_each(|(_, column)| column.push(values.next()));
    }
    let time = records.iter().map(|r| r.time_ns() as f64 / 1e9).collect::<Vec<f64>>();
    let columns = columns.into_iter().map(|(name, column)| (name, column.column()));
    let table = Table::of(iter::once((TIME.to_owned(), Column::own(time))).chain(columns));
    let meanings = R::CHANNEL.fields.iter().map(|f| (f.name, plain_meaning(f)));
    ControlFlow::Continue(
        table.meaning(iter::once((TIME, "time since the start of the run")).chain(meanings)),
    )
}

/// The words of a field without its unit, which stands last, and the full stop.
fn plain_meaning(field: &Field) -> &str {
    let words = field.meaning.trim_end_matches('.');
    let unit = Unit::of_key(field.name).map_or("", |unit| unit.text);
    words.strip_suffix(unit).and_then(|words| words.strip_suffix(", ")).unwrap_or(words)
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
        let read = clutch_sim::Scenario::parse(&origin, &self.log.header.scenario_toml, &[]);
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
        let h = &self.log.header;
        let mut all = vec![
            ("scenario".to_owned(), h.scenario_name.clone()),
            ("version".to_owned(), h.version.clone()),
            ("law_hash".to_owned(), format!("{:016x}", h.law_hash)),
            ("port".to_owned(), h.port.clone()),
            ("source".to_owned(), h.source.name().to_owned()),
            ("scalar".to_owned(), h.scalar.clone()),
            ("period_us".to_owned(), h.period_us.to_string()),
            ("started_unix_ns".to_owned(), h.started_unix_ns.to_string()),
        ];
        all.extend(h.extra.iter().cloned());
        pairs(py, &all)
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
    /// replay, ticks, the first difference (tick, field, logged, replayed), and the drift of friction over load.
    #[pyo3(signature = (scenario=None, law=None))]
    #[allow(clippy::type_complexity, reason = "the parts of clutch.replay's object")]
    fn replay<'py>(
        &self,
        py: Python<'py>,
        scenario: Option<&Scenario>,
        law: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<(Table, usize, Option<(u64, String, f64, f64)>, Bound<'py, PyAny>)> {
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
            replayed.commands.len(),
            first,
            from_json(py, &drift.to_json())?,
        ))
    }
}
