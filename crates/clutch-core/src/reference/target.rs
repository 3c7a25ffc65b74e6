//! The point of a path at a tick.

use crate::{FixedCounts, Real};

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
