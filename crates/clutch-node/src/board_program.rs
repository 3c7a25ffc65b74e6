//! The work of a board's program in each period, and with each byte that comes: the same on all boards.
//!
//! ```text
//!  encoder ─┐          ┌─► converter      1. the code goes out, from within the role, before it makes a frame
//!           ├─► role ──┼─► watchdog       2. only then is the watchdog fed
//!  line ────┘          └─► line           3. and only then are frames handed over
//! ```
//!
//! A board gives a [`Hardware`]; the role is a node of this crate. Both functions must be called
//! from one place, so that neither interrupts the other: nothing here locks.

use crate::board::{BoardMisfit, BoardNode, BoardParams};
use crate::outbox::Outbox;
use clutch_core::{Counts, DacCode, Micros};
use clutch_wire::{Decoder, Message};

/// The functions that a board's one file gives. None of them may wait.
pub trait Hardware {
    /// Time since the start, µs. Never goes back.
    fn now_us(&self) -> u64;

    /// The encoder's counts now.
    fn counts(&mut self) -> Counts;

    /// The encoder reports that it cannot be trusted; a board that cannot know says `false`.
    fn encoder_fault(&self) -> bool;

    /// The converter does not give the code that it was told last.
    fn converter_fault(&self) -> bool;

    /// Puts a code out.
    fn put_out(&mut self, code: DacCode);

    /// Feeds the hardware watchdog. Called once a period, when its code is out, and from nowhere
    /// else.
    fn feed_watchdog(&mut self);

    /// Hands frames to the line: all of them, and `true`; or none, while the line is busy with earlier ones. They are
    /// offered again then, with what comes after them.
    fn send(&mut self, frames: &[u8]) -> bool;

    /// A counter of the core's clock cycles; wraps.
    fn cycles(&self) -> u32;
}

/// A board's role towards the host. Times are [`Hardware::now_us`].
pub trait Role {
    /// Bytes from the host. `put_out` gets the code that the converter is to give afterwards.
    fn receive(&mut self, now_us: u64, bytes: &[u8], put_out: &mut impl FnMut(DacCode));

    /// A period begins. `put_out` gets the codes, at least one, and the last one is what this period's sample led to;
    /// frames are made after that. A code that a sample under control leaves as it is may come after them.
    fn sample(
        &mut self,
        now_us: u64,
        counts: Counts,
        encoder_fault: bool,
        converter_fault: bool,
        put_out: &mut impl FnMut(DacCode),
    );

    /// The sampling period, µs; none before one was configured.
    fn period_us(&self) -> Option<u32>;

    /// Frames for the host.
    fn outbox(&mut self) -> &mut Outbox;

    /// The code of the last sample is out, and its frames are made: cycles of the core for both, and the time up to the
    /// code.
    fn answered(&mut self, cycles: u32, lateness: Micros);
}

/// One sampling period: sample, code, watchdog, frames.
// A function of its own in machine code, too: its longest path is the bound of a period.
#[inline(never)]
pub fn tick(role: &mut impl Role, hardware: &mut impl Hardware) {
    let begun = hardware.cycles();
    let now_us = hardware.now_us();
    let counts = hardware.counts();
    let (encoder_fault, converter_fault) = (hardware.encoder_fault(), hardware.converter_fault());
    let mut lateness = None;
    role.sample(now_us, counts, encoder_fault, converter_fault, &mut |code| {
        hardware.put_out(code);
        lateness = Some(Micros(hardware.now_us().wrapping_sub(now_us) as u32));
    });
    // A role that puts nothing out is not one that works.
    if let Some(lateness) = lateness {
        hardware.feed_watchdog();
        role.answered(hardware.cycles().wrapping_sub(begun), lateness);
    }
    send(role, hardware);
}

/// Bytes from the host. A code among them goes out at once; the watchdog gets nothing from them.
// A function of its own in machine code, too: its stack is that of a configuration.
#[inline(never)]
pub fn receive(role: &mut impl Role, hardware: &mut impl Hardware, bytes: &[u8]) {
    role.receive(hardware.now_us(), bytes, &mut |code| hardware.put_out(code));
    send(role, hardware);
}

fn send(role: &mut impl Role, hardware: &mut impl Hardware) {
    let outbox = role.outbox();
    if !outbox.is_empty() && hardware.send(outbox.as_bytes()) {
        outbox.clear();
    }
}

/// The board as a host's data acquisition: the host closes the loop.
#[derive(Clone, Debug)]
pub struct DaqBoard {
    node: BoardNode,
    line: Decoder,
    outbox: Outbox,
}

impl DaqBoard {
    /// At power-up.
    ///
    /// # Errors
    /// Those of [`BoardParams::check`].
    pub fn new(params: &BoardParams) -> Result<Self, BoardMisfit> {
        Ok(DaqBoard { node: BoardNode::new(params)?, line: Decoder::new(), outbox: Outbox::default() })
    }
}

impl Role for DaqBoard {
    fn receive(&mut self, now_us: u64, bytes: &[u8], put_out: &mut impl FnMut(DacCode)) {
        self.node.receive(now_us as u32, &mut self.line, bytes, &mut self.outbox);
        put_out(self.node.code());
    }

    fn sample(
        &mut self,
        now_us: u64,
        counts: Counts,
        encoder_fault: bool,
        converter_fault: bool,
        put_out: &mut impl FnMut(DacCode),
    ) {
        let (fault, sample) = self.node.begin_period(now_us as u32, counts, encoder_fault, converter_fault);
        put_out(self.node.code());
        fault.iter().for_each(|fault| self.outbox.push(&Message::Fault(*fault)));
        sample.iter().for_each(|sample| self.outbox.push(&Message::Sample(*sample)));
    }

    fn period_us(&self) -> Option<u32> {
        self.node.period_us()
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    /// A sample has no room for it.
    fn answered(&mut self, _cycles: u32, _lateness: Micros) {}
}
