//! For a program that cannot continue: [`stop`], the safe output and no more feeding of the watchdog, which then
//! resets the board into its power-up state. Nothing here trusts the contents of memory, and nothing is reported:
//! text for a panic, with its formatting of numbers, would be most of the image.

use crate::board::stop;
use clutch_node::ResetCause;
use core::panic::PanicInfo;
use cortex_m_rt::{ExceptionFrame, exception};
use embassy_stm32::pac;

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    stop(ResetCause::Fault)
}

// Faults of memory, bus and usage escalate to it: none has a handler of its own.
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    stop(ResetCause::Fault)
}

// Parity of the memory, two wrong bits in the flash, a crystal that stops.
#[exception]
unsafe fn NonMaskableInt() -> ! {
    stop(if pac::RCC.cifr().read().cssf() { ResetCause::Clock } else { ResetCause::Fault })
}

// An unexpected interrupt.
#[exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    stop(ResetCause::Fault)
}
