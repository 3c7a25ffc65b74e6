//! Silences of an encoder in lanes: as [`clutch_core::StickSlip`] finds them one by one.

use crate::lane::Lane;
use clutch_core::StickSlipParams;

/// Several detectors for the encoders of several runs. Whole numbers are doubles here, exact far beyond any run.
#[derive(Clone)]
pub(super) struct Silences<V: Lane, const N: usize> {
    /// Counts that the path moves in a tick at a rad/s.
    counts_per_tick_second: V,
    silent_ticks: V,
    path_moved: V,
    /// Samples since the runs have settled.
    settled: f64,
    detectors: [Detector<V>; N],
}

/// A detector, and its memory.
#[derive(Clone)]
struct Detector<V: Lane> {
    gap: V,
    ticks: V,
    stuck: V::Mask,
    cycles: V,
    stuck_ticks: V,
    /// Cycles and ticks stuck before the run had settled.
    before: (V, V),
}

impl<V: Lane, const N: usize> Silences<V, N> {
    pub(super) fn new(all: [&StickSlipParams<f64>; N], counts_per_tick_second: V) -> Self {
        let zero = V::ZERO;
        let detector = |p: &StickSlipParams<f64>| Detector {
            gap: V::splat(p.gap),
            ticks: V::splat(f64::from(p.ticks)),
            stuck: V::none(),
            cycles: zero,
            stuck_ticks: zero,
            before: (zero, zero),
        };
        let detectors = all.map(detector);
        Silences { counts_per_tick_second, silent_ticks: zero, path_moved: zero, settled: 0.0, detectors }
    }

    /// A sample: where the counts have moved since the last one, and the velocity of the path, rad/s.
    #[inline(always)]
    pub(super) fn update(&mut self, moved: V::Mask, path_velocity: V, settled: bool) {
        if settled {
            self.settled += 1.0;
        }
        if V::all(moved) {
            (self.silent_ticks, self.path_moved) = (V::ZERO, V::ZERO);
            for detector in &mut self.detectors {
                detector.stuck = V::none();
            }
        } else {
            self.silent(!moved, path_velocity);
        }
        if !settled {
            for detector in &mut self.detectors {
                detector.before = (detector.cycles, detector.stuck_ticks);
            }
        }
    }

    /// The counts of some have not moved.
    #[inline(always)]
    fn silent(&mut self, still: V::Mask, path_velocity: V) {
        let step = (path_velocity * self.counts_per_tick_second).abs();
        // A path that is not a number moves nothing.
        let step = V::select(step.is_finite(), step, V::ZERO);
        self.silent_ticks = V::select(still, self.silent_ticks + V::ONE, V::ZERO);
        self.path_moved = V::select(still, self.path_moved + step, V::ZERO);
        for detector in &mut self.detectors {
            let (was, lasts) = (detector.stuck, detector.stuck & still);
            let long = detector.ticks.less_or_equal(self.silent_ticks);
            let begins = still & !was & long & detector.gap.less_or_equal(self.path_moved);
            detector.stuck = lasts | begins;
            let more = V::select(lasts, V::ONE, V::ZERO);
            detector.stuck_ticks = detector.stuck_ticks + V::select(begins, self.silent_ticks, more);
            if V::any(begins) {
                detector.cycles = V::select(begins, detector.cycles + V::ONE, detector.cycles);
                // A silence from before settling has been added with the rest.
                let unheard = self.silent_ticks - V::splat(self.settled);
                let unheard = V::select(begins & V::ZERO.less(unheard), unheard, V::ZERO);
                detector.before.1 = detector.before.1 + unheard;
            }
        }
    }

    /// Of each detector, the cycles and ticks stuck of a lane since its run had settled.
    pub(super) fn since_settled(&self, i: usize) -> [(f64, f64); N] {
        std::array::from_fn(|of| {
            let Detector { cycles, stuck_ticks, before, .. } = &self.detectors[of];
            (cycles.lane(i) - before.0.lane(i), stuck_ticks.lane(i) - before.1.lane(i))
        })
    }
}
