//! Many rigs of one scenario with its law, stepped in one call: what environments are made of.

use crate::scenario::Scenario;
use crate::stepping::native;
use clutch_sim::Fleet;
use numpy::ndarray::{Array2, ShapeError};
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray1};
use pyo3::exceptions::{PyIndexError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

/// Rigs with their laws, which agents step together.
///
/// A period of all takes one call, in the lanes of vectors, on all processors and without Python's lock.
#[pyclass(module = "clutch._clutch")]
pub(crate) struct Shafts {
    scenario: Scenario,
    fleet: Fleet,
}

#[pymethods]
impl Shafts {
    /// A shaft for each seed, which takes the place of the scenario's.
    #[new]
    fn new(py: Python<'_>, scenario: &Bound<'_, PyAny>, seeds: Vec<u64>) -> PyResult<Shafts> {
        let scenario = native(scenario)?;
        let made = py.detach(|| Fleet::new(&scenario.0, &seeds));
        let fleet = made.map_err(|e| scenario.error(py, &e))?;
        Ok(Shafts { scenario, fleet })
    }

    /// Names of the rows of what is seen.
    #[classattr]
    const QUANTITIES: [&'static str; Fleet::QUANTITIES.len()] = Fleet::QUANTITIES;

    /// One of them begins anew with the next step, which does not move it.
    fn reset(&mut self, py: Python<'_>, index: usize, seed: u64) -> PyResult<()> {
        let n = self.fleet.len();
        if index >= n {
            return Err(PyIndexError::new_err(format!("index = {index}: expected one below {n}")));
        }
        self.fleet.reset(index, seed).map_err(|e| self.scenario.error(py, &e))
    }

    /// A row for each quantity, a column for each shaft.
    fn seen<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let shape = (Fleet::QUANTITIES.len(), self.fleet.len());
        let mut numbers = Vec::with_capacity(shape.0 * shape.1);
        (0..shape.0).for_each(|quantity| self.fleet.tell(quantity, &mut numbers));
        let array = Array2::from_shape_vec(shape, numbers);
        Ok(array.map_err(|e: ShapeError| PyRuntimeError::new_err(e.to_string()))?.into_pyarray(py))
    }

    /// A period of each shaft under its voltage, V; then as `seen`.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        volts: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (volts, n) = (volts.as_slice()?, self.fleet.len());
        if volts.len() != n {
            return Err(PyValueError::new_err(format!("{} voltages: expected {n}", volts.len())));
        }
        if let Some(wrong) = volts.iter().find(|v| !v.is_finite()) {
            return Err(PyValueError::new_err(format!("voltage = {wrong}: expected a finite voltage, V")));
        }
        let stepped = py.detach(|| self.fleet.step(volts));
        stepped.map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
        self.seen(py)
    }
}
