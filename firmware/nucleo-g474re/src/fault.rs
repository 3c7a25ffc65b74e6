//! For a program that cannot continue: puts out [`BOOT_CODE`] and stops feeding the watchdog, which
//! then resets the board into its power-up state. Nothing here trusts the contents of memory, and
//! nothing is reported: text for a panic, with its formatting of numbers, would be most of the
//! image.

use crate::board::BOOT_CODE;
use core::panic::PanicInfo;
use cortex_m_rt::{ExceptionFrame, exception};
use embassy_stm32::pac;

/// Puts the safe output out and waits for the reset.
pub fn stop() -> ! {
    cortex_m::interrupt::disable();
    pac::DAC1.dhr12r(0).write(|w| w.set_dhr(BOOT_CODE.0));
    loop {
        cortex_m::asm::nop();
    }
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    stop()
}

// Faults of memory, bus and usage escalate to it: none has a handler of its own.
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    stop()
}

// Parity of the memory, two wrong bits in the flash, a crystal that stops.
#[exception]
unsafe fn NonMaskableInt() -> ! {
    stop()
}

// An unexpected interrupt.
#[exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    stop()
}
