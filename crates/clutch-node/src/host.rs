//! The host of a board controller: it configures, consents, and hears.

use crate::board_pace::BoardPace;
use crate::controller_telemetry::{both_states, notice};
use crate::notice::{Ending, LinkCounts, Notice, Standing};
use crate::outbox::Outbox;
use clutch_core::law::LawTerms;
use clutch_core::supervisor::{Cause, State};
use clutch_core::{FixedCounts, Micros, Planned, Servo, Target};
use clutch_wire::{
    Arm, Configure, ControllerHello, Decoder, Discover, Message, Ping, SCHEMA, Set, Stop, StopReason,
    TELEMETRY_ASKED, Telemetry, VERSION,
};

/// The state machine of the host of a board controller. Times are the host's monotonic
/// clock, ns.
#[derive(Clone, Debug)]
pub struct HostNode {
    servo: Servo<f32>,
    configure: Configure,
    decoder: Decoder,
    standing: Standing<f32>,
    counts: LinkCounts,
    controller: Option<ControllerHello>,
    /// The position at which the path begins; none before it is known.
    origin: Option<FixedCounts>,
    /// Number of the last telemetry; they begin with 1 at each Configure.
    number: u16,
    heard_ns: Option<u64>,
    /// A frame that shows that the host lives is due then.
    due_ns: u64,
    alive_ns: u64,
    silent_ns: u64,
    pings: u32,
    stopping: Option<StopReason>,
    /// The board's converter has said that it is in its safe output.
    stopped: bool,
    /// It has been silent for too long: a later report does not bring the run back.
    given_up: bool,
    pace: BoardPace,
}

impl HostNode {
    /// For a run: `servo` as the board builds it, `configure` as a [`crate::ControllerNode`] of the same run
    /// gives it. The board hears from the host each `alive_ns`; if nothing comes from it for `silent_ns`,
    /// control has ended for the host.
    #[must_use]
    pub fn new(servo: Servo<f32>, configure: Configure, alive_ns: u64, silent_ns: u64) -> Self {
        HostNode {
            servo,
            configure,
            decoder: Decoder::new(),
            standing: Standing::default(),
            counts: LinkCounts::default(),
            controller: None,
            origin: None,
            number: 0,
            heard_ns: None,
            due_ns: 0,
            alive_ns,
            silent_ns,
            pings: 0,
            stopping: None,
            stopped: false,
            given_up: false,
            pace: BoardPace::default(),
        }
    }

    /// The state of control.
    #[must_use]
    pub fn standing(&self) -> &Standing<f32> {
        &self.standing
    }

    /// Counts of what the board's own line has carried.
    #[must_use]
    pub fn counts(&self) -> &LinkCounts {
        &self.counts
    }

    /// The board, once it has answered.
    #[must_use]
    pub fn controller(&self) -> Option<&ControllerHello> {
        self.controller.as_ref()
    }

    /// This board has answered, perhaps another node of this host.
    pub fn meet(&mut self, controller: &ControllerHello) {
        self.controller = Some(*controller);
    }

    /// The servo.
    #[must_use]
    pub fn servo(&self) -> &Servo<f32> {
        &self.servo
    }

    /// The position at which the path begins.
    #[must_use]
    pub fn origin(&self) -> FixedCounts {
        self.origin.unwrap_or_default()
    }

    /// Asks who is there.
    pub fn discover(&mut self, nonce: u32, out: &mut Outbox) {
        out.push(&Message::Discover(Discover { nonce, version: VERSION, schema: SCHEMA }));
    }

    /// Sends a setting.
    pub fn set(&mut self, key: u16, value: u64, out: &mut Outbox) {
        out.push(&Message::Set(Set { run: self.configure.run, key, value }));
    }

    /// Sends the run to the board, which has its settings.
    pub fn configure(&mut self, out: &mut Outbox) {
        out.push(&Message::Configure(self.configure));
    }

    /// Consent.
    pub fn arm(&mut self, out: &mut Outbox) {
        out.push(&Message::Arm(Arm {
            run: self.configure.run,
            config: self.configure.config,
            boot: self.controller.map_or(0, |c| c.boot),
        }));
    }

    /// Asks for the clock of encoder and converter.
    pub fn ping(&mut self, nonce: u32, out: &mut Outbox) {
        out.push(&Message::Ping(Ping { run: self.configure.run, nonce }));
    }

    /// Asks the board to end control, `Done` or `Operator`; again and again, until it says that it has.
    pub fn stop(&mut self, reason: StopReason, out: &mut Outbox) {
        if self.stopping.is_none() {
            self.stopping = Some(reason);
            self.send_stop(reason, out);
        }
    }

    fn send_stop(&self, reason: StopReason, out: &mut Outbox) {
        out.push(&Message::Stop(Stop { run: self.configure.run, reason: reason as u8 }));
    }

    /// The line is gone. The board goes on until it misses its host.
    pub fn disconnect(&mut self) {
        if matches!(self.standing.state, State::Armed | State::Running) {
            (self.standing.state, self.standing.cause) = (State::Faulted, Cause::Silence);
        } else if self.standing.state != State::Faulted {
            self.standing.state = State::Disconnected;
        }
    }

    fn driving(&self) -> bool {
        matches!(self.standing.state, State::Armed | State::Running)
    }

    /// The latest time at which [`HostNode::poll`] has to be called, ns.
    #[must_use]
    pub fn poll_at(&self) -> Option<u64> {
        if self.asks_to_stop() {
            return Some(self.due_ns);
        }
        self.driving()
            .then(|| self.heard_ns.map_or(self.due_ns, |t| t.saturating_add(self.silent_ns).min(self.due_ns)))
    }

    /// Looks at the clock: shows that the host lives, and whether the board does.
    pub fn poll(
        &mut self,
        now_ns: u64,
        out: &mut Outbox,
        notices: &mut impl FnMut(Notice<f32, LawTerms<f32>>),
    ) {
        if !self.driving() && !self.asks_to_stop() {
            return;
        }
        if self.driving() && self.heard_ns.is_some_and(|t| now_ns.saturating_sub(t) >= self.silent_ns) {
            // It may hear all the same, and still drive.
            self.given_up = true;
            self.end(State::Faulted, Cause::Silence, 0.0, notices);
            self.stopping.get_or_insert(StopReason::Operator);
            self.due_ns = now_ns;
        }
        if let Some(micros) = self.pace.off.take()
            && self.driving()
        {
            self.given_up = true;
            self.end(State::Faulted, Cause::Clock, micros as f32, notices);
            self.stopping.get_or_insert(StopReason::Operator);
            self.due_ns = now_ns;
        }
        if now_ns >= self.due_ns {
            self.due_ns = now_ns.saturating_add(self.alive_ns);
            self.pings = self.pings.wrapping_add(1);
            // Not a number that somebody asks the clock with.
            self.ping(self.pings | 1 << 31, out);
            if let Some(reason) = self.stopping {
                self.send_stop(reason, out);
            }
        }
    }

    /// The silence that is borne where it is long: of a simulated board whose clock may wait.
    fn patience(&self) -> Micros {
        let long = self.silent_ns > 2_000_000_000;
        Micros(if long { u32::try_from(self.silent_ns / 1000).unwrap_or(u32::MAX) } else { 0 })
    }

    /// The board has been asked to stop, and has not said that it has.
    fn asks_to_stop(&self) -> bool {
        self.stopping.is_some() && !self.stopped
    }

    fn end(
        &mut self,
        state: State,
        cause: Cause,
        value: f32,
        notices: &mut impl FnMut(Notice<f32, LawTerms<f32>>),
    ) {
        let from = self.standing.state;
        (self.standing.state, self.standing.cause, self.standing.value) = (state, cause, value);
        notices(Notice::Ended(Ending { from, state, cause, value, tick: self.standing.tick }));
    }

    /// Bytes from the board. `path` is the planned path from position 0 on.
    pub fn receive(
        &mut self,
        now_ns: u64,
        bytes: &[u8],
        path: &impl Planned<f32>,
        notices: &mut impl FnMut(Notice<f32, LawTerms<f32>>),
    ) {
        for byte in bytes {
            match self.decoder.push(*byte) {
                None => {}
                Some(Ok(message)) => self.message(now_ns, &message, path, notices),
                Some(Err(error)) => notices(Notice::BadFrame(error)),
            }
        }
    }

    fn message(
        &mut self,
        now_ns: u64,
        message: &Message,
        path: &impl Planned<f32>,
        notices: &mut impl FnMut(Notice<f32, LawTerms<f32>>),
    ) {
        let (run, config) = (self.configure.run, self.configure.config);
        match message {
            Message::ControllerHello(m) => {
                if self.standing.state == State::Disconnected {
                    self.meet(m);
                }
                notices(Notice::ControllerHello(*m));
            }
            Message::Hello(m) => notices(Notice::Hello(*m)),
            Message::Taken(m) if m.run == run => notices(Notice::Taken(*m)),
            Message::Configured(m) if m.run == run && m.config == config => {
                if self.controller.is_none_or(|c| c.boot != m.boot) {
                    notices(Notice::OtherBoot(*m));
                    return;
                }
                if self.standing.state == State::Disconnected {
                    self.standing.state = State::Ready;
                    self.number = 0;
                }
                notices(Notice::Configured);
            }
            Message::Armed(m) if m.run == run && m.config == config => {
                if self.standing.state == State::Ready {
                    self.standing = Standing { state: State::Armed, ..Standing::default() };
                    self.pace.consent();
                    self.origin = None;
                    (self.heard_ns, self.due_ns) = (Some(now_ns), now_ns);
                }
                notices(Notice::Armed);
            }
            Message::Refused(m) => notices(Notice::Refused(*m)),
            Message::Pong(m) if m.run == run => notices(Notice::Pong(m.nonce, m.time_us)),
            Message::Stopped(m) if m.run == run => {
                self.stopped = true;
                notices(Notice::Stopped(*m));
            }
            Message::Fault(m) if m.run == run => notices(Notice::BoardFault(*m)),
            Message::Telemetry(m) if m.run == run => self.telemetry(now_ns, m, path, notices),
            Message::Ended(m) if m.run == run => {
                let Some((_, state)) = both_states(m.states) else { return };
                let runs = self.driving() || self.standing.state == State::Ready;
                // Standing again, it is not news.
                if state != self.standing.state && runs {
                    let cause = Cause::from_u8(m.cause).unwrap_or_default();
                    self.end(state, cause, f32::from_bits(m.value), notices);
                }
            }
            Message::Link(m) if m.run == run => {
                let wide = u64::from;
                self.counts = LinkCounts {
                    received: wide(m.received),
                    bad_frames: wide(m.bad_frames),
                    foreign: 0,
                    late: wide(m.late),
                    duplicated: wide(m.duplicated),
                    reordered: wide(m.reordered),
                };
                self.standing.lost = wide(m.lost);
                self.standing.rejected = wide(m.rejected);
                self.standing.deadline_misses = wide(m.deadline_misses);
            }
            Message::Discover(_)
            | Message::Configure(_)
            | Message::Arm(_)
            | Message::Actuate(_)
            | Message::Stop(_)
            | Message::Ping(_)
            | Message::Set(_) => notices(Notice::Echo),
            // A message of another run.
            _ => {}
        }
    }

    /// The position at which the path begins, when the telemetry that says so got lost: a whole number of counts,
    /// from where the path and the shaft are and what lies between.
    fn origin_from(&self, m: &Telemetry, position: FixedCounts) -> FixedCounts {
        const HALF: i64 = 1 << (FixedCounts::FRACTION_BITS - 1);
        let encoder = self.servo.encoder();
        let error = FixedCounts::from_real(f32::from_bits(m.error) * encoder.counts_per_radian::<f32>());
        let target = FixedCounts::from_counts(i64::from(m.counts)).plus(error);
        let origin = target.0.wrapping_sub(position.0).wrapping_add(HALF) >> FixedCounts::FRACTION_BITS;
        // It was a count of the encoder's, which wraps.
        FixedCounts::from_counts(i64::from(origin as i32))
    }

    fn telemetry(
        &mut self,
        now_ns: u64,
        m: &Telemetry,
        path: &impl Planned<f32>,
        notices: &mut impl FnMut(Notice<f32, LawTerms<f32>>),
    ) {
        if self.given_up {
            return;
        }
        self.heard_ns = Some(now_ns);
        self.pace.sample(now_ns, m.sequence, self.servo.period(), self.patience());
        let gap = m.number.wrapping_sub(self.number).wrapping_sub(1);
        // Half the range back is a frame that came twice.
        if gap < 0x8000 {
            self.standing.untold = self.standing.untold.wrapping_add(u64::from(gap));
            self.number = m.number;
        }
        // The tick's high half is ours to know.
        let ahead = m.tick.wrapping_sub(self.standing.tick as u32).cast_signed();
        let tick = self.standing.tick.wrapping_add_signed(i64::from(ahead));
        if both_states(m.states).is_some_and(|(from, _)| from == State::Armed) {
            self.origin = Some(FixedCounts::from_counts(i64::from(m.counts)));
        }
        let target = path.target(tick);
        if self.origin.is_none() && m.flags & TELEMETRY_ASKED != 0 {
            self.origin = Some(self.origin_from(m, target.position));
        }
        let target = Target { position: target.position.plus(self.origin()), ..target };
        let Some(notice) = notice(m, &self.servo, tick, target) else { return };
        let cycle = &notice.cycle;
        // The `Ended` frame was lost.
        let ended = !matches!(cycle.from, State::Ready | State::Armed | State::Running);
        if self.driving() && ended {
            self.end(cycle.from, cycle.cause, cycle.value, notices);
        }
        self.standing.tick = tick;
        self.standing.state = cycle.state;
        self.standing.cause = cycle.cause;
        self.standing.value = cycle.value;
        notices(Notice::Cycle(notice));
    }
}
