//! Proportional–derivative control.
//!
//! ```text
//! u = −(K_p e + K_d ė)                                            (4), with a brake's sign
//! ```
//!
//! The paper prints (4) without the minus. With `e = θ_d − θ > 0` the shaft lags and the brake
//! has to let go; as printed it holds harder and the shaft never comes back.

use super::{
    Asked, Beside, Command, ControlLaw, Damping, Listed, Output, OutputParams, OutputState, SampledForm, Surface, Tick,
};
use crate::params::{Range, Table};
use crate::{Arithmetic, Each, Micros, ParamError, Real};

crate::params! {
    /// Proportional–derivative control (4): `u = −(K_p e + K_d ė)`. The gains' defaults are Table 2's.
    pub struct PdParams<T>: Default {
        /// Proportional gain of (4).
        kp: T = 5000.0, "kp_v_rad" "K_p" V_RAD, Range::at_least(0.0);
        /// Derivative gain of (4).
        kd: T = 50.0, "kd_v_s_rad" "K_d" V_S_RAD, Range::at_least(0.0);
    }
}

/// The law (4), checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pd<T> {
    /// With a motor, negative.
    params: PdParams<T>,
    output: Output<T>,
}

impl<T: Real> Pd<T> {
    /// Checks gains and output stage.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(p: &PdParams<T>, output: &OutputParams<T>, period: Micros) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        Ok(Pd { params: *p, output: Output::new(output, period)? })
    }
}

impl<T: Arithmetic> Pd<T> {
    /// The laws of several lanes as one.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> Pd<L> {
        let output = Output::in_lanes(&|get| each(&|law| get(&law.output)));
        Pd { params: PdParams { kp: each(&|law| law.params.kp), kd: each(&|law| law.params.kd) }, output }
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn terms(&self, tick: &Tick<T>) -> (T, [T; 2]) {
        let proportional = -(self.params.kp * tick.error);
        let derivative = -(self.params.kd * tick.error_rate);
        (proportional + derivative, [proportional, derivative])
    }
}

impl<T: Arithmetic> ControlLaw<T> for Pd<T> {
    type State = OutputState<T>;
    type Terms = [T; 2];
    const TERMS: &'static [&'static str] = &["proportional_v", "derivative_v"];

    fn start(&self, tick: &Tick<T>, applied: T) -> Self::State {
        self.output.start(self.terms(tick).0, applied)
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn update(&self, state: &mut Self::State, tick: &Tick<T>) -> Command<T, Self::Terms> {
        let (demand, terms) = self.terms(tick);
        let (voltage, limit) = self.output.apply(state, demand);
        Command { voltage, limit, terms }
    }
}

impl<T: Real> Listed<T> for Pd<T> {
    type Params = PdParams<T>;
    const TITLE: &'static str = "PD (4)";

    fn build(p: &PdParams<T>, beside: &Beside<'_, T>) -> Result<Self, ParamError<T>> {
        let mut law = Pd::new(p, beside.output, beside.period)?;
        law.params = PdParams { kp: beside.sign() * p.kp, kd: beside.sign() * p.kd };
        Ok(law)
    }

    fn output(&self) -> &Output<T> {
        &self.output
    }

    fn damping(p: &PdParams<T>) -> Option<Damping<T>> {
        Some(Damping::Voltage(p.kd))
    }

    fn sampled(p: &PdParams<T>) -> Option<SampledForm<T>> {
        let none = T::ZERO;
        Some(SampledForm::Linear {
            kp: p.kp,
            ki: none,
            tracking_time: none,
            kd: p.kd,
            bias: none,
            coulomb: none,
            velocity: none,
        })
    }

    fn surface(&self, _: &Asked<'_, T>) -> Option<Surface<T>> {
        let (kp, kd) = (self.params.kp.abs(), self.params.kd.abs());
        (kd > T::ZERO && kp > T::ZERO).then(|| Surface::affine(kp / kd, self.output.limits(), kd))
    }
}
