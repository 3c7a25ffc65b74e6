//! The arithmetic that laws, filter, output stage and friction need each tick: no more, so that a vector of
//! lanes can have it too.
//!
//! A scalar takes a branch where it is cheaper; a vector computes both sides and selects. Each lane of a
//! vector has the bits that the scalar has: nothing here is fused, and nothing is summed across lanes.

use crate::limit::Limit;
use core::fmt::Debug;
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// A scalar, or a vector of them, one for each run. `f32` and `f64` are; a vector can be declared anywhere.
pub trait Arithmetic:
    Copy
    + Default
    + Debug
    + PartialEq
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The result of a comparison: true or false for each lane.
    type Mask: Copy + BitAnd<Output = Self::Mask> + BitOr<Output = Self::Mask> + Not<Output = Self::Mask>;
    /// A [`Limit`] for each lane.
    type Limit: Copy + Debug + Default + PartialEq;

    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;

    /// The nearest value to `x`, in each lane.
    fn splat(x: f64) -> Self;
    /// `self < other`; false where one is NaN.
    fn less(self, other: Self) -> Self::Mask;
    /// `self ≤ other`; false where one is NaN.
    fn less_or_equal(self, other: Self) -> Self::Mask;
    /// `a` where the mask is true, `b` elsewhere.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// The same limit in each lane.
    fn limit_of(limit: Limit) -> Self::Limit;
    /// `a` where the mask is true, `b` elsewhere.
    fn select_limit(mask: Self::Mask, a: Self::Limit, b: Self::Limit) -> Self::Limit;
    /// True where something decided: the limit is not [`Limit::None`].
    fn decided(limit: Self::Limit) -> Self::Mask;
    /// `true` if the mask is true in every lane: work that no lane needs can be left out.
    fn all(mask: Self::Mask) -> bool;
    /// |self|.
    fn abs(self) -> Self;
    /// e to the power of −self for 0 ≤ self ≤ [`Real::EXP_NEG_MAX`](crate::Real::EXP_NEG_MAX); NaN for NaN. In
    /// `f32` the error is at most 1.5e-7, and 1.6e-7 (1 + self) of the value.
    ///
    /// Outside that range the result is not an exponential.
    fn exp_neg(self) -> Self;
    /// Square root; NaN for a negative argument.
    fn sqrt(self) -> Self;
    /// self to the power of `n`.
    fn powf(self, n: Self) -> Self;
    /// The larger of the two; the other one if one is NaN.
    fn max(self, other: Self) -> Self;
    /// The smaller of the two; the other one if one is NaN.
    fn min(self, other: Self) -> Self;
    /// `self` between `lo` and `hi`, which are numbers, and the nearer of them beyond; `lo` for NaN. Never panics.
    #[inline]
    fn limit(self, lo: Self, hi: Self) -> Self {
        self.max(lo).min(hi)
    }
    /// Neither infinite nor NaN.
    fn is_finite(self) -> Self::Mask;

    /// The result of `a` where the mask is true, that of `b` elsewhere. A scalar asks the one that it needs, a vector both.
    #[inline(always)]
    fn branch(mask: Self::Mask, a: impl FnOnce() -> Self, b: impl FnOnce() -> Self) -> Self {
        Self::select(mask, a(), b())
    }

    /// Puts what `value` gives into `to` where the mask is true. A scalar asks for it there alone.
    #[inline(always)]
    fn put_where(mask: Self::Mask, to: &mut Self, value: impl FnOnce() -> Self) {
        *to = Self::select(mask, value(), *to);
    }

    /// `self` between `lowest` and `highest`, the nearer of them beyond, `invalid` for NaN; and the limit that decided.
    #[inline]
    fn limited(self, lowest: Self, highest: Self, invalid: Self) -> (Self, Self::Limit) {
        let inside = lowest.less_or_equal(self) & self.less_or_equal(highest);
        // Most values are inside.
        if Self::all(inside) {
            return (self, Self::limit_of(Limit::None));
        }
        let (below, above) = (self.less(lowest), highest.less(self));
        let of = Self::limit_of;
        let value = Self::select(above, highest, Self::select(below, lowest, invalid));
        let limit = Self::select_limit(below, of(Limit::Lowest), of(Limit::Invalid));
        let limit = Self::select_limit(above, of(Limit::Highest), limit);
        (Self::select(inside, self, value), Self::select_limit(inside, of(Limit::None), limit))
    }

    /// The sign: −1, 0 or 1; `sgn(0) = 0`, and 0 for NaN.
    #[inline]
    fn sgn(self) -> Self {
        let below = Self::select(self.less(Self::ZERO), -Self::ONE, Self::ZERO);
        Self::select(Self::ZERO.less(self), Self::ONE, below)
    }

    /// `sat(self)` of (30): the identity between −1 and 1, the sign outside; 0 for NaN.
    #[inline]
    fn sat(self) -> Self {
        let inner = Self::select(self.less(Self::ONE), self, Self::ONE);
        let outer = Self::select(self.less_or_equal(-Self::ONE), -Self::ONE, Self::ZERO);
        Self::select((-Self::ONE).less(self), inner, outer)
    }
}

/// Makes a vector of what something of each lane has: `each(&|law| law.kp)` is the `kp` of the law of each lane.
pub type Each<'a, S, T, L> = &'a dyn Fn(&dyn Fn(&S) -> T) -> L;
