//! The servo: encoder counts and target in, DAC code and terms out.
//!
//! ```text
//! counts ─► unwrap ─► e ─┬──────────► law ─► limits ─► shell ─► DAC code
//! target ───────────────┴─► ė (5) ──┘
//! ```
//!
//! The same type runs in the simulator, in the loop on Linux and on a board. It owns no clock
//! and no I/O.

use crate::law::{Beside, Command, ControlLaw, Law, LawParams, OutputParams, Seen, Shell, ShellParams, Tick};
use crate::velocity::{VelocityParams, VelocitySource, VelocityState};
use crate::{
    Arithmetic, Counts, Dac, DacCode, DacParams, Encoder, FixedCounts, Micros, ParamError, Place, Plant,
    PlantParams, Real, Target, off_map,
};

/// Everything a servo is built from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoParams<T = f64> {
    /// Sampling period `T`.
    pub period: Micros,
    /// The encoder.
    pub encoder: Encoder,
    /// The converter.
    pub dac: DacParams<T>,
    /// Source of the error rate.
    pub velocity: VelocityParams<T>,
    /// The plant as the computed-torque law and an observer believe it to be.
    pub model: PlantParams<T>,
    /// The law and its gains.
    pub law: LawParams<T>,
    /// Output limits and bumpless start.
    pub output: OutputParams<T>,
    /// The shell around the law.
    pub shell: ShellParams<T>,
}

impl<T: Real> ServoParams<T> {
    /// The paper's hardware with the given law: 1 ms, 20 000 counts/rev, 12 bit over ±10 V.
    #[must_use]
    pub fn paper(law: LawParams<T>) -> Self {
        ServoParams {
            period: Micros(1000),
            encoder: Encoder::PAPER,
            dac: DacParams::default(),
            velocity: VelocityParams::default(),
            model: PlantParams::default(),
            law,
            output: OutputParams::default(),
            shell: ShellParams::default(),
        }
    }
}

impl<T: Real> ServoParams<T> {
    /// The same in another scalar, each real number rounded to the nearest.
    #[must_use]
    pub fn cast<U: Real>(&self) -> ServoParams<U> {
        ServoParams {
            period: self.period,
            encoder: self.encoder,
            dac: self.dac.cast(),
            velocity: self.velocity.cast(),
            model: self.model.cast(),
            law: self.law.cast(),
            output: self.output.cast(),
            shell: self.shell.cast(),
        }
    }

    /// The parts beside which its law is built.
    #[must_use]
    pub fn beside(&self) -> Beside<'_, T> {
        Beside { model: &self.model, output: &self.output, encoder: self.encoder, period: self.period }
    }

    /// Checks that reaches the output's limits.
    ///
    /// # Errors
    /// Field `lowest` or `highest` of the output.
    pub fn check_output(&self) -> Result<(), ParamError<T>> {
        let (out, dac) = (&self.output, &self.dac);
        OutputParams::HIGHEST_REACHED.require(out.highest, out.highest <= dac.highest)?;
        OutputParams::LOWEST_REACHED.require(out.lowest, out.lowest >= dac.lowest)?;
        Ok(())
    }
}

/// A checked servo; never changes in a tick.
///
/// ```
/// use clutch_core::{Counts, FixedCounts, Servo, ServoParams, Target};
/// use clutch_core::law::{LawParams, PdParams};
/// let servo = Servo::<f32>::new(&ServoParams::paper(LawParams::Pd(PdParams::default())))?;
/// let target = Target { position: FixedCounts::from_counts(100), velocity: 0.0, acceleration: 0.0 };
/// let mut state = servo.start(Counts(100), &target, 0.0);
/// let out = servo.tick(&mut state, Counts(101), &target); // one count ahead: brake
/// assert!(out.command.voltage > 0.0);
/// # Ok::<(), clutch_core::ParamError<f32>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Servo<T, C = Law<T>> {
    law: C,
    shell: Shell<T>,
    velocity: VelocitySource<T>,
    encoder: Encoder,
    dac: Dac<T>,
    period: Micros,
    /// Radians of 2⁻¹⁶ counts.
    fine_radians: T,
}

/// The actuator's voltage since the last tick, as the servo was told or as its own code.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Applied<T> {
    Volts(T),
    /// Few ask for its voltage: it is computed where one does.
    Code(DacCode),
}

impl<T: Default> Default for Applied<T> {
    fn default() -> Self {
        Applied::Volts(T::default())
    }
}

/// Memory of a servo; a clone is a snapshot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ServoState<T, S> {
    /// Unwrapped position.
    position: FixedCounts,
    last: Counts,
    /// `θ_d − θ` of the last tick.
    error: FixedCounts,
    velocity: VelocityState<T>,
    law: S,
    applied: Applied<T>,
}

/// The output of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ServoOutput<T: Arithmetic, Terms> {
    /// The code for the converter; [`Dac::volts`] gives its voltage.
    pub code: DacCode,
    /// The law's input.
    pub tick: Tick<T>,
    /// The law's answer.
    pub command: Command<T, Terms>,
}

impl<T: Real> Servo<T> {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of range, by name; also output limits (`lowest`, `highest`) beyond
    /// the converter's range, at which it would clip unseen.
    pub fn new(p: &ServoParams<T>) -> Result<Self, ParamError<T>> {
        let servo = Servo::with_law(p, Law::new(&p.law, &p.beside())?)?;
        // Output and converter have taken these numbers by themselves: now both together.
        p.check_output()?;
        Ok(servo)
    }
}

impl<T: Real, C: ControlLaw<T>> Servo<T, C> {
    /// A servo around a law of your own; `p.law` is not used, and `p.output` by the shell alone.
    ///
    /// # Errors
    /// The first parameter out of range, by name.
    pub fn with_law(p: &ServoParams<T>, law: C) -> Result<Self, ParamError<T>> {
        let model = Plant::new(&p.model)?;
        Ok(Servo {
            law,
            shell: Shell::new(&p.shell, &p.output, p.model.actuator.kind())?,
            velocity: VelocitySource::new(&p.velocity, &model, p.encoder, p.period)?,
            encoder: p.encoder,
            dac: Dac::new(&p.dac)?,
            period: p.period,
            // By a power of two: a product with it has the same bits.
            fine_radians: FixedCounts(1).minus::<T>(FixedCounts(0)) * p.encoder.radians_per_count(),
        })
    }

    /// The law.
    #[must_use]
    pub fn law(&self) -> &C {
        &self.law
    }

    /// The encoder.
    #[must_use]
    pub fn encoder(&self) -> Encoder {
        self.encoder
    }

    /// The converter.
    #[must_use]
    pub fn dac(&self) -> &Dac<T> {
        &self.dac
    }

    /// The sampling period.
    #[must_use]
    pub fn period(&self) -> Micros {
        self.period
    }

    /// The state for a start at `counts` (which becomes the unwrapped position) while the brake
    /// is at `applied` volts and the shaft moves with the target.
    #[must_use]
    pub fn start(&self, counts: Counts, target: &Target<T>, applied: T) -> ServoState<T, C::State> {
        let mut state = ServoState::default();
        self.restart(&mut state, counts, target, applied);
        state
    }

    /// As [`Servo::start`], for [`Servo::tick_at`].
    #[must_use]
    pub fn start_at(&self, position: FixedCounts, target: &Target<T>, applied: T) -> ServoState<T, C::State> {
        let mut state = ServoState::default();
        self.restart_at(&mut state, position, target, applied);
        state
    }

    /// As [`Servo::start`], in place: a board has no room for a second state.
    pub(crate) fn restart(
        &self,
        state: &mut ServoState<T, C::State>,
        counts: Counts,
        target: &Target<T>,
        applied: T,
    ) {
        self.restart_at(state, FixedCounts::from_counts(i64::from(counts.0)), target, applied);
        state.last = counts;
    }

    fn restart_at(
        &self,
        state: &mut ServoState<T, C::State>,
        position: FixedCounts,
        target: &Target<T>,
        applied: T,
    ) {
        state.position = position;
        state.last = Counts::default();
        state.error = FixedCounts(target.position.0.wrapping_sub(position.0));
        state.velocity = self.velocity.start(position, target, applied);
        self.law.restart(&mut state.law, &self.measure(T::from_i64(state.error.0), target, T::ZERO), applied);
        self.law.sees(&mut state.law, || Seen { position, applied, place: Place::default() });
        state.applied = Applied::Volts(applied);
    }

    /// One period.
    #[inline]
    pub fn tick(
        &self,
        state: &mut ServoState<T, C::State>,
        counts: Counts,
        target: &Target<T>,
    ) -> ServoOutput<T, C::Terms> {
        self.tick_on(state, counts, target, off_map)
    }

    /// One period on a disc of which a map has the friction around a position.
    #[inline]
    pub fn tick_on(
        &self,
        state: &mut ServoState<T, C::State>,
        counts: Counts,
        target: &Target<T>,
        map: impl FnOnce(FixedCounts) -> Place<T>,
    ) -> ServoOutput<T, C::Terms> {
        let moved = FixedCounts::from_counts(i64::from(counts.since(state.last)));
        state.last = counts;
        self.tick_at(state, state.position.plus(moved), target, map)
    }

    /// As [`Servo::tick_on`], with a position finer than a count: an interpolating encoder, or the ideal sensor of a
    /// simulation. Use this or [`Servo::tick`] on one state, not both in turn.
    #[inline]
    pub fn tick_at(
        &self,
        state: &mut ServoState<T, C::State>,
        position: FixedCounts,
        target: &Target<T>,
        map: impl FnOnce(FixedCounts) -> Place<T>,
    ) -> ServoOutput<T, C::Terms> {
        state.position = position;
        self.step(state, target, map(position))
    }

    // Not generic over a closure: a board has its code once. The position is in the state: its arguments are in registers then.
    fn step(
        &self,
        state: &mut ServoState<T, C::State>,
        target: &Target<T>,
        place: Place<T>,
    ) -> ServoOutput<T, C::Terms> {
        let position = state.position;
        let error = target.position.0.wrapping_sub(position.0);
        // Both at once, and before anything else: a call for numbers of 64 bits finds no registers in use.
        let [counts, moved] = T::from_both([error, error.wrapping_sub(state.error.0)]);
        state.error = FixedCounts(error);
        let before = state.applied;
        let applied = || match before {
            Applied::Volts(volts) => volts,
            Applied::Code(code) => self.dac.volts(code),
        };
        let error_rate = self.velocity.update(&mut state.velocity, position, target, moved, applied);
        let tick = self.measure(counts, target, error_rate);
        self.law.sees(&mut state.law, || Seen { position, applied: applied(), place });
        let command = self.shell.around(self.law.update(&mut state.law, &tick), &tick);
        let code = self.dac.code(command.voltage);
        state.applied = Applied::Code(code);
        ServoOutput { code, tick, command }
    }

    /// Catches up with a sample that the link lost: `step` of `steps` periods lie between the
    /// last sample and the next, whose counts are `next`. The error is taken to have gone there
    /// in a straight line, so that its rate (5) is the mean one and not `steps` times as large.
    pub fn bridge(
        &self,
        state: &mut ServoState<T, C::State>,
        next: (Counts, &Target<T>),
        target: &Target<T>,
        (step, steps): (u32, u32),
    ) {
        // The encoder's word and the brake's voltage: neither is of this step's making.
        let before = (state.position, state.last, state.applied);
        let moved = FixedCounts::from_counts(i64::from(next.0.since(state.last)));
        let end = next.1.position.0.wrapping_sub(state.position.plus(moved).0);
        let left = u16::try_from(steps.saturating_sub(step).saturating_add(1)).unwrap_or(u16::MAX);
        // Each step closes its share of what is left.
        let share = divided(end.wrapping_sub(state.error.0), left.max(1));
        let error = state.error.0.wrapping_add(share);
        // An edge that nobody saw says nothing of a map.
        let _ = self.tick_at(state, FixedCounts(target.position.0.wrapping_sub(error)), target, off_map);
        (state.position, state.last, state.applied) = before;
    }

    /// `error`: 2⁻¹⁶ counts.
    #[inline]
    fn measure(&self, error: T, target: &Target<T>, error_rate: T) -> Tick<T> {
        Tick {
            error: error * self.fine_radians,
            error_rate,
            target_velocity: target.velocity,
            target_acceleration: target.acceleration,
        }
    }
}

/// `n / by`, the fraction cut off; digit by digit, since a board divides 32 bits at a time. 0 by 0.
fn divided(n: i64, by: u16) -> i64 {
    let (size, by) = (n.unsigned_abs(), u32::from(by));
    let (mut quotient, mut rest) = (0_u64, 0_u32);
    for shift in [48, 32, 16, 0] {
        let digits = rest << 16 | size.wrapping_shr(shift) as u32 & 0xffff;
        let digit = digits.checked_div(by).unwrap_or(0);
        rest = digits.wrapping_sub(digit.wrapping_mul(by));
        quotient = quotient << 16 | u64::from(digit);
    }
    if n < 0 { (quotient as i64).wrapping_neg() } else { quotient as i64 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::PdParams;

    fn servo() -> Servo<f64> {
        Servo::new(&ServoParams::paper(LawParams::Pd(PdParams::default()))).unwrap()
    }

    fn target(counts: i64) -> Target<f64> {
        Target { position: FixedCounts::from_counts(counts), velocity: 0.0, acceleration: 0.0 }
    }

    #[test]
    fn two_counts_ahead_give_the_voltage_of_the_law() {
        let servo = servo();
        let mut state = servo.start(Counts(0), &target(0), 0.0);
        let out = servo.tick(&mut state, Counts(2), &target(0));
        // Two counts ahead: 5000 V/rad · 6.28e-4 rad + 50 V s/rad · 0.2 · 0.628 rad/s = 9.42 V.
        assert!((out.command.voltage - 9.424_777_960_769).abs() < 1e-9);
        assert_eq!(out.code, servo.dac().code(out.command.voltage));
    }

    #[test]
    fn a_start_between_two_counts_is_one_at_a_count_with_the_rest_as_error() {
        let servo = servo();
        let half = FixedCounts(FixedCounts::from_counts(7).0 + (1 << (FixedCounts::FRACTION_BITS - 1)));
        let mut between = servo.start_at(half, &target(7), 0.0);
        let mut at = servo.start(Counts(7), &target(7), 0.0);
        let there = servo.tick_at(&mut between, half, &target(7), off_map);
        let here = servo.tick(&mut at, Counts(7), &target(7));
        // Half a count ahead, without a rate.
        assert_eq!((there.tick.error_rate, here.tick.error), (0.0, 0.0));
        let count: f64 = servo.encoder().radians_per_count();
        assert!((there.tick.error + 0.5 * count).abs() < 1e-12);
        assert!((there.command.voltage - 0.5 * count * 5000.0).abs() < 1e-9);
    }

    #[test]
    fn counts_that_wrap_are_a_shaft_that_turns_on() {
        let servo = servo();
        let start = i64::from(i32::MAX);
        let mut state = servo.start(Counts(i32::MAX), &target(start), 0.0);
        let out = servo.tick(&mut state, Counts(i32::MIN), &target(start + 1));
        assert_eq!(out.tick.error, 0.0);
    }

    /// A path of `rate` counts a period, and counts that lag it by `lag(tick)`.
    fn followed<T: Real>(rate: i64, lag: impl Fn(i64) -> i64) -> impl Fn(i64) -> (Counts, Target<T>) {
        let per_count: T = Encoder::PAPER.radians_per_count();
        move |k| {
            let position = FixedCounts::from_counts(rate * k);
            let velocity = T::from_i64(1000 * rate) * per_count;
            (Counts((rate * k - lag(k)) as i32), Target { position, velocity, acceleration: T::ZERO })
        }
    }

    type LawState<T> = <Law<T> as ControlLaw<T>>::State;

    /// Ticks 0 to `before` one by one, then `lost` samples bridged, then one tick.
    fn across<T: Real>(
        servo: &Servo<T>,
        run: &impl Fn(i64) -> (Counts, Target<T>),
        before: i64,
        lost: u32,
    ) -> (ServoState<T, LawState<T>>, Tick<T>) {
        let (counts, goal) = run(0);
        let mut state = servo.start(counts, &goal, T::ZERO);
        for k in 0..=before {
            let (counts, goal) = run(k);
            servo.tick(&mut state, counts, &goal);
        }
        let (next, goal) = run(before + i64::from(lost) + 1);
        for step in 1..=lost {
            let passed = run(before + i64::from(step)).1;
            servo.bridge(&mut state, (next, &goal), &passed, (step, lost + 1));
        }
        let out = servo.tick(&mut state, next, &goal);
        (state, out.tick)
    }

    fn a_straight_error_is_bridged_exactly<T: Real>() {
        let servo = Servo::<T>::new(&ServoParams::paper(LawParams::Pd(PdParams::default()))).unwrap();
        // The shaft loses four counts each period: whatever is lost, nothing is guessed wrong.
        for rate in [-3, 0, 5] {
            let run = followed::<T>(rate, |k| 4 * k);
            for lost in 0..8 {
                let bridged = across(&servo, &run, 20, lost);
                let seen = across(&servo, &run, 20 + i64::from(lost), 0);
                assert_eq!(bridged, seen, "{lost} samples lost at {rate} counts a period");
            }
        }
    }

    #[test]
    fn lost_samples_of_an_error_that_goes_in_a_straight_line_leave_no_trace() {
        a_straight_error_is_bridged_exactly::<f32>();
        a_straight_error_is_bridged_exactly::<f64>();
    }

    #[test]
    fn a_bridged_gap_gives_the_mean_error_rate_and_not_that_of_one_period() {
        let p = ServoParams {
            velocity: VelocityParams::SmoothedDerivative(crate::SmoothedDerivativeParams { smoothing: 1.0 }),
            ..ServoParams::paper(LawParams::Pd(PdParams::default()))
        };
        let servo = Servo::<f64>::new(&p).unwrap();
        // On the path up to tick 5, 12 counts behind at tick 9: three samples lost, four periods.
        let run = followed(1, |k| if k > 5 { 12 } else { 0 });
        let (_, tick) = across(&servo, &run, 5, 3);
        let count = 0.018_f64.to_radians();
        assert!((tick.error_rate - 3.0 * count / 1e-3).abs() < 1e-9, "{} rad/s", tick.error_rate);
        assert!((tick.error - 12.0 * count).abs() < 1e-12);
        // Without the bridge it would be the whole of it in one period.
        let (counts, goal) = run(5);
        let mut state = servo.start(counts, &goal, 0.0);
        let (next, goal) = run(9);
        let plain = servo.tick(&mut state, next, &goal).tick.error_rate;
        assert!((plain - 12.0 * count / 1e-3).abs() < 1e-9, "{plain} rad/s");
    }

    #[test]
    fn a_bridge_keeps_what_the_encoder_said_and_what_the_brake_got() {
        let servo = servo();
        let mut state = servo.start(Counts(7), &target(7), 3.0);
        let before = state;
        servo.bridge(&mut state, (Counts(i32::MIN), &target(900)), &target(400), (1, 2));
        let kept = |s: &ServoState<f64, _>| (s.position, s.last, s.applied);
        assert_eq!(kept(&state), kept(&before));
        assert_ne!(state, before, "filter and law have gone on");
    }

    #[test]
    fn a_gap_across_the_wrap_of_the_counter_is_bridged_like_any_other() {
        let servo = servo();
        let rates = [i64::from(i32::MAX) - 22, 1000].map(|origin| {
            let run = |k: i64| (Counts((origin + k) as i32), target(origin + k + k % 3));
            across(&servo, &run, 20, 3).1
        });
        assert_eq!(rates[0], rates[1]);
    }

    proptest::proptest! {
        #[test]
        fn division_by_digits_is_division(n: i64, shift in 0..63_u32, by in 1..u16::MAX) {
            for n in [n, n >> shift, i64::MIN, i64::MAX, 0] {
                proptest::prop_assert_eq!(divided(n, by), n / i64::from(by));
            }
        }

        #[test]
        fn no_step_of_a_bridge_is_too_odd_to_take(
            last: i32, next: i32, at: i64, goal: i64, step: u32, steps: u32,
        ) {
            let servo = servo();
            let to = |position| Target { position: FixedCounts(position), ..target(0) };
            let mut state = servo.start(Counts(last), &to(at), 0.0);
            servo.bridge(&mut state, (Counts(next), &to(goal)), &to(at), (step, steps));
            let out = servo.tick(&mut state, Counts(next), &to(goal));
            proptest::prop_assert!(out.command.voltage >= 0.0 && out.command.voltage <= 10.0);
        }
    }

    #[test]
    fn parameters_that_single_precision_holds_come_back_from_it() {
        let p = ServoParams::<f32>::paper(LawParams::Pd(PdParams { kp: 5000.0, kd: 50.0 }));
        assert_eq!(p.cast::<f64>().cast::<f32>(), p);
        let double = ServoParams::<f64>::paper(LawParams::Pd(PdParams::default()));
        assert_eq!(double.cast::<f64>(), double);
    }
}
