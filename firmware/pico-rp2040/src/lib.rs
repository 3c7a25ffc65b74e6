//! clutch on a Raspberry Pi Pico. The board is `board`, with its encoder in `quadrature` and its line in `line`; `run`
//! is a loop that any board without an executor can have. Wiring, power-up and flashing: docs/firmware.md. Not yet run
//! on hardware.
#![no_std]

pub mod board;
pub mod fault;
mod line;
#[path = "../../shared/panic.rs"]
mod panic;
mod quadrature;
pub mod run;
#[path = "../../shared/stack_guard.rs"]
mod stack_guard;
