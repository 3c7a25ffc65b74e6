//! Both ends of the serial line, as state machines without I/O and without a clock.
//!
//! ```text
//!  encoder ─► BoardNode ──Sample──► ControlNode ─► supervisor ─► servo
//!  pad     ◄─ watchdog  ◄─Actuate──             ◄─────────────────┘
//! ```
//!
//! The loop may run on a board itself; then a host looks on:
//!
//! ```text
//!  host: RemoteNode ◄──settings, telemetry──► Onboard (a ControlNode) ◄──as above──► BoardNode
//! ```
//!
//! [`BoardNode`] is what a data-acquisition board does: it samples, applies codes, and goes to the
//! safe state by itself when the controller falls silent. [`ControlNode`] is what drives it. Bytes
//! and times go in, bytes and notices come out; the Linux loop, the simulated board, the tests in
//! virtual time and firmware run the same two. No allocation, no `unsafe`, no reachable panic.
#![no_std]

mod board;
mod board_controller;
mod controller;
mod hardware;
mod host;
pub mod lockstep;
mod one_chip;
mod outbox;
mod settings;
mod telemetry;
mod wide_counter;

pub use board::{BoardNode, BoardParams};
pub use board_controller::{Onboard, OnboardParams, Ports, present_code};
pub use controller::{ControlNode, ControlParams, CycleNotice, Ending, LinkCounts, Notice};
pub use hardware::{Acquisition, Hardware, Role, receive, tick};
pub use host::{RemoteNode, Told};
pub use one_chip::Standalone;
pub use outbox::Outbox;
pub use settings::{
    Built, MAX_KNOTS, Misfit, Numbers, Path, RunParams, SETTINGS, SETTINGS_HASH, SettingInfo, Settings,
    Unsupported,
};
pub use wide_counter::WideCounter;
