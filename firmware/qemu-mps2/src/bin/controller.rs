//! The controller on the emulated board.
#![no_std]
#![no_main]

#[path = "../panic.rs"]
mod panic;

use cortex_m_rt::entry;

#[entry]
fn main() -> ! {
    semihosting::process::exit(0)
}
