//! Proportional–derivative control.
//!
//! ```text
//! u = −(K_p e + K_d ė)                                            (4), with a brake's sign
//! ```
//!
//! The paper prints (4) without the minus. With `e = θ_d − θ > 0` the shaft lags and the brake
//! has to let go; as printed it holds harder and the shaft never comes back.

use super::output::{Output, OutputParams, OutputState};
use super::{Command, Controller, Terms, Tick};
use crate::error::{cast, require};
use crate::{Micros, ParamError, Real};

/// Gains of (4); `Default` = Table 2.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct PdParams<T = f64> {
    /// `K_p` in (4), V/rad.
    pub kp: T,
    /// `K_d` in (4), V s/rad.
    pub kd: T,
}

cast!(PdParams { kp, kd });

impl<T: Real> Default for PdParams<T> {
    fn default() -> Self {
        PdParams { kp: T::from_i32(5000), kd: T::from_i32(50) }
    }
}

/// The law (4), checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pd<T> {
    params: PdParams<T>,
    output: Output<T>,
}

/// Intermediate terms of (4).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PdTerms<T> {
    /// `−K_p e`, V.
    pub proportional: T,
    /// `−K_d ė`, V.
    pub derivative: T,
}

impl<T: Real> Terms<T> for PdTerms<T> {
    fn columns(&self) -> [(&'static str, T); 3] {
        [
            ("proportional_v", self.proportional),
            ("derivative_v", self.derivative),
            ("demand_v", self.proportional + self.derivative),
        ]
    }
}

impl<T: Real> Pd<T> {
    /// Checks gains and output stage.
    ///
    /// # Errors
    /// `kp` or `kd` negative or not finite; a bad output stage or period.
    pub fn new(p: &PdParams<T>, output: &OutputParams<T>, period: Micros) -> Result<Self, ParamError<T>> {
        require("kp", p.kp, p.kp >= T::ZERO, "a finite number of at least 0 V/rad")?;
        require("kd", p.kd, p.kd >= T::ZERO, "a finite number of at least 0 V s/rad")?;
        Ok(Pd { params: *p, output: Output::new(output, period)? })
    }

    /// The gains.
    #[must_use]
    pub fn params(&self) -> &PdParams<T> {
        &self.params
    }

    /// The output stage.
    #[must_use]
    pub fn output(&self) -> &Output<T> {
        &self.output
    }

    #[inline]
    fn terms(&self, tick: &Tick<T>) -> (T, PdTerms<T>) {
        let terms = PdTerms {
            proportional: -(self.params.kp * tick.error),
            derivative: -(self.params.kd * tick.error_rate),
        };
        (terms.proportional + terms.derivative, terms)
    }
}

impl<T: Real> Controller<T> for Pd<T> {
    type State = OutputState<T>;
    type Terms = PdTerms<T>;

    fn start(&self, tick: &Tick<T>, applied: T) -> Self::State {
        self.output.start(self.terms(tick).0, applied)
    }

    #[inline]
    fn update(&self, state: &mut Self::State, tick: &Tick<T>) -> Command<T, Self::Terms> {
        let (demand, terms) = self.terms(tick);
        let (voltage, limit) = self.output.apply(state, demand);
        Command { voltage, limit, terms }
    }
}
