//! The frame that tells encoder and converter to go to the safe state, ready before it is needed.

use clutch_node::Outbox;
use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicUsize, Ordering};

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

/// The frame; empty when there is no run.
///
/// # Safety
/// For the handler of a failure alone: the thread that it interrupted, the one that writes, does not go on.
pub unsafe fn frame() -> &'static [u8] {
    let length = LAST_WORD.length.load(Ordering::Acquire);
    // SAFETY: the caller's.
    unsafe { &*LAST_WORD.bytes.get() }.get(..length).unwrap_or(&[])
}
