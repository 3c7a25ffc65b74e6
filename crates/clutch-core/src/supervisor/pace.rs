//! The pace of one clock by another: a board's periods against its own time, or against its host's.

/// Share by which two clocks may differ: one in so many.
const TOLERANCE: i32 = 20;
/// Time over which their difference is gathered, µs; then half of it is forgotten.
const MEMORY: i32 = 1 << 22;

/// Time that should have passed, and how much more has, µs.
///
/// Quartz differs by less than 0.01 %, a wrong prescaler by more than 5 %. The time that a machine that stalls adds to a
/// single sample is slack, once, and not a share.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pace {
    expected: i32,
    more: i32,
}

impl Pace {
    /// Time passes: by how much the clocks are apart (µs), if that is more than 5 % and the slack.
    #[inline]
    pub fn pass(&mut self, expected_us: u32, passed_us: i32, slack_us: u32) -> Option<i32> {
        let expected = i32::try_from(expected_us).unwrap_or(i32::MAX);
        self.expected = self.expected.saturating_add(expected);
        self.more = self.more.saturating_add(passed_us.saturating_sub(expected));
        if self.expected > MEMORY {
            self.expected /= 2;
            self.more /= 2;
        }
        let allowed = (self.expected / TOLERANCE).unsigned_abs().saturating_add(slack_us);
        (self.more.unsigned_abs() > allowed).then_some(self.more)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Periods of 1 ms, each of which takes so many µs by the other clock, until that is seen with a slack of 20 ms.
    fn seen(each_us: impl Fn(i32) -> i32) -> Option<i32> {
        let mut pace = Pace::default();
        (1..100_000).find(|k| pace.pass(1000, each_us(*k), 20_000).is_some())
    }

    #[test]
    fn clocks_that_differ_by_less_than_5_percent_agree_for_ever_and_others_do_not() {
        assert_eq!(seen(|_| 1000), None);
        assert_eq!((seen(|_| 1049), seen(|_| 951)), (None, None));
        // 20 ms and 50 µs a period, against what they are apart.
        for (each, most) in
            [(1100, 401), (900, 401), (1500, 45), (500, 45), (0, 22), (-1000, 11), (12_000, 2), (83, 24)]
        {
            let seen = seen(|_| each);
            assert!(seen.is_some_and(|k| k <= most), "{each} µs: {seen:?}");
        }
    }

    #[test]
    fn half_is_forgotten_behind_the_memory_and_not_at_its_end() {
        let apart = MEMORY / TOLERANCE + 1;
        let once = |expected: i32| Pace::default().pass(expected.unsigned_abs(), expected + apart, 0);
        assert_eq!(once(MEMORY), Some(apart));
        assert_eq!(once(MEMORY + 2), Some(apart / 2));
    }

    #[test]
    fn a_stall_is_slack_and_no_share() {
        // 19 ms in which nothing came, each two seconds, and made up for at once.
        assert_eq!(
            seen(|k| match k % 2000 {
                0 => 20_000,
                1..20 => 0,
                _ => 1000,
            }),
            None
        );
    }

    #[test]
    fn a_clock_that_was_right_for_long_and_is_now_wrong_is_found_within_seconds() {
        let mut pace = Pace::default();
        assert!((0..1_000_000).all(|_| pace.pass(1000, 1000, 0).is_none()), "a thousand seconds");
        // A tenth more: as soon as that is a twentieth of all that is remembered, which is 4.2 s at most.
        let found = (1..10_000).find_map(|n| pace.pass(1000, 1100, 0).map(|more| (n, more)));
        let (periods, more) = found.expect("never");
        assert!((1000..4300).contains(&periods) && more > 0, "after {periods} periods, {more} µs");
    }

    #[test]
    fn a_twentieth_and_the_slack_are_borne() {
        assert_eq!(Pace::default().pass(1000, 1050, 0), None);
        assert_eq!(Pace::default().pass(1000, 1051, 0), Some(51));
        assert_eq!(Pace::default().pass(1000, 1060, 10), None);
        assert_eq!(Pace::default().pass(1000, 939, 10), Some(-61));
    }
}
