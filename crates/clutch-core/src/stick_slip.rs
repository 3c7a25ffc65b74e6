//! Stick-slip seen from encoder counts: online, in constant memory.
//!
//! On hardware the stuck state is not visible; what is visible is an encoder that stays silent
//! while the path moves on. The detector sums how far the path has moved, in counts, since the
//! encoder last moved. Once that exceeds [`StickSlipParams::gap`] and the silence has lasted
//! [`StickSlipParams::ticks`], the shaft is called stuck; the next count ends it. Each entry is
//! one stick-slip cycle, as in the paper's Table 3.
//!
//! Sticks that come once in each count show no silence: edges are as even as in even motion. And a shaft that nearly stops
//! is silent for as long as one that does. `docs/meter.md` has precision and recall, and what the voltage shows besides.

use crate::params::{Range, Table};
use crate::{Counts, Encoder, Micros, ParamError, Real};

crate::params! {
    /// Conditions under which silence counts as sticking.
    pub struct StickSlipParams<T>: Default {
        /// Movement of the path during which the encoder shows none. Above 1 count, or a shaft in even motion
        /// would count as stuck.
        gap: T = 1.25, "gap_counts" "" COUNTS, Range::above(1.0);
        /// Shortest silence.
        ticks: u32 = 6, "silence_ticks" "" TICKS, Range::within(1.0, 4294967295.0);
    }
}

/// The detector, checked.
///
/// ```
/// use clutch_core::{Counts, Encoder, Micros, StickSlip, StickSlipParams, StickSlipState};
/// let detector = StickSlip::<f32>::new(&StickSlipParams::default(), Encoder::PAPER, Micros(1000))?;
/// let mut state = StickSlipState::default();
/// let rate = 2.0_f32.to_radians(); // a count each 9 ms
/// for _ in 0..20 { detector.update(&mut state, Counts(7), rate); }
/// assert!(state.stuck());
/// assert_eq!(state.cycles(), 1);
/// # Ok::<(), clutch_core::ParamError<f32>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StickSlip<T> {
    gap: T,
    ticks: u32,
    counts_per_tick_second: T,
}

/// Memory of the detector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StickSlipState<T> {
    last: Counts,
    started: bool,
    stuck: bool,
    silent_ticks: u32,
    path_moved: T,
    cycles: u64,
    stuck_ticks: u64,
    ticks: u64,
    stick_at: Option<Counts>,
    stair: u32,
}

impl<T: Real> StickSlipState<T> {
    /// The shaft is stuck now.
    #[must_use]
    pub fn stuck(&self) -> bool {
        self.stuck
    }

    /// Stick-slip cycles so far: entries into the stuck state.
    #[must_use]
    pub fn cycles(&self) -> u64 {
        self.cycles
    }

    /// Ticks spent stuck, the silence before the detection included.
    #[must_use]
    pub fn stuck_ticks(&self) -> u64 {
        self.stuck_ticks
    }

    /// Ticks since the counts have moved.
    #[must_use]
    pub fn silent_ticks(&self) -> u32 {
        self.silent_ticks
    }

    /// Ticks seen.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// Stair height: largest movement between one stick and the next, counts.
    #[must_use]
    pub fn stair(&self) -> u32 {
        self.stair
    }
}

impl<T: Real> StickSlip<T> {
    /// Checks the parameters.
    ///
    /// # Errors
    /// `gap` not above 1, `ticks` 0, `period` out of range.
    pub fn new(p: &StickSlipParams<T>, encoder: Encoder, period: Micros) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let counts_per_tick_second = encoder.counts_per_radian::<T>() * period.period::<T>()?;
        Ok(StickSlip { gap: p.gap, ticks: p.ticks, counts_per_tick_second })
    }

    /// One sample: counts and the path's velocity (rad/s) in; whether a stick begins here out.
    pub fn update(&self, state: &mut StickSlipState<T>, counts: Counts, target_velocity: T) -> bool {
        state.ticks = state.ticks.wrapping_add(1);
        let moved = counts.since(state.last) != 0;
        state.last = counts;
        if moved || !state.started {
            state.started = true;
            state.stuck = false;
            state.silent_ticks = 0;
            state.path_moved = T::ZERO;
            return false;
        }
        state.silent_ticks = state.silent_ticks.saturating_add(1);
        let step = (target_velocity * self.counts_per_tick_second).abs();
        // A path that is not a number moves nothing.
        state.path_moved += if step.is_finite() { step } else { T::ZERO };
        if state.stuck {
            state.stuck_ticks = state.stuck_ticks.wrapping_add(1);
            return false;
        }
        if state.silent_ticks < self.ticks || state.path_moved < self.gap {
            return false;
        }
        state.stuck = true;
        state.cycles = state.cycles.wrapping_add(1);
        state.stuck_ticks = state.stuck_ticks.wrapping_add(u64::from(state.silent_ticks));
        if let Some(at) = state.stick_at {
            state.stair = state.stair.max(counts.since(at).unsigned_abs());
        }
        state.stick_at = Some(counts);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn detector() -> StickSlip<f64> {
        StickSlip::new(&StickSlipParams::default(), Encoder::PAPER, Micros(1000)).unwrap()
    }

    #[test]
    fn even_motion_never_sticks_whatever_its_speed() {
        for rate_deg_s in [0.5, 2.0, 6.0, 10.0, 17.9, 18.0, 20.0, 100.0] {
            let (d, mut s) = (detector(), StickSlipState::default());
            for k in 0..20_000 {
                let counts = Counts((f64::from(k) * 1e-3 * rate_deg_s / 0.018).floor() as i32);
                assert!(!d.update(&mut s, counts, f64::to_radians(rate_deg_s)), "{rate_deg_s} °/s, tick {k}");
            }
        }
    }

    #[test]
    fn stairs_of_three_counts_are_counted_one_by_one() {
        let (d, mut s) = (detector(), StickSlipState::default());
        // 2 °/s in stairs: three counts at once each 27 ms.
        for k in 0..2_700 {
            d.update(&mut s, Counts(k / 27 * 3), 2.0_f64.to_radians());
        }
        assert_eq!(s.cycles(), 100);
        assert_eq!(s.stair(), 3);
        assert!(s.stuck_ticks() > 2_500);
    }

    #[test]
    fn a_path_that_rests_is_not_stick_slip() {
        let (d, mut s) = (detector(), StickSlipState::default());
        for _ in 0..100_000 {
            d.update(&mut s, Counts(5), 0.0);
        }
        assert_eq!(s.cycles(), 0);
    }

    #[test]
    fn a_shaft_that_stands_is_stuck_until_it_moves_and_each_period_is_counted() {
        let (d, mut s) = (detector(), StickSlipState::default());
        for k in 0..1000 {
            d.update(&mut s, Counts(5), 10.0_f64.to_radians());
            assert_eq!(s.ticks(), k + 1);
        }
        assert!(s.stuck());
        assert_eq!(s.silent_ticks(), 999, "the first sample is no silence");
        for k in 0..100 {
            d.update(&mut s, Counts(5 + k), 10.0_f64.to_radians());
        }
        assert!(!s.stuck());
    }

    #[test]
    fn a_velocity_that_is_no_number_moves_no_path() {
        let (d, mut s) = (detector(), StickSlipState::default());
        for _ in 0..1000 {
            d.update(&mut s, Counts(5), f64::NAN);
        }
        assert!(!s.stuck());
        assert_eq!((s.cycles(), s.ticks()), (0, 1000));
    }
}
