//! A board's own image on a register model of its chip, with the simulated rig behind the chip's timer and converter.
//!
//! | file | is |
//! |---|---|
//! | `cortex_m.py` | exceptions and time around the core of the Unicorn engine; its head has the protocol |
//! | `stm32g474.py`, `rp2040.py` | a chip each: its registers |
//! | `kind` | the chips |
//! | `process` | the process that carries it |
//! | `faults` | faults of the chip |
//! | `session` | a session with it |
//! | `alone` | a session with an image that has no host |

mod alone;
mod faults;
mod kind;
mod process;
mod session;

pub use alone::{AloneReport, AloneSession};
pub use faults::{ChipFault, ChipFaultError, ChipFaultKind};
pub use kind::ChipKind;
pub use process::{ChipError, Counted, MODULE, no_engine};
pub use session::{ChipOptions, ChipReport, ChipRole, ChipSession};

use crate::from_scenario;
use crate::sim_board::SimBoardError;
use crate::virtual_time::{VirtualBoard, VirtualError};
use clutch_core::{Dac, DacCode, FixedCounts, SafeCodes};
use clutch_node::Outbox;
use clutch_sim::engine::Event;
use clutch_sim::rig::Rig;
use clutch_sim::{MovingRig, Scenario};
use clutch_wire::{BoardState, Decoder, Message, STATUS_STATE};
use process::{Answer, Chip, Flags};
use std::path::Path;

/// A board at power-up on the scenario's rig: its image runs on a model of the chip.
pub struct ChipBoard {
    chip: Chip,
    scenario: Scenario,
    rig: MovingRig,
    dac: Dac<f64>,
    /// Voltage at the brake while the wiring alone decides, V: that of divider or switch, which holds.
    pull: f64,
    amplifier_dead: bool,
    faults: Vec<ChipFault>,
    decoder: Decoder,
    state: BoardState,
    last: Answer,
    /// Voltage in the period that the last sample ended, V.
    volts_before: f64,
    /// Time up to which the rig has moved, ns; none before the board is configured.
    moved_ns: Option<u64>,
    /// Time of the first sample, ns.
    started_ns: Option<u64>,
    samples: u64,
    armed_ns: Option<u64>,
    first_hit_ns: Option<u64>,
    resets: u32,
    events: Vec<Event>,
    /// The board's button is pressed; none, if a host gives consent.
    button: Option<bool>,
}

/// A chip at the end of a session.
#[derive(Clone, Debug, serde::Serialize)]
pub struct ChipEnd {
    /// Resets since power-up.
    pub resets: u32,
    /// True if its core spins, has no clock or has locked up.
    pub dead: bool,
    /// True if the wiring alone decides the output.
    pub floating: bool,
    /// The code that its converter has.
    pub code: u16,
    /// Numbers of instructions, if they were asked for.
    pub counted: Option<Counted>,
}

/// A bit beside those of the faults: the board's button is pressed, `Fault.PRESSED` in the model.
const PRESSED: u32 = 1 << 30;

/// A bit beside those of the faults: instructions of this request are counted, `Fault.METERED` in the model.
const METERED: u32 = 1 << 31;

/// Events that wait to be asked for.
const MAX_EVENTS: usize = 1 << 12;

impl ChipBoard {
    /// Powers up a board with an image.
    ///
    /// # Errors
    /// No Python, no module, no image; the scenario has no safe state, or its rig cannot be simulated.
    pub fn start(
        image: &Path,
        scenario: &Scenario,
        faults: &[ChipFault],
        count: Option<&Path>,
    ) -> Result<ChipBoard, VirtualError> {
        let spec = scenario.spec();
        let safety = scenario.safety().map_err(SimBoardError::from)?;
        let rig = Rig::new(&spec.rig, spec.run.seed).map_err(SimBoardError::from)?;
        let engine = spec.engine(&rig).map_err(SimBoardError::from)?;
        let dac = Dac::new(&spec.rig.dac.converter).map_err(SimBoardError::from)?;
        let codes = SafeCodes::new(&safety.on_fault, &dac, spec.period, spec.model.actuator.kind())
            .map_err(SimBoardError::from)?;
        let pull = dac.volts(codes.hold);
        let start = spec.run.start_position().minus::<f64>(FixedCounts(0));
        let start = start * rig.encoder.radians_per_count::<f64>();
        let rig = MovingRig::new(rig, engine, spec.run.seed, (start, 0.0), pull);
        let mut board = ChipBoard {
            chip: Chip::start(image, faults, count)?,
            scenario: scenario.clone(),
            rig,
            dac,
            pull,
            amplifier_dead: false,
            faults: faults.to_vec(),
            decoder: Decoder::new(),
            state: BoardState::Boot,
            last: Answer::default(),
            volts_before: pull,
            moved_ns: None,
            started_ns: None,
            samples: 0,
            armed_ns: None,
            first_hit_ns: None,
            resets: 0,
            events: Vec::new(),
            button: None,
        };
        board.exchange(0, &[], &mut Outbox::default())?;
        board.volts_before = board.volts_now();
        Ok(board)
    }

    /// Begins a fault with the next exchange.
    pub fn inject(&mut self, kind: ChipFaultKind) {
        self.faults.push(ChipFault { kind, at: None });
    }

    /// Presses the board's button, or lets it go, from the next exchange on: consent is the button's, and the lamp tells
    /// whether the board drives.
    pub fn press(&mut self, pressed: bool) {
        self.button = Some(pressed);
    }

    /// True if the board's lamp is lit.
    #[must_use]
    pub fn lamp(&self) -> bool {
        self.last.flags.has(Flags::LAMP)
    }

    /// Ends all faults with the next exchange.
    pub fn mend(&mut self) {
        self.faults.clear();
    }

    /// Resets since power-up.
    #[must_use]
    pub fn resets(&self) -> u32 {
        self.resets
    }

    /// True if the converter is off, and its pin floats; or the switch behind it is not set.
    #[must_use]
    pub fn floating(&self) -> bool {
        self.last.flags.has(Flags::FLOATING)
    }

    /// True if the core spins, has no clock, or has locked up: nothing but a watchdog's reset will run its program again.
    #[must_use]
    pub fn dead(&self) -> bool {
        let dead = [Flags::SPINNING, Flags::LOCKUP, Flags::STOPPED];
        dead.into_iter().any(|flag| self.last.flags.has(flag))
    }

    /// True if the core is in the handler of a fault or of a non-maskable interrupt.
    #[must_use]
    pub fn in_fault(&self) -> bool {
        self.last.flags.has(Flags::IN_FAULT)
    }

    /// True if it is there because of memory that nobody may access, the guard below the stack.
    #[must_use]
    pub fn guarded(&self) -> bool {
        self.last.flags.has(Flags::GUARDED)
    }

    /// Voltage at the brake now, V.
    #[must_use]
    pub fn volts_now(&self) -> f64 {
        if self.amplifier_dead {
            0.0
        } else if self.floating() {
            self.pull
        } else {
            self.dac.volts(DacCode(self.last.code))
        }
    }

    /// Ends the chip: how it was then.
    ///
    /// # Errors
    /// The numbers of instructions cannot be read.
    pub fn end(self) -> Result<ChipEnd, ChipError> {
        let (resets, dead, floating) = (self.resets(), self.dead(), self.floating());
        Ok(ChipEnd { resets, dead, floating, code: self.last.code, counted: self.chip.end()? })
    }

    /// The faults that are in force, as the chip takes them.
    fn active(&mut self, now_ns: u64) -> u32 {
        let armed = self.armed_for(now_ns);
        let active = self.faults.iter().filter(|fault| fault.active(armed));
        let bits = active.fold(0, |bits, fault| bits | fault.kind.bit());
        self.amplifier_dead = bits & ChipFaultKind::Amplifier.bit() != 0;
        if bits != 0 && armed.is_some() {
            self.first_hit_ns.get_or_insert(now_ns);
        }
        // The chip's work under control is counted, and nothing else.
        let metered = if self.state == BoardState::Running { METERED } else { 0 };
        bits | metered | if self.button == Some(true) { PRESSED } else { 0 }
    }

    /// The rig where it will be at a time, and what happens until then. It moves when the chip looks at it or acts on it,
    /// not when the chip's clock wakes up in between: a motion in two pieces has other bits than in one.
    fn ahead(&self, now_ns: u64) -> Result<(MovingRig, Vec<Event>), VirtualError> {
        let mut rig = self.rig.clone();
        let since = self.moved_ns.unwrap_or(now_ns);
        let mut events = Vec::new();
        if now_ns > since {
            let moved = rig.advance((now_ns - since) as f64 / 1e9).map_err(SimBoardError::from)?;
            events.extend_from_slice(moved);
        }
        Ok((rig, events))
    }

    /// The chip goes on to a time, and bytes come to it.
    fn exchange(&mut self, now_ns: u64, bytes: &[u8], out: &mut Outbox) -> Result<(), VirtualError> {
        let (ahead, events) = self.ahead(now_ns)?;
        let before = self.volts_now();
        let faults = self.active(now_ns);
        self.last = self.chip.exchange(now_ns, ahead.counts().0, faults, bytes)?;
        if self.button == Some(true) && self.lamp() && self.armed_ns.is_none() {
            // This sample is the run's first.
            (self.armed_ns, self.moved_ns) = (Some(now_ns), Some(now_ns));
            self.state = BoardState::Running;
        }
        if self.button.is_some() && !self.lamp() && self.state == BoardState::Running {
            self.state = BoardState::Stopped;
        }
        let sampling = self.started_ns.is_some() || self.moved_ns.is_some();
        let sampled = self.last.flags.has(Flags::SAMPLED) && sampling;
        if self.last.resets != self.resets {
            self.resets = self.last.resets;
            self.state = BoardState::Boot;
        }
        if sampled || self.volts_now().to_bits() != before.to_bits() {
            self.rig = ahead;
            if let Some(moved) = &mut self.moved_ns {
                *moved = now_ns;
            }
            // Nobody may ask for them: what waits is bounded.
            if self.events.len() < MAX_EVENTS {
                self.events.extend(events);
            }
        }
        if sampled {
            let started = *self.started_ns.get_or_insert(now_ns);
            self.rig.set_time((now_ns - started) as f64 / 1e9);
            self.rig.begin_period();
            self.samples += 1;
            self.volts_before = before;
        }
        self.rig.command(self.volts_now());
        self.listen(now_ns, out)
    }

    /// Takes the chip's frames: hands each to its line, and notes the state that it reports.
    fn listen(&mut self, now_ns: u64, out: &mut Outbox) -> Result<(), VirtualError> {
        for frame in self.last.sent.split_inclusive(|byte| *byte == 0) {
            out.append(frame);
        }
        for at in 0..self.last.sent.len() {
            let Some(Ok(message)) = self.last.sent.get(at).and_then(|byte| self.decoder.push(*byte)) else {
                continue;
            };
            match message {
                Message::Hello(hello) => {
                    let misfits = from_scenario::misfits(&self.scenario, &hello);
                    if !misfits.is_empty() {
                        return Err(VirtualError::Refused(misfits.join("; ")));
                    }
                }
                Message::Configured(_) => {
                    self.state = BoardState::Ready;
                    (self.started_ns, self.samples) = (None, 0);
                    self.moved_ns = Some(now_ns);
                }
                Message::Armed(_) => {
                    self.state = BoardState::Armed;
                    self.armed_ns.get_or_insert(now_ns);
                }
                Message::Sample(sample) => self.tell(sample.status),
                Message::Telemetry(telemetry) => self.tell(telemetry.status),
                Message::Stopped(_) => self.state = BoardState::Stopped,
                Message::Fault(_) => self.state = BoardState::Faulted,
                _ => {}
            }
        }
        Ok(())
    }

    /// A sample's status: the state in which it was taken.
    fn tell(&mut self, status: u8) {
        // The first code follows its sample at once.
        let state = match BoardState::from_u8(status & STATUS_STATE) {
            Some(BoardState::Armed) => Some(BoardState::Running),
            state => state,
        };
        self.state = state.unwrap_or(self.state);
    }
}

impl VirtualBoard for ChipBoard {
    fn next_ns(&self) -> Option<u64> {
        (self.last.next_ns != u64::MAX).then_some(self.last.next_ns)
    }
    fn step(&mut self, now_ns: u64, out: &mut Outbox) -> Result<(), VirtualError> {
        self.exchange(now_ns, &[], out)
    }
    fn receive(&mut self, now_ns: u64, bytes: &[u8], out: &mut Outbox) -> Result<(), VirtualError> {
        self.exchange(now_ns, bytes, out)
    }
    fn armed_for(&self, now_ns: u64) -> Option<f64> {
        self.armed_ns.map(|t| now_ns.saturating_sub(t) as f64 / 1e9)
    }
    fn samples(&self) -> u64 {
        self.samples
    }
    fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }
    // The chip's own code is out when its sample is told.
    fn volts(&self) -> f64 {
        self.volts_before
    }
    fn rig(&self) -> &MovingRig {
        &self.rig
    }
    fn state(&self) -> BoardState {
        self.state
    }
    fn code(&self) -> DacCode {
        DacCode(self.last.code)
    }
    fn first_hit_ns(&self) -> Option<u64> {
        self.first_hit_ns
    }
}
