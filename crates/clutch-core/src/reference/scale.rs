//! Radians and seconds in counts and ticks.

use crate::{Encoder, FixedCounts, Micros, ParamError, Real};

/// Factors that turn radians and seconds into counts and ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale<T> {
    pub(super) counts_per_radian: T,
    /// s
    pub(super) period: T,
}

/// Fractional bits of a rate in counts per tick: half of 2⁻⁴⁰ count per tick is 0.0012 counts
/// in 30 days at 1 kHz.
const RATE_BITS: u32 = 40;

impl<T: Real> Scale<T> {
    pub(super) fn new(encoder: Encoder, period: Micros) -> Result<Self, ParamError<T>> {
        Ok(Scale { counts_per_radian: encoder.counts_per_radian(), period: period.period()? })
    }

    /// rad/s to the nearest multiple of 2⁻⁴⁰ counts per tick.
    pub(super) fn rate(&self, radians_per_second: T) -> i64 {
        let counts_per_tick = radians_per_second * self.counts_per_radian * self.period;
        (counts_per_tick * T::from_i64(1 << RATE_BITS) + T::from_f64(0.5)).floor().to_i64()
    }

    /// A small distance in radians to fixed-point counts.
    pub(super) fn distance(&self, radians: T) -> FixedCounts {
        FixedCounts::from_real(radians * self.counts_per_radian)
    }

    pub(super) fn seconds(&self, ticks: u64) -> T {
        T::from_u64(ticks) * self.period
    }

    /// 2⁻⁴⁰ counts per tick in 64 bits hold a rate, rad/s.
    pub(super) fn holds_rate(&self, rate: T) -> bool {
        (rate * self.counts_per_radian * self.period).abs() < T::from_i32(4_000_000)
    }

    /// Fixed-point counts hold a distance, rad.
    pub(super) fn holds_distance(&self, distance: T) -> bool {
        (distance * self.counts_per_radian).abs() < T::from_f64(1e12)
    }

    /// Ticks count a time, s; not if it is NaN.
    pub(super) fn counts_time(&self, time: T) -> bool {
        time < self.period * T::from_f64(1e15)
    }

    /// Samples see a frequency, Hz.
    pub(super) fn samples(&self, frequency: T) -> bool {
        frequency * self.period < T::from_f64(0.5)
    }
}

/// `rate · ticks`, exact.
#[inline]
pub(super) fn advance(rate: i64, ticks: u64) -> FixedCounts {
    const EXTRA: u32 = RATE_BITS - FixedCounts::FRACTION_BITS;
    #[cold]
    #[inline(never)]
    fn wide(rate: i64, ticks: u64) -> i64 {
        (i128::from(rate).wrapping_mul(i128::from(ticks)) >> EXTRA) as i64
    }
    FixedCounts(match u32::try_from(ticks) {
        // 49 days at 1 kHz: the halves of the rate one by one, without products of 128 bits.
        Ok(ticks) => {
            let (high, low) = (rate >> 32, rate as u32);
            let high = high.wrapping_mul(i64::from(ticks)) << (32 - EXTRA);
            high.wrapping_add((u64::from(low).wrapping_mul(u64::from(ticks)) >> EXTRA) as i64)
        }
        Err(_) => wide(rate, ticks),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    proptest::proptest! {
        #[test]
        fn a_rate_over_any_ticks_is_the_product_of_128_bits(rate: i64, ticks: u64, short: u32) {
            for ticks in [ticks, short.into(), u32::MAX.into(), 0] {
                let product = i128::from(rate) * i128::from(ticks);
                proptest::prop_assert_eq!(advance(rate, ticks).0, (product >> 24) as i64);
            }
        }
    }
}
