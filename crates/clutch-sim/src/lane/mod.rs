//! Numbers of one run, or of several side by side.

pub(crate) mod elementary;
mod scalar;
pub(crate) mod vector;

use clutch_core::Arithmetic;

/// Lanes of the widest vector.
pub(crate) const MOST_LANES: usize = 8;

/// A number, or a vector of them: what flow and figures need besides what laws need.
pub(crate) trait Lane: Arithmetic<Mask: Send + Sync> + Send + Sync {
    /// Lanes, at most [`MOST_LANES`].
    const WIDTH: usize;

    /// Does some work in a function of its own, by the same instructions: code that many call is there once.
    fn apart<R>(work: impl FnOnce() -> R) -> R;
    /// A vector of what each lane has.
    fn of(each: impl FnMut(usize) -> f64) -> Self;
    /// The number in a lane.
    fn lane(&self, i: usize) -> f64;
    /// Puts a number into a lane.
    fn put(&mut self, i: usize, x: f64);
    /// Puts all lanes into as many numbers.
    fn store(self, to: &mut [f64]);
    /// True if the mask is true in a lane.
    fn any(mask: Self::Mask) -> bool;
    /// The mask, lane `i` in bit `i`.
    fn bits(mask: Self::Mask) -> u64;
    /// Lanes in which both are one number; NaN is none.
    #[inline(always)]
    fn same(a: Self, b: Self) -> Self::Mask {
        a.less_or_equal(b) & b.less_or_equal(a)
    }
    /// A mask that is true in no lane.
    #[inline(always)]
    fn none() -> Self::Mask {
        Self::ZERO.less(Self::ZERO)
    }
    /// Largest whole number not above self.
    fn floor(self) -> Self;
    /// e to the power of self, for |self| ≤ 700.
    fn exp(self) -> Self;
    /// Natural logarithm of a positive normal number.
    fn log(self) -> Self;
    /// e to the power of self, to 3e-14 of it, for |self| ≤ 700.
    fn near_exp(self) -> Self;
    /// e to the power of self, less 1, to 3e-14 of it, for |self| ≤ 700.
    fn near_expm1(self) -> Self;
    /// Natural logarithm of 1 + self, to 3e-14 of it, for self > −1.
    fn near_log1p(self) -> Self;
    /// Sine.
    #[inline(always)]
    fn sin(self) -> Self {
        self.sincos().0
    }
    /// Sine and cosine.
    fn sincos(self) -> (Self, Self);
    /// e to the power of minus each, less 1, as [`Lane::near_expm1`] has it.
    #[inline(always)]
    fn near_falls<const N: usize>(mut all: [Self; N]) -> [Self; N] {
        for x in &mut all {
            *x = (-*x).near_expm1();
        }
        all
    }
}

/// Does something for each lane whose bit is set.
#[inline(always)]
pub(crate) fn each(mut bits: u64, mut lane: impl FnMut(usize)) {
    while bits != 0 {
        lane(bits.trailing_zeros() as usize);
        bits &= bits - 1;
    }
}
