//! Silences of an encoder in lanes: as [`clutch_core::StickSlip`] finds them one by one.

use crate::lane::Lane;
use clutch_core::StickSlipParams;

/// A detector for several runs, and its memory. Whole numbers are doubles here, exact far beyond any run.
#[derive(Clone)]
pub(super) struct Silence<V: Lane> {
    gap: V,
    ticks: V,
    /// Counts that the path moves in a tick at a rad/s.
    counts_per_tick_second: V,
    stuck: V::Mask,
    silent_ticks: V,
    path_moved: V,
    cycles: V,
    stuck_ticks: V,
    /// Cycles and ticks stuck before the run had settled.
    before: (V, V),
    /// Ticks before that of a silence that is not yet found to be a stick.
    unheard: V,
}

impl<V: Lane> Silence<V> {
    pub(super) fn new(p: &StickSlipParams<f64>, counts_per_tick_second: V) -> Self {
        Silence {
            gap: V::splat(p.gap),
            ticks: V::splat(f64::from(p.ticks)),
            counts_per_tick_second,
            stuck: V::none(),
            silent_ticks: V::ZERO,
            path_moved: V::ZERO,
            cycles: V::ZERO,
            stuck_ticks: V::ZERO,
            before: (V::ZERO, V::ZERO),
            unheard: V::ZERO,
        }
    }

    /// A sample: whether the counts have moved since the last one, and the velocity of the path, rad/s.
    #[inline(always)]
    pub(super) fn update(&mut self, moved: V::Mask, path_velocity: V, settled: bool) {
        let still = !moved;
        let (was, lasts) = (self.stuck, self.stuck & still);
        self.silent_ticks = V::select(moved, V::ZERO, self.silent_ticks + V::ONE);
        let step = (path_velocity * self.counts_per_tick_second).abs();
        // A path that is not a number moves nothing.
        let step = V::select(step.is_finite(), step, V::ZERO);
        self.path_moved = V::select(moved, V::ZERO, self.path_moved + step);
        self.stuck = lasts;
        self.unheard = V::select(moved, V::ZERO, self.unheard);
        if V::any(still) {
            self.stuck_ticks = V::select(lasts, self.stuck_ticks + V::ONE, self.stuck_ticks);
            let long = self.ticks.less_or_equal(self.silent_ticks);
            let begins = still & !was & long & self.gap.less_or_equal(self.path_moved);
            self.cycles = V::select(begins, self.cycles + V::ONE, self.cycles);
            self.stuck_ticks = V::select(begins, self.stuck_ticks + self.silent_ticks, self.stuck_ticks);
            self.stuck = lasts | begins;
            // The silence before settling has been added with the rest.
            self.before.1 = V::select(begins, self.before.1 + self.unheard, self.before.1);
            self.unheard = V::select(begins, V::ZERO, self.unheard);
        }
        if !settled {
            self.before = (self.cycles, self.stuck_ticks);
            self.unheard = V::select(self.stuck, V::ZERO, self.silent_ticks);
        }
    }

    /// Cycles and ticks stuck of a lane since its run had settled.
    pub(super) fn since_settled(&self, i: usize) -> (f64, f64) {
        let (cycles, stuck_ticks) = &self.before;
        (self.cycles.lane(i) - cycles.lane(i), self.stuck_ticks.lane(i) - stuck_ticks.lane(i))
    }
}
