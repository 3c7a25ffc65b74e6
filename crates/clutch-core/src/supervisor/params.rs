//! The supervisor's parameters and what they become in ticks and counts.

use super::envelope::Envelope;
use crate::params::{Range, Table};
use crate::safe_state::SafeState;
use crate::{
    ActuatorKind, Bounds, Dac, FixedCounts, Interval, Micros, ParamError, Real, ServoParams, Target,
};

crate::params! {
    /// Limits that the supervisor watches. The defaults are for the paper's shaft at 1 kHz.
    pub struct LimitParams<T>: Default {
        /// Largest departure of a sample from where the last ones lead that a shaft can make in a period.
        jump: T = 0.15, "jump_deg" "" DEG, Range::above(0.0);
        /// Samples beyond `jump_deg`, within 128 periods, that end control. One glitch is tolerated.
        jumps: u32 = 3, "jumps" "" IN_128, Range::within(1.0, 128.0);
        /// Samples in a row that have to pass after one was refused before the law answers again.
        good_samples: u32 = 1, "good_samples" "" NONE, Range::within(1.0, 4294967295.0);
        /// Error at rest that ends control.
        following_error: T = 1.0, "following_error_deg" "" DEG, Range::above(0.0);
        /// Growth of `following_error_deg` with the target's speed.
        following_time: T = 0.02, "following_time_s" "" S, Range::at_least(0.0);
        /// Time at a limit of the voltage that ends control.
        saturation_time: T = 0.2, "saturation_time_s" "" S, Range::above(0.0);
        /// Counts by which an edge of the encoder may lie off its place.
        edge_counts: T = 0.2, "edge_counts" "" COUNTS, Range::at_least(0.0);
        /// Factor by which friction may exceed its upper bound before the counts of a shaft that it would have stopped
        /// sooner are not believed.
        friction_margin: T = 1.8, "friction_margin" "" NONE, Range::at_least(1.0);
        /// Factor by which friction may fall short of its lower bound before a shaft that is faster ends control.
        grip_margin: T = 1.2, "grip_margin" "" NONE, Range::at_least(1.0);
        /// Periods from a code to its effect, beyond the one in which it is sent; above 14 the effect may be that of any
        /// voltage of the output. No less than `rig.delay_ticks`.
        delay_cycles: u32 = 0, "delay_cycles" "" CYCLES, Range::within(0.0, 1000.0);
        /// Lost samples within 128 periods that end control.
        lost: u32 = 26, "lost" "" IN_128, Range::within(1.0, 128.0);
        /// Late samples, and codes that the board refuses as late, within 128 periods that end control.
        late: u32 = 26, "late" "" IN_128, Range::within(1.0, 128.0);
        /// Duplicated, or reordered, samples within 128 periods that end control.
        disorder: u32 = 2, "disorder" "" IN_128, Range::within(1.0, 128.0);
        /// Periods without a sample that end control.
        silence_cycles: u32 = 3, "silence_cycles" "" CYCLES, Range::within(2.0, 1000.0);
        /// Longest time from a sample's arrival to its answer.
        deadline: Micros = 500, "deadline_us" "" US, Range::within(1.0, 4294967295.0);
        /// Answers later than `deadline_us`, within 128 periods, that end control.
        overruns: u32 = 26, "overruns" "" IN_128, Range::within(1.0, 128.0);
    }
    relations(p) {
        /// The encoder resolves the jump.
        JUMP_COUNTS: jump, "an angle of at least one count of rig.encoder.counts_per_rev and below 2³⁰ of them, °";
        /// The board hears of a good sample in time.
        GOOD_IN_TIME: good_samples,
            "a number below silence_cycles: an unanswered board goes to its safe state" =>
            p.good_samples < p.silence_cycles;
        /// Ticks count the time.
        SATURATION_COUNTED: saturation_time, "a time of 1 to 4e9 times sampling.period_us";
    }
}

/// Limits within which control goes on. There is no `Default`: the safe state has to be chosen;
/// [`SupervisorParams::new`] takes it and fills in the rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SupervisorParams<T = f64> {
    /// Safe state: what the brake does when control ends.
    pub on_fault: SafeState<T>,
    /// Highest speed that a target may have.
    pub speed: SpeedLimit<T>,
    /// Limits that are watched.
    pub limits: LimitParams<T>,
}

crate::params! {
    /// The speed that a path may ask for.
    pub struct SpeedLimit<T>: Default {
        /// Highest speed that a path may ask for: a guard against a slip of units. On a board a target that moves
        /// faster ends control.
        speed_limit: T = 360.0, "speed_limit_deg_s" "" DEG_S, Range::above(0.0);
    }
}

impl<T: Real> SupervisorParams<T> {
    /// The given safe state with limits for the paper's shaft at 1 kHz.
    #[must_use]
    pub fn new(on_fault: SafeState<T>) -> Self {
        SupervisorParams { on_fault, speed: SpeedLimit::default(), limits: LimitParams::default() }
    }

    /// The same in another scalar, each real number rounded to the nearest.
    #[must_use]
    pub fn cast<U: Real>(&self) -> SupervisorParams<U> {
        SupervisorParams {
            on_fault: self.on_fault.cast(),
            speed: self.speed.cast(),
            limits: self.limits.cast(),
        }
    }
}

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
