//! Bytes on their way out.

use clutch_wire::{Message, encode};

const CAPACITY: usize = 512;

/// Frames that wait to be written. A frame that does not fit is counted and dropped: the line is then
/// so far behind that its frames would be of no use.
#[derive(Clone, Copy, Debug)]
pub struct Outbox {
    bytes: [u8; CAPACITY],
    used: usize,
    dropped: u32,
}

impl Default for Outbox {
    fn default() -> Self {
        Outbox::new()
    }
}

impl Outbox {
    /// Nothing to be written.
    #[must_use]
    pub const fn new() -> Outbox {
        Outbox { bytes: [0; CAPACITY], used: 0, dropped: 0 }
    }

    /// Adds a frame.
    pub fn push(&mut self, message: &Message) {
        self.append(encode(message).as_bytes());
    }

    /// Adds whole frames that have been made before.
    pub fn append(&mut self, frame: &[u8]) {
        let end = self.used.saturating_add(frame.len());
        match self.bytes.get_mut(self.used..end) {
            Some(free) => {
                free.iter_mut().zip(frame).for_each(|(to, from)| *to = *from);
                self.used = end;
            }
            None => self.dropped = self.dropped.saturating_add(1),
        }
    }

    /// The bytes that are to be written.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..self.used).unwrap_or(&[])
    }

    /// Nothing is to be written.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.used == 0
    }

    /// It has been written.
    pub fn clear(&mut self) {
        self.used = 0;
    }

    /// Frames that did not fit.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped
    }
}
