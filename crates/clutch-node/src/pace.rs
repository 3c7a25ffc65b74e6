//! The pace of a board's periods by its host's clock.

use clutch_core::Micros;
use clutch_core::supervisor::Pace;

/// What the arrival of a single sample may be off, µs: a host's machine may stall.
const SLACK_US: u32 = 25_000;

/// Arrivals of samples.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct HostPace {
    last: Option<(u64, u16)>,
    pace: Pace,
    /// By how much the clocks are apart, µs, once that is too much.
    pub(crate) off: Option<i32>,
}

impl HostPace {
    /// A sample arrives. A board that is given more time before its silence counts, counts periods as slowly.
    pub(crate) fn sample(&mut self, now_ns: u64, sequence: u16, period: Micros, silence: Micros) {
        let Some((since_ns, before)) = self.last else {
            self.last = Some((now_ns, sequence));
            return;
        };
        let periods = sequence.wrapping_sub(before);
        // Again, or overtaken.
        if periods == 0 || periods > u16::MAX / 2 {
            return;
        }
        self.last = Some((now_ns, sequence));
        let passed = i32::try_from(now_ns.saturating_sub(since_ns) / 1000).unwrap_or(i32::MAX);
        let expected = period.0.saturating_mul(u32::from(periods));
        let slack = SLACK_US.max(period.0.saturating_mul(4)).max(silence.0.saturating_mul(4));
        if let Some(off) = self.pace.pass(expected, passed, slack) {
            self.off.get_or_insert(off);
        }
    }
}
