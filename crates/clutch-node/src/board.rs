//! The board's end: samples out, codes in, a watchdog.
//!
//! ```text
//!            Configure            Arm            first Actuate
//!   Boot ───────────────► Ready ───────► Armed ───────────────► Running
//!                         ▲  ▲             │ │                    │ │
//!                         │  └─ Configure ─┼─┴── Stop ── Stopped ◄┘ │
//!                         │                └── watchdog ─┐          │ watchdog, Stop{fault}
//!                         └──────── Configure ────── Faulted ◄──────┘
//! ```
//!
//! `docs/wire.md` is the specification; this is one implementation, the one that the simulated
//! board and the firmware run.

use crate::outbox::Sink;
use clutch_core::{Counts, DacCode, SafeCodes, SafeKind, SafeRun};
use clutch_wire::{
    Actuate, Arm, Armed, BoardFault, BoardState, Configure, Configured, Decoder, Discover, Fault, Hello,
    Message, Pong, Refusal, Refused, ResetCause, SCHEMA, STATUS_DAC_FAULT, STATUS_ENCODER_FAULT, STATUS_LATE,
    Sample, StopReason, Stopped, VERSION, WARNING_BROWN_OUT, WATCHDOG_PERIODS,
};

/// Parameters of a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoardParams {
    /// Its serial number; 0 is the simulated board, whose clock may wait for the controller.
    pub board: u32,
    /// A number that changes at each power-up, and cannot be guessed: `Arm` has to bring it back.
    pub boot: u32,
    /// Encoder counts per revolution.
    pub counts_per_rev: u32,
    /// Converter: bits.
    pub dac_bits: u8,
    /// Converter: voltage of code 0, mV.
    pub dac_lowest_mv: i32,
    /// Converter: voltage one step above its highest code, mV.
    pub dac_highest_mv: i32,
    /// Shortest sampling period, µs.
    pub period_min_us: u32,
    /// Longest sampling period, µs.
    pub period_max_us: u32,
    /// Longest time that the watchdog can be set to, µs.
    pub watchdog_max_us: u32,
    /// Output at power-up: the safe output of the rig that the board is built into.
    pub boot_code: u16,
    /// The reason why its program started.
    pub started_by: ResetCause,
    /// Its supply may fall further before it is reset than its program asks for.
    pub brown_out_low: bool,
}

impl BoardParams {
    /// Checks them. A board whose numbers are constants checks them when it is compiled: refused at run time, they
    /// would leave an image that does nothing, and an optimiser removes the rest of it without a word.
    ///
    /// ```
    /// # use clutch_node::{BoardParams, ResetCause};
    /// const PARAMS: BoardParams = BoardParams {
    ///     board: 4711,
    ///     boot: 0,
    ///     counts_per_rev: 20_000,
    ///     dac_bits: 12,
    ///     dac_lowest_mv: 0,
    ///     dac_highest_mv: 10_000,
    ///     period_min_us: 500,
    ///     period_max_us: 4000,
    ///     watchdog_max_us: 100_000,
    ///     boot_code: 1844,
    ///     started_by: ResetCause::Unknown,
    ///     brown_out_low: false,
    /// };
    /// const _: () = assert!(PARAMS.check().is_ok());
    /// ```
    ///
    /// # Errors
    /// The first parameter that no board can have.
    pub const fn check(&self) -> Result<(), BoardMisfit> {
        Err(if self.dac_bits < 1 || self.dac_bits > 16 {
            BoardMisfit::DacBits(self.dac_bits)
        } else if self.dac_highest_mv <= self.dac_lowest_mv {
            BoardMisfit::DacHighest(self.dac_highest_mv)
        } else if self.boot_code > self.top() {
            BoardMisfit::BootCode(self.boot_code)
        } else if self.period_min_us == 0 || self.period_min_us > self.period_max_us {
            BoardMisfit::PeriodMin(self.period_min_us)
        } else if self.watchdog_max_us / 2 < self.period_min_us {
            BoardMisfit::WatchdogMax(self.watchdog_max_us)
        } else {
            return Ok(());
        })
    }

    /// True if the board can sample so often, µs.
    pub(crate) fn has_period(&self, period_us: u32) -> bool {
        (self.period_min_us..=self.period_max_us).contains(&period_us)
    }

    /// True if its watchdog can be set to so much, µs, with a period: two of them at least, a hundred at most.
    pub(crate) fn has_watchdog(&self, watchdog_us: u32, period_us: u32) -> bool {
        let longest = period_us.saturating_mul(WATCHDOG_PERIODS).min(self.watchdog_max_us);
        watchdog_us / 2 >= period_us && watchdog_us <= longest
    }

    /// The converter's highest code.
    const fn top(&self) -> u16 {
        let bits = if self.dac_bits < 16 { self.dac_bits } else { 16 };
        ((1_u32 << bits) - 1) as u16
    }
}

/// The reason why a board cannot be as its parameters say.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoardMisfit {
    /// [`BoardParams::dac_bits`] is outside 1…16.
    DacBits(u8),
    /// [`BoardParams::dac_highest_mv`] is not above the lowest voltage.
    DacHighest(i32),
    /// [`BoardParams::boot_code`] is above the converter's top.
    BootCode(u16),
    /// [`BoardParams::period_min_us`] is 0, or above the longest period.
    PeriodMin(u32),
    /// [`BoardParams::watchdog_max_us`] is below two of the shortest periods.
    WatchdogMax(u32),
}

impl core::fmt::Display for BoardMisfit {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            BoardMisfit::DacBits(n) => write!(f, "dac_bits = {n}: expected 1 to 16 bits"),
            BoardMisfit::DacHighest(n) => {
                write!(f, "dac_highest_mv = {n}: expected a voltage above the lowest, mV")
            }
            BoardMisfit::BootCode(n) => write!(f, "boot_code = {n}: expected a code that the converter has"),
            BoardMisfit::PeriodMin(n) => {
                write!(f, "period_min_us = {n}: expected a time above 0 µs and not above the longest period")
            }
            BoardMisfit::WatchdogMax(n) => {
                write!(f, "watchdog_max_us = {n}: expected at least two of the shortest periods, µs")
            }
        }
    }
}

impl core::error::Error for BoardMisfit {}

/// Samples that an Actuate may answer.
const RECENT: usize = 8;

/// The board's state machine. Times are the board's clock, µs; it wraps.
#[derive(Clone, Debug)]
pub struct BoardNode {
    params: BoardParams,
    state: BoardState,
    run: u16,
    config: u64,
    period_us: u32,
    watchdog_us: u32,
    safe: SafeCodes,
    safe_run: SafeRun,
    /// The safe output of the run that ended: it goes on while the next one is configured.
    ending: SafeCodes,
    code: DacCode,
    sequence: u16,
    /// Times of the last samples, by the low bits of their sequence; none before there was one.
    recent: [Option<u32>; RECENT],
    /// The time at which the last code was applied, or consent given.
    fed_us: u32,
    /// Sequence that the last applied code answered.
    answered: Option<u16>,
    late: bool,
    safe_under_way: bool,
    /// Sequence of the first sample after consent.
    armed_at: u16,
}

impl BoardNode {
    /// A board at power-up.
    ///
    /// # Errors
    /// Those of [`BoardParams::check`].
    pub fn new(p: &BoardParams) -> Result<Self, BoardMisfit> {
        p.check()?;
        Ok(BoardNode::of(p))
    }

    /// The same of parameters that were checked.
    #[inline]
    pub(crate) fn of(p: &BoardParams) -> Self {
        BoardNode {
            params: *p,
            state: BoardState::Boot,
            run: 0,
            config: 0,
            period_us: 0,
            watchdog_us: 0,
            safe: SafeCodes { hold: DacCode(p.boot_code), ..SafeCodes::default() },
            safe_run: SafeRun::default(),
            ending: SafeCodes::default(),
            code: DacCode(p.boot_code),
            sequence: 0,
            recent: [None; RECENT],
            fed_us: 0,
            answered: None,
            late: false,
            safe_under_way: false,
            armed_at: 0,
        }
    }

    /// The code that the converter is to give now.
    #[must_use]
    pub fn code(&self) -> DacCode {
        self.code
    }

    /// The board's state.
    #[must_use]
    pub fn state(&self) -> BoardState {
        self.state
    }

    /// The sampling period, µs; none before one was configured.
    #[must_use]
    pub fn period_us(&self) -> Option<u32> {
        (self.state != BoardState::Boot).then_some(self.period_us)
    }

    /// The latest time at which [`BoardNode::poll`] has to be called; none while nothing is watched.
    #[must_use]
    pub fn watchdog_at(&self) -> Option<u32> {
        self.driving().then(|| self.fed_us.wrapping_add(self.watchdog_us))
    }

    /// The time at which the last code was applied, or consent given.
    #[must_use]
    pub fn fed_us(&self) -> u32 {
        self.fed_us
    }

    /// The number of the newest sample, if it needs an answer that has not come.
    #[must_use]
    pub fn unanswered(&self) -> Option<u16> {
        let newest = self.sequence.wrapping_sub(1);
        let awaited = self.driving() && self.sequence != self.armed_at;
        (awaited && self.answered != Some(newest)).then_some(newest)
    }

    pub(crate) fn driving(&self) -> bool {
        matches!(self.state, BoardState::Armed | BoardState::Running)
    }

    /// Bytes from the controller, over a line whose frames `line` reads.
    pub fn receive(&mut self, now_us: u32, line: &mut Decoder, bytes: &[u8], out: &mut impl Sink) {
        // Also where no message is whole: a code that comes after the watchdog's time does not undo what that does.
        self.poll(now_us, out);
        for byte in bytes {
            // A frame that is not whole is dropped without a word.
            if let Some(Ok(message)) = line.push(*byte) {
                self.message(now_us, &message, out);
            }
        }
    }

    /// A message from the controller, by value.
    pub fn hear(&mut self, now_us: u32, message: &Message, out: &mut impl Sink) {
        self.poll(now_us, out);
        self.message(now_us, message, out);
    }

    /// A code from the controller, by value.
    pub fn obey(&mut self, now_us: u32, answer: &Actuate, out: &mut impl Sink) {
        self.poll(now_us, out);
        if answer.run == self.run && self.driving() {
            self.actuate(now_us, answer, out);
        }
    }

    /// A sampling period begins: the encoder's counts, and what the board sees of its hardware. Its messages go out.
    pub fn sample(
        &mut self,
        now_us: u32,
        counts: Counts,
        encoder_fault: bool,
        converter_fault: bool,
        out: &mut impl Sink,
    ) {
        let (fault, sample) = self.begin_period(now_us, counts, encoder_fault, converter_fault);
        if let Some(fault) = fault {
            out.push(&Message::Fault(fault));
        }
        if let Some(sample) = sample {
            out.push(&Message::Sample(sample));
        }
    }

    /// The same for who hears by value: first the fault, if there is one, then the sample.
    pub fn begin_period(
        &mut self,
        now_us: u32,
        counts: Counts,
        encoder_fault: bool,
        converter_fault: bool,
    ) -> (Option<Fault>, Option<Sample>) {
        if self.state == BoardState::Boot {
            return (None, None);
        }
        // The safe output goes on through Ready, until a new run takes over; the period in which it
        // begins has its first step already.
        let begun = self.safe_under_way;
        let mut fault = self.watch(now_us);
        if self.driving() && (encoder_fault || converter_fault) {
            let cause = if encoder_fault { BoardFault::Encoder } else { BoardFault::Converter };
            fault = Some(self.fault(now_us, cause, 0));
        } else if begun {
            self.code = self.safe_run.next(&self.ending);
        }
        let flag = |on: bool, bit: u8| if on { bit } else { 0 };
        let status = self.state as u8
            | flag(encoder_fault, STATUS_ENCODER_FAULT)
            | flag(converter_fault, STATUS_DAC_FAULT)
            | flag(self.late, STATUS_LATE);
        self.late = false;
        let sample =
            Sample { run: self.run, sequence: self.sequence, time_us: now_us, counts: counts.0, status };
        if let Some(slot) = self.recent.get_mut(usize::from(self.sequence) % RECENT) {
            *slot = Some(now_us);
        }
        self.sequence = self.sequence.wrapping_add(1);
        (fault, Some(sample))
    }

    /// Looks at the clock: the watchdog.
    pub fn poll(&mut self, now_us: u32, out: &mut impl Sink) {
        if let Some(fault) = self.watch(now_us) {
            out.push(&Message::Fault(fault));
        }
    }

    fn watch(&mut self, now_us: u32) -> Option<Fault> {
        let silent = now_us.wrapping_sub(self.fed_us);
        let bites = self.driving() && silent >= self.watchdog_us;
        bites.then(|| self.fault(now_us, BoardFault::Watchdog, silent))
    }

    // A function of its own in machine code: it ends control, and the bound of a period that goes on leaves it out.
    #[cold]
    #[inline(never)]
    fn fault(&mut self, now_us: u32, cause: BoardFault, value: u32) -> Fault {
        self.make_safe(BoardState::Faulted);
        let sequence = self.sequence.wrapping_sub(1);
        Fault { run: self.run, sequence, time_us: now_us, cause: cause as u8, value }
    }

    fn make_safe(&mut self, state: BoardState) {
        self.safe_run = SafeRun::begin(self.code);
        self.ending = self.safe;
        self.code = self.safe_run.next(&self.ending);
        self.safe_under_way = true;
        self.state = state;
    }

    fn message(&mut self, now_us: u32, message: &Message, out: &mut impl Sink) {
        match message {
            Message::Discover(m) => self.discover(m, out),
            Message::Configure(m) => self.configure(m, out),
            Message::Arm(m) => self.arm(now_us, m, out),
            Message::Actuate(m) if m.run == self.run && self.driving() => self.actuate(now_us, m, out),
            Message::Stop(m) => {
                if m.run != self.run || self.state == BoardState::Boot {
                    return;
                }
                if self.driving() {
                    let fault = m.reason == StopReason::Fault as u8;
                    self.make_safe(if fault { BoardState::Faulted } else { BoardState::Stopped });
                }
                let stopped = Stopped { run: self.run, reason: m.reason, code: self.code.0 };
                out.push(&Message::Stopped(stopped));
            }
            Message::Ping(m) => {
                out.push(&Message::Pong(Pong { run: m.run, nonce: m.nonce, time_us: now_us }));
            }
            // Another board's frames: an echo, or two boards on one line.
            _ => {}
        }
    }

    fn discover(&self, m: &Discover, out: &mut impl Sink) {
        if let Some(refused) = misunderstood(m) {
            out.push(&Message::Refused(refused));
            return;
        }
        let p = &self.params;
        out.push(&Message::Hello(Hello {
            nonce: m.nonce,
            version: VERSION,
            schema: SCHEMA,
            board: p.board,
            boot: p.boot,
            counts_per_rev: p.counts_per_rev,
            dac_bits: p.dac_bits,
            dac_lowest_mv: p.dac_lowest_mv,
            dac_highest_mv: p.dac_highest_mv,
            period_min_us: p.period_min_us,
            period_max_us: p.period_max_us,
            watchdog_max_us: p.watchdog_max_us,
            boot_code: p.boot_code,
            started_by: p.started_by as u8,
            warnings: if p.brown_out_low { WARNING_BROWN_OUT } else { 0 },
            state: self.state as u8,
            run: self.run,
            config: self.config,
        }));
    }

    fn configure(&mut self, m: &Configure, out: &mut impl Sink) {
        let p = &self.params;
        let safe_kind = clutch_wire::SafeKind::from_u8(m.safe_kind);
        let codes_fit = m.hold_code <= self.params.top() && m.release_code <= self.params.top();
        let never_arrives = safe_kind == Some(clutch_wire::SafeKind::Ramp) && m.ramp_step == 0;
        let again = self.state == BoardState::Ready && m.run == self.run && m.config == self.config;
        let spent = m.run == self.run && self.state != BoardState::Boot && !again;
        let refusal = if again {
            None // the answer was lost; what else the frame says changes nothing
        } else if self.driving() {
            Some((Refusal::State, self.state as u32))
        } else if spent {
            Some((Refusal::Run, u32::from(self.run)))
        } else if !p.has_period(m.period_us) {
            Some((Refusal::Period, m.period_us))
        } else if !p.has_watchdog(m.watchdog_us, m.period_us) {
            Some((Refusal::Watchdog, m.watchdog_us))
        } else if safe_kind.is_none() || !codes_fit || never_arrives {
            Some((Refusal::Safe, u32::from(m.safe_kind)))
        } else {
            None
        };
        if let Some((reason, value)) = refusal {
            let request = Configure::KIND;
            out.push(&Message::Refused(Refused { request, reason: reason as u8, value }));
            return;
        }
        if !again {
            self.run = m.run;
            self.config = m.config;
            self.period_us = m.period_us;
            self.watchdog_us = m.watchdog_us;
            self.safe = SafeCodes {
                kind: match safe_kind {
                    Some(clutch_wire::SafeKind::Ramp) => SafeKind::Ramp,
                    Some(clutch_wire::SafeKind::Release) => SafeKind::Release,
                    Some(clutch_wire::SafeKind::HoldThenRelease) => SafeKind::HoldThenRelease,
                    Some(clutch_wire::SafeKind::Hold) | None => SafeKind::Hold,
                },
                hold: DacCode(m.hold_code),
                release: DacCode(m.release_code),
                ramp_step: m.ramp_step,
                hold_periods: m.hold_periods,
            };
            self.state = BoardState::Ready;
            self.sequence = 0;
            self.recent = [None; RECENT];
            self.answered = None;
            self.late = false;
        }
        let boot = self.params.boot;
        out.push(&Message::Configured(Configured { run: self.run, config: self.config, boot }));
    }

    fn arm(&mut self, now_us: u32, m: &Arm, out: &mut impl Sink) {
        let again = self.state == BoardState::Armed;
        let refusal = if self.state != BoardState::Ready && !again {
            Some((Refusal::State, self.state as u32))
        } else if m.run != self.run {
            Some((Refusal::Run, u32::from(self.run)))
        } else if m.config != self.config {
            Some((Refusal::Config, self.config as u32))
        } else if m.boot != self.params.boot {
            // Without the number: whoever has not heard it is not told.
            Some((Refusal::Boot, 0))
        } else {
            None
        };
        if let Some((reason, value)) = refusal {
            let request = Arm::KIND;
            out.push(&Message::Refused(Refused { request, reason: reason as u8, value }));
            return;
        }
        if !again {
            self.state = BoardState::Armed;
            self.safe_under_way = false;
            self.fed_us = now_us;
            self.armed_at = self.sequence;
        }
        out.push(&Message::Armed(Armed { run: self.run, config: self.config }));
    }

    fn actuate(&mut self, now_us: u32, m: &Actuate, out: &mut impl Sink) {
        if m.code > self.params.top() {
            let refused =
                Refused { request: Actuate::KIND, reason: Refusal::Code as u8, value: u32::from(m.code) };
            out.push(&Message::Refused(refused));
            return;
        }
        // A code that answers what a later one has answered already changes nothing.
        if self.answered.is_some_and(|last| (m.sequence.wrapping_sub(last) as i16) <= 0) {
            return;
        }
        let behind = self.sequence.wrapping_sub(1).wrapping_sub(m.sequence);
        let taken = self.recent.get(usize::from(m.sequence) % RECENT).copied().flatten();
        let taken = taken.filter(|_| usize::from(behind) < RECENT);
        match taken {
            Some(time) if now_us.wrapping_sub(time) <= u32::from(m.valid_us) => {
                self.answered = Some(m.sequence);
                self.code = DacCode(m.code);
                self.fed_us = now_us;
                self.state = BoardState::Running;
            }
            _ => self.late = true,
        }
    }
}

/// The refusal of a host that speaks another version or has another table; none for one that does not.
pub(crate) fn misunderstood(m: &Discover) -> Option<Refused> {
    let (reason, value) = if m.version != VERSION {
        (Refusal::Version, u32::from(VERSION))
    } else if m.schema != SCHEMA {
        (Refusal::Schema, SCHEMA as u32)
    } else {
        return None;
    };
    Some(Refused { request: Discover::KIND, reason: reason as u8, value })
}
