//! As nucleo-daq, on a rig where the brake's voltage is read back, whatever `READ_BACK` of the board says.
#![no_std]
#![no_main]

use clutch_node::{DaqBoard, ResetCause};
use clutch_nucleo_g474re::board::{Board, Line, stop};
use clutch_nucleo_g474re::run;
use cortex_m_rt::entry;
use static_cell::StaticCell;

#[embassy_executor::task]
async fn control(board: Board<true>, line: Line) -> ! {
    // In a memory cell of its own: a task keeps a copy of each argument for every call on the way.
    static ROLE: StaticCell<DaqBoard> = StaticCell::new();
    let role = ROLE.init_with(|| DaqBoard::new(&board.params()).unwrap_or_else(|_| stop(ResetCause::Fault)));
    run::run(role, board, line).await
}

#[entry]
fn main() -> ! {
    run::begin(control)
}
