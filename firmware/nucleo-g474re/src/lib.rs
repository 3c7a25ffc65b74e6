//! clutch on a NUCLEO-G474RE. The board is `board`; the rest is the same on any board that embassy
//! supports. Wiring, power-up and flashing: docs/firmware.md. Not yet run on hardware.
#![no_std]

pub mod board;
pub mod button;
pub mod fault;
mod program;
mod read_back;
pub mod run;
#[path = "../../shared/stack_guard.rs"]
mod stack_guard;
