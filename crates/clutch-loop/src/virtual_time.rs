//! Controller, line and simulated board in virtual time: what the fault campaign runs.
//!
//! The same state machines, frames and rig as in real time; only the clock is computed. A run of
//! one second takes some milliseconds and repeats bit for bit.

use crate::faults::{Direction, Fault};
use crate::faulty_line::FaultyLine;
use crate::preflight;
use crate::sim_board::{SimBoard, SimBoardError};
use crate::station::{Station, StationNotice};
use crate::to_log;
use clutch_core::supervisor::{Cause, State};
use clutch_core::{Micros, Real, Target};
use clutch_log::Record;
use clutch_node::{Ending, Notice, Outbox, Standing};
use clutch_sim::engine::{Event, Motion, Shaft};
use clutch_sim::metrics::{MetricsBuilder, MetricsSample};
use clutch_sim::{Metrics, Scenario};
use clutch_wire::{BoardState, StopReason};

/// Time that a controller takes for an answer, over a part of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stall {
    /// When it begins, s after arming.
    pub at: f64,
    /// Until when, s after arming.
    pub until: f64,
    /// How long each answer takes then, s.
    pub answer: f64,
}

/// How a run in virtual time is made.
#[derive(Clone, Debug)]
pub struct VirtualOptions {
    /// One way, ns.
    pub latency_ns: u64,
    /// What goes wrong on line and board.
    pub faults: Vec<Fault>,
    /// A controller that is too slow.
    pub stall: Option<Stall>,
    /// Seed of the line's faults.
    pub seed: u64,
    /// Whether records are kept.
    pub record: bool,
    /// Time after arming at which the run ends, s; the safe state is watched until then.
    pub duration: f64,
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
            ticks: u64::MAX,
            settle: 0.0,
        }
    }
}

/// What became of a run.
#[derive(Clone, Debug, Default)]
pub struct VirtualReport {
    /// Why the controller ended control, if by a fault.
    pub cause: Option<Cause>,
    /// Where the controller stood last, and why.
    pub standing: Standing<f64>,
    /// When the fault first showed, s after arming.
    pub hit: Option<f64>,
    /// When the controller faulted, s after arming.
    pub tripped: Option<f64>,
    /// When the board's safe output was in force, s after arming.
    pub safe: Option<f64>,
    /// How far the shaft went beyond the path's position at the moment of the safe output, rad.
    pub overrun: f64,
    /// Largest distance between shaft and path until the end or the safe output, rad.
    pub largest_error: f64,
    /// Lowest and highest voltage that the board was told, V.
    pub volts: (f64, f64),
    /// Ticks in which the law answered.
    pub answers: u64,
    /// What a log would hold.
    pub records: Vec<Record>,
    /// The code that the converter had when the controller was armed.
    pub present: u16,
    /// True errors, one per sample from arming on, rad.
    pub errors: Vec<f64>,
    /// The board's state at the end.
    pub board: Option<BoardState>,
    /// Figures of the shaft's true motion under control, as a simulation has them; the last period of the
    /// run, in which it ends, is not among them.
    pub metrics: Metrics,
}

/// A run in virtual time could not be made.
#[derive(Debug, thiserror::Error)]
pub enum VirtualError {
    /// The board or its rig.
    #[error(transparent)]
    Board(#[from] SimBoardError),
    /// The station.
    #[error("{0}")]
    Station(String),
    /// Encoder and converter, or the controller, before control began.
    #[error("the board did not take the run: {0}")]
    Refused(String),
}

/// A sample of the shaft that waits for its answer.
struct Sampled {
    shaft: Shaft,
    /// When, by the rig's clock, s.
    rig_time: f64,
    /// The run's tick, once the controller has told.
    tick: Option<u64>,
}

/// Controller, line and board.
pub struct VirtualLoop<S> {
    board: SimBoard,
    station: S,
    up: FaultyLine,
    down: FaultyLine,
    params: VirtualOptions,
    now_ns: u64,
}

impl<S: Station> VirtualLoop<S> {
    /// A station, and the scenario's rig on a board.
    ///
    /// # Errors
    /// As [`SimBoard::new`].
    pub fn new(scenario: &Scenario, params: VirtualOptions, station: S) -> Result<Self, SimBoardError> {
        let line = |way| FaultyLine::new(way, params.latency_ns, &params.faults, params.seed);
        Ok(VirtualLoop {
            board: SimBoard::new(scenario, &params.faults, 1, false)?,
            station,
            up: line(Direction::Up),
            down: line(Direction::Down),
            params,
            now_ns: 0,
        })
    }

    /// Discovers, configures, arms, and runs to the end; `path` is the one that the controller follows.
    ///
    /// # Errors
    /// The engine gave up, or the station.
    pub fn run(&mut self, path: &impl Fn(u64) -> Target<S::Scalar>) -> Result<VirtualReport, VirtualError> {
        let mut report =
            VirtualReport { volts: (f64::INFINITY, f64::NEG_INFINITY), ..VirtualReport::default() };
        let (mut out, mut up) = (Outbox::default(), Outbox::default());
        let radians = self.station.encoder().radians_per_count::<f64>();
        let dac = *self.station.dac();
        let period_ns = u64::from(self.station.period().0) * 1000;
        let period = self.station.period().seconds::<f64>();
        let mut figures = MetricsBuilder::new(period, self.params.settle);
        let mut waiting: Option<Sampled> = None;
        let (mut hello, mut configured, mut asked, mut armed) = (false, false, false, false);
        let mut origin_ns = 0;
        let mut safe_at: Option<u64> = None;
        let mut busy_until = 0;
        let (mut sampled, mut first_sample) = (0, None);
        self.station.discover(1, &mut out);
        self.sound()?;
        let present = self.board.code();
        report.present = present.0;
        self.down.send(0, None, out.as_bytes());
        out.clear();
        let mut end_ns = u64::MAX;
        loop {
            // What comes next.
            let host = self.up.next_ns().map(|t| t.max(busy_until));
            let poll = self.station.poll_at().map(|t| t.max(busy_until));
            let times = [self.board.next_ns(), host, self.down.next_ns(), poll];
            let Some(next) = times.into_iter().flatten().min() else { break };
            self.now_ns = next.max(self.now_ns);
            if self.now_ns >= end_ns {
                self.now_ns = end_ns;
                self.board.step(end_ns, &mut up)?;
                break;
            }
            let now = self.now_ns;
            let before = self.board.armed_for(now);

            // The board: its clock first, then what has arrived.
            if self.board.next_ns().is_some_and(|t| t <= now) {
                self.board.step(now, &mut up)?;
            }
            while let Some(bytes) = self.down.arrived(now) {
                self.board.receive(now, &bytes, &mut up)?;
                if self.board.next_ns().is_some_and(|t| t <= now) {
                    self.board.step(now, &mut up)?;
                }
            }
            if before.is_none() && self.board.armed_for(now).is_some() {
                origin_ns = now;
                end_ns = now + (self.params.duration * 1e9) as u64;
            }
            let armed_for = self.board.armed_for(now);
            self.up.send(now, armed_for, up.as_bytes());
            up.clear();
            if self.board.samples() != sampled {
                sampled = self.board.samples();
                let events = self.board.take_events();
                if let Some(Sampled { shaft, rig_time, tick: Some(tick) }) = waiting.take()
                    && tick + 1 < self.params.ticks
                {
                    let time = tick as f64 * period;
                    let error = self.target(path, tick) - shaft.position;
                    let voltage = self.board.volts();
                    figures.sample(time, MetricsSample { error, velocity: shaft.velocity, voltage });
                    // The rig's clock began before the run's.
                    let of_run = |e: &Event| Event { time: e.time - rig_time + time, ..*e };
                    let events: Vec<Event> = events.iter().map(of_run).collect();
                    figures.period(time, shaft.motion == Motion::Stuck, &events);
                }
                let rig = self.board.rig();
                waiting = Some(Sampled { shaft: *rig.shaft(), rig_time: rig.time(), tick: None });
                if let Some(first) = first_sample
                    && safe_at.is_none()
                {
                    let error = self.target(path, sampled - first) - self.board.rig().shaft().position;
                    report.largest_error = report.largest_error.max(error.abs());
                    report.errors.push(error);
                }
            }
            let safe_now = matches!(
                self.board.node().state(),
                BoardState::Stopped | BoardState::Faulted | BoardState::Boot
            );
            if armed_for.is_some() && safe_now && safe_at.is_none() {
                safe_at = Some(now);
                report.safe = armed_for;
            }

            // The controller.
            if now < busy_until {
                continue;
            }
            let mut records = Vec::new();
            let time_ns = now.saturating_sub(origin_ns);
            let (mut ended, mut refused) = (None, None);
            let mut greeted = false;
            {
                let (armed_now, rig) = (&mut armed, self.board.rig());
                let mut notices = |n: StationNotice<S>| match n {
                    Notice::Hello(_) => greeted = true,
                    Notice::Configured => configured = true,
                    Notice::Armed => *armed_now = true,
                    Notice::Cycle(n) if *armed_now => {
                        if let Some(waiting) = waiting.as_mut().filter(|_| n.cycle.answer.is_some()) {
                            waiting.tick = Some(n.cycle.tick);
                        }
                        report.answers += u64::from(n.cycle.answer.is_some());
                        let volts = dac.volts(n.cycle.code).to_f64();
                        report.volts = (report.volts.0.min(volts), report.volts.1.max(volts));
                        records.push(Record::Sample(to_log::sample(time_ns, 0, &n)));
                        records.push(Record::Command(to_log::command(time_ns, &n.cycle, &dac, radians)));
                        records.extend(to_log::change(time_ns, &n.cycle));
                        records.push(Record::Truth(to_log::truth(time_ns, n.cycle.tick, rig)));
                    }
                    Notice::Ended(ending) => ended = Some(ending),
                    Notice::Refused(m) if !*armed_now => refused = Some(m),
                    _ => {}
                };
                while let Some(bytes) = self.up.arrived(now) {
                    self.station.receive(now, &bytes, &mut out, &mut notices);
                }
                self.station.poll(now, &mut out, &mut notices);
            }
            if greeted && !hello {
                hello = true;
                self.station.configure(present, &mut out);
            }
            self.sound()?;
            if let Some(m) = refused {
                return Err(VirtualError::Refused(preflight::why(&m)));
            }
            if configured && !asked && self.board.samples() >= 3 {
                asked = true;
                self.station.arm(&mut out);
            }
            let standing = self.station.standing();
            let (state, tick) = (standing.state, standing.tick);
            if state == State::Running && first_sample.is_none() {
                first_sample = Some(sampled);
            }
            if let Some(ending) = ended {
                records.push(to_log::ended(time_ns, &ending));
            }
            if state == State::Faulted && report.tripped.is_none() {
                report.tripped = armed_for;
                report.cause = Some(standing.cause);
            }
            if !S::LOOKS_ON && state == State::Running && tick + 1 >= self.params.ticks {
                self.station.stop(StopReason::Done, &mut out);
                let Standing { state: to, cause, value, .. } = self.station.standing();
                records.push(to_log::ended(time_ns, &Ending { from: state, state: to, cause, value, tick }));
            }
            if self.params.record {
                report.records.append(&mut records);
            }
            if !out.as_bytes().is_empty() {
                let answer =
                    self.params.stall.filter(|s| armed_for.is_some_and(|t| t >= s.at && t < s.until));
                let takes = answer.map_or(0, |s| (s.answer * 1e9) as u64);
                busy_until = now.saturating_add(takes);
                self.station.answered(Micros((takes / 1000) as u32));
                self.down.send(busy_until, armed_for, out.as_bytes());
                out.clear();
            }
            // Nothing to come: a board that has started anew, and a controller that has given up.
            if end_ns == u64::MAX && now > 1_000 * period_ns {
                break;
            }
        }
        self.sound()?;
        let standing = self.station.standing();
        report.standing = standing.map(Real::to_f64);
        report.board = Some(self.board.node().state());
        report.hit = [self.up.hits().1, self.down.hits().1, self.board.first_hit_ns()]
            .into_iter()
            .flatten()
            .min()
            .map(|t| t.saturating_sub(origin_ns) as f64 / 1e9);
        let at_end = self.board.rig().shaft().position;
        report.metrics = figures.finish();
        report.overrun =
            report.overrun.max(self.beyond(at_end, path, safe_at.unwrap_or(self.now_ns), origin_ns));
        Ok(report)
    }

    /// An error if the station cannot go on.
    fn sound(&self) -> Result<(), VirtualError> {
        self.station.failure().map_or(Ok(()), |why| Err(VirtualError::Station(why)))
    }

    /// How far a position lies beyond the path's at a time.
    fn beyond(
        &self,
        position: f64,
        path: &impl Fn(u64) -> Target<S::Scalar>,
        at_ns: u64,
        origin_ns: u64,
    ) -> f64 {
        let period_ns = u64::from(self.station.period().0) * 1000;
        let tick = at_ns.saturating_sub(origin_ns) / period_ns;
        position - self.target(path, tick)
    }

    fn target(&self, path: &impl Fn(u64) -> Target<S::Scalar>, tick: u64) -> f64 {
        let radians = self.station.encoder().radians_per_count::<f64>();
        let position = path(tick).position.plus(self.station.origin());
        position.minus::<f64>(clutch_core::FixedCounts(0)) * radians
    }
}
