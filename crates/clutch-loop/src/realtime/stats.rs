//! The lateness of the cycles, and the time that they took.

use hdrhistogram::Histogram;
use std::fmt;
use std::time::Duration;

/// Finest step, ns: lateness while spinning is a fraction of a microsecond.
const LOWEST_NS: u64 = 16;
/// Largest time that is distinguished, ns: 10 s.
const HIGHEST_NS: u64 = 10_000_000_000;
/// Decimal digits kept: a percentile is at most 0.1 % off.
const DIGITS: u8 = 3;

/// Times of a loop's cycles, in a histogram of fixed size.
///
/// [`CycleStats::record`] neither allocates nor locks: the control thread owns its recorder and
/// gives it away at the end. Times are kept within 0.1 % (or 16 ns) up to 10 s, longer ones count
/// as 10 s. The maximum is exact.
///
/// ```
/// use clutch_loop::realtime::CycleStats;
/// let mut lateness = CycleStats::new();
/// for us in 1..=1000 { lateness.record(us * 1000); }
/// let summary = lateness.summary();
/// assert_eq!(summary.count, 1000);
/// assert!((499_000..=501_000).contains(&summary.p50_ns));
/// assert_eq!(summary.max_ns, 1_000_000);
/// ```
#[derive(Clone, Debug)]
pub struct CycleStats {
    histogram: Histogram<u64>,
    max_ns: u64,
    beyond: u64,
}

/// The figures of a [`CycleStats`], ns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CycleSummary {
    /// Cycles recorded.
    pub count: u64,
    /// Median, ns.
    pub p50_ns: u64,
    /// 99 % of the cycles took no longer, ns.
    pub p99_ns: u64,
    /// 99.9 % of the cycles took no longer, ns.
    pub p99_9_ns: u64,
    /// Longest, ns; exact.
    pub max_ns: u64,
}

impl Default for CycleStats {
    fn default() -> Self {
        CycleStats::new()
    }
}

impl CycleStats {
    /// An empty recorder. Allocates all it will ever need, about 170 kB.
    #[must_use]
    pub fn new() -> Self {
        // The three bounds are constants within what the crate takes.
        let mut histogram = Histogram::new_with_bounds(LOWEST_NS, HIGHEST_NS, DIGITS)
            .expect("constant bounds: 1 <= low, 2 low <= high, digits <= 5");
        histogram.auto(false);
        CycleStats { histogram, max_ns: 0, beyond: 0 }
    }

    /// One cycle's time, ns.
    pub fn record(&mut self, ns: u64) {
        self.histogram.saturating_record(ns.min(HIGHEST_NS));
        self.max_ns = self.max_ns.max(ns);
        if ns > HIGHEST_NS {
            self.beyond = self.beyond.saturating_add(1);
        }
    }

    /// Cycles recorded.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.histogram.len()
    }

    /// Cycles beyond 10 s, of which only the longest is known exactly.
    #[must_use]
    pub fn beyond(&self) -> u64 {
        self.beyond
    }

    /// The longest, ns, exact; 0 if there is none.
    #[must_use]
    pub fn max_ns(&self) -> u64 {
        self.max_ns
    }

    /// The time that `percent` of all cycles did not exceed, ns; 0 if there is none. Outside 0 to
    /// 100 the nearest of the two is meant.
    #[must_use]
    pub fn percentile_ns(&self, percent: f64) -> u64 {
        if self.histogram.is_empty() || percent.is_nan() {
            return 0;
        }
        // A bucket's upper end may lie above the longest time.
        self.histogram.value_at_percentile(percent.clamp(0.0, 100.0)).min(self.max_ns)
    }

    /// All figures at once.
    #[must_use]
    pub fn summary(&self) -> CycleSummary {
        CycleSummary {
            count: self.count(),
            p50_ns: self.percentile_ns(50.0),
            p99_ns: self.percentile_ns(99.0),
            p99_9_ns: self.percentile_ns(99.9),
            max_ns: self.max_ns,
        }
    }

    /// Takes the cycles of another recorder in.
    pub fn add(&mut self, other: &CycleStats) {
        // Cannot fail: both have the same bounds.
        if self.histogram.add(&other.histogram).is_ok() {
            self.max_ns = self.max_ns.max(other.max_ns);
            self.beyond = self.beyond.saturating_add(other.beyond);
        }
    }

    /// Forgets all cycles.
    pub fn clear(&mut self) {
        self.histogram.clear();
        self.max_ns = 0;
        self.beyond = 0;
    }

    /// Counters held: fixed from the start.
    #[cfg(test)]
    pub(super) fn size(&self) -> usize {
        self.histogram.distinct_values()
    }
}

impl fmt::Display for CycleSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.count == 0 {
            return f.write_str("no cycles");
        }
        let time = Duration::from_nanos;
        write!(
            f,
            "p50 {:.1?}  p99 {:.1?}  p99.9 {:.1?}  max {:.1?}  ({} cycles)",
            time(self.p50_ns),
            time(self.p99_ns),
            time(self.p99_9_ns),
            time(self.max_ns),
            self.count
        )
    }
}
