//! The board as the host's data acquisition: `clutch loop --port`.
#![no_std]
#![no_main]

use clutch_node::{DaqBoard, ResetCause};
use clutch_pico_rp2040::board::{start, stop};
use clutch_pico_rp2040::run;
use cortex_m_rt::entry;

#[entry]
fn main() -> ! {
    let board = start();
    let Ok(mut role) = DaqBoard::new(&board.params()) else { stop(ResetCause::Fault) };
    run::run(&mut role, board)
}
