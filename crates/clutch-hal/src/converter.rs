//! Converters from codes to a voltage.

use clutch_core::DacCode;
use embedded_hal::pwm::SetDutyCycle;
use embedded_hal::spi::SpiDevice;

/// A converter.
pub trait Converter {
    /// Puts a code out, and does not wait for long; false if the converter has not taken it.
    fn put(&mut self, code: DacCode) -> bool;
}

/// A pulse width and the filter behind it: the code 0 is no pulse, the code above the last one a pulse without end.
#[derive(Debug)]
pub struct Pwm<P> {
    pwm: P,
    bits: u8,
}

/// A timer whose steps are coarser than the converter's codes.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CoarsePwm {
    /// Its steps in a period.
    pub steps: u16,
    /// Bits of the converter that it was to be.
    pub bits: u8,
}

impl core::fmt::Display for CoarsePwm {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let CoarsePwm { steps, bits } = self;
        write!(f, "a period of {steps} steps: expected at least 2^{bits}, one for each code of {bits} bits")
    }
}

impl core::error::Error for CoarsePwm {}

impl<P: SetDutyCycle> Pwm<P> {
    /// A converter of so many bits.
    ///
    /// # Errors
    /// A timer that has not a step for each code.
    pub fn new(pwm: P, bits: u8) -> Result<Self, CoarsePwm> {
        let steps = pwm.max_duty_cycle();
        if bits == 0 || bits > 15 || u32::from(steps) < 1 << u32::from(bits) {
            return Err(CoarsePwm { steps, bits });
        }
        Ok(Pwm { pwm, bits })
    }
}

impl<P: SetDutyCycle> Converter for Pwm<P> {
    fn put(&mut self, code: DacCode) -> bool {
        let whole = u32::from(self.pwm.max_duty_cycle());
        let half = (1_u32 << self.bits) >> 1;
        // The nearest step; a code that is none is the last.
        let duty = (u32::from(code.0) * whole + half) >> self.bits;
        self.pwm.set_duty_cycle(duty.min(whole) as u16).is_ok()
    }
}

/// Kinds of converters on SPI.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpiKind {
    /// MCP4921, or channel A of an MCP4922: 12 bit, the voltage of its reference without amplification (Microchip, DS21897).
    Mcp4921,
    /// MCP4821, or channel A of an MCP4822: 12 bit, twice its own reference of 2.048 V (Microchip, DS22244).
    Mcp4821,
    /// DAC8551: 16 bit (Texas Instruments, SLAS429).
    Dac8551,
}

/// A converter on SPI, in mode 0 or 1 as its sheet says, at a rate that makes three bytes a matter of microseconds.
#[derive(Debug)]
pub struct SpiDac<S> {
    spi: S,
    kind: SpiKind,
}

impl<S: SpiDevice> SpiDac<S> {
    /// A converter of a kind.
    pub const fn new(spi: S, kind: SpiKind) -> Self {
        SpiDac { spi, kind }
    }
}

impl<S: SpiDevice> Converter for SpiDac<S> {
    fn put(&mut self, code: DacCode) -> bool {
        // A code that is none is the last: its other bits would be the converter's configuration.
        let twelve = code.0.min(0x0fff);
        let word = |config: u16| (config | twelve).to_be_bytes();
        match self.kind {
            // Bit 12: on; bit 13: once the reference, else twice.
            SpiKind::Mcp4921 => self.spi.write(&word(0x3000)),
            SpiKind::Mcp4821 => self.spi.write(&word(0x1000)),
            SpiKind::Dac8551 => {
                let [high, low] = code.0.to_be_bytes();
                self.spi.write(&[0, high, low])
            }
        }
        .is_ok()
    }
}
