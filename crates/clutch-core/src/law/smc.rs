//! Sliding-mode control with the saturation boundary layer.
//!
//! ```text
//! σ = f e + ė                                                     (13)
//! u = −{K_p sat(σ/ε) + K_d sat(σ ė/ε) ė}                          (31)
//! ```
//!
//! `ε` divides `σ` (rad/s) and `σ ė` (rad²/s²) alike; the paper gives it no unit.

use super::{
    Asked, Beside, Command, ControlLaw, Damping, Listed, Output, OutputParams, OutputState, SampledForm, Surface, Tick,
};
use crate::params::{Range, Table};
use crate::{Arithmetic, Each, Micros, ParamError, Real};

crate::params! {
    /// Sliding-mode control with a boundary layer (31). The gains' defaults are Table 2's.
    ///
    /// `u = −{K_p sat(σ/ε) + K_d sat(σ ė/ε) ė}` with `σ = f e + ė`.
    pub struct SmcParams<T>: Default {
        /// Switching gain of (31).
        kp: T = 3.0, "kp_v" "K_p" V, Range::at_least(0.0);
        /// Damping gain of (31).
        kd: T = 400.0, "kd_v_s_rad" "K_d" V_S_RAD, Range::at_least(0.0);
        /// Slope of the sliding surface (13).
        slope: T = 70.0, "slope_1_s" "f" PER_S, Range::above(0.0);
        /// Thickness of the boundary layer (30).
        boundary: T = 0.1, "boundary_rad_s" "ε" RAD_S, Range::divisor();
    }
}

/// The law (31), checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smc<T> {
    /// With a motor, gains are negative.
    params: SmcParams<T>,
    inverse_boundary: T,
    output: Output<T>,
}

impl<T: Real> Smc<T> {
    /// Checks gains and output stage.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(p: &SmcParams<T>, output: &OutputParams<T>, period: Micros) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let inverse_boundary = T::ONE / p.boundary;
        Ok(Smc { params: *p, inverse_boundary, output: Output::new(output, period)? })
    }
}

/// The two parts of a sliding law, of `σ` and `σ ė`: their sum, and `σ` with both.
#[cfg_attr(target_os = "none", inline)]
#[cfg_attr(not(target_os = "none"), inline(always))]
pub(super) fn switched<T: Arithmetic>(
    (kp, kd): (T, T),
    surface: T,
    error_rate: T,
    switch: impl Fn(T) -> T,
) -> (T, [T; 3]) {
    let across = surface * error_rate;
    let switching = -(kp * switch(surface));
    let damping = -(kd * switch(across) * error_rate);
    (switching + damping, [surface, switching, damping])
}

impl<T: Arithmetic> Smc<T> {
    /// The laws of several lanes as one.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> Smc<L> {
        let output = Output::in_lanes(&|get| each(&|law| get(&law.output)));
        let params = SmcParams {
            kp: each(&|law| law.params.kp),
            kd: each(&|law| law.params.kd),
            slope: each(&|law| law.params.slope),
            boundary: each(&|law| law.params.boundary),
        };
        Smc { params, inverse_boundary: each(&|law| law.inverse_boundary), output }
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn terms(&self, tick: &Tick<T>) -> (T, [T; 3]) {
        let SmcParams { kp, kd, slope, .. } = self.params;
        let surface = slope * tick.error + tick.error_rate;
        switched((kp, kd), surface, tick.error_rate, |x| (x * self.inverse_boundary).sat())
    }
}

impl<T: Arithmetic> ControlLaw<T> for Smc<T> {
    type State = OutputState<T>;
    type Terms = [T; 3];
    const TERMS: &'static [&'static str] = &["surface_rad_s", "switching_v", "damping_v"];

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

impl<T: Real> Listed<T> for Smc<T> {
    type Params = SmcParams<T>;
    const TITLE: &'static str = "SMC (31), with boundary layer";

    fn build(p: &SmcParams<T>, beside: &Beside<'_, T>) -> Result<Self, ParamError<T>> {
        let mut law = Smc::new(p, beside.output, beside.period)?;
        law.params.kp = beside.sign() * p.kp;
        law.params.kd = beside.sign() * p.kd;
        Ok(law)
    }

    fn output(&self) -> &Output<T> {
        &self.output
    }

    fn damping(p: &SmcParams<T>) -> Option<Damping<T>> {
        Some(Damping::Voltage(p.kp / p.boundary))
    }

    fn sampled(p: &SmcParams<T>) -> Option<SampledForm<T>> {
        Some(SampledForm::Layer { kp: p.kp, kd: p.kd, slope: p.slope, boundary: p.boundary })
    }

    fn surface(&self, _: &Asked<'_, T>) -> Option<Surface<T>> {
        let SmcParams { kp, kd, slope, .. } = self.params;
        let (kp, kd) = (kp.abs(), kd.abs());
        // The layer as the law computes with it.
        let layer = T::ONE / self.inverse_boundary;
        Some(Surface { slope, layer, kp, kd: Some(kd), weakened: layer > T::ZERO, sliding: true })
    }
}
