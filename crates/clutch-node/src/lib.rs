//! The nodes at a serial line, as state machines without I/O and without a clock.
//!
//! ```text
//!  encoder ─► BoardNode ──Sample──► ControllerNode ─► supervisor ─► servo
//!  pad     ◄─ watchdog  ◄─Actuate──                ◄─────────────────┘
//! ```
//!
//! The controller may run on a board itself; then a host looks on:
//!
//! ```text
//!  HostNode ◄──settings, telemetry──► BoardController (a ControllerNode) ◄──as above──► BoardNode
//! ```
//!
//! [`BoardNode`] is what a board at encoder and converter does: it samples, applies codes, and goes to the
//! safe state by itself when the controller falls silent. [`ControllerNode`] is what drives it. Bytes
//! and times go in, bytes and notices come out; the Linux loop, the simulated board, the tests in
//! virtual time and firmware run the same two. No allocation, no `unsafe`, no reachable panic.
//!
//! | file | runs on | is |
//! |---|---|---|
//! | `controller` | PC or board | the node that closes the loop |
//! | `board` | board | samples out, codes in, a watchdog |
//! | `host` | PC | what sets a board controller up and looks on |
//! | `board_controller` | board | a controller that a host looks at |
//! | `one_chip` | board | a board controller and its board in one memory |
//! | `hardware` | board | what a board's program does each period, in either role |
//! | `wide_counter` | board | a counter of 16 bits as one of 32 |
//! | `lockstep` | both | a board controller that is asked instead of keeping time |
//! | `telemetry` | both | a run's cycles on their way to the host; on its way to the board it is [`Settings`](clutch_settings::Settings) |
//! | `notice`, `outbox`, `pace` | both | what a node reports, its frames on their way out, and the pace of the samples |
#![no_std]
#![forbid(unsafe_code)]

mod board;
mod board_controller;
mod controller;
mod hardware;
mod host;
pub mod lockstep;
mod notice;
mod one_chip;
mod outbox;
mod pace;
mod telemetry;
mod wide_counter;

pub use board::{BoardMisfit, BoardNode, BoardParams};
pub use board_controller::{BoardController, BoardControllerParams, present_code};
pub use clutch_wire::ResetCause;
pub use controller::{ControllerNode, ControllerParams};
pub use hardware::{DaqBoard, Hardware, Role, receive, tick};
pub use host::HostNode;
pub use lockstep::Outboxes;
pub use notice::{CycleNotice, Ending, LinkCounts, Notice, Standing};
pub use one_chip::OneChip;
pub use outbox::{Outbox, Sink};
pub use wide_counter::WideCounter;
