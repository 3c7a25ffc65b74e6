//! Intervals with outward rounding: each result holds the exact one.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// `low … high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// A number as it is.
pub(crate) fn at(x: f64) -> Interval {
    Interval { low: x, high: x }
}

/// The nearest number to each end lies within half a step of it, so the next one lies outside.
fn outward(low: f64, high: f64) -> Interval {
    Interval { low: low.next_down(), high: high.next_up() }
}

/// Sums and products with 0 are exact.
const ZERO: Interval = Interval { low: 0.0, high: 0.0 };

/// All that there is: of what is no number.
const ALL: Interval = Interval { low: f64::NEG_INFINITY, high: f64::INFINITY };

impl Interval {
    /// Without knowing which of some numbers is the least and which the greatest.
    fn hull(ends: [f64; 4]) -> Interval {
        // A number that is none makes the interval all there is.
        if ends.iter().any(|x| x.is_nan()) {
            return ALL;
        }
        outward(
            ends.into_iter().fold(f64::INFINITY, f64::min),
            ends.into_iter().fold(f64::NEG_INFINITY, f64::max),
        )
    }

    /// The interval widened by a share of its ends, for functions of the library that are not rounded as told.
    pub(crate) fn widened(self, share: f64) -> Interval {
        let off = |x: f64| x.abs() * share;
        outward(self.low - off(self.low), self.high + off(self.high))
    }

    /// As a number that is at most each of its own.
    pub(crate) fn least(self) -> Interval {
        at(self.low)
    }

    /// As a number that is at least each of its own.
    pub(crate) fn most(self) -> Interval {
        at(self.high)
    }

    /// An end is no number.
    fn is_none(self) -> bool {
        self.low.is_nan() || self.high.is_nan()
    }

    pub(crate) fn min(self, other: Interval) -> Interval {
        if self.is_none() || other.is_none() {
            return ALL;
        }
        Interval { low: self.low.min(other.low), high: self.high.min(other.high) }
    }

    pub(crate) fn max(self, other: Interval) -> Interval {
        if self.is_none() || other.is_none() {
            return ALL;
        }
        Interval { low: self.low.max(other.low), high: self.high.max(other.high) }
    }

    /// `[0, ∞)` of it.
    pub(crate) fn positive(self) -> Interval {
        self.max(at(0.0))
    }

    pub(crate) fn abs(self) -> Interval {
        let (a, b) = (self.low.abs(), self.high.abs());
        let low = if self.low <= 0.0 && self.high >= 0.0 { 0.0 } else { a.min(b) };
        Interval { low, high: a.max(b) }
    }
}

impl Add for Interval {
    type Output = Interval;
    fn add(self, o: Interval) -> Interval {
        if self == ZERO || o == ZERO {
            return if self == ZERO { o } else { self };
        }
        outward(self.low + o.low, self.high + o.high)
    }
}

impl Sub for Interval {
    type Output = Interval;
    fn sub(self, o: Interval) -> Interval {
        self + -o
    }
}

impl Neg for Interval {
    type Output = Interval;
    fn neg(self) -> Interval {
        Interval { low: -self.high, high: -self.low }
    }
}

impl Mul for Interval {
    type Output = Interval;
    fn mul(self, o: Interval) -> Interval {
        if self == ZERO || o == ZERO {
            return ZERO;
        }
        Interval::hull([self.low * o.low, self.low * o.high, self.high * o.low, self.high * o.high])
    }
}

impl Div for Interval {
    type Output = Interval;
    /// All there is if the divisor may be 0.
    fn div(self, o: Interval) -> Interval {
        if o.low <= 0.0 && o.high >= 0.0 {
            return ALL;
        }
        if self == ZERO {
            return ZERO;
        }
        Interval::hull([self.low / o.low, self.low / o.high, self.high / o.low, self.high / o.high])
    }
}
