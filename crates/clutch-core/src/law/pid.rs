//! Proportional–integral–derivative control with feed-forward.
//!
//! ```text
//! u = u_0 − (K_p e + K_i ∫ e dt + K_d d + K_c sgn θ̇_d + K_v θ̇_d + K_a θ̈_d),     τ ḋ = ė − d
//! ```
//!
//! This is the sign for a brake; with a motor it is `u_0 + (…)`.
//!
//! While a limit of the output decides, the integral follows it with the tracking time (back-calculation,
//! Åström and Hägglund 2006): it holds what the actuator gives and not what it was asked for. A run begins with
//! the integral at which the law demands the voltage that the brake has, so that the start is bumpless.

use super::{Beside, Command, ControlLaw, Damping, Listed, Output, OutputParams, OutputState, SampledForm, Tick};
use crate::params::{Range, Table};
use crate::{Arithmetic, Each, Micros, ParamError, Real};

crate::params! {
    /// PID control with feed-forward, a filtered derivative, and an integral that does not wind up at a limit.
    ///
    /// `u = u_0 − (K_p e + K_i ∫ e dt + K_d d + K_c sgn θ̇_d + K_v θ̇_d + K_a θ̈_d)` with a brake, `u_0 + (…)` with a motor;
    /// `τ ḋ = ė − d`. A start is bumpless where there is an integral. The feed-forward of a believed plant is
    /// `u_0 = T_u/(μ K_COF)`, `K_v = C_d/(μ K_COF)`, `K_a = J/(μ K_COF)` with a brake; `u_0 = −T_u/k_t`,
    /// `K_c = μ N_0/k_t`, `K_v = C_d/k_t`, `K_a = J/k_t` with a motor.
    pub struct PidParams<T>: Default {
        /// Proportional gain.
        kp: T = 1000.0, "kp_v_rad" "K_p" V_RAD, Range::at_least(0.0);
        /// Integral gain.
        ki: T = 10000.0, "ki_v_rad_s" "K_i" V_RAD_S, Range::at_least(0.0);
        /// Derivative gain.
        kd: T = 20.0, "kd_v_s_rad" "K_d" V_S_RAD, Range::at_least(0.0);
        /// Time constant of the derivative's filter; 0 takes the error rate as it is.
        derivative_time: T = 0.0, "derivative_time_s" "τ" S, Range::at_least(0.0);
        /// Time in which the integral follows a limit of the output.
        tracking_time: T = 0.05, "tracking_time_s" "T_t" S, Range::above(0.0);
        /// Voltage without error, at rest.
        bias: T = 0.0, "bias_v" "u_0" V, Range::ANY;
        /// Feed-forward of friction: this voltage the way that the path goes, none where it rests.
        coulomb: T = 0.0, "coulomb_v" "K_c" V, Range::ANY;
        /// Feed-forward of the path's velocity.
        velocity: T = 0.0, "velocity_v_s_rad" "K_v" V_S_RAD, Range::ANY;
        /// Feed-forward of the path's acceleration.
        acceleration: T = 0.0, "acceleration_v_s2_rad" "K_a" V_S2_RAD, Range::ANY;
    }
    relations(p) {
        /// A period is no longer than the time in which the integral follows.
        SLOWER_THAN_A_PERIOD: tracking_time, "a time of at least sampling.period_us, s";
    }
}

/// The law, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pid<T> {
    params: PidParams<T>,
    /// Integral gain times the period, V/rad; with a motor negative, as the gains in `params`.
    integral_step: T,
    /// Share of a new error rate in the filtered one.
    newest: T,
    /// Share of what a limit cuts off that the integral takes back in a period.
    tracking: T,
    /// Filtered rate at which the derivative part alone spans the output, rad/s.
    fastest: T,
    output: Output<T>,
}

/// Memory of the law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PidState<T> {
    /// `−K_i ∫ e dt` and what a start and limits have added, V.
    integral: T,
    /// `d`, rad/s.
    rate: T,
    output: OutputState<T>,
}

super::list::selected! { PidState: integral rate }

impl<T: Real> Pid<T> {
    /// Checks gains and output stage.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(p: &PidParams<T>, output: &OutputParams<T>, period: Micros) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let seconds = period.period::<T>()?;
        PidParams::SLOWER_THAN_A_PERIOD.require(p.tracking_time, p.tracking_time >= seconds)?;
        let span = output.highest - output.lowest;
        Ok(Pid {
            params: *p,
            integral_step: p.ki * seconds,
            newest: seconds / (p.derivative_time + seconds),
            // Without an integral nothing would ever bring back what a limit has taken.
            tracking: if p.ki > T::ZERO { seconds / p.tracking_time } else { T::ZERO },
            fastest: if p.kd > T::ZERO { span / p.kd } else { T::ZERO },
            output: Output::new(output, period)?,
        })
    }
}

impl<T: Arithmetic> Pid<T> {
    /// The laws of several lanes as one.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> Pid<L> {
        let p = |get: fn(&PidParams<T>) -> T| each(&|law| get(&law.params));
        let params = PidParams {
            kp: p(|p| p.kp),
            ki: p(|p| p.ki),
            kd: p(|p| p.kd),
            derivative_time: p(|p| p.derivative_time),
            tracking_time: p(|p| p.tracking_time),
            bias: p(|p| p.bias),
            coulomb: p(|p| p.coulomb),
            velocity: p(|p| p.velocity),
            acceleration: p(|p| p.acceleration),
        };
        Pid {
            params,
            integral_step: each(&|law| law.integral_step),
            newest: each(&|law| law.newest),
            tracking: each(&|law| law.tracking),
            fastest: each(&|law| law.fastest),
            output: Output::in_lanes(&|get| each(&|law| get(&law.output))),
        }
    }

    /// Proportional, derivative and feed-forward part, V.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn parts(&self, tick: &Tick<T>, rate: T) -> (T, T, T) {
        let p = &self.params;
        let way = tick.target_velocity.sgn();
        let along = p.velocity * tick.target_velocity + p.acceleration * tick.target_acceleration;
        let forward = p.bias - (p.coulomb * way + along);
        (-(p.kp * tick.error), -(p.kd * rate), forward)
    }
}

impl<T: Arithmetic> ControlLaw<T> for Pid<T> {
    type State = PidState<T>;
    type Terms = [T; 5];
    const TERMS: &'static [&'static str] =
        &["proportional_v", "integral_v", "derivative_v", "feed_forward_v", "cut_off_v"];

    fn start(&self, tick: &Tick<T>, applied: T) -> PidState<T> {
        let (proportional, derivative, forward) = self.parts(tick, tick.error_rate);
        let without = proportional + derivative + forward;
        // The first tick adds a step of its own.
        let integral = applied - without + self.integral_step * tick.error;
        let found = T::ZERO.less(self.integral_step.abs()) & integral.is_finite();
        let integral = T::select(found, integral, T::ZERO);
        let output = self.output.start(without + integral - self.integral_step * tick.error, applied);
        PidState { integral, rate: tick.error_rate, output }
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn update(&self, state: &mut PidState<T>, tick: &Tick<T>) -> Command<T, [T; 5]> {
        state.rate = state.rate + self.newest * (tick.error_rate - state.rate);
        let (proportional, derivative, forward) = self.parts(tick, state.rate);
        let integral = state.integral - self.integral_step * tick.error;
        let demand = proportional + integral + derivative + forward;
        let (voltage, limit) = self.output.apply(&mut state.output, demand);
        // Only a limit cuts something off; the offset of a bumpless start is none.
        let limited = voltage.less_or_equal(self.output.lowest()) | self.output.highest().less_or_equal(voltage);
        let cut_off = T::select(limited, voltage - demand, T::ZERO);
        let next = integral + self.tracking * cut_off;
        // One measurement that is no number, or beyond measure, spoils one tick and not the run: what is remembered
        // stays within what the output can answer.
        let (low, high) = (self.output.lowest() - forward, self.output.highest() - forward);
        state.integral = T::select(next.is_finite(), next.limit(low, high), state.integral);
        let rate = state.rate.limit(-self.fastest, self.fastest);
        state.rate = T::select(state.rate.is_finite(), rate, T::ZERO);
        Command { voltage, limit, terms: [proportional, integral, derivative, forward, cut_off] }
    }
}

impl<T: Real> Listed<T> for Pid<T> {
    type Params = PidParams<T>;
    const TITLE: &'static str = "PID";
    const SAMPLED_IF: &'static str = "without derivative_time_s";

    /// With all that it has.
    fn busiest() -> PidParams<T> {
        let part = |x: f64| T::from_f64(x);
        PidParams {
            derivative_time: part(0.002),
            bias: part(2.0),
            velocity: part(0.5),
            acceleration: part(0.1),
            ..PidParams::default()
        }
    }

    fn build(p: &PidParams<T>, beside: &Beside<'_, T>) -> Result<Self, ParamError<T>> {
        let sign = beside.sign();
        let mut law = Pid::new(p, beside.output, beside.period)?;
        let PidParams { kp, kd, coulomb, velocity, acceleration, .. } = p;
        law.params.kp = sign * *kp;
        law.params.kd = sign * *kd;
        law.params.coulomb = sign * *coulomb;
        law.params.velocity = sign * *velocity;
        law.params.acceleration = sign * *acceleration;
        law.integral_step = sign * law.integral_step;
        Ok(law)
    }

    fn output(&self) -> &Output<T> {
        &self.output
    }

    fn damping(p: &PidParams<T>) -> Option<Damping<T>> {
        Some(Damping::Voltage(p.kd))
    }

    /// Sampled form, where the derivative has no filter.
    fn sampled(p: &PidParams<T>) -> Option<SampledForm<T>> {
        let PidParams { kp, ki, tracking_time, kd, bias, coulomb, velocity, .. } = *p;
        let form = SampledForm::Linear { kp, ki, tracking_time, kd, bias, coulomb, velocity };
        (p.derivative_time == T::ZERO).then_some(form)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    const PERIOD: Micros = Micros(1000);

    fn pid(p: PidParams) -> Pid<f64> {
        Pid::new(&p, &OutputParams::default(), PERIOD).unwrap()
    }

    fn behind(error: f64) -> Tick<f64> {
        Tick { error, ..Tick::default() }
    }

    #[test]
    fn an_integral_grows_with_the_error_and_the_time() {
        let law = pid(PidParams { kp: 0.0, kd: 0.0, ki: 100.0, bias: 5.0, ..PidParams::default() });
        let mut state = PidState::default();
        let mut last = 0.0;
        for _ in 0..500 {
            last = law.update(&mut state, &behind(0.01)).voltage;
        }
        // 5 V − 100 V/(rad s) · 0.01 rad · 0.5 s
        assert!((last - 4.5).abs() < 1e-12, "{last}");
    }

    #[test]
    fn an_integral_at_a_limit_lets_go_within_the_tracking_time() {
        let p = PidParams { kp: 100.0, ki: 1000.0, kd: 0.0, tracking_time: 0.02, ..PidParams::default() };
        let law = pid(p);
        let mut state = PidState::default();
        // A second with 1000 V asked for: without tracking the integral would hold 1000 V.
        for _ in 0..1000 {
            assert_eq!(law.update(&mut state, &behind(-1.0)).voltage, 10.0);
        }
        // The proportional part alone is 90 V too much: the tracking has emptied the integral.
        let [.., integral, _, _, cut_off] = law.update(&mut state, &behind(-1.0)).terms;
        assert!(integral < 1.1 && cut_off < -90.0, "{integral} V, {cut_off} V");
        let ticks = (0..).take_while(|_| law.update(&mut state, &behind(0.02)).voltage >= 10.0).count();
        assert!(ticks <= 1, "{ticks} ms at the limit after the error has turned");
    }

    #[test]
    fn without_an_integral_a_limit_leaves_nothing_behind() {
        let law = pid(PidParams { ki: 0.0, kd: 0.0, bias: 2.25, ..PidParams::default() });
        let mut state = law.start(&Tick::default(), 2.25);
        for error in [-0.1, 0.1] {
            let limit = (0..1000).map(|_| law.update(&mut state, &behind(error)).voltage).next_back();
            assert_eq!(limit, Some(if error < 0.0 { 10.0 } else { 0.0 }));
            assert_eq!(law.update(&mut state, &Tick::default()).voltage, 2.25, "after {error} rad");
        }
    }

    #[test]
    fn a_start_takes_over_the_voltage_that_the_brake_has() {
        let law = pid(PidParams { bias: 1.0, ..PidParams::default() });
        let tick = Tick { error: 1e-4, error_rate: 0.01, target_velocity: 0.03, target_acceleration: 0.0 };
        let mut state = law.start(&tick, 2.25);
        assert!((law.update(&mut state, &tick).voltage - 2.25).abs() < 1e-12);
        // Without an integral the output stage does it, if it is asked to.
        let p = PidParams { ki: 0.0, ..PidParams::default() };
        let slow = OutputParams { bumpless_time: 0.05, ..OutputParams::default() };
        let law = Pid::new(&p, &slow, PERIOD).unwrap();
        let mut state = law.start(&tick, 2.25);
        assert!((law.update(&mut state, &tick).voltage - 2.25).abs() < 1e-12);
    }

    #[test]
    fn a_filtered_derivative_reaches_a_step_by_1_over_1_plus_its_time_in_periods() {
        let p = PidParams { kp: 0.0, ki: 0.0, kd: 1.0, bias: 5.0, derivative_time: 0.009, ..PidParams::default() };
        let law = pid(p);
        let mut state = PidState::default();
        for n in 1..40 {
            let tick = Tick { error_rate: 1.0, ..Tick::default() };
            let expected = 5.0 - (1.0 - 0.9_f64.powi(n));
            assert!((law.update(&mut state, &tick).voltage - expected).abs() < 1e-12, "tick {n}");
        }
    }

    #[test]
    fn feed_forward_carries_a_path_without_an_error() {
        // The voltage by (1) on an accelerated path with the friction of a fast shaft.
        let (mu_k, j, c, torque) = (0.15 * 0.14, 0.0017, 0.001, 0.047088);
        let p = PidParams {
            bias: torque / mu_k,
            velocity: c / mu_k,
            acceleration: j / mu_k,
            ..PidParams::default()
        };
        let tick = Tick { target_velocity: 0.5, target_acceleration: 2.0, ..Tick::default() };
        let volts = pid(p).update(&mut PidState::default(), &tick).voltage;
        assert!((volts - (torque - j * 2.0 - c * 0.5) / mu_k).abs() < 1e-12);
    }

    #[test]
    fn a_measurement_that_is_no_number_spoils_one_tick() {
        let law = pid(PidParams::default());
        let mut state = law.start(&Tick::default(), 3.0);
        let bad = Tick { error: f64::NAN, error_rate: f64::NAN, ..Tick::default() };
        assert_eq!(law.update(&mut state, &bad).limit, crate::law::Limit::Invalid);
        assert!((law.update(&mut state, &Tick::default()).voltage - 3.0).abs() < 1e-12);
    }

    #[test]
    fn an_integral_faster_than_a_period_is_refused() {
        let p = PidParams { tracking_time: 0.0005, ..PidParams::default() };
        let e = Pid::<f64>::new(&p, &OutputParams::default(), PERIOD).unwrap_err();
        assert_eq!(e.field(), "tracking_time");
        assert_eq!(e.to_string(), "tracking_time_s = 0.0005: expected a time of at least sampling.period_us, s");
    }
}
