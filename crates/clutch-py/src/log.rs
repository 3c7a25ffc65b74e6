//! Logs: their channels as tables, and replay.

use crate::convert::{from_json, log_error, scenario_error};
use crate::scenario::Scenario;
use crate::stepping::PythonLaw;
use crate::table::{Column, Table, pairs};
use clutch_log::names::{Names, name_of};
use clutch_log::{InChannel, Kind, Limits, TIME, Value};
use clutch_loop::replay;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::iter;
use std::path::PathBuf;
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
    let read = py.detach(|| clutch_log::read(&path, &Limits::default()));
    let log = Arc::new(read.map_err(|e| log_error(py, &e))?);
    Ok(Log { log, origin: path.display().to_string() })
}

/// A column that grows by a record.
enum Growing {
    Whole(Vec<i64>),
    Real(Vec<f64>),
    Flag(Vec<bool>),
    Name(Names, Vec<&'static str>),
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
                all.push(u8::try_from(x).map_or("?", |x| name_of(names, x)));
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

/// The records of a channel: the time, and the channel's fields. `terms` name the last ones of commands.
fn table<R: InChannel>(records: &[R], terms: &[String]) -> Table {
    let mut columns: Vec<(String, Growing)> =
        R::CHANNEL.columns(terms).into_iter().map(|(name, kind)| (name, Growing::of(kind))).collect();
    for record in records {
        let mut values = record.values();
        columns.iter_mut().for_each(|(_, column)| column.push(values.next()));
    }
    let time = records.iter().map(|r| r.time_ns() as f64 / 1e9).collect::<Vec<f64>>();
    let columns = columns.into_iter().map(|(name, column)| (name, column.column()));
    Table::of(iter::once((TIME.to_owned(), Column::own(time))).chain(columns))
}

impl Log {
    fn tables(&self) -> Vec<(&'static str, Table)> {
        fn named<R: InChannel>(records: &[R], terms: &[String]) -> (&'static str, Table) {
            (R::CHANNEL.topic.trim_start_matches('/'), table(records, terms))
        }
        let log = &self.log;
        let terms = &log.header.term_names;
        vec![
            named(&log.samples, terms),
            named(&log.commands, terms),
            named(&log.events, terms),
            named(&log.links, terms),
            named(&log.changes, terms),
            named(&log.truths, terms),
        ]
    }
}

#[pymethods]
impl Log {
    /// Channels that have records, as tables.
    fn channels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (name, table) in py.detach(|| self.tables()) {
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
            None => {
                let origin = format!("{}: its scenario", self.origin);
                let read = clutch_sim::Scenario::parse(&origin, &self.log.header.scenario_toml, &[]);
                Scenario(Arc::new(read.map_err(|e| scenario_error(py, &e, None))?))
            }
        };
        let replayed = match law {
            None => py.detach(|| replay::replay(&self.log, &scenario.0)),
            Some(law) => {
                let law = PythonLaw::new(law, &scenario)?;
                let replayed = py.detach(|| replay::replay_law(&self.log, &scenario.0, &law));
                if let Some(e) = law.failure() {
                    return Err(e);
                }
                replayed
            }
        };
        let failed = |e: replay::ReplayError| PyValueError::new_err(format!("{}: {e}", self.origin));
        let replayed = replayed.map_err(failed)?;
        let drift = py.detach(|| replay::drift(&self.log, &scenario.0)).map_err(failed)?;
        let first = replayed.first.as_ref().map(|d| (d.tick, d.field.clone(), d.logged, d.replayed));
        let terms = &self.log.header.term_names;
        Ok((
            table(&replayed.commands, terms),
            replayed.commands.len(),
            first,
            from_json(py, &drift.to_json())?,
        ))
    }
}
