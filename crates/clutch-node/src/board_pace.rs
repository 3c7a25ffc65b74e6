//! The pace of a board's periods by its host's clock.

use clutch_core::Micros;
use clutch_core::supervisor::Pace;

/// Slack of a sample's arrival, µs: a host's machine may stall.
const SLACK_US: u32 = 25_000;
/// The same before consent, µs: samples wait in the line while a host sets itself up.
const UNCONSENTED_US: u32 = 1_000_000;

/// Arrivals of samples.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BoardPace {
    /// Arrival of the sample that the next one is held against, ns, and its number.
    last: Option<(u64, u16)>,
    /// The newest of those that came at once: a burst makes up for a stall, and its last one shows by how much.
    newest: Option<(u64, u16)>,
    pace: Pace,
    consented: bool,
    /// By how much the clocks are apart, µs, once that is too much.
    pub(crate) off: Option<i32>,
}

impl BoardPace {
    /// Consent: samples come as they are made from now on.
    pub(crate) fn consent(&mut self) {
        *self = BoardPace { consented: true, off: self.off, ..BoardPace::default() };
    }

    /// A sample arrives. A board that is given more time before its silence counts, counts periods as slowly.
    pub(crate) fn sample(&mut self, now_ns: u64, sequence: u16, period: Micros, silence: Micros) {
        match self.newest {
            Some((at_ns, _)) if at_ns != now_ns => self.judge(period, silence),
            _ => {}
        }
        self.newest = Some((now_ns, sequence));
    }

    /// The newest sample against the one before.
    fn judge(&mut self, period: Micros, silence: Micros) {
        let (Some((now_ns, sequence)), Some((since_ns, before))) = (self.newest, self.last) else {
            self.last = self.newest;
            return;
        };
        let periods = sequence.wrapping_sub(before);
        // Again, or overtaken.
        if periods == 0 || periods > u16::MAX / 2 {
            return;
        }
        self.last = self.newest;
        let passed = i32::try_from(now_ns.saturating_sub(since_ns) / 1000).unwrap_or(i32::MAX);
        let expected = period.0.saturating_mul(u32::from(periods));
        let least = if self.consented { SLACK_US } else { UNCONSENTED_US };
        let slack = least.max(period.0.saturating_mul(4)).max(silence.0.saturating_mul(4));
        if let Some(off) = self.pace.pass(expected, passed, slack) {
            self.off.get_or_insert(off);
        }
    }
}
