//! Logs: their channels as tables, and replay.

use crate::convert::{log_error, scenario_error};
use crate::scenario::Scenario;
use crate::table::{Column, Table, pairs};
use clutch_log::names::{ARRIVALS, CAUSES, COMMAND_SOURCES, EVENT_KINDS, LIMITS, Names, STATES, name_of};
use clutch_log::{CommandRecord, Limits};
use clutch_loop::replay;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
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

/// Columns of records: numbers by a function each, small numbers by their names.
struct Columns<'a, R>(&'a [R], Vec<(String, Column)>);

impl<'a, R> Columns<'a, R> {
    fn new(records: &'a [R], time_ns: impl Fn(&R) -> u64, tick: impl Fn(&R) -> u64) -> Self {
        let mut c = Columns(records, Vec::new());
        c.real("time_s", |r| time_ns(r) as f64 / 1e9);
        c.whole("tick", |r| tick(r) as i64);
        c
    }

    fn real(&mut self, name: &str, f: impl Fn(&R) -> f64) -> &mut Self {
        self.1.push((name.into(), Column::own(self.0.iter().map(f).collect::<Vec<f64>>())));
        self
    }

    fn whole(&mut self, name: &str, f: impl Fn(&R) -> i64) -> &mut Self {
        self.1.push((name.into(), Column::own(self.0.iter().map(f).collect::<Vec<i64>>())));
        self
    }

    fn flag(&mut self, name: &str, f: impl Fn(&R) -> bool) -> &mut Self {
        self.1.push((name.into(), Column::own(self.0.iter().map(f).collect::<Vec<bool>>())));
        self
    }

    fn name(&mut self, name: &str, names: Names, f: impl Fn(&R) -> u8) -> &mut Self {
        self.1.push((name.into(), Column::text(self.0.iter().map(|r| name_of(names, f(r))))));
        self
    }

    fn table(self) -> Table {
        Table::of(self.1)
    }
}

fn commands(records: &[CommandRecord], terms: &[String]) -> Table {
    let mut c = Columns::new(records, |r| r.time_ns, |r| r.tick);
    c.name("state", STATES, |r| r.state)
        .name("source", COMMAND_SOURCES, |r| r.source)
        .name("limit", LIMITS, |r| r.limit)
        .whole("code", |r| r.code.into())
        .real("voltage_v", |r| r.voltage)
        .real("demand_v", |r| r.demand)
        .whole("target_counts_x65536", |r| r.target_fixed)
        .real("target_position_rad", |r| r.target_position)
        .real("target_velocity_rad_s", |r| r.target_velocity)
        .real("target_acceleration_rad_s2", |r| r.target_acceleration)
        .real("error_rad", |r| r.error)
        .real("error_rate_rad_s", |r| r.error_rate);
    for (i, term) in terms.iter().enumerate() {
        // As the log's own schema does it, where a law calls a term like a field.
        let taken = c.1.iter().any(|(n, _)| n == term);
        let name = if taken { format!("{term}_{i}") } else { term.clone() };
        c.real(&name, |r| r.terms.get(i).copied().unwrap_or(f64::NAN));
    }
    c.table()
}

impl Log {
    fn tables(&self) -> Vec<(&'static str, Table)> {
        let log = &self.log;
        let mut sample = Columns::new(&log.samples, |r| r.time_ns, |r| r.tick);
        sample
            .name("arrival", ARRIVALS, |r| r.arrival)
            .whole("sequence", |r| r.sequence.into())
            .whole("board_time_us", |r| r.board_time_us.into())
            .whole("counts", |r| r.counts.into())
            .whole("status", |r| r.status.into())
            .whole("age_us", |r| r.age_us.into())
            .whole("lateness_us", |r| r.lateness_us.into())
            .flag("superseded", |r| r.superseded);
        let mut event = Columns::new(&log.events, |r| r.time_ns, |r| r.tick);
        event
            .name("kind", EVENT_KINDS, |r| r.kind)
            .name("from_state", STATES, |r| r.from)
            .name("to_state", STATES, |r| r.to)
            .name("cause", CAUSES, |r| r.cause)
            .real("value", |r| r.value);
        let mut link = Columns::new(&log.links, |r| r.time_ns, |r| r.tick);
        link.whole("received", |r| r.received as i64)
            .whole("lost", |r| r.lost as i64)
            .whole("late", |r| r.late as i64)
            .whole("duplicated", |r| r.duplicated as i64)
            .whole("reordered", |r| r.reordered as i64)
            .whole("rejected_frames", |r| r.rejected_frames as i64)
            .whole("rejected_samples", |r| r.rejected_samples as i64)
            .whole("deadline_misses", |r| r.deadline_misses as i64)
            .whole("log_dropped", |r| r.log_dropped as i64);
        let mut truth = Columns::new(&log.truths, |r| r.time_ns, |r| r.tick);
        truth
            .real("position_rad", |r| r.position)
            .real("velocity_rad_s", |r| r.velocity)
            .flag("stuck", |r| r.stuck);
        vec![
            ("sample", sample.table()),
            ("command", commands(&log.commands, &log.header.term_names)),
            ("event", event.table()),
            ("link", link.table()),
            ("truth", truth.table()),
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

    /// Feeds the recorded counts to the recorded law, or to another scenario's: commands of the
    /// replay, ticks, and the first difference (tick, field, logged, replayed).
    #[pyo3(signature = (scenario=None))]
    #[allow(clippy::type_complexity, reason = "the parts of clutch.replay's object")]
    fn replay(
        &self,
        py: Python<'_>,
        scenario: Option<&Scenario>,
    ) -> PyResult<(Table, usize, Option<(u64, String, f64, f64)>)> {
        let scenario = match scenario {
            Some(other) => other.clone(),
            None => {
                let origin = format!("{}: its scenario", self.origin);
                let read = clutch_sim::Scenario::parse(&origin, &self.log.header.scenario_toml, &[]);
                Scenario(Arc::new(read.map_err(|e| scenario_error(py, &e, None))?))
            }
        };
        let replayed = py.detach(|| replay::replay(&self.log, &scenario.0));
        let replayed = replayed.map_err(|e| PyValueError::new_err(format!("{}: {e}", self.origin)))?;
        let first = replayed.first.as_ref().map(|d| (d.tick, d.field.clone(), d.logged, d.replayed));
        let terms = &self.log.header.term_names;
        Ok((commands(&replayed.commands, terms), replayed.commands.len(), first))
    }
}
