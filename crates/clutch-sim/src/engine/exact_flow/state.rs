//! A state of the motion within an interval.

use crate::lane::Lane;

/// A state within an interval.
#[derive(Clone, Copy)]
pub(crate) struct State<V> {
    /// Since the begin of the interval, s.
    pub(crate) time: V,
    /// `s`.
    pub(crate) speed: V,
    /// `φ`, 1/s, as the last piece left it: more than the speed gives. NaN where no piece did.
    pub(crate) rate: V,
    /// `∫ s dt`, s.
    pub(crate) way: V,
}

impl<V: Lane> State<V> {
    /// The begin of an interval.
    #[inline(always)]
    pub(crate) fn at(speed: V) -> Self {
        State { time: V::ZERO, speed, rate: V::splat(f64::NAN), way: V::ZERO }
    }

    /// The state of one lane.
    pub(crate) fn lane(&self, i: usize) -> State<f64> {
        State {
            time: self.time.lane(i),
            speed: self.speed.lane(i),
            rate: self.rate.lane(i),
            way: self.way.lane(i),
        }
    }

    /// `a` where the mask is true, `b` elsewhere.
    #[inline(always)]
    pub(crate) fn select(mask: V::Mask, a: &Self, b: &Self) -> Self {
        State {
            time: V::select(mask, a.time, b.time),
            speed: V::select(mask, a.speed, b.speed),
            rate: V::select(mask, a.rate, b.rate),
            way: V::select(mask, a.way, b.way),
        }
    }
}
