//! Values of records that are computed from what there is in a run.

use crate::names::CommandSource;
use clutch_core::supervisor::{Cycle, State};
use clutch_core::{FixedCounts, Real, ServoOutput};

/// The position that counts show, rad. They wrap at 2³² and a target does not: of the positions that they can be it is the
/// one nearest to the target.
pub(crate) fn position(counts: i32, target: FixedCounts, radians_per_count: f64) -> f64 {
    const WRAPS: u32 = i64::BITS - i32::BITS - FixedCounts::FRACTION_BITS;
    let counts = FixedCounts::from_counts(i64::from(counts));
    let behind = target.0.wrapping_sub(counts.0) << WRAPS >> WRAPS;
    let position = FixedCounts(target.0.wrapping_sub(behind));
    position.minus::<f64>(FixedCounts(0)) * radians_per_count
}

/// The origin of a cycle's code.
pub(crate) fn source<T: Real, X>(cycle: &Cycle<T, X>) -> CommandSource {
    let safe = matches!(cycle.state, State::Holding | State::Released | State::Faulted);
    match (safe, cycle.output.is_some()) {
        (true, _) => CommandSource::Safe,
        (false, true) => CommandSource::Law,
        (false, false) => CommandSource::Unanswered,
    }
}

/// A real of the servo's output; 0 where the law was not asked. Every real of a log is a double: a number in single
/// precision is one exactly.
pub(crate) fn of_law<T: Real, X>(cycle: &Cycle<T, X>, value: fn(&ServoOutput<T, X>) -> T) -> f64 {
    cycle.output.as_ref().map_or(0.0, |out| value(out).to_f64())
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "exact")]
mod tests {
    use super::*;

    #[test]
    fn counts_that_wrapped_are_positions_beside_the_target() {
        let at = |counts, target| position(counts, FixedCounts::from_counts(target), 0.5);
        assert_eq!((at(7, 9), at(-7, 9)), (3.5, -3.5));
        let turn = 1_i64 << 32;
        assert_eq!(at(i32::MIN, i64::from(i32::MAX)), (turn / 2) as f64 * 0.5);
        assert_eq!(at(i32::MAX, -turn / 2), (-turn / 2 - 1) as f64 * 0.5);
        assert_eq!(at(-3, 5 * turn), (5 * turn - 3) as f64 * 0.5);
        // The target's fraction is not the encoder's.
        assert_eq!(position(7, FixedCounts(9 << 16 | 0xffff), 0.5), 3.5);
    }
}
