//! The controller role on the emulated board, over one of two links:
//!
//! | files `to_fw` and `from_fw` in the emulator's directory | link |
//! |---|---|
//! | exist | lockstep: time and bytes come through them; `clutch hil` starts this |
//! | do not exist | UART0 is the host's line, UART1 that of encoder and converter; real time |
//!
//! The first does some 20 000 cycles a second and repeats bit for bit. The second is a board like
//! any other, but a slow one.
#![no_std]
#![no_main]

#[path = "../fault.rs"]
mod fault;
#[path = "../files.rs"]
mod files;
#[path = "../last_word.rs"]
mod last_word;
#[path = "../lockstep.rs"]
mod lockstep;
#[path = "../../../shared/panic.rs"]
mod panic;
#[path = "../serial.rs"]
mod serial;

use clutch_node::{BoardController, BoardControllerParams};
use cortex_m_rt::entry;

/// Serial number of the emulated board: one that keeps its own time.
const BOARD: u32 = 1;

#[entry]
fn main() -> ! {
    // No cycle counter: the emulator does not know the time of an instruction.
    let node = BoardController::new(BoardControllerParams { board: BOARD, boot: 1, clock_hz: 0 });
    match lockstep::Link::open() {
        Some(link) => lockstep::run(link, node),
        None => serial::run(node),
    }
}
