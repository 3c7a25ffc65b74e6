//! One run: rig, servo and path in closed loop.

use crate::detected::Detector;
use crate::engine::{EngineError, EngineKind, Event, ExactFlow, Motion, Shaft};
use crate::metrics::{Detected, Metrics, MetricsBuilder, MetricsSample};
use crate::moving_rig::MovingRig;
use crate::progress::{Progress, Report, UNWATCHED};
use crate::rig::{Rig, RigParams};
use clutch_core::friction::FrictionModel;
use clutch_core::law::{ControlLaw, LawParams, Limit, OutputParams, ShellParams, Terms};
use clutch_core::params::{Range, Table};
use clutch_core::reference::{Reference, ReferenceParams};
use clutch_core::{
    Counts, Encoder, FixedCounts, FrictionMap, Micros, ParamError, Place, PlantParams, Real, Servo,
    ServoOutput, ServoParams, ServoState, Target, VelocityParams, params,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

clutch_core::words! {
    /// Motion of the shaft at the beginning.
    pub enum Start {
        /// On the path: at its velocity, the brake at the voltage that keeps it. (12) and (13) assume a path without
        /// jumps.
        OnPath = "on_path" default,
        /// Held at rest: by a brake with a quarter more than the voltage that this takes, by a motor with the voltage that
        /// balances the drive.
        Rest = "rest",
    }
}

params! {
    /// Length, beginning, seed and engine of a run.
    #[derive(Copy)]
    pub struct RunParams<f64>: Default {
        /// Length.
        duration: f64 = 5.0, "duration_s" "" S, Range::above(0.0);
        /// Time at the start that is left out of the figures.
        settle: f64 = 1.0, "settle_s" "" S, Range::at_least(0.0);
        /// Motion of the shaft at the beginning.
        start: Start = "on_path", "start" "" NONE, Range::ANY;
        /// Position at which shaft and path begin; absent: somewhere within the first count, drawn from the seed.
        /// The place of the path between the encoder's edges decides how often a slow shaft sticks, and nobody mounts
        /// an encoder to a fraction of a count.
        start_counts: Option<f64>, "start_counts" "" COUNTS, Range::above(-1e9).below(1e9);
        /// Seed of everything random: start, ripple phases, noise, a hand.
        seed: u64 = 1, "seed" "" NONE, Range::within(0.0, i64::MAX as f64);
        /// Engine that integrates the motion.
        engine: EngineKind = "auto", "engine" "" NONE, Range::ANY;
    }
    relations(p) {
        /// Samples fit the memory.
        FITS: duration, "a time of 1 to 10 million times sampling.period_us: a run keeps every sample";
        /// Figures have samples.
        SETTLES: settle, "a time that ends at least sampling.period_us before run.duration_s does";
    }
}

/// Samples that a run may have: it keeps each of them, about a hundred bytes.
const LONGEST: u64 = 10_000_000;
/// Samples between two reports of progress: some milliseconds, so that whoever stops a run waits no longer.
pub(crate) const REPORT_EVERY: u64 = 16_384;

impl RunParams {
    /// The number of ticks.
    #[must_use]
    pub fn ticks(&self, period: Micros) -> u64 {
        libm::rint(self.duration / period.seconds::<f64>()) as u64
    }

    /// Position at which shaft and path begin.
    #[must_use]
    pub fn start_position(&self) -> FixedCounts {
        match self.start_counts {
            Some(counts) => FixedCounts::from_real(counts),
            None => FixedCounts(Pcg64::seed_from_u64(self.seed ^ 0x0073_7461_7274).random_range(0..1 << 16)),
        }
    }

    /// Checks duration and settling time against the period.
    ///
    /// # Errors
    /// The first parameter out of range, or one that does not fit the period.
    pub fn check(&self, period: Micros) -> Result<(), ParamError> {
        let shortest: f64 = period.period()?;
        self.check_rows()?;
        let fits = self.duration >= shortest && self.ticks(period) <= LONGEST;
        RunParams::FITS.require(self.duration, fits)?;
        RunParams::SETTLES.require(self.settle, self.settle <= self.duration - shortest)?;
        Ok(())
    }
}

/// Everything a run is made of, SI and radians.
#[derive(Clone, Debug, PartialEq)]
pub struct RunSpec<'a> {
    /// The rig.
    pub rig: RigParams,
    /// Sampling period.
    pub period: Micros,
    /// Source of the law's error rate.
    pub velocity: VelocityParams,
    /// The plant as law and observer believe it to be.
    pub model: PlantParams,
    /// The law.
    pub law: LawParams,
    /// Output limits and bumpless start.
    pub output: OutputParams,
    /// The shell around the law.
    pub shell: ShellParams,
    /// The path.
    pub reference: ReferenceParams<'a>,
    /// Friction along the disc, where there is a map.
    pub friction_map: Option<FrictionMap<'a>>,
    /// Length, beginning, seed and engine.
    pub run: RunParams,
}

impl<'a> RunSpec<'a> {
    /// The paper's sampling and filter, its nominal model, on a rig.
    #[must_use]
    pub fn new(rig: RigParams, law: LawParams, reference: ReferenceParams<'a>) -> Self {
        RunSpec {
            rig,
            period: Micros(1000),
            velocity: VelocityParams::default(),
            model: PlantParams::default(),
            law,
            output: OutputParams::default(),
            shell: ShellParams::default(),
            reference,
            friction_map: None,
            run: RunParams::default(),
        }
    }

    /// The engine that runs on a rig: the exact flow where `auto` may take it.
    ///
    /// # Errors
    /// The exact flow is asked for and cannot take the rig.
    pub fn engine(&self, rig: &Rig) -> Result<EngineKind, RunError> {
        let lags = self.rig.actuator_time_constant.is_some();
        let bends = rig.model.plant.friction().bristles().is_some();
        match (self.run.engine, bends) {
            (EngineKind::Auto | EngineKind::Bristle, true) => return Ok(EngineKind::Bristle),
            (EngineKind::Bristle, false) => return Err(RunError::NoBristles),
            (engine, true) => return Err(RunError::Bristles(engine)),
            _ => {}
        }
        match (self.run.engine, ExactFlow::refuses(&rig.model, rig.drive.is_constant(), lags)) {
            (EngineKind::ExactFlow, Some(needs)) => Err(RunError::Engine(needs)),
            (EngineKind::DormandPrince | EngineKind::Bristle, _) | (EngineKind::Auto, Some(_)) => {
                Ok(EngineKind::DormandPrince)
            }
            (EngineKind::ExactFlow | EngineKind::Auto, None) => Ok(EngineKind::ExactFlow),
        }
    }

    /// The path from where the run begins, planned in the law's scalar: a board that computes in
    /// single precision has nothing else to plan in.
    ///
    /// # Errors
    /// A parameter out of range.
    pub fn path<T: Real>(&self) -> Result<Reference<'a, T>, ParamError> {
        let encoder = Encoder::new::<f64>(self.rig.encoder.sensor.counts_per_rev)?;
        let start = self.run.start_position();
        Reference::new(&self.reference.cast(), start, encoder, self.period).map_err(|e| e.cast())
    }

    /// Rig and path as a run in the scalar `T` begins.
    ///
    /// # Errors
    /// A parameter out of range; an engine that cannot take the rig.
    pub fn prepare<T: Real>(&self) -> Result<Prepared<'a, T>, RunError> {
        let p = &self.run;
        let rig = Rig::new(&self.rig, p.seed)?;
        let engine = self.engine(&rig)?;
        p.check(self.period)?;
        let encoder = rig.encoder;
        let reference = self.path::<T>()?;
        let first = reference.at(0);
        let begin = first.position.minus::<f64>(FixedCounts(0)) * encoder.radians_per_count::<f64>();
        if i32::try_from(first.position.0 >> FixedCounts::FRACTION_BITS).is_err() {
            return Err(RunError::Begin(begin));
        }
        let velocity = if p.start == Start::OnPath { first.velocity.to_f64() } else { 0.0 };
        let volts =
            if p.start == Start::Rest { rig.resting_voltage() } else { rig.sliding_voltage(velocity) };
        let moving = MovingRig::new(rig, engine, p.seed, (begin, velocity), volts);
        Ok(Prepared { reference, moving, volts, engine })
    }

    /// The servo's parameters.
    ///
    /// # Errors
    /// Field `counts_per_rev`.
    pub fn servo(&self) -> Result<ServoParams, ParamError> {
        Ok(ServoParams {
            period: self.period,
            encoder: Encoder::new(self.rig.encoder.sensor.counts_per_rev)?,
            dac: self.rig.dac.converter,
            velocity: self.velocity,
            model: self.model,
            law: self.law,
            output: self.output,
            shell: self.shell,
        })
    }
}

/// A run could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RunError {
    /// A parameter is out of range.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// The path begins where no counter can be, rad.
    #[error("the path begins at {0} rad: expected a beginning within ±2³¹ counts")]
    Begin(f64),
    /// The servo is one of another run.
    #[error("the servo has another period or another encoder than the run")]
    OtherServo,
    /// The engine cannot take the rig.
    #[error("engine = exact_flow: expected dormand_prince or auto: exact_flow needs {0}")]
    Engine(&'static str),
    /// The friction has bristles, which the engine has not.
    #[error("engine = {}: expected bristle or auto: the rig's friction has bristles, which bend before it slides", .0.name())]
    Bristles(EngineKind),
    /// The friction has no bristles, which the engine needs.
    #[error(
        "engine = bristle: expected dormand_prince, exact_flow or auto: the rig's friction has no bristles"
    )]
    NoBristles,
    /// The engine gave up.
    #[error(transparent)]
    Motion(#[from] EngineError),
    /// There is no room for so many samples.
    #[error("no memory for {0} samples, of about 130 bytes each; make the run shorter, or keep figures only")]
    Memory(u64),
    /// The watcher of the progress ended it.
    #[error("stopped before its end")]
    Stopped,
}

/// Parts that a run keeps besides its figures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// Every sample and event; the bounds on stick-slip by counts and voltage among the figures.
    Trace,
    /// Nothing: for sweeps, whose traces would fill the memory.
    Figures,
}

/// A rig and a path at the start of a run.
pub struct Prepared<'a, T> {
    /// The path.
    pub reference: Reference<'a, T>,
    /// The rig, at the path's beginning.
    pub moving: MovingRig,
    /// Voltage on the brake before the first tick, V.
    pub volts: f64,
    /// Engine that moves the rig.
    pub engine: EngineKind,
}

impl<T: Real> Prepared<'_, T> {
    /// The servo's state for the first tick.
    #[must_use]
    pub fn servo_state<C: ControlLaw<T>>(&self, servo: &Servo<T, C>) -> ServoState<T, C::State> {
        let (first, volts) = (self.reference.at(0), T::from_f64(self.volts));
        if self.moving.rig().params.encoder.quantised {
            servo.start(self.moving.counts(), &first, volts)
        } else {
            servo.start_at(self.moving.fine_counts(), &first, volts)
        }
    }
}

/// The samples of a run, one column each; SI and radians.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// Time, s.
    pub time: Vec<f64>,
    /// `θ_d`, rad.
    pub target_position: Vec<f64>,
    /// `θ_d`, 2⁻¹⁶ counts.
    pub target_fixed: Vec<FixedCounts>,
    /// `θ̇_d`, rad/s.
    pub target_velocity: Vec<f64>,
    /// `θ̈_d`, rad/s².
    pub target_acceleration: Vec<f64>,
    /// `θ`, rad.
    pub position: Vec<f64>,
    /// `θ̇`, rad/s.
    pub velocity: Vec<f64>,
    /// `e = θ_d − θ`, rad.
    pub error: Vec<f64>,
    /// Encoder counts.
    pub counts: Vec<i32>,
    /// `e` as the law saw it, rad.
    pub measured_error: Vec<f64>,
    /// `ė` as the law saw it, rad/s.
    pub error_rate: Vec<f64>,
    /// DAC code.
    pub code: Vec<u16>,
    /// Voltage commanded, V.
    pub voltage: Vec<f64>,
    /// Voltage that the law answered, before the converter, V.
    pub demand: Vec<f64>,
    /// The limit of the output that decided it, if one did.
    pub limit: Vec<Limit>,
    /// Voltage on the brake before the first tick, V.
    pub start_voltage: f64,
    /// True if the shaft was stuck at the sample.
    pub stuck: Vec<bool>,
    /// The law's terms: names and columns.
    pub terms: Vec<(&'static str, Vec<f64>)>,
}

/// Columns of a table of samples, beside those of the law's terms, with their meanings.
pub const SAMPLE_COLUMNS: [(&str, &str); 15] = [
    ("time_s", "time of the sample"),
    ("target_position_rad", "target position, from the encoder's zero"),
    ("target_velocity_rad_s", "target velocity"),
    ("target_acceleration_rad_s2", "target acceleration"),
    ("position_rad", "true position"),
    ("velocity_rad_s", "true velocity; exactly 0 when stuck"),
    ("error_rad", "true error, target less position"),
    ("counts", "the encoder's counts"),
    ("measured_error_rad", "error as the law saw it"),
    ("error_rate_rad_s", "rate of the error as the law saw it"),
    ("code", "code given to the converter"),
    ("voltage_v", "voltage commanded at this sample, before delay and lag"),
    ("demand_v", "the law's answer, before the converter"),
    (
        "limit",
        "limit of the output that decided it: 0 none, 1 the lowest, 2 the highest, 3 the demand was no number",
    ),
    ("stuck", "the shaft is stuck at the sample"),
];

impl Trace {
    /// The law's terms as columns of a table of samples; a name that a sample has already gets `law_` before it.
    pub fn term_columns(&self) -> impl Iterator<Item = (String, &[f64])> {
        self.terms.iter().map(|(name, values)| {
            let taken = SAMPLE_COLUMNS.iter().any(|(column, _)| column == name);
            (if taken { format!("law_{name}") } else { (*name).to_owned() }, values.as_slice())
        })
    }

    /// Without samples, and with room for so many: growing copies everything, again and again.
    fn with_room(n: u64) -> Result<Self, RunError> {
        Ok(Trace {
            time: room(n)?,
            target_position: room(n)?,
            target_fixed: room(n)?,
            target_velocity: room(n)?,
            target_acceleration: room(n)?,
            position: room(n)?,
            velocity: room(n)?,
            error: room(n)?,
            counts: room(n)?,
            measured_error: room(n)?,
            error_rate: room(n)?,
            code: room(n)?,
            voltage: room(n)?,
            demand: room(n)?,
            limit: room(n)?,
            start_voltage: 0.0,
            stuck: room(n)?,
            terms: Vec::new(),
        })
    }
}

/// A column with room for so many samples.
pub(crate) fn room<T>(n: u64) -> Result<Vec<T>, RunError> {
    let mut column = Vec::new();
    let fits = usize::try_from(n).is_ok_and(|n| column.try_reserve_exact(n).is_ok());
    if fits { Ok(column) } else { Err(RunError::Memory(n)) }
}

/// A run's outcome.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Samples.
    pub trace: Trace,
    /// Sticks and break-aways, in order.
    pub events: Vec<Event>,
    /// Figures.
    pub metrics: Metrics,
    /// Stick-slip as a loop on hardware knows it.
    pub detected: Detected,
    /// Ticks at which the encoder's silence showed a stick ([`clutch_core::StickSlip`]), in order.
    pub detections: Vec<u64>,
    /// Engine that ran.
    pub engine: EngineKind,
}

impl Run {
    /// A run of which only figures were kept.
    pub(crate) fn of_figures(engine: EngineKind, metrics: Metrics, detected: Detected) -> Self {
        Run { trace: Trace::default(), events: Vec::new(), metrics, detected, detections: Vec::new(), engine }
    }
}

/// Runs the law of the specification, in the scalar `T`.
///
/// # Errors
/// A parameter out of range, an engine that cannot take the rig, a motion it cannot follow.
pub fn simulate<T: Real>(spec: &RunSpec<'_>) -> Result<Run, RunError> {
    simulate_watched::<T>(spec, Keep::Trace, UNWATCHED)
}

/// As [`simulate`], keeps what is asked for, and reports its progress, in samples.
///
/// # Errors
/// As [`simulate`]; [`RunError::Stopped`].
pub fn simulate_watched<T: Real>(
    spec: &RunSpec<'_>,
    keep: Keep,
    progress: Report<'_>,
) -> Result<Run, RunError> {
    let servo = Servo::<T>::new(&spec.servo()?.cast()).map_err(|e| e.cast())?;
    simulate_servo(spec, &servo, keep, progress)
}

/// Runs a servo around any law; the specification's own law is not used.
///
/// # Errors
/// As [`simulate_watched`].
pub fn simulate_servo<T: Real, C: ControlLaw<T>>(
    spec: &RunSpec<'_>,
    servo: &Servo<T, C>,
    keep: Keep,
    progress: Report<'_>,
) -> Result<Run, RunError> {
    simulate_prepared(spec, servo, spec.prepare::<T>()?, keep, progress)
}

/// As [`simulate_servo`], with rig and path as they are: [`RunSpec::prepare`] makes them, and [`MovingRig::by`] gives the rig
/// another engine.
///
/// # Errors
/// As [`simulate_watched`].
pub fn simulate_prepared<T: Real, C: ControlLaw<T>>(
    spec: &RunSpec<'_>,
    servo: &Servo<T, C>,
    prepared: Prepared<'_, T>,
    keep: Keep,
    progress: Report<'_>,
) -> Result<Run, RunError> {
    let (volts, engine) = (prepared.volts, prepared.engine);
    let mut run = ClosedLoop::of(spec, servo, prepared)?;
    let p = &spec.run;
    let period: f64 = spec.period.seconds();
    let ticks = p.ticks(spec.period);

    let kept = if keep == Keep::Trace { ticks } else { 0 };
    let mut trace = Trace { start_voltage: volts, ..Trace::with_room(kept)? };
    for name in servo.law().term_names() {
        trace.terms.push((name, room(kept)?));
    }
    let mut events = Vec::new();
    let mut figures = MetricsBuilder::new(period, p.settle);
    let mut detector = Detector::new(spec, keep)?;
    let mut detections = Vec::new();
    for k in 0..ticks {
        if k % REPORT_EVERY == 0 {
            let told = progress(Progress { total: ticks, finished: REPORT_EVERY.min(ticks - k) });
            if told.is_break() {
                return Err(RunError::Stopped);
            }
        }
        let Sample { time, target, target_position, shaft, counts, out, commanded } = run.sample(k);
        let error = target_position - shaft.position;
        figures.sample(time, MetricsSample { error, velocity: shaft.velocity, voltage: commanded });
        if keep == Keep::Trace {
            trace.time.push(time);
            trace.target_position.push(target_position);
            trace.target_fixed.push(target.position);
            trace.target_velocity.push(target.velocity.to_f64());
            trace.target_acceleration.push(target.acceleration.to_f64());
            trace.position.push(shaft.position);
            trace.velocity.push(shaft.velocity);
            trace.error.push(error);
            trace.counts.push(counts.0);
            trace.measured_error.push(out.tick.error.to_f64());
            trace.error_rate.push(out.tick.error_rate.to_f64());
            trace.code.push(out.code.0);
            trace.voltage.push(commanded);
            trace.demand.push(out.command.voltage.to_f64());
            trace.limit.push(out.command.limit);
            trace.stuck.push(shaft.motion == Motion::Stuck);
            for (column, value) in trace.terms.iter_mut().zip(out.command.terms.values()) {
                column.1.push(value.to_f64());
            }
        }

        let begins = detector.sample(k, counts, target.velocity.to_f64(), commanded).begins;
        if begins && keep == Keep::Trace {
            detections.push(k);
        }
        let seen = run.advance()?;
        figures.period(time, shaft.motion == Motion::Stuck, seen);
        if keep == Keep::Trace {
            events.extend_from_slice(seen);
        }
    }
    let metrics = figures.finish();
    let detected = detector.finish(metrics.measured_s);
    Ok(Run { trace, events, metrics, detected, detections, engine })
}

/// Rig, servo and path, tick by tick: the one order of a simulated period.
pub(crate) struct ClosedLoop<'a, 's, T: Real, C: ControlLaw<T>> {
    servo: &'s Servo<T, C>,
    state: ServoState<T, C::State>,
    reference: Reference<'a, T>,
    map: Option<FrictionMap<'a>>,
    moving: MovingRig,
    period: f64,
}

/// A sample of a closed loop, and the answer to it.
pub(crate) struct Sample<T: Real, Terms> {
    pub(crate) time: f64,
    pub(crate) target: Target<T>,
    /// `θ_d`, rad.
    pub(crate) target_position: f64,
    pub(crate) shaft: Shaft,
    pub(crate) counts: Counts,
    pub(crate) out: ServoOutput<T, Terms>,
    /// Voltage that goes out, V.
    pub(crate) commanded: f64,
}

impl<'a, 's, T: Real, C: ControlLaw<T>> ClosedLoop<'a, 's, T, C> {
    /// The start of a run.
    pub(crate) fn begin(spec: &RunSpec<'a>, servo: &'s Servo<T, C>) -> Result<Self, RunError> {
        ClosedLoop::of(spec, servo, spec.prepare::<T>()?)
    }

    fn of(spec: &RunSpec<'a>, servo: &'s Servo<T, C>, prepared: Prepared<'a, T>) -> Result<Self, RunError> {
        let encoder = Encoder::new::<f64>(spec.rig.encoder.sensor.counts_per_rev)?;
        if servo.period() != spec.period || servo.encoder() != encoder {
            return Err(RunError::OtherServo);
        }
        let state = prepared.servo_state(servo);
        let Prepared { reference, moving, .. } = prepared;
        let period = spec.period.seconds();
        Ok(ClosedLoop { servo, state, reference, map: spec.friction_map, moving, period })
    }

    /// Tick `k` begins: sensor, law, converter.
    #[inline]
    pub(crate) fn sample(&mut self, k: u64) -> Sample<T, C::Terms> {
        let moving = &mut self.moving;
        let time = k as f64 * self.period;
        let target = self.reference.at(k);
        moving.set_time(time);
        moving.begin_period();
        let shaft = *moving.shaft();
        let counts = moving.counts();
        let rig = moving.rig();
        let map = |position| self.map.map_or_else(Place::default, |map| map.at(position));
        let out = if rig.params.encoder.quantised {
            self.servo.tick_on(&mut self.state, counts, &target, map)
        } else {
            self.servo.tick_at(&mut self.state, moving.fine_counts(), &target, map)
        };
        let commanded =
            if rig.params.dac.quantised { rig.dac.volts(out.code) } else { out.command.voltage.to_f64() };
        let radians: f64 = rig.encoder.radians_per_count();
        let target_position = target.position.minus::<f64>(FixedCounts(0)) * radians;
        moving.command(commanded);
        Sample { time, target, target_position, shaft, counts, out, commanded }
    }

    /// The period passes; what happened in it.
    #[inline]
    pub(crate) fn advance(&mut self) -> Result<&[Event], EngineError> {
        self.moving.advance(self.period)
    }
}
