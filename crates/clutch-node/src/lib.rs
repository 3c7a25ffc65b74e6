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
mod control;
mod counter;
pub mod exchange;
mod onboard;
mod outbox;
mod remote;
mod runner;
mod settings;
mod standalone;
mod telemetry;

pub use board::{BoardNode, BoardParams};
pub use control::{ControlNode, ControlParams, CycleNotice, Ending, LinkCounts, Notice};
pub use counter::WideCounter;
pub use onboard::{Onboard, OnboardParams, Ports, present_code};
pub use outbox::Outbox;
pub use remote::{RemoteNode, Told};
pub use runner::{Acquisition, Hardware, Role, receive, tick};
pub use settings::{
    Built, MAX_KNOTS, Misfit, Numbers, Path, RunParams, SETTINGS, SETTINGS_HASH, SettingInfo, Settings,
    Unsupported,
};
pub use standalone::Standalone;
