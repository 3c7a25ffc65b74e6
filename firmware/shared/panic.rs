//! No panic is reachable: the handler calls a symbol that is not defined, so an image with a path
//! to a panic does not link.

use core::panic::PanicInfo;

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        fn __panic_path_survived() -> !;
    }
    // SAFETY: never reached, or there would be no image.
    unsafe { __panic_path_survived() }
}
