#![doc = include_str!("../README.md")]
//!
//! | file | what |
//! |---|---|
//! | `memory` | objects in memory of the caller's |
//! | `settings` | a run as numbers, and what is wrong with them |
//! | `axis` | servo, supervisor and path of a shaft |
//! | `servo` | the servo by itself |
//! | `law` | the law by itself |
//! | `path` | targets along a path |
//! | `safe` | the safe state, code by code |
//! | `stick_slip` | sticks that the encoder shows |
#![no_std]
#![allow(non_camel_case_types, reason = "the names are those of C")]
#![allow(
    clippy::missing_safety_doc,
    reason = "pointers are checked as far as they can be; the README says the rest"
)]

mod axis;
mod law;
mod memory;
mod path;
mod safe;
mod servo;
mod settings;
mod stick_slip;

pub use axis::*;
pub use law::*;
pub use memory::clutch_result;
pub use path::*;
pub use safe::*;
pub use servo::*;
pub use settings::*;
pub use stick_slip::*;

#[cfg(feature = "staticlib")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        fn clutch_panic_path_survived() -> !;
    }
    // SAFETY: no program has it: one with a path to a panic does not link.
    unsafe { clutch_panic_path_survived() }
}

// The compiler's own functions name this where programs unwind. Weak, so that a program may have another Rust library.
#[cfg(all(feature = "staticlib", not(target_os = "none")))]
core::arch::global_asm!(
    ".weak rust_eh_personality",
    ".hidden rust_eh_personality",
    "rust_eh_personality:",
    "ret"
);

/// A panic that can be reached: with it a program must not link, or the check proves nothing.
#[cfg(feature = "control")]
#[unsafe(no_mangle)]
pub extern "C" fn clutch_control(place: usize) -> u8 {
    #[allow(clippy::indexing_slicing, reason = "the panic that is to be found")]
    [1, 2, 3][place]
}
