//! The supervisor's parameters.

use crate::params::Range;
use crate::safe_state::SafeState;
use crate::{Micros, Real};

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
