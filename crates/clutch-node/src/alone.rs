//! A controller without a host: its run is compiled in, and a button gives consent.
//!
//! ```text
//!  encoder ──┐                                 ┌─► converter
//!            ├─► Alone: supervisor ─► servo ───┼─► watchdog
//!  button ───┘                                 └─► lamp
//! ```
//!
//! | state | a press of the button | lamp |
//! |---|---|---|
//! | Ready | consent: the run begins with the next sample | off |
//! | Armed, Running | the end of control, at once | on |
//! | Holding, Released | acknowledged: Ready | a flash each second |
//! | Faulted | acknowledged: Ready | as many flashes as the number of the [`Cause`], then a pause |
//!
//! A press gives consent once it has lasted 20 ms, and once the button has been let go for as long before: neither a
//! contact that bounces nor a button that is stuck, or held at power-up, begins a run. The next press ends it with the
//! first sample that sees it.

use crate::board::BoardParams;
use crate::board_program::Hardware;
use clutch_core::law::{ControlLaw, Listed};
use clutch_core::reference::OneKind;
use clutch_core::supervisor::{BoardMode, Cause, Sample, State};
use clutch_core::{
    BeginningAt, Bounds, DacCode, FixedCounts, Micros, ParamError, Planned, Real, Servo, ServoParams,
    Supervisor, SupervisorParams, SupervisorState,
};
use clutch_wire::BoardFault;

/// Time for which a contact has to stay as it is, µs.
const STEADY_US: u32 = 20_000;

/// Length of a flash, and of the dark before the next, µs.
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AloneMisfit {
    /// The board's encoder has so many counts per revolution.
    Encoder(u32),
    /// The board's converter has other bits, or another range.
    Converter,
    /// The board does not have this period.
    Period(Micros),
    /// A parameter of the run.
    Run(ParamError<f32>),
}

/// Compares a run with the board's own numbers.
fn fits(run: &ServoParams<f32>, board: &BoardParams) -> Result<(), AloneMisfit> {
    // A voltage of whole mV, as both have it.
    let volts = |mv: i32| f32::from_i32(mv) / 1000.0;
    let converter = (board.dac_bits, volts(board.dac_lowest_mv), volts(board.dac_highest_mv));
    if run.encoder.counts_per_rev() != board.counts_per_rev {
        Err(AloneMisfit::Encoder(board.counts_per_rev))
    } else if (run.dac.bits, run.dac.lowest, run.dac.highest) != converter {
        Err(AloneMisfit::Converter)
    } else if !(board.period_min_us..=board.period_max_us).contains(&run.period.0) {
        Err(AloneMisfit::Period(run.period))
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
    sequence: u16,
    /// Time of the last answer, or of consent, µs.
    answered_us: u32,
    lateness: Micros,
    button: Button,
    /// Time since the state's lamp began, µs.
    lit_us: u32,
}

/// A button whose contact bounces.
#[derive(Clone, Copy, Debug)]
struct Button {
    pressed: bool,
    /// Time for which the contact has been otherwise, µs.
    otherwise_us: u32,
}

impl Button {
    /// Its contact in a period; true if this is a press.
    fn presses(&mut self, pressed: bool, period_us: u32) -> bool {
        self.otherwise_us =
            if pressed == self.pressed { 0 } else { self.otherwise_us.saturating_add(period_us) };
        if self.otherwise_us < STEADY_US {
            return false;
        }
        *self = Button { pressed, otherwise_us: 0 };
        pressed
    }
}

impl<L: Listed<f32>, P: OneKind<f32>> Alone<L, P> {
    /// A controller at power-up of a board, whose converter has the boot code until the first consent.
    ///
    /// # Errors
    /// A run of another board; a parameter out of range.
    pub fn new(run: &AloneRun<L, P>, board: &BoardParams) -> Result<Self, AloneMisfit> {
        fits(&run.servo, board)?;
        Alone::build(run, DacCode(board.boot_code)).map_err(AloneMisfit::Run)
    }

    fn build(run: &AloneRun<L, P>, boot_code: DacCode) -> Result<Self, ParamError<f32>> {
        let p = &run.servo;
        p.output.check_for(p.model.actuator.kind())?;
        let servo = Servo::with_law(p, L::build(&run.law, &p.beside())?)?;
        p.check_output()?;
        let supervisor = Supervisor::new(&run.supervisor, p, &run.bounds)?;
        let path = run.path.path(p.encoder, p.period)?;
        // A run goes on from the count at which it finds the shaft.
        let whole = path.target(0).position.plus(run.start).0 >> FixedCounts::FRACTION_BITS;
        let start = FixedCounts(run.start.0.wrapping_sub(FixedCounts::from_counts(whole).0));
        let mut state = SupervisorState::at_code(boot_code);
        supervisor.connect(&mut state);
        Ok(Alone {
            servo,
            supervisor,
            path,
            start,
            ticks: run.ticks,
            watchdog: run.watchdog,
            state,
            origin: FixedCounts::default(),
            sequence: 0,
            answered_us: 0,
            lateness: Micros(0),
            // It may be held: it has to be let go first.
            button: Button { pressed: true, otherwise_us: 0 },
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
        let sample = Sample {
            sequence: self.sequence,
            time: Micros(now_us as u32),
            counts: hardware.counts(),
            board: BoardMode::Safe,
            encoder_fault: hardware.encoder_fault(),
            converter_fault: hardware.converter_fault(),
            command_late: false,
            superseded: false,
            lateness: core::mem::take(&mut self.lateness),
        };
        let before = self.state.state();
        self.listen(now_us as u32, pressed);
        self.sample(now_us as u32, sample);
        hardware.put_out(self.state.code());
        self.lateness = Micros(hardware.now_us().wrapping_sub(now_us) as u32);
        hardware.feed_watchdog();
        let planned = BeginningAt { planned: &self.path, origin: self.origin };
        self.supervisor.expect(&mut self.state, &planned);
        let same = self.state.state() == before;
        self.lit_us = if same { self.lit_us.wrapping_add(self.period_us()) } else { 0 };
    }

    /// The button: consent, its end, or an acknowledgement.
    fn listen(&mut self, now_us: u32, pressed: bool) {
        // The press that gave consent may go on.
        let anew = pressed && !self.button.pressed;
        let press = self.button.presses(pressed, self.period_us());
        match self.state.state() {
            State::Armed | State::Running if anew => self.end(Cause::Operator),
            State::Ready | State::Holding | State::Released | State::Faulted if press => self.agree(now_us),
            _ => {}
        }
    }

    /// Consent to a run, or to leave the end of one.
    // A function of its own in machine code: a run that goes on has none.
    #[cold]
    #[inline(never)]
    fn agree(&mut self, now_us: u32) {
        if self.state.state() == State::Ready {
            let present = self.state.code();
            self.supervisor.arm(&mut self.state, present);
            self.answered_us = now_us;
        } else {
            self.supervisor.acknowledge(&mut self.state);
        }
    }

    /// The end of control, as wanted.
    // As above.
    #[cold]
    #[inline(never)]
    fn end(&mut self, cause: Cause) {
        self.supervisor.stop(&mut self.state, cause);
        // A press that ends a run is used up: it acknowledges nothing.
        self.button = Button { pressed: true, otherwise_us: 0 };
    }

    /// The law has given no code for too long.
    // As above.
    #[cold]
    #[inline(never)]
    fn silent(&mut self) {
        self.supervisor.board_fault(&mut self.state, f32::from(BoardFault::Watchdog as u8));
    }

    /// The sample: judged, and answered.
    fn sample(&mut self, now_us: u32, sample: Sample) {
        let driving = matches!(self.state.state(), State::Armed | State::Running);
        let silent_us = now_us.wrapping_sub(self.answered_us);
        if driving && silent_us >= self.watchdog.0 {
            self.silent();
        }
        if self.state.state() == State::Armed {
            self.origin = FixedCounts::from_counts(i64::from(sample.counts.0)).plus(self.start);
        }
        let board = match self.state.state() {
            State::Ready => BoardMode::Ready,
            State::Armed | State::Running => BoardMode::Driving,
            _ => BoardMode::Safe,
        };
        let sample = Sample { board, ..sample };
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

    /// True while the lamp is to be lit.
    #[must_use]
    pub fn lamp(&self) -> bool {
        let flashes = match self.state.state() {
            State::Armed | State::Running => return true,
            State::Ready | State::Disconnected => return false,
            State::Holding | State::Released => 1,
            State::Faulted => self.state.cause() as u32,
        };
        // Dark before each, and for three times as long behind the last.
        let dark = flashes.saturating_mul(2);
        let at = (self.lit_us / FLASH_US).checked_rem(dark.saturating_add(2)).unwrap_or(0);
        at < dark && at & 1 == 1
    }
}
