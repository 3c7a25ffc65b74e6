//! Counts over the time between edges of the encoder, which drives call the M/T method.
//!
//! ```text
//! ω = (θ_b − θ_a) / (t_b − t_a),   t_b − t_a ≥ t_g;     |ω| ≤ q / (t − t_e) in silence
//! ```
//!
//! `a` is the edge that ended the last measurement, `b` the first one that is `t_g` later, `q` a count, `t_e` the time
//! of the last edge. A slow shaft is measured from edge to edge, a fast one over the counts of `t_g`. Where no edge
//! comes, the shaft cannot go faster than one count since the last one, so that a shaft that rests is seen to slow
//! down. Times are those of samples: an edge may be a period older. Nothing is modelled.
//!
//! After Ohmae et al., *IEEE Trans. Industrial Electronics* IE-29, 1982, 207–211, which times the edges by a counter of
//! their own.

use crate::params::{Range, Table};
use crate::{Encoder, FixedCounts, Micros, ParamError, Real};

crate::params! {
    /// Counts over the time between edges of the encoder, the M/T method of drives: from edge to edge where the shaft
    /// is slow, over the counts of some time where it is fast, and no more than a count since the last edge in silence.
    pub struct CountsOverTimeParams<T>: Default {
        /// Least time over which counts are taken. Longer is smoother and later.
        least: T = 0.002, "least_time_s" "t_g" S, Range::at_least(0.0).up_to(10.0);
    }
}

/// The measurement, checked.
#[doc(alias = "M/T method")]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CountsOverTime<T> {
    /// Least periods of a measurement.
    least: T,
    /// Velocity of one count in one period, rad/s.
    count: T,
}

/// Memory of the measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CountsOverTimeState<T> {
    /// Whole counts of the last sample.
    counts: i64,
    /// The edge with which the measurement began: the lower one of that count.
    from: i64,
    /// Periods since that edge, and since the last one.
    since: u32,
    silent: u32,
    velocity: T,
}

/// The whole counts that an encoder shows at a position.
fn whole(position: FixedCounts) -> i64 {
    position.0 >> FixedCounts::FRACTION_BITS
}

impl<T: Real> CountsOverTime<T> {
    /// Checks the parameters.
    ///
    /// # Errors
    /// `least` outside [0, 10]; `period` out of range.
    pub fn new(p: &CountsOverTimeParams<T>, encoder: Encoder, period: Micros) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let period = period.period::<T>()?;
        Ok(CountsOverTime { least: p.least / period, count: encoder.radians_per_count::<T>() / period })
    }

    /// A shaft that moves at `velocity`, rad/s, as if an edge had just been passed.
    #[must_use]
    pub fn start(&self, position: FixedCounts, velocity: T) -> CountsOverTimeState<T> {
        let counts = whole(position);
        CountsOverTimeState { counts, from: counts, since: 0, silent: 0, velocity }
    }

    /// One sample: position in, velocity out, rad/s.
    #[must_use]
    pub fn update(&self, state: &mut CountsOverTimeState<T>, position: FixedCounts) -> T {
        let counts = whole(position);
        let last = core::mem::replace(&mut state.counts, counts);
        state.since = state.since.saturating_add(1);
        state.silent = state.silent.saturating_add(1);
        if counts == last {
            let most = self.count / T::from_u64(u64::from(state.silent));
            state.velocity = state.velocity.limit(-most, most);
            return state.velocity;
        }
        state.silent = 0;
        let periods = T::from_u64(u64::from(state.since));
        if periods >= self.least {
            // The lower edge of a count is passed on the way up, its upper one on the way down.
            let edge = if counts > last { counts } else { counts.wrapping_add(1) };
            let way = T::from_i64(edge.wrapping_sub(state.from));
            state.velocity = way * self.count / periods;
            (state.from, state.since) = (edge, 0);
        }
        state.velocity
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;
    use proptest::prelude::*;
    use std::vec::Vec;

    const MS: Micros = Micros(1000);

    fn source<T: Real>(least: f64) -> CountsOverTime<T> {
        CountsOverTime::new(&CountsOverTimeParams { least: T::from_f64(least) }, Encoder::PAPER, MS).unwrap()
    }

    fn default<T: Real>() -> CountsOverTime<T> {
        CountsOverTime::new(&CountsOverTimeParams::default(), Encoder::PAPER, MS).unwrap()
    }

    fn read(angle: f64) -> FixedCounts {
        FixedCounts::from_counts((angle * 20_000.0 / TAU).floor() as i64)
    }

    /// Velocities of the samples 1 to n of a motion, by its angle, rad.
    fn seen<T: Real>(o: &CountsOverTime<T>, n: u32, angle: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut state = o.start(read(angle(0.0)), T::ZERO);
        (1..=n).map(|k| o.update(&mut state, read(angle(f64::from(k) * 1e-3))).to_f64()).collect()
    }

    #[test]
    fn a_constant_rate_is_told_to_a_period_or_a_count() {
        for degrees in [0.5_f64, 2.0, 20.0, 100.0, -2.0, -20.0] {
            let rate = degrees.to_radians();
            let told = seen::<f64>(&default(), 4000, |t| rate * t);
            // A slow shaft's time is known to a period, a fast one's way to a count.
            let edge = TAU / 20_000.0 / rate.abs();
            let time = edge.max(2e-3);
            let bound = if edge < 1e-3 { edge / time } else { 1e-3 / (time - 1e-3) };
            for velocity in &told[2000..] {
                let off = velocity / rate - 1.0;
                assert!(off.abs() <= bound, "{degrees} °/s: {off}");
            }
            let mean = told[2000..].iter().sum::<f64>() / 2000.0;
            assert!((mean / rate - 1.0).abs() < 0.02, "{degrees} °/s: {}", mean.to_degrees());
        }
    }

    #[test]
    fn a_shaft_that_stops_is_seen_to_slow_down_as_one_count_over_the_silence() {
        let rate = 20.0_f64.to_radians();
        let told = seen::<f64>(&default(), 1000, |t| rate * t.min(0.5));
        for (k, velocity) in told.iter().enumerate().skip(520) {
            let most = TAU / 20_000.0 / (k as f64 + 1.0 - 500.0) * 1e3;
            assert!(*velocity > 0.9 * most && *velocity <= 1.01 * most, "sample {k}: {velocity}, {most}");
        }
    }

    #[test]
    fn a_count_that_comes_and_goes_is_no_motion() {
        let o = default::<f64>();
        let mut state = o.start(FixedCounts::from_counts(7), 0.0);
        for k in 0..200 {
            let velocity = o.update(&mut state, FixedCounts::from_counts(7 + i64::from(k % 2)));
            // Where in the count the shaft began is not known to the first measurement.
            assert!(k < 16 || velocity == 0.0, "sample {k}: {velocity}");
        }
    }

    #[test]
    fn the_velocity_is_the_same_after_a_million_turns_and_in_either_precision() {
        let far = FixedCounts::from_counts(20_000_000_000);
        let (o, single) = (default::<f64>(), default::<f32>());
        let (mut near, mut away) = (o.start(FixedCounts(0), 0.0), o.start(far, 0.0));
        let mut short = single.start(far, 0.0);
        for k in 0..3000 {
            let step = read(0.03 * f64::from(k) * 1e-3 + 0.01 * libm::sin(f64::from(k) * 0.01));
            let velocity = o.update(&mut near, step);
            assert_eq!(velocity, o.update(&mut away, far.plus(step)));
            assert!((f64::from(single.update(&mut short, far.plus(step))) - velocity).abs() < 1e-6);
        }
    }

    /// Root mean square of the velocity's error, °/s, over 20 s behind 2 s: a rate and a sine around it.
    fn rms(least: f64, rate: f64, around: f64, hertz: f64) -> f64 {
        let (rate, around, w) = (rate.to_radians(), around.to_radians(), TAU * hertz);
        let angle =
            |t: f64| rate * t + if around > 0.0 { around / w * (1.0 - libm::cos(w * t)) } else { 0.0 };
        let told = seen::<f64>(&source(least), 22_000, angle);
        let square = |(k, velocity): (usize, &f64)| {
            let truth = rate + around * libm::sin(w * (k as f64 + 1.0) * 1e-3);
            (velocity - truth) * (velocity - truth)
        };
        libm::sqrt(told.iter().enumerate().skip(2000).map(square).sum::<f64>() / 20_000.0).to_degrees()
    }

    #[test]
    fn the_table_of_velocity_errors_of_theory_5_is_what_comes_out() {
        // Motion; `t_g` of 2, 4 and 8 ms.
        for (motion, expected) in [
            ((2.0, 0.0, 0.0), [0.08, 0.08, 0.08]),
            ((20.0, 0.0, 0.0), [3.74, 2.24, 0.71]),
            ((20.0, 10.0, 10.0), [3.35, 2.36, 3.56]),
            ((20.0, 10.0, 20.0), [3.59, 3.74, 6.32]),
        ] {
            for (least, expected) in [0.002, 0.004, 0.008].into_iter().zip(expected) {
                let found = rms(least, motion.0, motion.1, motion.2);
                assert!(
                    (found - expected).abs() < 0.01,
                    "{motion:?} over {least} s: {found}, not {expected}"
                );
            }
        }
    }

    #[test]
    fn a_time_outside_its_range_is_named() {
        for bad in [-1e-3, 10.1, f64::NAN, f64::INFINITY] {
            let e = CountsOverTime::new(&CountsOverTimeParams { least: bad }, Encoder::PAPER, MS);
            assert_eq!(e.unwrap_err().field(), "least");
        }
        let p = CountsOverTimeParams::<f64>::default();
        assert_eq!(CountsOverTime::new(&p, Encoder::PAPER, Micros(0)).unwrap_err().field(), "period");
    }

    proptest! {
        #[test]
        fn no_counts_make_the_velocity_nan(
            samples in proptest::collection::vec(any::<i64>(), 1..60), least in 0.0_f64..0.1
        ) {
            let (single, double) = (source::<f32>(least), source::<f64>(least));
            let (mut s32, mut s64) = (single.start(FixedCounts(0), 0.0), double.start(FixedCounts(0), 0.0));
            for counts in samples {
                prop_assert!(single.update(&mut s32, FixedCounts(counts)).is_finite());
                prop_assert!(double.update(&mut s64, FixedCounts(counts)).is_finite());
            }
        }
    }
}
