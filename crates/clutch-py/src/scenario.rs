//! Checked scenarios, and the checks of single tables.

use crate::background::no_thread;
use crate::convert::{
    core_error, from_json, from_table, load_error, os_error, overrides, param_error, scenario_error, to_table,
};
use crate::path::Path;
use clutch_certificate::file::{self, FileError};
use clutch_cli::certify::{Asked, certificate, check_save};
use clutch_core::{BrakeGeometry, Friction, FrictionModel};
use clutch_sim::ScenarioError;
use clutch_sim::friction_lab::examine;
use clutch_sim::rig::Rig;
use clutch_sim::scenario::{BUILT_IN, CertificateError, check_section, override_keys};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use toml::{Table, Value};

/// A checked scenario, as the simulator takes it; `clutch.Scenario` is its public form.
#[pyclass(frozen, module = "clutch._clutch")]
#[derive(Clone)]
pub(crate) struct Scenario(pub(crate) Arc<clutch_sim::Scenario>);

impl Scenario {
    pub(crate) fn error(&self, py: Python<'_>, e: &ScenarioError) -> PyErr {
        scenario_error(py, e, Some(self.0.table()))
    }

    fn certificate_error(&self, py: Python<'_>, e: &anyhow::Error) -> PyErr {
        let text = e.to_string();
        match (e.downcast_ref::<ScenarioError>(), e.downcast_ref::<CertificateError>()) {
            (Some(e), _) => self.error(py, e),
            (_, Some(CertificateError::File(FileError::Io { name, error }))) => {
                os_error(py, name.as_ref(), &text, error)
            }
            _ => PyValueError::new_err(text),
        }
    }
}

#[pymethods]
impl Scenario {
    /// Checks the tables of a scenario.
    #[new]
    #[pyo3(signature = (tables, origin="Scenario"))]
    fn new(py: Python<'_>, tables: &Bound<'_, PyDict>, origin: &str) -> PyResult<Scenario> {
        let table = to_table(tables)?;
        match clutch_sim::Scenario::from_table(origin, table.clone(), &[]) {
            Ok(s) => Ok(Scenario(Arc::new(s))),
            Err(e) => Err(scenario_error(py, &e, Some(&table))),
        }
    }

    /// Reads a scenario from TOML; errors begin with `origin`.
    #[staticmethod]
    #[pyo3(signature = (origin, text, overrides=None))]
    fn parse(
        py: Python<'_>,
        origin: &str,
        text: &str,
        overrides: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Scenario> {
        let set = crate::convert::overrides(overrides)?;
        parse(py, origin, text, &set)
    }

    /// Reads a scenario from a file or, if there is none, the built-in one of that name.
    #[staticmethod]
    #[pyo3(signature = (name, overrides=None))]
    fn load(py: Python<'_>, name: PathBuf, overrides: Option<&Bound<'_, PyDict>>) -> PyResult<Scenario> {
        let set = self::overrides(overrides)?;
        let (origin, text) = clutch_sim::Scenario::text(&name).map_err(|e| load_error(py, &e))?;
        parse(py, &origin, &text, &set)
    }

    /// Every table with its defaults filled in.
    fn tables<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        from_table(py, self.0.table())
    }

    /// The scenario's file, defaults filled in.
    fn to_toml(&self) -> String {
        self.0.canonical()
    }

    /// The object that `clutch certify --json` prints; with a proof that is looked for, and written to a file, or with one
    /// that is read from a file.
    #[pyo3(signature = (sampled=false, save=None, check=None))]
    fn certificate<'py>(
        &self,
        py: Python<'py>,
        sampled: bool,
        save: Option<PathBuf>,
        check: Option<PathBuf>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let asked = match (sampled, &save, check) {
            (false, None, None) => Asked::Nothing,
            (true, _, None) => Asked::Search,
            (false, None, Some(file)) => Asked::Check(file),
            (false, Some(_), _) => {
                return Err(PyValueError::new_err(
                    "save: expected with sampled=True, which looks for a proof",
                ));
            }
            (true, _, Some(_)) => {
                return Err(PyValueError::new_err(
                    "check: expected without sampled=True: a proof is read from a file, or looked for",
                ));
            }
        };
        let scenario = self.0.clone();
        if asked == Asked::Nothing {
            let found = py.detach(|| certificate(&scenario, &asked));
            return from_json(py, &found.map_err(|e| self.certificate_error(py, &e))?.0);
        }
        save.as_ref().map_or(Ok(()), check_save).map_err(|e| self.certificate_error(py, &e))?;
        // A search takes up to minutes and does not stop half-way: Ctrl-C leaves it to itself, and what it finds is dropped.
        let work =
            std::thread::Builder::new().spawn(move || certificate(&scenario, &asked)).map_err(no_thread)?;
        while !work.is_finished() {
            py.detach(|| std::thread::sleep(Duration::from_millis(1)));
            py.check_signals()?;
        }
        let found = work.join().map_err(|_| PyRuntimeError::new_err("the search for a proof broke"))?;
        let (told, proof) = found.map_err(|e| self.certificate_error(py, &e))?;
        if let (Some(path), Some(proof)) = (&save, proof) {
            let written = file::write(path, &proof).map_err(CertificateError::from);
            written.map_err(|e| self.certificate_error(py, &e.into()))?;
        }
        from_json(py, &told)
    }

    /// The path, sampled.
    pub(crate) fn path(&self, py: Python<'_>) -> PyResult<Path> {
        Path::new(py, &self.0, |e| self.error(py, &self.0.run_error(&e.into())))
    }

    /// Slope, 1/s, and layer, rad/s, of the sliding surface of law or shell; none of a law without one, or of a path that cannot be
    /// followed.
    fn surface(&self) -> Option<(f64, f64)> {
        let certificate = self.0.plan().ok()?.certificate;
        (certificate.slope > 0.0).then_some((certificate.slope, certificate.layer))
    }

    /// The meaning of a dotted key, in a few words; none of one that is no parameter.
    fn meaning(&self, key: &str) -> Option<String> {
        Some(self.0.meaning(key)?.trim_end_matches('.').to_owned())
    }

    /// The number of ticks in a run.
    #[getter]
    fn ticks(&self) -> u64 {
        self.0.ticks()
    }

    /// Acceleration of the plant (1) at time, position, velocity and brake voltage, rad/s²;
    /// 0 at rest while friction holds.
    fn acceleration(
        &self,
        py: Python<'_>,
        time: f64,
        position: f64,
        velocity: f64,
        voltage: f64,
    ) -> PyResult<f64> {
        let spec = self.0.spec();
        let rig = Rig::new(&spec.rig, spec.run.seed).map_err(|e| core_error(py, &e))?;
        Ok(rig.acceleration(time, position, velocity, voltage))
    }
}

fn parse(py: Python<'_>, origin: &str, text: &str, set: &[(String, Value)]) -> PyResult<Scenario> {
    let table: Table = match text.parse() {
        Ok(table) => table,
        // The same text gives the error again, in the scenario's words.
        Err(_) => match clutch_sim::Scenario::parse(origin, text, &[]) {
            Ok(s) => return Ok(Scenario(Arc::new(s))),
            Err(e) => return Err(scenario_error(py, &e, None)),
        },
    };
    checked(py, origin, table, set)
}

/// A scenario of a table with keys overridden; errors carry the value as it is then.
pub(crate) fn checked(
    py: Python<'_>,
    origin: &str,
    mut table: Table,
    set: &[(String, Value)],
) -> PyResult<Scenario> {
    let whole = override_keys(origin, &mut table, set);
    let made = whole.and_then(|()| clutch_sim::Scenario::from_table(origin, table.clone(), &[]));
    made.map(|s| Scenario(Arc::new(s))).map_err(|e| scenario_error(py, &e, Some(&table)))
}

/// Checks one table by itself: `key` as `law.smc`, `name` its name in errors. Gives the table
/// back with its defaults filled in.
#[pyfunction]
pub(crate) fn check<'py>(
    py: Python<'py>,
    key: &str,
    name: &str,
    table: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyDict>> {
    let table = to_table(table)?;
    let checked = check_section(name, key, table.clone()).map_err(|e| {
        // In an object the tables around it have no name.
        let inner = e.key.strip_prefix(key).map_or(e.key.as_str(), |k| k.trim_start_matches('.'));
        let e = ScenarioError { key: inner.to_owned(), ..e.clone() };
        scenario_error(py, &e, Some(&table))
    })?;
    from_table(py, &checked)
}

/// Names of the built-in scenarios.
///
/// Examples
/// --------
/// >>> import clutch
/// >>> "smc_2" in clutch.scenarios()
/// True
#[pyfunction]
pub(crate) fn scenarios() -> Vec<&'static str> {
    BUILT_IN.iter().map(|b| b.name).collect()
}

/// The table of a built-in rig: `ideal`, `paper`, `bench`.
#[pyfunction]
pub(crate) fn rig<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyDict>> {
    let base = Table::from_iter([("base".to_owned(), Value::String(name.into()))]);
    let table = check_section("Rig", "rig", base).map_err(|e| scenario_error(py, &e, None))?;
    from_table(py, &table)
}

/// A number of a table; NaN, which no constructor takes, if it is not there.
fn number(table: &Bound<'_, PyDict>, key: &str) -> PyResult<f64> {
    table.get_item(key)?.map_or(Ok(f64::NAN), |v| v.extract())
}

/// Coefficients of the steady friction of a scenario's rig at some velocities, rad/s, with their signs.
#[pyfunction]
pub(crate) fn steady_friction<'py>(
    py: Python<'py>,
    scenario: &Scenario,
    velocity: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let friction = Friction::build(&scenario.0.params().rig.friction).map_err(|e| core_error(py, &e))?;
    let values = velocity.as_slice()?.iter().map(|v| friction.coefficient(*v)).collect();
    Ok(PyArray1::from_vec(py, values))
}

/// The experiments of the friction laboratory with the friction of a scenario's rig: by name, what was set and what was
/// found.
#[pyfunction]
pub(crate) fn friction_lab<'py>(py: Python<'py>, scenario: &Scenario) -> PyResult<Bound<'py, PyDict>> {
    let lab = py.detach(|| examine(&scenario.0.params().rig.friction));
    let lab = lab.map_err(|e| PyValueError::new_err(e.to_string()))?;
    let all = [
        ("steady", lab.steady),
        ("pre_sliding", lab.pre_sliding),
        ("lag", lab.lag),
        ("break_away", lab.break_away),
    ];
    let dict = PyDict::new(py);
    for (name, points) in all {
        let (set, found): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
        dict.set_item(name, (PyArray1::from_vec(py, set), PyArray1::from_vec(py, found)))?;
    }
    Ok(dict)
}

/// `K_COF` (18) of a brake's geometry, N m/V.
#[pyfunction]
pub(crate) fn brake_gain(py: Python<'_>, table: &Bound<'_, PyDict>) -> PyResult<f64> {
    let number = |key| number(table, key);
    let geometry = BrakeGeometry {
        inner_radius: number("inner_radius_m")?,
        torque_constant: number("torque_constant_nm_a")?,
        pad_area: number("pad_area_m2")?,
        lever_area: number("lever_area_m2")?,
        armature_resistance: number("armature_resistance_ohm")?,
        contact_radius: number("contact_radius_m")?,
    };
    geometry.brake_gain().map_err(|e| {
        let value = PyString::new(py, &e.value.to_string()).into_any();
        param_error(py, &e.to_string(), e.field(), value)
    })
}
