//! The controller role: the loop runs on the board, and a host looks on.
//!
//! ```text
//!            Set… Configure Arm Stop Ping            Configure Arm Actuate Stop
//!   host ────────────────────────────────► BoardController ───────────────────────────► encoder and
//!        ◄──────────────────────────────── (loop)  ◄─────────────────────────── converter
//!          Taken Configured Armed Telemetry           Configured Armed Sample
//! ```
//!
//! Towards encoder and converter it is a [`ControllerNode`], the one that runs on Linux; they are a
//! [`crate::BoardNode`] behind another serial line, or on the same chip ([`crate::OneChip`]). Towards
//! the host it speaks the same protocol as a board, with settings before and telemetry instead of
//! samples. A host that falls silent ends the run in the safe state.

use crate::board::misunderstood;
use crate::controller::{ControllerNode, ControllerParams};
use crate::controller_telemetry::{frame, states};
use crate::notice::{Ending, Notice};
use crate::outbox::{Outbox, Sink};
use clutch_core::law::LawTerms;
use clutch_core::supervisor::State;
use clutch_core::{DacCode, Micros};
use clutch_settings::{Built, MAX_KNOTS, Misfit, Path, Prepared, SETTINGS_HASH, Settings};
use clutch_wire::{
    Armed, BoardState, Configure, Configured, ControllerHello, Decoder, Discover, Ended, Hello, Link,
    Message, Pong, Refusal, Refused, SCHEMA, Sample, Set, Stop, StopReason, Taken, VERSION,
};

/// Parameters of a board in the controller role.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoardControllerParams {
    /// Its serial number; 0 and 1 are emulated boards.
    pub board: u32,
    /// A number that changes at each power-up.
    pub boot: u32,
    /// Frequency of the clock whose cycles [`BoardController::spent`] is given, Hz; 0 if it is not called.
    pub clock_hz: u32,
}

/// Interval of the reports to the host on what the line has carried.
const LINK_EVERY_NS: u64 = 1_000_000_000;

/// A run that the host has configured.
#[derive(Clone, Debug)]
struct Run {
    control: ControllerNode<f32>,
    path: Path,
    number: u16,
    config: u64,
    ticks: u64,
    host_silence_ns: u64,
    /// Telemetry so far.
    told: u16,
}

/// The controller role's state machine. Times are the board's monotonic clock, ns.
#[derive(Clone, Debug)]
pub struct BoardController {
    params: BoardControllerParams,
    decoder: Decoder,
    settings: Settings,
    /// The run that the settings are for.
    settings_run: u16,
    /// Numbers with which the targets of a table are computed.
    prepared: Prepared,
    /// Encoder and converter, once they have answered.
    hello: Option<Hello>,
    run: Option<Run>,
    heard_ns: u64,
    linked_ns: u64,
    spent: u32,
    /// Notices that were heard and are still to be followed.
    news: News,
}

type Cycle = Notice<f32, LawTerms<f32>>;

/// The way of a run's notices to the host. Not a function: it borrows field by field, and control goes on beside it.
macro_rules! report {
    ($node:ident, $run:ident, $host:ident) => {
        Report {
            run: $run.number,
            config: $run.config,
            boot: $node.params.boot,
            told: &mut $run.told,
            spent: $node.spent,
            hello: &mut $node.hello,
            host: $host,
            news: &mut $node.news,
        }
    };
}

impl BoardController {
    /// A board at power-up.
    #[inline] // in place: a copy of it would be on the stack of who keeps it
    #[must_use]
    pub fn new(params: BoardControllerParams) -> Self {
        BoardController {
            params,
            decoder: Decoder::new(),
            settings: Settings::default(),
            settings_run: 0,
            prepared: Prepared::default(),
            hello: None,
            run: None,
            heard_ns: 0,
            linked_ns: 0,
            spent: 0,
            news: News::default(),
        }
    }

    /// The state of control.
    #[must_use]
    pub fn state(&self) -> State {
        self.run.as_ref().map_or(State::Disconnected, |r| r.control.state().state())
    }

    /// True if it drives, or has the consent to.
    #[must_use]
    pub fn driving(&self) -> bool {
        self.run.as_ref().is_some_and(Run::driving)
    }

    /// The frame that tells encoder and converter to go to the safe state, for a handler that can trust nothing
    /// else; none while nothing is driven.
    #[must_use]
    pub fn last_word(&self) -> Option<Outbox> {
        let run = self.run.as_ref().filter(|r| r.driving())?;
        let mut out = Outbox::default();
        out.push(&Message::Stop(Stop { run: run.number, reason: StopReason::Fault as u8 }));
        Some(out)
    }

    /// Clock cycles that the last tick took, for the telemetry of the next.
    pub fn spent(&mut self, cycles: u32) {
        self.spent = cycles;
    }

    /// Reports how long the last answer took, from sample to write.
    pub fn answered(&mut self, lateness: Micros) {
        if let Some(run) = &mut self.run {
            run.control.answered(lateness);
        }
    }

    /// The latest time at which [`BoardController::poll`] has to be called, ns; none while nothing is awaited.
    #[must_use]
    pub fn poll_at(&self) -> Option<u64> {
        let run = self.run.as_ref()?;
        let host = (run.driving() && run.host_silence_ns > 0)
            .then(|| self.heard_ns.saturating_add(run.host_silence_ns));
        match (run.control.poll_at(), host) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        }
    }

    /// Looks at the clock: silence of encoder and converter, silence of the host.
    pub fn poll(&mut self, now_ns: u64, host: &mut Outbox, daq: &mut impl Sink) {
        let Some(run) = &mut self.run else { return };
        let (number, mut ends) = (run.number, false);
        run.control.poll(now_ns, daq, &mut |n: Cycle| {
            if let Notice::Ended(ending) = n {
                host.push(&ended(number, &ending));
                ends = true;
            }
        });
        if ends {
            tell_link(run, host);
        }
        let silent = now_ns.saturating_sub(self.heard_ns);
        if run.driving() && run.host_silence_ns > 0 && silent >= run.host_silence_ns {
            run.end(StopReason::Operator, host, daq);
        }
    }

    /// Bytes from the host.
    pub fn host(&mut self, now_ns: u64, bytes: &[u8], host: &mut Outbox, daq: &mut impl Sink) {
        for byte in bytes {
            if let Some(Ok(message)) = self.decoder.push(*byte) {
                self.message(now_ns, &message, host, daq);
            }
        }
    }

    /// Bytes from encoder and converter, over a line whose frames `line` reads.
    pub fn daq(
        &mut self,
        now_ns: u64,
        line: &mut Decoder,
        bytes: &[u8],
        host: &mut Outbox,
        daq: &mut impl Sink,
    ) {
        let Some(run) = &mut self.run else {
            for byte in bytes {
                if let Some(Ok(message)) = line.push(*byte) {
                    introduction(&mut self.hello, &message, host);
                }
            }
            return;
        };
        let drove = run.driving();
        let (path, knots, prepared) = (&run.path, self.settings.knots(), &self.prepared);
        let at = |tick: u64| path.target_with(knots, prepared, tick);
        let mut report = report!(self, run, host);
        run.control.receive(now_ns, line, bytes, &at, daq, &mut |n| report.notice(n));
        self.follow(now_ns, drove, host, daq);
    }

    /// A message of encoder and converter by value, other than a sample. [`BoardController::follow`] comes after it.
    // A function of its own in machine code: in most periods there is none.
    #[cold]
    #[inline(never)]
    pub(crate) fn hear(&mut self, message: &Message, host: &mut Outbox, daq: &mut impl Sink) {
        let Some(run) = &mut self.run else { return introduction(&mut self.hello, message, host) };
        let mut report = report!(self, run, host);
        run.control.message(message, daq, &mut |n| report.notice(n));
    }

    /// A sample by value. [`BoardController::follow`] comes after it.
    pub(crate) fn sample(&mut self, now_ns: u64, sample: &Sample, host: &mut Outbox, daq: &mut impl Sink) {
        let Some(run) = &mut self.run else { return };
        let (path, knots, prepared) = (&run.path, self.settings.knots(), &self.prepared);
        let at = |tick: u64| path.target_with(knots, prepared, tick);
        let mut report = report!(self, run, host);
        run.control.sample(now_ns, sample, false, &at, daq, &mut |n| report.notice(n));
    }

    /// Draws the conclusions from the notices that were heard; `drove`: true if it drove before them.
    pub(crate) fn follow(&mut self, now_ns: u64, drove: bool, host: &mut Outbox, daq: &mut impl Sink) {
        let news = core::mem::take(&mut self.news);
        let Some(run) = &mut self.run else { return };
        if news.told {
            self.spent = 0;
        }
        if news.armed
            && let Some(hello) = &mut self.hello
        {
            // From now on the converter has not the code of power-up any more.
            hello.state = BoardState::Armed as u8;
        }
        if news.ends || (drove && !run.driving()) {
            tell_link(run, host);
        }
        let state = run.control.state();
        if state.state() == State::Running && state.tick().saturating_add(1) >= run.ticks {
            run.end(StopReason::Done, host, daq);
        }
        if run.driving() && now_ns.saturating_sub(self.linked_ns) >= LINK_EVERY_NS {
            self.linked_ns = now_ns;
            tell_link(run, host);
        }
    }

    fn message(&mut self, now_ns: u64, message: &Message, host: &mut Outbox, daq: &mut impl Sink) {
        match message {
            // Messages that only a host sends show that it lives; an echo of this board's own words does not.
            Message::Discover(_)
            | Message::Set(_)
            | Message::Configure(_)
            | Message::Arm(_)
            | Message::Stop(_)
            | Message::Ping(_) => self.heard_ns = now_ns,
            _ => return,
        }
        match message {
            Message::Discover(m) => self.discover(m, host, daq),
            Message::Set(m) => self.set(m, host),
            Message::Configure(m) => {
                if let Err((reason, value)) = self.configure(now_ns, m, daq) {
                    let request = Configure::KIND;
                    host.push(&Message::Refused(Refused { request, reason: reason as u8, value }));
                }
            }
            Message::Arm(m) => {
                let state = self.state();
                let refusal = match &mut self.run {
                    Some(run) if run.number == m.run && run.config == m.config => match state {
                        _ if m.boot != self.params.boot => (Refusal::Boot, 0),
                        State::Ready | State::Armed | State::Running => {
                            run.control.arm(daq);
                            return;
                        }
                        _ => (Refusal::State, state as u32),
                    },
                    _ => (Refusal::Run, u32::from(self.number())),
                };
                let (reason, value) = (refusal.0 as u8, refusal.1);
                let request = clutch_wire::Arm::KIND;
                host.push(&Message::Refused(Refused { request, reason, value }));
            }
            Message::Stop(m) => self.stop(m, host, daq),
            Message::Ping(m) => match &mut self.run {
                Some(run) if run.number == m.run => run.control.ping(m.nonce, daq),
                _ => {}
            },
            _ => {}
        }
    }

    fn number(&self) -> u16 {
        self.run.as_ref().map_or(0, |r| r.number)
    }

    fn discover(&mut self, m: &Discover, host: &mut Outbox, daq: &mut impl Sink) {
        if let Some(refused) = misunderstood(m) {
            host.push(&Message::Refused(refused));
            return;
        }
        host.push(&Message::ControllerHello(ControllerHello {
            nonce: m.nonce,
            version: VERSION,
            schema: SCHEMA,
            settings: SETTINGS_HASH,
            board: self.params.board,
            boot: self.params.boot,
            clock_hz: self.params.clock_hz,
            knots: MAX_KNOTS as u16,
            state: self.state() as u8,
            run: self.number(),
            config: self.run.as_ref().map_or(0, |r| r.config),
        }));
        daq.push(&Message::Discover(*m));
    }

    fn set(&mut self, m: &Set, host: &mut Outbox) {
        let refusal = if self.driving() {
            Some((Refusal::State, self.state() as u32))
        } else if !Settings::knows(m.key) {
            Some((Refusal::Setting, u32::from(m.key)))
        } else {
            if m.run != self.settings_run {
                self.settings = Settings::default();
                self.settings_run = m.run;
            }
            // Consent is to what was configured: a setting behind it takes it back. Were a consent
            // on its way already, the watchdog of encoder and converter would end it.
            if matches!(self.state(), State::Disconnected | State::Ready) {
                self.run = None;
            }
            (!self.settings.set(m.key, m.value)).then_some((Refusal::Setting, u32::from(m.key)))
        };
        host.push(&match refusal {
            None => Message::Taken(Taken { run: m.run, key: m.key, value: m.value }),
            Some((reason, value)) => {
                Message::Refused(Refused { request: Set::KIND, reason: reason as u8, value })
            }
        });
    }

    fn configure(&mut self, now_ns: u64, m: &Configure, daq: &mut impl Sink) -> Result<(), (Refusal, u32)> {
        if self.driving() {
            return Err((Refusal::State, self.state() as u32));
        }
        let Some(hello) = self.hello else { return Err((Refusal::NoBoard, 0)) };
        if m.run != self.settings_run {
            return Err((Refusal::Run, self.settings_run.into()));
        }
        let built: Built = self.settings.build().map_err(|misfit| match misfit {
            Misfit::Missing(_) | Misfit::Unknown(_) => (Refusal::Setting, misfit.bits()),
            Misfit::Unfit { .. } => (Refusal::Unfit, misfit.bits()),
        })?;
        let times = &built.times;
        let params = ControllerParams {
            run: m.run,
            config: m.config,
            boot: hello.boot,
            watchdog: times.watchdog,
            valid: times.valid,
            silence: times.silence,
        };
        let mut control = ControllerNode::new(params, built.servo, built.supervisor);
        // The run that the host asks for is the one of the settings, or there is none.
        if control.configuration() != *m {
            return Err((Refusal::Differs, 0));
        }
        built.path.prepare(self.settings.knots(), &mut self.prepared);
        control.configure(present_code(&hello, built.supervisor.safe_codes().hold), daq);
        self.run = Some(Run {
            control,
            path: built.path,
            number: m.run,
            config: m.config,
            ticks: built.ticks,
            host_silence_ns: u64::from(times.host_silence.0).saturating_mul(1000),
            told: 0,
        });
        self.linked_ns = now_ns;
        self.news = News::default();
        Ok(())
    }

    fn stop(&mut self, m: &Stop, host: &mut Outbox, daq: &mut impl Sink) {
        let Some(run) = self.run.as_mut().filter(|r| r.number == m.run) else { return };
        let reason = if m.reason == StopReason::Done as u8 { StopReason::Done } else { StopReason::Operator };
        if !run.end(reason, host, daq) {
            // It has ended before. Encoder and converter are told again, and say where they are.
            daq.push(&Message::Stop(*m));
        }
    }
}

impl Run {
    fn driving(&self) -> bool {
        matches!(self.control.state().state(), State::Armed | State::Running)
    }

    /// Ends control as wanted and reports so to the host; whether there was anything to end.
    fn end(&mut self, reason: StopReason, host: &mut Outbox, daq: &mut impl Sink) -> bool {
        let from = self.control.state().state();
        self.control.stop(reason, daq);
        let ends = self.control.state().state() != from;
        if ends {
            host.push(&ended(self.number, &self.control.ending(from)));
            tell_link(self, host);
        }
        ends
    }
}

/// The meaning of the controller's notices for the run.
#[derive(Clone, Copy, Debug, Default)]
struct News {
    told: bool,
    armed: bool,
    ends: bool,
}

/// The controller's notices on their way to the host.
struct Report<'a> {
    run: u16,
    config: u64,
    boot: u32,
    told: &'a mut u16,
    spent: u32,
    /// Encoder and converter, as they have introduced themselves.
    hello: &'a mut Option<Hello>,
    host: &'a mut Outbox,
    news: &'a mut News,
}

impl Report<'_> {
    fn notice(&mut self, n: Cycle) {
        let (run, config, boot) = (self.run, self.config, self.boot);
        match n {
            // Before consent nothing is driven, and the line stays free.
            Notice::Cycle(n) if n.cycle.state == State::Ready => {}
            Notice::Cycle(mut n) => {
                n.cycles = if self.news.told { 0 } else { self.spent };
                self.news.told = true;
                *self.told = self.told.wrapping_add(1);
                self.host.push(&Message::Telemetry(frame(run, *self.told, &n)));
            }
            Notice::Configured => self.host.push(&Message::Configured(Configured { run, config, boot })),
            Notice::Armed => {
                self.news.armed = true;
                self.host.push(&Message::Armed(Armed { run, config }));
            }
            Notice::Refused(m) => self.host.push(&Message::Refused(m)),
            Notice::Pong(nonce, time_us) => self.host.push(&Message::Pong(Pong { run, nonce, time_us })),
            Notice::Stopped(m) => self.host.push(&Message::Stopped(m)),
            Notice::BoardFault(m) => self.host.push(&Message::Fault(m)),
            // Before the telemetry of the sample that shows it.
            Notice::Ended(ending) => {
                self.news.ends = true;
                self.host.push(&ended(run, &ending));
            }
            Notice::Hello(m) => {
                *self.hello = Some(m);
                self.host.push(&Message::Hello(m));
            }
            // Another power-up of encoder and converter: the host hears nothing, asks again, and is told who is there.
            Notice::OtherBoot(_)
            | Notice::ControllerHello(_)
            | Notice::Taken(_)
            | Notice::BadFrame(_)
            | Notice::Echo => {}
        }
    }
}

/// Before there is a run: who are encoder and converter?
fn introduction(known: &mut Option<Hello>, message: &Message, host: &mut Outbox) {
    match message {
        Message::Hello(m) => {
            *known = Some(*m);
            host.push(message);
        }
        Message::Refused(_) => host.push(message),
        _ => {}
    }
}

fn ended(run: u16, ending: &Ending<f32>) -> Message {
    Message::Ended(Ended {
        run,
        tick: ending.tick as u32,
        states: states(ending.from, ending.state),
        cause: ending.cause as u8,
        value: ending.value.to_bits(),
    })
}

fn tell_link(run: &Run, host: &mut Outbox) {
    let (counts, state) = (run.control.counts(), run.control.state());
    host.push(&Message::Link(Link {
        run: run.number,
        received: counts.received as u32,
        lost: state.lost() as u32,
        late: counts.late as u32,
        duplicated: counts.duplicated as u32,
        reordered: counts.reordered as u32,
        bad_frames: counts.bad_frames as u32,
        rejected: state.rejected() as u32,
        deadline_misses: state.deadline_misses() as u32,
        dropped: host.dropped(),
    }));
}

/// The code that a converter has before the first answer of a run: that of power-up, or the safe
/// state's of the run before.
#[must_use]
pub fn present_code(hello: &Hello, hold: DacCode) -> DacCode {
    match BoardState::from_u8(hello.state) {
        Some(BoardState::Boot) => DacCode(hello.boot_code),
        _ => hold,
    }
}
