//! The reaction to a failing processor: encoder and converter are ordered into the safe state.
//!
//! The frame is ready before it is needed, so that a handler that can trust nothing has only to send it.

use crate::{lockstep, serial};
use clutch_node::Outbox;
use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicUsize, Ordering};
use cortex_m_rt::{ExceptionFrame, exception};

const ROOM: usize = 16;

/// The frame; its length is published after it.
struct LastWord {
    bytes: UnsafeCell<[u8; ROOM]>,
    length: AtomicUsize,
}

// SAFETY: written by the one thread with the length at 0, read by the handler of its failure.
unsafe impl Sync for LastWord {}

static LAST_WORD: LastWord = LastWord { bytes: UnsafeCell::new([0; ROOM]), length: AtomicUsize::new(0) };

/// Keeps the frame that ends the present run; none when there is no run.
pub fn prepare(frame: Option<Outbox>) {
    LAST_WORD.length.store(0, Ordering::Release);
    let Some(frame) = frame else { return };
    let frame = frame.as_bytes();
    // SAFETY: with the length at 0 nobody reads.
    let bytes = unsafe { &mut *LAST_WORD.bytes.get() };
    if let Some(room) = bytes.get_mut(..frame.len()) {
        room.iter_mut().zip(frame).for_each(|(to, from)| *to = *from);
        LAST_WORD.length.store(frame.len(), Ordering::Release);
    }
}

/// An invalid instruction.
pub fn fail() -> ! {
    cortex_m::asm::udf()
}

/// Sends the last frame, and exits with a code that nothing else uses.
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    let length = LAST_WORD.length.load(Ordering::Acquire);
    // SAFETY: what the handler interrupted does not go on.
    let frame = unsafe { &*LAST_WORD.bytes.get() }.get(..length).unwrap_or(&[]);
    serial::last_word(frame);
    lockstep::last_word(frame);
    semihosting::process::exit(101)
}
