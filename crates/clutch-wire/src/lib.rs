#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

#[cfg(test)]
extern crate std;

mod bytes;
mod codes;
mod frame;
mod list;
mod message;

pub use codes::{
    BoardFault, BoardState, CODES, CodeInfo, CodeValue, Refusal, ResetCause, STATUS, STATUS_DAC_FAULT,
    STATUS_ENCODER_FAULT, STATUS_LATE, STATUS_STATE, SafeKind, StopReason, TELEMETRY, TELEMETRY_ANSWERED,
    TELEMETRY_ASKED, TELEMETRY_LIMIT, TELEMETRY_SUPERSEDED, TELEMETRY_TARGETED, WARNING_BROWN_OUT, WARNINGS,
};
pub use frame::{Decoder, Frame, FrameError, MAX_BODY, MAX_FRAME, encode, encode_into};
pub use list::List;
pub use message::{
    Actuate, Arm, Armed, Configure, Configured, ControllerHello, Direction, Discover, Ended, Fault,
    FieldInfo, Hello, Link, Message, MessageInfo, Ping, Pong, Refused, SCHEMA, Sample, Set, Stop, Stopped,
    TABLE, Taken, Telemetry,
};

/// Version of the protocol: of the rules, of the codes' meanings and of the framing. A change of
/// the table alone shows in [`SCHEMA`].
pub const VERSION: u8 = 4;

/// Most periods that a host may ask a board's watchdog to wait for: a host that has gone does not leave a code on for
/// longer.
pub const WATCHDOG_PERIODS: u32 = 100;

#[cfg(test)]
mod tests;
