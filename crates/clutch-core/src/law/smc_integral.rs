//! Sliding-mode control with a boundary layer and an integral in its surface.
//!
//! ```text
//! σ = ė + f e + z,     ż = g e
//! u = −{K_p sat(σ/ε) + K_d sat(σ ė/ε) ė}                          as (31)
//! ```
//!
//! Within the layer (31) is proportional control and keeps an offset; the integral takes it away (Slotine and Li 1991; Utkin
//! and Shi 1996 for the start on the surface). With a motor the sign turns round.
//!
//! The integral stands still where layer or output saturates and it would go further that way, and never leaves the layer. A
//! run begins with the integral at which the switching part demands the voltage that the brake has.

use super::smc::switched;
use super::{Beside, Command, ControlLaw, Damping, Listed, Output, OutputParams, OutputState, Tick};
use crate::params::{Range, Table};
use crate::{Arithmetic, Each, Micros, ParamError, Real};

crate::params! {
    /// Sliding-mode control with a boundary layer, whose surface has the integral of the error: it keeps no offset.
    ///
    /// `u = −{K_p sat(σ/ε) + K_d sat(σ ė/ε) ė}` with `σ = ė + f e + g ∫ e dt` and a brake, `{…}` with a motor. A start is
    /// bumpless up to `K_p`, and the integral does not wind up at a limit.
    pub struct SmcIntegralParams<T>: Default {
        /// Switching gain.
        kp: T = 7.0, "kp_v" "K_p" V, Range::above(0.0);
        /// Damping gain.
        kd: T = 0.0, "kd_v_s_rad" "K_d" V_S_RAD, Range::at_least(0.0);
        /// Slope of the sliding surface.
        slope: T = 30.0, "slope_1_s" "f" PER_S, Range::above(0.0);
        /// Gain of the integral in the surface.
        integral: T = 3000.0, "integral_1_s2" "g" PER_S2, Range::at_least(0.0);
        /// Thickness of the boundary layer (30).
        boundary: T = 0.27, "boundary_rad_s" "ε" RAD_S, Range::divisor();
    }
}

/// The law, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmcIntegral<T> {
    /// With a motor, gains in volts are negative.
    params: SmcIntegralParams<T>,
    inverse_boundary: T,
    /// Way of the integral in a period for an error of 1 rad, rad/s.
    step: T,
    output: Output<T>,
}

/// Memory of the law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SmcIntegralState<T> {
    /// `z`, rad/s.
    integral: T,
    output: OutputState<T>,
}

super::list::selected! { SmcIntegralState: integral }

impl<T: Real> SmcIntegral<T> {
    /// Checks gains and output stage.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(
        p: &SmcIntegralParams<T>,
        output: &OutputParams<T>,
        period: Micros,
    ) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let step = p.integral * period.period::<T>()?;
        let inverse_boundary = T::ONE / p.boundary;
        Ok(SmcIntegral { params: *p, inverse_boundary, step, output: Output::new(output, period)? })
    }
}

impl<T: Arithmetic> SmcIntegral<T> {
    /// The laws of several lanes as one.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> SmcIntegral<L> {
        let params = SmcIntegralParams {
            kp: each(&|law| law.params.kp),
            kd: each(&|law| law.params.kd),
            slope: each(&|law| law.params.slope),
            integral: each(&|law| law.params.integral),
            boundary: each(&|law| law.params.boundary),
        };
        SmcIntegral {
            params,
            inverse_boundary: each(&|law| law.inverse_boundary),
            step: each(&|law| law.step),
            output: Output::in_lanes(&|get| each(&|law| get(&law.output))),
        }
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn terms(&self, integral: T, tick: &Tick<T>) -> (T, [T; 3]) {
        let SmcIntegralParams { kp, kd, slope, .. } = self.params;
        let surface = slope * tick.error + tick.error_rate + integral;
        switched((kp, kd), surface, tick.error_rate, |x| (x * self.inverse_boundary).sat())
    }
}

impl<T: Arithmetic> ControlLaw<T> for SmcIntegral<T> {
    type State = SmcIntegralState<T>;
    type Terms = [T; 4];
    const TERMS: &'static [&'static str] = &["surface_rad_s", "integral_rad_s", "switching_v", "damping_v"];

    fn start(&self, tick: &Tick<T>, applied: T) -> SmcIntegralState<T> {
        let SmcIntegralParams { kp, slope, boundary, .. } = self.params;
        let wanted = (-(applied * boundary / kp)).limit(-boundary, boundary);
        let integral = wanted - (slope * tick.error + tick.error_rate);
        let within = || integral.limit(-boundary, boundary);
        let found = T::ZERO.less(self.step) & integral.is_finite();
        let integral = T::branch(found, within, || T::ZERO);
        SmcIntegralState { integral, output: self.output.start(self.terms(integral, tick).0, applied) }
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn update(&self, state: &mut SmcIntegralState<T>, tick: &Tick<T>) -> Command<T, [T; 4]> {
        let integral = state.integral;
        let (demand, [surface, switching, damping]) = self.terms(integral, tick);
        let (voltage, limit) = self.output.apply(&mut state.output, demand);
        let step = self.step * tick.error;
        let boundary = self.params.boundary;
        let stays = || integral;
        let moves = || (integral + step).limit(-boundary, boundary);
        let full = || T::branch(T::ZERO.less(step * surface), stays, moves);
        let unlimited = || T::branch(boundary.less_or_equal(surface.abs()), full, moves);
        let next = || T::branch(T::decided(limit), full, unlimited);
        T::put_where(step.is_finite(), &mut state.integral, next);
        Command { voltage, limit, terms: [surface, integral, switching, damping] }
    }
}

impl<T: Real> Listed<T> for SmcIntegral<T> {
    type Params = SmcIntegralParams<T>;
    const TITLE: &'static str = "SMC with an integral";

    /// With all that it has.
    fn busiest() -> SmcIntegralParams<T> {
        SmcIntegralParams { kd: T::from_f64(20.0), ..SmcIntegralParams::default() }
    }

    fn build(p: &SmcIntegralParams<T>, beside: &Beside<'_, T>) -> Result<Self, ParamError<T>> {
        let mut law = SmcIntegral::new(p, beside.output, beside.period)?;
        law.params.kp = beside.sign() * p.kp;
        law.params.kd = beside.sign() * p.kd;
        Ok(law)
    }

    fn output(&self) -> &Output<T> {
        &self.output
    }

    fn damping(p: &SmcIntegralParams<T>) -> Option<Damping<T>> {
        Some(Damping::Voltage(p.kp / p.boundary))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::{Limit, Smc, SmcParams};

    const PERIOD: Micros = Micros(1000);

    fn law(p: SmcIntegralParams) -> SmcIntegral<f64> {
        SmcIntegral::new(&p, &OutputParams::default(), PERIOD).unwrap()
    }

    fn behind(error: f64) -> Tick<f64> {
        Tick { error, ..Tick::default() }
    }

    /// Error of a sliding shaft with the load and friction of Table 1 that a law holds in place, after ten seconds, rad.
    fn held(p: SmcIntegralParams) -> f64 {
        let law = law(p);
        let (mut position, mut velocity) = (0.0_f64, 0.0_f64);
        let mut state = law.start(&Tick::default(), 0.0);
        for _ in 0..10_000 {
            let tick = Tick { error: -position, error_rate: -velocity, ..Tick::default() };
            let volts = law.update(&mut state, &tick).voltage;
            velocity += (0.047088 - 0.021 * volts - 0.001 * velocity) / 0.0017 * 1e-3;
            position += velocity * 1e-3;
        }
        -position
    }

    #[test]
    fn an_integral_in_the_surface_takes_away_the_offset_that_the_layer_keeps() {
        let p = SmcIntegralParams::default();
        let without = held(SmcIntegralParams { integral: 0.0, ..p });
        // e = −v_h ε/(K_p f): theory, section 4.
        let offset = -(0.047088 / 0.021) * p.boundary / (p.kp * p.slope);
        assert!((without / offset - 1.0).abs() < 1e-6, "{without} and {offset} rad");
        assert!(held(p).abs() < 1e-6 * offset.abs(), "{} rad", held(p));
    }

    #[test]
    fn without_an_integral_it_is_the_law_31() {
        let p = SmcIntegralParams { kd: 30.0, integral: 0.0, ..SmcIntegralParams::default() };
        let SmcIntegralParams { kp, kd, slope, boundary, .. } = p;
        let output = OutputParams::default();
        let smc = Smc::new(&SmcParams { kp, kd, slope, boundary }, &output, PERIOD).unwrap();
        let (mut one, mut other) = (SmcIntegralState::default(), OutputState::default());
        let mut inside = 0;
        for k in 0..1000 {
            let swing = f64::from(k) * 0.1;
            let tick = Tick { error: -6e-3 * swing.sin(), error_rate: -0.6 * swing.cos(), ..Tick::default() };
            let (a, b) = (law(p).update(&mut one, &tick), smc.update(&mut other, &tick));
            assert_eq!((a.voltage, a.limit), (b.voltage, b.limit), "tick {k}");
            inside += usize::from(a.terms[0].abs() < boundary);
        }
        assert!((100..900).contains(&inside), "{inside} ticks within the layer");
    }

    #[test]
    fn an_integral_at_a_limit_stands_still_and_never_leaves_the_layer() {
        let p = SmcIntegralParams { kp: 5.0, ..SmcIntegralParams::default() };
        let law = law(p);
        let mut state = law.start(&behind(0.0), 2.25);
        let found = state.integral;
        for _ in 0..1000 {
            assert_eq!(law.update(&mut state, &behind(0.1)).limit, Limit::Lowest);
        }
        assert_eq!(state.integral, found);
        // Beyond the layer with the output not yet at its limit.
        for _ in 0..1000 {
            assert_eq!(law.update(&mut state, &behind(-0.1)).voltage, 5.0);
        }
        assert_eq!(state.integral, found);
        for _ in 0..100_000 {
            law.update(&mut state, &behind(-1e-4));
        }
        assert!(state.integral <= -0.95 * p.boundary && state.integral >= -p.boundary, "{}", state.integral);
    }

    #[test]
    fn a_start_takes_over_a_voltage_up_to_the_switching_gain() {
        let tick = Tick { error: -1e-4, error_rate: 0.01, target_velocity: 0.03, target_acceleration: 0.0 };
        let law = law(SmcIntegralParams { kp: 5.0, ..SmcIntegralParams::default() });
        for (applied, first) in [(2.25, 2.25), (4.9, 4.9), (9.0, 5.0)] {
            let volts = law.update(&mut law.start(&tick, applied), &tick).voltage;
            assert!((volts - first).abs() < 0.03 * first, "{volts} V after {applied} V");
        }
    }

    #[test]
    fn a_measurement_that_is_no_number_spoils_one_tick() {
        let law = law(SmcIntegralParams::default());
        let mut state = law.start(&Tick::default(), 3.0);
        let bad = Tick { error_rate: f64::NAN, ..behind(f64::NAN) };
        assert_eq!(law.update(&mut state, &bad).limit, Limit::Invalid);
        assert!((law.update(&mut state, &Tick::default()).voltage - 3.0).abs() < 1e-12);
        assert_eq!(law.start(&behind(f64::NAN), 3.0), SmcIntegralState::default());
    }
}
