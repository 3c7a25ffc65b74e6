//! A list of numbers at the end of a message.

use crate::message::{Put, next};
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

    /// Of numbers; what is too much is left out.
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

    pub(crate) fn put(&self, out: &mut Put<'_>) {
        out.bytes([self.count]);
        for (place, number) in out.next(self.size()).as_chunks_mut().0.iter_mut().zip(self.numbers()) {
            *place = number.to_le_bytes();
        }
    }

    pub(crate) fn take(rest: &mut &[u8]) -> Option<List> {
        let [count] = next(rest)?;
        let mut list = List { count, ..List::default() };
        let places = list.values.get_mut(..usize::from(count))?;
        let (bytes, behind) = rest.split_at_checked(size_of_val(places))?;
        for (place, bytes) in places.iter_mut().zip(bytes.as_chunks().0) {
            *place = u32::from_le_bytes(*bytes);
        }
        *rest = behind;
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
