//! The blue button and the green lamp, for the program without a host.

use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::{Idr, Moder, Odr, Pupdr};

/// Level of PC13 while the button is pressed, as the maker's own driver for this board has it. A description of the board by
/// others has the low level: if it is right, a run begins when the button is let go and ends after 2 s, and the first
/// power-on shows it.
const PRESSED: Idr = Idr::HIGH;

const BUTTON: usize = 13;
const LAMP: usize = 5;

/// Sets the two pins: PC13 and PA5.
pub fn start() {
    pac::GPIOC.pupdr().modify(|w| w.set_pupdr(BUTTON, Pupdr::PULL_DOWN));
    pac::GPIOC.moder().modify(|w| w.set_moder(BUTTON, Moder::INPUT));
    light(false);
    pac::GPIOA.moder().modify(|w| w.set_moder(LAMP, Moder::OUTPUT));
}

/// True while the button is pressed.
#[must_use]
pub fn pressed() -> bool {
    pac::GPIOC.idr().read().idr(BUTTON) == PRESSED
}

/// Lights the lamp, or puts it out.
pub fn light(lit: bool) {
    pac::GPIOA.odr().modify(|w| w.set_odr(LAMP, if lit { Odr::HIGH } else { Odr::LOW }));
}
