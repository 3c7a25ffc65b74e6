//! Many rigs with their laws, stepped in one call: what a vector of environments is made of.

use crate::path::{Path, Target};
use crate::scenario::Scenario;
use crate::stepping::{Plant, Servo, native};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray1};
use pyo3::exceptions::{PyIndexError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::prelude::*;

/// Shafts for each thread, at least: a step takes microseconds, and a thread that wakes up does, too.
const TOGETHER: usize = 16;

/// A rig, the scenario's own law beside it, and the path.
struct Shaft {
    plant: Plant,
    servo: Servo,
    path: Path,
    tick: usize,
    /// Its numbers in the array now.
    told: [f64; Shaft::QUANTITIES.len()],
}

impl Shaft {
    const QUANTITIES: [&'static str; 13] = [
        "time_s",
        "position_rad",
        "velocity_rad_s",
        "counts",
        "stuck",
        "sticks",
        "voltage_v",
        "measured_error_rad",
        "error_rate_rad_s",
        "target_counts",
        "target_velocity_rad_s",
        "target_acceleration_rad_s2",
        "law_voltage_v",
    ];

    fn new(py: Python<'_>, scenario: &Scenario) -> PyResult<Shaft> {
        let given = Bound::new(py, scenario.clone())?;
        let mut shaft = Shaft {
            plant: Plant::new(py, &given)?,
            servo: Servo::new(py, &given)?,
            path: scenario.path(py)?,
            tick: 0,
            told: [0.0; Shaft::QUANTITIES.len()],
        };
        shaft.look();
        Ok(shaft)
    }

    /// The scenario's law sees the sample; what it sees and answers is noted.
    fn look(&mut self) {
        let Some(target) = self.path.target(self.tick).map(Target) else { return };
        let law = self.servo.answer(self.plant.seen(), &target);
        let target = [target.position_counts(), target.0.velocity, target.0.acceleration];
        let told = self.plant.told().into_iter().chain(self.servo.seen()).chain(target).chain([law]);
        self.told.iter_mut().zip(told).for_each(|(place, value)| *place = value);
    }

    fn step(&mut self, volts: f64) -> Result<(), String> {
        self.plant.advance(volts).map_err(|e| e.to_string())?;
        self.tick += 1;
        self.look();
        Ok(())
    }
}

/// Rigs with their laws, which agents step together.
///
/// A period of all takes one call, on all processors and without Python's lock.
#[pyclass(module = "clutch._clutch")]
pub(crate) struct Shafts(Vec<Shaft>);

#[pymethods]
impl Shafts {
    #[new]
    fn new(py: Python<'_>, scenarios: Vec<Bound<'_, PyAny>>) -> PyResult<Shafts> {
        let shafts = scenarios.iter().map(|s| Shaft::new(py, &native(s)?)).collect::<PyResult<_>>()?;
        Ok(Shafts(shafts))
    }

    /// Names of the rows of what is seen.
    #[classattr]
    const QUANTITIES: [&'static str; Shaft::QUANTITIES.len()] = Shaft::QUANTITIES;

    /// Begins one of them anew.
    fn reset(&mut self, py: Python<'_>, index: usize, scenario: &Bound<'_, PyAny>) -> PyResult<()> {
        let n = self.0.len();
        let Some(place) = self.0.get_mut(index) else {
            return Err(PyIndexError::new_err(format!("index = {index}: expected one below {n}")));
        };
        *place = Shaft::new(py, &native(scenario)?)?;
        Ok(())
    }

    /// A row for each quantity, a column for each shaft.
    fn seen<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let shape = (Shaft::QUANTITIES.len(), self.0.len());
        Array2::from_shape_fn(shape, |(row, column)| self.0[column].told[row]).into_pyarray(py)
    }

    /// A period of those shafts that are chosen, each under its voltage, V; then as `seen`.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        volts: PyReadonlyArray1<'_, f64>,
        chosen: PyReadonlyArray1<'_, bool>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (volts, chosen) = (volts.as_slice()?, chosen.as_slice()?);
        let n = self.0.len();
        if volts.len() != n || chosen.len() != n {
            return Err(PyValueError::new_err(format!(
                "{} voltages for {} choices: expected {n} of each",
                volts.len(),
                chosen.len()
            )));
        }
        if let Some(wrong) = volts.iter().zip(chosen).find_map(|(v, c)| (*c && !v.is_finite()).then_some(v)) {
            return Err(PyValueError::new_err(format!("voltage = {wrong}: expected a finite voltage, V")));
        }
        let stepped = py.detach(|| {
            let step = |((shaft, volts), chosen): ((&mut Shaft, &f64), &bool)| {
                if *chosen { shaft.step(*volts) } else { Ok(()) }
            };
            if n <= TOGETHER {
                return self.0.iter_mut().zip(volts).zip(chosen).try_for_each(step);
            }
            self.0.par_iter_mut().zip(volts).zip(chosen).with_min_len(TOGETHER).try_for_each(step)
        });
        stepped.map_err(PyRuntimeError::new_err)?;
        Ok(self.seen(py))
    }
}
