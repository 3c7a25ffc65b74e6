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
//! Or there is no host, and a button gives consent: [`Alone`].
//!
//! [`BoardNode`] is what a board at encoder and converter does: it samples, applies codes, and goes to the
//! safe state by itself when the controller falls silent. [`ControllerNode`] is what drives it. Bytes
//! and times go in, bytes and notices come out; the Linux loop, the simulated board, the tests in
//! virtual time and firmware run the same two. No allocation, no `unsafe`, no reachable panic.
//!
//! A file is named after its node; without one in its name it is of all of them.
//!
//! | file | runs on | is |
//! |---|---|---|
//! | `controller` | PC or board | the node that closes the loop |
//! | `controller_telemetry` | both | a run's cycles on their way to the host; on its way to the board it is [`Settings`](clutch_settings::Settings) |
//! | `controller_lockstep` | both | a board controller that is asked instead of keeping time |
//! | `board` | board | samples out, codes in, a watchdog |
//! | `board_program`, `board_counter` | board | what a board's program does each period, in either role; a counter of 16 bits as one of 32 |
//! | `board_pace` | PC or board | the pace of a board's samples, by the clock of who gets them |
//! | `board_controller` | board | a controller that a host looks at |
//! | `host` | PC | what sets a board controller up and looks on |
//! | `one_chip` | board | a board controller and its board in one memory |
//! | `alone` | board | a controller without a host |
//! | `notice`, `outbox` | both | what a node reports, and its frames on their way out |
#![no_std]
#![forbid(unsafe_code)]

mod alone;
mod board;
mod board_controller;
mod board_counter;
mod board_pace;
mod board_program;
mod controller;
pub mod controller_lockstep;
mod controller_telemetry;
mod host;
mod notice;
mod one_chip;
mod outbox;

pub use alone::{Alone, AloneMisfit, AloneRun};
pub use board::{BoardMisfit, BoardNode, BoardParams};
pub use board_controller::{BoardController, BoardControllerParams, present_code};
pub use board_counter::WideCounter;
pub use board_program::{DaqBoard, Hardware, Role, receive, tick};
pub use clutch_wire::ResetCause;
pub use controller::{ControllerNode, ControllerParams};
pub use controller_lockstep::Lines;
pub use host::HostNode;
pub use notice::{CycleNotice, Ending, LinkCounts, Notice, Standing};
pub use one_chip::OneChip;
pub use outbox::{Outbox, Sink};
