//! Frames: stuffing, checksum, and the decoder that finds them again in any stream of bytes.

use crate::bytes::Put;
use crate::message::{LONGEST, Message};
use core::fmt;
use crc::{CRC_32_ISO_HDLC, Crc};

/// A kilobyte of table: a board that cannot spare it writes its own loop (docs/wire.md has one).
static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// The longest frame before stuffing, bytes.
pub const MAX_BODY: usize = LONGEST;

/// The longest frame on the wire, bytes: one of stuffing and the delimiter come on top.
pub const MAX_FRAME: usize = MAX_BODY + 2;

// Below 254 bytes COBS costs exactly one byte, and a code of 0xFF cannot be complete: there is only
// one way to stuff a frame. The table's lengths and the decoder's counters are bytes.
const _: () = assert!(MAX_FRAME < 254, "a frame must fit one block of COBS");

/// The bytes of one frame, delimiter included.
#[derive(Clone, Copy)]
pub struct Frame {
    bytes: [u8; MAX_FRAME],
    length: usize,
}

impl Frame {
    /// The bytes for the wire.
    #[inline]
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }
}

/// The frame of a message.
#[must_use]
pub fn encode(message: &Message) -> Frame {
    let mut bytes = [0; MAX_FRAME];
    let length = encode_into(message, &mut bytes);
    Frame { bytes, length }
}

/// Writes the frame of a message to the start of a place for any; its length. Bytes behind it then are of no meaning.
#[must_use]
pub fn encode_into(message: &Message, frame: &mut [u8; MAX_FRAME]) -> usize {
    let [code, rest @ ..] = frame;
    // The fields are written where they are sent from.
    let length = message.put(&mut Put::new(rest));
    close(code, rest, length)
}

/// Closes a frame whose fields are the first `length` bytes behind its code; its length, or 0 where it has no room.
#[inline]
fn close(code: &mut u8, rest: &mut [u8], length: usize) -> usize {
    let Some((body, rest)) = rest.split_at_mut_checked(length) else { return 0 };
    let Some((checksum, [delimiter, ..])) = rest.split_first_chunk_mut() else { return 0 };
    *checksum = CRC.checksum(body).to_le_bytes();
    *delimiter = 0;
    // COBS, from the end: each zero, and the place in front of the first byte, gets the distance to the next zero, below
    // 254 (see `MAX_FRAME`); the delimiter is one.
    let mut distance = 1_u8;
    for bytes in [&mut checksum[..], body] {
        for byte in bytes.iter_mut().rev() {
            if *byte == 0 {
                (*byte, distance) = (distance, 0);
            }
            distance = distance.wrapping_add(1);
        }
    }
    *code = distance;
    // The code, the checksum and the delimiter.
    length.wrapping_add(1 + 4 + 1)
}

/// The reason why bytes were dropped.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// The stuffing is wrong: a code points past the end of the frame.
    Cobs,
    /// More bytes without a delimiter than the longest frame has. Reported once; the rest is
    /// dropped silently.
    TooLong,
    /// Shorter than a kind and a CRC.
    TooShort,
    /// The checksum does not hold.
    Crc {
        /// The checksum in the frame.
        expected: u32,
        /// The checksum of its bytes.
        computed: u32,
    },
    /// Not the length that its kind has. Bytes before stuffing.
    Length {
        /// Kind of the frame.
        kind: u8,
        /// Length of that kind, bytes, with as many numbers as its list claims; 255 stands for more, too.
        expected: u8,
        /// Length of the frame, bytes.
        got: u8,
    },
    /// A kind that is not in the table.
    UnknownKind(u8),
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            FrameError::Cobs => f.write_str("stuffing: a code points past the end of the frame"),
            FrameError::TooLong => {
                write!(f, "length: more than {} bytes without a delimiter (0x00)", MAX_FRAME - 1)
            }
            FrameError::TooShort => f.write_str("length: expected at least 5 bytes, a kind and a CRC"),
            FrameError::Crc { expected, computed } => {
                write!(f, "CRC = {expected:#010x}: expected {computed:#010x}, which the bytes give")
            }
            FrameError::Length { kind, expected, got } => {
                write!(f, "length = {got} bytes: expected {expected} for kind {kind:#04x}")
            }
            FrameError::UnknownKind(kind) => {
                write!(f, "kind = {kind:#04x}: expected one of the table (schema {:#018x})", crate::SCHEMA)
            }
        }
    }
}

impl core::error::Error for FrameError {}

/// Finds frames in a stream of bytes, in constant memory.
///
/// It starts as if a delimiter had just come. The next delimiter always puts it in step again:
/// garbage costs at most the one frame that it runs into.
#[derive(Clone, Copy, Debug)]
pub struct Decoder {
    body: [u8; MAX_BODY],
    /// Bytes in `body`.
    length: u8,
    /// Bytes since the delimiter.
    count: u8,
    /// Bytes of the present block still to come.
    left: u8,
    /// Too long: drop up to the delimiter.
    dropping: bool,
}

impl Default for Decoder {
    fn default() -> Self {
        Decoder::new()
    }
}

impl Decoder {
    /// In step, nothing read.
    #[must_use]
    pub const fn new() -> Decoder {
        Decoder { body: [0; MAX_BODY], length: 0, count: 0, left: 0, dropping: false }
    }

    /// Takes a byte; a message or an error if a frame ends here. Two delimiters in a row are no
    /// frame and no error.
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<Result<Message, FrameError>> {
        if byte == 0 {
            return self.finish();
        }
        if self.dropping {
            return None;
        }
        if usize::from(self.count) >= MAX_FRAME - 1 {
            self.dropping = true;
            return Some(Err(FrameError::TooLong));
        }
        self.count = self.count.wrapping_add(1);
        if self.left > 0 {
            self.left = self.left.wrapping_sub(1);
            self.append(byte);
        } else {
            // A code. Each but the first stands where a zero was.
            if self.count > 1 {
                self.append(0);
            }
            self.left = byte.wrapping_sub(1);
        }
        None
    }

    /// One byte less than `count` gets here: the body has room.
    #[inline]
    fn append(&mut self, byte: u8) {
        if let Some(place) = self.body.get_mut(usize::from(self.length)) {
            *place = byte;
        }
        self.length = self.length.wrapping_add(1);
    }

    // Kept as a function in machine code: the timing analysis has a stated number of its calls.
    #[inline(never)]
    fn finish(&mut self) -> Option<Result<Message, FrameError>> {
        let (length, count, left, dropping) = (self.length, self.count, self.left, self.dropping);
        (self.length, self.count, self.left, self.dropping) = (0, 0, 0, false);
        if count == 0 || dropping {
            return None;
        }
        if left > 0 {
            return Some(Err(FrameError::Cobs));
        }
        Some(parse(self.body.get(..usize::from(length)).unwrap_or_default()))
    }
}

/// The checksum comes first: without it, kind and length mean nothing.
fn parse(body: &[u8]) -> Result<Message, FrameError> {
    let Some((content, crc)) = body.split_last_chunk::<4>() else {
        return Err(FrameError::TooShort);
    };
    let Some((&kind, fields)) = content.split_first() else {
        return Err(FrameError::TooShort);
    };
    let (expected, computed) = (u32::from_le_bytes(*crc), CRC.checksum(content));
    if expected != computed {
        return Err(FrameError::Crc { expected, computed });
    }
    let Some(length) = Message::length(kind, fields) else {
        return Err(FrameError::UnknownKind(kind));
    };
    if length != body.len() {
        // A list may claim more than any frame has; what came is below 254, see MAX_FRAME.
        let expected = u8::try_from(length).unwrap_or(u8::MAX);
        return Err(FrameError::Length { kind, expected, got: body.len() as u8 });
    }
    Message::take(kind, fields).ok_or(FrameError::UnknownKind(kind))
}

#[cfg(test)]
mod tests {
    use super::*;

    // The table of messages rules these out; that nothing panics must not depend on it.

    #[test]
    fn a_frame_that_has_no_room_is_none() {
        // Four bytes of checksum and the delimiter have to follow the fields.
        for (room, length) in [(3, 4), (8, 4), (4, 0)] {
            let mut place = [7; 8];
            assert_eq!(close(&mut 0, &mut place[..room], length), 0);
            assert_eq!(place, [7; 8]);
        }
        assert_eq!(close(&mut 0, &mut [7; 9], 4), 10);
    }

    #[test]
    fn a_byte_for_which_a_body_has_no_room_is_left_out() {
        let mut decoder = Decoder::new();
        decoder.length = u8::MAX;
        let before = decoder.body;
        decoder.append(1);
        assert_eq!(decoder.body, before);
    }
}
