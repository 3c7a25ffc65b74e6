//! Planned paths: where the shaft shall be at each tick, with velocity and acceleration.
//!
//! Positions are fixed-point counts (2⁻¹⁶ count, 64 bit) and depend on the tick's number, not
//! on a sum over ticks: a ramp is as exact after a month as after a second. Velocity and
//! acceleration are the analytic derivatives, in rad/s and rad/s². In `f32` a path stays within
//! 2e-6 of its way of the one in `f64`; straight lines of a table agree to the last bit.
//!
//! | reference | velocity | acceleration |
//! |---|---|---|
//! | hold | 0 | 0 |
//! | ramp | jumps at the start | 0 |
//! | trapezoid | continuous | jumps |
//! | jerk-limited | continuous | continuous, jerk bounded |
//! | minimum jerk | continuous | continuous (Flash and Hogan 1985) |
//! | sine, chirp | continuous; may jump at the start | continuous; jumps at a chirp's end |
//! | table, linear | jumps at knots | 0 |
//! | table, cubic | continuous | jumps at knots; never overshoots (Fritsch and Butland 1984) |

mod profile;
mod table;
#[cfg(test)]
mod tests;
mod wave;

pub use profile::{JerkLimited, MinimumJerk, Trapezoid};
pub use table::{Interpolation, Knot, Prepared, Steepness, Table};
pub use wave::{Chirp, Sine};

use crate::params::{Range, Table as _};
use crate::{Encoder, FixedCounts, Micros, ParamError, Real};
use profile::Profile;
use wave::Wave;

/// The point of the path at which the shaft shall be now.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Target<T> {
    /// `θ_d`, in 2⁻¹⁶ counts from the encoder's zero.
    pub position: FixedCounts,
    /// `θ̇_d`, rad/s.
    pub velocity: T,
    /// `θ̈_d`, rad/s².
    pub acceleration: T,
}

impl<T: Real> Target<T> {
    /// The same in another scalar, velocity and acceleration rounded to the nearest.
    #[must_use]
    pub fn cast<U: Real>(&self) -> Target<U> {
        let to = |x: T| U::from_f64(x.to_f64());
        Target { position: self.position, velocity: to(self.velocity), acceleration: to(self.acceleration) }
    }
}

crate::params! {
    /// Constant rate from the first tick: the paper's path.
    pub struct Ramp<T> {
        /// Rate, to which the velocity jumps at the start. A brake follows only the sign of its drive.
        rate: T, "rate_deg_s" "" DEG_S, Range::ANY;
    }
    relations(p) {
        /// Counts hold the rate.
        RATE: rate, "a finite rate below 4e6 counts of rig.encoder.counts_per_rev per sampling.period_us, °/s";
    }
}

crate::choice! {
    /// Planned path of the shaft.
    pub enum ReferenceParams<'a, T> {
        /// Stays at the start.
        Hold = "hold",
        /// Constant rate from the first tick.
        Ramp(Ramp<T>) = "ramp",
        /// Rest to rest with bounded velocity and acceleration.
        Trapezoid(Trapezoid<T>) = "trapezoid",
        /// Rest to rest with bounded velocity, acceleration and jerk.
        JerkLimited(JerkLimited<T>) = "jerk_limited",
        /// Rest to rest with the least jerk over a given time.
        MinimumJerk(MinimumJerk<T>) = "minimum_jerk",
        /// A sine on a ramp.
        Sine(Sine<T>) = "sine",
        /// A sine of rising or falling frequency on a ramp.
        Chirp(Chirp<T>) = "chirp",
        /// Points in time.
        Table(Table<'a>) = "table",
    }
}

impl<T> ReferenceParams<'_, T> {
    /// A ramp of this rate, rad/s.
    #[must_use]
    pub const fn ramp(rate: T) -> Self {
        ReferenceParams::Ramp(Ramp { rate })
    }
}

/// A checked path.
///
/// ```
/// use clutch_core::{Encoder, FixedCounts, Micros, reference::{Reference, ReferenceParams}};
/// let two_deg_s = 2.0_f64.to_radians();
/// let ramp = Reference::new(&ReferenceParams::ramp(two_deg_s), FixedCounts(0), Encoder::PAPER, Micros(1000))?;
/// let after_9_s = ramp.at(9_000); // 18° are 1000 counts
/// assert!((after_9_s.position.0 - (1000 << 16)).abs() <= 1);
/// assert_eq!(after_9_s.velocity, two_deg_s);
/// # Ok::<(), clutch_core::ParamError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference<'a, T> {
    kind: Kind<'a, T>,
    start: FixedCounts,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind<'a, T> {
    Profile(Profile<T>),
    Wave(Wave<T>),
    Table(Table<'a>, table::Scale<T>),
}

impl<'a, T: Real> Reference<'a, T> {
    /// A path from `start`, the position at tick 0.
    ///
    /// # Errors
    /// The first parameter out of range, by name.
    pub fn new(
        p: &ReferenceParams<'a, T>,
        start: FixedCounts,
        encoder: Encoder,
        period: Micros,
    ) -> Result<Self, ParamError<T>> {
        let seconds = period.period::<T>()?;
        let scale = Scale { counts_per_radian: encoder.counts_per_radian(), period: seconds };
        let kind = match p {
            ReferenceParams::Hold => Kind::Profile(Profile::ramp(T::ZERO, scale)),
            ReferenceParams::Ramp(p) => {
                p.check_rows()?;
                Kind::Profile(Profile::ramp(Ramp::RATE.require(p.rate, scale.holds_rate(p.rate))?, scale))
            }
            ReferenceParams::Trapezoid(p) => Kind::Profile(Profile::trapezoid(p, scale)?),
            ReferenceParams::JerkLimited(p) => Kind::Profile(Profile::jerk_limited(p, scale)?),
            ReferenceParams::MinimumJerk(p) => Kind::Profile(Profile::minimum_jerk(p, scale)?),
            ReferenceParams::Sine(p) => Kind::Wave(Wave::sine(p, scale)?),
            ReferenceParams::Chirp(p) => Kind::Wave(Wave::chirp(p, scale)?),
            ReferenceParams::Table(table) => {
                table.check_points()?;
                Kind::Table(*table, table::Scale::new(encoder, period))
            }
        };
        Ok(Reference { kind, start })
    }

    /// The target at a tick.
    #[must_use]
    pub fn at(&self, tick: u64) -> Target<T> {
        let target = match &self.kind {
            Kind::Profile(p) => p.at(tick),
            Kind::Wave(w) => w.at(tick),
            Kind::Table(t, scale) => t.scaled(tick, scale),
        };
        Target { position: target.position.plus(self.start), ..target }
    }
}

/// Factors that turn radians and seconds into counts and ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scale<T> {
    counts_per_radian: T,
    /// s
    period: T,
}

/// Fractional bits of a rate in counts per tick: half of 2⁻⁴⁰ count per tick is 0.0012 counts
/// in 30 days at 1 kHz.
const RATE_BITS: u32 = 40;

impl<T: Real> Scale<T> {
    /// rad/s to the nearest multiple of 2⁻⁴⁰ counts per tick.
    fn rate(&self, radians_per_second: T) -> i64 {
        let counts_per_tick = radians_per_second * self.counts_per_radian * self.period;
        (counts_per_tick * T::from_i64(1 << RATE_BITS) + T::from_f64(0.5)).floor().to_i64()
    }

    /// A small distance in radians to fixed-point counts.
    fn distance(&self, radians: T) -> FixedCounts {
        FixedCounts::from_real(radians * self.counts_per_radian)
    }

    fn seconds(&self, ticks: u64) -> T {
        T::from_u64(ticks) * self.period
    }

    /// 2⁻⁴⁰ counts per tick in 64 bits hold a rate, rad/s.
    fn holds_rate(&self, rate: T) -> bool {
        (rate * self.counts_per_radian * self.period).abs() < T::from_i32(4_000_000)
    }

    /// Fixed-point counts hold a distance, rad.
    fn holds_distance(&self, distance: T) -> bool {
        (distance * self.counts_per_radian).abs() < T::from_f64(1e12)
    }

    /// Ticks count a time, s; not if it is NaN.
    fn counts_time(&self, time: T) -> bool {
        time < self.period * T::from_f64(1e15)
    }

    /// Samples see a frequency, Hz.
    fn samples(&self, frequency: T) -> bool {
        frequency * self.period < T::from_f64(0.5)
    }
}

/// `rate · ticks`, exact.
#[inline]
fn advance(rate: i64, ticks: u64) -> FixedCounts {
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
mod advance_tests {
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
