//! Values that a parameter may have.

use super::{Kind, Unit};
use crate::Real;
use core::fmt;

/// The values that a number may have, in the unit of its key. Infinities and NaN are never among them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Lower end.
    pub low: f64,
    /// `true` if the lower end itself is taken.
    pub low_in: bool,
    /// Upper end.
    pub high: f64,
    /// `true` if the upper end itself is taken.
    pub high_in: bool,
    /// `true` if the code divides by the value, so that its inverse has to be finite too.
    pub divides: bool,
}

impl Range {
    /// Any finite number.
    pub const ANY: Range =
        Range { low: f64::NEG_INFINITY, low_in: false, high: f64::INFINITY, high_in: false, divides: false };

    /// `low` or more.
    #[must_use]
    pub const fn at_least(low: f64) -> Range {
        Range { low, low_in: true, ..Range::ANY }
    }

    /// More than `low`.
    #[must_use]
    pub const fn above(low: f64) -> Range {
        Range { low, ..Range::ANY }
    }

    /// More than 0, and large enough to divide by.
    #[must_use]
    pub const fn divisor() -> Range {
        Range { low: 0.0, divides: true, ..Range::ANY }
    }

    /// `low` to `high`, both taken.
    #[must_use]
    pub const fn within(low: f64, high: f64) -> Range {
        Range { low, low_in: true, high, high_in: true, divides: false }
    }

    /// This range without numbers above `high`.
    #[must_use]
    pub const fn up_to(self, high: f64) -> Range {
        Range { high, high_in: true, ..self }
    }

    /// This range without `high` and the numbers above it.
    #[must_use]
    pub const fn below(self, high: f64) -> Range {
        Range { high, high_in: false, ..self }
    }

    /// `true` if a number, in SI, is within the range, whose ends are in `unit`.
    // Always inlined: range and unit are constants, whose doubles a board without them had better not compute with.
    #[allow(clippy::inline_always, reason = "see above")]
    #[inline(always)]
    pub fn holds<T: Real>(&self, unit: &Unit, x: T) -> bool {
        let (low, high) = (T::from_f64(unit.to_si(self.low)), T::from_f64(unit.to_si(self.high)));
        within(x, low, high, (self.low_in, self.high_in, self.divides))
    }

    /// `true` if a whole number is within the range, whose ends are whole numbers or infinite.
    #[allow(clippy::inline_always, reason = "as above")]
    #[inline(always)]
    pub fn holds_whole(&self, n: u64) -> bool {
        let (low, high) = (self.low as u64, self.high as u64);
        (self.low < 0.0 || n > low || (self.low_in && n == low))
            && (self.high == f64::INFINITY || n < high || (self.high_in && n == high))
    }

    /// The range in words, in the unit of the key or in that of the struct (`si`).
    #[must_use]
    pub fn words(&self, kind: Kind, unit: &Unit, si: bool) -> Words {
        Words { range: *self, kind, unit: *unit, si }
    }
}

/// A range's answer, whose ends are taken or not.
// A function of its own: a board has its code once, and not for each of its parameters.
#[inline(never)]
fn within<T: Real>(x: T, low: T, high: T, (low_in, high_in, divides): (bool, bool, bool)) -> bool {
    x.is_finite()
        && (x > low || (low_in && x == low))
        && (x < high || (high_in && x == high))
        && (!divides || (T::ONE / x).is_finite())
}

/// A [`Range`] in words: `a finite number of at least 0 V/rad`.
#[derive(Clone, Copy, Debug)]
pub struct Words {
    range: Range,
    kind: Kind,
    unit: Unit,
    si: bool,
}

impl fmt::Display for Words {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Words { range, kind, unit, si } = self;
        let end = |x: f64| if *si { unit.to_si(x) } else { x };
        let (low, high) = (end(range.low), end(range.high));
        let (has_low, has_high) = (low.is_finite(), high.is_finite());
        let text = if *si { unit.si } else { unit.text };
        let what = match kind {
            Kind::Real => "number",
            Kind::Whole => "whole number",
            Kind::Switch => return f.write_str("true or false"),
            Kind::Text => {
                return f.write_str("a text in quotes, without line breaks and other control characters");
            }
            Kind::Points => {
                write!(f, "a list of at least one pair [{text}] of finite numbers, with ")?;
                let (of, unit) = if text.starts_with('s') { ("times", "s") } else { ("angles", "°") };
                write!(f, "{of} that rise")?;
                // Beyond a million of either nobody asks.
                return match (has_low, has_high && high < 1e6) {
                    (true, true) => write!(f, " from {low} to {high} {unit}"),
                    (true, false) => write!(f, " from {low} {unit} on"),
                    _ => Ok(()),
                };
            }
            Kind::Word(words) => {
                f.write_str("one of: ")?;
                for (i, word) in words.iter().enumerate() {
                    write!(f, "{}{}", if i > 0 { ", " } else { "" }, word.name)?;
                }
                return Ok(());
            }
        };
        let whole = matches!(kind, Kind::Whole);
        // A range with two ends needs no "finite"; a whole number is.
        let finite = if whole || (has_low && has_high) { "" } else { "finite " };
        write!(f, "a {finite}{what}")?;
        match (has_low, has_high) {
            (true, true) if range.low_in && range.high_in => {
                write!(f, " from {} to {}", Grouped(low), Grouped(high))?;
            }
            _ => {
                if has_low {
                    let from = if range.low_in { " of at least" } else { " above" };
                    write!(f, "{from} {}", Grouped(low))?;
                }
                if has_high {
                    let and = if has_low { " and" } else { "" };
                    let to = if range.high_in { " at most" } else { " below" };
                    write!(f, "{and}{to} {}", Grouped(high))?;
                }
            }
        }
        match (text.is_empty(), has_low || has_high) {
            (true, _) => {}
            (false, true) => write!(f, " {text}")?,
            (false, false) => write!(f, ", {text}")?,
        }
        if range.divides { f.write_str(" whose inverse is finite, too") } else { Ok(()) }
    }
}

/// A number whose digits are grouped in threes, if it is a long whole one.
struct Grouped(f64);

impl fmt::Display for Grouped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n = self.0.abs();
        if !(1e4..1e15).contains(&n) || n % 1.0 > 0.0 {
            // The largest whole number of a file is no number of 53 bits.
            return if n == 9_223_372_036_854_775_808.0 { i64::MAX.fmt(f) } else { self.0.fmt(f) };
        }
        if self.0 < 0.0 {
            f.write_str("-")?;
        }
        let (n, mut unit) = (n as u64, 1_000_000_000_000_u64);
        let mut begun = false;
        while unit > 0 {
            let group = n / unit % 1000;
            match (begun, group) {
                (false, 0) => {}
                (false, _) => write!(f, "{group}")?,
                (true, _) => write!(f, " {group:03}")?,
            }
            begun |= group > 0;
            unit /= 1000;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::{CYCLES, DEG, NONE, V, V_RAD};
    use std::string::ToString;

    #[test]
    fn a_range_in_words_has_its_ends_and_its_unit() {
        let real = |range: Range, unit: &Unit| range.words(Kind::Real, unit, false).to_string();
        assert_eq!(real(Range::ANY, &V), "a finite number, V");
        assert_eq!(real(Range::at_least(0.0), &V_RAD), "a finite number of at least 0 V/rad");
        assert_eq!(real(Range::above(0.0).up_to(1.0), &NONE), "a number above 0 and at most 1");
        assert_eq!(real(Range::divisor(), &V), "a finite number above 0 V whose inverse is finite, too");
        let whole = Range::within(2.0, 16_777_216.0).words(Kind::Whole, &CYCLES, false);
        assert_eq!(whole.to_string(), "a whole number from 2 to 16 777 216 periods");
    }

    #[test]
    fn ends_are_in_the_unit_of_the_key() {
        let range = Range::within(-90.0, 90.0);
        assert!(range.holds(&DEG, 1.5_f64) && !range.holds(&DEG, 1.6_f64));
        assert!(!range.holds(&DEG, f64::NAN) && !Range::ANY.holds(&DEG, f64::INFINITY));
    }
}
