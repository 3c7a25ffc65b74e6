//! A controller without a host: its run is compiled in, and a button gives consent.
//!
//! ```text
//!  encoder ──┐                                 ┌─► converter
//!            ├─► Alone: supervisor ─► servo ───┼─► watchdog
//!  button ───┘                                 └─► lamp
//! ```
//!
//! | state | button | lamp |
//! |---|---|---|
//! | Ready | a press is consent: the run begins with the next sample | a flash each 2.2 s |
//! | Armed, Running | a press ends control, with the first sample that sees it | on |
//! | Holding, Released | a press of 1 s acknowledges: Ready | a flash each 0.8 s |
//! | Faulted | the same | as many flashes as the number of the [`Cause`], then a pause |
//!
//! A press gives consent once it has lasted 20 ms, in a state that has lasted 1 s, and once the button has been let go for
//! 20 ms before: neither a contact that bounces nor a button that is stuck, or held at power-up, begins a run, and presses
//! in a hurry end one and begin none. A press that gave consent and does not end within 2 s ends the run.
//!
//! Before the first consent the output is the boot code, whatever is wrong. After a run its safe state goes on by itself,
//! acknowledged or not, until the next consent. A program that begins anew after a fault begins as Faulted.

use crate::board::{BoardMisfit, BoardParams};
use crate::board_program::Hardware;
use clutch_core::law::{ControlLaw, Listed};
use clutch_core::reference::OneKind;
use clutch_core::supervisor::{BoardMode, Cause, Sample, State};
use clutch_core::{
    BeginningAt, Bounds, Counts, DacCode, FixedCounts, Micros, ParamError, Planned, Real, SafeRun, Servo,
    ServoParams, Supervisor, SupervisorParams, SupervisorState,
};
use clutch_wire::{BoardFault, ResetCause};

/// Time for which the button has to be let go before a press counts: before consent, and before the end of a run, µs.
const LET_GO_US: u32 = 20_000;
const LET_GO_TO_STOP_US: u32 = 5_000;

/// Length of a press that is consent, µs.
const PRESS_US: u32 = 20_000;

/// Length of a press that acknowledges, and of a state before consent, µs.
const LONG_US: u32 = 1_000_000;

/// Length of a press that ends the run to which it was the consent, µs.
const STUCK_US: u32 = 2_000_000;

/// Length of a flash, and of the dark before it, µs.
const FLASH_US: u32 = 200_000;

/// A run with its law and its kind of path, whose types keep all others out of the image: as `clutch scenario rust` prints
/// it.
#[allow(missing_debug_implementations, reason = "the law's parameters need not have one")]
pub struct AloneRun<L: Listed<f32>, P> {
    /// The servo; its law is the next field.
    pub servo: ServoParams<f32>,
    /// The law's parameters.
    pub law: L::Params,
    /// The supervisor.
    pub supervisor: SupervisorParams<f32>,
    /// Bounds on the plant.
    pub bounds: Bounds<f32>,
    /// The path.
    pub path: P,
    /// Place within a count at which the path begins.
    pub start: FixedCounts,
    /// Ticks of the run.
    pub ticks: u64,
    /// Time under control without an answer of the law after which control ends.
    pub watchdog: Micros,
}

/// A run that a board cannot take.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AloneMisfit {
    /// The board's own parameters.
    Board(BoardMisfit),
    /// The board's encoder has so many counts per revolution.
    Encoder(u32),
    /// The board's converter has other bits, or another range.
    Converter,
    /// The board does not have this period.
    Period(Micros),
    /// The watchdog's time is below two periods, above a hundred of them, or above the board's longest.
    Watchdog(Micros),
    /// A parameter of the run.
    Run(ParamError<f32>),
}

/// Compares a run with the board's own numbers.
fn fits(servo: &ServoParams<f32>, watchdog: Micros, board: &BoardParams) -> Result<(), AloneMisfit> {
    board.check().map_err(AloneMisfit::Board)?;
    // To the nearest mV, as a host compares them.
    let same = |volts: f32, mv: i32| (volts * 1000.0 - f32::from_i32(mv)).abs() < 0.5;
    let (dac, period) = (&servo.dac, servo.period);
    if servo.encoder.counts_per_rev() != board.counts_per_rev {
        Err(AloneMisfit::Encoder(board.counts_per_rev))
    } else if dac.bits != board.dac_bits
        || !same(dac.lowest, board.dac_lowest_mv)
        || !same(dac.highest, board.dac_highest_mv)
    {
        Err(AloneMisfit::Converter)
    } else if !board.has_period(period.0) {
        Err(AloneMisfit::Period(period))
    } else if !board.has_watchdog(watchdog.0, period.0) {
        Err(AloneMisfit::Watchdog(watchdog))
    } else {
        Ok(())
    }
}

/// The controller. Its period is the servo's.
#[allow(missing_debug_implementations, reason = "the law's state need not have one")]
pub struct Alone<L: Listed<f32>, P: OneKind<f32>> {
    servo: Servo<f32, L>,
    supervisor: Supervisor<f32>,
    /// From the position at tick 0 on, whole counts of it left out.
    path: P::Path,
    start: FixedCounts,
    ticks: u64,
    watchdog: Micros,
    state: SupervisorState<f32, <L as ControlLaw<f32>>::State>,
    /// The position at which the path begins.
    origin: FixedCounts,
    /// The converter's code.
    code: DacCode,
    /// The safe state since the last run; none before the first.
    safe: Option<SafeRun>,
    sequence: u16,
    /// Time of the last answer, or of consent, µs.
    answered_us: u32,
    lateness: Micros,
    button: Button,
    /// Time in this state, µs, as far as an hour.
    age_us: u32,
    /// Time since the lamp's pattern began, µs.
    lit_us: u32,
}

/// A button, and how long its contact has been closed or open, µs.
#[derive(Clone, Copy, Debug)]
struct Button {
    down_us: u32,
    up_us: u32,
    /// This press has had its effect, until the button is let go.
    used: bool,
}

impl Button {
    /// Its contact in a period; let go for `let_go_us` it can be pressed anew.
    fn sees(&mut self, pressed: bool, period_us: u32, let_go_us: u32) {
        let [longer, none] =
            if pressed { [&mut self.down_us, &mut self.up_us] } else { [&mut self.up_us, &mut self.down_us] };
        *longer = longer.saturating_add(period_us);
        *none = 0;
        self.used &= self.up_us < let_go_us;
    }

    /// True if it is pressed anew, for so long.
    fn pressed_for(&self, least_us: u32) -> bool {
        !self.used && self.down_us >= least_us
    }
}

impl<L: Listed<f32>, P: OneKind<f32>> Alone<L, P> {
    /// A controller at power-up of a board.
    ///
    /// # Errors
    /// A run of another board; a parameter out of range.
    pub fn new(run: &AloneRun<L, P>, board: &BoardParams) -> Result<Self, AloneMisfit> {
        fits(&run.servo, run.watchdog, board)?;
        Alone::build(run, board).map_err(AloneMisfit::Run)
    }

    fn build(run: &AloneRun<L, P>, board: &BoardParams) -> Result<Self, ParamError<f32>> {
        let p = &run.servo;
        p.output.check_for(p.model.actuator.kind())?;
        let servo = Servo::with_law(p, L::build(&run.law, &p.beside())?)?;
        p.check_output()?;
        let supervisor = Supervisor::new(&run.supervisor, p, &run.bounds)?;
        let path = run.path.path(p.encoder, p.period)?;
        // A run goes on from the count at which it finds the shaft.
        let whole = path.target(0).position.plus(run.start).0 >> FixedCounts::FRACTION_BITS;
        let start = FixedCounts(run.start.0.wrapping_sub(FixedCounts::from_counts(whole).0));
        let mut state = SupervisorState::default();
        supervisor.connect(&mut state);
        if matches!(board.started_by, ResetCause::Watchdog | ResetCause::Fault | ResetCause::Clock) {
            supervisor.board_fault(&mut state, 0.0);
        }
        Ok(Alone {
            servo,
            supervisor,
            path,
            start,
            ticks: run.ticks,
            watchdog: run.watchdog,
            state,
            origin: FixedCounts::default(),
            code: DacCode(board.boot_code),
            safe: None,
            sequence: 0,
            answered_us: 0,
            lateness: Micros(0),
            // It may be held: it has to be let go first.
            button: Button { down_us: 0, up_us: 0, used: true },
            age_us: 0,
            lit_us: 0,
        })
    }

    /// The supervisor's state.
    #[must_use]
    pub fn state(&self) -> &SupervisorState<f32, L::State> {
        &self.state
    }

    /// The position at which the path begins.
    #[must_use]
    pub fn origin(&self) -> FixedCounts {
        self.origin
    }

    /// The sampling period, µs.
    #[must_use]
    pub fn period_us(&self) -> u32 {
        self.servo.period().0
    }

    /// One sampling period: sample, code, watchdog; then what the next one needs. `pressed`: the button's contact.
    // A function of its own in machine code, too: its longest path is the bound of a period.
    #[inline(never)]
    pub fn tick(&mut self, hardware: &mut impl Hardware, pressed: bool) {
        let now_us = hardware.now_us();
        let counts = hardware.counts();
        let faults = (hardware.encoder_fault(), hardware.converter_fault());
        let (before, drove) = (self.state.state(), self.driving());
        self.listen(now_us as u32, pressed);
        let driven = drove || self.driving();
        self.sample(now_us as u32, counts, faults);
        self.code = if self.driving() { self.state.code() } else { self.safe_code(driven) };
        hardware.put_out(self.code);
        self.lateness = Micros(hardware.now_us().wrapping_sub(now_us) as u32);
        hardware.feed_watchdog();
        let planned = BeginningAt { planned: &self.path, origin: self.origin };
        self.supervisor.expect(&mut self.state, &planned);
        self.pass(before);
    }

    fn driving(&self) -> bool {
        matches!(self.state.state(), State::Armed | State::Running)
    }

    /// The button: consent, its end, or an acknowledgement.
    fn listen(&mut self, now_us: u32, pressed: bool) {
        let driving = self.driving();
        let let_go_us = if driving { LET_GO_TO_STOP_US } else { LET_GO_US };
        self.button.sees(pressed, self.period_us(), let_go_us);
        let had = match self.state.state() {
            State::Ready => self.age_us >= LONG_US && self.button.pressed_for(PRESS_US),
            State::Armed | State::Running => self.button.pressed_for(1) || self.button.down_us >= STUCK_US,
            _ => self.button.pressed_for(LONG_US),
        };
        if had {
            self.button.used = true;
            if driving {
                self.end(Cause::Operator);
            } else {
                self.agree(now_us);
            }
        }
    }

    /// Consent to a run, or to leave the end of one.
    // A function of its own in machine code: a run that goes on has none.
    #[cold]
    #[inline(never)]
    fn agree(&mut self, now_us: u32) {
        if self.state.state() == State::Ready {
            self.supervisor.arm(&mut self.state, self.code);
            self.answered_us = now_us;
        } else {
            self.supervisor.acknowledge(&mut self.state);
        }
    }

    /// The end of control, as wanted.
    // A function of its own in machine code: a run that goes on has none.
    #[cold]
    #[inline(never)]
    fn end(&mut self, cause: Cause) {
        self.supervisor.stop(&mut self.state, cause);
    }

    /// The law has given no code for too long.
    // A function of its own in machine code: a run that goes on has none.
    #[cold]
    #[inline(never)]
    fn silent(&mut self) {
        self.supervisor.board_fault(&mut self.state, f32::from(BoardFault::Watchdog as u8));
    }

    /// The sample: judged, and answered.
    fn sample(&mut self, now_us: u32, counts: Counts, (encoder_fault, converter_fault): (bool, bool)) {
        if self.driving() && now_us.wrapping_sub(self.answered_us) >= self.watchdog.0 {
            self.silent();
        }
        let board = match self.state.state() {
            State::Ready => BoardMode::Ready,
            State::Armed | State::Running => BoardMode::Driving,
            _ => BoardMode::Safe,
        };
        if self.state.state() == State::Armed {
            self.origin = FixedCounts::from_counts(i64::from(counts.0)).plus(self.start);
        }
        let sample = Sample {
            sequence: self.sequence,
            time: Micros(now_us),
            counts,
            board,
            encoder_fault,
            converter_fault,
            // There is no line on which it could be.
            command_late: false,
            superseded: false,
            lateness: core::mem::take(&mut self.lateness),
        };
        self.sequence = self.sequence.wrapping_add(1);
        let planned = BeginningAt { planned: &self.path, origin: self.origin };
        let cycle = self.supervisor.sample(&self.servo, &mut self.state, &sample, planned);
        if cycle.answer.is_some() {
            self.answered_us = now_us;
        }
        if cycle.state == State::Running && self.state.tick().saturating_add(1) >= self.ticks {
            self.end(Cause::Done);
        }
    }

    /// The code without control: the safe state's, which begins when control ends; before there was any, what is there.
    // A function of its own in machine code: a run that goes on has none.
    #[cold]
    #[inline(never)]
    fn safe_code(&mut self, driven: bool) -> DacCode {
        if driven {
            self.safe = Some(SafeRun::begin(self.code));
        }
        match &mut self.safe {
            Some(run) => run.next(self.supervisor.safe_codes()),
            None => self.code,
        }
    }

    /// A period of the lamp, and of the state; `before` is the state in which it began.
    fn pass(&mut self, before: State) {
        let period_us = self.period_us();
        if self.state.state() != before {
            (self.age_us, self.lit_us) = (0, 0);
            return;
        }
        self.age_us = self.age_us.saturating_add(period_us);
        self.lit_us = self.lit_us.saturating_add(period_us);
        let (flashes, pause) = self.flashes();
        if self.lit_us >= FLASH_US.saturating_mul(2 * flashes + pause) {
            self.lit_us = 0;
        }
    }

    /// The lamp's flashes, and the time that it is dark behind them, in lengths of a flash.
    fn flashes(&self) -> (u32, u32) {
        match self.state.state() {
            State::Faulted => (self.state.cause() as u32, 2),
            State::Holding | State::Released => (1, 2),
            _ => (1, 9),
        }
    }

    /// True while the lamp is to be lit.
    #[must_use]
    pub fn lamp(&self) -> bool {
        let at = self.lit_us / FLASH_US;
        self.driving() || (at < 2 * self.flashes().0 && at & 1 == 1)
    }
}
