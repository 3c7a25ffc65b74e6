//! Sliding-mode control with the sign function: it chatters.
//!
//! ```text
//! u = −{K_p sgn(σ) + K_d sgn(σ ė) ė}                              (29)
//! ```

use super::smc::switched;
use super::{Asked, Beside, Command, ControlLaw, Listed, Output, OutputParams, OutputState, Surface, Tick};
use crate::params::{Range, Table};
use crate::{Arithmetic, Each, Micros, ParamError, Real};

crate::params! {
    /// Sliding-mode control with the sign function (29), without a boundary layer: it chatters. The gains' defaults are Table 2's.
    ///
    /// `u = −{K_p sgn(σ) + K_d sgn(σ ė) ė}` with `σ = f e + ė`.
    pub struct SmcSignParams<T>: Default {
        /// Switching gain of (29).
        kp: T = 3.0, "kp_v" "K_p" V, Range::at_least(0.0);
        /// Damping gain of (29).
        kd: T = 400.0, "kd_v_s_rad" "K_d" V_S_RAD, Range::at_least(0.0);
        /// Slope of the sliding surface (13).
        slope: T = 70.0, "slope_1_s" "f" PER_S, Range::above(0.0);
    }
}

/// The law (29), checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmcSign<T> {
    /// With a motor, gains are negative.
    params: SmcSignParams<T>,
    output: Output<T>,
}

impl<T: Real> SmcSign<T> {
    /// Checks gains and output stage.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(p: &SmcSignParams<T>, output: &OutputParams<T>, period: Micros) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        Ok(SmcSign { params: *p, output: Output::new(output, period)? })
    }
}

impl<T: Arithmetic> SmcSign<T> {
    /// The laws of several lanes as one.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> SmcSign<L> {
        let output = Output::in_lanes(&|get| each(&|law| get(&law.output)));
        let params = SmcSignParams {
            kp: each(&|law| law.params.kp),
            kd: each(&|law| law.params.kd),
            slope: each(&|law| law.params.slope),
        };
        SmcSign { params, output }
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn terms(&self, tick: &Tick<T>) -> (T, [T; 3]) {
        let SmcSignParams { kp, kd, slope } = self.params;
        let surface = slope * tick.error + tick.error_rate;
        switched((kp, kd), surface, tick.error_rate, T::sgn)
    }
}

impl<T: Arithmetic> ControlLaw<T> for SmcSign<T> {
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

impl<T: Real> Listed<T> for SmcSign<T> {
    type Params = SmcSignParams<T>;
    const TITLE: &'static str = "SMC (29), with the sign function";

    fn build(p: &SmcSignParams<T>, beside: &Beside<'_, T>) -> Result<Self, ParamError<T>> {
        let mut law = SmcSign::new(p, beside.output, beside.period)?;
        law.params.kp = beside.sign() * p.kp;
        law.params.kd = beside.sign() * p.kd;
        Ok(law)
    }

    fn output(&self) -> &Output<T> {
        &self.output
    }

    fn surface(&self, _: &Asked<'_, T>) -> Option<Surface<T>> {
        let SmcSignParams { kp, kd, slope } = self.params;
        let (kp, kd) = (kp.abs(), kd.abs());
        Some(Surface { slope, layer: T::ZERO, kp, kd: Some(kd), weakened: false, sliding: true })
    }
}
