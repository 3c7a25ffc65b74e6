//! Many runs at once: eight of them in the lanes of a vector, each with the bits of its run alone.
//!
//! ```text
//! rows of a sweep ─► group (same law, same length, …) ─► block of chunks of eight lanes
//!     each period:  encoder ─► (5) ─► law ─► converter ─► linear motion          in lanes, every run
//!                                                     └─► quadrature, series     in lanes, the runs in the layer
//!                                                     └─► stops                  one by one
//! ```
//!
//! Arithmetic, law, output stage, actuator and the pieces of the exact flow are the very functions of one run, over
//! [`Lane`] instead of `f64`. Nothing is fused, and nothing is summed across lanes; each elementary function has the bits
//! of `libm`. A run that leaves what lanes can do (a position beyond ±2³⁰ counts, a number that is none) runs again alone.

mod block;
mod elementary;
mod group;
mod silence;
#[cfg(test)]
mod tests;
mod vector;

pub(crate) use group::run_all;

use clutch_core::Arithmetic;

/// A number, or a vector of them: what flow and figures need besides what laws need.
pub(crate) trait Lane: Arithmetic {
    /// Lanes.
    const WIDTH: usize;
    /// Magnitude of what asks an exponential, beyond which a motion goes on alone; 100 below where exponentials end here.
    const EXPONENT: f64;

    /// Does some work in a function of its own, by the same instructions: code that many call is there once.
    fn apart<R>(work: impl FnOnce() -> R) -> R;
    /// A vector of what each lane has.
    fn of(each: impl FnMut(usize) -> f64) -> Self;
    /// The number in a lane.
    fn lane(&self, i: usize) -> f64;
    /// Puts a number into a lane.
    fn put(&mut self, i: usize, x: f64);
    /// True if the mask is true in a lane.
    fn any(mask: Self::Mask) -> bool;
    /// The mask, lane `i` in bit `i`.
    fn bits(mask: Self::Mask) -> u64;
    /// Largest whole number not above self.
    fn floor(self) -> Self;
    /// e to the power of self, for |self| ≤ 700.
    fn exp(self) -> Self;
    /// e to the power of self, less 1, for |self| ≤ 700.
    fn expm1(self) -> Self;
    /// Natural logarithm of a positive normal number.
    fn log(self) -> Self;
    /// Natural logarithm of 1 + self, for self > −1.
    fn log1p(self) -> Self;
}

impl Lane for f64 {
    const WIDTH: usize = 1;
    const EXPONENT: f64 = f64::INFINITY;

    #[inline(always)]
    fn apart<R>(work: impl FnOnce() -> R) -> R {
        work()
    }
    #[inline]
    fn of(mut each: impl FnMut(usize) -> f64) -> f64 {
        each(0)
    }
    #[inline]
    fn lane(&self, _: usize) -> f64 {
        *self
    }
    #[inline]
    fn put(&mut self, _: usize, x: f64) {
        *self = x;
    }
    #[inline]
    fn any(mask: bool) -> bool {
        mask
    }
    #[inline]
    fn bits(mask: bool) -> u64 {
        mask.into()
    }
    #[inline]
    fn floor(self) -> f64 {
        libm::floor(self)
    }
    #[inline]
    fn exp(self) -> f64 {
        libm::exp(self)
    }
    #[inline]
    fn expm1(self) -> f64 {
        libm::expm1(self)
    }
    #[inline]
    fn log(self) -> f64 {
        libm::log(self)
    }
    #[inline]
    fn log1p(self) -> f64 {
        libm::log1p(self)
    }
}
