//! One run: rig, servo and path in closed loop.

use crate::detected::Detector;
use crate::engine::{EngineError, EngineKind, Event, Motion, Shaft};
use crate::metrics::{Detected, Metrics, MetricsBuilder, MetricsSample};
use crate::moving_rig::MovingRig;
use crate::progress::{Progress, Report, UNWATCHED};
use clutch_core::law::{ControlLaw, Limit, Terms};
use clutch_core::reference::Reference;
use clutch_core::{
    Counts, Encoder, FixedCounts, FrictionMap, Place, Real, Servo, ServoOutput, ServoState, Target,
};

pub use crate::run_spec::{Keep, Prepared, RunError, RunParams, RunSpec, Start};

/// Samples between two reports of progress: some milliseconds, so that whoever stops a run waits no longer.
pub(crate) const REPORT_EVERY: u64 = 16_384;

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

/// A column of a table of samples.
#[derive(Clone, Copy, Debug)]
pub struct SampleColumn {
    /// Its name, with its unit.
    pub name: &'static str,
    /// Its meaning.
    pub meaning: &'static str,
    /// Its values, of a run's samples.
    pub values: fn(&Trace) -> Values<'_>,
}

/// Values of a column of samples.
#[derive(Clone, Copy, Debug)]
pub enum Values<'a> {
    /// Real numbers.
    Real(&'a [f64]),
    /// Counts of the encoder.
    Counts(&'a [i32]),
    /// Codes of the converter.
    Codes(&'a [u16]),
    /// Limits of the output, as numbers.
    Limits(&'a [Limit]),
    /// True or not.
    Flags(&'a [bool]),
}

macro_rules! sample_columns {
    ($($name:literal $meaning:literal $kind:ident $field:ident;)+) => {
        /// Columns of a table of samples, beside those of the law's terms.
        pub const SAMPLE_COLUMNS: &[SampleColumn] = &[$(SampleColumn {
            name: $name,
            meaning: $meaning,
            values: |trace| Values::$kind(&trace.$field),
        }),+];
    };
}
sample_columns! {
    "time_s" "time of the sample" Real time;
    "target_position_rad" "target position, from the encoder's zero" Real target_position;
    "target_velocity_rad_s" "target velocity" Real target_velocity;
    "target_acceleration_rad_s2" "target acceleration" Real target_acceleration;
    "position_rad" "true position" Real position;
    "velocity_rad_s" "true velocity; exactly 0 when stuck" Real velocity;
    "error_rad" "true error, target less position" Real error;
    "counts" "the encoder's counts" Counts counts;
    "measured_error_rad" "error as the law saw it" Real measured_error;
    "error_rate_rad_s" "rate of the error as the law saw it" Real error_rate;
    "code" "code given to the converter" Codes code;
    "voltage_v" "voltage commanded at this sample, before delay and lag" Real voltage;
    "demand_v" "the law's answer, before the converter" Real demand;
    "limit" "limit of the output that decided it: 0 none, 1 the lowest, 2 the highest, 3 the demand was no number" Limits limit;
    "stuck" "the shaft is stuck at the sample" Flags stuck;
}

impl Trace {
    /// The law's terms as columns of a table of samples; a name that a sample has already gets `law_` before it.
    pub fn term_columns(&self) -> impl Iterator<Item = (String, &[f64])> {
        self.terms.iter().map(|(name, values)| {
            let taken = SAMPLE_COLUMNS.iter().any(|column| column.name == *name);
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
