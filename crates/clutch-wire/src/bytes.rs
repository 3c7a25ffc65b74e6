//! Bytes of a frame, one field after the other.

/// Writes fields one after the other. A field that does not fit is left out, which the lengths of
/// the table rule out; this way nothing can panic.
pub(crate) struct Put<'a> {
    rest: &'a mut [u8],
}

impl<'a> Put<'a> {
    pub(crate) fn new(rest: &'a mut [u8]) -> Self {
        Put { rest }
    }

    #[inline]
    pub(crate) fn bytes<const N: usize>(&mut self, bytes: [u8; N]) {
        if let Some((head, tail)) = core::mem::take(&mut self.rest).split_first_chunk_mut::<N>() {
            *head = bytes;
            self.rest = tail;
        }
    }
}

/// The next `N` bytes.
#[inline]
pub(crate) fn next<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (head, tail) = rest.split_first_chunk::<N>()?;
    *rest = tail;
    Some(*head)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_that_does_not_fit_is_left_out() {
        let mut place = [7; 3];
        let mut put = Put::new(&mut place);
        put.bytes([1, 2]);
        put.bytes([3, 4]);
        assert_eq!(place, [1, 2, 7]);
    }
}
