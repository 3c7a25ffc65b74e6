//! A run as it is known before it begins.

use crate::{FixedCounts, FrictionMap, Place, Real, Target, off_map};

/// The path of a run and, where there is a map of the disc, the friction along it. A closure from ticks to targets is a path
/// without a map.
pub trait Planned<T: Real> {
    /// The target at a tick.
    fn target(&self, tick: u64) -> Target<T>;

    /// Friction around a position, as a map has it.
    #[inline]
    fn place(&self, position: FixedCounts) -> Place<T> {
        off_map(position)
    }
}

impl<T: Real, F: Fn(u64) -> Target<T>> Planned<T> for F {
    #[inline]
    fn target(&self, tick: u64) -> Target<T> {
        self(tick)
    }
}

/// A path, and the map of the disc if there is one.
#[derive(Clone, Copy, Debug)]
pub struct OnDisc<'a, F> {
    /// The target at a tick.
    pub path: F,
    /// Friction along the disc.
    pub map: Option<FrictionMap<'a>>,
}

impl<T: Real, F: Fn(u64) -> Target<T>> Planned<T> for OnDisc<'_, F> {
    #[inline]
    fn target(&self, tick: u64) -> Target<T> {
        (self.path)(tick)
    }

    #[inline]
    fn place(&self, position: FixedCounts) -> Place<T> {
        self.map.as_ref().map_or_else(|| off_map(position), |map| map.at(position))
    }
}

impl<T: Real, F: Fn(u64) -> Target<T>> Planned<T> for &OnDisc<'_, F> {
    #[inline]
    fn target(&self, tick: u64) -> Target<T> {
        (**self).target(tick)
    }

    #[inline]
    fn place(&self, position: FixedCounts) -> Place<T> {
        (**self).place(position)
    }
}

/// A run whose path, planned from position 0 on, begins at another.
#[derive(Clone, Copy, Debug)]
pub struct BeginningAt<'a, P> {
    /// As planned.
    pub planned: &'a P,
    /// The position at which the path begins.
    pub origin: FixedCounts,
}

impl<T: Real, P: Planned<T>> Planned<T> for BeginningAt<'_, P> {
    #[inline]
    fn target(&self, tick: u64) -> Target<T> {
        let target = self.planned.target(tick);
        Target { position: target.position.plus(self.origin), ..target }
    }

    #[inline]
    fn place(&self, position: FixedCounts) -> Place<T> {
        self.planned.place(position)
    }
}
