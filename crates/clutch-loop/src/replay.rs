//! Replay: the recorded counts to the recorded law, every output compared bit for bit.

use crate::build_error::BuildError;
use crate::drift::{Drift, DriftReport};
use crate::from_scenario::{self, BuiltRun};
use crate::live_gains;
use crate::to_log::{FOREIGN_LAW, PRESENT_CODE, REPORT_EVERY, START_VOLTAGE};
use clutch_core::law::ControlLaw;
use clutch_core::supervisor::{Arrival, BoardMode, Cause, Cycle, Sample, State};
use clutch_core::{
    BeginningAt, Counts, DacCode, FixedCounts, Micros, Place, Real, Servo, SupervisorState, Target,
};
use clutch_log::{CommandRecord, EventKind, EventRecord, InChannel, Kind, Log, SampleRecord, Source, Value};
use clutch_sim::detected::Detector;
use clutch_sim::progress::{Progress, Report};
use clutch_sim::scenario::ScalarKind;
use clutch_sim::{Keep, Scenario};
use clutch_wire::{BoardState, STATUS_DAC_FAULT, STATUS_ENCODER_FAULT, STATUS_LATE, STATUS_STATE};

/// A log could not be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// Its scenario.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// It does not say something that a replay needs.
    #[error("the log lacks {0}: it was not written by `clutch loop` or `clutch sim --log`")]
    Lacks(&'static str),
    /// Its law is none of clutch's.
    #[error(
        "the law that ran was {0}, written in Python, and the log has its name only: replay it with clutch.replay(log, law=…)"
    )]
    Foreign(
        /// Its name.
        String,
    ),
    /// It is of no simulation.
    #[error("the log is of a loop, which runs clutch's own laws: give no law to its replay")]
    NoSimulation,
    /// Its samples do not determine the law's inputs.
    #[error(
        "the log is of a run with an ideal sensor (rig.encoder.quantised = false), and holds whole counts only; it cannot be replayed"
    )]
    Ideal,
    /// The caller ended the replay.
    #[error("the replay was ended")]
    Stopped,
    /// Samples and commands do not belong together.
    #[error(
        "the log has {samples} samples and {commands} commands, where each sample has one: it is damaged"
    )]
    Unpaired {
        /// Samples.
        samples: usize,
        /// Commands.
        commands: usize,
    },
}

/// The first tick and field that differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Tick.
    pub tick: u64,
    /// Field of the channel `/command`.
    pub field: String,
    /// In the log.
    pub logged: f64,
    /// In the replay.
    pub replayed: f64,
}

/// A replay.
#[derive(Clone, Debug)]
pub struct Replay {
    /// The commands of the replay, one for each that was logged before the first gap.
    pub commands: Vec<CommandRecord>,
    /// The first difference, if there is one.
    pub first: Option<Difference>,
    /// Records that the log dropped.
    pub dropped: u64,
    /// Commands in the log behind its first gap: they are not comparable.
    pub behind_gap: usize,
    /// Terms that the logged law had more or fewer than this one, as that of a former version: they are not comparable.
    pub terms_apart: usize,
}

/// Ticks in order; every few thousand the caller gets a report, and may end the work.
fn ticks<'a, R>(
    ticks: &'a [R],
    report: Report<'a>,
) -> impl Iterator<Item = Result<&'a R, ReplayError>> + use<'a, R> {
    let total = ticks.len() as u64;
    ticks.iter().enumerate().map(move |(i, tick)| {
        let finished = REPORT_EVERY.min(ticks.len() - i) as u64;
        if i % REPORT_EVERY == 0 && report(Progress { total, finished }).is_break() {
            return Err(ReplayError::Stopped);
        }
        Ok(tick)
    })
}

/// The first field that both have and in which two commands differ, in its bits; times may.
fn difference(
    columns: &[(String, Kind)],
    logged: &CommandRecord,
    replayed: &CommandRecord,
) -> Option<Difference> {
    let number = |value: Value| match value {
        Value::Whole(x) => x as f64,
        Value::Real(x) => x,
        Value::Flag(x) => f64::from(u8::from(x)),
    };
    let bits = |value: Value| match value {
        Value::Real(x) => Value::Whole(x.to_bits() as i64),
        other => other,
    };
    let pairs = columns.iter().zip(logged.values().zip(replayed.values()));
    pairs.into_iter().find_map(|((field, _), (logged_value, replayed_value))| {
        (bits(logged_value) != bits(replayed_value)).then(|| Difference {
            tick: logged.tick,
            field: field.clone(),
            logged: number(logged_value),
            replayed: number(replayed_value),
        })
    })
}

/// Replays a log under a scenario: its own, or one with other parameters.
///
/// # Errors
/// The scenario is not one for a run like the log's; `report` ended it.
pub fn replay(log: &Log, scenario: &Scenario, report: Report<'_>) -> Result<Replay, ReplayError> {
    if let Some(name) = extra(log, FOREIGN_LAW) {
        return Err(ReplayError::Foreign(name.to_owned()));
    }
    match scenario.scalar() {
        ScalarKind::F32 => replay_in::<f32>(log, scenario, report),
        ScalarKind::F64 => replay_in::<f64>(log, scenario, report),
    }
}

/// Replays a simulation's log with a law that is none of clutch's, in double precision; the scenario's own is not used.
///
/// # Errors
/// The log is of no simulation; the scenario is not one for a run like it; `report` ended it.
pub fn replay_law<C: ControlLaw<f64>>(
    log: &Log,
    scenario: &Scenario,
    law: C,
    report: Report<'_>,
) -> Result<Replay, ReplayError> {
    if log.header.source != Source::Simulation {
        return Err(ReplayError::NoSimulation);
    }
    let samples = paired(log)?;
    let servo = Servo::with_law(&scenario.spec().servo().map_err(BuildError::from)?, law);
    let servo = servo.map_err(BuildError::from)?;
    compared(log, simulated(log, samples, scenario, &servo, report)?, report)
}

/// The drift of friction over load in a log, by a scenario's model and bounds: its own, or others. Lost samples and gaps of
/// the log interrupt it.
///
/// # Errors
/// The scenario is none for a run like the log's; samples and commands do not belong together;
/// `report` ended it.
pub fn drift(log: &Log, scenario: &Scenario, report: Report<'_>) -> Result<DriftReport, ReplayError> {
    let samples = paired(log)?;
    let plan = scenario.plan().map_err(BuildError::from)?;
    let mut detector = Detector::new(&scenario.spec(), Keep::Trace).map_err(BuildError::from)?;
    let mut drift = Drift::new(scenario, &plan.bounds)?;
    // A simulated converter may give what it is asked for; a log has its code and the demand.
    let exact = log.header.source == Source::Simulation && !scenario.spec().rig.dac.quantised;
    for (sample, command) in ticks(samples, report).zip(&log.commands) {
        let voltage = if exact { command.demand } else { command.voltage };
        drift.watch_log(&mut detector, [(sample?, &CommandRecord { voltage, ..*command })]);
    }
    Ok(*drift.report())
}

fn replay_in<T: Real>(log: &Log, scenario: &Scenario, report: Report<'_>) -> Result<Replay, ReplayError> {
    let samples = paired(log)?;
    let commands = match log.header.source {
        Source::Simulation => {
            let params = scenario.spec().servo().map_err(BuildError::from)?.cast::<T>();
            let servo = Servo::<T>::new(&params).map_err(|e| BuildError::from(e.cast::<f64>()))?;
            simulated(log, samples, scenario, &servo, report)?
        }
        Source::Loop | Source::Replay => looped::<T>(log, samples, scenario, report)?,
    };
    compared(log, commands, report)
}

/// Samples that have a command, up to the first gap.
fn paired(log: &Log) -> Result<&[SampleRecord], ReplayError> {
    let dropped = log.events.iter().find(|e| e.kind == EventKind::LogDropped as u8).map(|e| e.time_ns);
    let gap = [log.gap_from_ns, dropped].into_iter().flatten().min();
    if log.samples.len() != log.commands.len() && log.complete && gap.is_none() {
        let (samples, commands) = (log.samples.len(), log.commands.len());
        return Err(ReplayError::Unpaired { samples, commands });
    }
    // The law's filters and integrals behind a gap are not known.
    let before = |time_ns: u64| gap.is_none_or(|from| time_ns < from);
    let pairs = log.samples.iter().zip(&log.commands);
    let pairs = pairs.take_while(|(s, c)| before(s.time_ns) && before(c.time_ns)).count();
    Ok(log.samples.get(..pairs).unwrap_or(&[]))
}

fn compared(log: &Log, commands: Vec<CommandRecord>, report: Report<'_>) -> Result<Replay, ReplayError> {
    let columns = CommandRecord::CHANNEL.columns(&log.header.term_names);
    let mut first = None;
    for (logged, replayed) in ticks(&log.commands, report).zip(&commands) {
        first = difference(&columns, logged?, replayed);
        if first.is_some() {
            break;
        }
    }
    let dropped = log.links.iter().map(|l| l.log_dropped).max().unwrap_or(0);
    // A log that was cut may have one sample more than it has commands, or the other way round.
    let behind_gap = log.samples.len().min(log.commands.len()).saturating_sub(commands.len());
    let terms = |commands: &[CommandRecord]| commands.first().map_or(0, |c| c.terms.len());
    let terms_apart = terms(&log.commands).abs_diff(terms(&commands));
    Ok(Replay { commands, first, dropped, behind_gap, terms_apart })
}

fn extra<'a>(log: &'a Log, key: &str) -> Option<&'a str> {
    log.header.extra.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str())
}

fn seen(s: &SampleRecord) -> Sample {
    Sample {
        sequence: s.sequence,
        time: Micros(s.board_time_us),
        counts: Counts(s.counts),
        board: match BoardState::from_u8(s.status & STATUS_STATE) {
            Some(BoardState::Ready) => BoardMode::Ready,
            Some(BoardState::Armed | BoardState::Running) => BoardMode::Driving,
            _ => BoardMode::Safe,
        },
        encoder_fault: s.status & STATUS_ENCODER_FAULT != 0,
        converter_fault: s.status & STATUS_DAC_FAULT != 0,
        command_late: s.status & STATUS_LATE != 0,
        superseded: s.superseded,
        lateness: Micros(s.lateness_us),
    }
}

fn looped<T: Real>(
    log: &Log,
    samples: &[SampleRecord],
    scenario: &Scenario,
    report: Report<'_>,
) -> Result<Vec<CommandRecord>, ReplayError> {
    let present = extra(log, PRESENT_CODE).and_then(|v| v.parse().ok());
    let present = present.ok_or(ReplayError::Lacks("the code at arming"))?;
    let built = BuiltRun::<T>::new(scenario, 0)?;
    let (mut servo, supervisor) = (built.servo, &built.supervisor);
    let mut changed = Changed::new(log, scenario);
    let path = from_scenario::path::<T>(scenario)?;
    let radians = servo.encoder().radians_per_count::<f64>();
    let mut state = SupervisorState::default();
    supervisor.connect(&mut state);
    supervisor.arm(&mut state, DacCode(present));
    let mut origin = FixedCounts(0);
    // Ends that no sample brought, in order.
    let ended = EventKind::Ended as u8;
    let mut ends = log.events.iter().filter(|e| e.kind == ended).peekable();
    let mut commands = Vec::with_capacity(samples.len());
    for sample in ticks(samples, report) {
        let sample = sample?;
        let safe = seen(sample).board == BoardMode::Safe;
        // The board's own report comes just before the first sample that shows its safe state;
        // what else ended control came between two wake-ups.
        let own = |e: &EventRecord| e.cause == Cause::Board as u8 || e.cause == Cause::Late as u8;
        let before =
            |e: &&EventRecord| e.time_ns < sample.time_ns || (e.time_ns == sample.time_ns && own(e) && safe);
        while let Some(end) = ends.next_if(before) {
            match end.cause {
                c if c == Cause::Silence as u8 => supervisor.silence(&mut state, u32::MAX),
                c if c == Cause::Clock as u8 => supervisor.off_pace(&mut state, end.value as i32),
                c if c == Cause::Done as u8 => supervisor.stop(&mut state, Cause::Done),
                c if c == Cause::Operator as u8 => supervisor.stop(&mut state, Cause::Operator),
                _ => supervisor.board_fault(&mut state, T::from_f64(end.value)),
            }
        }
        if state.state() == State::Armed {
            origin = FixedCounts::from_counts(i64::from(sample.counts));
        }
        if let Some(scenario) = changed.by(sample.time_ns)? {
            servo = BuiltRun::<T>::new(scenario, 0)?.servo;
        }
        let planned = BeginningAt { planned: &path, origin };
        let cycle = supervisor.sample(&servo, &mut state, &seen(sample), planned);
        commands.push(CommandRecord::of(&cycle, sample.time_ns, servo.dac(), radians));
    }
    Ok(commands)
}

/// The changes of gains that a log has, one after the other. A parameter that a replay has its own value of keeps that.
struct Changed<'a> {
    log: &'a Log,
    scenario: Scenario,
    /// Values of the replay's parameters, as they were at its start.
    asked: Vec<(String, String)>,
    next: usize,
}

impl<'a> Changed<'a> {
    fn new(log: &'a Log, scenario: &Scenario) -> Self {
        Changed { log, scenario: scenario.clone(), asked: scenario.parameters(), next: 0 }
    }

    /// The scenario with what was changed before a sample at this time; none if nothing was since the last call.
    fn by(&mut self, time_ns: u64) -> Result<Option<&Scenario>, ReplayError> {
        let mut any = false;
        while let Some(change) = self.log.changes.get(self.next).filter(|change| change.time_ns <= time_ns) {
            self.next += 1;
            let logged = self.log.header.parameters.get(usize::from(change.parameter));
            let (key, value) = logged.ok_or(ReplayError::Lacks("the parameter that was changed"))?;
            if self.asked.iter().any(|(k, v)| k == key && v == value) {
                self.scenario =
                    live_gains::with(&self.scenario, key, change.value).map_err(BuildError::from)?;
                any = true;
            }
        }
        Ok(any.then_some(&self.scenario))
    }
}

fn simulated<T: Real, C: ControlLaw<T>>(
    log: &Log,
    samples: &[SampleRecord],
    scenario: &Scenario,
    servo: &Servo<T, C>,
    report: Report<'_>,
) -> Result<Vec<CommandRecord>, ReplayError> {
    let spec = scenario.spec();
    if !spec.rig.encoder.quantised {
        return Err(ReplayError::Ideal);
    }
    let volts = extra(log, START_VOLTAGE).and_then(|v| u64::from_str_radix(v, 16).ok());
    let volts = f64::from_bits(volts.ok_or(ReplayError::Lacks("the voltage at the start"))?);
    let path = spec.path::<T>().map_err(BuildError::from)?;
    let radians = servo.encoder().radians_per_count::<f64>();
    let Some(first) = samples.first() else { return Ok(Vec::new()) };
    let mut state = servo.start(Counts(first.counts), &path.at(0), T::from_f64(volts));
    ticks(samples, report)
        .map(|sample| {
            let sample = sample?;
            let target = path.at(sample.tick);
            let map = |position| spec.friction_map.map_or_else(Place::default, |map| map.at(position));
            let output = servo.tick_on(&mut state, Counts(sample.counts), &target, map);
            let cycle = simulated_cycle(sample.tick, target, output);
            Ok(CommandRecord::of(&cycle, sample.time_ns, servo.dac(), radians))
        })
        .collect()
}

/// A tick of a simulation, in the form of a loop's.
#[must_use]
pub fn simulated_cycle<T: Real, X>(
    tick: u64,
    target: Target<T>,
    output: clutch_core::ServoOutput<T, X>,
) -> Cycle<T, X> {
    Cycle {
        tick,
        arrival: Arrival::Fresh,
        from: State::Running,
        state: State::Running,
        cause: Cause::None,
        value: T::ZERO,
        answer: Some(output.code),
        code: output.code,
        target,
        output: Some(output),
    }
}
