//! Rows that let go within a step: found by a bound, not by samples.
//!
//! Stuck rows hold while some `λ` with `Jᵀλ = Q` on their span has `|λ_i| ≤ h_i`: a convex condition on loads and bounds
//! together. Two instants at a distance `L` that hold with bounds less `m` therefore hold all along the chord between them, and
//! loads and bounds leave the chord by `L²/8` of their second derivatives at most. Where independent rows take up that
//! departure of the loads within `m`, nothing can have let go; elsewhere the time is halved.

use super::System;
use super::modes::{Held, hold};
use super::span::Span;
use super::state::{Equations, INSTANT, Mode, STILL, SystemError};
use clutch_core::friction::FrictionModel;
use nalgebra::SVector;

/// Halvings of a step after which an instant that no bound excludes is passed over, as in the search of the shaft: the excess
/// there is below what its curvature makes in a millionth of the step.
const EXCLUDED: u32 = 20;
/// Instants of one search at which no row has let go: one peak takes some dozens. More are of a load that stays at the limit,
/// where no bound excludes anything.
const ASKED: u32 = 500;
/// Curvature that is estimated counts as so many times what it seems.
const DOUBT: f64 = 2.0;

/// An instant of a step, and what its rows hold.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instant<const N: usize, const B: usize> {
    /// Time since the step began, s.
    pub(super) at: f64,
    pub(super) equations: Equations<N, B>,
    /// Torques and accelerations of stuck rows.
    pub(super) held: Held<B>,
    /// Acceleration above which a stuck row is no longer held.
    pub(super) still: f64,
    /// A stuck row is no longer held.
    pub(super) gone: bool,
}

impl<const N: usize, const B: usize> Instant<N, B> {
    pub(super) fn of(at: f64, equations: Equations<N, B>, stuck: &[bool; B]) -> Self {
        if !stuck.contains(&true) {
            let none = Held { torque: SVector::zeros(), acceleration: SVector::zeros() };
            return Instant { at, equations, held: none, still: 0.0, gone: false };
        }
        let (held, still) = left(&equations, &equations.bound, stuck);
        let gone = (0..B).any(|i| stuck[i] && held.acceleration[i].abs() > still);
        Instant { at, equations, held, still, gone }
    }
}

/// Torques of stuck rows within the bounds, accelerations that they leave, and the one above which a row is not held.
fn left<const N: usize, const B: usize>(
    e: &Equations<N, B>,
    bound: &SVector<f64, B>,
    stuck: &[bool; B],
) -> (Held<B>, f64) {
    let a = e.rows * e.inverse * e.rows.transpose();
    let b = e.rows * e.free;
    let both = |i: usize| b[i].abs() + a[(i, i)] * e.bound[i];
    let largest = (0..B).filter(|i| stuck[*i]).fold(0.0_f64, |most, i| most.max(both(i)));
    (hold(&a, &b, bound, stuck), STILL * largest)
}

/// Loads and bounds within a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Value<const N: usize, const B: usize> {
    /// Its time as a share of the step.
    share: f64,
    free: SVector<f64, N>,
    normal: SVector<f64, B>,
}

impl<const N: usize, const B: usize> Value<N, B> {
    pub(super) fn of(share: f64, e: &Equations<N, B>) -> Self {
        Value { share, free: e.free, normal: e.normal }
    }
}

/// The most that a quantity bends in a step of 1 s: the larger of its first and last second differences, and how far they differ,
/// as the ends of a step lie outside of both.
fn bend<const N: usize, const B: usize, const D: usize>(
    values: &[Value<N, B>],
    of: impl Fn(&Value<N, B>) -> SVector<f64, D>,
) -> SVector<f64, D> {
    let slope = |a: &Value<N, B>, b: &Value<N, B>| (of(b) - of(a)) / (b.share - a.share);
    let second =
        |v: &[Value<N, B>]| (slope(&v[1], &v[2]) - slope(&v[0], &v[1])) * (2.0 / (v[2].share - v[0].share));
    let (first, last) = (second(&values[..3]), second(&values[values.len() - 3..]));
    first.zip_map(&last, |a, b| DOUBT * (a.abs().max(b.abs()) + (a - b).abs()))
}

/// A step that is searched.
pub(super) struct Stretch<'m, S, const N: usize, const B: usize> {
    pub(super) system: &'m S,
    /// Time at which it begins, and its length, s.
    pub(super) from: f64,
    pub(super) length: f64,
    pub(super) modes: [Mode; B],
    /// Loads and bounds within it; none of what rests.
    pub(super) between: Option<[Value<N, B>; 2]>,
    /// The equations after a time within it, s.
    pub(super) equations_after: &'m dyn Fn(f64) -> Result<Equations<N, B>, SystemError>,
}

/// A search for the first instant of a step at which a stuck row lets go.
pub(super) struct Search<'m, S, const N: usize, const B: usize> {
    stretch: Stretch<'m, S, N, B>,
    stuck: [bool; B],
    /// The most that the torques bend which take up the load, N m/s².
    loads: SVector<f64, B>,
    /// The most that the bounds bend, N m/s².
    bounds: SVector<f64, B>,
    /// Rows are redundant: their torques can be others than those that were found.
    redundant: bool,
    /// Torque by which no row is seen to let go.
    tolerance: f64,
    /// Instants that may still be asked.
    asked: u32,
}

impl<'m, S: System<N, B>, const N: usize, const B: usize> Search<'m, S, N, B> {
    /// A search over a step, between its begin and its end.
    pub(super) fn new(
        stretch: Stretch<'m, S, N, B>,
        (a, b): (&Instant<N, B>, &Instant<N, B>),
    ) -> Result<Self, SystemError> {
        let Stretch { system, from, length: h, modes, between, equations_after } = stretch;
        let stuck = modes.map(|mode| mode == Mode::Stuck);
        let (begin, end) = (&a.equations, &b.equations);
        let told = system.curvature(from, from + h);
        let (mut load, mut normal) = told.unwrap_or_else(|| (SVector::zeros(), SVector::zeros()));
        // Motion bends the load, too: no bound of that is known, and its values within the step are looked at.
        let (first, last) = (Value::of(0.0, begin), Value::of(1.0, end));
        let seen = match between {
            Some([early, late]) => Some([first, early, late, last]),
            // Nothing moves, and nobody knows the loads: three values are enough.
            None if told.is_none() => Some([first, Value::of(0.5, &equations_after(0.5 * h)?), last, last]),
            None => None,
        };
        let seen = seen.as_ref().map(|seen| if between.is_some() { &seen[..] } else { &seen[..3] });
        let per_square = 1.0 / (h * h);
        if let (Some(seen), None) = (seen, told) {
            normal = bend(seen, |value| value.normal) * per_square;
        }
        let friction = |i: usize| system.friction(i);
        for i in (0..B).filter(|i| normal[*i] > 0.0 && !stuck[*i]) {
            let sign = modes[i].sign();
            let slides = friction(i).level((sign * end.slip[i]).max(0.0)) * normal[i];
            load += end.rows.row(i).transpose().abs() * slides;
        }
        let bounds = SVector::<f64, B>::from_fn(|i, _| {
            if stuck[i] && normal[i] > 0.0 { friction(i).at_rest() * normal[i] } else { 0.0 }
        });
        let mut search = Search {
            stretch,
            stuck,
            loads: SVector::zeros(),
            bounds,
            redundant: false,
            tolerance: STILL * begin.bound.amax().max(end.bound.amax()),
            asked: ASKED,
        };
        if seen.is_some() || load.amax() > 0.0 || bounds.amax() > 0.0 {
            // A row whose normal force is 0 all along holds nothing.
            let weight = SVector::<f64, B>::from_fn(|i, _| {
                let most = begin.normal[i].max(end.normal[i]) + 0.125 * normal[i] * h * h;
                if stuck[i] { friction(i).at_rest() * most.max(0.0) } else { 0.0 }
            });
            let carriers = Span::of(&end.inverse, &end.rows, &weight);
            search.redundant = carriers.count() < (0..B).filter(|i| weight[*i] > 0.0).count();
            for j in (0..N).filter(|j| load[*j] > 0.0) {
                search.loads += carriers.torque(&end.inverse.column(j).into_owned()).abs() * load[j];
            }
            if let Some(seen) = seen {
                search.loads += bend(seen, |value| carriers.torque(&value.free)) * per_square;
            }
        }
        Ok(search)
    }

    /// The first instant with a row that lets go, on the far side of the root; `a` has none.
    pub(super) fn first(
        &mut self,
        a: &Instant<N, B>,
        b: &Instant<N, B>,
        halvings: u32,
    ) -> Result<Option<f64>, SystemError> {
        if !b.gone && (halvings >= EXCLUDED || self.asked == 0 || self.excluded(a, b)) {
            return Ok(None);
        }
        let width = b.at - a.at;
        let at = a.at + 0.5 * width;
        if width <= INSTANT || at <= a.at || at >= b.at {
            return Ok(b.gone.then_some(b.at));
        }
        let middle = Instant::of(at, (self.stretch.equations_after)(at)?, &self.stuck);
        if !b.gone {
            self.asked -= 1;
        }
        match self.first(a, &middle, halvings + 1)? {
            Some(instant) => Ok(Some(instant)),
            None if middle.gone => Ok(Some(middle.at)),
            None => self.first(&middle, b, halvings + 1),
        }
    }

    /// No row lets go between two instants at which none has.
    fn excluded(&self, a: &Instant<N, B>, b: &Instant<N, B>) -> bool {
        let eighth = 0.125 * (b.at - a.at) * (b.at - a.at);
        let bounds = |of: &Instant<N, B>| {
            // Without the clamp of a normal force below 0, which is no chord.
            of.equations.bound.zip_map(&of.equations.normal, |h, n| if n > 0.0 { h } else { 0.0 })
        };
        let mut room = [bounds(a), bounds(b)];
        for i in (0..B).filter(|i| self.stuck[*i]) {
            let carries = self.loads[i] * eighth;
            // A row that begins to hold, or ends it, is taken for one that holds nothing.
            if room[0][i] <= 0.0 || room[1][i] <= 0.0 {
                if carries > self.tolerance {
                    return false;
                }
                room.iter_mut().for_each(|room| room[i] = 0.0);
                continue;
            }
            for room in &mut room {
                room[i] -= carries + self.bounds[i] * eighth;
                if room[i] < -self.tolerance {
                    return false;
                }
                room[i] = room[i].max(0.0);
            }
        }
        self.held(a, &room[0]) && self.held(b, &room[1])
    }

    /// Stuck rows hold within that room.
    fn held(&self, at: &Instant<N, B>, room: &SVector<f64, B>) -> bool {
        let within = |i: usize| at.held.torque[i].abs() <= room[i] + self.tolerance;
        if (0..B).filter(|i| self.stuck[*i]).all(within) {
            return true;
        }
        if !self.redundant {
            return false;
        }
        let (held, still) = left(&at.equations, room, &self.stuck);
        (0..B).all(|i| !self.stuck[i] || held.acceleration[i].abs() <= still)
    }
}

/// The time at which a row that slips at both ends of a step of `h` is slowest between them, if it comes near to a stop there:
/// of the cubic with its rates and accelerations at the ends, in the direction of its slip.
pub(super) fn slowest(h: f64, rate: (f64, f64), acceleration: (f64, f64)) -> Option<f64> {
    if rate.0 <= 0.0 || rate.1 <= 0.0 {
        return None;
    }
    let (d0, d1, rise) = (h * acceleration.0, h * acceleration.1, rate.1 - rate.0);
    let (square, cube) = (3.0 * rise - 2.0 * d0 - d1, d0 + d1 - 2.0 * rise);
    let root = square * square - 3.0 * cube * d0;
    if root <= 0.0 {
        return None;
    }
    let share = -d0 / (square + root.sqrt());
    if !(share > 0.0 && share < 1.0) {
        return None;
    }
    let least = rate.0 + share * (d0 + share * (square + share * cube));
    // The cubic leaves the rate by far less than a hundredth of the depth of the dip.
    (least <= 0.01 * (rate.0.min(rate.1) - least)).then_some(share * h)
}
