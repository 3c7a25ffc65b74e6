//! The controller without a host: its run is compiled in, and the blue button begins and ends it.
#![no_std]
#![no_main]

// The module `alone_run`, written by `clutch scenario rust`: the file that build.rs chose.
include!(concat!(env!("OUT_DIR"), "/alone_run.rs"));

use clutch_node::{BoardParams, Hardware as _};
use clutch_nucleo_g474re::board::{self, Board, Line, READ_BACK};
use clutch_nucleo_g474re::{button, run};
use static_cell::StaticCell;

#[embassy_executor::task]
async fn control(mut board: Board<READ_BACK>, _line: Line) -> ! {
    button::start();
    let Some(alone) = made(&board.params()) else { refuse(&mut board).await };
    let mut beat = run::every(alone.period_us());
    loop {
        beat.next().await;
        alone.tick(&mut board, button::pressed());
        button::light(alone.lamp());
    }
}

/// The controller of the run, in a memory cell; none if it is of another board.
// A function of its own in machine code: what it takes of the stack would be the task's in each period.
#[inline(never)]
fn made(board: &BoardParams) -> Option<&'static mut alone_run::OfRun> {
    static ALONE: StaticCell<alone_run::OfRun> = StaticCell::new();
    let alone = alone_run::controller(board).ok()?;
    Some(ALONE.init_with(|| alone))
}

/// A run that this board cannot take: the output stays the boot code, and the lamp flickers.
#[cold]
async fn refuse(board: &mut Board<READ_BACK>) -> ! {
    let (mut beat, mut lit) = (run::every(board::WATCHDOG_US / 2), 0_u8);
    loop {
        beat.next().await;
        board.put_out(board::BOOT_CODE);
        board.feed_watchdog();
        lit = lit.wrapping_add(1);
        button::light(lit & 16 != 0);
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    run::begin(control)
}
