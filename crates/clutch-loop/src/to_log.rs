//! The records that a log gets of each sample, of the link and of the shaft.

use crate::build_error::BuildError;
use crate::drift::Alarm;
use crate::from_scenario;
use crate::onlooker::Looking;
use clutch_core::law::{Command, Terms, Tick};
use clutch_core::supervisor::{Arrival, Cause, Cycle, State};
use clutch_core::{Dac, DacCode, Micros, Real, Servo, ServoOutput, Target};
use clutch_log::{
    CommandRecord, EventKind, EventRecord, Header, LogError, LogWriter, MAX_TERMS, Record, SampleRecord,
    Source, TruthRecord,
};
use clutch_node::{CycleNotice, Ending};
use clutch_sim::engine::Motion;
use clutch_sim::progress::{Progress, Report};
use clutch_sim::run::Trace;
use clutch_sim::scenario::ScalarKind;
use clutch_sim::{MovingRig, Scenario};
use clutch_wire::{BoardState, Sample};
use std::path::Path;

/// Key of the header under which the code at arming stands.
pub const PRESENT_CODE: &str = "present_code";
/// Key of the header under which a simulation's voltage at the start stands: its bits, in hex.
pub const START_VOLTAGE: &str = "start_voltage_bits";
/// Name of the law in a log's header, if it is none of clutch's: the scenario's own law then did not run.
pub const FOREIGN_LAW: &str = "foreign_law";

/// A change of the supervisor's state, if this was one.
#[must_use]
pub fn change<T: Real, X>(time_ns: u64, cycle: &Cycle<T, X>) -> Option<Record> {
    let Cycle { from, state, cause, value, tick, .. } = *cycle;
    (from != state)
        .then(|| event(EventKind::StateChange, time_ns, &Ending { from, state, cause, value, tick }))
}

/// An end that no sample brought: silence, the board's own report, an operator, the path's end.
#[must_use]
pub fn ended<T: Real>(time_ns: u64, ending: &Ending<T>) -> Record {
    event(EventKind::Ended, time_ns, ending)
}

/// Friction over load left the bounds.
#[must_use]
pub fn drift(time_ns: u64, state: State, alarm: &Alarm) -> Record {
    let (cause, value, tick) = (Cause::None, alarm.seen.friction, alarm.tick);
    event(EventKind::Drift, time_ns, &Ending { from: state, state, cause, value, tick })
}

fn event<T: Real>(kind: EventKind, time_ns: u64, e: &Ending<T>) -> Record {
    Record::Event(EventRecord::of(kind, e, time_ns))
}

/// Terms as a trace has them.
#[derive(Clone, Copy, Default)]
struct Traced<T> {
    values: [T; MAX_TERMS],
    count: usize,
}

impl<T: Real> Terms<T> for Traced<T> {
    fn values(&self) -> &[T] {
        &self.values[..self.count]
    }
}

impl<T: Real> Traced<T> {
    fn at(trace: &Trace, i: usize) -> Self {
        let mut terms = Traced { values: [T::ZERO; MAX_TERMS], count: trace.terms.len().min(MAX_TERMS) };
        for (value, (_, traced)) in terms.values.iter_mut().zip(&trace.terms) {
            *value = T::from_f64(traced[i]);
        }
        terms
    }
}

/// The cycle of a simulation's sample, as a controller would report it. The law's numbers were of its scalar before the
/// trace had them, and the target was rounded to it before the law saw it.
fn cycle<T: Real>(t: &Trace, i: usize) -> Cycle<T, Traced<T>> {
    let [error, error_rate] = [t.measured_error[i], t.error_rate[i]].map(T::from_f64);
    let [velocity, acceleration] = [t.target_velocity[i], t.target_acceleration[i]].map(T::from_f64);
    let tick = Tick { error, error_rate, target_velocity: velocity, target_acceleration: acceleration };
    let code = DacCode(t.code[i]);
    let voltage = T::from_f64(t.demand[i]);
    let command = Command { voltage, limit: t.limit[i], terms: Traced::at(t, i) };
    Cycle {
        tick: i as u64,
        arrival: Arrival::Fresh,
        from: State::Running,
        state: State::Running,
        cause: Cause::None,
        value: T::ZERO,
        answer: Some(code),
        code,
        target: Target { position: t.target_fixed[i], velocity, acceleration },
        output: Some(ServoOutput { code, tick, command }),
    }
}

/// Records of a simulation: every sample with its command and the shaft's true state.
fn of_simulation<T: Real>(
    run: &clutch_sim::Run,
    dac: Dac<T>,
    radians_per_count: f64,
    period: Micros,
) -> impl Iterator<Item = [Record; 3]> {
    let t = &run.trace;
    let period_us = u64::from(period.0);
    (0..t.time.len()).map(move |i| {
        let tick = i as u64;
        let time_ns = tick * period_us * 1000;
        let cycle = cycle::<T>(t, i);
        let sample = Sample {
            run: 0,
            sequence: tick as u16,
            time_us: (tick * period_us) as u32,
            counts: t.counts[i],
            status: BoardState::Running as u8,
        };
        let notice = CycleNotice { sample, superseded: false, lateness: Micros(0), cycles: 0, cycle };
        [
            Record::Sample(SampleRecord::of(&notice, time_ns, 0, 0, radians_per_count)),
            Record::Command(CommandRecord::of(&notice.cycle, time_ns, &dac, radians_per_count)),
            Record::Truth(TruthRecord {
                tick,
                time_ns,
                position: t.position[i],
                velocity: t.velocity[i],
                stuck: t.stuck[i],
            }),
        ]
    })
}

/// Samples between two reports of progress, of a replay, too: milliseconds.
pub(crate) const REPORT_EVERY: usize = 4096;

/// Writes a simulation as a log, with the channels that a loop writes and the shaft's true motion;
/// `version` is the build's, `foreign_law` the name of the law that ran if it is none of clutch's.
///
/// # Errors
/// The file cannot be written; `report` ended the writing, and the file is gone.
pub fn save_simulation(
    path: &Path,
    scenario: &Scenario,
    run: &clutch_sim::Run,
    version: &str,
    foreign_law: Option<&str>,
    report: Report<'_>,
) -> Result<(), SaveError> {
    match (scenario.scalar(), foreign_law) {
        (ScalarKind::F32, None) => save_in::<f32>(path, scenario, run, version, foreign_law, report),
        // A foreign law has double precision.
        (ScalarKind::F64, _) | (_, Some(_)) => {
            save_in::<f64>(path, scenario, run, version, foreign_law, report)
        }
    }
}

/// A simulation could not be written.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The file.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The scenario.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The caller ended the writing.
    #[error("the writing was ended")]
    Stopped,
}

/// Plays a simulation at its own pace to one that looks on, with the records that a log of it has; until its end, or a
/// stop.
///
/// # Errors
/// The scenario.
pub fn play_simulation(
    looking: &Looking,
    scenario: &Scenario,
    run: &clutch_sim::Run,
    version: &str,
) -> Result<(), BuildError> {
    match scenario.scalar() {
        ScalarKind::F32 => play_in::<f32>(looking, scenario, run, version),
        ScalarKind::F64 => play_in::<f64>(looking, scenario, run, version),
    }
}

fn play_in<T: Real>(
    looking: &Looking,
    scenario: &Scenario,
    run: &clutch_sim::Run,
    version: &str,
) -> Result<(), BuildError> {
    let (header, mut ticks) = simulation::<T>(scenario, run, version, None)?;
    let mut played = looking.begin(&header, scenario);
    ticks.all(|tick| {
        tick.iter().for_each(|record| played.show(record));
        !played.stopped()
    });
    Ok(())
}

/// The header and the records of a simulation.
fn simulation<'a, T: Real>(
    scenario: &Scenario,
    run: &'a clutch_sim::Run,
    version: &str,
    foreign_law: Option<&str>,
) -> Result<(Header, impl Iterator<Item = [Record; 3]> + use<'a, T>), BuildError> {
    let spec = scenario.spec();
    let servo = Servo::<T>::new(&spec.servo()?.cast()).map_err(|e| e.cast::<f64>())?;
    let mut header = from_scenario::header(scenario, &servo, Source::Simulation, "", version);
    let bits = format!("{:016x}", run.trace.start_voltage.to_bits());
    header.extra.push((START_VOLTAGE.to_owned(), bits));
    if let Some(name) = foreign_law {
        header.extra.push((FOREIGN_LAW.to_owned(), name.to_owned()));
        header.term_names = run.trace.terms.iter().map(|(name, _)| (*name).to_owned()).collect();
        (header.law_hash, header.scalar) = (0, "f64".to_owned());
    } else if let Ok(plan) = scenario.plan() {
        // As a loop's; a path that no plan takes has none.
        let sampled = scenario.sampled(&plan.bounds);
        header.extra.extend(sampled.verdicts(plan.certificate.certified(), None));
    }
    Ok((header, of_simulation(run, *servo.dac(), servo.encoder().radians_per_count(), spec.period)))
}

fn save_in<T: Real>(
    path: &Path,
    scenario: &Scenario,
    run: &clutch_sim::Run,
    version: &str,
    foreign_law: Option<&str>,
    report: Report<'_>,
) -> Result<(), SaveError> {
    let (header, ticks) = simulation::<T>(scenario, run, version, foreign_law)?;
    let mut log = LogWriter::create(path, &header)?;
    let total = run.trace.time.len();
    for (i, tick) in ticks.enumerate() {
        let finished = REPORT_EVERY.min(total - i) as u64;
        if i % REPORT_EVERY == 0 && report(Progress { total: total as u64, finished }).is_break() {
            drop(log);
            // It would read as a log that was cut; nobody wants it.
            let removed = std::fs::remove_file(path);
            removed.map_err(|source| {
                SaveError::Log(LogError::Io { path: path.into(), action: "cannot be removed", source })
            })?;
            return Err(SaveError::Stopped);
        }
        for record in &tick {
            log.write(record)?;
        }
    }
    log.finish()?;
    Ok(())
}

/// The shaft as it truly is.
#[must_use]
pub fn truth(time_ns: u64, tick: u64, rig: &MovingRig) -> TruthRecord {
    let shaft = rig.shaft();
    TruthRecord {
        tick,
        time_ns,
        position: shaft.position,
        velocity: shaft.velocity,
        stuck: shaft.motion == Motion::Stuck,
    }
}
