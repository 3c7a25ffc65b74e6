//! The supervisor's parameters in ticks and counts.

use super::envelope::Envelope;
use super::params::{LimitParams, SupervisorParams};
use crate::params::Table;
use crate::{
    ActuatorKind, Bounds, Dac, FixedCounts, Interval, Micros, ParamError, Real, ServoParams, Target,
};

/// The parameters in ticks, counts and SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limits<T> {
    pub(super) period: T,
    pub(super) period_us: u32,
    /// Slack of the time of a single sample, µs: a simulated board's machine may stall.
    pub(super) clock_slack_us: u32,
    pub(super) radians_per_count: T,
    /// Counts per period of dead reckoning.
    pub(super) jump: u32,
    pub(super) jumps: u32,
    pub(super) good_samples: u32,
    pub(super) following_error: T,
    pub(super) following_time: T,
    pub(super) saturation_cycles: u32,
    pub(super) lost: u32,
    pub(super) late: u32,
    pub(super) disorder: u32,
    pub(super) silence_cycles: u32,
    pub(super) deadline: Micros,
    pub(super) overruns: u32,
    /// Target velocity below which a path rests, rad/s.
    pub(super) still: T,
    speed_limit: T,
    /// Counts per period at the speed limit, and one more for rounding.
    speed_counts: T,
    actuator: ActuatorKind,
    pub(super) envelope: Envelope<T>,
}

impl<T: Real> Limits<T> {
    pub(super) fn new(
        p: &SupervisorParams<T>,
        servo: &ServoParams<T>,
        dac: Dac<T>,
        bounds: &Bounds<T>,
    ) -> Result<Self, ParamError<T>> {
        let period = servo.period.period::<T>()?;
        let per_radian: T = servo.encoder.counts_per_radian();
        p.speed.check_rows()?;
        let speed_limit = p.speed.speed_limit;
        let p = &p.limits;
        p.check_rows()?;
        let counts = p.jump * per_radian;
        LimitParams::JUMP_COUNTS.require(p.jump, counts >= T::ONE && counts < T::from_i32(1 << 30))?;
        let saturation = p.saturation_time / period + T::from_f64(0.5);
        let fits = saturation >= T::ONE && saturation < T::from_f64(4e9);
        LimitParams::SATURATION_COUNTED.require(p.saturation_time, fits)?;
        bounds.check_rows()?;
        let inertia = bounds.inertia.high;
        Interval::HIGH_USABLE.require(inertia, inertia > T::ZERO)?;
        Interval::LOW_USABLE.require(bounds.inertia.low, bounds.inertia.low > T::ZERO)?;
        Interval::LOW_USABLE.require(bounds.drive_torque.low, true)?;
        let drag = bounds.viscous_damping.high;
        Interval::HIGH_USABLE.require(drag, drag >= T::ZERO)?;
        let strongest = bounds.strongest_brake();
        Interval::HIGH_USABLE.require(strongest, strongest >= T::ZERO)?;
        Interval::HIGH_USABLE.require(bounds.drive_torque.high, true)?;
        let motor = &bounds.motor_gain;
        Interval::LOW_USABLE.require(motor.low, motor.low >= T::ZERO)?;
        Interval::HIGH_USABLE.require(motor.high, motor.high >= T::ZERO)?;
        let weakest = bounds.weakest_brake();
        Interval::LOW_USABLE.require(weakest, weakest >= T::ZERO)?;
        let speed_counts = speed_limit * per_radian * period + T::ONE;
        Ok(Limits {
            period,
            period_us: servo.period.0,
            clock_slack_us: servo.period.0.saturating_mul(4).max(20_000),
            radians_per_count: servo.encoder.radians_per_count(),
            jump: counts.floor().to_i64() as u32,
            jumps: p.jumps,
            good_samples: p.good_samples,
            following_error: p.following_error,
            following_time: p.following_time,
            saturation_cycles: saturation.floor().to_i64() as u32,
            lost: p.lost,
            late: p.late,
            disorder: p.disorder,
            silence_cycles: p.silence_cycles,
            deadline: p.deadline,
            overruns: p.overruns,
            still: T::from_f64(1e-6),
            speed_limit,
            speed_counts,
            actuator: bounds.actuator,
            envelope: Envelope::new(
                p,
                dac,
                &servo.output,
                bounds,
                per_radian * period * period,
                period,
                speed_counts + counts,
            ),
        })
    }

    /// `true` if a voltage above 0 drives the shaft.
    pub(super) fn drives_above_0(&self) -> bool {
        self.actuator.drives_above_0()
    }

    /// True if a path can have a target: numbers, within the speed limit, and near the last, so many periods ago.
    #[inline]
    pub(super) fn believes(&self, last: Option<FixedCounts>, goal: &Target<T>, periods: u32) -> bool {
        let speed = goal.velocity.abs();
        if !(goal.acceleration.is_finite() && speed <= self.speed_limit) {
            return false;
        }
        let Some(last) = last else { return true };
        // A difference that wraps is farther than any path goes in a period.
        let wraps = goal.position.0.checked_sub(last.0).is_none();
        let moved: T = goal.position.minus::<T>(last).abs();
        !wraps && moved <= self.speed_counts * T::from_u64(u64::from(periods))
    }
}
