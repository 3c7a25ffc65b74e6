//! What ends in [`stop`], the safe output and no word to the watchdog, which then resets the board into its
//! power-up state. Nothing here trusts what is in memory, and nobody is told: text for a panic, with its
//! formatting of numbers, would be most of the image.

use crate::board::stop;
use core::panic::PanicInfo;
use cortex_m_rt::{ExceptionFrame, exception};

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

// An interrupt that nobody has asked for.
#[exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    stop()
}
