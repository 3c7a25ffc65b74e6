//! The control task: one task, in an interrupt of its own, owns node and hardware. Periods and
//! bytes reach it one after the other, so nothing is shared and nothing locks.

use crate::board::{self, Board, CONTROL, Line, stop};
use clutch_node::{ResetCause, Role, receive, tick};
use embassy_executor::{InterruptExecutor, SpawnError, SpawnToken};
use embassy_futures::select::{Either, select};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::InterruptExt;
use embassy_time::{Duration, Ticker};

/// Bytes that are processed at a time: the longest wait of a period.
const CHUNK: usize = 32;

/// Period until a host has configured one, µs.
const BOOT_PERIOD_US: u32 = 1000;

static EXECUTOR: InterruptExecutor = InterruptExecutor::new();

// No hardware is behind this interrupt; the executor raises it.
#[interrupt]
unsafe fn TIM20_UP() {
    // SAFETY: called here only, and not before `begin` has started the executor: that enables it.
    unsafe { EXECUTOR.on_interrupt() }
}

/// Starts the board and its control task, and sleeps between interrupts for ever.
pub fn begin<S: Send, const READ_BACK: bool>(
    control: impl FnOnce(Board<READ_BACK>, Line) -> Result<SpawnToken<S>, SpawnError>,
) -> ! {
    let (board, line) = board::start();
    interrupt::TIM20_UP.set_priority(CONTROL);
    let Ok(control) = control(board, line) else { stop(ResetCause::Fault) };
    EXECUTOR.start(interrupt::TIM20_UP).spawn(control);
    loop {
        cortex_m::asm::wfi();
    }
}

/// Runs a role, for ever.
pub async fn run<const READ_BACK: bool>(
    role: &mut impl Role,
    mut board: Board<READ_BACK>,
    mut line: Line,
) -> ! {
    let mut bytes = [0; CHUNK];
    let mut period_us = BOOT_PERIOD_US;
    let mut beat = every(period_us);
    loop {
        // In this order: a period that is due takes precedence over waiting bytes.
        match select(beat.next(), line.read(&mut bytes)).await {
            Either::First(()) => tick(role, &mut board),
            Either::Second(count) => receive(role, &mut board, &bytes[..count]),
        }
        let wanted_us = role.period_us().unwrap_or(BOOT_PERIOD_US);
        if wanted_us != period_us {
            period_us = wanted_us;
            beat = every(period_us);
        }
    }
}

/// A beat of a period, µs.
pub fn every(period_us: u32) -> Ticker {
    Ticker::every(Duration::from_micros(period_us.into()))
}
