//! Friction along the disc, as an earlier ride has shown it.

use crate::{FixedCounts, Real};
use core::fmt;

/// Least friction in a map, over its mean.
const LEAST: f64 = 0.1;

/// Friction at points of the disc, at even distances: each a multiple of the mean, in parts of [`FrictionMap::ONE`].
/// Between the points it is a cubic (Catmull and Rom 1974).
///
/// ```
/// use clutch_core::{FixedCounts, FrictionMap};
/// // From count 100 on, each 4 counts.
/// let map = FrictionMap::new(100, 4, &[4096, 4096, 4506, 4096, 4096])?;
/// let place = map.at::<f64>(FixedCounts::from_counts(108));
/// assert!((place.friction(0.0) - 1.1).abs() < 1e-4);
/// assert!(!map.at::<f64>(FixedCounts::from_counts(90)).is_known());
/// # Ok::<(), clutch_core::NoMap>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrictionMap<'a> {
    first: i64,
    step: u32,
    factors: &'a [u16],
}

/// Points are none of a map.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoMap {
    /// There are so many, of at least four.
    Few(usize),
    /// They are so many counts apart, of 1 to [`FrictionMap::WIDEST`].
    Step(u32),
    /// The point of that number (from 0) is beyond a tenth of the mean, or ten times that.
    Factor(usize),
}

impl fmt::Display for NoMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NoMap::Few(n) => write!(f, "{n} points: expected four or more"),
            NoMap::Step(step) => {
                write!(f, "points {step} counts apart: expected 1 to {} counts", FrictionMap::WIDEST)
            }
            NoMap::Factor(n) => write!(f, "the factor of point {n}: expected 0.1 to 10"),
        }
    }
}

impl core::error::Error for NoMap {}

impl<'a> FrictionMap<'a> {
    /// The mean, as a factor.
    pub const ONE: u16 = 4096;
    /// Most counts from point to point.
    pub const WIDEST: u32 = 10_000;

    /// A map whose first point is at `first` counts, the others `step` counts apart.
    ///
    /// # Errors
    /// Fewer than four points; a step of 0 or above [`FrictionMap::WIDEST`]; a factor below a tenth, or above ten.
    pub fn new(first: i64, step: u32, factors: &'a [u16]) -> Result<Self, NoMap> {
        if factors.len() < 4 {
            return Err(NoMap::Few(factors.len()));
        }
        if step == 0 || step > FrictionMap::WIDEST {
            return Err(NoMap::Step(step));
        }
        let (least, most) = (FrictionMap::ONE / 10, FrictionMap::ONE * 10);
        match factors.iter().position(|factor| !(least..=most).contains(factor)) {
            Some(n) => Err(NoMap::Factor(n)),
            None => Ok(FrictionMap { first, step, factors }),
        }
    }

    /// Friction around a count; unknown before the second point and from the last but one on.
    #[must_use]
    pub fn at<T: Real>(&self, position: FixedCounts) -> Place<T> {
        let counts = (position.0 >> FixedCounts::FRACTION_BITS).wrapping_sub(self.first);
        let step = i64::from(self.step);
        let (cell, within) = (counts.checked_div_euclid(step), counts.checked_rem_euclid(step));
        let before = cell.and_then(|cell| usize::try_from(cell.wrapping_sub(1)).ok());
        let Some([a, b, c, d]) = before.and_then(|i| self.factors.get(i..)?.first_chunk::<4>()) else {
            return Place::default();
        };
        let per_one = T::ONE / T::from_i32(i32::from(FrictionMap::ONE));
        let [a, b, c, d] = [*a, *b, *c, *d].map(|factor| T::from_i32(i32::from(factor)) * per_one);
        let per_step = T::ONE / T::from_u64(u64::from(self.step));
        let u = T::from_i64(within.unwrap_or(0)) * per_step;
        let (half, two, three) = (T::splat(0.5), T::splat(2.0), T::splat(3.0));
        let c1 = c - a;
        let c2 = two * a - T::splat(5.0) * b + T::splat(4.0) * c - d;
        let c3 = three * (b - c) + (d - a);
        Place {
            factor: (b + half * u * (c1 + u * (c2 + u * c3))).max(T::splat(LEAST)),
            slope: half * per_step * (c1 + u * (two * c2 + three * u * c3)),
            bend: per_step * per_step * (c2 + three * u * c3),
            reach: T::from_u64(u64::from(self.step)),
        }
    }
}

/// The place at any position of a disc of which there is no map.
#[inline]
#[must_use]
pub fn off_map<T: Real>(position: FixedCounts) -> Place<T> {
    let _ = position;
    Place::default()
}

/// Friction around the lower edge of a count, over its mean along the disc. `Default`: nobody knows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place<T> {
    factor: T,
    /// Per count.
    slope: T,
    /// Per count².
    bend: T,
    /// Counts to which this holds.
    reach: T,
}

impl<T: Real> Place<T> {
    /// `true` if friction is known here.
    #[inline]
    #[must_use]
    pub fn is_known(&self) -> bool {
        self.factor > T::ZERO
    }

    /// Friction so many counts above the edge, over its mean; beyond the reach of the place, as at its end.
    #[inline]
    #[must_use]
    pub fn friction(&self, counts: T) -> T {
        let away = counts.limit(-self.reach, self.reach);
        // A cubic swings beyond its points; friction stays one, by which a law divides.
        (self.factor + away * (self.slope + T::splat(0.5) * away * self.bend)).max(T::splat(LEAST))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(first: i64, step: u32, n: u32) -> impl Iterator<Item = u16> {
        (0..n).map(move |i| {
            let counts = first as f64 + f64::from(i * step);
            let factor = 1.0 + 0.15 * libm::sin(0.107 * counts);
            (factor * 4096.0).round() as u16
        })
    }

    #[test]
    fn between_points_a_wave_is_what_it_was() {
        let factors: std::vec::Vec<u16> = wave(-37, 4, 100).collect();
        let map = FrictionMap::new(-37, 4, &factors).unwrap();
        for counts in -33..=354_i64 {
            let place = map.at::<f64>(FixedCounts::from_counts(counts));
            for away in [-1.0, 0.0, 0.5, 1.0, 2.0] {
                let truth = 1.0 + 0.15 * libm::sin(0.107 * (counts as f64 + away));
                let error = place.friction(away) - truth;
                assert!(error.abs() < 2.5e-3, "{error} at {counts} and {away}");
            }
        }
    }

    #[test]
    fn nothing_is_known_beyond_the_ends() {
        let map = FrictionMap::new(100, 4, &[4096; 5]).unwrap();
        let known = |counts| map.at::<f32>(FixedCounts::from_counts(counts)).is_known();
        let of: std::vec::Vec<i64> = (0..200).filter(|&counts| known(counts)).collect();
        assert_eq!(of, (104..112).collect::<std::vec::Vec<_>>());
        assert!(!known(i64::MAX >> 16) && !known(i64::MIN >> 16));
    }

    #[test]
    fn far_from_a_place_its_curve_is_not_followed() {
        let map = FrictionMap::new(0, 4, &[4096, 4096, 5000, 7000, 9000]).unwrap();
        let place = map.at::<f64>(FixedCounts::from_counts(5));
        assert_eq!(place.friction(1e9), place.friction(4.0));
    }

    proptest::proptest! {
        #[test]
        fn friction_is_known_and_positive_between_any_points(
            first in -1_i64 << 40..1 << 40, step in 1_u32..=10_000, factors in proptest::collection::vec(409_u16..=40_960, 4..30),
            at: i64, away in -1e5_f64..1e5,
        ) {
            let map = FrictionMap::new(first, step, &factors).unwrap();
            let last = (factors.len() as i64 - 2) * i64::from(step);
            for counts in [at, first.wrapping_add(at.rem_euclid(last + i64::from(step)))] {
                let place = map.at::<f64>(FixedCounts::from_counts(counts));
                let within = counts.wrapping_sub(first);
                proptest::prop_assert_eq!(place.is_known(), (i64::from(step)..last).contains(&within) || place.is_known() && counts != (counts << 16) >> 16);
                proptest::prop_assert!(!place.is_known() || place.friction(away) >= 0.1);
            }
        }
    }

    #[test]
    fn points_that_are_none_of_a_map_are_refused() {
        let of = |step, factors: &[u16]| FrictionMap::new(0, step, factors).unwrap_err().to_string();
        use std::string::ToString;
        assert_eq!(of(4, &[4096; 3]), "3 points: expected four or more");
        assert_eq!(of(0, &[4096; 4]), "points 0 counts apart: expected 1 to 10000 counts");
        assert_eq!(of(10_001, &[4096; 4]), "points 10001 counts apart: expected 1 to 10000 counts");
        assert_eq!(of(4, &[4096, 4096, 0, 4096]), "the factor of point 2: expected 0.1 to 10");
    }
}
