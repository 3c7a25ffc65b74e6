//! The brake's voltage, read back behind the amplifier: whether it follows the converter.

use crate::board::{BOOT_CODE, CLOCK_HZ};
use clutch_core::DacCode;
use core::cell::Cell;
use embassy_stm32::pac;
use embassy_stm32::pac::adc::vals::SampleTime;
use embassy_stm32::pac::adccommon::vals::Ckmode;

/// Codes by which the voltage may be off: 5 % of the range, for resistors of 1 %, offset and noise.
const TOLERANCE: u16 = 205;

/// Periods in a row in which it has to be off by more: one is noise.
const PERIODS: u8 = 3;

/// Channel of the ADC: PA0. Its pin is analogue from the reset on.
const CHANNEL: u8 = 1;

/// The ADC, which converts once a period.
pub(crate) struct ReadBack {
    /// The code whose voltage is being converted.
    asked: Cell<DacCode>,
    /// Periods in a row in which it was off.
    off: Cell<u8>,
}

impl ReadBack {
    /// Starts the ADC, by the chip's reference manual.
    pub(crate) fn start() -> ReadBack {
        let adc = pac::ADC1;
        pac::RCC.ahb2enr().modify(|w| w.set_adc12en(true));
        pac::ADC12_COMMON.ccr().modify(|w| w.set_ckmode(Ckmode::SYNC_DIV4)); // 42.5 MHz
        adc.cr().modify(|w| w.set_deeppwd(false));
        adc.cr().modify(|w| w.set_advregen(true));
        cortex_m::asm::delay(CLOCK_HZ / 50_000); // its regulator wants 20 µs
        adc.cr().modify(|w| w.set_adcal(true));
        while adc.cr().read().adcal() {}
        adc.cr().modify(|w| w.set_aden(true));
        while !adc.isr().read().adrdy() {}
        adc.smpr().modify(|w| w.set_smp(usize::from(CHANNEL), SampleTime::CYCLES92_5)); // 2.2 µs
        adc.sqr1().modify(|w| w.set_sq(0, CHANNEL));
        adc.cr().modify(|w| w.set_adstart(true));
        ReadBack { asked: Cell::new(BOOT_CODE), off: Cell::new(0) }
    }

    /// Takes the conversion that began with the period before, and begins the next, of the code that is out now. True
    /// if the voltage has been off for some periods.
    pub(crate) fn strays(&self, out: DacCode) -> bool {
        let adc = pac::ADC1;
        let done = adc.isr().read().eoc();
        let off = !done || adc.dr().read().rdata().abs_diff(self.asked.get().0) > TOLERANCE;
        self.off.set(if off { self.off.get().saturating_add(1) } else { 0 });
        self.asked.set(out);
        adc.cr().modify(|w| w.set_adstart(true));
        self.off.get() >= PERIODS
    }
}
