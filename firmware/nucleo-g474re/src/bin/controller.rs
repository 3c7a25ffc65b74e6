//! The board as controller: it closes the loop, and a host looks on: `clutch loop --board`.
#![no_std]
#![no_main]

use clutch_node::{OnboardParams, Standalone};
use clutch_nucleo_g474re::board::{Board, CLOCK_HZ, Line};
use clutch_nucleo_g474re::run;
use cortex_m_rt::entry;

#[embassy_executor::task]
async fn control(board: Board, line: Line) -> ! {
    let params = OnboardParams { board: board.board, boot: board.boot, clock_hz: CLOCK_HZ };
    run::run(Standalone::new(params, &board.params()).ok(), board, line).await
}

#[entry]
fn main() -> ! {
    run::begin(control)
}
