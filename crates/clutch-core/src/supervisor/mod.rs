//! The supervisor: what may reach the law, and when control has to end.
//!
//! ```text
//!                 connect                arm (consent)         first sample
//!  Disconnected ──────────► Ready ─────────────────► Armed ─────────────────► Running
//!       ▲                    ▲ ▲                       │                        │  │
//!       │ disconnect         │ │ acknowledge (consent) │ stop                   │  │ a check
//!       │ (from any)         │ │                       ▼                   stop │  │ fails
//!       │                    │ └───────────── Holding / Released ◄──────────────┘  ▼
//!       └─────────────       └─────────────────────────────────────────────── Faulted
//! ```
//!
//! Holding and Released are the ends that were wanted: the safe state with the brake on, or let
//! go. Faulted is the safe state with a cause, and latches: nothing but an acknowledgement
//! followed by a new consent leads back to Running. A check may fail in Ready and Armed too.
//!
//! Every sample passes a gate before it touches the law: sequence, board's status, plausible
//! counts, plausible target. A sample that does not pass is not answered; the board keeps its code for at
//! most its watchdog's three cycles, then goes to the safe state by itself. After a sample that
//! was refused the law answers again once [`LimitParams::good_samples`] have passed in a row.
//!
//! | check | fails when |
//! |---|---|
//! | [`Cause::Lost`] | samples are missing more often than allowed in a window |
//! | [`Cause::Late`] | samples or answers come too late, more often than allowed |
//! | [`Cause::Duplicated`], [`Cause::Reordered`] | samples repeat, or arrive out of order, more often than allowed |
//! | [`Cause::Jump`] | counts depart from dead reckoning by more than a shaft can, more often than allowed |
//! | [`Cause::StandStill`] | no count came, and no shaft of the bounds can have stood still |
//! | [`Cause::Channel`] | the same, and counts went to and fro |
//! | [`Cause::Reversed`] | counts went backwards, where no shaft of the bounds goes |
//! | [`Cause::TooSlow`], [`Cause::TooFast`] | counts are behind the slowest shaft of the bounds, or ahead of the fastest |
//! | [`Cause::FollowingError`] | the error exceeds its limit, which grows with the speed |
//! | [`Cause::Saturation`] | the output is at a limit for too long |
//! | [`Cause::NotFinite`] | the law's measurement, terms or demand are not numbers |
//! | [`Cause::Target`] | the target is not a number, or moves faster than the speed limit |
//! | [`Cause::Deadline`] | the answer was late, more often than allowed |
//! | [`Cause::Silence`] | no sample for so many cycles |
//! | [`Cause::Clock`] | the board's time does not pass as its periods do, or its periods not as its host's time |
//! | [`Cause::Board`] | the board reports a fault, or is not driving although it should |
//!
//! The supervisor owns no clock. A log records all of its input, so a replay decides the
//! same at every tick.

mod cause;
mod envelope;
mod limits;
mod pace;
mod params;
mod state;

pub use cause::{Cause, Checks};
pub use pace::Pace;
pub use params::{LimitParams, SpeedLimit, SupervisorParams};
pub use state::{Arrival, BoardMode, Cycle, Sample, State, SupervisorState};

use crate::law::{ControlLaw, Limit, Terms};
use crate::safe_state::{SafeCodes, SafeRun};
use crate::{
    Bounds, Counts, Dac, DacCode, Micros, ParamError, Planned, Real, Servo, ServoOutput, ServoParams, Target,
};
use limits::Limits;

/// A checked supervisor; never changes in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Supervisor<T> {
    limits: Limits<T>,
    safe: SafeCodes,
    checks: Checks,
}

impl<T: Real> Supervisor<T> {
    /// Checks the parameters. `bounds` say how little drive and motor and how much friction may do:
    /// a shaft that must have moved although no count came is what [`Cause::StandStill`] means.
    ///
    /// # Errors
    /// The first parameter out of range, by name.
    pub fn new(
        p: &SupervisorParams<T>,
        servo: &ServoParams<T>,
        bounds: &Bounds<T>,
    ) -> Result<Self, ParamError<T>> {
        let dac = Dac::new(&servo.dac)?;
        Ok(Supervisor {
            safe: SafeCodes::new(&p.on_fault, &dac, servo.period, bounds.actuator)?,
            limits: Limits::new(p, servo, dac, bounds)?,
            checks: Checks::ALL,
        })
    }

    /// The same with fewer checks. For the campaign that shows that each of them is needed, and
    /// for nothing else.
    #[must_use]
    pub const fn with_checks(mut self, checks: Checks) -> Self {
        self.checks = checks;
        self
    }

    /// The safe state, in the converter's codes.
    #[must_use]
    pub fn safe_codes(&self) -> &SafeCodes {
        &self.safe
    }

    /// The link is up and the board is configured.
    pub fn connect<S>(&self, s: &mut SupervisorState<T, S>) {
        if s.state == State::Disconnected {
            s.state = State::Ready;
        }
    }

    /// The link is gone. From Armed and Running this is a fault.
    pub fn disconnect<S>(&self, s: &mut SupervisorState<T, S>) {
        if matches!(s.state, State::Armed | State::Running) {
            self.fault(s, Cause::Silence, T::ZERO);
        }
        if s.state != State::Faulted {
            s.state = State::Disconnected;
        }
    }

    /// Consent: from Ready to Armed. `present` is the code that the converter has. True if it
    /// was possible. All that was seen before is forgotten, so that a run depends on its own samples.
    pub fn arm<S: Default>(&self, s: &mut SupervisorState<T, S>, present: DacCode) -> bool {
        let ready = s.state == State::Ready;
        if ready {
            *s = SupervisorState { state: State::Armed, code: present, ..SupervisorState::default() };
        }
        ready
    }

    /// Consent to leave Faulted, Holding or Released: to Ready, with everything forgotten.
    pub fn acknowledge<S: Default>(&self, s: &mut SupervisorState<T, S>) {
        if matches!(s.state, State::Faulted | State::Holding | State::Released) {
            let code = s.code;
            *s = SupervisorState { state: State::Ready, code, ..SupervisorState::default() };
        }
    }

    /// An end that was wanted: the safe state without a fault.
    pub fn stop<S>(&self, s: &mut SupervisorState<T, S>, cause: Cause) {
        if matches!(s.state, State::Armed | State::Running | State::Ready) {
            s.cause = cause;
            self.make_safe(s);
            s.state = State::Holding;
            self.advance_safe(s);
        }
    }

    /// The board says that it has gone to its safe state by itself; `value` is its own reason.
    pub fn board_fault<S>(&self, s: &mut SupervisorState<T, S>, value: T) {
        self.check(s, Self::why_safe(s), value);
    }

    /// Answers that came too late explain a watchdog that bit.
    fn why_safe<S>(s: &SupervisorState<T, S>) -> Cause {
        if s.late.any(s.periods) { Cause::Late } else { Cause::Board }
    }

    /// No sample for `cycles` periods.
    pub fn silence<S>(&self, s: &mut SupervisorState<T, S>, cycles: u32) {
        if cycles >= self.limits.silence_cycles {
            self.check(s, Cause::Silence, T::from_u64(u64::from(cycles)));
        }
    }

    /// A period goes by without a sample: where control has ended, the safe state takes its next step all the same.
    pub fn pass<S>(&self, s: &mut SupervisorState<T, S>) {
        if matches!(s.state, State::Faulted | State::Holding | State::Released) {
            self.advance_safe(s);
        }
    }

    /// The board's periods and the host's clock are apart by so many µs: [`Pace`].
    pub fn off_pace<S>(&self, s: &mut SupervisorState<T, S>, micros: i32) {
        self.check(s, Cause::Clock, T::from_i32(micros));
    }

    /// One sample: judged, and if it may pass, given to the servo.
    ///
    /// The answer, if there is one, belongs on the wire at once.
    pub fn sample<C: ControlLaw<T>>(
        &self,
        servo: &Servo<T, C>,
        s: &mut SupervisorState<T, C::State>,
        sample: &Sample,
        planned: impl Planned<T>,
    ) -> Cycle<T, C::Terms> {
        let from = s.state;
        let fresh_fault = s.cause;
        let mut cycle = Cycle { tick: s.tick, from, ..Cycle::default() };
        self.judge(servo, s, sample, &planned, &mut cycle);
        if matches!(s.state, State::Faulted | State::Holding | State::Released) {
            cycle.answer = None;
            // A fault of this very cycle has taken its first step already.
            if cycle.arrival.is_fresh() && s.cause == fresh_fault {
                self.advance_safe(s);
            }
        }
        cycle.state = s.state;
        cycle.cause = s.cause;
        cycle.value = s.value;
        cycle.code = s.code;
        cycle
    }

    /// Computes what the next sample will most likely be judged by, so that its answer comes sooner. Without this call
    /// the answers are the same, and come later.
    pub fn expect<S>(&self, s: &mut SupervisorState<T, S>, planned: &impl Planned<T>) {
        if s.state == State::Running {
            let tick = s.tick.wrapping_add(1);
            s.expected = Some((tick, planned.target(tick)));
            let losses = s.losses(s.periods.wrapping_add(1));
            self.limits.envelope.expect(&mut s.envelope, losses);
        }
    }

    // A function of its own in machine code: where each period is expected, its bound leaves it out.
    #[cold]
    #[inline(never)]
    fn unexpected(planned: &impl Planned<T>, tick: u64) -> Target<T> {
        planned.target(tick)
    }

    /// The gates one after another. A sample that one of them stops is not answered.
    fn judge<C: ControlLaw<T>>(
        &self,
        servo: &Servo<T, C>,
        s: &mut SupervisorState<T, C::State>,
        sample: &Sample,
        planned: &impl Planned<T>,
        cycle: &mut Cycle<T, C::Terms>,
    ) {
        let Some(periods) = self.in_sequence(s, sample, cycle) else { return };
        self.check_clock(s, sample.time, periods);
        if periods > 1 {
            self.count_lost(s, u32::from(periods) - 1);
        }
        self.count_late(s, sample);
        self.check_board(s, sample);
        let Some((moved, elapsed)) = self.plausible_counts(s, sample, periods, cycle) else { return };
        if s.state == State::Running {
            self.within_envelope(s, moved, elapsed);
        }
        if !Self::recovered(s) {
            return;
        }
        Self::start_if_armed(s, cycle);
        if s.state != State::Running {
            return;
        }
        let goal = match s.expected.take() {
            Some((tick, target)) if tick == s.tick => target,
            _ => Self::unexpected(planned, s.tick),
        };
        cycle.target = goal;
        // Nothing was served before the first.
        let since_served =
            s.served.map_or(0, |served| u32::try_from(s.tick.saturating_sub(served)).unwrap_or(u32::MAX));
        if !self.plausible_target(s, &goal, since_served.max(1)) {
            return;
        }
        if since_served != 1 {
            self.begin_or_bridge(servo, s, sample.counts, &goal, planned);
        }
        let out = servo.tick_on(&mut s.servo, sample.counts, &goal, |position| planned.place(position));
        s.served = Some(s.tick);
        cycle.output = Some(out);
        self.check_output(s, &out, &goal, since_served.max(1));
        if s.state == State::Running && !sample.superseded {
            s.code = out.code;
            s.envelope.sends(out.code);
            cycle.answer = Some(out.code);
        }
    }

    /// The periods since the sample before, and the time of all that is remembered moved on by them.
    /// None if the sample came before, or is older than one that did.
    #[inline]
    fn in_sequence<S, X>(
        &self,
        s: &mut SupervisorState<T, S>,
        sample: &Sample,
        cycle: &mut Cycle<T, X>,
    ) -> Option<u16> {
        let ahead = if s.started { sample.sequence.wrapping_sub(s.sequence) as i16 } else { 1 };
        if ahead <= 0 {
            let (history, cause, arrival) = if ahead == 0 {
                (&mut s.duplicated, Cause::Duplicated, Arrival::Duplicate)
            } else {
                (&mut s.reordered, Cause::Reordered, Arrival::Reordered)
            };
            cycle.arrival = arrival;
            let count = history.mark(s.periods);
            if count >= self.limits.disorder {
                self.check(s, cause, T::from_u64(u64::from(count)));
            }
            return None;
        }
        let periods = ahead.unsigned_abs();
        if !s.started {
            s.time = Micros(sample.time.0.wrapping_sub(self.limits.period_us));
        }
        s.started = true;
        s.sequence = sample.sequence;
        s.periods = s.periods.wrapping_add(u64::from(periods));
        if s.state == State::Running {
            s.tick = s.tick.wrapping_add(u64::from(periods));
            cycle.tick = s.tick;
        }
        cycle.arrival = if sample.superseded { Arrival::Late } else { Arrival::Fresh };
        Some(periods)
    }

    /// [`Cause::Clock`]: the board's time against its periods.
    #[inline]
    fn check_clock<S>(&self, s: &mut SupervisorState<T, S>, time: Micros, periods: u16) {
        let passed = time.0.wrapping_sub(s.time.0) as i32;
        s.time = time;
        let expected = self.limits.period_us.saturating_mul(u32::from(periods));
        if let Some(off) = s.pace.pass(expected, passed, self.limits.clock_slack_us) {
            self.check(s, Cause::Clock, T::from_i32(off));
        }
    }

    /// [`Cause::Silence`] and [`Cause::Lost`]: samples that are missing before this one.
    // A function of its own in machine code: where none is missing, a period's bound leaves it out.
    #[cold]
    #[inline(never)]
    fn count_lost<S>(&self, s: &mut SupervisorState<T, S>, lost: u32) {
        let l = &self.limits;
        s.lost_total = s.lost_total.wrapping_add(u64::from(lost));
        let count = s.lost.mark_many(lost, s.periods);
        if lost >= l.silence_cycles {
            self.check(s, Cause::Silence, T::from_u64(u64::from(lost)));
        }
        if count >= l.lost {
            self.check(s, Cause::Lost, T::from_u64(u64::from(count)));
        }
    }

    /// [`Cause::Late`] and [`Cause::Deadline`]: samples and answers that took too long.
    #[inline]
    fn count_late<S>(&self, s: &mut SupervisorState<T, S>, sample: &Sample) {
        let l = &self.limits;
        if sample.superseded || sample.command_late {
            let count = s.late.mark(s.periods);
            if count >= l.late {
                self.check(s, Cause::Late, T::from_u64(u64::from(count)));
            }
        }
        if sample.lateness > l.deadline {
            s.deadline_misses = s.deadline_misses.wrapping_add(1);
            if s.overrun.mark(s.periods) >= l.overruns {
                self.check(s, Cause::Deadline, T::from_u64(u64::from(sample.lateness.0)));
            }
        }
    }

    /// [`Cause::Board`]: a fault that the board reports, or a board that does not drive although it should.
    #[inline]
    fn check_board<S>(&self, s: &mut SupervisorState<T, S>, sample: &Sample) {
        let commanding = matches!(s.state, State::Armed | State::Running);
        if sample.encoder_fault || sample.converter_fault {
            self.check(s, Cause::Board, T::ZERO);
        } else if commanding && sample.board != BoardMode::Driving {
            self.check(s, Self::why_safe(s), T::ZERO);
        }
    }

    /// The counts that the shaft has moved and the periods it took, both since the last sample that
    /// passed. None, and [`Cause::Jump`] in the end, if they depart too far from dead reckoning
    /// from the last two.
    #[inline]
    fn plausible_counts<S, X>(
        &self,
        s: &mut SupervisorState<T, S>,
        sample: &Sample,
        periods: u16,
        cycle: &mut Cycle<T, X>,
    ) -> Option<(i32, u32)> {
        let l = &self.limits;
        let moved = sample.counts.since(s.counts);
        let mut elapsed = u32::from(periods);
        if s.reckoned {
            s.unpassed = s.unpassed.saturating_add(u32::from(periods));
            let Reckoned { expected, allowed, rate } = match s.unpassed {
                1 => Reckoned { expected: s.rate, allowed: l.jump.saturating_mul(8) / 8, rate: moved },
                periods => self.reckoned_after(s.rate, moved, periods),
            };
            let off = moved.saturating_sub(expected).unsigned_abs();
            if off > allowed {
                cycle.arrival = Arrival::Implausible;
                s.rejected_total = s.rejected_total.wrapping_add(1);
                s.recovering = l.good_samples;
                if s.jump.mark(s.periods) >= l.jumps {
                    self.check(s, Cause::Jump, T::from_u64(u64::from(off)));
                }
                return None;
            }
            s.rate = rate;
            // With those of samples that were refused in between.
            elapsed = s.unpassed;
        } else {
            s.reckoned = true;
            s.rate = 0;
        }
        s.counts = sample.counts;
        s.unpassed = 0;
        Some((moved, elapsed))
    }

    /// Dead reckoning over any number of periods.
    // A function of its own in machine code: where the sample before has passed, a period's bound leaves it out.
    #[cold]
    #[inline(never)]
    fn reckoned_after(&self, rate: i32, moved: i32, periods: u32) -> Reckoned {
        let n = i32::try_from(periods).unwrap_or(i32::MAX);
        Reckoned {
            expected: rate.saturating_mul(n),
            // The longer ago, the less dead reckoning knows: an eighth more with each period.
            allowed: self.limits.jump.saturating_mul(periods.saturating_add(7)) / 8,
            rate: moved.checked_div(n).unwrap_or(0),
        }
    }

    /// True if enough good samples have come since one that was refused.
    #[inline]
    fn recovered<S>(s: &mut SupervisorState<T, S>) -> bool {
        if s.recovering > 0 {
            s.recovering -= 1;
        }
        s.recovering == 0
    }

    /// The first sample that passes after the consent starts the run.
    #[inline]
    fn start_if_armed<S, X>(s: &mut SupervisorState<T, S>, cycle: &mut Cycle<T, X>) {
        if s.state == State::Armed {
            s.state = State::Running;
            s.tick = 0;
            s.served = None;
            cycle.tick = 0;
        }
    }

    /// True if a path can have this target so many periods after the last; if not, [`Cause::Target`].
    #[inline]
    fn plausible_target<S>(&self, s: &mut SupervisorState<T, S>, goal: &Target<T>, periods: u32) -> bool {
        let plausible = self.limits.believes(s.last_target, goal, periods);
        if plausible {
            s.last_target = Some(goal.position);
        } else {
            self.check(s, Cause::Target, goal.velocity);
        }
        plausible
    }

    /// Starts the servo, or takes it over the ticks that had no sample.
    // A function of its own in machine code: where each sample is served, a period's bound leaves it out.
    #[cold]
    #[inline(never)]
    fn begin_or_bridge<C: ControlLaw<T>>(
        &self,
        servo: &Servo<T, C>,
        s: &mut SupervisorState<T, C::State>,
        counts: Counts,
        goal: &Target<T>,
        planned: &impl Planned<T>,
    ) {
        let Some(served) = s.served else { return self.begin(servo, s, counts, goal) };
        let steps = s.tick.saturating_sub(served);
        // More than that is silence.
        let steps = u32::try_from(steps).unwrap_or(1).min(self.limits.silence_cycles.saturating_add(8));
        for step in 1..steps {
            let passed = planned.target(served.wrapping_add(u64::from(step)));
            servo.bridge(&mut s.servo, (counts, goal), &passed, (step, steps));
        }
    }

    #[inline(never)]
    fn begin<C: ControlLaw<T>>(
        &self,
        servo: &Servo<T, C>,
        s: &mut SupervisorState<T, C::State>,
        counts: Counts,
        goal: &Target<T>,
    ) {
        let applied = servo.dac().volts(s.code);
        servo.restart(&mut s.servo, counts, goal, applied);
        self.limits.envelope.restart(&mut s.envelope, s.code);
    }

    /// [`Cause::NotFinite`], [`Cause::FollowingError`] and [`Cause::Saturation`].
    #[inline]
    fn check_output<S, X: Terms<T>>(
        &self,
        s: &mut SupervisorState<T, S>,
        out: &ServoOutput<T, X>,
        goal: &Target<T>,
        since_served: u32,
    ) {
        let l = &self.limits;
        if !finite(out) {
            self.check(s, Cause::NotFinite, out.command.voltage);
        }
        let error = out.tick.error.abs();
        if error > l.following_error + l.following_time * goal.velocity.abs() {
            self.check(s, Cause::FollowingError, out.tick.error);
        }
        let resting = goal.velocity.abs() <= l.still;
        let saturated = match out.command.limit {
            Limit::None => false,
            // At the end of a path a shaft that has come too far rests there under full brake.
            Limit::Highest => !resting || l.drives_above_0(),
            Limit::Lowest | Limit::Invalid => true,
        };
        // More than that is silence.
        let passed = since_served.min(self.limits.silence_cycles.saturating_add(8));
        s.saturated = if saturated { s.saturated.saturating_add(passed) } else { 0 };
        if s.saturated >= l.saturation_cycles {
            self.check(s, Cause::Saturation, out.command.voltage);
        }
    }

    /// Causes of the envelope: counts that no shaft of the bounds can have given under the volts that were sent.
    fn within_envelope<S>(&self, s: &mut SupervisorState<T, S>, moved: i32, periods: u32) {
        let l = &self.limits;
        let losses = s.losses(s.periods);
        if let Some((cause, counts)) = l.envelope.judge(&mut s.envelope, losses, moved, periods) {
            self.check(s, cause, counts * l.radians_per_count);
        }
    }

    /// A check has failed.
    // A function of its own in machine code: it ends control, and the bound of a period that goes on leaves it out.
    #[cold]
    #[inline(never)]
    fn check<S>(&self, s: &mut SupervisorState<T, S>, cause: Cause, value: T) {
        let watched = matches!(s.state, State::Ready | State::Armed | State::Running);
        // The first cause is the one that is reported.
        if watched && self.checks.has(cause) {
            self.fault(s, cause, value);
        }
    }

    fn fault<S>(&self, s: &mut SupervisorState<T, S>, cause: Cause, value: T) {
        self.make_safe(s);
        self.advance_safe(s);
        s.state = State::Faulted;
        s.cause = cause;
        s.value = value;
    }

    fn make_safe<S>(&self, s: &mut SupervisorState<T, S>) {
        s.safe = SafeRun::begin(s.code);
    }

    fn advance_safe<S>(&self, s: &mut SupervisorState<T, S>) {
        // Asked before the step: whether this code is the one that lets go.
        let released = s.safe.released(&self.safe);
        s.code = s.safe.next(&self.safe);
        if s.state == State::Holding && released {
            s.state = State::Released;
        }
    }
}

/// Counts by dead reckoning: the way that is expected and by how much it may be off, and the rate of the way that was gone.
struct Reckoned {
    expected: i32,
    allowed: u32,
    rate: i32,
}

#[inline]
fn finite<T: Real, X: Terms<T>>(out: &ServoOutput<T, X>) -> bool {
    let t = &out.tick;
    // A code stands for a number of volts, whichever it is.
    let rest = [t.error, t.error_rate, out.command.voltage];
    out.command.limit != Limit::Invalid && rest.are_finite() && out.command.terms.are_finite()
}

#[cfg(test)]
mod tests;
