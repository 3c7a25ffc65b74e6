//! The board as the host's data acquisition: `clutch loop --port`.
#![no_std]
#![no_main]

use clutch_node::Acquisition;
use clutch_nucleo_g474re::board::{Board, Line};
use clutch_nucleo_g474re::run;
use cortex_m_rt::entry;

#[embassy_executor::task]
async fn control(board: Board, line: Line) -> ! {
    run::run(Acquisition::new(&board.params()).ok(), board, line).await
}

#[entry]
fn main() -> ! {
    run::begin(control)
}
