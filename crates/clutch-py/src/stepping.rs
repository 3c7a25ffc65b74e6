//! Law and plant stepped by the user, and laws written in Python.

use crate::convert::core_error;
use crate::path::{Target, fixed_to_counts};
use crate::scenario::Scenario;
use crate::table::{Column, Table};
use clutch_core::law::{
    Command, ControlLaw, Law, LawState, LawTerms, Limit, Output, OutputState, Seen, Terms,
};
use clutch_core::{
    Counts, Dac, Encoder, FixedCounts, FrictionMap, ParamError, Real, ServoOutput, ServoState,
    StickSlipParams, StickSlipState, law, off_map,
};
use clutch_sim::MovingRig;
use clutch_sim::engine::{EngineError, Event, EventKind, Motion};
use clutch_sim::friction_map::MapGrid;
use clutch_sim::scenario::ScalarKind;
use pyo3::exceptions::{PyAttributeError, PyOverflowError, PyRuntimeError, PyTypeError, PyValueError};
use pyo3::ffi::PyLong_AsLongAndOverflow;
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFloat, PyInt};
use std::sync::{Arc, Mutex};

type State<T> = ServoState<T, LawState<T>>;

/// A servo in one scalar, with its state.
#[derive(Clone)]
struct Running<T: Real> {
    servo: clutch_core::Servo<T>,
    state: State<T>,
    last: ServoOutput<T, LawTerms<T>>,
}

#[derive(Clone)]
#[allow(
    clippy::large_enum_variant,
    reason = "one lives in each servo; a box would cost each step a cache line"
)]
enum Scalar {
    F32(Running<f32>),
    F64(Running<f64>),
}

/// The law of a scenario with its state, sampled by you: counts and target in, volts out.
///
/// It is the servo that the simulator, the loop and the boards run, bit for bit. It begins as
/// `clutch.simulate` does.
///
/// Parameters
/// ----------
/// scenario : Scenario
///     Law, gains, sampling, encoder, converter; its scalar, f32 or f64.
///
/// Examples
/// --------
/// The loop of `clutch.simulate`, by hand:
///
/// >>> import clutch
/// >>> scenario = clutch.Scenario.load("smc_2").override({"run.duration_s": 2.0})
/// >>> servo, plant, path = clutch.Servo(scenario), clutch.Plant(scenario), scenario.path()
/// >>> volts = []
/// >>> for tick in range(len(path)):
/// ...     volts.append(servo.step(plant.counts, path.at(tick)))
/// ...     counts = plant.step(volts[-1])
/// >>> volts == clutch.simulate(scenario).samples["voltage_v"].tolist()
/// True
#[pyclass(module = "clutch")]
#[derive(Clone)]
pub(crate) struct Servo {
    running: Scalar,
    /// Counts are fractions where the rig's sensor is ideal.
    whole: bool,
    /// The converter rounds; else the law's own voltage goes out.
    rounds: bool,
    dac: Dac<f64>,
    map: Option<Arc<MapGrid>>,
}

fn begin<T: Real>(py: Python<'_>, scenario: &Scenario) -> PyResult<Running<T>> {
    let spec = scenario.0.spec();
    let wrong = |e: &ParamError| core_error(py, e);
    let params = spec.servo().map_err(|e| wrong(&e))?.cast::<T>();
    let servo = clutch_core::Servo::<T>::new(&params).map_err(|e| wrong(&e.cast()))?;
    let begun = spec.prepare::<T>().map_err(|e| scenario.error(py, &scenario.0.run_error(&e)))?;
    Ok(Running { state: begun.servo_state(&servo), servo, last: ServoOutput::default() })
}

impl<T: Real> Running<T> {
    fn step(
        &mut self,
        counts: f64,
        whole: bool,
        target: &Target,
        map: Option<FrictionMap<'_>>,
    ) -> (u16, f64) {
        let target = target.0.cast();
        let map = |position| map.map_or_else(|| off_map(position), |map| map.at(position));
        self.last = if whole {
            self.servo.tick_on(&mut self.state, Counts(counts as i64 as i32), &target, map)
        } else {
            self.servo.tick_at(&mut self.state, FixedCounts::from_real(counts), &target, map)
        };
        (self.last.code.0, self.last.command.voltage.to_f64())
    }

    fn start(&mut self, counts: f64, whole: bool, target: &Target, volts: f64) {
        let (target, volts) = (target.0.cast(), T::from_f64(volts));
        self.last = ServoOutput::default();
        self.state = if whole {
            self.servo.start(Counts(counts as i64 as i32), &target, volts)
        } else {
            self.servo.start_at(FixedCounts::from_real(counts), &target, volts)
        };
    }

    fn terms(&self) -> Vec<(&'static str, f64)> {
        let values = self.last.command.terms.values().iter().map(|x| x.to_f64());
        self.servo.law().term_names().iter().copied().zip(values).collect()
    }
}

macro_rules! either {
    ($value:expr, $running:ident => $body:expr) => {
        match $value {
            Scalar::F32($running) => $body,
            Scalar::F64($running) => $body,
        }
    };
}

/// Counts as Python gives them, a number of any kind. Of an `int` the value is read as it stands: as an `f64` it would
/// become a `float` first, each period.
struct Given(f64);

impl<'py> FromPyObject<'_, 'py> for Given {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = f64::INPUT_TYPE;

    #[inline(always)]
    fn extract(number: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if number.is_exact_instance_of::<PyInt>() {
            let mut overflow = 0;
            // SAFETY: a borrowed object is alive, and this one is an `int`.
            let whole = unsafe { PyLong_AsLongAndOverflow(number.as_ptr(), &mut overflow) };
            if overflow == 0 {
                return Ok(Given(whole as f64));
            }
        }
        number.extract().map(Given)
    }
}

/// Counts as a number that the law takes: whole ones within 32 bit unless the sensor is ideal.
fn checked_counts(Given(counts): Given, whole: bool) -> PyResult<f64> {
    let fits = if whole {
        // Not `fract`, which is a call without SSE4.1.
        f64::from(counts as i32) == counts
    } else {
        counts.abs() < 1e12
    };
    if fits {
        return Ok(counts);
    }
    let expected = if whole { "a whole number of counts within 32 bit" } else { "finite counts below 1e12" };
    let text = format!("counts = {counts}: expected {expected}");
    Err(if counts.is_finite() && counts.abs() > 2e9 {
        PyOverflowError::new_err(text)
    } else {
        PyValueError::new_err(text)
    })
}

#[pymethods]
impl Servo {
    #[new]
    fn new(py: Python<'_>, scenario: &Bound<'_, PyAny>) -> PyResult<Servo> {
        let scenario = native(scenario)?;
        let spec = scenario.0.spec();
        Ok(Servo {
            running: match scenario.0.scalar() {
                ScalarKind::F32 => Scalar::F32(begin(py, &scenario)?),
                ScalarKind::F64 => Scalar::F64(begin(py, &scenario)?),
            },
            whole: spec.rig.encoder.quantised,
            rounds: spec.rig.dac.quantised,
            dac: Dac::new(&spec.rig.dac.converter).map_err(|e| core_error(py, &e))?,
            map: scenario.0.map_grid().cloned(),
        })
    }

    /// Begins anew: the shaft at `counts` moves with the target, the brake has been at `voltage`.
    #[pyo3(signature = (counts, target, voltage))]
    fn start(&mut self, counts: Given, target: &Target, voltage: f64) -> PyResult<()> {
        let whole = self.whole;
        let counts = checked_counts(counts, whole)?;
        if !voltage.is_finite() {
            return Err(PyValueError::new_err(format!("voltage = {voltage}: expected a finite voltage, V")));
        }
        either!(&mut self.running, r => r.start(counts, whole, target, voltage));
        Ok(())
    }

    /// One sampling period: the encoder's counts and the target in, the brake's voltage out, V.
    ///
    /// Parameters
    /// ----------
    /// counts : int
    ///     The encoder's counts; a fraction if the scenario's sensor is ideal.
    /// target : Target
    ///     The path now.
    ///
    /// Returns
    /// -------
    /// float
    ///     The voltage to command, V, as the converter gives it.
    fn step(&mut self, counts: Given, target: &Target) -> PyResult<f64> {
        Ok(self.answer(checked_counts(counts, self.whole)?, target))
    }

    /// Code for the converter at the last step.
    #[getter]
    fn code(&self) -> u16 {
        either!(&self.running, r => r.last.code.0)
    }

    /// Position error of the last step as the law saw it, rad.
    #[getter]
    fn error(&self) -> f64 {
        either!(&self.running, r => r.last.tick.error.to_f64())
    }

    /// Rate of the error as the law saw it, rad/s.
    #[getter]
    fn error_rate(&self) -> f64 {
        either!(&self.running, r => r.last.tick.error_rate.to_f64())
    }

    /// Voltage that the law demanded of the converter at the last step, V.
    #[getter]
    fn demand(&self) -> f64 {
        either!(&self.running, r => r.last.command.voltage.to_f64())
    }

    /// True if a limit of the output decided the last voltage.
    #[getter]
    fn limited(&self) -> bool {
        either!(&self.running, r => r.last.command.limit != Limit::None)
    }

    /// The limit that decided the last voltage, as in a run's column `limit`: 0 the law, 1 the
    /// lowest voltage, 2 the highest, 3 a demand that was not a number.
    #[getter]
    fn limit(&self) -> u8 {
        either!(&self.running, r => r.last.command.limit as u8)
    }

    /// The law's intermediate terms at the last step, by name with unit.
    #[getter]
    fn terms<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (name, value) in either!(&self.running, r => r.terms()) {
            dict.set_item(name, value)?;
        }
        Ok(dict)
    }

    /// A snapshot: continues from here by itself.
    fn copy(&self) -> Servo {
        self.clone()
    }

    fn __copy__(&self) -> Servo {
        self.clone()
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Servo {
        self.copy()
    }
}

impl Servo {
    /// One sampling period: counts that are known to be good and the target in, the voltage as the converter gives it
    /// out, V.
    fn answer(&mut self, counts: f64, target: &Target) -> f64 {
        let whole = self.whole;
        let map = self.map.as_ref().and_then(|grid| grid.map());
        let (code, volts) = either!(&mut self.running, r => r.step(counts, whole, target, map));
        if self.rounds { self.dac.volts(clutch_core::DacCode(code)) } else { volts }
    }
}

#[derive(Clone)]
enum Sticks {
    F32(clutch_core::StickSlip<f32>, StickSlipState<f32>),
    F64(clutch_core::StickSlip<f64>, StickSlipState<f64>),
}

/// Stick-slip seen from the encoder's counts, sampled by you.
///
/// The shaft counts as stuck when the encoder is silent while the path moves by more than a count.
///
/// Parameters
/// ----------
/// scenario : Scenario
///     Encoder and sampling period; its scalar, f32 or f64.
///
/// Examples
/// --------
/// Three counts at once each 27 ms, where the path moves evenly:
///
/// >>> import clutch
/// >>> sticks = clutch.StickSlip(clutch.Scenario.load("pd_2"))
/// >>> for tick in range(270):
/// ...     begins = sticks.update(tick // 27 * 3, 0.035)
/// >>> sticks.cycles, sticks.stair
/// (10, 3)
#[pyclass(module = "clutch")]
#[derive(Clone)]
pub(crate) struct StickSlip(Sticks);

macro_rules! seen {
    ($of:expr, $state:ident => $body:expr) => {
        match &$of.0 {
            Sticks::F32(_, $state) => $body,
            Sticks::F64(_, $state) => $body,
        }
    };
}

#[pymethods]
impl StickSlip {
    #[new]
    fn new(py: Python<'_>, scenario: &Bound<'_, PyAny>) -> PyResult<StickSlip> {
        let scenario = native(scenario)?;
        let spec = scenario.0.spec();
        let wrong = |e: ParamError| core_error(py, &e);
        let (encoder, period) =
            (Encoder::new(spec.rig.encoder.sensor.counts_per_rev).map_err(wrong)?, spec.period);
        let single = StickSlipParams::default();
        let double = StickSlipParams::default();
        Ok(StickSlip(match scenario.0.scalar() {
            ScalarKind::F32 => Sticks::F32(
                clutch_core::StickSlip::new(&single, encoder, period).map_err(|e| wrong(e.cast()))?,
                StickSlipState::default(),
            ),
            ScalarKind::F64 => Sticks::F64(
                clutch_core::StickSlip::new(&double, encoder, period).map_err(wrong)?,
                StickSlipState::default(),
            ),
        }))
    }

    /// One sampling period: the encoder's counts and the path's velocity, rad/s.
    ///
    /// Parameters
    /// ----------
    /// counts : int
    ///     The encoder's counts.
    /// velocity_rad_s : float
    ///     Velocity of the path now, rad/s.
    ///
    /// Returns
    /// -------
    /// bool
    ///     True if a stick is detected at this sample.
    fn update(&mut self, counts: Given, velocity_rad_s: f64) -> PyResult<bool> {
        let counts = Counts(checked_counts(counts, true)? as i64 as i32);
        Ok(match &mut self.0 {
            Sticks::F32(detector, state) => detector.update(state, counts, f32::from_f64(velocity_rad_s)),
            Sticks::F64(detector, state) => detector.update(state, counts, velocity_rad_s),
        })
    }

    /// True if the shaft counts as stuck now.
    #[getter]
    fn stuck(&self) -> bool {
        seen!(self, state => state.stuck())
    }

    /// Stick-slip cycles so far.
    #[getter]
    fn cycles(&self) -> u64 {
        seen!(self, state => state.cycles())
    }

    /// Sampling periods spent stuck so far, with the silence before each detection.
    #[getter]
    fn stuck_ticks(&self) -> u64 {
        seen!(self, state => state.stuck_ticks())
    }

    /// Largest movement between one stick and the next so far, counts.
    #[getter]
    fn stair(&self) -> u32 {
        seen!(self, state => state.stair())
    }
}

/// The rig of a scenario, stepped by you: volts in, counts out.
///
/// It begins where the scenario's run begins, at its position, velocity and voltage.
///
/// Parameters
/// ----------
/// scenario : Scenario
///     Rig, sampling, start, seed, engine.
///
/// Examples
/// --------
/// Let go, the weight accelerates the shaft:
///
/// >>> import clutch
/// >>> plant = clutch.Plant(clutch.Scenario.load("smc_2"))
/// >>> start = plant.velocity
/// >>> for _ in range(10):
/// ...     counts = plant.step(0.0)
/// >>> plant.velocity > start
/// True
///
/// A copy goes its own way from where the plant is, and a plant can be pickled:
///
/// >>> import copy
/// >>> other = copy.copy(plant)
/// >>> other.step(2.0) == plant.step(2.0)
/// True
#[derive(Clone)]
#[pyclass(module = "clutch")]
pub(crate) struct Plant {
    /// The scenario it was made of.
    scenario: Scenario,
    moving: MovingRig,
    /// After a motion that the engine could not follow.
    broken: bool,
    period: f64,
    tick: u64,
    start_voltage: f64,
    voltage: f64,
    whole: bool,
    rounds: bool,
    events: Vec<Event>,
    sticks: usize,
}

#[pymethods]
impl Plant {
    #[new]
    fn new(py: Python<'_>, scenario: &Bound<'_, PyAny>) -> PyResult<Plant> {
        let scenario = native(scenario)?;
        let spec = scenario.0.spec();
        let begun = match scenario.0.scalar() {
            ScalarKind::F32 => spec.prepare::<f32>().map(|p| (p.moving, p.volts)),
            ScalarKind::F64 => spec.prepare::<f64>().map(|p| (p.moving, p.volts)),
        };
        let (mut moving, start_voltage) = begun.map_err(|e| scenario.error(py, &scenario.0.run_error(&e)))?;
        moving.begin_period();
        Ok(Plant {
            scenario: scenario.clone(),
            moving,
            broken: false,
            period: spec.period.seconds(),
            tick: 0,
            start_voltage,
            voltage: start_voltage,
            whole: spec.rig.encoder.quantised,
            rounds: spec.rig.dac.quantised,
            events: Vec::new(),
            sticks: 0,
        })
    }

    /// One sampling period with `voltage` commanded; the counts at its end (a fraction if the
    /// sensor is ideal).
    ///
    /// The rig's converter rounds and limits the voltage, its delay and lag come on top.
    fn step<'py>(&mut self, py: Python<'py>, voltage: f64) -> PyResult<Bound<'py, PyAny>> {
        if !voltage.is_finite() {
            return Err(PyValueError::new_err(format!("voltage = {voltage}: expected a finite voltage, V")));
        }
        if self.broken {
            return Err(PyRuntimeError::new_err(
                "the plant broke in an earlier step; place it, or make a new one",
            ));
        }
        self.advance(voltage).map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
        self.counts(py)
    }

    /// The encoder's output: whole counts; a fraction if the scenario's sensor is ideal.
    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        if self.whole {
            Ok(self.moving.counts().0.into_pyobject(py)?.into_any())
        } else {
            Ok(PyFloat::new(py, self.fine_counts()).into_any())
        }
    }

    /// Position in counts to 2⁻¹⁶ of one, as an ideal sensor shows it.
    #[getter]
    fn fine_counts(&self) -> f64 {
        fixed_to_counts(self.moving.fine_counts())
    }

    /// True position, rad.
    #[getter]
    fn position(&self) -> f64 {
        self.moving.shaft().position
    }

    /// True velocity, rad/s; exactly 0 when stuck.
    #[getter]
    fn velocity(&self) -> f64 {
        self.moving.shaft().velocity
    }

    /// True if friction holds the shaft.
    #[getter]
    fn stuck(&self) -> bool {
        self.moving.shaft().motion == Motion::Stuck
    }

    /// Number of sticks so far.
    #[getter]
    fn sticks(&self) -> usize {
        self.sticks
    }

    /// Time since the start, s.
    #[getter]
    fn time(&self) -> f64 {
        self.tick as f64 * self.period
    }

    /// Voltage last commanded, as the converter gives it, V.
    #[getter]
    fn voltage(&self) -> f64 {
        self.voltage
    }

    /// Voltage at the start, V.
    #[getter]
    fn start_voltage(&self) -> f64 {
        self.start_voltage
    }

    /// Sticks and break-aways so far: columns time_s, kind, position_rad, torque_nm.
    fn events(&self) -> Table {
        event_table(&self.events)
    }

    /// Puts the shaft somewhere else: its time and what is random go on.
    ///
    /// Bristles, if its friction has some, bend as in steady sliding, at rest as they have to under the voltage at the pad.
    ///
    /// Parameters
    /// ----------
    /// position_rad : float
    ///     Position of the shaft, rad.
    /// velocity_rad_s : float, optional
    ///     Its velocity, rad/s; 0 is at rest.
    /// voltage_v : float, optional
    ///     Voltage that the converter has given since long, V; absent: the voltages go on, also those that are still on
    ///     their way through delay and lag.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     A number that is not finite, a position beyond the encoder's counts, a voltage beyond the converter's.
    #[pyo3(signature = (position_rad, velocity_rad_s=0.0, voltage_v=None))]
    fn place(&mut self, position_rad: f64, velocity_rad_s: f64, voltage_v: Option<f64>) -> PyResult<()> {
        let refused = |name: &str, value: f64, expected: String| {
            Err(PyValueError::new_err(format!("{name} = {value:e}: expected {expected}")))
        };
        let rig = self.moving.rig();
        let per_radian: f64 = rig.encoder.counts_per_radian();
        let counted = (position_rad * per_radian).abs() < f64::from(i32::MAX);
        if !counted {
            return refused("position_rad", position_rad, "a finite position within ±2³¹ counts".to_owned());
        }
        if !velocity_rad_s.is_finite() {
            return refused("velocity_rad_s", velocity_rad_s, "a finite velocity".to_owned());
        }
        let converter = &rig.params.dac.converter;
        let reached = converter.lowest..=converter.highest;
        if let Some(volts) = voltage_v.filter(|volts| !reached.contains(volts)) {
            let expected = format!("a voltage of the converter, {} to {} V", reached.start(), reached.end());
            return refused("voltage_v", volts, expected);
        }
        self.moving.place(position_rad, velocity_rad_s, voltage_v);
        self.voltage = voltage_v.unwrap_or(self.voltage);
        self.broken = false;
        Ok(())
    }

    /// A plant in the same state, which goes its own way.
    fn copy(&self) -> Plant {
        self.clone()
    }

    fn __copy__(&self) -> Plant {
        self.clone()
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Plant {
        self.clone()
    }

    /// The scenario as TOML, the rig's state as bits, and the plant's own numbers.
    #[allow(clippy::type_complexity, reason = "pickle's form")]
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String, Vec<u64>))> {
        let plant = slf.borrow();
        let mut words = vec![
            u64::from(plant.broken),
            plant.tick,
            plant.voltage.to_bits(),
            plant.start_voltage.to_bits(),
            plant.sticks as u64,
            plant.events.len() as u64,
        ];
        for e in &plant.events {
            let kind = u64::from(e.kind == EventKind::Stick);
            words.extend([e.time.to_bits(), kind, e.position.to_bits(), e.torque.to_bits()]);
        }
        words.extend(plant.moving.state());
        let rebuild = slf.py().import("clutch._clutch")?.getattr("_plant")?;
        Ok((rebuild, (plant.scenario.0.canonical(), words)))
    }
}

impl Plant {
    /// One sampling period with a finite voltage commanded.
    fn advance(&mut self, voltage: f64) -> Result<(), EngineError> {
        let (period, moving) = (self.period, &mut self.moving);
        let dac = moving.rig().dac;
        let volts = if self.rounds { dac.volts(dac.code(voltage)) } else { voltage };
        moving.command(volts);
        let seen = match moving.advance(period) {
            Ok(seen) => seen,
            Err(e) => {
                self.broken = true;
                return Err(e);
            }
        };
        self.sticks += seen.iter().filter(|e| e.kind == EventKind::Stick).count();
        self.events.extend_from_slice(seen);
        self.voltage = volts;
        self.tick += 1;
        moving.set_time(self.tick as f64 * period);
        moving.begin_period();
        Ok(())
    }
}

/// A pickled plant.
#[pyfunction]
pub(crate) fn _plant(py: Python<'_>, scenario: &str, words: Vec<u64>) -> PyResult<Plant> {
    let wrong = || PyValueError::new_err("this is no pickled plant of this version");
    let read = clutch_sim::Scenario::parse("a pickled plant", scenario, &[]);
    let scenario = Scenario(Arc::new(read.map_err(|e| crate::convert::scenario_error(py, &e, None))?));
    let mut plant = Plant::new(py, Bound::new(py, scenario)?.as_any())?;
    let mut words = words.into_iter();
    let mut next = || words.next().ok_or_else(wrong);
    plant.broken = next()? != 0;
    plant.tick = next()?;
    plant.voltage = f64::from_bits(next()?);
    plant.start_voltage = f64::from_bits(next()?);
    plant.sticks = next()? as usize;
    for _ in 0..next()? {
        let (time, kind) = (f64::from_bits(next()?), next()?);
        let kind = if kind == 0 { EventKind::BreakAway } else { EventKind::Stick };
        let (position, torque) = (f64::from_bits(next()?), f64::from_bits(next()?));
        plant.events.push(Event { time, kind, position, torque });
    }
    let rest: Vec<u64> = words.collect();
    // One period more has begun than has passed.
    let begun = rest.first() == plant.tick.checked_add(1).as_ref();
    if begun && plant.moving.restore(&rest) { Ok(plant) } else { Err(wrong()) }
}

/// Sticks and break-aways as a table.
pub(crate) fn event_table(events: &[Event]) -> Table {
    let of = |f: &dyn Fn(&Event) -> f64| Column::own(events.iter().map(f).collect::<Vec<f64>>());
    let kind = events.iter().map(|e| match e.kind {
        EventKind::Stick => "stick",
        EventKind::BreakAway => "break_away",
    });
    Table::of([
        ("time_s", of(&|e| e.time)),
        ("kind", Column::text(kind)),
        ("position_rad", of(&|e| e.position)),
        ("torque_nm", of(&|e| e.torque)),
    ])
}

/// The checked scenario of a `clutch.Scenario`, or the native one itself.
pub(crate) fn native(scenario: &Bound<'_, PyAny>) -> PyResult<Scenario> {
    if let Ok(native) = scenario.cast::<Scenario>() {
        return Ok(native.get().clone());
    }
    let inner = scenario.getattr("_native").map_err(|e| {
        if !e.is_instance_of::<PyAttributeError>(scenario.py()) {
            return e;
        }
        let kind = scenario.get_type();
        PyTypeError::new_err(format!("scenario is of type {kind}: expected a clutch.Scenario"))
    })?;
    Ok(inner.cast::<Scenario>()?.get().clone())
}

/// The input of a law written in Python, each period.
///
/// Parameters
/// ----------
/// error, error_rate : float
///     Position error, target minus position, rad, and its rate, rad/s.
/// target_velocity, target_acceleration : float
///     Velocity and acceleration of the path, rad/s and rad/s².
/// time : float
///     Time since the start of the run, s.
/// position : float
///     Position that the encoder shows, unwrapped, rad.
/// counts : float
///     The same in counts; whole, unless the sensor is ideal.
/// applied : float
///     Voltage since the last tick, as the converter gave it, V.
///
/// Examples
/// --------
/// >>> import clutch
/// >>> def law(tick):
/// ...     return 2.24 - 80.0 * tick.error
/// >>> clutch.simulate("smc_2", law=law).metrics.max_error_rad < 0.01
/// True
#[pyclass(frozen, module = "clutch")]
pub(crate) struct Tick {
    tick: law::Tick<f64>,
    time: f64,
    position: f64,
    counts: f64,
    applied: f64,
}

#[pymethods]
impl Tick {
    #[new]
    #[pyo3(signature = (error, error_rate, target_velocity=0.0, target_acceleration=0.0, time=0.0, position=0.0, counts=0.0, applied=0.0))]
    #[allow(clippy::too_many_arguments, reason = "Python names them")]
    fn new(
        error: f64,
        error_rate: f64,
        target_velocity: f64,
        target_acceleration: f64,
        time: f64,
        position: f64,
        counts: f64,
        applied: f64,
    ) -> Tick {
        let tick = law::Tick { error, error_rate, target_velocity, target_acceleration };
        Tick { tick, time, position, counts, applied }
    }

    /// Position error, target minus position, rad.
    #[getter]
    fn error(&self) -> f64 {
        self.tick.error
    }

    /// Its rate, from the scenario's derivative (5) or observer, rad/s.
    #[getter]
    fn error_rate(&self) -> f64 {
        self.tick.error_rate
    }

    /// Target velocity, rad/s.
    #[getter]
    fn target_velocity(&self) -> f64 {
        self.tick.target_velocity
    }

    /// Target acceleration, rad/s².
    #[getter]
    fn target_acceleration(&self) -> f64 {
        self.tick.target_acceleration
    }

    /// Measured velocity, rad/s.
    #[getter]
    fn velocity(&self) -> f64 {
        self.tick.velocity()
    }

    /// Time since the start of the run, s.
    #[getter]
    fn time(&self) -> f64 {
        self.time
    }

    /// Position that the encoder shows, unwrapped, rad.
    #[getter]
    fn position(&self) -> f64 {
        self.position
    }

    /// The same in counts; whole, unless the sensor is ideal.
    #[getter]
    fn counts(&self) -> f64 {
        self.counts
    }

    /// Voltage since the last tick, as the converter gave it, V.
    #[getter]
    fn applied(&self) -> f64 {
        self.applied
    }

    fn __repr__(&self) -> String {
        let t = &self.tick;
        format!("Tick(time={}, error={}, error_rate={})", self.time, t.error, t.error_rate)
    }
}

/// A law written in Python, behind the scenario's output stage.
pub(crate) struct PythonLaw {
    /// Answers a tick.
    step: Py<PyAny>,
    /// Told of the first tick, if the law has it.
    start: Option<Py<PyAny>>,
    output: Output<f64>,
    period: f64,
    radians_per_count: f64,
    failure: Mutex<Option<PyErr>>,
}

/// Its state: the law keeps its own.
#[derive(Clone, Default)]
pub(crate) struct PythonState {
    output: OutputState<f64>,
    ticks: u64,
    seen: Seen<f64>,
}

impl PythonLaw {
    /// A function of a `Tick`, or an object with such a method `step` and, if it likes, one `start`.
    pub(crate) fn new(law: &Bound<'_, PyAny>, scenario: &Scenario) -> PyResult<Self> {
        let py = law.py();
        let (step, start) = if law.hasattr("step")? {
            let start = if law.hasattr("start")? { Some(law.getattr("start")?.unbind()) } else { None };
            (law.getattr("step")?, start)
        } else {
            (law.clone(), None)
        };
        if let Some(start) = start.as_ref().map(|start| start.bind(py)).filter(|start| !start.is_callable()) {
            let kind = start.get_type();
            return Err(PyTypeError::new_err(format!(
                "law.start is of type {kind}: expected a method start(tick), or another name"
            )));
        }
        if !step.is_callable() {
            let kind = law.get_type();
            return Err(PyTypeError::new_err(format!(
                "law is of type {kind}: expected a function of a clutch.Tick, or an object with a method step(tick)"
            )));
        }
        let spec = scenario.0.spec();
        let encoder =
            Encoder::new::<f64>(spec.rig.encoder.sensor.counts_per_rev).map_err(|e| core_error(py, &e))?;
        Ok(PythonLaw {
            step: step.unbind(),
            start,
            output: output_stage(py, scenario)?,
            period: spec.period.seconds(),
            radians_per_count: encoder.radians_per_count(),
            failure: Mutex::new(None),
        })
    }

    /// The exception that the law raised first.
    pub(crate) fn failure(&self) -> Option<PyErr> {
        self.failure.lock().ok()?.take()
    }

    /// The run is lost: its remaining results are of no use.
    pub(crate) fn failed(&self) -> bool {
        self.failure.lock().map_or(true, |f| f.is_some())
    }

    fn ask(&self, tick: &law::Tick<f64>, state: &PythonState) -> f64 {
        let Ok(mut failure) = self.failure.lock() else { return f64::NAN };
        if failure.is_some() {
            return f64::NAN; // until the run ends, at its next report
        }
        let time = state.ticks as f64 * self.period;
        let counts = fixed_to_counts(state.seen.position);
        let position = counts * self.radians_per_count;
        let given = Tick { tick: *tick, time, position, counts, applied: state.seen.applied };
        let asked = Python::attach(|py| -> PyResult<f64> {
            let given = Bound::new(py, given)?;
            if let Some(start) = self.start.as_ref().filter(|_| state.ticks == 0) {
                start.bind(py).call1((&given,))?;
            }
            let answer = self.step.bind(py).call1((given,))?;
            answer.extract::<f64>().map_err(|e| {
                if !e.is_instance_of::<PyTypeError>(py) {
                    return e; // the answer's own: it could not become a number
                }
                PyTypeError::new_err(format!(
                    "the law answered {answer} at t = {time} s: expected a voltage, V"
                ))
            })
        });
        asked.unwrap_or_else(|e| {
            *failure = Some(e);
            f64::NAN
        })
    }
}

impl ControlLaw<f64> for PythonLaw {
    type State = PythonState;
    /// The only term of a law whose inside is not known.
    type Terms = [f64; 1];
    const TERMS: &'static [&'static str] = &["python_v"];

    fn start(&self, _: &law::Tick<f64>, _: f64) -> PythonState {
        PythonState::default()
    }

    fn sees(&self, state: &mut PythonState, seen: impl FnOnce() -> Seen<f64>) {
        state.seen = seen();
    }

    fn update(&self, state: &mut PythonState, tick: &law::Tick<f64>) -> Command<f64, [f64; 1]> {
        let demand = self.ask(tick, state);
        state.ticks += 1;
        let (voltage, limit) = self.output.apply(&mut state.output, demand);
        Command { voltage, limit, terms: [demand] }
    }
}

/// The output stage of a scenario.
fn output_stage(py: Python<'_>, scenario: &Scenario) -> PyResult<Output<f64>> {
    let spec = scenario.0.spec();
    let servo = spec.servo().map_err(|e| core_error(py, &e))?;
    let law = Law::new(&servo.law, &servo.beside()).map_err(|e| core_error(py, &e))?;
    Ok(*law.output())
}
