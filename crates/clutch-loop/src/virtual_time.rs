//! Controller, line and simulated board in virtual time: the runs of the fault campaign.
//!
//! The same state machines, frames and rig as in real time; only the clock is computed. A run of
//! one second takes some milliseconds and repeats bit for bit.

use crate::cause_words::why;
#[cfg(target_os = "linux")]
use crate::chip_board::ChipError;
use crate::faults::{Direction, Fault};
use crate::faulty_line::FaultyLine;
use crate::onlooker::Played;
use crate::sim_board::{SimBoard, SimBoardError};
use crate::station::{Station, StationNotice};
use crate::to_log;
use crate::true_motion::{At, TrueMotion};
use clutch_core::supervisor::{Cause, State};
use clutch_core::{DacCode, FixedCounts, Micros, Planned, Real};
use clutch_log::{CommandRecord, Record, SampleRecord};
use clutch_node::{Ending, Notice, Outbox, Standing};
use clutch_sim::engine::Event;
use clutch_sim::{Metrics, MovingRig, Scenario};
use clutch_wire::{BoardState, Refused, StopReason};

/// Time that a controller takes for an answer, over a part of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stall {
    /// Its start, s after arming.
    pub at: f64,
    /// Its end, s after arming.
    pub until: f64,
    /// Time that each answer takes then, s.
    pub answer: f64,
}

/// Options of a run in virtual time.
#[derive(Clone, Debug)]
pub struct VirtualOptions {
    /// One way, ns.
    pub latency_ns: u64,
    /// The faults of line and board.
    pub faults: Vec<Fault>,
    /// A controller that is too slow.
    pub stall: Option<Stall>,
    /// Seed of the line's faults.
    pub seed: u64,
    /// True if records are kept.
    pub record: bool,
    /// Time after arming at which the run ends, s; the safe state is watched until then.
    pub duration: f64,
    /// Time for which the safe state is watched, s: the run ends no later.
    pub watched: f64,
    /// Ticks after which the run is over and an orderly stop follows.
    pub ticks: u64,
    /// Time left out of the figures, s.
    pub settle: f64,
}

/// A line that loses nothing and takes no time, a controller that never stalls, and no end but that of the
/// duration, which has to be given.
impl Default for VirtualOptions {
    fn default() -> Self {
        VirtualOptions {
            latency_ns: 0,
            faults: Vec::new(),
            stall: None,
            seed: 1,
            record: false,
            duration: 0.0,
            watched: f64::INFINITY,
            ticks: u64::MAX,
            settle: 0.0,
        }
    }
}

/// Periods from an operator's stop to the end of the run: the board reports its end, and is seen in its safe state.
const STOPPING: u64 = 10;

/// The outcome of a run.
#[derive(Clone, Debug, Default)]
pub struct VirtualReport {
    /// The cause for which the controller ended control, if by a fault.
    pub cause: Option<Cause>,
    /// The controller's last state, and its cause.
    pub standing: Standing<f64>,
    /// The time at which the fault first showed, s after arming.
    pub hit: Option<f64>,
    /// The time at which the controller faulted, s after arming.
    pub tripped: Option<f64>,
    /// The time at which the board's safe output was in force, s after arming.
    pub safe: Option<f64>,
    /// The time at which the board followed its controller again after that, s after arming: never, if it latches.
    pub relapsed: Option<f64>,
    /// The distance by which the shaft went beyond the path's position at the moment of the safe output, rad.
    pub overrun: f64,
    /// Largest distance between shaft and path until the end or the safe output, rad.
    pub largest_error: f64,
    /// Lowest and highest voltage of the codes sent to the board, V.
    pub volts: (f64, f64),
    /// Largest step between the voltages of two answers with a gap of at least one sample between them, V.
    pub kick: f64,
    /// Ticks in which the law answered.
    pub answers: u64,
    /// Samples, from the first answer to the end or the safe output, that were left without one.
    pub unanswered: u64,
    /// Highest code that the board has put out.
    pub highest_code: u16,
    /// The code that it puts out when its safe output is first in force.
    pub safe_code: u16,
    /// The code that it puts out at the end.
    pub last_code: u16,
    /// The records that a log would hold.
    pub records: Vec<Record>,
    /// The code that the converter had when the controller was armed.
    pub present: u16,
    /// True errors, one per sample from arming on, rad.
    pub errors: Vec<f64>,
    /// True if one that looked on has stopped it, as an operator does.
    pub stopped: bool,
    /// The board's state at the end.
    pub board: Option<BoardState>,
    /// Figures of the shaft's true motion under control, as a simulation has them; the last period of the
    /// run, in which it ends, is not among them.
    pub metrics: Metrics,
}

impl VirtualReport {
    /// Samples and commands of a run that was recorded, each in their order.
    #[must_use]
    pub fn samples_and_commands(&self) -> (Vec<SampleRecord>, Vec<CommandRecord>) {
        let (mut samples, mut commands) = (Vec::new(), Vec::new());
        for record in &self.records {
            match record {
                Record::Sample(sample) => samples.push(*sample),
                Record::Command(command) => commands.push(*command),
                _ => {}
            }
        }
        (samples, commands)
    }
}

/// A run in virtual time could not be made.
#[derive(Debug, thiserror::Error)]
pub enum VirtualError {
    /// The board or its rig.
    #[error(transparent)]
    Board(#[from] SimBoardError),
    /// The chip, or what carries it.
    #[cfg(target_os = "linux")]
    #[error(transparent)]
    Chip(#[from] ChipError),
    /// The station.
    #[error("{0}")]
    Station(String),
    /// Encoder and converter, or the controller, before control began.
    #[error("the board did not take the run: {0}")]
    Refused(String),
}

/// A sample of the shaft that waits for its answer.
struct Sampled {
    at: At,
    /// The run's tick, once the controller has reported it.
    tick: Option<u64>,
}

/// A board with a rig, both in virtual time. Times are the board's, ns; voltages V.
pub trait VirtualBoard {
    /// The time at which [`VirtualBoard::step`] has to be called next.
    fn next_ns(&self) -> Option<u64>;
    /// Does what is due by now.
    ///
    /// # Errors
    /// Rig or board cannot go on.
    fn step(&mut self, now_ns: u64, out: &mut Outbox) -> Result<(), VirtualError>;
    /// Bytes from the line arrive.
    ///
    /// # Errors
    /// As [`VirtualBoard::step`].
    fn receive(&mut self, now_ns: u64, bytes: &[u8], out: &mut Outbox) -> Result<(), VirtualError>;
    /// Seconds since the consent; none before.
    fn armed_for(&self, now_ns: u64) -> Option<f64>;
    /// Samples taken since it was configured.
    fn samples(&self) -> u64;
    /// The shaft's events since the last call.
    fn take_events(&mut self) -> Vec<Event>;
    /// The voltage in the period that the last sample ended.
    fn volts(&self) -> f64;
    /// The rig.
    fn rig(&self) -> &MovingRig;
    /// Its state.
    fn state(&self) -> BoardState;
    /// The code that the converter has been given.
    fn code(&self) -> DacCode;
    /// The time at which a fault of its hardware first showed.
    fn first_hit_ns(&self) -> Option<u64>;
}

impl VirtualBoard for SimBoard {
    fn next_ns(&self) -> Option<u64> {
        SimBoard::next_ns(self)
    }
    fn step(&mut self, now_ns: u64, out: &mut Outbox) -> Result<(), VirtualError> {
        Ok(SimBoard::step(self, now_ns, out)?)
    }
    fn receive(&mut self, now_ns: u64, bytes: &[u8], out: &mut Outbox) -> Result<(), VirtualError> {
        Ok(SimBoard::receive(self, now_ns, bytes, out)?)
    }
    fn armed_for(&self, now_ns: u64) -> Option<f64> {
        SimBoard::armed_for(self, now_ns)
    }
    fn samples(&self) -> u64 {
        SimBoard::samples(self)
    }
    fn take_events(&mut self) -> Vec<Event> {
        SimBoard::take_events(self)
    }
    // The code of the last sample comes over the line, after it.
    fn volts(&self) -> f64 {
        SimBoard::volts(self)
    }
    fn rig(&self) -> &MovingRig {
        SimBoard::rig(self)
    }
    fn state(&self) -> BoardState {
        self.node().state()
    }
    fn code(&self) -> DacCode {
        SimBoard::code(self)
    }
    fn first_hit_ns(&self) -> Option<u64> {
        SimBoard::first_hit_ns(self)
    }
}

/// Controller, line and board.
pub struct VirtualLoop<S, B = SimBoard> {
    board: B,
    station: S,
    up: FaultyLine,
    down: FaultyLine,
    params: VirtualOptions,
    now_ns: u64,
    played: Option<Played>,
}

impl<S: Station> VirtualLoop<S> {
    /// A station, and the scenario's rig on a board.
    ///
    /// # Errors
    /// As [`SimBoard::new`].
    pub fn new(scenario: &Scenario, params: VirtualOptions, station: S) -> Result<Self, SimBoardError> {
        let board = SimBoard::new(scenario, &params.faults, 1, false)?;
        Ok(VirtualLoop::with_board(board, params, station))
    }
}

impl<S: Station, B: VirtualBoard> VirtualLoop<S, B> {
    /// A station, and a board with its rig.
    pub fn with_board(board: B, params: VirtualOptions, station: S) -> Self {
        let line = |way| FaultyLine::new(way, params.latency_ns, &params.faults, params.seed);
        let (up, down) = (line(Direction::Up), line(Direction::Down));
        VirtualLoop { board, station, up, down, params, now_ns: 0, played: None }
    }

    /// The same, looked at: no faster than a clock, and ended by an operator's stop.
    #[must_use]
    pub fn played(self, played: Option<Played>) -> Self {
        VirtualLoop { played, ..self }
    }

    /// Discovers, configures, arms, and runs to the end; `path` is the one that the controller follows.
    ///
    /// # Errors
    /// The engine gave up, or the station.
    pub fn run(&mut self, path: &impl Planned<S::Scalar>) -> Result<VirtualReport, VirtualError> {
        let mut course = Course::new(self, path);
        course.discover()?;
        while let Some(now) = course.next_event() {
            if now >= course.end_ns {
                course.stop_the_clock()?;
                break;
            }
            let armed_for = course.board_turn(now)?;
            if now < course.busy_until {
                continue;
            }
            course.station_turn(now, armed_for)?;
            // Nothing to come: a board that has started anew, and a controller that has given up.
            if course.end_ns == u64::MAX && now > 1_000 * course.period_ns {
                break;
            }
        }
        course.report()
    }

    /// The rig on the board, as the run has left it.
    #[must_use]
    pub fn rig(&self) -> &MovingRig {
        self.board.rig()
    }

    /// The board, as the run has left it.
    #[must_use]
    pub fn into_board(self) -> B {
        self.board
    }

    /// An error if the station cannot go on.
    fn sound(&self) -> Result<(), VirtualError> {
        self.station.failure().map_or(Ok(()), |why| Err(VirtualError::Station(why)))
    }
}

/// The steps that station and board have made with each other.
#[derive(Clone, Copy, Default)]
struct Handshake {
    greeted: bool,
    configured: bool,
    asked: bool,
    armed: bool,
}

/// The results of a turn of the station.
struct Heard<T> {
    records: Vec<Record>,
    ended: Option<Ending<T>>,
    refused: Option<Refused>,
}

/// A run on its way.
struct Course<'a, S: Station, B, P> {
    on: &'a mut VirtualLoop<S, B>,
    path: &'a P,
    report: VirtualReport,
    figures: TrueMotion,
    period_ns: u64,
    /// Frames of the station.
    out: Outbox,
    /// Frames of the board.
    up: Outbox,
    hands: Handshake,
    /// The code that the converter had at the start.
    present: DacCode,
    /// The time at which the board was armed.
    origin_ns: u64,
    /// The time at which the run is over; not before the board is armed.
    end_ns: u64,
    safe_at: Option<u64>,
    /// The station makes an answer until then.
    busy_until: u64,
    waiting: Option<Sampled>,
    /// Number of the last sample that was answered, and the voltage, V.
    answered: Option<(u16, f64)>,
    /// Samples that the board has taken.
    sampled: u64,
    /// The number that it had taken when control began.
    first_sample: Option<u64>,
}

impl<'a, S: Station, B: VirtualBoard, P: Planned<S::Scalar>> Course<'a, S, B, P> {
    fn new(on: &'a mut VirtualLoop<S, B>, path: &'a P) -> Self {
        let (period, present) = (on.station.period(), on.board.code());
        Course {
            report: VirtualReport {
                volts: (f64::INFINITY, f64::NEG_INFINITY),
                present: present.0,
                ..VirtualReport::default()
            },
            figures: TrueMotion::new(period, on.station.encoder().radians_per_count(), on.params.settle),
            period_ns: u64::from(period.0) * 1000,
            out: Outbox::default(),
            up: Outbox::default(),
            hands: Handshake::default(),
            present,
            origin_ns: 0,
            end_ns: u64::MAX,
            safe_at: None,
            busy_until: 0,
            waiting: None,
            answered: None,
            sampled: 0,
            first_sample: None,
            on,
            path,
        }
    }

    /// Asks who is there.
    fn discover(&mut self) -> Result<(), VirtualError> {
        self.on.station.discover(1, &mut self.out);
        self.on.sound()?;
        self.on.down.send(0, None, self.out.as_bytes());
        self.out.clear();
        Ok(())
    }

    /// The time at which something falls due next, on the board, on the line, or for the station.
    fn next_event(&mut self) -> Option<u64> {
        let v = &mut *self.on;
        let heard = v.up.next_ns().map(|t| t.max(self.busy_until));
        let poll = v.station.poll_at().map(|t| t.max(self.busy_until));
        let next = [v.board.next_ns(), heard, v.down.next_ns(), poll].into_iter().flatten().min()?;
        v.now_ns = next.max(v.now_ns);
        Some(v.now_ns)
    }

    /// The run is over: the rig moves to its end, and no further.
    fn stop_the_clock(&mut self) -> Result<(), VirtualError> {
        self.on.now_ns = self.end_ns;
        self.on.board.step(self.end_ns, &mut self.up)
    }

    /// The board: its clock first, then what has arrived. Time since it was armed, s.
    fn board_turn(&mut self, now: u64) -> Result<Option<f64>, VirtualError> {
        let v = &mut *self.on;
        let before = v.board.armed_for(now);
        if v.board.next_ns().is_some_and(|t| t <= now) {
            v.board.step(now, &mut self.up)?;
        }
        while let Some(bytes) = v.down.arrived(now) {
            v.board.receive(now, &bytes, &mut self.up)?;
            if v.board.next_ns().is_some_and(|t| t <= now) {
                v.board.step(now, &mut self.up)?;
            }
        }
        let armed_for = v.board.armed_for(now);
        if before.is_none() && armed_for.is_some() {
            self.origin_ns = now;
            self.end_ns = now + (v.params.duration * 1e9) as u64;
        }
        v.up.send(now, armed_for, self.up.as_bytes());
        self.up.clear();
        if v.board.samples() != self.sampled {
            self.sampled = v.board.samples();
            self.sample_taken();
        }
        let state = self.on.board.state();
        let safe = matches!(state, BoardState::Stopped | BoardState::Faulted | BoardState::Boot);
        if armed_for.is_some() && safe && self.safe_at.is_none() {
            self.safe_at = Some(now);
            self.report.safe = armed_for;
            self.report.safe_code = self.on.board.code().0;
            self.end_ns = self.end_ns.min(now.saturating_add((self.on.params.watched * 1e9) as u64));
        }
        if self.safe_at.is_some() && !safe && self.report.relapsed.is_none() {
            self.report.relapsed = armed_for;
        }
        self.report.highest_code = self.report.highest_code.max(self.on.board.code().0);
        Ok(armed_for)
    }

    /// The board has taken a sample: the period before it goes into the figures.
    fn sample_taken(&mut self) {
        let events = self.on.board.take_events();
        let ignored = self.waiting.as_ref().is_some_and(|s| s.tick.is_none());
        if ignored && self.first_sample.is_some() && self.safe_at.is_none() {
            self.report.unanswered += 1;
        }
        if let Some(Sampled { at, tick: Some(tick) }) = self.waiting.take()
            && tick + 1 < self.on.params.ticks
        {
            let target = self.target(tick);
            self.figures.period(tick, &at, target, self.on.board.volts(), &events);
        }
        let at = At::now(self.on.board.rig());
        let shaft = at.shaft;
        self.waiting = Some(Sampled { at, tick: None });
        if let Some(first) = self.first_sample
            && self.safe_at.is_none()
        {
            let error = self.figures.angle(self.target(self.sampled - first)) - shaft.position;
            self.report.largest_error = self.report.largest_error.max(error.abs());
            self.report.errors.push(error);
        }
    }

    /// The station: what it hears, what follows from that, and what it sends.
    fn station_turn(&mut self, now: u64, armed_for: Option<f64>) -> Result<(), VirtualError> {
        let time_ns = now.saturating_sub(self.origin_ns);
        let mut heard = self.hear(now, time_ns);
        self.on.sound()?;
        if let Some(m) = heard.refused {
            return Err(VirtualError::Refused(why(&m, None)));
        }
        if self.hands.configured && !self.hands.asked && self.on.board.samples() >= 3 {
            self.hands.asked = true;
            self.on.station.arm(&mut self.out);
        }
        heard.records.extend(heard.ended.map(|ending| to_log::ended(time_ns, &ending)));
        heard.records.extend(self.follow(time_ns, armed_for));
        if let Some(mut played) = self.on.played.take() {
            heard.records.iter().for_each(|record| played.show(record));
            if played.stopped() {
                self.report.stopped = true;
                self.end_ns = self.end_ns.min(now + STOPPING * self.period_ns);
                let end = self.end(time_ns, StopReason::Operator);
                end.iter().for_each(|record| played.show(record));
                heard.records.extend(end);
            }
            self.on.played = Some(played);
        }
        if self.on.params.record {
            self.report.records.append(&mut heard.records);
        }
        self.answer(now, armed_for);
        Ok(())
    }

    /// Takes in what has come over the line, and what the clock says.
    fn hear(&mut self, now: u64, time_ns: u64) -> Heard<S::Scalar> {
        let VirtualLoop { board, station, up, .. } = &mut *self.on;
        let (hands, waiting, report) = (&mut self.hands, &mut self.waiting, &mut self.report);
        let answered = &mut self.answered;
        let (dac, radians) = (*station.dac(), station.encoder().radians_per_count::<f64>());
        let mut heard = Heard { records: Vec::new(), ended: None, refused: None };
        let mut greeted = false;
        let mut notices = |n: StationNotice<S>| match n {
            Notice::Hello(_) => greeted = true,
            Notice::Configured => hands.configured = true,
            Notice::Armed => hands.armed = true,
            Notice::Cycle(n) if hands.armed => {
                if let Some(waiting) = waiting.as_mut().filter(|_| n.cycle.answer.is_some()) {
                    waiting.tick = Some(n.cycle.tick);
                }
                report.answers += u64::from(n.cycle.answer.is_some());
                let volts = dac.volts(n.cycle.code).to_f64();
                if n.cycle.answer.is_some() {
                    let last = answered.replace((n.sample.sequence, volts));
                    let gap = last.filter(|(before, _)| n.sample.sequence.wrapping_sub(*before) > 1);
                    report.kick =
                        gap.map_or(report.kick, |(_, before)| report.kick.max((volts - before).abs()));
                }
                report.volts = (report.volts.0.min(volts), report.volts.1.max(volts));
                let records = &mut heard.records;
                records.push(Record::Sample(SampleRecord::of(&n, time_ns, 0, 0, radians)));
                records.push(Record::Command(CommandRecord::of(&n.cycle, time_ns, &dac, radians)));
                records.extend(to_log::change(time_ns, &n.cycle));
                records.push(Record::Truth(to_log::truth(time_ns, n.cycle.tick, board.rig())));
            }
            Notice::Ended(ending) => heard.ended = Some(ending),
            Notice::Refused(m) if !hands.armed => heard.refused = Some(m),
            _ => {}
        };
        while let Some(bytes) = up.arrived(now) {
            station.receive(now, &bytes, &mut self.out, &mut notices);
        }
        station.poll(now, &mut self.out, &mut notices);
        if greeted && !self.hands.greeted {
            self.hands.greeted = true;
            station.configure(self.present, &mut self.out);
        }
        heard
    }

    /// Follows the state of control: its beginning and a fault are noted, and the path's end stops it.
    fn follow(&mut self, time_ns: u64, armed_for: Option<f64>) -> Option<Record> {
        let Standing { state, cause, tick, .. } = self.on.station.standing();
        if state == State::Running && self.first_sample.is_none() {
            self.first_sample = Some(self.sampled);
        }
        if state == State::Faulted && self.report.tripped.is_none() {
            self.report.tripped = armed_for;
            self.report.cause = Some(cause);
        }
        if S::LOOKS_ON || state != State::Running || tick + 1 < self.on.params.ticks {
            return None;
        }
        self.end(time_ns, StopReason::Done)
    }

    /// Ends control. A board that closes the loop says itself when it has ended.
    fn end(&mut self, time_ns: u64, reason: StopReason) -> Option<Record> {
        let from = self.on.station.standing().state;
        self.on.station.stop(reason, &mut self.out);
        let Standing { state, cause, value, tick, .. } = self.on.station.standing();
        (!S::LOOKS_ON).then(|| to_log::ended(time_ns, &Ending { from, state, cause, value, tick }))
    }

    /// Sends what there is to send, as late as the stall that was asked for makes it.
    fn answer(&mut self, now: u64, armed_for: Option<f64>) {
        if self.out.as_bytes().is_empty() {
            return;
        }
        let v = &mut *self.on;
        let stall = v.params.stall.filter(|s| armed_for.is_some_and(|t| t >= s.at && t < s.until));
        let takes = stall.map_or(0, |s| (s.answer * 1e9) as u64);
        self.busy_until = now.saturating_add(takes);
        v.station.answered(Micros((takes / 1000) as u32));
        v.down.send(self.busy_until, armed_for, self.out.as_bytes());
        self.out.clear();
    }

    /// The outcome of the run.
    fn report(mut self) -> Result<VirtualReport, VirtualError> {
        self.on.sound()?;
        let now_ns = self.on.now_ns;
        let overrun = self.on.board.rig().shaft().position - self.path_at(self.safe_at.unwrap_or(now_ns));
        let v = &self.on;
        self.report.standing = v.station.standing().map(Real::to_f64);
        self.report.board = Some(v.board.state());
        self.report.last_code = v.board.code().0;
        let hits = [v.up.hits().1, v.down.hits().1, v.board.first_hit_ns()];
        let first = hits.into_iter().flatten().min();
        self.report.hit = first.map(|t| t.saturating_sub(self.origin_ns) as f64 / 1e9);
        self.report.metrics = self.figures.finish();
        self.report.overrun = self.report.overrun.max(overrun);
        Ok(self.report)
    }

    /// The path's position at a time, rad.
    fn path_at(&self, at_ns: u64) -> f64 {
        self.figures.angle(self.target(at_ns.saturating_sub(self.origin_ns) / self.period_ns))
    }

    /// The path's position at a tick.
    fn target(&self, tick: u64) -> FixedCounts {
        self.path.target(tick).position.plus(self.on.station.origin())
    }
}
