//! The path of a scenario, and its targets.

use crate::convert::core_error;
use crate::table::{Column, Table};
use clutch_core::{Encoder, FixedCounts, ParamError};
use clutch_sim::scenario::ScalarKind;
use pyo3::exceptions::{PyIndexError, PyMemoryError, PyValueError};
use pyo3::prelude::*;

pub(crate) fn fixed_to_counts(position: FixedCounts) -> f64 {
    position.minus::<f64>(FixedCounts(0))
}

/// A point of a path: the law's target at one tick.
///
/// Parameters
/// ----------
/// position_counts : float
///     Target position, encoder counts from the encoder's zero; kept to 2⁻¹⁶ counts.
/// velocity_rad_s : float
///     Target velocity, rad/s.
/// acceleration_rad_s2 : float
///     Target acceleration, rad/s².
///
/// Examples
/// --------
/// >>> import clutch
/// >>> clutch.Target(12.5, 0.035)
/// Target(12.5, 0.035, 0.0)
#[pyclass(frozen, module = "clutch", eq)]
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Target(pub(crate) clutch_core::Target<f64>);

#[pymethods]
impl Target {
    #[new]
    #[pyo3(signature = (position_counts, velocity_rad_s=0.0, acceleration_rad_s2=0.0))]
    fn new(position_counts: f64, velocity_rad_s: f64, acceleration_rad_s2: f64) -> PyResult<Target> {
        let named = [
            ("position_counts", position_counts),
            ("velocity_rad_s", velocity_rad_s),
            ("acceleration_rad_s2", acceleration_rad_s2),
        ];
        if let Some((name, value)) = named.iter().find(|(_, x)| !x.is_finite() || x.abs() >= 1e12) {
            return Err(PyValueError::new_err(format!(
                "{name} = {value}: expected a finite number below 1e12"
            )));
        }
        Ok(Target(clutch_core::Target {
            position: FixedCounts::from_real(position_counts),
            velocity: velocity_rad_s,
            acceleration: acceleration_rad_s2,
        }))
    }

    /// Target position, counts.
    #[getter]
    fn position_counts(&self) -> f64 {
        fixed_to_counts(self.0.position)
    }

    /// Target velocity, rad/s.
    #[getter]
    fn velocity_rad_s(&self) -> f64 {
        self.0.velocity
    }

    /// Target acceleration, rad/s².
    #[getter]
    fn acceleration_rad_s2(&self) -> f64 {
        self.0.acceleration
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyAny>, (f64, f64, f64)) {
        let t = slf.get();
        (slf.get_type().into_any(), (t.position_counts(), t.0.velocity, t.0.acceleration))
    }

    fn __repr__(&self) -> String {
        format!("Target({:?}, {:?}, {:?})", self.position_counts(), self.0.velocity, self.0.acceleration)
    }
}

/// A scenario's path, sampled at its period.
///
/// Examples
/// --------
/// >>> import clutch
/// >>> path = clutch.Scenario.load("minimum_jerk").path()
/// >>> path.at(0).velocity_rad_s
/// 0.0
/// >>> len(path) == len(path.table())
/// True
#[pyclass(frozen, module = "clutch")]
pub(crate) struct Path {
    targets: Vec<clutch_core::Target<f64>>,
    period: f64,
    radians_per_count: f64,
}

impl Path {
    /// `wrong` is the package's exception for a path that the scenario's parameters do not make.
    pub(crate) fn new(
        py: Python<'_>,
        scenario: &clutch_sim::Scenario,
        wrong: impl Fn(ParamError) -> PyErr,
    ) -> PyResult<Path> {
        let spec = scenario.spec();
        let encoder =
            Encoder::new::<f64>(spec.rig.encoder.sensor.counts_per_rev).map_err(|e| core_error(py, &e))?;
        let ticks = scenario.ticks();
        let mut targets = Vec::new();
        let room = usize::try_from(ticks).is_ok_and(|n| targets.try_reserve_exact(n).is_ok());
        if !room {
            return Err(PyMemoryError::new_err(format!("no memory for a path of {ticks} targets")));
        }
        match scenario.scalar() {
            ScalarKind::F32 => {
                let path = spec.path::<f32>().map_err(&wrong)?;
                targets.extend((0..ticks).map(|k| path.at(k).cast::<f64>()));
            }
            ScalarKind::F64 => {
                let path = spec.path::<f64>().map_err(&wrong)?;
                targets.extend((0..ticks).map(|k| path.at(k)));
            }
        }
        Ok(Path { targets, period: spec.period.seconds(), radians_per_count: encoder.radians_per_count() })
    }
}

#[pymethods]
impl Path {
    /// The target at a tick of the run, from 0.
    fn at(&self, tick: i64) -> PyResult<Target> {
        let n = self.targets.len();
        let target = usize::try_from(tick).ok().and_then(|tick| self.targets.get(tick));
        target.map(|t| Target(*t)).ok_or_else(|| {
            PyIndexError::new_err(format!("tick {tick}: expected one of the run's, 0 to {}", n - 1))
        })
    }

    fn __len__(&self) -> usize {
        self.targets.len()
    }

    /// Columns time_s, position_rad, velocity_rad_s, acceleration_rad_s2.
    fn table(&self) -> Table {
        let of = |f: &dyn Fn(&clutch_core::Target<f64>) -> f64| {
            Column::own(self.targets.iter().map(f).collect::<Vec<f64>>())
        };
        let time: Vec<f64> = (0..self.targets.len()).map(|k| k as f64 * self.period).collect();
        Table::of([
            ("time_s", Column::own(time)),
            ("position_rad", of(&|t| fixed_to_counts(t.position) * self.radians_per_count)),
            ("velocity_rad_s", of(&|t| t.velocity)),
            ("acceleration_rad_s2", of(&|t| t.acceleration)),
        ])
    }

    fn __repr__(&self) -> String {
        format!("Path({} ticks of {} s)", self.targets.len(), self.period)
    }
}
