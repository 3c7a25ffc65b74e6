//! Messages on their way out.

use clutch_wire::{Actuate, MAX_FRAME, Message, encode_into};

/// The way of a node's messages to its other end: frames on a line, or the other end itself.
pub trait Sink {
    /// Hands a message over.
    fn push(&mut self, message: &Message);

    /// Hands a code over: the message that must not wait for anything.
    fn actuate(&mut self, answer: &Actuate) {
        self.push(&Message::Actuate(*answer));
    }
}

const CAPACITY: usize = 512;

/// Frames that wait to be written. A frame that does not fit is counted and dropped: the line is then
/// so far behind that its frames would be of no use.
#[derive(Clone, Copy, Debug)]
pub struct Outbox {
    /// Behind the capacity is room for a frame that does not fit.
    bytes: [u8; CAPACITY + MAX_FRAME],
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
        Outbox { bytes: [0; CAPACITY + MAX_FRAME], used: 0, dropped: 0 }
    }

    /// Adds a frame.
    // A function of its own in machine code: it is called from many places, and the timing analysis counts its calls.
    #[inline(never)]
    pub fn push(&mut self, message: &Message) {
        let free = self.bytes.get_mut(self.used..).unwrap_or_default();
        let Some(free) = free.first_chunk_mut() else { return };
        let length = encode_into(message, free);
        self.take(length);
    }

    /// Adds whole frames that have been made before.
    pub fn append(&mut self, frame: &[u8]) {
        let free = self.bytes.get_mut(self.used..).unwrap_or_default();
        free.iter_mut().zip(frame).for_each(|(to, from)| *to = *from);
        self.take(frame.len());
    }

    /// Takes so many bytes that were written behind the others, or drops them.
    fn take(&mut self, length: usize) {
        match self.used.checked_add(length).filter(|end| *end <= CAPACITY) {
            Some(end) => self.used = end,
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

impl Sink for Outbox {
    fn push(&mut self, message: &Message) {
        Outbox::push(self, message);
    }
}

/// Messages that wait for the end that is in the same memory.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Mail {
    waiting: [Option<Message>; Mail::MOST],
    /// The place of the oldest.
    first: u8,
    count: u8,
}

impl Mail {
    /// An end answers a message with one, and reports one fault: nothing waits behind more.
    const MOST: usize = 4;

    /// The oldest message.
    pub(crate) fn take(&mut self) -> Option<Message> {
        self.count = self.count.checked_sub(1)?;
        let at = usize::from(self.first) % Mail::MOST;
        self.first = self.first.wrapping_add(1);
        self.waiting.get_mut(at)?.take()
    }
}

impl Sink for Mail {
    /// A message without room is lost, as on a line; the ends bear that.
    // A function of its own in machine code: in most periods there is none.
    #[cold]
    #[inline(never)]
    fn push(&mut self, message: &Message) {
        let at = usize::from(self.first.wrapping_add(self.count)) % Mail::MOST;
        if usize::from(self.count) < Mail::MOST
            && let Some(place) = self.waiting.get_mut(at)
        {
            *place = Some(*message);
            self.count = self.count.wrapping_add(1);
        }
    }
}
