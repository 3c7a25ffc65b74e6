//! The controller: handshake, cycle, stop. On a PC, and within [`crate::BoardController`].

use crate::board_pace::BoardPace;
use crate::notice::{CycleNotice, Ending, LinkCounts, Notice};
use crate::outbox::Sink;
use clutch_core::law::{ControlLaw, Law};
use clutch_core::supervisor::{BoardMode, Cause, Sample as Seen, State};
use clutch_core::{
    BeginningAt, Counts, DacCode, FixedCounts, Micros, Planned, Real, SafeKind, Servo, Supervisor,
    SupervisorState,
};
use clutch_wire::{
    Actuate, Arm, BoardState, Configure, Decoder, Discover, Message, Ping, SCHEMA, STATUS_DAC_FAULT,
    STATUS_ENCODER_FAULT, STATUS_LATE, STATUS_STATE, Sample, Stop, StopReason, VERSION,
};

/// Parameters of a run, on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ControllerParams {
    /// Number of the run; another for each run on a board.
    pub run: u16,
    /// Hash of the scenario.
    pub config: u64,
    /// The board's power-up, as its `Hello` has it. A `Hello` that comes before the run is configured sets it.
    pub boot: u32,
    /// The board's watchdog.
    pub watchdog: Micros,
    /// Time after its sample for which a code is valid.
    pub valid: Micros,
    /// Time without a sample after which the supervisor's check of silence is asked. A simulated
    /// board's clock may wait for a machine that stalls; there it is longer than the check's own
    /// cycles.
    pub silence: Micros,
}

/// The controller's state machine. Times are the host's monotonic clock, ns.
#[derive(Clone, Debug)]
pub struct ControllerNode<T: Real, C: ControlLaw<T> = Law<T>> {
    params: ControllerParams,
    servo: Servo<T, C>,
    supervisor: Supervisor<T>,
    state: SupervisorState<T, C::State>,
    counts: LinkCounts,
    /// The code that the converter has before the first answer.
    present: DacCode,
    /// The position at which the path begins: the counts of the first sample that is answered.
    origin: FixedCounts,
    last_sample_ns: Option<u64>,
    /// This silence has been reported to the supervisor.
    silence_told: bool,
    lateness: Micros,
    stopping: Option<StopReason>,
    pace: BoardPace,
}

impl<T: Real, C: ControlLaw<T>> ControllerNode<T, C> {
    /// A controller that has not spoken yet.
    #[must_use]
    pub fn new(params: ControllerParams, servo: Servo<T, C>, supervisor: Supervisor<T>) -> Self {
        ControllerNode {
            params,
            servo,
            supervisor,
            state: SupervisorState::default(),
            counts: LinkCounts::default(),
            present: supervisor.safe_codes().hold,
            origin: FixedCounts::default(),
            last_sample_ns: None,
            silence_told: false,
            lateness: Micros(0),
            stopping: None,
            pace: BoardPace::default(),
        }
    }

    /// The supervisor's state.
    #[must_use]
    pub fn state(&self) -> &SupervisorState<T, C::State> {
        &self.state
    }

    /// Counts of what the line has carried.
    #[must_use]
    pub fn counts(&self) -> &LinkCounts {
        &self.counts
    }

    /// The position at which the path begins.
    #[must_use]
    pub fn origin(&self) -> FixedCounts {
        self.origin
    }

    /// Another servo takes over from the next sample on, with the state that this one has left: one that differs in its law's
    /// gains alone.
    pub fn tune(&mut self, servo: Servo<T, C>) {
        self.servo = servo;
    }

    /// The servo.
    #[must_use]
    pub fn servo(&self) -> &Servo<T, C> {
        &self.servo
    }

    /// Asks who is there.
    pub fn discover(&mut self, nonce: u32, out: &mut impl Sink) {
        out.push(&Message::Discover(Discover { nonce, version: VERSION, schema: SCHEMA }));
    }

    /// Sends the run to the board; `present` is the code that its converter has now. The pre-flight has taken place.
    pub fn configure(&mut self, present: DacCode, out: &mut impl Sink) {
        self.present = present;
        out.push(&Message::Configure(self.configuration()));
    }

    /// The message that brings the run to the board.
    #[must_use]
    pub fn configuration(&self) -> Configure {
        let safe = self.supervisor.safe_codes();
        Configure {
            run: self.params.run,
            config: self.params.config,
            period_us: self.servo.period().0,
            watchdog_us: self.params.watchdog.0,
            safe_kind: match safe.kind {
                SafeKind::Hold => clutch_wire::SafeKind::Hold,
                SafeKind::Ramp => clutch_wire::SafeKind::Ramp,
                SafeKind::Release => clutch_wire::SafeKind::Release,
                SafeKind::HoldThenRelease => clutch_wire::SafeKind::HoldThenRelease,
            } as u8,
            hold_code: safe.hold.0,
            release_code: safe.release.0,
            ramp_step: safe.ramp_step,
            hold_periods: safe.hold_periods,
        }
    }

    /// Consent.
    pub fn arm(&mut self, out: &mut impl Sink) {
        out.push(&Message::Arm(Arm {
            run: self.params.run,
            config: self.params.config,
            boot: self.params.boot,
        }));
    }

    /// Asks for the board's clock.
    pub fn ping(&mut self, nonce: u32, out: &mut impl Sink) {
        out.push(&Message::Ping(Ping { run: self.params.run, nonce }));
    }

    /// Ends control as wanted: `Done` or `Operator`.
    pub fn stop(&mut self, reason: StopReason, out: &mut impl Sink) {
        if self.stopping.is_some() {
            return; // what ended control first is what the board is told, again and again
        }
        let cause = if reason == StopReason::Done { Cause::Done } else { Cause::Operator };
        self.supervisor.stop(&mut self.state, cause);
        self.send_stop(reason, out);
    }

    /// The line is gone.
    pub fn disconnect(&mut self) {
        self.supervisor.disconnect(&mut self.state);
    }

    /// Reports how long the last answer took, from sample to write.
    pub fn answered(&mut self, lateness: Micros) {
        self.lateness = lateness;
    }

    /// The latest time at which [`ControllerNode::poll`] has to be called, ns; none while nothing is
    /// awaited.
    #[must_use]
    pub fn poll_at(&self) -> Option<u64> {
        let watched = matches!(self.state.state(), State::Ready | State::Armed | State::Running);
        let silence = u64::from(self.params.silence.0).saturating_mul(1000);
        self.last_sample_ns.filter(|_| watched && !self.silence_told).map(|t| t.saturating_add(silence))
    }

    /// Looks at the clock: silence.
    pub fn poll(&mut self, now_ns: u64, out: &mut impl Sink, notices: &mut impl FnMut(Notice<T, C::Terms>)) {
        // Between samples, so that a replay knows which of them came before.
        if let Some(micros) = self.pace.off.take() {
            let from = self.state.state();
            self.supervisor.off_pace(&mut self.state, micros);
            self.after_fault(from, out, notices);
        }
        if self.poll_at().is_some_and(|at| now_ns >= at) {
            self.silence_told = true;
            let from = self.state.state();
            self.supervisor.silence(&mut self.state, u32::MAX);
            self.after_fault(from, out, notices);
        }
    }

    /// Bytes from the board, over a line whose frames `line` reads. The path is planned from position 0 on.
    pub fn receive(
        &mut self,
        now_ns: u64,
        line: &mut Decoder,
        bytes: &[u8],
        planned: &impl Planned<T>,
        out: &mut impl Sink,
        notices: &mut impl FnMut(Notice<T, C::Terms>),
    ) {
        // A sample waits until it is known whether a newer one came with it.
        let mut waiting: Option<Sample> = None;
        for byte in bytes {
            let message = match line.push(*byte) {
                None => continue,
                Some(Ok(message)) => message,
                Some(Err(error)) => {
                    self.counts.bad_frames = self.counts.bad_frames.wrapping_add(1);
                    notices(Notice::BadFrame(error));
                    continue;
                }
            };
            let sample = match message {
                Message::Sample(sample) => Some(sample),
                _ => None,
            };
            // Over a line a sample comes by the clock of another machine.
            if let Some(sample) = sample.filter(|s| s.run == self.params.run) {
                self.pace.sample(now_ns, sample.sequence, self.servo.period(), self.params.silence);
            }
            if let Some(earlier) = waiting.take() {
                let newer = sample.is_some_and(|s| {
                    s.run == earlier.run && (s.sequence.wrapping_sub(earlier.sequence) as i16) > 0
                });
                self.sample(now_ns, &earlier, newer, planned, out, notices);
            }
            match sample {
                Some(sample) => waiting = Some(sample),
                None => self.message(&message, out, notices),
            }
        }
        if let Some(sample) = waiting {
            self.sample(now_ns, &sample, false, planned, out, notices);
        }
    }

    // A function of its own in machine code, too: the timing analysis is told how often it is called.
    #[inline(never)]
    pub(crate) fn message(
        &mut self,
        message: &Message,
        out: &mut impl Sink,
        notices: &mut impl FnMut(Notice<T, C::Terms>),
    ) {
        let (run, config) = (self.params.run, self.params.config);
        match message {
            Message::Hello(m) => {
                if self.state.state() == State::Disconnected {
                    self.params.boot = m.boot;
                }
                notices(Notice::Hello(*m));
            }
            Message::ControllerHello(m) => notices(Notice::ControllerHello(*m)),
            Message::Configured(m) if m.run == run && m.config == config => {
                if m.boot != self.params.boot {
                    notices(Notice::OtherBoot(*m));
                    return;
                }
                self.supervisor.connect(&mut self.state);
                notices(Notice::Configured);
            }
            Message::Armed(m) if m.run == run && m.config == config => {
                self.supervisor.arm(&mut self.state, self.present);
                self.pace.consent();
                notices(Notice::Armed);
            }
            Message::Refused(m) => notices(Notice::Refused(*m)),
            Message::Pong(m) if m.run == run => notices(Notice::Pong(m.nonce, m.time_us)),
            Message::Stopped(m) if m.run == run => notices(Notice::Stopped(*m)),
            Message::Fault(m) if m.run == run => {
                notices(Notice::BoardFault(*m));
                let from = self.state.state();
                self.supervisor.board_fault(&mut self.state, T::from_i32(i32::from(m.cause)));
                self.after_fault(from, out, notices);
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

    // A function of its own in machine code, too: the timing analysis is told how often it is called.
    #[inline(never)]
    pub(crate) fn sample(
        &mut self,
        now_ns: u64,
        sample: &Sample,
        superseded: bool,
        planned: &impl Planned<T>,
        out: &mut impl Sink,
        notices: &mut impl FnMut(Notice<T, C::Terms>),
    ) {
        if sample.run != self.params.run {
            self.counts.foreign = self.counts.foreign.wrapping_add(1);
            return;
        }
        let board = BoardState::from_u8(sample.status & STATUS_STATE);
        let seen = Seen {
            sequence: sample.sequence,
            time: Micros(sample.time_us),
            counts: Counts(sample.counts),
            board: match board {
                Some(BoardState::Ready) => BoardMode::Ready,
                Some(BoardState::Armed | BoardState::Running) => BoardMode::Driving,
                _ => BoardMode::Safe,
            },
            encoder_fault: sample.status & STATUS_ENCODER_FAULT != 0,
            converter_fault: sample.status & STATUS_DAC_FAULT != 0,
            command_late: sample.status & STATUS_LATE != 0,
            // Before consent no answer is due: samples that pile up while the control thread starts
            // say nothing of the line.
            superseded: superseded && self.state.state() != State::Ready,
            lateness: self.lateness,
        };
        let lateness = core::mem::take(&mut self.lateness);
        if self.state.state() == State::Armed {
            self.origin = FixedCounts::from_counts(i64::from(sample.counts));
        }
        let origin = self.origin;
        let from_here = || BeginningAt { planned, origin };
        let cycle = self.supervisor.sample(&self.servo, &mut self.state, &seen, from_here());
        if let Some(code) = cycle.answer {
            out.actuate(&Actuate {
                run: self.params.run,
                sequence: sample.sequence,
                code: code.0,
                valid_us: u16::try_from(self.params.valid.0).unwrap_or(u16::MAX),
            });
        }
        // Control first: what follows does not change the answer.
        self.counts.received = self.counts.received.wrapping_add(1);
        self.last_sample_ns = Some(now_ns);
        self.silence_told = false;
        if cycle.from != State::Faulted && cycle.state == State::Faulted {
            self.send_stop(StopReason::Fault, out);
        } else if let Some(reason) = self.stopping {
            // Until the board says that it has heard.
            if seen.board == BoardMode::Driving {
                self.send_stop(reason, out);
            }
        }
        // The receiver of the notice takes time, and the next period needs what is computed here: that comes first.
        self.supervisor.expect(&mut self.state, &from_here());
        self.count(cycle.arrival);
        notices(Notice::Cycle(CycleNotice { sample: *sample, superseded, lateness, cycles: 0, cycle }));
    }

    fn count(&mut self, arrival: clutch_core::supervisor::Arrival) {
        use clutch_core::supervisor::Arrival;
        let counter = match arrival {
            Arrival::Late => &mut self.counts.late,
            Arrival::Duplicate => &mut self.counts.duplicated,
            Arrival::Reordered => &mut self.counts.reordered,
            _ => return,
        };
        *counter = counter.wrapping_add(1);
    }

    // A function of its own in machine code: a run that goes on has none.
    #[cold]
    #[inline(never)]
    fn after_fault(
        &mut self,
        from: State,
        out: &mut impl Sink,
        notices: &mut impl FnMut(Notice<T, C::Terms>),
    ) {
        if self.state.state() == State::Faulted && self.stopping.is_none() {
            notices(Notice::Ended(self.ending(from)));
            self.send_stop(StopReason::Fault, out);
        }
    }

    /// The end of control; `from` is the state before.
    pub(crate) fn ending(&self, from: State) -> Ending<T> {
        let s = &self.state;
        Ending { from, state: s.state(), cause: s.cause(), value: s.value(), tick: s.tick() }
    }

    // A function of its own in machine code: the run is over then.
    #[cold]
    #[inline(never)]
    fn send_stop(&mut self, reason: StopReason, out: &mut impl Sink) {
        self.stopping = Some(reason);
        out.push(&Message::Stop(Stop { run: self.params.run, reason: reason as u8 }));
    }
}
