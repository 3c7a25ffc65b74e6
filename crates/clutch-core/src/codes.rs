//! Raw codes of the hardware, and how they scale: encoder counts, DAC codes, microseconds.
//!
//! Each is a type of its own; arithmetic across them does not compile. Angles are subtracted
//! as integers and only then converted: after a minute at 100 °/s the step of an absolute angle
//! in `f32` is 7.6e-6 rad, and a difference over 1 ms is coarse by 0.44 °/s.

use crate::params::{Range, Table};
use crate::{ParamError, Real};

/// Encoder counts as the counter gives them; wraps.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Counts(pub i32);

impl Counts {
    /// Counts moved since `earlier`: right across the wrap of the counter while less than
    /// half its range lies between.
    #[inline]
    #[must_use]
    pub fn since(self, earlier: Counts) -> i32 {
        self.0.wrapping_sub(earlier.0)
    }
}

/// A position in 2⁻¹⁶ counts, unwrapped: ±1.4e14 counts, exact over any run.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct FixedCounts(pub i64);

impl FixedCounts {
    /// Fractional bits.
    pub const FRACTION_BITS: u32 = 16;

    /// A whole number of counts.
    #[inline]
    #[must_use]
    pub const fn from_counts(counts: i64) -> FixedCounts {
        FixedCounts(counts.wrapping_shl(Self::FRACTION_BITS))
    }

    /// `counts` rounded down to 2⁻¹⁶ counts; saturates.
    #[inline]
    #[must_use]
    pub fn from_real<T: Real>(counts: T) -> FixedCounts {
        FixedCounts((counts * T::from_i32(1 << Self::FRACTION_BITS)).floor().to_i64())
    }

    /// The difference `self − other`, in counts.
    #[inline]
    #[must_use]
    pub fn minus<T: Real>(self, other: FixedCounts) -> T {
        // 2⁻¹⁶ is a power of two: the product is exact.
        T::from_i64(self.0.wrapping_sub(other.0)) * (T::ONE / T::from_i32(1 << Self::FRACTION_BITS))
    }

    /// Sum; wraps.
    #[inline]
    #[must_use]
    pub fn plus(self, other: FixedCounts) -> FixedCounts {
        FixedCounts(self.0.wrapping_add(other.0))
    }
}

/// A code for the digital-to-analogue converter.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DacCode(pub u16);

/// A time span in microseconds: the sampling period `T`, for one.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Micros(pub u32);

impl Micros {
    /// In seconds.
    #[inline]
    #[must_use]
    pub fn seconds<T: Real>(self) -> T {
        T::from_u64(u64::from(self.0)) / T::from_i32(1_000_000)
    }

    /// A sampling period must be longer than nothing and at most a second.
    ///
    /// # Errors
    /// Field `period` if it is 0 or above 1 000 000 µs.
    pub fn period<T: Real>(self) -> Result<T, ParamError<T>> {
        Table::<T>::check_rows(&SamplingParams { period: self })?;
        Ok(self.seconds())
    }
}

crate::params! {
    /// Times at which a servo is asked.
    pub struct SamplingParams<>: Default {
        /// Time from sample to sample, in (5).
        period: Micros = 1000, "period_us" "T" US, Range::within(1.0, 1e6);
    }
}

crate::params! {
    /// The angle sensor: `counts = ⌊θ N/2π⌋`.
    pub struct EncoderParams<>: Default {
        /// Counts per revolution, after quadrature. The paper's resolution is 0.018°.
        counts_per_rev: u32 = 20000, "counts_per_rev" "N" COUNTS_PER_REV, Range::within(4.0, 16777216.0);
    }
}

/// An incremental encoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encoder {
    counts_per_rev: u32,
}

impl Encoder {
    /// The paper's encoder: 20 000 counts per revolution, 0.018° each.
    pub const PAPER: Encoder = Encoder { counts_per_rev: 20_000 };

    /// An encoder of `counts_per_rev` counts per revolution (after quadrature).
    ///
    /// # Errors
    /// Field `counts_per_rev` outside 4…16 777 216 (the integers that `f32` holds exactly).
    pub fn new<T: Real>(counts_per_rev: u32) -> Result<Encoder, ParamError<T>> {
        Table::<T>::check_rows(&EncoderParams { counts_per_rev })?;
        Ok(Encoder { counts_per_rev })
    }

    /// Counts per revolution.
    #[must_use]
    pub fn counts_per_rev(self) -> u32 {
        self.counts_per_rev
    }

    /// One count, in radians.
    #[inline]
    #[must_use]
    pub fn radians_per_count<T: Real>(self) -> T {
        (T::PI + T::PI) / T::from_u64(u64::from(self.counts_per_rev))
    }

    /// Counts per radian.
    #[inline]
    #[must_use]
    pub fn counts_per_radian<T: Real>(self) -> T {
        T::from_u64(u64::from(self.counts_per_rev)) / (T::PI + T::PI)
    }
}

crate::params! {
    /// The converter from codes to volts. The paper's has 12 bit over ±10 V, 4.88 mV a step.
    pub struct DacParams<T>: Default {
        /// Resolution.
        bits: u8 = 12, "bits" "" BITS, Range::within(1.0, 16.0);
        /// Voltage of code 0.
        lowest: T = -10.0, "lowest_v" "" V, Range::ANY;
        /// Voltage one step above that of the highest code, which so is 9.9951 V by default.
        highest: T = 10.0, "highest_v" "" V, Range::ANY;
    }
    relations(p) {
        /// The range is not empty.
        ABOVE_LOWEST: highest, "a voltage above lowest_v" => p.highest > p.lowest;
        /// A step of the converter is a number.
        DIVISIBLE: highest, "a voltage so far above lowest_v, and no farther, that a step between two codes is a finite number above 0 V";
    }
}

/// A checked converter: volts to codes and back.
///
/// ```
/// use clutch_core::{Dac, DacCode, DacParams};
/// let dac = Dac::<f64>::new(&DacParams::default())?;
/// assert_eq!(dac.code(0.0), DacCode(2048));
/// assert_eq!(dac.code(1e9), DacCode(4095));
/// assert_eq!(dac.volts(DacCode(2049)), 20.0 / 4096.0);
/// # Ok::<(), clutch_core::ParamError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dac<T> {
    lowest: T,
    step: T,
    per_volt: T,
    top: u16,
}

impl<T: Real> Dac<T> {
    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(p: &DacParams<T>) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let codes = 1_i32.wrapping_shl(p.bits.into());
        let step = (p.highest - p.lowest) / T::from_i32(codes);
        DacParams::DIVISIBLE.require(p.highest, step > T::ZERO && step.is_finite())?;
        Ok(Dac {
            lowest: p.lowest,
            step,
            per_volt: T::from_i32(codes) / (p.highest - p.lowest),
            top: codes.wrapping_sub(1) as u16,
        })
    }

    /// The nearest code; saturates at both ends, NaN gives code 0.
    #[inline]
    #[must_use]
    pub fn code(&self, volts: T) -> DacCode {
        let x = (volts - self.lowest) * self.per_volt + T::from_f64(0.5);
        DacCode(x.to_u16().min(self.top))
    }

    /// The voltage that the code stands for, V; a code above the converter's range gives its top.
    #[inline]
    #[must_use]
    pub fn volts(&self, code: DacCode) -> T {
        self.lowest + self.step * T::from_i32(i32::from(code.0.min(self.top)))
    }

    /// One step, V.
    #[must_use]
    pub fn step(&self) -> T {
        self.step
    }

    /// Codes per volt, as [`Dac::code`] computes with it.
    #[must_use]
    pub fn per_volt(&self) -> T {
        self.per_volt
    }

    /// The highest code.
    #[must_use]
    pub fn top(&self) -> DacCode {
        DacCode(self.top)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn one_count_of_the_papers_encoder_is_0_018_degrees() {
        let count: f64 = Encoder::PAPER.radians_per_count();
        assert!((count.to_degrees() - 0.018).abs() < 1e-15);
        assert!((count - 3.1416e-4).abs() < 1e-8);
    }

    #[test]
    fn counts_subtract_across_the_wrap_of_the_counter() {
        assert_eq!(Counts(i32::MIN).since(Counts(i32::MAX)), 1);
        assert_eq!(Counts(i32::MAX).since(Counts(i32::MIN)), -1);
    }

    #[test]
    fn out_of_range_converters_are_named() {
        let bad = DacParams { bits: 0, ..DacParams::<f64>::default() };
        assert_eq!(Dac::new(&bad).unwrap_err().field(), "bits");
        let bad = DacParams { highest: -10.0, ..DacParams::<f64>::default() };
        assert_eq!(Dac::new(&bad).unwrap_err().field(), "highest");
        assert_eq!(Micros(0).period::<f64>().unwrap_err().field(), "period");
        assert_eq!(Encoder::new::<f64>(3).unwrap_err().field(), "counts_per_rev");
    }

    #[test]
    fn a_converter_has_its_highest_code_at_its_highest_voltage() {
        let dac = Dac::<f64>::new(&DacParams::default()).unwrap();
        assert_eq!(dac.top(), DacCode(4095));
        assert!((dac.volts(dac.top()) + dac.step() - 10.0).abs() < 1e-12);
        assert!((dac.per_volt() * dac.step() - 1.0).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn a_code_survives_the_way_to_volts_and_back(code in 0_u16..4096, bits in 1_u8..=16) {
            let dac = Dac::<f64>::new(&DacParams { bits, ..Default::default() }).unwrap();
            let code = DacCode(code.min(((1_u32 << bits) - 1) as u16));
            prop_assert_eq!(dac.code(dac.volts(code)), code);
            let dac = Dac::<f32>::new(&DacParams { bits, ..Default::default() }).unwrap();
            prop_assert_eq!(dac.code(dac.volts(code)), code);
        }

        #[test]
        fn the_nearest_code_is_at_most_half_a_step_away(volts in -10.0_f64..9.997) {
            let dac = Dac::<f64>::new(&DacParams::default()).unwrap();
            prop_assert!((dac.volts(dac.code(volts)) - volts).abs() <= 0.5 * dac.step() + 1e-12);
        }

        #[test]
        fn every_float_gives_a_code_in_range(bits in any::<u64>()) {
            let dac = Dac::<f64>::new(&DacParams::default()).unwrap();
            prop_assert!(dac.code(f64::from_bits(bits)).0 <= 4095);
        }
    }

    #[test]
    fn a_range_that_has_no_step_is_refused() {
        let dac = |lowest, highest| Dac::<f32>::new(&DacParams { bits: 12, lowest, highest });
        assert_eq!(dac(0.0, 1e-44).unwrap_err().field(), "highest", "a step of 0 V");
        assert_eq!(dac(-3e38, 3e38).unwrap_err().field(), "highest", "an infinite one");
    }
}
