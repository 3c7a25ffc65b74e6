//! The board as controller: it closes the loop, and a host watches: `clutch loop --board`.
#![no_std]
#![no_main]

use clutch_node::{BoardControllerParams, OneChip, ResetCause};
use clutch_nucleo_g474re::board::{Board, CLOCK_HZ, Line, READ_BACK, stop};
use clutch_nucleo_g474re::run;
use cortex_m_rt::entry;
use static_cell::StaticCell;

#[embassy_executor::task]
async fn control(board: Board<READ_BACK>, line: Line) -> ! {
    let params = BoardControllerParams { board: board.board, boot: board.boot, clock_hz: CLOCK_HZ };
    // In a memory cell of its own: a task keeps a copy of each argument for every call on the way.
    static ROLE: StaticCell<OneChip> = StaticCell::new();
    let role =
        ROLE.init_with(|| OneChip::new(params, &board.params()).unwrap_or_else(|_| stop(ResetCause::Fault)));
    run::run(role, board, line).await
}

#[entry]
fn main() -> ! {
    run::begin(control)
}
