//! For a processor that cannot continue: [`stop`], the safe output and no more feeding of the watchdog, which then
//! resets the board into its power-up state. A panic has no path to it: the image would not link.

use crate::board::stop;
use cortex_m_rt::{ExceptionFrame, exception};

#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    stop()
}

// An unexpected interrupt, the one of a clock that has stopped, and the NMI.
#[exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    stop()
}

/// The loader of the flash on a Pico, at the place where the chip looks for it.
#[unsafe(link_section = ".boot2")]
#[used]
static BOOT2: [u8; 256] = rp2040_boot2::BOOT_LOADER_W25Q080;
