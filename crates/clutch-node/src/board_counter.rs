//! A counter of 16 bits as one of 32.

use clutch_core::Counts;

/// Encoder counts from a timer of 16 bits, as those of small microcontrollers are. It is right as long
/// as the shaft turns by less than 2¹⁵ counts from reading to reading.
#[derive(Clone, Copy, Debug)]
pub struct WideCounter {
    last: u16,
    counts: Counts,
}

impl WideCounter {
    /// Begins at 0, with the timer at `raw`.
    #[must_use]
    pub const fn new(raw: u16) -> Self {
        WideCounter { last: raw, counts: Counts(0) }
    }

    /// The counts, now that the timer is at `raw`. They wrap at 32 bits.
    pub fn read(&mut self, raw: u16) -> Counts {
        let moved = raw.wrapping_sub(self.last).cast_signed();
        self.last = raw;
        self.counts = Counts(self.counts.0.wrapping_add(i32::from(moved)));
        self.counts
    }
}
