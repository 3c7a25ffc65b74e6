//! The lag of an actuator, from releases out of two voltages.
//!
//! An actuator that follows a voltage with the time constant `τ_a` lets a brake go the later the higher the voltage `u` was, since that has to
//! fall to `u_b` first, with which the shaft breaks away; what is left of it brakes the fall for another moment:
//!
//! ```text
//! D(u) = τ_d + τ_a ln(u/u_b),   θ̈ = (T/J)(1 − (μ_d/μ_s) e^{−s/τ_a}) − (C/J) θ̇   a time s behind that
//! ```
//!
//! with the dead time `τ_d`. The logarithm of the ratio of two voltages separates the two times. `u_b` differs along the disc, by which
//! delays scatter.

use crate::Estimate;
use crate::confidence::DEVIATIONS;

/// Least logarithm of the ratio of the voltages, and fewest releases from each.
const APART: f64 = 0.2;
const FEWEST: usize = 3;
/// Deviation that a delay has at least, periods: of its grid, and of the place of an edge.
const LEAST: f64 = 0.05;
/// Most that the logarithm of a break-away's voltage departs from its mean.
const ALONG_DISC: f64 = 0.5;
/// μ_d/μ_s, for what is left of a voltage behind a break-away; and what it may be off by, which shifts the delay.
const LEFT: (f64, f64) = (0.65, 0.2);

/// Way that the brake takes of a fall at unit acceleration, in a time behind the break-away, s; damping counts for nothing in it.
pub(crate) fn left_of_fall(time: f64, lag: f64) -> f64 {
    LEFT.0 * lag * (time + lag * libm::expm1(-time / lag))
}

/// A release as far as a lag shows in it: the logarithm of the voltage before it, and its delay, s.
pub(crate) type Late = (f64, f64);

/// Delays over the logarithm of the voltage, as a straight line: its slope is the lag.
pub(crate) struct LagLine {
    /// Lag, s, from 0.
    pub(crate) lag: Estimate,
    /// The most by which a delay lies beside the line, s.
    rest: f64,
    /// Mean of logarithm and delay, and the deviation of that delay.
    mean: (Late, f64),
    deviation: f64,
    /// What is left of a voltage behind a break-away, in lags, where falls are taken for free from their delay on.
    left: f64,
}

impl LagLine {
    /// None where voltages are too few, or too close. `lag`: that of the falls whose delays these are, s.
    pub(crate) fn through(late: &[Late], lag: f64, period: f64) -> Option<LagLine> {
        let ends = late.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |e, l| (e.0.min(l.0), e.1.max(l.0)));
        let middle = 0.5 * (ends.0 + ends.1);
        let high = late.iter().filter(|l| l.0 > middle).count();
        if ends.1 - ends.0 < APART || high < FEWEST || late.len() < high + FEWEST {
            return None;
        }
        let n = late.len() as f64;
        let mean = late.iter().fold((0.0, 0.0), |sum, l| (sum.0 + l.0 / n, sum.1 + l.1 / n));
        let square = late.iter().map(|l| (l.0 - mean.0) * (l.0 - mean.0)).sum::<f64>();
        let slope = late.iter().map(|l| (l.0 - mean.0) * (l.1 - mean.1)).sum::<f64>() / square;
        let rests = late.iter().map(|l| l.1 - mean.1 - slope * (l.0 - mean.0));
        let scatter = (rests.clone().map(|r| r * r).sum::<f64>() / (n - 2.0)).sqrt();
        let scatter = scatter.max(LEAST * period);
        let deviation = scatter / square.sqrt();
        let off = DEVIATIONS * deviation;
        let left = if lag > 0.0 { 0.0 } else { LEFT.0 };
        let lag =
            Estimate { value: slope.max(0.0), low: (slope - off).max(0.0), high: (slope + off).max(0.0) };
        let rest = rests.map(f64::abs).fold(0.0, f64::max);
        Some(LagLine { lag, rest, mean: (mean, scatter / n.sqrt()), deviation, left })
    }

    /// `true` if a delay lies farther beside the line than friction along the disc lets it, and this, s.
    pub(crate) fn strays(&self, by: f64) -> bool {
        self.rest > by + ALONG_DISC * self.lag.value
    }

    /// Dead time and lag together, s: the delay of a voltage that changes slowly, of shafts that break away at `volts`; `common`: by
    /// which all delays may be off together, s.
    pub(crate) fn delay(&self, volts: f64, common: f64) -> Estimate {
        let ((_, delay), deviation) = self.mean;
        let earlier = self.earlier(volts);
        let value = (delay - earlier * self.lag.value).max(0.0);
        let off = DEVIATIONS * deviation.hypot(earlier * self.deviation) + LEFT.1 * self.lag.value + common;
        Estimate { value, low: (value - off).max(0.0), high: value + off }
    }

    /// The delay of releases, s, that no lag was needed for, as that of a voltage that changes slowly: one that may be there lets it be
    /// less.
    pub(crate) fn without(&self, delay: Estimate, volts: f64) -> Estimate {
        let less = (self.earlier(volts) * self.lag.high).max(0.0);
        Estimate { low: (delay.low - less).max(0.0), ..delay }
    }

    /// Lags by which a voltage that changes slowly acts earlier than a release.
    fn earlier(&self, volts: f64) -> f64 {
        let ((log, _), _) = self.mean;
        log - libm::log(volts) + self.left - 1.0
    }
}

/// The delay of releases from one voltage, s, which a lag made differ, as that of a voltage that changes slowly: no more than a lag
/// without a dead time lets it be less.
pub(crate) fn unseparated(delay: Estimate, over_break_away: f64) -> Estimate {
    Estimate { low: delay.low / (libm::log(over_break_away) + LEFT.0).max(1.0), ..delay }
}
