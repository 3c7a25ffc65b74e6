//! The board as controller: it closes the loop, and a host watches: `clutch loop --board`.
#![no_std]
#![no_main]

use clutch_node::{BoardControllerParams, OneChip};
use clutch_pico_rp2040::board::{CYCLES_HZ, start};
use clutch_pico_rp2040::run;
use cortex_m_rt::entry;

#[entry]
fn main() -> ! {
    let board = start();
    let params = board.params();
    let controller = BoardControllerParams { board: params.board, boot: params.boot, clock_hz: CYCLES_HZ };
    // Its parameters were checked when they were compiled.
    run::run(&mut OneChip::of(controller, &params), board)
}
