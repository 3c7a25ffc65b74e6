//! An interval of numbers.

use crate::Real;
use crate::params::Range;

crate::params! {
    /// A closed interval.
    #[derive(Default)]
    pub struct Interval<T> {
        /// Lower end.
        low: T, "low" "" NONE, Range::ANY;
        /// Upper end.
        high: T, "high" "" NONE, Range::ANY;
    }
    relations(p) {
        /// A supervisor can work with the lower end.
        LOW_USABLE: low, "a finite number that the parameter may be";
        /// A supervisor can work with the upper end.
        HIGH_USABLE: high, "a finite number that the parameter may be";
    }
}

impl<T: Real> Interval<T> {
    /// `value · (1 ± share)`.
    pub(crate) fn around(value: T, share: T) -> Self {
        let (a, b) = (value * (T::ONE - share), value * (T::ONE + share));
        Interval { low: a.min(b), high: a.max(b) }
    }

    /// Largest magnitude.
    pub(crate) fn magnitude(self) -> T {
        self.low.abs().max(self.high.abs())
    }

    /// `low (1 − share) … high (1 + share)` of an interval of positive numbers.
    pub(crate) fn widened(self, share: T) -> Self {
        Interval { low: self.low * (T::ONE - share), high: self.high * (T::ONE + share) }
    }
}
