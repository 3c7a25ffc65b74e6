//! The supervisor's parameters and what they become in ticks and counts.

use crate::error::{cast, require};
use crate::safe_state::SafeState;
use crate::{Bounds, Micros, ParamError, Real, ServoParams, Target};

/// Limits within which control goes on. There is no `Default`: the safe state has to be chosen;
/// [`SupervisorParams::new`] takes it and fills in the rest.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct SupervisorParams<T = f64> {
    /// What the brake does when control ends.
    pub on_fault: SafeState<T>,
    /// Highest speed that a target may have, rad/s.
    pub speed_limit: T,
    /// Largest departure of a sample from dead reckoning that a shaft can make in a period, rad.
    pub jump: T,
    /// Samples beyond that, within 128 periods, that end control. One glitch is tolerated.
    pub jumps: u32,
    /// Samples in a row that have to pass after one was refused before the law answers again.
    pub good_samples: u32,
    /// Limit of the error at rest, rad.
    pub following_error: T,
    /// How much the limit grows with the target's speed, s.
    pub following_time: T,
    /// Time at a limit of the output that ends control, s.
    pub saturation_time: T,
    /// Distance that the shaft must have gone without a count, counts.
    pub stand_still: T,
    /// How many times the friction at the upper bound may be exceeded before a shaft under brake
    /// is expected to move.
    pub friction_margin: T,
    /// Lost samples within 128 periods that end control.
    pub lost: u32,
    /// Late samples and late answers within 128 periods that end control.
    pub late: u32,
    /// Duplicated, or reordered, samples within 128 periods that end control.
    pub disorder: u32,
    /// Periods without a sample that end control; the board's watchdog has as many.
    pub silence_cycles: u32,
    /// Longest time from a sample's arrival to its answer.
    pub deadline: Micros,
    /// Answers later than that within 128 periods that end control.
    pub overruns: u32,
}

cast!(SupervisorParams {
    speed_limit, jump, following_error, following_time, saturation_time, stand_still, friction_margin
} keep { jumps, good_samples, lost, late, disorder, silence_cycles, deadline, overruns } nested { on_fault });

impl<T: Real> SupervisorParams<T> {
    /// The given safe state with limits for the paper's shaft at 1 kHz.
    #[must_use]
    pub fn new(on_fault: SafeState<T>) -> Self {
        let degree = T::PI / T::from_i32(180);
        SupervisorParams {
            on_fault,
            speed_limit: T::from_i32(360) * degree,
            jump: T::from_f64(0.15) * degree,
            jumps: 3,
            good_samples: 1,
            following_error: degree,
            following_time: T::from_f64(0.02),
            saturation_time: T::from_f64(0.2),
            stand_still: T::from_f64(1.1),
            friction_margin: T::from_f64(1.8),
            lost: 26,
            late: 26,
            disorder: 2,
            silence_cycles: 3,
            deadline: Micros(500),
            overruns: 26,
        }
    }
}

/// The parameters in ticks, counts and SI, and what the shaft must do at least.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limits<T> {
    pub(super) period: T,
    pub(super) radians_per_count: T,
    /// Counts per period of dead reckoning.
    pub(super) jump: u32,
    pub(super) jumps: u32,
    pub(super) good_samples: u32,
    pub(super) following_error: T,
    pub(super) following_time: T,
    pub(super) saturation_cycles: u32,
    /// rad
    pub(super) stand_still: T,
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
    /// Least acceleration by the drive, rad/s²; most deceleration by the brake, rad/s² per V, and
    /// by viscous drag, 1/s.
    pub(super) drive: T,
    pub(super) brake: T,
    pub(super) drag: T,
}

impl<T: Real> Limits<T> {
    pub(super) fn new(
        p: &SupervisorParams<T>,
        servo: &ServoParams<T>,
        bounds: &Bounds<T>,
    ) -> Result<Self, ParamError<T>> {
        let period = servo.period.period::<T>()?;
        let per_radian: T = servo.encoder.counts_per_radian();
        let above_0 = |field, value: T, expected| require(field, value, value > T::ZERO, expected);
        let events = |field, n: u32| {
            let value = T::from_u64(u64::from(n));
            require(field, value, (1..=128).contains(&n), "1 to 128 within 128 periods")
        };
        above_0("speed_limit", p.speed_limit, "a finite speed above 0 rad/s")?;
        let counts = p.jump * per_radian;
        let expected = "an angle of at least one count and below 2³⁰ of them, rad";
        require("jump", p.jump, counts >= T::ONE && counts < T::from_i32(1 << 30), expected)?;
        events("jumps", p.jumps)?;
        events("lost", p.lost)?;
        events("late", p.late)?;
        events("disorder", p.disorder)?;
        events("overruns", p.overruns)?;
        let cycles = T::from_u64(u64::from(p.silence_cycles));
        let fits = (2..=1000).contains(&p.silence_cycles);
        require("silence_cycles", cycles, fits, "2 to 1000 periods")?;
        let good = T::from_u64(u64::from(p.good_samples));
        let expected =
            "at least 1, and fewer than silence_cycles: an unanswered board goes to its safe state";
        let fits = p.good_samples >= 1 && p.good_samples < p.silence_cycles;
        require("good_samples", good, fits, expected)?;
        above_0("following_error", p.following_error, "a finite angle above 0 rad")?;
        let expected = "a finite time of at least 0 s";
        require("following_time", p.following_time, p.following_time >= T::ZERO, expected)?;
        let saturation = p.saturation_time / period + T::from_f64(0.5);
        let fits = saturation >= T::ONE && saturation < T::from_f64(4e9);
        require("saturation_time", p.saturation_time, fits, "a time of 1 to 4e9 periods, s")?;
        let expected = "a number of at least 1 count";
        require("stand_still", p.stand_still, p.stand_still >= T::ONE, expected)?;
        let expected = "a number of at least 1";
        require("friction_margin", p.friction_margin, p.friction_margin >= T::ONE, expected)?;
        let deadline = T::from_u64(u64::from(p.deadline.0));
        require("deadline", deadline, p.deadline.0 >= 1, "at least 1 µs")?;
        let inertia = bounds.inertia.high;
        above_0("inertia", inertia, "bounds on the inertia that end at a finite number above 0 kg m²")?;
        let drive = bounds.drive_torque.low;
        require(
            "drive_torque",
            drive,
            true,
            "bounds on the driving torque that begin at a finite number, N m",
        )?;
        let drag = bounds.viscous_damping.high;
        let expected = "bounds on the viscous damping that end at a finite number of at least 0 N m s/rad";
        require("viscous_damping", drag, drag >= T::ZERO, expected)?;
        let strongest = bounds.mu_static.high.max(bounds.mu_dynamic.high) * bounds.brake_gain.high;
        let expected =
            "bounds on friction and brake gain whose ends give a finite number of at least 0 N m/V";
        require("brake_gain", strongest, strongest >= T::ZERO, expected)?;
        Ok(Limits {
            period,
            radians_per_count: servo.encoder.radians_per_count(),
            jump: counts.floor().to_i64() as u32,
            jumps: p.jumps,
            good_samples: p.good_samples,
            following_error: p.following_error,
            following_time: p.following_time,
            saturation_cycles: saturation.floor().to_i64() as u32,
            stand_still: p.stand_still / per_radian,
            lost: p.lost,
            late: p.late,
            disorder: p.disorder,
            silence_cycles: p.silence_cycles,
            deadline: p.deadline,
            overruns: p.overruns,
            still: T::from_f64(1e-6),
            speed_limit: p.speed_limit,
            speed_counts: p.speed_limit * per_radian * period + T::ONE,
            drive: drive / inertia,
            brake: strongest * p.friction_margin / inertia,
            drag: drag / inertia,
        })
    }

    /// Whether a path can have a target: numbers, within the speed limit, and near the last.
    pub(super) fn believes(
        &self,
        last: Option<&Target<T>>,
        goal: &Target<T>,
        tick: u64,
        served: u64,
    ) -> bool {
        let speed = goal.velocity.abs();
        if !(goal.acceleration.is_finite() && speed <= self.speed_limit) {
            return false;
        }
        let Some(last) = last else { return true };
        let periods = T::from_u64(tick.saturating_sub(served).max(1));
        let moved: T = goal.position.minus::<T>(last.position).abs();
        // A difference that wraps is farther than any path goes in a period.
        let wraps = goal.position.0.checked_sub(last.position.0).is_none();
        !wraps && moved <= self.speed_counts * periods
    }
}
