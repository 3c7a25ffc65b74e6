//! A path through points in time.

use super::target::Target;
use crate::params::{self, Editor, Kind, Leaf, Range, Unit};
use crate::{Encoder, FixedCounts, Micros, ParamError, Planned, Real};

/// A point of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)] // C has it, too: clutch-c
pub struct Knot {
    /// Time from the start, µs.
    pub time_us: u64,
    /// Position relative to the start.
    pub position: FixedCounts,
}

crate::words! {
    /// Curve from point to point.
    pub enum Interpolation {
        /// Straight lines: the velocity jumps at each point.
        Linear = "linear",
        /// Monotone cubics (Fritsch and Butland 1984): the velocity is continuous and a rising table never runs
        /// backwards, which a brake could not follow.
        Cubic = "cubic" default,
    }
}

crate::params! {
    /// Points in time. Before the first point the path rests there, after the last too.
    pub struct Table<'a> {
        /// Points of time and angle, from the start; times rise. A brake follows only angles that do not fall.
        knots: &'a [Knot], "points_s_deg" "" S_DEG, Range::at_least(0.0).below(1e12);
        /// Curve from point to point.
        interpolation: Interpolation = "cubic", "interpolation" "" NONE, Range::ANY;
    }
    relations(p) {
        /// There is a path.
        NOT_EMPTY: knots, "at least one point";
        /// Time goes on.
        RISING: knots, "times of at least 0 s that rise from point to point";
        /// Counts hold the points.
        HELD: knots, "positions below 7e13 counts of rig.encoder.counts_per_rev";
    }
}

impl<'a, T: Real> Leaf<T> for &'a [Knot] {
    const KIND: Kind = Kind::Points;
    type Literal = ();
    type As<U: Real> = &'a [Knot];

    fn of((): (), _: &Unit) -> Self {
        &[]
    }
    fn blank() -> Self {
        &[]
    }
    fn edit<P: params::Table<T>, E: Editor<T>>(&mut self, row: usize, editor: &mut E) {
        editor.other::<P>(row, None);
    }
    fn number(&self) -> T {
        T::from_u64(self.len() as u64)
    }
    fn outside(&self, _: &Range, _: &Unit) -> Option<T> {
        None
    }
    fn cast<U: Real>(&self) -> Self {
        self
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Scale<T> {
    radians_per_count: T,
    period_us: u64,
}

impl<T: Real> Scale<T> {
    fn new(encoder: Encoder, period: Micros) -> Self {
        Scale { radians_per_count: encoder.radians_per_count(), period_us: u64::from(period.0) }
    }
}

/// A checked path through points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tabulated<'a, T> {
    table: Table<'a>,
    scale: Scale<T>,
}

impl<'a, T: Real> Tabulated<'a, T> {
    pub(super) fn new(table: &Table<'a>, encoder: Encoder, period: Micros) -> Result<Self, ParamError<T>> {
        table.check_points()?;
        Ok(Tabulated { table: *table, scale: Scale::new(encoder, period) })
    }

    pub(super) fn at(&self, tick: u64) -> Target<T> {
        self.table.scaled(tick, &self.scale)
    }
}

impl<T: Real> Planned<T> for Tabulated<'_, T> {
    #[inline]
    fn target(&self, tick: u64) -> Target<T> {
        self.at(tick)
    }
}

/// One interval between points.
#[derive(Clone, Copy)]
struct Interval<T> {
    length_us: u64,
    rise: FixedCounts,
    /// s
    length: T,
}

impl<T: Real> Interval<T> {
    /// Counts per second.
    fn slope(&self) -> T {
        self.rise.minus::<T>(FixedCounts(0)) / self.length
    }

    /// The rise within the first `us` of the interval along a straight line; exact but for the
    /// rounding down.
    fn along(&self, us: u64) -> FixedCounts {
        let product = i128::from(self.rise.0).wrapping_mul(i128::from(us));
        FixedCounts(product.checked_div_euclid(i128::from(self.length_us)).unwrap_or(0) as i64)
    }

    /// The same without a division.
    fn along_at(&self, us: u64, rate: Steepness) -> FixedCounts {
        let (us, length) = (u128::from(us), u128::from(self.length_us));
        let (high, low) = (rate.0 >> 64, rate.0 & u128::from(u64::MAX));
        // This is the quotient of a number rounded down, or one less.
        let least = us.wrapping_mul(high).wrapping_add(us.wrapping_mul(low) >> 64);
        let rest =
            us.wrapping_mul(u128::from(self.rise.0.unsigned_abs())).wrapping_sub(least.wrapping_mul(length));
        let more = rest >= length;
        let whole = (least as i64).wrapping_add(i64::from(more));
        let exact = rest == if more { length } else { 0 };
        FixedCounts(if self.rise.0 < 0 {
            whole.wrapping_neg().wrapping_sub(i64::from(!exact))
        } else {
            whole
        })
    }
}

/// The rise of a table's interval for each µs, without its sign, in 2⁻⁶⁴ of a position's unit; rounded down. Computed
/// before a run, it saves a board the division of 128 bits in each period.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Steepness(u128);

/// Numbers for a table's targets, where each point's share of them was computed before a run.
#[derive(Clone, Copy, Debug)]
pub struct Prepared<'a, T> {
    /// [`Table::steepness`] of each point.
    pub steepness: &'a [Steepness],
    /// [`Table::slope`] of each point.
    pub slopes: &'a [T],
}

impl<'a> Table<'a> {
    /// The same: points are whole numbers.
    #[must_use]
    pub fn cast(&self) -> Table<'a> {
        *self
    }

    /// Checks the points; the value of an error is the number (from 0) of the point.
    fn check_points<T: Real>(&self) -> Result<(), ParamError<T>> {
        Table::NOT_EMPTY.require(T::ZERO, !self.knots.is_empty())?;
        let rising = |w: &[Knot]| matches!(w, [a, b] if a.time_us < b.time_us);
        if let Some(i) = self.knots.windows(2).position(|w| !rising(w)) {
            return Err(Table::RISING.error(T::from_u64(i as u64 + 1)));
        }
        // So that no difference between two points overflows.
        match self.knots.iter().position(|k| k.position.0.unsigned_abs() >= 1 << 62) {
            None => Ok(()),
            Some(i) => Err(Table::HELD.error(T::from_u64(i as u64))),
        }
    }

    fn interval<T: Real>(&self, first: usize) -> Option<Interval<T>> {
        let (a, b) = (self.knots.get(first)?, self.knots.get(first.checked_add(1)?)?);
        let length_us = b.time_us.wrapping_sub(a.time_us);
        let rise = FixedCounts(b.position.0.wrapping_sub(a.position.0));
        Some(Interval { length_us, rise, length: T::from_u64(length_us) / T::from_i32(1_000_000) })
    }

    /// The slope at a point, counts/s: a weighted harmonic mean of both sides; 0 at an extremum
    /// and at the ends, where the path comes from rest and goes to rest.
    #[must_use]
    pub fn slope<T: Real>(&self, at: usize) -> T {
        let before = at.checked_sub(1).and_then(|i| self.interval::<T>(i));
        match (before, self.interval::<T>(at)) {
            (Some(l), Some(r)) => {
                let (dl, dr) = (l.slope(), r.slope());
                if dl * dr <= T::ZERO {
                    return T::ZERO;
                }
                let two = T::from_i32(2);
                let (wl, wr) = (two * r.length + l.length, r.length + two * l.length);
                (wl + wr) / (wl / dl + wr / dr)
            }
            _ => T::ZERO,
        }
    }

    /// The target at a tick, from the first point's zero on. For who keeps the points apart from a
    /// [`super::Reference`]; it checks nothing, and of points that no reference takes it makes some target.
    #[must_use]
    pub fn at<T: Real>(&self, tick: u64, encoder: Encoder, period: Micros) -> Target<T> {
        self.scaled(tick, &Scale::new(encoder, period))
    }

    /// The steepness of the interval behind a point; 0 behind the last.
    #[must_use]
    pub fn steepness(&self, point: usize) -> Steepness {
        // The intervals are the same in any scalar.
        let Some(Interval { rise, length_us, .. }) = self.interval::<f32>(point) else {
            return Steepness::default();
        };
        let rise = rise.0.unsigned_abs();
        let whole = rise.checked_div(length_us).unwrap_or(0);
        let (mut rest, mut part) = (rise.wrapping_sub(whole.wrapping_mul(length_us)), 0_u64);
        // Bit by bit: a board has no division of 128 bits, and one for it alone takes 8 kB.
        for _ in 0..64 {
            let carry = rest >> 63 != 0;
            (rest, part) = (rest << 1, part << 1);
            if carry || rest >= length_us {
                (rest, part) = (rest.wrapping_sub(length_us), part | 1);
            }
        }
        Steepness(u128::from(whole) << 64 | u128::from(part))
    }

    /// [`Table::at`] for who has prepared each point.
    // A function of its own in machine code, as the other: the bound of a period with another path leaves it out.
    #[inline(never)]
    #[must_use]
    pub fn at_with<T: Real>(
        &self,
        prepared: Prepared<'_, T>,
        tick: u64,
        encoder: Encoder,
        period: Micros,
    ) -> Target<T> {
        let of = |point: usize| prepared.steepness.get(point).copied().unwrap_or_default();
        self.on(
            tick,
            &Scale::new(encoder, period),
            |point, interval, us| interval.along_at(us, of(point)),
            |point| prepared.slopes.get(point).copied().unwrap_or(T::ZERO),
        )
    }

    #[inline(never)]
    fn scaled<T: Real>(&self, tick: u64, scale: &Scale<T>) -> Target<T> {
        self.on(tick, scale, |_, interval, us| interval.along(us), |point| self.slope(point))
    }

    #[inline]
    fn on<T: Real>(
        &self,
        tick: u64,
        scale: &Scale<T>,
        along: impl Fn(usize, &Interval<T>, u64) -> FixedCounts,
        slope: impl Fn(usize) -> T,
    ) -> Target<T> {
        let time = tick.saturating_mul(scale.period_us);
        let after = self.knots.partition_point(|k| k.time_us <= time);
        let Some(last) = after.checked_sub(1) else {
            let position = self.knots.first().map_or(FixedCounts(0), |k| k.position);
            return Target { position, ..Target::default() };
        };
        let Some(knot) = self.knots.get(last) else { return Target::default() };
        let Some(interval) = self.interval::<T>(last) else {
            return Target { position: knot.position, ..Target::default() };
        };
        let since = time.wrapping_sub(knot.time_us);
        let h = interval.length;
        let chord = interval.slope();
        // The straight line in integers; a cubic adds its deviation, which vanishes at the points.
        let line = knot.position.plus(along(last, &interval, since));
        let (deviation, velocity, acceleration) = match self.interpolation {
            Interpolation::Linear => (T::ZERO, chord, T::ZERO),
            Interpolation::Cubic => {
                let s = T::from_u64(since) / T::from_i32(1_000_000) / h;
                let (two, three) = (T::from_i32(2), T::from_i32(3));
                // Slopes at both points relative to the chord. Hermite:
                // p = line + h s (1 − s) [(1 − s) m0 − s m1]
                let (m0, m1) = (slope(last) - chord, slope(last.wrapping_add(1)) - chord);
                let (c2, c3) = (-(two * m0 + m1), m0 + m1);
                let left = T::ONE - s;
                (
                    h * s * left * (left * m0 - s * m1),
                    chord + m0 + s * (two * c2 + s * three * c3),
                    (two * c2 + T::from_i32(6) * s * c3) / h,
                )
            }
        };
        Target {
            position: line.plus(FixedCounts::from_real(deviation)),
            velocity: velocity * scale.radians_per_count,
            acceleration: acceleration * scale.radians_per_count,
        }
    }
}
