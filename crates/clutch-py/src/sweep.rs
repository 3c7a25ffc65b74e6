//! Sweeps in the background, on all cores.

use crate::convert::{scenario_error, to_toml};
use crate::run::sample_columns;
use crate::stepping::native;
use crate::table::{Column, Table};
use clutch_sim::metrics::figure_columns;
use clutch_sim::scenario::CERTIFIED;
use clutch_sim::{Keep, ScenarioError, sweep};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A figure that was asked for.
#[derive(Clone, Copy)]
enum Asked {
    Certified,
    /// Its place among all figures.
    Figure(usize),
}

impl Asked {
    /// The figure of that name; none if there is none.
    fn named(name: &str) -> Option<Asked> {
        if name == CERTIFIED {
            return Some(Asked::Certified);
        }
        let place = figure_columns(&Default::default(), &Default::default()).position(|(n, _)| n == name);
        place.map(Asked::Figure)
    }
}

/// The result of a row.
struct Row {
    metrics: Vec<f64>,
    error: Option<ScenarioError>,
    trace: Option<Table>,
}

/// The state that the threads of a sweep share with Python.
struct Shared {
    rows: Mutex<BTreeMap<usize, Row>>,
    finished: AtomicUsize,
    /// Lowest row that was refused; `usize::MAX` = none.
    refused: AtomicUsize,
    stop: AtomicBool,
    ended: Mutex<bool>,
    bell: Condvar,
    /// The message of a thread that panicked.
    broke: Mutex<Option<String>>,
}

/// Reports the end of a sweep, however it came.
struct AtEnd(Arc<Shared>);

impl Drop for AtEnd {
    fn drop(&mut self) {
        *locked(&self.0.ended) = true;
        self.0.bell.notify_all();
    }
}

/// A thread that panicked has left whole rows or none.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A sweep that runs in threads of its own; `clutch.sweep` is its public form.
#[pyclass(frozen, module = "clutch._clutch")]
pub(crate) struct Sweep {
    sweep: Arc<sweep::Sweep>,
    metrics: Vec<(String, Asked)>,
    traces: Vec<String>,
    every: usize,
    threads: usize,
    shared: Arc<Shared>,
    started: AtomicBool,
}

#[pymethods]
impl Sweep {
    /// `rows` of values for the dotted `keys`, over a scenario. `instructions` are those of the lanes, for comparisons;
    /// else the widest that the processor has.
    #[new]
    #[pyo3(signature = (scenario, keys, rows, metrics, traces=Vec::new(), every=1, threads=None, instructions=None))]
    #[expect(clippy::too_many_arguments, reason = "Python names them")]
    fn new(
        scenario: &Bound<'_, PyAny>,
        keys: Vec<String>,
        rows: &Bound<'_, PyList>,
        metrics: Vec<String>,
        traces: Vec<String>,
        every: usize,
        threads: Option<usize>,
        instructions: Option<&str>,
    ) -> PyResult<Sweep> {
        let scenario = native(scenario)?;
        let rows = rows
            .iter()
            .map(|row| row.try_iter()?.map(|v| to_toml(&v?)).collect::<PyResult<Vec<_>>>())
            .collect::<PyResult<Vec<_>>>()?;
        let metrics = metrics.into_iter().map(|name| match Asked::named(&name) {
            Some(asked) => Ok((name, asked)),
            None => {
                let known: Vec<&str> =
                    figure_columns(&Default::default(), &Default::default()).map(|(name, _)| name).collect();
                let text = format!("metrics: \"{name}\": expected {CERTIFIED}, {}", known.join(", "));
                Err(PyValueError::new_err(text))
            }
        });
        let metrics = metrics.collect::<PyResult<_>>()?;
        if every == 0 {
            return Err(PyValueError::new_err("every = 0: expected at least 1 sample"));
        }
        if threads == Some(0) {
            return Err(PyValueError::new_err("threads = 0: expected at least 1"));
        }
        let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let refused = |e: &dyn std::error::Error| PyValueError::new_err(e.to_string());
        let sweep = sweep::Sweep::of("sweep", &scenario.0, keys, rows).map_err(|e| refused(&e))?;
        let sweep = match instructions {
            Some(asked) => sweep.in_lanes_of(asked).map_err(|e| refused(&e))?,
            None => sweep,
        };
        Ok(Sweep {
            sweep: Arc::new(sweep),
            metrics,
            traces,
            every,
            threads: threads.unwrap_or(cores),
            shared: Arc::new(Shared {
                rows: Mutex::default(),
                finished: AtomicUsize::new(0),
                refused: AtomicUsize::new(usize::MAX),
                stop: AtomicBool::new(false),
                ended: Mutex::new(false),
                bell: Condvar::new(),
                broke: Mutex::default(),
            }),
            started: AtomicBool::new(false),
        })
    }

    /// Starts the threads; once only.
    fn start(&self) -> PyResult<()> {
        if self.started.swap(true, Ordering::SeqCst) {
            return Err(PyRuntimeError::new_err("the sweep has been started already"));
        }
        let (sweep, shared) = (self.sweep.clone(), self.shared.clone());
        let metrics: Vec<Asked> = self.metrics.iter().map(|(_, asked)| *asked).collect();
        let (traces, every) = (self.traces.clone(), self.every);
        let threads = self.threads;
        let keep = if traces.is_empty() { Keep::Figures } else { Keep::Trace };
        let work = move || {
            let _told = AtEnd(shared.clone());
            let done = |i: usize, outcome: Result<sweep::Row, ScenarioError>| {
                let row = row(outcome, &metrics, &traces, every);
                if row.error.is_some() {
                    shared.refused.fetch_min(i, Ordering::SeqCst);
                }
                locked(&shared.rows).insert(i, row);
                shared.finished.fetch_add(1, Ordering::SeqCst);
            };
            let run = AssertUnwindSafe(|| sweep.run(threads, keep, &shared.stop, &done));
            if let Err(panic) = catch_unwind(run) {
                let said = panic.downcast_ref::<String>().cloned();
                let said = said.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()));
                *locked(&shared.broke) = Some(said.unwrap_or_default());
            }
        };
        let spawned = std::thread::Builder::new().name("clutch-sweep".into()).spawn(work);
        spawned.map(drop).map_err(|e| PyRuntimeError::new_err(format!("no thread for the sweep: {e}")))
    }

    /// Rows that are done.
    #[getter]
    fn finished(&self) -> usize {
        self.shared.finished.load(Ordering::SeqCst)
    }

    /// The lowest row so far that the scenario refused.
    #[getter]
    fn refused(&self) -> Option<usize> {
        Some(self.shared.refused.load(Ordering::SeqCst)).filter(|i| *i != usize::MAX)
    }

    /// Rows in all.
    #[getter]
    fn total(&self) -> usize {
        self.sweep.len()
    }

    /// Waits at most `seconds`; true if the sweep has ended.
    fn wait(&self, py: Python<'_>, seconds: f64) -> PyResult<bool> {
        if seconds.is_nan() || seconds < 0.0 {
            return Err(PyValueError::new_err(format!("seconds = {seconds}: expected at least 0")));
        }
        // A time beyond the range of Duration is for ever.
        let time = Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
        Ok(py.detach(|| {
            let ended = locked(&self.shared.ended);
            let waited = self.shared.bell.wait_timeout_while(ended, time, |ended| !*ended);
            *waited.unwrap_or_else(PoisonError::into_inner).0
        }))
    }

    /// Ends the sweep: runs under way stop within milliseconds and leave nothing.
    fn cancel(&self) {
        self.shared.stop.store(true, Ordering::SeqCst);
    }

    /// Finished rows: a table (run, each metric, error), traces by row, and for each refused row its error.
    #[allow(clippy::type_complexity, reason = "the parts of clutch.sweep's object")]
    fn result<'py>(&self, py: Python<'py>) -> PyResult<(Table, Bound<'py, PyDict>, Vec<(usize, Py<PyAny>)>)> {
        if let Some(said) = locked(&self.shared.broke).clone() {
            return Err(PyRuntimeError::new_err(format!("a thread of the sweep broke: {said}")));
        }
        let mut columns = Vec::new();
        let mut kept = Vec::new();
        let mut refused = Vec::new();
        {
            // No Python while the lock is held: its threads wait for this one.
            let mut rows = locked(&self.shared.rows);
            let row: Vec<i64> = rows.keys().map(|i| *i as i64).collect();
            columns.push(("row".to_owned(), Column::own(row)));
            for (m, (name, asked)) in self.metrics.iter().enumerate() {
                let values = rows.values().map(|r| r.metrics[m]);
                let column = match asked {
                    Asked::Certified => Column::own(values.map(|x| x > 0.0).collect::<Vec<bool>>()),
                    Asked::Figure(_) => Column::own(values.collect::<Vec<f64>>()),
                };
                columns.push((name.clone(), column));
            }
            let text = |r: &Row| r.error.as_ref().map_or(String::new(), ToString::to_string);
            columns.push(("error".to_owned(), Column::text(rows.values().map(text))));
            for (i, row) in rows.iter_mut() {
                kept.extend(row.trace.take().map(|trace| (*i, trace)));
                refused.extend(row.error.clone().map(|e| (*i, e)));
            }
        }
        let traces = PyDict::new(py);
        for (i, trace) in kept {
            traces.set_item(i, Bound::new(py, trace)?)?;
        }
        let error = |(i, e)| (i, scenario_error(py, &e, None).into_value(py).into_any());
        Ok((Table::of(columns), traces, refused.into_iter().map(error).collect()))
    }
}

fn row(
    outcome: Result<sweep::Row, ScenarioError>,
    metrics: &[Asked],
    traces: &[String],
    every: usize,
) -> Row {
    match outcome {
        Ok(sweep::Row { certified, run }) => {
            let value = |asked: &Asked| match asked {
                Asked::Certified => f64::from(u8::from(certified)),
                Asked::Figure(place) => {
                    let figure = figure_columns(&run.metrics, &run.detected).nth(*place);
                    figure.and_then(|(_, x)| x).unwrap_or(f64::NAN)
                }
            };
            let metrics = metrics.iter().map(value).collect();
            let trace = (!traces.is_empty()).then(|| {
                let columns = sample_columns(&Arc::new(run));
                let wanted = columns.into_iter().filter(|(n, _)| traces.contains(n));
                // A copy, so that the other columns go.
                Table::of(wanted.map(|(n, c)| (n, c.every(every))))
            });
            Row { metrics, error: None, trace }
        }
        Err(e) => {
            let nothing = |asked: &Asked| match asked {
                Asked::Certified => 0.0,
                Asked::Figure(_) => f64::NAN,
            };
            Row { metrics: metrics.iter().map(nothing).collect(), error: Some(e), trace: None }
        }
    }
}
