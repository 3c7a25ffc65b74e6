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

mod one_kind;
mod profile;
mod scale;
mod table;
mod target;
#[cfg(test)]
mod tests;
mod wave;

pub use one_kind::OneKind;
pub use profile::{JerkLimited, MinimumJerk, Profile, Ramp, Trapezoid};
pub use table::{Interpolation, Knot, Prepared, Steepness, Table, Tabulated};
pub use target::Target;
pub use wave::{Chirp, Sine, Wave};

use crate::{Encoder, FixedCounts, Micros, ParamError, Real};
use scale::Scale;

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
    Table(Tabulated<'a, T>),
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
        let scale = Scale::new(encoder, period)?;
        let kind = match p {
            ReferenceParams::Hold => Kind::Profile(Profile::at_rate(T::ZERO, scale)),
            ReferenceParams::Ramp(p) => Kind::Profile(Profile::ramp(p, scale)?),
            ReferenceParams::Trapezoid(p) => Kind::Profile(Profile::trapezoid(p, scale)?),
            ReferenceParams::JerkLimited(p) => Kind::Profile(Profile::jerk_limited(p, scale)?),
            ReferenceParams::MinimumJerk(p) => Kind::Profile(Profile::minimum_jerk(p, scale)?),
            ReferenceParams::Sine(p) => Kind::Wave(Wave::sine(p, scale)?),
            ReferenceParams::Chirp(p) => Kind::Wave(Wave::chirp(p, scale)?),
            ReferenceParams::Table(p) => Kind::Table(Tabulated::new(p, encoder, period)?),
        };
        Ok(Reference { kind, start })
    }

    /// The target at a tick.
    #[must_use]
    pub fn at(&self, tick: u64) -> Target<T> {
        let target = match &self.kind {
            Kind::Profile(p) => p.at(tick),
            Kind::Wave(w) => w.at(tick),
            Kind::Table(t) => t.at(tick),
        };
        Target { position: target.position.plus(self.start), ..target }
    }
}
