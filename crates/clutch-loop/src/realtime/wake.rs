//! Lateness of the control thread's wake-ups.

/// Rate at which two crystals may part, as a share of the time: the quickest way seen may have become longer by this.
const DRIFT: i64 = 10_000; // 100 ppm

/// The lateness of wake-ups that samples cause: by how much longer each took, from the board's time of the sample to this
/// thread, than the quickest before it. The offset between the clocks falls out, and so does the time on the line, as far
/// as it is always the same.
#[derive(Clone, Copy, Debug, Default)]
pub struct SampleWake {
    /// The board's time of the last sample, µs, and the way to the first one's time, ns.
    last: Option<(u32, i64)>,
    quickest: i64,
}

impl SampleWake {
    /// A sample of this time of the board's (µs) woke this thread at a time of this machine's (ns). Its lateness, ns; none
    /// of a sample that is not newer than the one before.
    pub fn woke(&mut self, time_us: u32, now_ns: u64) -> Option<u64> {
        let now = now_ns.cast_signed();
        let Some((last_us, last_ns)) = self.last else {
            (self.last, self.quickest) = (Some((time_us, 0)), now);
            return Some(0);
        };
        let step = i64::from(time_us.wrapping_sub(last_us).cast_signed()).saturating_mul(1000);
        if step <= 0 {
            return None;
        }
        let board = last_ns.saturating_add(step);
        let way = now.saturating_sub(board);
        self.last = Some((time_us, board));
        self.quickest = way.min(self.quickest.saturating_add(step / DRIFT));
        Some(way.saturating_sub(self.quickest).cast_unsigned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lateness_is_what_a_sample_took_longer_than_the_quickest() {
        let mut wake = SampleWake::default();
        // 50 ppm between the clocks, across the wrap of the board's; 300 µs on the line.
        let (late, mut seen) = ([0, 40, 0, 7, 900, 0, 25], Vec::new());
        for (i, late) in late.iter().enumerate() {
            let board = (u32::MAX - 2_500).wrapping_add(1000 * i as u32);
            let ours = 5_000_000_000 + (1_000_050 * i as u64) + 300_000 + 1000 * late;
            seen.push(wake.woke(board, ours).unwrap());
        }
        for (seen, late) in seen.iter().zip(late) {
            assert!(seen.abs_diff(1000 * late) < 1000, "{seen} ns for {late} µs");
        }
        assert_eq!(wake.woke(u32::MAX - 2_500, 6_000_000_000), None, "an old one");
    }
}
