//! Each check at its threshold and just below it, the state machine, and what no sample may do.
//!
//! The paper's shaft, in both scalars. A path of one count a period is 18 °/s at 1 kHz.

use super::*;
use crate::law::CtcParams;
use crate::law::{Command, Law, LawParams, OutputParams, PdParams, SmcParams, Tick};
use crate::{Counts, FixedCounts, Micros, PlantParams, SafeState, Tolerances};
use proptest::prelude::*;
use std::format;
use std::vec::Vec;

/// 5 V in the paper's converter.
const SAFE: DacCode = DacCode(3072);
/// 0 V.
const ZERO_VOLTS: DacCode = DacCode(2048);

/// The same physics in single and in double precision.
macro_rules! in_both_scalars {
    ($($(#[doc = $doc:literal])* fn $name:ident<$t:ident>() $body:block)+) => {$(
        $(#[doc = $doc])*
        #[test]
        fn $name() {
            fn in_scalar<$t: Real>() $body
            in_scalar::<f32>();
            in_scalar::<f64>();
        }
    )+};
}

fn params<T: Real>() -> SupervisorParams<T> {
    SupervisorParams::new(SafeState::hold(T::from_i32(5)))
}

fn paper<T: Real>() -> ServoParams<T> {
    ServoParams::paper(LawParams::Pd(PdParams::default()))
}

fn bounds<T: Real>() -> Bounds<T> {
    Bounds::around(&PlantParams::default(), &Tolerances::default()).unwrap()
}

/// A straight path: `rate` counts a period from `origin` on.
fn line<T: Real>(origin: i64, rate: i64) -> impl Fn(u64) -> Target<T> + Copy {
    let per_count: T = crate::Encoder::PAPER.radians_per_count();
    move |tick| Target {
        position: FixedCounts::from_counts(origin.wrapping_add(rate.wrapping_mul(tick as i64))),
        velocity: T::from_i64(rate * 1000) * per_count,
        acceleration: T::ZERO,
    }
}

/// All checks but the envelope's: most tests' shaft knows no physics. Those of the envelope are in `envelope/tests.rs`.
fn kinematic() -> Checks {
    ENVELOPE.into_iter().fold(Checks::ALL.without(Cause::Clock), Checks::without)
}

const ENVELOPE: [Cause; 5] =
    [Cause::StandStill, Cause::Channel, Cause::Reversed, Cause::TooSlow, Cause::TooFast];

/// A supervised servo that is fed sample by sample.
struct Rig<T: Real, C: ControlLaw<T> = Law<T>> {
    servo: Servo<T, C>,
    supervisor: Supervisor<T>,
    state: SupervisorState<T, C::State>,
    /// Number of the next sample.
    sequence: u16,
    /// Counts of the path at tick 0, and per period.
    path: (i64, i64),
    /// Counts that the shaft is ahead of the path's tick 0, and how many fresh samples were sent.
    ahead: i32,
    sent: i64,
}

impl<T: Real> Rig<T> {
    fn with(p: &SupervisorParams<T>, s: &ServoParams<T>) -> Self {
        Rig::around(p, s, Servo::new(s).unwrap())
    }

    /// In Armed, on a path of 18 °/s from count 1000 on.
    fn armed() -> Self {
        Rig::with(&params(), &paper()).arm()
    }

    /// In Running, after ten samples on the path.
    fn running() -> Self {
        Rig::armed().warm()
    }
}

impl<T: Real, C: ControlLaw<T>> Rig<T, C> {
    fn around(p: &SupervisorParams<T>, s: &ServoParams<T>, servo: Servo<T, C>) -> Self {
        let supervisor = Supervisor::new(p, s, &bounds()).unwrap().with_checks(kinematic());
        let state = SupervisorState::default();
        Rig { servo, supervisor, state, sequence: 0, path: (1000, 1), ahead: 0, sent: 0 }
    }

    fn arm(mut self) -> Self {
        self.supervisor.connect(&mut self.state);
        assert!(self.supervisor.arm(&mut self.state, ZERO_VOLTS));
        self
    }

    fn warm(mut self) -> Self {
        for _ in 0..10 {
            assert_eq!(self.good().state, State::Running);
        }
        self
    }

    /// A sample of a shaft that follows the path; not sent yet.
    fn fresh(&self) -> Sample {
        let counts = self.path.0 + self.path.1 * self.sent + i64::from(self.ahead);
        Sample {
            sequence: self.sequence,
            time: Micros((self.sent as u32).wrapping_mul(1000)),
            counts: Counts(counts as i32),
            board: BoardMode::Driving,
            ..Sample::default()
        }
    }

    /// The board's clock goes on; what it sent is lost.
    fn lose(&mut self) {
        self.sequence = self.sequence.wrapping_add(1);
        self.sent += 1;
    }

    /// Sends a sample, fresh or changed, in the place of the next one.
    fn send(&mut self, sample: Sample) -> Cycle<T, C::Terms> {
        self.lose();
        self.again(sample)
    }

    /// Sends a sample for which no period of the board has passed.
    fn again(&mut self, sample: Sample) -> Cycle<T, C::Terms> {
        self.supervisor.sample(&self.servo, &mut self.state, &sample, line(self.path.0, self.path.1))
    }

    fn good(&mut self) -> Cycle<T, C::Terms> {
        self.send(self.fresh())
    }

    /// A sample whose counts are off by `counts`.
    fn off(&mut self, counts: i32) -> Cycle<T, C::Terms> {
        let mut sample = self.fresh();
        sample.counts.0 = sample.counts.0.wrapping_add(counts);
        self.send(sample)
    }

    /// A sample with a target of its own.
    fn aimed(&mut self, change: impl Fn(Target<T>) -> Target<T>) -> Cycle<T, C::Terms> {
        let (sample, path) = (self.fresh(), line(self.path.0, self.path.1));
        self.lose();
        self.supervisor.sample(&self.servo, &mut self.state, &sample, |tick| change(path(tick)))
    }

    fn runs(&self) -> bool {
        self.state.state() == State::Running
    }
}

/// Faulted in this very cycle, with the safe output and without an answer; what the check saw.
#[track_caller]
fn faulted<T: Real, X>(cycle: &Cycle<T, X>, cause: Cause) -> f64 {
    assert_eq!((cycle.state, cycle.cause), (State::Faulted, cause));
    assert_eq!((cycle.answer, cycle.code), (None, SAFE), "the safe state is there in the same cycle");
    cycle.value.to_f64()
}

#[track_caller]
fn answered<T: Real, X>(cycle: &Cycle<T, X>) {
    assert_eq!((cycle.state, cycle.cause), (State::Running, Cause::None));
    assert_eq!(cycle.answer, Some(cycle.code));
}

/// Events one in every `every` periods: how many until control ends, at most 1000.
fn events_until_the_end<T: Real>(every: u32, event: impl Fn(&mut Rig<T>)) -> Option<u32> {
    let mut rig = Rig::<T>::running();
    for n in 1..=1000 {
        for _ in 1..every {
            rig.good();
        }
        event(&mut rig);
        if !rig.runs() {
            return Some(n);
        }
    }
    None
}

// The checks.

in_both_scalars! {
    fn the_26th_lost_sample_within_128_periods_ends_control_and_a_rarer_loss_never<T>() {
        let lose_one = |rig: &mut Rig<T>| {
            rig.lose();
            rig.good();
        };
        // 26 events, 4 periods apart, are 104 periods; 5 apart they would be 129.
        assert_eq!(events_until_the_end(3, lose_one), Some(26));
        assert_eq!(events_until_the_end(5, lose_one), None, "22 of 128 periods are tolerated");
        let mut rig = Rig::<T>::running();
        for _ in 0..25 {
            lose_one(&mut rig);
        }
        answered(&rig.good());
        rig.lose();
        assert_eq!(faulted(&rig.good(), Cause::Lost), 26.0, "the value is the count");
        assert_eq!(rig.state.lost(), 26);
    }

    fn the_26th_late_sample_or_answer_ends_control<T>() {
        for late in [
            |s: Sample| Sample { superseded: true, ..s },
            |s: Sample| Sample { command_late: true, ..s },
            |s: Sample| Sample { command_late: true, superseded: true, ..s },
        ] {
            let mut rig = Rig::<T>::running();
            for n in 1..26 {
                let cycle = rig.send(late(rig.fresh()));
                assert_eq!(cycle.state, State::Running, "event {n} of 25 is tolerated");
            }
            assert_eq!(faulted(&rig.send(late(rig.fresh())), Cause::Late), 26.0);
            assert_eq!(events_until_the_end(6, |rig: &mut Rig<T>| { rig.send(late(rig.fresh())); }), None);
        }
    }

    fn the_second_sample_that_comes_twice_ends_control<T>() {
        let mut rig = Rig::<T>::running();
        let sample = rig.fresh();
        rig.send(sample);
        let before = rig.state.servo;
        let cycle = rig.again(sample);
        assert_eq!((cycle.arrival, cycle.state, cycle.answer), (Arrival::Duplicate, State::Running, None));
        assert_eq!(rig.state.servo, before, "it does not reach the law");
        answered(&rig.good());
        assert_eq!(faulted(&rig.again(Sample { sequence: rig.sequence.wrapping_sub(1), ..rig.fresh() }), Cause::Duplicated), 2.0);
    }

    fn the_second_sample_that_comes_after_a_newer_one_ends_control<T>() {
        let mut rig = Rig::<T>::running();
        let overtaken = rig.fresh();
        rig.lose();
        rig.good();
        let before = rig.state.servo;
        let cycle = rig.again(overtaken);
        assert_eq!((cycle.arrival, cycle.state, cycle.answer), (Arrival::Reordered, State::Running, None));
        assert_eq!(rig.state.servo, before, "it does not reach the law");
        answered(&rig.good());
        assert_eq!(faulted(&rig.again(overtaken), Cause::Reordered), 2.0);
    }

    fn eight_counts_off_dead_reckoning_are_a_shaft_and_nine_are_a_jump<T>() {
        // 0.15° are 8.3 counts.
        for (off, passes) in [(8, true), (-8, true), (9, false), (-9, false)] {
            let mut rig = Rig::<T>::running();
            let cycle = rig.off(off);
            assert_eq!(cycle.arrival == Arrival::Fresh, passes, "{off} counts");
            assert_eq!(cycle.answer.is_some(), passes, "{off} counts");
            assert_eq!(rig.state.rejected(), u64::from(!passes));
        }
    }

    fn the_third_jump_within_128_periods_ends_control<T>() {
        let mut rig = Rig::<T>::running();
        for _ in 0..2 {
            assert_eq!(rig.off(1000).state, State::Running);
            answered(&rig.good());
        }
        assert_eq!(faulted(&rig.off(1000), Cause::Jump), 1000.0, "the value is how far off, counts");
        assert_eq!(events_until_the_end(64, |rig: &mut Rig<T>| { rig.off(9); }), None, "two in 128 periods");
    }

    fn a_shaft_that_stays_where_it_jumped_to_ends_control_in_the_third_sample<T>() {
        let mut rig = Rig::<T>::running();
        rig.ahead = 100;
        assert_eq!(rig.good().state, State::Running);
        assert_eq!(rig.good().state, State::Running);
        faulted(&rig.good(), Cause::Jump);
    }

    fn the_less_dead_reckoning_knows_the_more_it_lets_pass<T>() {
        // After one refused or lost sample an eighth more: 9 counts of 8.3 · 9/8 = 9.
        for (off, passes) in [(9, true), (10, false)] {
            for refused in [true, false] {
                let mut rig = Rig::<T>::running();
                if refused { rig.off(1000); } else { rig.lose(); }
                assert_eq!(rig.off(off).arrival == Arrival::Fresh, passes, "{off} counts");
            }
        }
    }

    fn a_shaft_under_full_brake_may_stand<T>() {
        let mut rig = Rig::<T>::armed();
        rig.supervisor = rig.supervisor.with_checks(Checks::ALL);
        (rig.path, rig.ahead) = ((1000, 0), 20);
        for k in 0..1000 {
            let cycle = rig.good();
            assert_eq!((cycle.state, cycle.cause), (State::Running, Cause::None), "sample {k}");
            assert_eq!(cycle.output.unwrap().code, rig.servo.dac().top());
        }
    }

    fn the_following_error_may_be_one_degree_at_rest_and_more_at_speed<T>() {
        // 1° is 55.6 counts; at 18 °/s the limit is 1° + 0.02 s · 18 °/s = 1.36°, 75.6 counts.
        for (rate, off, passes) in
            [(0, 55, true), (0, 56, false), (1, 75, true), (1, 76, false), (-1, 75, true), (-1, 76, false)]
        {
            for ahead in [off, -off] {
                let mut rig = Rig::<T>::armed();
                (rig.path, rig.ahead) = ((1000, rate), ahead);
                let cycle = rig.good();
                if passes {
                    answered(&cycle);
                } else {
                    let error = faulted(&cycle, Cause::FollowingError);
                    let expected = -f64::from(ahead) * 0.018_f64.to_radians();
                    assert!((error - expected).abs() < 1e-6, "the value is the error: {error} rad");
                }
            }
        }
    }

    fn a_following_error_of_exactly_the_limit_passes_and_of_the_number_above_it_does_not<T>() {
        let at = |limit: T| {
            let mut p = params::<T>();
            (p.limits.following_error, p.limits.following_time) = (limit, T::ZERO);
            let mut rig = Rig::with(&p, &paper()).arm();
            (rig.path, rig.ahead) = ((1000, 0), 40);
            rig.good()
        };
        let error = at(T::from_f64(0.1)).output.unwrap().tick.error.abs();
        answered(&at(error));
        faulted(&at(error * (T::ONE - T::from_f64(1e-6))), Cause::FollowingError);
    }

    fn the_200th_period_at_a_limit_of_the_output_ends_control<T>() {
        // 20 counts ahead of the path the law wants 31 V of 10 V; behind it, less than 0 V.
        for (ahead, volts) in [(20, 10.0), (-20, 0.0)] {
            let mut rig = Rig::<T>::armed();
            rig.ahead = ahead;
            for k in 0..199 {
                assert_eq!(rig.good().state, State::Running, "period {k} of 199 at {volts} V");
            }
            assert_eq!(faulted(&rig.good(), Cause::Saturation), volts, "the value is the demand, V");
        }
    }

    fn lost_periods_at_a_limit_count_as_saturated_too<T>() {
        let mut rig = Rig::<T>::armed();
        rig.ahead = 20;
        // Ten gaps of one sample: 199 periods.
        for k in 0..189 {
            if k % 18 == 17 { rig.lose(); }
            assert_eq!(rig.good().state, State::Running, "sample {k}");
        }
        faulted(&rig.good(), Cause::Saturation);
    }

    fn a_demand_within_the_limits_starts_the_time_of_saturation_anew<T>() {
        let mut rig = Rig::<T>::armed();
        for round in 0..4 {
            rig.ahead = 2;
            for k in 0..120 {
                // Two counts ahead and going on ahead by steps that the gate lets pass.
                rig.ahead = (rig.ahead + 2).min(20);
                assert_eq!(rig.good().state, State::Running, "round {round}, period {k}");
            }
            // Back by a count in each second period: never still for long.
            while rig.ahead > 1 {
                rig.good();
                rig.ahead -= 1;
                let cycle = rig.good();
                assert_eq!((cycle.state, cycle.cause), (State::Running, Cause::None), "round {round}");
            }
            // The error's rate has to die away: it holds the demand below 0 V for a while.
            let within = (0..30).any(|_| rig.good().output.unwrap().command.limit == Limit::None);
            assert!(within, "the demand is within the limits again");
        }
    }

    fn a_target_that_is_no_number_ends_control_before_the_law_sees_it<T>() {
        for bad in [T::from_f64(f64::NAN), T::ONE / T::ZERO, -T::ONE / T::ZERO] {
            for which in 0..2 {
                let mut rig = Rig::<T>::running();
                let before = rig.state.servo;
                let cycle = rig.aimed(|t| match which {
                    0 => Target { velocity: bad, ..t },
                    _ => Target { acceleration: bad, ..t },
                });
                faulted(&cycle, Cause::Target);
                assert_eq!(rig.state.servo, before);
                assert!(cycle.output.is_none());
            }
        }
    }

    fn a_target_may_have_the_speed_limit_and_no_more<T>() {
        let limit = params::<T>().speed.speed_limit;
        for sign in [T::ONE, -T::ONE] {
            // At 0.02 s · 360 °/s the following error may be 8.2°, so only the speed can trip.
            answered(&Rig::<T>::running().aimed(|t| Target { velocity: sign * limit, ..t }));
            let above = limit * T::from_f64(1.000_001);
            let seen = faulted(&Rig::<T>::running().aimed(|t| Target { velocity: sign * above, ..t }), Cause::Target);
            assert_eq!(seen, (sign * above).to_f64(), "the value is the speed, rad/s");
        }
    }

    fn a_target_may_move_as_far_in_a_period_as_the_speed_limit_allows<T>() {
        // 360 °/s are 20 counts a period, and one is for rounding; the path goes 1 by itself.
        for (step, lost, passes) in [(19, 0, true), (21, 0, false), (-21, 0, true), (-23, 0, false), (39, 1, true), (42, 1, false)] {
            let mut rig = Rig::<T>::running();
            for _ in 0..lost { rig.lose(); }
            let at = rig.sent as u64;
            let cycle = rig.aimed(|t| Target { position: t.position.plus(FixedCounts::from_counts(step)), ..t });
            assert_eq!(cycle.tick, at);
            if passes { answered(&cycle); } else { faulted(&cycle, Cause::Target); }
        }
        let mut rig = Rig::<T>::running();
        faulted(&rig.aimed(|t| Target { position: FixedCounts(i64::MIN), ..t }), Cause::Target);
    }

    fn the_26th_answer_beyond_the_deadline_ends_control<T>() {
        let at = |us: u32| move |rig: &mut Rig<T>| { rig.send(Sample { lateness: Micros(us), ..rig.fresh() }); };
        assert_eq!(events_until_the_end(1, at(501)), Some(26));
        assert_eq!(events_until_the_end(1, at(500)), None, "500 µs are in time");
        assert_eq!(events_until_the_end(6, at(501)), None, "22 of 128 are tolerated");
        let mut rig = Rig::<T>::running();
        let last = (0..26).map(|k| rig.send(Sample { lateness: Micros(600 + k), ..rig.fresh() })).last();
        assert_eq!(faulted(&last.unwrap(), Cause::Deadline), 625.0, "the value is the time, µs");
        assert_eq!(rig.state.deadline_misses(), 26);
    }

    fn three_periods_without_a_sample_are_silence_and_two_are_not<T>() {
        let mut rig = Rig::<T>::running();
        rig.supervisor.silence(&mut rig.state, 2);
        assert!(rig.runs());
        rig.supervisor.silence(&mut rig.state, 3);
        assert_eq!((rig.state.state(), rig.state.cause(), rig.state.code()), (State::Faulted, Cause::Silence, SAFE));
        assert_eq!(rig.state.value(), T::from_i32(3));

        let mut rig = Rig::<T>::running();
        rig.lose();
        rig.lose();
        answered(&rig.good());
        for _ in 0..3 { rig.lose(); }
        assert_eq!(faulted(&rig.good(), Cause::Silence), 3.0, "a gap that nobody timed is silence all the same");
    }

    fn a_board_that_reports_a_fault_or_does_not_drive_ends_control<T>() {
        for bad in [
            |s| Sample { encoder_fault: true, ..s },
            |s| Sample { converter_fault: true, ..s },
            |s| Sample { board: BoardMode::Safe, ..s },
            |s| Sample { board: BoardMode::Ready, ..s },
        ] {
            let mut rig = Rig::<T>::running();
            faulted(&rig.send(bad(rig.fresh())), Cause::Board);
            let mut rig = Rig::<T>::armed();
            faulted(&rig.send(bad(rig.fresh())), Cause::Board);
        }
        let mut rig = Rig::<T>::running();
        rig.supervisor.board_fault(&mut rig.state, T::from_i32(2));
        assert_eq!((rig.state.state(), rig.state.cause()), (State::Faulted, Cause::Board));
        assert_eq!(rig.state.value(), T::from_i32(2));
    }

    fn a_watchdog_that_bit_after_late_answers_is_named_late<T>() {
        let mut rig = Rig::<T>::running();
        rig.send(Sample { command_late: true, ..rig.fresh() });
        faulted(&rig.send(Sample { board: BoardMode::Safe, ..rig.fresh() }), Cause::Late);
        let mut rig = Rig::<T>::running();
        rig.send(Sample { command_late: true, ..rig.fresh() });
        rig.supervisor.board_fault(&mut rig.state, T::ONE);
        assert_eq!(rig.state.cause(), Cause::Late);
    }

    fn a_board_that_does_not_drive_is_no_fault_before_consent<T>() {
        let mut rig = Rig::<T>::with(&params(), &paper());
        rig.supervisor.connect(&mut rig.state);
        for board in [BoardMode::Ready, BoardMode::Safe, BoardMode::Driving] {
            let cycle = rig.send(Sample { board, ..rig.fresh() });
            assert_eq!((cycle.state, cycle.answer), (State::Ready, None));
        }
        let cycle = rig.send(Sample { encoder_fault: true, ..rig.fresh() });
        assert_eq!((cycle.state, cycle.cause), (State::Faulted, Cause::Board), "but no encoder is");
    }

    fn an_event_127_periods_ago_counts_and_one_128_ago_does_not<T>() {
        for (apart, ends) in [(127, true), (128, false)] {
            let mut rig = Rig::<T>::running();
            rig.again(Sample { sequence: rig.sequence.wrapping_sub(1), ..rig.fresh() });
            for _ in 0..apart { rig.good(); }
            rig.again(Sample { sequence: rig.sequence.wrapping_sub(1), ..rig.fresh() });
            assert_eq!(!rig.runs(), ends, "{apart} periods apart");
        }
    }

    fn each_check_ends_control_and_only_that_one_does<T>() {
        for cause in Cause::CHECKS {
            let out = |checks| provoke::<T>(cause, checks);
            assert_eq!(out(Checks::ALL), (State::Faulted, cause));
            let without = out(Checks::ALL.without(cause));
            assert_ne!(without.1, cause, "{cause:?} is out and still ends control");
        }
    }
}

/// Does what the check is there for.
fn provoke<T: Real>(cause: Cause, checks: Checks) -> (State, Cause) {
    if cause == Cause::NotFinite {
        let mut rig = spoilt::<T>(Spoilt::Term);
        rig.supervisor = rig.supervisor.with_checks(checks);
        for _ in 0..5 {
            rig.good();
        }
        return (rig.state.state(), rig.state.cause());
    }
    let mut rig = Rig::<T>::armed();
    let others = if ENVELOPE.contains(&cause) || cause == Cause::Clock { Checks::ALL } else { kinematic() };
    rig.supervisor = rig.supervisor.with_checks(Checks::both(checks, others));
    rig.path.1 = match cause {
        Cause::StandStill | Cause::Channel | Cause::TooFast | Cause::Clock => 0,
        Cause::Reversed => -1,
        Cause::TooSlow => 8,
        _ => 1,
    };
    if cause == Cause::Saturation {
        rig.ahead = 20;
    }
    if cause == Cause::FollowingError {
        rig.ahead = -90;
    }
    if cause == Cause::Channel {
        rig.ahead = -20;
    }
    if cause == Cause::Clock {
        // Under full brake the shaft may stand.
        rig.ahead = 20;
    }
    rig.good();
    for k in 1..=210 {
        let old = Sample { sequence: rig.sequence.wrapping_sub(1), ..rig.fresh() };
        match cause {
            Cause::Lost => rig.lose(),
            Cause::Late => {
                rig.send(Sample { command_late: true, ..rig.fresh() });
            }
            Cause::Duplicated => {
                rig.again(old);
            }
            Cause::Reordered => {
                rig.again(Sample { sequence: old.sequence.wrapping_sub(1), ..old });
            }
            Cause::Jump => {
                rig.off(1000);
            }
            Cause::Deadline => {
                rig.send(Sample { lateness: Micros(501), ..rig.fresh() });
            }
            Cause::Silence => rig.supervisor.silence(&mut rig.state, 3),
            Cause::Board => {
                rig.send(Sample { converter_fault: true, ..rig.fresh() });
            }
            // Behind its path, so that the brake is open.
            Cause::Channel => rig.ahead = -20 - (k & 1),
            Cause::TooFast => rig.ahead += k,
            // Half as fast as it should.
            Cause::Clock => {
                rig.send(Sample { time: Micros(500 * k as u32), ..rig.fresh() });
                continue;
            }
            Cause::TooSlow if k > 8 => rig.ahead -= 4,
            Cause::Target => {
                rig.aimed(|t| Target { acceleration: T::ONE / T::ZERO, ..t });
            }
            _ => {}
        }
        rig.good();
    }
    (rig.state.state(), rig.state.cause())
}

// A law that goes wrong.

#[derive(Clone, Copy)]
enum Spoilt {
    Term,
    Voltage,
    Invalid,
    Nothing,
}

/// A law of 2 V that answers `what` in its fourth tick.
struct Breaks(Spoilt);

impl<T: Real> ControlLaw<T> for Breaks {
    type State = u32;
    type Terms = [T; 2];
    const TERMS: &'static [&'static str] = &["first", "second"];

    fn start(&self, _: &Tick<T>, _: T) -> u32 {
        0
    }

    fn update(&self, state: &mut u32, _: &Tick<T>) -> Command<T, [T; 2]> {
        *state += 1;
        let nan = T::from_f64(f64::NAN);
        let good = Command { voltage: T::from_i32(2), ..Command::default() };
        match self.0 {
            _ if *state < 4 => good,
            Spoilt::Nothing => good,
            Spoilt::Term => Command { terms: [T::ZERO, nan], ..good },
            Spoilt::Voltage => Command { voltage: nan, ..good },
            Spoilt::Invalid => Command { limit: Limit::Invalid, ..good },
        }
    }
}

fn spoilt<T: Real>(what: Spoilt) -> Rig<T, Breaks> {
    let servo = Servo::with_law(&paper(), Breaks(what)).unwrap();
    Rig::around(&params(), &paper(), servo).arm()
}

in_both_scalars! {
    fn a_law_whose_term_or_demand_is_no_number_ends_control_and_its_code_is_not_sent<T>() {
        for what in [Spoilt::Term, Spoilt::Voltage, Spoilt::Invalid] {
            let mut rig = spoilt::<T>(what);
            for _ in 0..3 {
                answered(&rig.good());
            }
            faulted(&rig.good(), Cause::NotFinite);
        }
        let mut rig = spoilt::<T>(Spoilt::Nothing);
        for _ in 0..10 {
            answered(&rig.good());
        }
    }
}

// The state machine.

#[derive(Clone, Copy, Debug)]
enum Event {
    Connect,
    Disconnect,
    Arm,
    Acknowledge,
    Stop,
    BoardFault,
    Silence,
    Sample,
}

const EVENTS: [Event; 8] = [
    Event::Connect,
    Event::Disconnect,
    Event::Arm,
    Event::Acknowledge,
    Event::Stop,
    Event::BoardFault,
    Event::Silence,
    Event::Sample,
];

impl<T: Real> Rig<T> {
    fn happens(&mut self, event: Event) {
        let (v, s) = (self.supervisor, &mut self.state);
        match event {
            Event::Connect => v.connect(s),
            Event::Disconnect => v.disconnect(s),
            Event::Arm => assert_eq!(v.arm(s, ZERO_VOLTS), s.state() == State::Armed),
            Event::Acknowledge => v.acknowledge(s),
            Event::Stop => v.stop(s, Cause::Operator),
            Event::BoardFault => v.board_fault(s, T::ONE),
            Event::Silence => v.silence(s, 3),
            Event::Sample => {
                self.good();
            }
        }
    }

    /// By the shortest way, under the safe state `on_fault`.
    fn in_state(state: State, on_fault: SafeState<T>) -> Self {
        let way: &[Event] = match state {
            State::Disconnected => &[],
            State::Ready => &[Event::Connect],
            State::Armed => &[Event::Connect, Event::Arm],
            State::Running => &[Event::Connect, Event::Arm, Event::Sample],
            State::Holding | State::Released => &[Event::Connect, Event::Arm, Event::Sample, Event::Stop],
            State::Faulted => &[Event::Connect, Event::Arm, Event::Sample, Event::BoardFault],
        };
        let mut rig = Rig::with(&SupervisorParams { on_fault, ..params() }, &paper());
        way.iter().for_each(|event| rig.happens(*event));
        assert_eq!(rig.state.state(), state);
        rig
    }
}

/// The diagram at the head of the module, as a table: a row per state, a column per event.
const DIAGRAM: [(State, [State; 8]); 7] = {
    use State::{
        Armed as A, Disconnected as D, Faulted as F, Holding as H, Ready as R, Released as L, Running as U,
    };
    [
        //   Connect Disconnect Arm Acknowledge Stop BoardFault Silence Sample
        (D, [R, D, D, D, D, D, D, D]),
        (R, [R, D, A, R, H, F, F, R]),
        (A, [A, F, A, A, H, F, F, U]),
        (U, [U, F, U, U, H, F, F, U]),
        (H, [H, D, H, R, H, H, H, H]),
        (L, [L, D, L, R, L, L, L, L]),
        (F, [F, F, F, R, F, F, F, F]),
    ]
};

fn diagram_says(from: State, event: Event) -> State {
    let row = DIAGRAM.iter().find(|(state, _)| *state == from).unwrap();
    row.1[event as usize]
}

in_both_scalars! {
    fn every_event_in_every_state_leads_where_the_diagram_says<T>() {
        for (from, _) in DIAGRAM {
            for event in EVENTS {
                let mut on_fault = SafeState::hold(T::from_i32(5));
                if from == State::Released {
                    on_fault = SafeState::Release;
                }
                let mut rig = Rig::<T>::in_state(from, on_fault);
                if matches!(event, Event::Arm) && from != State::Ready {
                    assert!(!rig.supervisor.arm(&mut rig.state, ZERO_VOLTS));
                } else {
                    rig.happens(event);
                }
                assert_eq!(rig.state.state(), diagram_says(from, event), "{from:?}, {event:?}");
            }
        }
    }

    fn a_fault_latches_until_it_is_acknowledged_and_armed_again<T>() {
        let mut rig = Rig::<T>::running();
        rig.supervisor.board_fault(&mut rig.state, T::from_i32(7));
        for event in [Event::Connect, Event::Disconnect, Event::Stop, Event::BoardFault, Event::Silence, Event::Sample] {
            for _ in 0..200 {
                rig.happens(event);
                assert_eq!((rig.state.state(), rig.state.code()), (State::Faulted, SAFE), "{event:?}");
                assert_eq!((rig.state.cause(), rig.state.value()), (Cause::Board, T::from_i32(7)), "{event:?}: the first cause stays");
            }
        }
        assert!(!rig.supervisor.arm(&mut rig.state, ZERO_VOLTS));
        rig.supervisor.acknowledge(&mut rig.state);
        assert_eq!(rig.good().answer, None, "an acknowledgement alone answers nothing");
        assert!(rig.supervisor.arm(&mut rig.state, SAFE));
        rig.path.0 = i64::from(rig.fresh().counts.0);
        rig.sent = 0;
        answered(&rig.good());
    }

    fn an_acknowledgement_forgets_everything_but_the_converters_code<T>() {
        let mut rig = Rig::<T>::running();
        rig.lose();
        rig.good();
        rig.off(1000);
        rig.again(Sample { sequence: rig.sequence.wrapping_sub(1), ..rig.fresh() });
        rig.send(Sample { lateness: Micros(900), command_late: true, ..rig.fresh() });
        rig.supervisor.silence(&mut rig.state, 3);
        rig.supervisor.acknowledge(&mut rig.state);
        let fresh = SupervisorState { state: State::Ready, code: SAFE, ..SupervisorState::default() };
        assert_eq!(rig.state, fresh);
    }

    fn a_run_does_not_depend_on_what_was_seen_before_consent<T>() {
        let mut plain = Rig::<T>::armed();
        let mut rig = Rig::<T>::with(&params(), &paper());
        rig.supervisor.connect(&mut rig.state);
        for k in 0..40 {
            let wild = Sample { sequence: k * 7, counts: Counts(i32::from(k) * 1_000_003), lateness: Micros(400), ..Sample::default() };
            rig.again(wild);
            if rig.state.state() == State::Faulted {
                rig.supervisor.acknowledge(&mut rig.state);
            }
        }
        assert!(rig.supervisor.arm(&mut rig.state, ZERO_VOLTS));
        for _ in 0..20 {
            assert_eq!(rig.good(), plain.good());
        }
        assert_eq!(rig.state, plain.state);
    }

    fn a_stop_holds_with_the_safe_state_and_is_no_fault<T>() {
        let mut rig = Rig::<T>::running();
        rig.supervisor.stop(&mut rig.state, Cause::Done);
        assert_eq!((rig.state.state(), rig.state.cause(), rig.state.code()), (State::Holding, Cause::Done, SAFE));
        let cycle = rig.good();
        assert_eq!((cycle.from, cycle.state, cycle.answer, cycle.code), (State::Holding, State::Holding, None, SAFE));
    }

    fn the_line_cut_while_running_is_a_fault_named_silence<T>() {
        let mut rig = Rig::<T>::running();
        rig.supervisor.disconnect(&mut rig.state);
        assert_eq!((rig.state.state(), rig.state.cause(), rig.state.code()), (State::Faulted, Cause::Silence, SAFE));
    }

    fn a_ramp_goes_one_step_with_each_fresh_sample_and_none_with_another<T>() {
        // 1000 V/s to 5 V are 204.8 codes a period, from 0 V on: five periods.
        let on_fault = SafeState::ramp(T::from_i32(1000), T::from_i32(5));
        let mut rig = Rig::<T>::with(&SupervisorParams { on_fault, ..params() }, &paper()).arm().warm();
        assert_eq!(rig.state.code(), ZERO_VOLTS);
        let cycle = rig.send(Sample { encoder_fault: true, ..rig.fresh() });
        let mut codes = Vec::from([cycle.code.0]);
        for k in 0..6 {
            codes.push(rig.good().code.0);
            let twice = rig.again(Sample { sequence: rig.sequence.wrapping_sub(1), ..rig.fresh() });
            assert_eq!(twice.code.0, codes[k + 1], "a duplicate is no period");
            let old = rig.again(Sample { sequence: rig.sequence.wrapping_sub(9), ..rig.fresh() });
            assert_eq!(old.code.0, codes[k + 1], "an old sample is no period");
        }
        assert_eq!(codes, [2252, 2457, 2662, 2867, 3071, 3072, 3072].map(|c| if c == 3071 { codes[4] } else { c }));
        assert!((3071..=3072).contains(&codes[4]), "5 · 204.8 codes, rounded down to 2⁻¹⁶");
        // A sample that the gate refuses is a period of the board all the same.
        let mut rig = Rig::<T>::with(&SupervisorParams { on_fault, ..params() }, &paper()).arm().warm();
        rig.send(Sample { encoder_fault: true, ..rig.fresh() });
        assert_eq!(rig.off(1_000_000).code.0, 2457);
    }

    fn a_period_without_a_sample_is_a_step_of_the_safe_state_and_nothing_while_control_goes_on<T>() {
        let on_fault = SafeState::ramp(T::from_i32(1000), T::from_i32(5));
        let mut rig = Rig::<T>::with(&SupervisorParams { on_fault, ..params() }, &paper()).arm().warm();
        rig.supervisor.pass(&mut rig.state);
        assert_eq!((rig.state.state(), rig.state.code()), (State::Running, ZERO_VOLTS));
        rig.supervisor.stop(&mut rig.state, Cause::Done);
        let mut codes = Vec::from([rig.state.code().0]);
        for _ in 0..2 {
            rig.supervisor.pass(&mut rig.state);
            codes.push(rig.state.code().0);
        }
        assert_eq!(codes, [2252, 2457, 2662]);
    }

    fn hold_then_release_lets_go_after_its_time_and_says_released_when_it_does<T>() {
        let on_fault = SafeState::hold_then_release(T::from_i32(5), T::from_f64(0.003));
        let mut rig = Rig::<T>::with(&SupervisorParams { on_fault, ..params() }, &paper()).arm().warm();
        rig.supervisor.stop(&mut rig.state, Cause::Done);
        let mut seen = Vec::from([(rig.state.state(), rig.state.code())]);
        for _ in 0..4 {
            let cycle = rig.good();
            seen.push((cycle.state, cycle.code));
        }
        let (holding, released) = ((State::Holding, SAFE), (State::Released, ZERO_VOLTS));
        assert_eq!(seen, [holding, holding, holding, released, released], "three periods of 5 V, then 0 V");
    }

    fn after_a_fault_hold_then_release_lets_go_and_stays_faulted<T>() {
        let on_fault = SafeState::hold_then_release(T::from_i32(5), T::from_f64(0.002));
        let mut rig = Rig::<T>::with(&SupervisorParams { on_fault, ..params() }, &paper()).arm().warm();
        faulted(&rig.send(Sample { encoder_fault: true, ..rig.fresh() }), Cause::Board);
        let codes: Vec<_> = (0..3).map(|_| (rig.good().code, rig.state.state())).collect();
        assert_eq!(codes, [(SAFE, State::Faulted), (ZERO_VOLTS, State::Faulted), (ZERO_VOLTS, State::Faulted)]);
    }

    fn release_lets_go_at_once<T>() {
        let mut rig = Rig::<T>::in_state(State::Released, SafeState::Release);
        assert_eq!(rig.state.code(), ZERO_VOLTS);
        assert_eq!(rig.good().code, ZERO_VOLTS);
    }
}

// Samples that reach the law.

in_both_scalars! {
    fn a_sample_that_a_newer_one_has_overtaken_feeds_the_law_and_is_not_answered<T>() {
        let (mut rig, mut plain) = (Rig::<T>::running(), Rig::<T>::running());
        plain.good();
        let cycle = rig.send(Sample { superseded: true, ..rig.fresh() });
        assert_eq!((cycle.arrival, cycle.answer, cycle.state), (Arrival::Late, None, State::Running));
        assert_eq!(rig.state.servo, plain.state.servo);
        assert_eq!(rig.good().output, plain.good().output);
    }

    fn the_sequence_wraps_from_65535_to_0_without_a_gap<T>() {
        let mut rig = Rig::<T>::armed();
        rig.sequence = 65_500;
        for _ in 0..100 {
            answered(&rig.good());
        }
        assert_eq!((rig.state.lost(), rig.state.tick(), rig.sequence), (0, 99, 64));
        rig.sequence = 65_535;
        rig.state.sequence = 65_534;
        rig.lose();
        answered(&rig.good());
        assert_eq!(rig.state.lost(), 1, "the sample of the wrap itself was lost");
    }

    fn counts_that_wrap_are_a_shaft_that_turns_on<T>() {
        for rate in [1_i64, -1] {
            let edge = if rate > 0 { i64::from(i32::MAX) } else { i64::from(i32::MIN) };
            let (mut rig, mut plain) = (Rig::<T>::armed(), Rig::<T>::armed());
            (rig.path, plain.path) = ((edge - 20 * rate, rate), (1000, rate));
            for k in 0..40 {
                let (over, far) = (rig.good(), plain.good());
                answered(&over);
                assert_eq!((over.answer, over.output), (far.answer, far.output), "sample {k}");
            }
            let crossed = i64::from(rig.fresh().counts.0).signum();
            assert_eq!(crossed, -rate, "the counts have changed sign");
        }
    }

    fn a_glitch_on_a_straight_path_leaves_no_trace_in_the_law<T>() {
        for glitch in [i32::MAX, i32::MIN, 9, -9, 1 << 20] {
            let (mut hit, mut clean) = (Rig::<T>::running(), Rig::<T>::running());
            clean.good();
            let mut sample = hit.fresh();
            sample.counts.0 = if glitch.abs_diff(0) > 1000 { glitch } else { sample.counts.0 + glitch };
            let before = hit.state.servo;
            let cycle = hit.send(sample);
            assert_eq!((cycle.arrival, cycle.answer, cycle.state), (Arrival::Implausible, None, State::Running));
            assert_eq!(hit.state.servo, before, "the law has not seen it");
            for _ in 0..20 {
                let (a, b) = (hit.good(), clean.good());
                assert_eq!((a.tick, a.answer, a.output), (b.tick, b.answer, b.output), "{glitch} counts");
                assert_eq!(hit.state.servo, clean.state.servo, "{glitch} counts");
            }
        }
    }

    fn a_first_sample_that_lies_is_found_by_the_third_after_it_at_the_latest<T>() {
        for lie in [i32::MAX, i32::MIN, 100_000] {
            let mut rig = Rig::<T>::armed();
            let first = Sample { counts: Counts(lie), ..rig.fresh() };
            // The run begins at the first sample: its path does too.
            let path = line::<T>(i64::from(lie), 1);
            let fed = |rig: &mut Rig<T>, sample| {
                rig.lose();
                rig.supervisor.sample(&rig.servo, &mut rig.state, &sample, path)
            };
            let begin = fed(&mut rig, first);
            answered(&begin);
            for _ in 0..2 {
                let sample = rig.fresh();
                assert_eq!(fed(&mut rig, sample).answer, None, "the truth is not believed, and not answered");
            }
            let sample = rig.fresh();
            faulted(&fed(&mut rig, sample), Cause::Jump);
        }
    }

    fn the_law_answers_again_with_the_kth_good_sample_in_a_row<T>() {
        for k in 1..=2 {
            let p = SupervisorParams { limits: LimitParams { good_samples: k, ..params().limits }, ..params() };
            let mut rig = Rig::<T>::with(&p, &paper()).arm().warm();
            rig.off(1000);
            for n in 1..k {
                assert_eq!(rig.good().answer, None, "good sample {n} of {k}");
            }
            answered(&rig.good());
            // Another glitch in between starts the row anew.
            rig.off(1000);
            for _ in 1..k {
                rig.good();
            }
            answered(&rig.good());
        }
    }
}

// Parameters.

in_both_scalars! {
    fn each_parameter_out_of_range_is_named<T>() {
        let (d, nan) = (params::<T>(), T::from_f64(f64::NAN));
        let infinite = T::ONE / T::ZERO;
        let count: T = crate::Encoder::PAPER.radians_per_count();
        let f = T::from_f64;
        let table = [
            (SupervisorParams { on_fault: SafeState::hold(f(0.0)), ..d }, "volts"),
            (SupervisorParams { on_fault: SafeState::hold(f(10.1)), ..d }, "volts"),
            (SupervisorParams { on_fault: SafeState::ramp(f(0.0), f(5.0)), ..d }, "rate"),
            (SupervisorParams { on_fault: SafeState::hold_then_release(f(5.0), f(0.0)), ..d }, "after"),
            (SupervisorParams { speed: SpeedLimit { speed_limit: f(0.0) }, ..d }, "speed_limit"),
            (SupervisorParams { speed: SpeedLimit { speed_limit: infinite }, ..d }, "speed_limit"),
            (SupervisorParams { limits: LimitParams { jump: count * f(0.99), ..d.limits }, ..d }, "jump"),
            (SupervisorParams { limits: LimitParams { jump: count * f(1.1e9), ..d.limits }, ..d }, "jump"),
            (SupervisorParams { limits: LimitParams { jump: nan, ..d.limits }, ..d }, "jump"),
            (SupervisorParams { limits: LimitParams { jumps: 0, ..d.limits }, ..d }, "jumps"),
            (SupervisorParams { limits: LimitParams { jumps: 129, ..d.limits }, ..d }, "jumps"),
            (SupervisorParams { limits: LimitParams { good_samples: 0, ..d.limits }, ..d }, "good_samples"),
            (SupervisorParams { limits: LimitParams { good_samples: 3, ..d.limits }, ..d }, "good_samples"),
            (SupervisorParams { limits: LimitParams { following_error: f(0.0), ..d.limits }, ..d }, "following_error"),
            (SupervisorParams { limits: LimitParams { following_error: nan, ..d.limits }, ..d }, "following_error"),
            (SupervisorParams { limits: LimitParams { following_time: f(-0.1), ..d.limits }, ..d }, "following_time"),
            (SupervisorParams { limits: LimitParams { following_time: infinite, ..d.limits }, ..d }, "following_time"),
            (SupervisorParams { limits: LimitParams { saturation_time: f(0.0004), ..d.limits }, ..d }, "saturation_time"),
            (SupervisorParams { limits: LimitParams { saturation_time: f(5e6), ..d.limits }, ..d }, "saturation_time"),
            (SupervisorParams { limits: LimitParams { edge_counts: f(-0.1), ..d.limits }, ..d }, "edge_counts"),
            (SupervisorParams { limits: LimitParams { edge_counts: infinite, ..d.limits }, ..d }, "edge_counts"),
            (SupervisorParams { limits: LimitParams { grip_margin: f(0.9), ..d.limits }, ..d }, "grip_margin"),
            (SupervisorParams { limits: LimitParams { delay_cycles: 1001, ..d.limits }, ..d }, "delay_cycles"),
            (SupervisorParams { limits: LimitParams { friction_margin: f(0.9), ..d.limits }, ..d }, "friction_margin"),
            (SupervisorParams { limits: LimitParams { friction_margin: nan, ..d.limits }, ..d }, "friction_margin"),
            (SupervisorParams { limits: LimitParams { lost: 0, ..d.limits }, ..d }, "lost"),
            (SupervisorParams { limits: LimitParams { lost: 129, ..d.limits }, ..d }, "lost"),
            (SupervisorParams { limits: LimitParams { late: 0, ..d.limits }, ..d }, "late"),
            (SupervisorParams { limits: LimitParams { late: 129, ..d.limits }, ..d }, "late"),
            (SupervisorParams { limits: LimitParams { disorder: 0, ..d.limits }, ..d }, "disorder"),
            (SupervisorParams { limits: LimitParams { disorder: 129, ..d.limits }, ..d }, "disorder"),
            (SupervisorParams { limits: LimitParams { silence_cycles: 1, ..d.limits }, ..d }, "silence_cycles"),
            (SupervisorParams { limits: LimitParams { silence_cycles: 1001, ..d.limits }, ..d }, "silence_cycles"),
            (SupervisorParams { limits: LimitParams { deadline: Micros(0), ..d.limits }, ..d }, "deadline"),
            (SupervisorParams { limits: LimitParams { overruns: 0, ..d.limits }, ..d }, "overruns"),
            (SupervisorParams { limits: LimitParams { overruns: 129, ..d.limits }, ..d }, "overruns"),
        ];
        for (bad, field) in table {
            let error = Supervisor::new(&bad, &paper(), &bounds()).unwrap_err();
            assert_eq!(error.field(), field, "{bad:?}");
        }
        let slow = ServoParams { period: Micros(0), ..paper() };
        assert_eq!(Supervisor::new(&d, &slow, &bounds()).unwrap_err().field(), "period");
        let (b, not) = (bounds::<T>(), |low| crate::Interval { low, high: nan });
        for (bad, field) in [
            (Bounds { inertia: not(f(0.001)), ..b }, "high"),
            (Bounds { inertia: crate::Interval { low: f(0.0), high: f(0.0) }, ..b }, "high"),
            (Bounds { inertia: crate::Interval { low: f(0.0), high: f(0.001) }, ..b }, "low"),
            (Bounds { drive_torque: not(nan), ..b }, "low"),
            (Bounds { viscous_damping: not(f(0.0)), ..b }, "high"),
            (Bounds { brake_gain: not(f(0.1)), ..b }, "high"),
        ] {
            assert_eq!(Supervisor::new(&d, &paper(), &bad).unwrap_err().field(), field, "{bad:?}");
        }
        let at_the_limits = SupervisorParams {
            limits: LimitParams {
                jumps: 128, lost: 128, late: 1, disorder: 1, overruns: 128, silence_cycles: 1000, good_samples: 999,
                jump: count * f(1.01), edge_counts: f(0.0), grip_margin: f(1.0), friction_margin: f(1.0), following_time: f(0.0),
                deadline: Micros(1), saturation_time: f(0.0006), ..d.limits
            },
            ..d
        };
        assert!(Supervisor::new(&at_the_limits, &paper(), &bounds()).is_ok());
    }

    fn a_cast_keeps_every_parameter<T>() {
        let p = SupervisorParams::<T> { limits: LimitParams { jumps: 4, lost: 5, late: 6, disorder: 7, overruns: 8, ..params().limits }, ..params() };
        assert_eq!(p.cast::<f64>().cast::<T>(), p);
    }
}

// Any numbers.

/// A shaft that goes 0 to 2 counts a period, near its path of one.
fn wandering() -> impl Strategy<Value = Vec<i32>> {
    prop::collection::vec(0..=2_i32, 60..200).prop_map(|steps| {
        let mut at = 0;
        steps
            .iter()
            .enumerate()
            .map(|(k, step)| {
                at += step;
                // Pulled back to the path: what a law would do.
                let path = k as i32;
                at = at.clamp(path - 6, path + 6);
                1000 + at
            })
            .collect()
    })
}

fn laws<T: Real>(which: usize) -> LawParams<T> {
    match which {
        0 => LawParams::Pd(PdParams::default()),
        1 => LawParams::Ctc(CtcParams::default()),
        _ => LawParams::Smc(SmcParams::default()),
    }
}

/// The fate of a sample in a recorded run.
#[derive(Clone, Copy)]
enum Fate {
    Good,
    Lost,
    Counts(i32),
}

fn replay<T: Real>(
    law: usize,
    good_samples: u32,
    counts: &[i32],
    fate: impl Fn(usize) -> Fate,
) -> Vec<Option<Cycle<T>>> {
    let p = SupervisorParams { limits: LimitParams { good_samples, ..params().limits }, ..params() };
    let mut rig = Rig::<T>::with(&p, &ServoParams::paper(laws(law))).arm();
    let mut cycles = Vec::new();
    for (k, counts) in counts.iter().enumerate() {
        let sample = Sample { counts: Counts(*counts), ..rig.fresh() };
        cycles.push(match fate(k) {
            Fate::Good => Some(rig.send(sample)),
            Fate::Counts(other) => Some(rig.send(Sample { counts: Counts(other), ..sample })),
            Fate::Lost => {
                rig.lose();
                None
            }
        });
    }
    cycles
}

/// After `good_samples` good samples a run with a glitch goes on as one in which that sample, and
/// those that were waited for, were lost.
fn a_glitch_is_a_loss<T: Real>(
    law: usize,
    good: u32,
    counts: &[i32],
    at: usize,
    glitch: i32,
) -> Result<(), TestCaseError> {
    let waits = at + good as usize;
    let hit = replay::<T>(law, good, counts, |k| if k == at { Fate::Counts(glitch) } else { Fate::Good });
    let lost = replay::<T>(law, good, counts, |k| if k >= at && k < waits { Fate::Lost } else { Fate::Good });
    // It may be no glitch at all: near enough to the truth, or after the end of control.
    prop_assume!(hit[at].as_ref().is_some_and(|c| c.arrival == Arrival::Implausible));
    prop_assume!(lost[..at].iter().flatten().all(|c| c.state == State::Running));
    for k in waits..counts.len() {
        let (Some(a), Some(b)) = (&hit[k], &lost[k]) else { unreachable!("only those before are lost") };
        prop_assert_eq!(a, b, "sample {} of a glitch at {}", k, at);
    }
    Ok(())
}

#[derive(Clone, Debug)]
enum Op {
    Good { counts: i8 },
    Sample { sequence: i16, counts: i32, flags: u8, lateness: u32 },
    Target { position: i64, velocity: u64, acceleration: u64 },
    Event(usize),
}

fn op() -> impl Strategy<Value = Op> {
    prop_oneof![
        24 => (0..=2_i8).prop_map(|counts| Op::Good { counts }),
        2 => any::<i8>().prop_map(|counts| Op::Good { counts }),
        2 => (prop_oneof![Just(0_i16), -3..6_i16, any::<i16>()], any::<i32>(), any::<u8>(), any::<u32>())
            .prop_map(|(sequence, counts, flags, lateness)| Op::Sample { sequence, counts, flags, lateness }),
        1 => (any::<i64>(), any::<u64>(), any::<u64>())
            .prop_map(|(position, velocity, acceleration)| Op::Target { position, velocity, acceleration }),
        2 => (0..EVENTS.len()).prop_map(Op::Event),
        // So that most of a sequence is spent in Running.
        3 => Just(Op::Event(Event::Acknowledge as usize)),
        3 => Just(Op::Event(Event::Connect as usize)),
        3 => Just(Op::Event(Event::Arm as usize)),
    ]
}

fn whatever_comes<T: Real>(law: usize, ops: &[Op]) -> Result<u32, TestCaseError> {
    let eight = T::from_i32(8);
    let servo = ServoParams {
        output: OutputParams { highest: eight, on_invalid: eight, ..OutputParams::default() },
        ..ServoParams::paper(laws(law))
    };
    let mut rig = Rig::<T>::with(&params(), &servo);
    // 8 V of ±10 V in 12 bits.
    let allowed = ZERO_VOLTS..=DacCode(3686);
    let (mut at, mut answers) = (0_i32, 0);
    for op in ops {
        let from = rig.state.state();
        let mut cycle = None;
        match *op {
            Op::Event(i) => {
                let event = EVENTS[i];
                if matches!(event, Event::Arm) && from == State::Ready {
                    (rig.path, rig.sent, rig.ahead) = ((i64::from(at), 1), 0, 0);
                    prop_assert!(rig.supervisor.arm(&mut rig.state, SAFE));
                } else if !matches!(event, Event::Sample | Event::Arm) {
                    rig.happens(event);
                    prop_assert_eq!(rig.state.state(), diagram_says(from, event), "{:?}, {:?}", from, event);
                }
            }
            Op::Good { counts } => {
                at = at.wrapping_add(i32::from(counts));
                cycle = Some(rig.send(Sample { counts: Counts(at), ..rig.fresh() }));
            }
            Op::Sample { sequence, counts, flags, lateness } => {
                rig.sequence = rig.sequence.wrapping_add(sequence as u16);
                cycle = Some(rig.again(Sample {
                    sequence: rig.sequence,
                    time: Micros(counts as u32),
                    counts: Counts(counts),
                    board: [BoardMode::Driving, BoardMode::Driving, BoardMode::Ready, BoardMode::Safe]
                        [usize::from(flags & 3)],
                    encoder_fault: flags & 28 == 28,
                    converter_fault: flags & 44 == 44,
                    command_late: flags & 64 != 0,
                    superseded: flags & 128 != 0,
                    lateness: Micros(lateness),
                }));
                rig.lose();
            }
            Op::Target { position, velocity, acceleration } => {
                let number = |bits| T::from_f64(f64::from_bits(bits));
                let target = Target {
                    position: FixedCounts(position),
                    velocity: number(velocity),
                    acceleration: number(acceleration),
                };
                at = at.wrapping_add(1);
                let sample = Sample { counts: Counts(at), ..rig.fresh() };
                rig.lose();
                cycle = Some(rig.supervisor.sample(&rig.servo, &mut rig.state, &sample, |_| target));
            }
        }
        let (state, code) = (rig.state.state(), rig.state.code());
        // At power-up nobody knows what the converter has.
        if !matches!(state, State::Disconnected | State::Ready) || code != DacCode(0) {
            prop_assert!(allowed.contains(&code), "{:?} in {:?} after {:?}", code, state, op);
        }
        if matches!(state, State::Faulted | State::Holding) {
            prop_assert_eq!(code, SAFE, "{:?} after {:?}", state, op);
        }
        let Some(cycle) = cycle else { continue };
        let may = match from {
            State::Armed | State::Running => [State::Running, State::Faulted, from],
            State::Ready => [State::Ready, State::Faulted, from],
            _ => [from; 3],
        };
        prop_assert!(may.contains(&cycle.state), "{:?} → {:?}", from, cycle.state);
        prop_assert_eq!((cycle.state, cycle.code), (state, code));
        prop_assert_eq!(cycle.state == State::Faulted, Cause::CHECKS.contains(&cycle.cause));
        if let Some(answer) = cycle.answer {
            prop_assert_eq!((cycle.state, cycle.arrival), (State::Running, Arrival::Fresh));
            prop_assert!(allowed.contains(&answer));
            let out = cycle.output.unwrap();
            let volts = rig.servo.dac().volts(out.code);
            prop_assert!(volts >= T::ZERO && volts <= eight);
            answers += 1;
        }
    }
    Ok(answers)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn a_glitch_of_any_size_equals_a_lost_sample_to_the_last_bit(
        counts in wandering(),
        at in 1..50_usize,
        glitch in prop_oneof![any::<i32>(), Just(i32::MAX), Just(i32::MIN), 900..1200_i32],
        law in 0..3_usize,
        good in 1..=2_u32,
    ) {
        a_glitch_is_a_loss::<f64>(law, good, &counts, at, glitch)?;
        a_glitch_is_a_loss::<f32>(law, good, &counts, at, glitch)?;
    }

    /// With (5) a sample that is bridged leaves `K²` of the error that was guessed, over a period,
    /// in the rate; it dies away with `1 − K`. The guess is the middle of a shaft that goes 0 to 2
    /// counts a period: at most one count off.
    #[test]
    fn a_glitch_moves_the_error_rate_by_no_more_than_the_bridged_error(
        counts in wandering(), at in 1..50_usize, glitch in prop_oneof![Just(i32::MAX), Just(i32::MIN)],
    ) {
        let clean = replay::<f64>(0, 1, &counts, |_| Fate::Good);
        let hit = replay::<f64>(0, 1, &counts, |k| if k == at { Fate::Counts(glitch) } else { Fate::Good });
        let (smoothing, guess) = (0.2_f64, 1.0 + 1e-3);
        let per_period = 0.018_f64.to_radians() / 1e-3;
        let mut bound = smoothing * smoothing * guess * per_period;
        for k in at + 1..counts.len() {
            let (Some(a), Some(b)) = (&clean[k], &hit[k]) else { unreachable!("none is lost") };
            // The two may end at different times: the jump is one event more.
            let (Some(a), Some(b)) = (a.output, b.output) else { break };
            let off = (a.tick.error_rate - b.tick.error_rate).abs();
            prop_assert!(off <= bound + 1e-12, "sample {}: {} rad/s, bound {} rad/s", k, off, bound);
            prop_assert_eq!(a.tick.error, b.tick.error);
            bound *= 1.0 - smoothing;
        }
    }

    #[test]
    fn whatever_comes_the_code_stays_within_the_limits_and_a_fault_is_safe(
        ops in prop::collection::vec(op(), 1..300), law in 0..3_usize,
    ) {
        whatever_comes::<f64>(law, &ops)?;
        whatever_comes::<f32>(law, &ops)?;
    }
}

#[test]
fn the_random_sequences_do_reach_the_law() {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;
    let mut runner = TestRunner::deterministic();
    let answers: u32 = (0..50)
        .map(|k| {
            let ops = prop::collection::vec(op(), 300).new_tree(&mut runner).unwrap().current();
            whatever_comes::<f64>(k % 3, &ops).unwrap()
        })
        .sum();
    assert!(answers > 50 * 20, "{}", format!("only {answers} answers in 50 sequences of 300"));
}
