//! The serial DAQ protocol: one table of messages, and the frames that carry them.
//!
//! A board reads an encoder and writes a converter; a host closes the loop. This crate is what
//! both say to each other, as bytes. It does no I/O, keeps no time and allocates nothing.
//! docs/wire.md specifies the same for those who write a board in another language.
//!
//! ```text
//! frame = COBS( kind u8 · fields, little-endian · CRC-32 u32 ) · 0x00
//! ```
//!
//! ```
//! use clutch_wire::{Decoder, Message, Sample, encode};
//! let sample = Message::Sample(Sample { run: 1, sequence: 7, time_us: 7000, counts: -3, status: 3 });
//! let frame = encode(&sample);
//! assert_eq!(frame.as_bytes().len(), 20);
//! let mut decoder = Decoder::new();
//! let heard: Vec<_> = frame.as_bytes().iter().filter_map(|&byte| decoder.push(byte)).collect();
//! assert_eq!(heard, [Ok(sample)]);
//! ```
//!
//! The stuffing is our own: the public COBS crates index into slices, with panics that a linker
//! cannot always remove, and a decoder of hostile bytes must not have any.
#![no_std]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

#[cfg(test)]
extern crate std;

mod codes;
mod frame;
mod list;
mod message;

pub use codes::{
    BoardFault, BoardState, CODES, CodeInfo, CodeValue, Refusal, STATUS, STATUS_DAC_FAULT,
    STATUS_ENCODER_FAULT, STATUS_LATE, STATUS_STATE, SafeKind, StopReason, TELEMETRY, TELEMETRY_ANSWERED,
    TELEMETRY_ASKED, TELEMETRY_LIMIT, TELEMETRY_SUPERSEDED, TELEMETRY_TARGETED,
};
pub use frame::{Decoder, Frame, FrameError, MAX_BODY, MAX_FRAME, encode};
pub use list::List;
pub use message::{
    Actuate, Arm, Armed, Configure, Configured, ControllerHello, Direction, Discover, Ended, Fault,
    FieldInfo, Hello, Link, Message, MessageInfo, Ping, Pong, Refused, SCHEMA, Sample, Set, Stop, Stopped,
    TABLE, Taken, Telemetry,
};

/// Version of the protocol: of the rules, of the codes' meanings and of the framing. A change of
/// the table alone shows in [`SCHEMA`].
pub const VERSION: u8 = 2;

#[cfg(test)]
mod tests;
