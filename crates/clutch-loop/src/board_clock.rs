//! A board's clock by this machine's, before consent: its time, and the samples that it takes.
//!
//! Each look is a request and its answer. The board did all that the answer shows between the two, and took the samples that
//! came before the answer before it. So two looks bound the board's rate from below and from above, however long a busy
//! machine or a slow line held each of them up: a board that is right is never refused, and a look that says little is
//! followed by another. A board may itself be held up between an answer and a sample; so it is believed soon, and refused
//! only after a second, of which that is no share.
//!
//! A simulated board's clock slips behind where its machine stalls, and never runs ahead. Of a board that calls itself one it
//! is refused what no slip explains: a rate that is too high, or below a half. Its word alone would leave a real board behind
//! a socket unlooked at.

use clutch_core::Micros;
use clutch_sim::number;

/// Share by which the board's rate may differ from this machine's.
const TOLERANCE: f64 = 0.05;
/// Share that is left of the rate of a clock that slips, at least.
const SLIPPED: f64 = 0.5;
/// Looks that a board is believed by have so much time between them, ns: its clock may tick in milliseconds.
const NEAR_NS: u64 = 50_000_000;
/// Looks that a board is refused by, ns.
const FAR_NS: u64 = 1_000_000_000;
/// Samples that may change places with an answer.
const OVERTAKEN: f64 = 2.0;

/// A look at the board: a request and its answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Look {
    /// Times of the request and of its answer by this machine's clock, ns.
    pub asked_ns: (u64, u64),
    /// The board's time in the answer, µs.
    pub board_us: u32,
    /// Number of the newest sample before the answer; none where samples do not come here.
    pub sample: Option<u16>,
}

/// Bounds of a rate, in parts of that which it should have.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rate {
    low: f64,
    high: f64,
}

impl Rate {
    const UNKNOWN: Rate = Rate { low: f64::NEG_INFINITY, high: f64::INFINITY };

    /// Something has passed, `low` to `high` seconds of it, while `shortest` to `longest` seconds did here.
    fn narrow(&mut self, (low, high): (f64, f64), (shortest, longest): (f64, f64)) {
        self.low = self.low.max(if low > 0.0 { low / longest } else { low / shortest });
        self.high = self.high.min(if high > 0.0 { high / shortest } else { high / longest });
    }

    /// True if it cannot be right, where it has to be at least this.
    fn is_wrong(self, least: f64) -> bool {
        self.low > 1.0 + TOLERANCE || self.high < least
    }

    /// True if it can only be right.
    fn is_right(self, least: f64) -> bool {
        // Of a rate that is none, nothing is known.
        self.low >= least && self.high <= 1.0 + TOLERANCE && self.low <= self.high
    }

    /// The middle of its bounds, or the bound that there is.
    fn seen(self) -> f64 {
        let middle = 0.5 * (self.low + self.high);
        if middle.is_finite() { middle } else { self.low.max(0.0).min(self.high) }
    }
}

/// The rate of a board that is wrong, in parts of what it should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wrong {
    /// The board's time.
    Time(f64),
    /// The samples that it takes.
    Samples(f64),
}

/// What is expected of a board's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Expected {
    /// Its period.
    pub period: Micros,
    /// It may slip behind: the board calls itself simulated.
    pub slips: bool,
}

impl Expected {
    /// The lowest rate, in parts of that which it should have.
    fn least(self) -> f64 {
        if self.slips { SLIPPED } else { 1.0 - TOLERANCE }
    }

    /// Samples or seconds that are right, so many by this machine's clock, in words.
    #[must_use]
    pub fn words(self, right: f64) -> String {
        let text = |x: f64| number((x * 1e3).round() / 1e3);
        if self.slips {
            let (least, most) = (text(right * SLIPPED), text(right * (1.0 + TOLERANCE)));
            format!("{least} to {most} of one whose serial number is a simulated board's")
        } else {
            format!("{} to 5 %", text(right))
        }
    }
}

/// A rate by looks that are near, and by those that are far apart.
#[derive(Clone, Copy, Debug)]
struct Rates {
    near: Rate,
    far: Rate,
}

/// A board's clock by this machine's.
#[derive(Clone, Debug)]
pub struct BoardClock {
    expected: Expected,
    /// Its samples come here.
    samples_come: bool,
    looks: Vec<Look>,
    time: Rates,
    samples: Rates,
}

impl BoardClock {
    /// Clock of a board of which this is expected; its samples come to this machine, or to another.
    #[must_use]
    pub fn new(expected: Expected, samples_come: bool) -> Self {
        let unknown = Rates { near: Rate::UNKNOWN, far: Rate::UNKNOWN };
        BoardClock { expected, samples_come, looks: Vec::new(), time: unknown, samples: unknown }
    }

    /// Takes a look in, later than those before. True if board and machine agree as far as can be seen, false if nobody can
    /// say yet.
    ///
    /// # Errors
    /// The rate that is wrong.
    pub fn look(&mut self, look: Look) -> Result<bool, Wrong> {
        let seconds = |from: u64, to: u64| to.saturating_sub(from) as f64 * 1e-9;
        let (asked, answered) = look.asked_ns;
        let (period, least) = (f64::from(self.expected.period.0) * 1e-6, self.expected.least());
        for before in &self.looks {
            let apart = asked.saturating_sub(before.asked_ns.1);
            if apart < NEAR_NS {
                continue;
            }
            let passed = (seconds(before.asked_ns.1, asked), seconds(before.asked_ns.0, answered));
            let by_the_board = f64::from(look.board_us.wrapping_sub(before.board_us).cast_signed()) * 1e-6;
            let taken = match (before.sample, look.sample) {
                (Some(from), Some(to)) => Some(f64::from(to.wrapping_sub(from).cast_signed())),
                (None, None) => Some(0.0),
                // The number before the first is not known.
                _ => None,
            };
            let narrow = |time: &mut Rate, samples: &mut Rate| {
                time.narrow((by_the_board, by_the_board), passed);
                if let Some(taken) = taken {
                    let (fewest, most) = (taken - OVERTAKEN, taken + OVERTAKEN);
                    samples.narrow((fewest * period, most * period), passed);
                }
            };
            narrow(&mut self.time.near, &mut self.samples.near);
            if apart >= FAR_NS {
                narrow(&mut self.time.far, &mut self.samples.far);
            }
        }
        self.looks.push(look);
        if self.samples_come && self.samples.far.is_wrong(least) {
            return Err(Wrong::Samples(self.samples.far.seen()));
        }
        if self.time.far.is_wrong(least) {
            return Err(Wrong::Time(self.time.far.seen()));
        }
        Ok(self.time.near.is_right(least) && (!self.samples_come || self.samples.near.is_right(least)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    const STRICT: Expected = Expected { period: Micros(1000), slips: false };

    /// Looks, 5 ms apart, at a board whose time and samples run at these rates, over a line that holds each way up by a random
    /// time below `held_up_ms`. Gives the verdict and when it fell, ms; none within two seconds.
    fn verdict(
        rates: (f64, f64),
        period_us: u32,
        held_up_ms: f64,
        seed: u64,
    ) -> (Option<Result<(), Wrong>>, f64) {
        let expected = Expected { period: Micros(period_us), slips: false };
        verdict_of(expected, rates, held_up_ms, seed)
    }

    fn verdict_of(
        expected: Expected,
        (time, samples): (f64, f64),
        held_up_ms: f64,
        seed: u64,
    ) -> (Option<Result<(), Wrong>>, f64) {
        let mut rng = Pcg64::seed_from_u64(seed);
        let period_us = expected.period.0;
        let mut clock = BoardClock::new(expected, true);
        let mut now = 1e9;
        // Not in step with the samples.
        let start = 1e9 - 1e6 * rng.random_range(0.0..1.0);
        while now < 3e9 {
            let asked = now;
            let there = asked + 1e5 + 1e6 * held_up_ms * rng.random_range(0.0..1.0);
            now = there + 1e5 + 1e6 * held_up_ms * rng.random_range(0.0..1.0);
            let since = there - start;
            let look = Look {
                asked_ns: (asked as u64, now as u64),
                board_us: (u32::MAX - 40_000).wrapping_add((since * time / 1e3) as i64 as u32),
                sample: Some(65_500_u16.wrapping_add((since * samples / 1e3 / f64::from(period_us)) as u16)),
            };
            match clock.look(look) {
                Ok(false) => now += 5e6,
                Ok(true) => return (Some(Ok(())), (now - 1e9) / 1e6),
                Err(wrong) => return (Some(Err(wrong)), (now - 1e9) / 1e6),
            }
        }
        (None, 2e3)
    }

    #[test]
    fn a_board_that_is_right_is_never_refused_however_busy_the_machine_is() {
        for held_up_ms in [0.0, 1.0, 10.0, 50.0, 200.0] {
            for (seed, drift) in (0..200).flat_map(|seed| [(seed, 0.99), (seed, 1.0), (seed, 1.01)]) {
                for period_us in [100, 1000, 10_000, 250_000] {
                    let (said, _) = verdict((drift, drift), period_us, held_up_ms, seed);
                    assert!(
                        said.is_none_or(|said| said == Ok(())),
                        "{held_up_ms} ms, {seed}, {period_us} µs: {said:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_quiet_machine_knows_within_a_tenth_of_a_second_and_a_busy_one_within_two() {
        for seed in 0..200 {
            let (said, ms) = verdict((1.0, 1.0), 1000, 0.3, seed);
            assert!(said == Some(Ok(())) && ms < 130.0, "{said:?} after {ms} ms");
            let (said, ms) = verdict((1.0, 1.0), 1000, 20.0, seed);
            assert!(said == Some(Ok(())), "{said:?} after {ms} ms");
        }
    }

    #[test]
    fn a_board_at_another_rate_is_refused_by_what_is_wrong_with_it() {
        for rate in [1.0 / 155.0, 0.083, 0.5, 0.9, 1.1, 1.2, 2.0, 12.0] {
            for seed in 0..50 {
                for (held_up_ms, at_most) in [(0.3, 1020.0), (20.0, 2000.0)] {
                    // The whole clock, samples alone, time alone.
                    let all = [((rate, rate), true), ((1.0, rate), true), ((rate, 1.0), false)];
                    for (rates, samples) in all {
                        let (said, ms) = verdict(rates, 1000, held_up_ms, seed);
                        let right = match said {
                            // A board that takes a sample each 155 ms takes 13 in two seconds.
                            Some(Err(Wrong::Samples(seen))) => {
                                samples && (seen - rate).abs() < 0.05 * rate + 0.005
                            }
                            Some(Err(Wrong::Time(seen))) => (seen - rate).abs() < 0.05 * rate + 1e-3,
                            _ => false,
                        };
                        assert!(right && ms <= at_most, "{rates:?}, {held_up_ms} ms: {said:?} after {ms} ms");
                    }
                }
            }
        }
    }

    #[test]
    fn a_board_that_is_held_up_before_its_samples_is_not_refused_and_one_without_samples_is() {
        // Thirty samples come behind an answer, once: a second later that is no share.
        let look = |ms: u64, sample| Look {
            asked_ns: (ms * 1_000_000, ms * 1_000_000 + 200_000),
            board_us: ms as u32 * 1000,
            sample,
        };
        let mut clock = BoardClock::new(STRICT, true);
        for ms in (0..2000).step_by(5) {
            let late = if (40..70).contains(&ms) { 30 } else { 0 };
            assert!(clock.look(look(ms, Some(100 + ms as u16 - late))).is_ok(), "at {ms} ms");
        }
        let mut clock = BoardClock::new(STRICT, true);
        let said = (0..2000).step_by(5).map(|ms| clock.look(look(ms, None))).find(|said| *said != Ok(false));
        assert!(matches!(said, Some(Err(Wrong::Samples(seen))) if seen < 0.01), "{said:?}");
        // They go to another machine.
        let mut clock = BoardClock::new(STRICT, false);
        assert!((0..100).step_by(5).any(|ms| clock.look(look(ms, None)) == Ok(true)));
    }

    #[test]
    fn a_clock_that_may_slip_is_refused_where_it_runs_ahead_or_at_less_than_half_its_rate() {
        let slips = Expected { period: Micros(1000), slips: true };
        for seed in 0..50 {
            for held_up_ms in [0.3, 10.0] {
                for rate in [0.6, 0.9, 1.0, 1.01] {
                    for rates in [(rate, rate), (1.0, rate), (rate, 1.0)] {
                        let (said, ms) = verdict_of(slips, rates, held_up_ms, seed);
                        assert!(said == Some(Ok(())), "{rates:?}: {said:?} after {ms} ms");
                    }
                }
                for rate in [-1.0, 0.0, 1.0 / 155.0, 0.4, 1.1, 1.2, 2.0, 12.0] {
                    let (said, ms) = verdict_of(slips, (rate, 1.0), held_up_ms, seed);
                    assert!(matches!(said, Some(Err(Wrong::Time(_)))), "{rate}: {said:?} after {ms} ms");
                    let (said, ms) = verdict_of(slips, (1.0, rate.max(0.0)), held_up_ms, seed);
                    assert!(matches!(said, Some(Err(Wrong::Samples(_)))), "{rate}: {said:?} after {ms} ms");
                }
            }
        }
    }

    #[test]
    fn the_rates_that_are_right_are_told() {
        let words = |slips| Expected { period: Micros(1000), slips }.words(1000.0);
        assert_eq!(words(false), "1000 to 5 %");
        assert_eq!(words(true), "500 to 1050 of one whose serial number is a simulated board's");
    }

    #[test]
    fn a_time_that_stands_still_or_runs_backwards_is_refused() {
        for rate in [0.0, -1.0] {
            let (said, ms) = verdict((rate, 1.0), 1000, 0.3, 7);
            assert!(
                matches!(said, Some(Err(Wrong::Time(seen))) if seen <= 0.0) && ms < 1020.0,
                "{said:?} after {ms} ms"
            );
        }
    }
}
