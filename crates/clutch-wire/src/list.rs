//! A list of numbers at the end of a message.

use crate::bytes::{Put, next};
use core::fmt;

/// Up to eight numbers of 32 bits, as many as there are.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub struct List {
    count: u8,
    /// Zero beyond the count.
    values: [u32; List::MOST],
}

impl List {
    /// Most numbers.
    pub const MOST: usize = clutch_core::law::MAX_TERMS;

    /// Collects numbers; those beyond the most are left out.
    #[must_use]
    pub fn new(numbers: impl IntoIterator<Item = u32>) -> List {
        let mut list = List::default();
        for (place, number) in list.values.iter_mut().zip(numbers) {
            *place = number;
            list.count = list.count.wrapping_add(1);
        }
        list
    }

    /// The numbers.
    #[must_use]
    pub fn numbers(&self) -> &[u32] {
        self.values.get(..usize::from(self.count)).unwrap_or_default()
    }

    /// Bytes of the numbers alone.
    pub(crate) fn size(&self) -> usize {
        4_usize.wrapping_mul(self.count.into())
    }

    /// All places, also those beyond the count: a list ends its message, and nothing behind a message's length is sent.
    /// So there is no length to ask for and no loop.
    pub(crate) fn put(&self, out: &mut Put<'_>) {
        out.bytes([self.count]);
        self.values.iter().for_each(|number| out.bytes(number.to_le_bytes()));
    }

    /// Number by number: a copy of a length that only the frame knows would be bounded by that of any.
    pub(crate) fn take(rest: &mut &[u8]) -> Option<List> {
        let [count] = next(rest)?;
        let mut list = List { count, ..List::default() };
        for place in list.values.get_mut(..usize::from(count))? {
            *place = u32::from_le_bytes(next(rest)?);
        }
        Some(list)
    }

    /// Bytes of the numbers that the list claims whose count is at that place.
    pub(crate) fn claimed(fields: &[u8], at: usize) -> usize {
        4_usize.wrapping_mul(fields.get(at).copied().unwrap_or(0).into())
    }
}

impl fmt::Debug for List {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.numbers().fmt(f)
    }
}
