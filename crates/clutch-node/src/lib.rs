#![doc = include_str!("../README.md")]
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
