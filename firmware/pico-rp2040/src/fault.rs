//! Code that runs from flash, and before or after all else: the copy of the program into memory, and the end of a processor
//! that cannot continue. [`stop`] puts the safe output out and feeds the watchdog no more, which then resets the board
//! into its power-up state. A panic has no path to it: the image would not link.

use crate::board::stop;
use clutch_node::ResetCause;
use cortex_m_rt::exception;

/// The loader of the flash on a Pico, at the place where the chip looks for it.
#[unsafe(link_section = ".boot2")]
#[used]
static BOOT2: [u8; 256] = rp2040_boot2::BOOT_LOADER_W25Q080;

/// Copies the program into memory, before the first function there is called.
///
/// # Safety
/// For the runtime alone, which calls it once, before memory has a value.
// By the words of the processor: a compiler's own function for copies is in the program.
#[unsafe(export_name = "__pre_init")]
#[unsafe(link_section = ".HardFault.copy")]
unsafe extern "C" fn copy_program() {
    unsafe extern "C" {
        static mut __program: u32;
        static mut __eprogram: u32;
        static __iprogram: u32;
    }
    let (mut to, mut from) = (&raw mut __program, &raw const __iprogram);
    while to < &raw mut __eprogram {
        // SAFETY: the linker's bounds of the program, in memory that nothing uses yet.
        unsafe {
            to.write_volatile(from.read_volatile());
            (to, from) = (to.add(1), from.add(1));
        }
    }
}

#[exception(trampoline = false)]
#[unsafe(link_section = ".HardFault.user")]
unsafe fn HardFault() -> ! {
    stop(ResetCause::Fault)
}

// An unexpected interrupt, the one of a clock that has stopped, and the NMI.
#[exception]
#[unsafe(link_section = ".HardFault.others")]
unsafe fn DefaultHandler(number: i16) -> ! {
    let clock = number == rp_pac::Interrupt::CLOCKS_IRQ as i16;
    stop(if clock { ResetCause::Clock } else { ResetCause::Fault })
}
