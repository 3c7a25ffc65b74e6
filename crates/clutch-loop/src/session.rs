//! A session of the loop: a scenario and options in; refusals, events and a summary out.
//!
//! [`Session::new`] refuses what can be refused before a port is opened. [`Session::run`] opens it, asks the board
//! who it is, says what it will do, makes a release test where that is asked for, configures and arms the board, runs to
//! the path's end, and leaves the board in its safe state. Starting it is the consent.

use crate::board_clock::Expected;
use crate::board_words::{board_text, controller_text, is_simulated, start_notes, started_text};
use crate::build_error::BuildError;
use crate::campaign::CampaignError;
use crate::cause_words::cause_text;
use crate::clearance::{ClearanceError, Cleared, check};
use crate::control_loop::{self, ConfiguredRun, LoopOptions, LoopReport, OnDrift, Pace};
use crate::drift::DriftReport;
use crate::faults::Fault;
use crate::from_scenario::{self, BuiltRun};
use crate::live_gains::{Changes, LiveGains};
use crate::log_thread::{LogThread, Ring};
use crate::onlooker::Onlooker;
use crate::port::{Address, DeviceKind, Endpoint, Port, PortError, PseudoTerminal, SerialOptions};
use crate::preflight::{PreflightError, Talk};
use crate::realtime::{RealtimeOptions, WaitMode, describe_system};
use crate::release::{self, NoRelease, ReleaseTest};
use crate::sim_board::PATIENT_BOARD;
use crate::sim_board_server::{ServeError, ServeOptions, ServeReport, serve};
use crate::station::{ALIVE_NS, BOARD_SILENCE_NS, ControllerStation, HOST_SILENCE, HostStation, Station};
use crate::summary::{LogSummary, Summary};
use crate::to_log::PRESENT_CODE;
use crate::tuning::Tuning;
use crate::watch::Watch;
use clutch_core::law::Law;
use clutch_core::params::CYCLES;
use clutch_core::supervisor::Cause;
use clutch_core::{
    ActuatorKind, DacCode, Micros, Real, SafeHold, SafeHoldThenRelease, SafeRamp, SafeState, Servo,
};
use clutch_log::{LogError, Source};
use clutch_node::{ControllerNode, HostNode, present_code};
use clutch_sim::scenario::ScalarKind;
use clutch_sim::{Scenario, ScenarioError, number};
use clutch_wire::{Actuate, ControllerHello, Hello, Sample, Telemetry};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread::{JoinHandle, ScopedJoinHandle};
use std::time::Duration;

/// Interval at which a run is looked at.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// The longest time that a board may take to say who it is.
const GREETING: Duration = Duration::from_secs(2);
/// Silence that a patient board's clock may cost: what it waits for, and half a second.
const PATIENT_SILENCE: Micros = Micros(5_500_000);
/// Bytes that stuffing and the end of a frame add.
const AROUND_A_BODY: usize = 2;

/// The board of a session.
#[derive(Clone, Debug)]
pub enum Board {
    /// Simulated in the background, and reached over a real pseudo-terminal.
    Simulated {
        /// Its faults.
        faults: Vec<Fault>,
        /// Seed of what goes wrong at random.
        seed: u64,
        /// True if its clock waits for nobody, as on hardware.
        strict: bool,
    },
    /// In the role daq: the loop is closed here.
    Daq(Address),
    /// In the role controller: the loop is closed there, and this machine looks on.
    Controller(Address),
}

clutch_core::words! {
    /// Says if a release test comes before the run: see [`crate::release`].
    pub enum Release {
        /// On a serial device, where the scenario allows one; a simulated board is wired as it says.
        Auto = "auto" default,
        /// In any case; a scenario that allows none is refused.
        Always = "always",
        /// Never.
        Never = "never",
    }
}

/// Options of a session.
#[derive(Clone, Debug)]
pub struct SessionOptions {
    /// The board.
    pub board: Board,
    /// Line rate of its port, baud; none for the usual one. Without effect on USB, pseudo-terminals and TCP.
    pub baud: Option<u32>,
    /// A new file for a log.
    pub log: Option<PathBuf>,
    /// True if the board is one whose clock waits for this machine, and may be silent for as long: a simulated board of
    /// another process. A session knows it of its own board.
    pub patient: bool,
    /// True if gains may run that are not certified for the scenario's bounds.
    pub uncertified: bool,
    /// A saved certificate of the sampled loop, which is checked before anything else.
    pub certificate: Option<PathBuf>,
    /// The test of encoder and brake before the run.
    pub release: Release,
    /// The longest way of a shaft within the bounds in that test, rad.
    pub release_way: f64,
    /// Priority, memory, core, wait.
    pub realtime: RealtimeOptions,
    /// The event that starts a cycle.
    pub pace: Pace,
    /// The effect of friction over load that leaves the bounds.
    pub on_drift: OnDrift,
    /// Version and commit of the build, for log and summary.
    pub version: String,
}

/// On a patient simulated board, without a log.
impl Default for SessionOptions {
    fn default() -> Self {
        SessionOptions {
            board: Board::Simulated { faults: Vec::new(), seed: 1, strict: false },
            baud: None,
            log: None,
            patient: false,
            uncertified: false,
            certificate: None,
            release: Release::default(),
            release_way: release::WAY_DEG.to_radians(),
            realtime: RealtimeOptions::default(),
            pace: Pace::default(),
            on_drift: OnDrift::default(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
        }
    }
}

/// A session was refused, or could not go on.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The scenario.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The scenario makes no run.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// It is not one for a board, or not with these gains.
    #[error(transparent)]
    Clearance(#[from] ClearanceError),
    /// The way of the release test.
    #[error("release_deg = {}: expected a number above 0 and at most {} °", number(.0.to_degrees()), release::LONGEST_WAY_DEG)]
    ReleaseWay(f64),
    /// The power of a release test to find faults could not be calculated.
    #[error(transparent)]
    Tells(#[from] CampaignError),
    /// There is no release test for the scenario, and one was asked for.
    #[error("{scenario}: no release test: {why}")]
    NoRelease {
        /// The scenario's name.
        scenario: String,
        /// The reason.
        why: NoRelease,
    },
    /// The release test did not end as that of any shaft within the bounds would.
    #[error(
        "the release test ended it: {text}.\nThe run was not started, and the output is in the safe state. Check sign and \
         resolution of the encoder, sign and scale of the converter, and [bounds]"
    )]
    Released {
        /// The cause.
        cause: Cause,
        /// The cause in words.
        text: String,
    },
    /// The log.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The port.
    #[error(transparent)]
    Port(#[from] PortError),
    /// The board, before consent.
    #[error(transparent)]
    Preflight(#[from] PreflightError),
    /// The simulated board.
    #[error(transparent)]
    Serve(#[from] ServeError),
    /// The system.
    #[error("{what}: {error}")]
    System {
        /// The action that failed, in words.
        what: &'static str,
        /// The system's answer.
        error: std::io::Error,
    },
    /// A defect of this program.
    #[error("{0}. Please report this as a defect")]
    Panicked(&'static str),
}

fn system(what: &'static str) -> impl Fn(std::io::Error) -> SessionError {
    move |error| SessionError::System { what, error }
}

/// The announcement of what a session is about to do, and on what.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Announcement {
    /// The scenario's name.
    pub title: String,
    /// Name and value.
    pub rows: Vec<(&'static str, String)>,
    /// Further remarks, a line each.
    pub remarks: Vec<String>,
}

/// The progress of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Time of the run so far, s.
    pub time: f64,
    /// Its length, s.
    pub duration: f64,
    /// Error, rad.
    pub error: f64,
    /// Brake voltage, V.
    pub volts: f64,
    /// Samples lost.
    pub lost: u64,
    /// Answers later than the deadline.
    pub late_answers: u64,
}

/// An event while a session runs.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The announcement of what it is about to do: the board has said who it is, and nothing has moved.
    Announced(Announcement),
    /// The progress of the run, some twenty times a second.
    Progress(Progress),
    /// The log has ended early; the loop continues.
    LogEnded,
    /// Friction over load has left the bounds that a certificate assumes, in words.
    Drift(String),
}

/// A checked session.
#[derive(Clone, Debug)]
pub struct Session {
    scenario: Scenario,
    options: SessionOptions,
    cleared: Cleared,
    /// The test that comes first where it is wanted; the reason why there is none otherwise.
    release: Result<ReleaseTest, NoRelease>,
    /// The change made in the scenario for the board's sake.
    note: Option<String>,
    onlooker: Option<Arc<dyn Onlooker>>,
}

impl Session {
    /// Checks everything that can be checked without a board. A board that closes the loop itself calculates in
    /// single precision: its scenario is made one of that.
    ///
    /// # Errors
    /// As [`check`].
    pub fn new(scenario: Scenario, options: SessionOptions) -> Result<Session, SessionError> {
        let single = match options.board {
            Board::Controller(_) => from_scenario::in_single_precision(&scenario)?,
            _ => None,
        };
        let note = single.as_ref().map(|_| from_scenario::SINGLE_PRECISION.to_owned());
        let scenario = single.unwrap_or(scenario);
        let (certificate, log) = (options.certificate.as_deref(), options.log.as_deref());
        let cleared = check(&scenario, certificate, options.uncertified, log)?;
        if !(options.release_way > 0.0 && options.release_way <= release::LONGEST_WAY_DEG.to_radians()) {
            return Err(SessionError::ReleaseWay(options.release_way));
        }
        let release = ReleaseTest::new(&scenario, &cleared.plan, options.release_way)?;
        if let (Release::Always, Err(why)) = (options.release, &release) {
            return Err(SessionError::NoRelease { scenario: scenario.name().to_owned(), why: *why });
        }
        Ok(Session { scenario, options, cleared, release, note, onlooker: None })
    }

    /// The same with one that looks on at the run, and not at a release test before it.
    #[must_use]
    pub fn looked_at(self, onlooker: Option<Arc<dyn Onlooker>>) -> Session {
        Session { onlooker, ..self }
    }

    /// True if the gains are certified, in continuous time, for the scenario's bounds.
    #[must_use]
    pub fn certified(&self) -> bool {
        self.cleared.plan.certificate.certified()
    }

    /// True if the board's clock waits for this machine. The board's own words decide nothing here: a real one
    /// that says it would be allowed seconds of silence.
    fn patient(&self) -> bool {
        match &self.options.board {
            Board::Simulated { faults, strict, .. } => !strict && !faults.iter().any(|f| f.kind.silences()),
            Board::Daq(_) | Board::Controller(_) => self.options.patient,
        }
    }

    /// The release test that comes first, if one does.
    fn first(&self, port: &Port) -> Option<&ReleaseTest> {
        let wanted = match self.options.release {
            Release::Always => true,
            Release::Auto => is_real(port),
            Release::Never => false,
        };
        self.release.as_ref().ok().filter(|_| wanted)
    }

    /// The receivers of the run's records.
    fn receivers(&self) -> Receivers<'_> {
        Receivers { log: self.options.log.as_deref(), onlooker: self.onlooker.as_deref() }
    }

    /// The scenario as it will run.
    #[must_use]
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Runs it, on this thread and some of its own, until the path's end, a fault, or `stop`; `event` is called on
    /// this thread and may set `stop`. The board is in its safe state then, as far as it can be known.
    ///
    /// # Errors
    /// Obstacles that keep the run from beginning: port, board, log. The cause that ends it later is in the summary.
    pub fn run(&self, stop: &Arc<AtomicBool>, event: &mut dyn FnMut(Event)) -> Result<Summary, SessionError> {
        let passed = Arc::default();
        let (simulated, address, faults) = match &self.options.board {
            Board::Daq(address) | Board::Controller(address) => (None, address.clone(), 0),
            Board::Simulated { faults, seed, .. } => {
                let options = ServeOptions {
                    faults: faults.clone(),
                    seed: *seed,
                    patient: self.patient(),
                    wait: WaitMode::Sleep,
                    passed: Arc::clone(&passed),
                };
                let (board, address) = SimulatedBoard::start(&self.scenario, options)?;
                (Some(board), address, faults.len())
            }
        };
        let mut course = Course { session: self, address: &address, stop, passed, event };
        let ran = match (&self.options.board, self.scenario.scalar()) {
            (Board::Controller(_), _) => course.on_controller(),
            (_, ScalarKind::F32) => course.on_daq::<f32>(),
            (_, ScalarKind::F64) => course.on_daq::<f64>(),
        };
        let board = match simulated.map(SimulatedBoard::stop).transpose() {
            // Of a board that could not begin the loop knows only that it has gone.
            Err(why @ SessionError::Serve(ServeError::Board(_))) => return Err(why),
            ended => ended,
        };
        let (report, log) = ran?;
        Ok(Summary {
            scenario: self.scenario.name().to_owned(),
            version: self.options.version.clone(),
            cleared: self.cleared.clone(),
            certificate: self.options.certificate.clone(),
            stopped: stop.load(Ordering::Relaxed),
            faults,
            report,
            board: board?,
            log,
        })
    }
}

/// The simulated board, beside the loop.
struct SimulatedBoard {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Result<ServeReport, ServeError>>,
}

impl SimulatedBoard {
    fn start(scenario: &Scenario, options: ServeOptions) -> Result<(SimulatedBoard, Address), SessionError> {
        let (mut terminal, _) =
            PseudoTerminal::open().map_err(system("a pseudo-terminal could not be opened"))?;
        let address = terminal.address();
        let stop = Arc::new(AtomicBool::new(false));
        let (scenario, flag) = (scenario.clone(), stop.clone());
        let thread = std::thread::Builder::new()
            .name("clutch-board".to_owned())
            .spawn(move || serve(&scenario, &options, &mut terminal, &flag, |_| ()))
            .map_err(system("the simulated board could not be started"))?;
        Ok((SimulatedBoard { stop, thread }, address))
    }

    fn stop(self) -> Result<ServeReport, SessionError> {
        self.stop.store(true, Ordering::Relaxed);
        let end = self.thread.join();
        let report = end.map_err(|_| SessionError::Panicked("the simulated board came to a bad end"))?;
        Ok(report?)
    }
}

/// A log that was begun before the board was armed: what cannot be logged is known before anything moves.
struct Logging {
    thread: Option<LogThread>,
    ring: Option<Ring>,
    shown: Option<Ring>,
    watch: Arc<Watch>,
}

impl Logging {
    /// The log with what a board has said that is ready; of a run that it refused nothing stays.
    fn of_a_run<T, E>(self, ready: Result<T, E>) -> Result<(Logging, T), E> {
        match ready {
            Ok(ready) => Ok((self, ready)),
            Err(why) => {
                drop((self.ring, self.shown));
                self.thread.into_iter().for_each(LogThread::discard);
                Err(why)
            }
        }
    }
}

/// The receivers of a run's records: none in a release test.
#[derive(Clone, Copy, Default)]
struct Receivers<'a> {
    log: Option<&'a Path>,
    onlooker: Option<&'a dyn Onlooker>,
}

/// A session on its way.
struct Course<'a> {
    session: &'a Session,
    address: &'a Address,
    stop: &'a Arc<AtomicBool>,
    /// As [`Watch::passed`], for a simulated board.
    passed: Arc<AtomicU32>,
    event: &'a mut dyn FnMut(Event),
}

type Ran = (LoopReport, Option<LogSummary>);

impl Course<'_> {
    /// The loop is closed here.
    fn on_daq<T: Real>(&mut self) -> Result<Ran, SessionError> {
        let scenario = &self.session.scenario;
        let (mut port, notes) = self.open((Sample::LENGTH, Actuate::LENGTH))?;
        let mut station = controller(&BuiltRun::<T>::new(scenario, 0)?, from_scenario::path(scenario)?);
        let mut hello = Talk::new(&mut port, &mut station).discover(GREETING)?;
        self.check_fit(&hello, &port)?;
        let first = self.session.first(&port);
        self.announce(&hello, &port, &notes, None)?;
        if let Some(test) = first {
            let (report, _) = self.daq_run::<T>(&test.scenario, &mut port, &hello, Receivers::default())?;
            self.passed(&report)?;
            hello = Talk::new(&mut port, &mut station).discover(GREETING)?;
        }
        self.daq_run::<T>(scenario, &mut port, &hello, self.session.receivers())
    }

    /// A run on a board that has said who it is.
    fn daq_run<T: Real>(
        &mut self,
        scenario: &Scenario,
        port: &mut Port,
        hello: &Hello,
        receivers: Receivers<'_>,
    ) -> Result<Ran, SessionError> {
        let built = self.built::<T>(scenario, hello)?;
        let mut station = controller(&built, from_scenario::path(scenario)?);
        let present = present_code(hello, built.supervisor.safe_codes().hold);
        let (gains, changes) = self.tuning(scenario, &built, receivers);
        let log = self.log(&built, present, &board_text(hello), receivers, gains)?;
        let judged = self.expected(hello, port, built.servo.period());
        let mut talk = Talk::new(port, &mut station);
        let ready = talk.configure(present).and_then(|()| talk.clock(judged));
        let (log, clock) = log.of_a_run(ready)?;
        let configured = ConfiguredRun {
            station: &mut station,
            port,
            ring: log.ring,
            shown: log.shown,
            changes,
            watch: &log.watch,
            patient: self.session.patient(),
            ticks: built.ticks,
            clock,
            detector: built.detector,
            drift: built.drift,
        };
        self.drive(scenario, configured, log.thread)
    }

    /// The loop is closed on the board.
    fn on_controller(&mut self) -> Result<Ran, SessionError> {
        let scenario = &self.session.scenario;
        // Telemetry each cycle; now and then a word to it.
        let (mut port, notes) = self.open((Telemetry::LENGTH, 0))?;
        let mut station = host(scenario, &BuiltRun::<f32>::new(scenario, 0)?, false)?;
        let mut hello = Talk::new(&mut port, &mut station).discover(GREETING)?;
        let met = station.node.controller().copied();
        let board = met.as_ref().map_or_else(String::new, controller_text);
        self.check_fit(&hello, &port)?;
        let first = self.session.first(&port);
        self.announce(&hello, &port, &notes, Some(&board))?;
        if let Some(test) = first {
            let (report, _) =
                self.controller_run(&test.scenario, &mut port, &hello, met.as_ref(), Receivers::default())?;
            self.passed(&report)?;
            hello = Talk::new(&mut port, &mut station).discover(GREETING)?;
        }
        self.controller_run(scenario, &mut port, &hello, met.as_ref(), self.session.receivers())
    }

    /// A run on a board that closes the loop, and that has said who it is.
    fn controller_run(
        &mut self,
        scenario: &Scenario,
        port: &mut Port,
        hello: &Hello,
        met: Option<&ControllerHello>,
        receivers: Receivers<'_>,
    ) -> Result<Ran, SessionError> {
        let patient = self.session.patient();
        let built = self.built::<f32>(scenario, hello)?;
        let host_silence = if patient { built.controller.silence } else { HOST_SILENCE };
        let settings = from_scenario::settings(scenario, &built, host_silence, built.ticks)?;
        let mut station = host(scenario, &built, patient)?;
        if let Some(met) = met {
            station.node.meet(met);
        }
        let hold = built.supervisor.safe_codes().hold;
        let board = met.map_or_else(String::new, controller_text) + &started_text(hello);
        let log = self.log(&built, present_code(hello, hold), &board, receivers, None)?;
        let judged = self.expected(hello, port, built.servo.period());
        let mut talk = Talk::new(port, &mut station);
        let ready =
            talk.upload(&settings).and_then(|()| talk.configure(hold)).and_then(|()| talk.clock(judged));
        let (log, clock) = log.of_a_run(ready)?;
        let configured = ConfiguredRun {
            station: &mut station,
            port,
            ring: log.ring,
            shown: log.shown,
            changes: None,
            watch: &log.watch,
            patient,
            ticks: built.ticks,
            clock,
            detector: built.detector,
            drift: built.drift,
        };
        let (report, log) = self.drive(scenario, configured, log.thread)?;
        Ok((LoopReport { clock_hz: met.map_or(0, |c| c.clock_hz), ..report }, log))
    }

    /// The verdict of a release test.
    fn passed(&self, report: &LoopReport) -> Result<(), SessionError> {
        // A stop of the test stops the run as well.
        if report.cause == Cause::Done || self.stop.load(Ordering::Relaxed) {
            return Ok(());
        }
        let text = cause_text(report.cause, report.value, report.on_the_board, false);
        Err(SessionError::Released { cause: report.cause, text })
    }

    /// Opens the port, whose line carries frames with bodies of these lengths each cycle, from the board and to it.
    fn open(&self, (up, down): (usize, usize)) -> Result<(Port, Vec<String>), SessionError> {
        let options = SerialOptions { baud: self.session.options.baud, low_latency: true };
        let opened = Port::open(self.address, &options)?;
        let (port, mut notes) = (opened.port, opened.notes);
        let period = Duration::from_micros(u64::from(self.session.scenario.spec().period.0));
        if port.kind().has_line_rate() {
            let on_the_line = |body: usize| if body > 0 { body + AROUND_A_BODY } else { 0 };
            notes.extend(port.check_baud((on_the_line(down), on_the_line(up)), period)?);
        }
        Ok((port, notes))
    }

    /// Checks that encoder and converter are those of the scenario.
    fn check_fit(&self, hello: &Hello, port: &Port) -> Result<(), PreflightError> {
        let mut lines = from_scenario::misfits(&self.session.scenario, hello);
        let is_controller = matches!(self.session.options.board, Board::Controller(_));
        if is_simulated(hello) && is_real(port) && !is_controller {
            lines.push(format!(
                "board: its serial number {} is kept for simulated boards; give it another",
                hello.board
            ));
        }
        if self.session.patient() && hello.board != PATIENT_BOARD {
            lines.push(format!(
                "board: {}, and its clock waits for nobody; run without patience",
                board_text(hello)
            ));
        }
        if lines.is_empty() {
            return Ok(());
        }
        Err(PreflightError::Misfit { address: self.address.to_string(), lines })
    }

    /// What is expected of the board's clock by this machine's; nothing where it may wait, or where the simulation is our
    /// own. A board that only calls itself simulated may slip, as a simulated one does where its machine stalls, and no more:
    /// behind a socket it may be a real one. At a real port it is never taken for one.
    fn expected(&self, hello: &Hello, port: &Port, period: Micros) -> Option<Expected> {
        let ours = matches!(self.session.options.board, Board::Simulated { .. });
        let judged = !self.session.patient() && !ours;
        judged.then_some(Expected { period, slips: !is_real(port) && is_simulated(hello) })
    }

    /// A new run on a board with this clock: when the clock waits, so does our patience.
    fn built<T: Real>(&self, scenario: &Scenario, hello: &Hello) -> Result<BuiltRun<T>, BuildError> {
        let mut built = BuiltRun::<T>::new(scenario, hello.run.wrapping_add(1).max(1))?;
        built.controller.boot = hello.boot;
        if self.session.patient() {
            built.controller.silence = PATIENT_SILENCE;
        }
        Ok(built)
    }

    /// Says what will be done; `controller` is the board that closes the loop, if one does.
    fn announce(
        &mut self,
        hello: &Hello,
        port: &Port,
        notes: &[String],
        controller: Option<&str>,
    ) -> Result<(), SessionError> {
        let mut announcement = self.announcement(hello, port.kind())?;
        let auto = self.session.options.release == Release::Auto && is_real(port);
        let test = match (self.session.first(port), &self.session.release) {
            (Some(test), _) => Some(test.describe()?),
            (None, Err(why)) if auto => Some(format!("no test: {why}")),
            _ => None,
        };
        announcement.rows.extend(test.map(|test| ("release", test)));
        let remarks = &mut announcement.remarks;
        remarks.extend(self.session.note.iter().chain(notes).map(|note| format!("note: {note}")));
        remarks.extend(controller.map(|board| format!("the loop is closed on the board: {board}")));
        (self.event)(Event::Announced(announcement));
        Ok(())
    }

    fn announcement(&self, hello: &Hello, kind: DeviceKind) -> Result<Announcement, SessionError> {
        let Session { scenario, cleared, .. } = self.session;
        let plan = &cleared.plan;
        let (spec, safety) = (scenario.spec(), scenario.safety()?);
        let safe = match safety.on_fault {
            SafeState::Hold(SafeHold { volts }) => format!("hold with {} V", number(volts)),
            SafeState::Ramp(SafeRamp { rate, volts }) => {
                format!("ramp by {} V/s to {} V, and hold", number(rate), number(volts))
            }
            SafeState::Release => "release".to_owned(),
            SafeState::HoldThenRelease(SafeHoldThenRelease { volts, after }) => {
                format!("hold with {} V for {} s, then release", number(volts), number(after))
            }
        };
        let (boot, holds) = from_scenario::boot_output(scenario, hello, plan);
        let board = format!(
            "{}; {} counts/rev, {} bit, powers up at {} V",
            board_text(hello),
            hello.counts_per_rev,
            hello.dac_bits,
            number(boot)
        );
        let fastest = number(plan.envelope.velocity.to_degrees());
        let outside = |lines: Vec<String>| {
            if lines.is_empty() { "" } else { ", outside of which the scenario's rig lies" }
        };
        let gains = if self.session.certified() {
            let outside = outside(scenario.outside_bounds(&plan.bounds)?);
            format!("certified in continuous time for the bounds given{outside}")
        } else if cleared.proven.is_some() && cleared.sampled.bound_suffices() {
            let outside = outside(scenario.outside_sampled(&plan.bounds)?);
            format!("not certified in continuous time; certified as sampled for the bounds given{outside}")
        } else {
            "NOT certified in continuous time; run all the same, as asked".to_owned()
        };
        let mut rows = vec![
            ("port", format!("{}, {}", self.address, kind.describe())),
            ("board", board),
            (
                "loop",
                format!(
                    "{} µs, answers due within {} µs",
                    spec.period.0, safety.limits.supervisor.deadline.0
                ),
            ),
            ("path", format!("{} s, up to {fastest} °/s", number(spec.run.duration))),
            ("gains", gains),
            ("as sampled", cleared.sampled.short_line(cleared.proven.as_ref())),
            ("safe state", format!("{safe}: {}", safety.reason.0)),
            ("watchdog", format!("{} {} on the board", safety.limits.watchdog_cycles, CYCLES.text)),
        ];
        rows.extend(describe_system().first().map(|system| ("system", system.clone())));
        let mut remarks = start_notes(hello);
        if !holds {
            let does = if plan.bounds.actuator == ActuatorKind::Motor { "drives" } else { "does not hold" };
            remarks.push(format!("note: the board powers up at a voltage that {does} the shaft; set its power-up output to the safe state's"));
        }
        remarks.extend(cleared.limits_met(scenario));
        if is_simulated(hello)
            && let Some(reason) = scenario.cannot_follow()?
        {
            remarks.push(format!("note: {reason}"));
        }
        if !is_simulated(hello) && plan.bounds.actuator != ActuatorKind::Motor {
            remarks.push(
                "note: a brake that a motor presses lets go when its power fails; no software changes that"
                    .to_owned(),
            );
        }
        Ok(Announcement { title: scenario.name().to_owned(), rows, remarks })
    }

    /// The gains that one who looks on may change, and the control thread's end; none where the scenario allows none.
    #[expect(clippy::type_complexity, reason = "two ends of one thing")]
    fn tuning<T: Real>(
        &self,
        scenario: &Scenario,
        built: &BuiltRun<T>,
        receivers: Receivers<'_>,
    ) -> (Option<Arc<dyn LiveGains>>, Option<Changes<Servo<T>>>) {
        let allowed = scenario.safety().is_ok_and(|safety| safety.live_gains);
        if !allowed || receivers.onlooker.is_none() {
            return (None, None);
        }
        let (tuning, changes) = Tuning::new(scenario, built, self.session.options.uncertified);
        (Some(Arc::new(tuning)), Some(changes))
    }

    /// Begins the log, and the view.
    fn log<T: Real>(
        &self,
        built: &BuiltRun<T>,
        present: DacCode,
        board: &str,
        receivers: Receivers<'_>,
        gains: Option<Arc<dyn LiveGains>>,
    ) -> Result<Logging, SessionError> {
        let Session { scenario, options, .. } = self.session;
        let (stop, passed) = (self.stop.clone(), self.passed.clone());
        let watch = Arc::new(Watch { stop, passed, ..Watch::default() });
        let port = self.address.to_string();
        let mut header = from_scenario::header(scenario, &built.servo, Source::Loop, &port, &options.version);
        header.extra.push((PRESENT_CODE.to_owned(), present.0.to_string()));
        header.extra.push(("board".to_owned(), board.to_owned()));
        header.extra.extend(self.session.cleared.verdicts());
        let started = receivers.log.map(|path| LogThread::start(path, &header, watch.clone())).transpose()?;
        let (thread, ring) = started.unzip();
        let shown = receivers.onlooker.map(|onlooker| onlooker.begin(&header, scenario, gains));
        Ok(Logging { thread, ring, shown, watch })
    }

    /// Runs it on a thread of its own, and looks at it from this one.
    fn drive<S: Station + Send>(
        &mut self,
        scenario: &Scenario,
        configured: ConfiguredRun<'_, S>,
        log: Option<LogThread>,
    ) -> Result<Ran, SessionError> {
        let (watch, ticks) = (configured.watch, configured.ticks);
        let SessionOptions { realtime, pace, on_drift, log: path, .. } = &self.session.options;
        let settle = scenario.spec().run.settle;
        let hooks: (fn(), fn()) = (|| (), || ());
        let options = LoopOptions { realtime: *realtime, pace: *pace, settle, on_drift: *on_drift, hooks };
        let drift = *configured.drift.report();
        let report = std::thread::scope(|scope| {
            let control = std::thread::Builder::new()
                .name("clutch-control".to_owned())
                .spawn_scoped(scope, move || control_loop::run(configured, &options))
                .map_err(system("the control thread could not be started"))?;
            self.look_on(&control, watch, ticks, &drift);
            control.join().map_err(|_| SessionError::Panicked("the control thread came to a bad end; the board's watchdog has put the brake into the safe state"))
        })?;
        let log = log.zip(path.as_ref()).map(|(thread, path)| LogSummary {
            path: path.clone(),
            records: thread.finish().map(|summary| summary.records).map_err(|error| error.to_string()),
        });
        Ok((report, log))
    }

    /// Reports where the run stands until it is over.
    fn look_on(
        &mut self,
        control: &ScopedJoinHandle<'_, LoopReport>,
        watch: &Watch,
        ticks: u64,
        drift: &DriftReport,
    ) {
        let period = self.session.scenario.spec().period.seconds::<f64>();
        let (mut log_ended, mut alarms) = (false, 0);
        while !control.is_finished() {
            (self.event)(Event::Progress(Progress {
                time: watch.tick.load(Ordering::Relaxed) as f64 * period,
                duration: ticks as f64 * period,
                error: watch.error_nrad.load(Ordering::Relaxed) as f64 * 1e-9,
                volts: watch.millivolts.load(Ordering::Relaxed) as f64 / 1e3,
                lost: watch.lost.load(Ordering::Relaxed),
                late_answers: watch.late_answers.load(Ordering::Relaxed),
            }));
            if watch.log_ended.load(Ordering::Relaxed) && !log_ended {
                log_ended = true;
                (self.event)(Event::LogEnded);
            }
            self.tell_drift(watch, drift, &mut alarms);
            std::thread::sleep(LOOK_EVERY);
        }
        // One that has ended the run came after the last look.
        self.tell_drift(watch, drift, &mut alarms);
    }

    /// Reports an alarm of drift that is new.
    fn tell_drift(&mut self, watch: &Watch, drift: &DriftReport, told: &mut u64) {
        let (number, alarm) = watch.drift.last();
        if number > *told {
            *told = number;
            (self.event)(Event::Drift(drift.alarm_words(&alarm)));
        }
    }
}

fn controller<T: Real, P>(built: &BuiltRun<T>, path: P) -> ControllerStation<T, Law<T>, P> {
    ControllerStation::new(ControllerNode::new(built.controller, built.servo, built.supervisor), path)
}

fn host<'a>(
    scenario: &'a Scenario,
    built: &BuiltRun<f32>,
    patient: bool,
) -> Result<HostStation<impl clutch_core::Planned<f32> + 'a>, BuildError> {
    let configure = ControllerNode::new(built.controller, built.servo, built.supervisor).configuration();
    let silence = if patient { u64::from(PATIENT_SILENCE.0) * 1000 } else { BOARD_SILENCE_NS };
    let node = HostNode::new(built.servo, configure, ALIVE_NS, silence);
    Ok(HostStation::new(node, from_scenario::path::<f32>(scenario)?))
}

/// True for a device, of which nobody knows how it is wired.
fn is_real(port: &Port) -> bool {
    port.kind() != DeviceKind::PseudoTerminal && !port.kind().is_socket()
}
