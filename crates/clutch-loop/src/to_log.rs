//! The records that a log gets of each sample, of the link and of the shaft.

use crate::build_error::BuildError;
use crate::drift::Alarm;
use crate::from_scenario;
use crate::onlooker::Looking;
use clutch_core::law::Terms;
use clutch_core::supervisor::{Cause, Cycle, State};
use clutch_core::{Dac, FixedCounts, Real, Servo};
use clutch_log::{
    CommandRecord, CommandSource, EventKind, EventRecord, Header, LinkRecord, LogError, LogWriter, Record,
    SampleRecord, Source, TruthRecord,
};
use clutch_node::{CycleNotice, Ending, LinkCounts};
use clutch_sim::engine::Motion;
use clutch_sim::progress::{Progress, Report};
use clutch_sim::scenario::ScalarKind;
use clutch_sim::{MovingRig, Scenario};
use std::path::Path;

/// Key of the header under which the code at arming stands.
pub const PRESENT_CODE: &str = "present_code";
/// Key of the header under which a simulation's voltage at the start stands: its bits, in hex.
pub const START_VOLTAGE: &str = "start_voltage_bits";
/// Name of the law in a log's header, if it is none of clutch's: the scenario's own law then did not run.
pub const FOREIGN_LAW: &str = "foreign_law";

/// A sample as it came.
#[must_use]
pub fn sample<T: Real, X>(
    time_ns: u64,
    age_us: u32,
    n: &CycleNotice<T, X>,
    radians_per_count: f64,
) -> SampleRecord {
    SampleRecord {
        tick: n.cycle.tick,
        time_ns,
        arrival: n.cycle.arrival as u8,
        sequence: n.sample.sequence,
        board_time_us: n.sample.time_us,
        counts: n.sample.counts,
        status: n.sample.status,
        age_us,
        lateness_us: n.lateness.0,
        superseded: n.superseded,
        wake_us: 0,
        position: position(n.sample.counts, n.cycle.target.position, radians_per_count),
    }
}

/// The position that counts show, rad. They wrap at 2³² and a target does not: of the positions that they can be it is the
/// one nearest to the target.
fn position(counts: i32, target: FixedCounts, radians_per_count: f64) -> f64 {
    const WRAPS: u32 = i64::BITS - i32::BITS - FixedCounts::FRACTION_BITS;
    let counts = FixedCounts::from_counts(i64::from(counts));
    let behind = target.0.wrapping_sub(counts.0) << WRAPS >> WRAPS;
    let position = FixedCounts(target.0.wrapping_sub(behind));
    position.minus::<f64>(FixedCounts(0)) * radians_per_count
}

/// The command that a sample led to. Every real is a double; a number in single precision is one
/// exactly.
#[must_use]
pub fn command<T: Real, X: Terms<T>>(
    time_ns: u64,
    cycle: &Cycle<T, X>,
    dac: &Dac<T>,
    radians_per_count: f64,
) -> CommandRecord {
    let safe = matches!(cycle.state, State::Holding | State::Released | State::Faulted);
    let source = match (safe, cycle.output.is_some()) {
        (true, _) => CommandSource::Safe,
        (false, true) => CommandSource::Law,
        (false, false) => CommandSource::Unanswered,
    };
    let target = cycle.target;
    let mut record = CommandRecord {
        tick: cycle.tick,
        time_ns,
        state: cycle.state as u8,
        source: source as u8,
        code: cycle.code.0,
        voltage: dac.volts(cycle.code).to_f64(),
        target_fixed: target.position.0,
        target_position: target.position.minus::<f64>(FixedCounts(0)) * radians_per_count,
        target_velocity: target.velocity.to_f64(),
        target_acceleration: target.acceleration.to_f64(),
        ..CommandRecord::default()
    };
    if let Some(out) = &cycle.output {
        record.limit = out.command.limit as u8;
        record.demand = out.command.voltage.to_f64();
        record.error = out.tick.error.to_f64();
        record.error_rate = out.tick.error_rate.to_f64();
        record.terms = out.command.terms.values().iter().map(|value| value.to_f64()).collect();
    }
    record
}

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
    Record::Event(EventRecord {
        tick: e.tick,
        time_ns,
        kind: kind as u8,
        from: e.from as u8,
        to: e.state as u8,
        cause: e.cause as u8,
        value: e.value.to_f64(),
    })
}

/// Records of a simulation: every sample with its command and the shaft's true state.
fn of_simulation<T: Real>(
    run: &clutch_sim::Run,
    dac: Dac<T>,
    radians_per_count: f64,
    period: clutch_core::Micros,
) -> impl Iterator<Item = [Record; 3]> {
    let t = &run.trace;
    let period_ns = u64::from(period.0) * 1000;
    (0..t.time.len()).map(move |i| {
        let tick = i as u64;
        let time_ns = tick * period_ns;
        // A target was rounded to the law's scalar before the law saw it.
        let cast = |x: f64| T::from_f64(x).to_f64();
        [
            Record::Sample(SampleRecord {
                tick,
                time_ns,
                sequence: tick as u16,
                board_time_us: (time_ns / 1000) as u32,
                counts: t.counts[i],
                status: clutch_wire::BoardState::Running as u8,
                position: position(t.counts[i], t.target_fixed[i], radians_per_count),
                ..SampleRecord::default()
            }),
            Record::Command(CommandRecord {
                tick,
                time_ns,
                state: State::Running as u8,
                source: CommandSource::Law as u8,
                limit: t.limit[i] as u8,
                code: t.code[i],
                voltage: dac.volts(clutch_core::DacCode(t.code[i])).to_f64(),
                demand: t.demand[i],
                target_fixed: t.target_fixed[i].0,
                target_position: t.target_position[i],
                target_velocity: cast(t.target_velocity[i]),
                target_acceleration: cast(t.target_acceleration[i]),
                error: t.measured_error[i],
                error_rate: t.error_rate[i],
                terms: t.terms.iter().map(|(_, values)| values[i]).collect(),
            }),
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

/// The link's counters; `(lost, implausible, deadline misses, dropped by the log)` come from
/// elsewhere.
#[must_use]
pub fn link(
    time_ns: u64,
    tick: u64,
    counts: &LinkCounts,
    (lost, rejected_samples, deadline_misses, log_dropped): (u64, u64, u64, u64),
) -> LinkRecord {
    LinkRecord {
        tick,
        time_ns,
        received: counts.received,
        lost,
        late: counts.late,
        duplicated: counts.duplicated,
        reordered: counts.reordered,
        rejected_frames: counts.bad_frames,
        rejected_samples,
        deadline_misses,
        log_dropped,
    }
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

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "exact")]
mod tests {
    use super::*;

    #[test]
    fn counts_that_wrapped_are_positions_beside_the_target() {
        let at = |counts, target| position(counts, FixedCounts::from_counts(target), 0.5);
        assert_eq!((at(7, 9), at(-7, 9)), (3.5, -3.5));
        let turn = 1_i64 << 32;
        assert_eq!(at(i32::MIN, i64::from(i32::MAX)), (turn / 2) as f64 * 0.5);
        assert_eq!(at(i32::MAX, -turn / 2), (-turn / 2 - 1) as f64 * 0.5);
        assert_eq!(at(-3, 5 * turn), (5 * turn - 3) as f64 * 0.5);
        // The target's fraction is not the encoder's.
        assert_eq!(position(7, FixedCounts(9 << 16 | 0xffff), 0.5), 3.5);
    }
}
