//! Computed-torque control: the plant (1) solved for the voltage.
//!
//! ```text
//! τ = −K (K_p e + K_d ė)                                          (10)
//! u = [T_u − J (θ̈_d − τ) − C_d θ̇] / (μ(θ̇) K_COF)                  (9), (11)
//! ```
//!
//! `θ̇` is the measured velocity, `θ̇_d − ė`, and `μ` is taken without its sign: a shaft at
//! rest is about to move, so `μ = μ_s` there.

use super::output::{Output, OutputParams, OutputState};
use super::{Command, Controller, Terms, Tick};
use crate::error::{cast, require};
use crate::{Micros, ParamError, Plant, PlantParams, Real};

/// Gains of (11); `Default` = Table 2.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct CtcParams<T = f64> {
    /// `K` in (10), no unit.
    #[doc(alias = "K")]
    pub outer_gain: T,
    /// `K_p` in (10), 1/s².
    pub kp: T,
    /// `K_d` in (10), 1/s.
    pub kd: T,
}

cast!(CtcParams { outer_gain, kp, kd });

impl<T: Real> Default for CtcParams<T> {
    fn default() -> Self {
        CtcParams { outer_gain: T::from_i32(90), kp: T::from_i32(100), kd: T::from_f64(0.7) }
    }
}

/// The law (11), checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ctc<T> {
    params: CtcParams<T>,
    model: Plant<T>,
    output: Output<T>,
}

/// Intermediate terms of (11).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CtcTerms<T> {
    /// `τ` in (10), rad/s².
    pub accel_demand: T,
    /// `T_f` in (8): friction torque asked for, N m.
    pub friction_torque: T,
    /// `|μ(θ̇)|` by the model.
    pub mu: T,
}

impl<T: Real> Terms<T> for CtcTerms<T> {
    fn columns(&self) -> [(&'static str, T); 3] {
        [
            ("accel_demand_rad_s2", self.accel_demand),
            ("friction_torque_demand_nm", self.friction_torque),
            ("mu_model", self.mu),
        ]
    }
}

impl<T: Real> Ctc<T> {
    /// Checks gains, the plant that the law believes in, and output stage.
    ///
    /// # Errors
    /// A gain negative or not finite; a bad model (also one with `mu_static` or `mu_dynamic`
    /// 0, by which (11) divides); a bad output stage or period.
    pub fn new(
        p: &CtcParams<T>,
        model: &PlantParams<T>,
        output: &OutputParams<T>,
        period: Micros,
    ) -> Result<Self, ParamError<T>> {
        require("outer_gain", p.outer_gain, p.outer_gain >= T::ZERO, "a finite number of at least 0")?;
        require("kp", p.kp, p.kp >= T::ZERO, "a finite number of at least 0 1/s²")?;
        require("kd", p.kd, p.kd >= T::ZERO, "a finite number of at least 0 1/s")?;
        let f = &model.friction;
        require("mu_static", f.mu_static, f.mu_static > T::ZERO, "a number above 0: the law divides by it")?;
        require(
            "mu_dynamic",
            f.mu_dynamic,
            f.mu_dynamic > T::ZERO,
            "a number above 0: the law divides by it",
        )?;
        Ok(Ctc { params: *p, model: Plant::new(model)?, output: Output::new(output, period)? })
    }

    /// The gains.
    #[must_use]
    pub fn params(&self) -> &CtcParams<T> {
        &self.params
    }

    /// The believed plant. It differs from the true one wherever friction is not known.
    #[must_use]
    pub fn model(&self) -> &Plant<T> {
        &self.model
    }

    /// The output stage.
    #[must_use]
    pub fn output(&self) -> &Output<T> {
        &self.output
    }

    #[inline]
    fn terms(&self, tick: &Tick<T>, mu: T) -> (T, CtcTerms<T>) {
        let (p, m) = (&self.params, self.model.params());
        let accel_demand = -(p.outer_gain * (p.kp * tick.error + p.kd * tick.error_rate));
        let friction_torque = m.drive_torque
            - m.inertia * (tick.target_acceleration - accel_demand)
            - m.viscous_damping * tick.velocity();
        (friction_torque / (mu * m.brake_gain), CtcTerms { accel_demand, friction_torque, mu })
    }

    #[inline]
    fn command(&self, state: &mut OutputState<T>, tick: &Tick<T>, mu: T) -> Command<T, CtcTerms<T>> {
        let (demand, terms) = self.terms(tick, mu);
        let (voltage, limit) = self.output.apply(state, demand);
        Command { voltage, limit, terms }
    }

    /// Apart: a call of the power among what a tick computes makes the others slower, too.
    #[cold]
    #[inline(never)]
    fn command_for_any_exponent(
        &self,
        state: &mut OutputState<T>,
        tick: &Tick<T>,
    ) -> Command<T, CtcTerms<T>> {
        self.command(state, tick, self.model.friction().magnitude(tick.velocity()))
    }
}

impl<T: Real> Controller<T> for Ctc<T> {
    type State = OutputState<T>;
    type Terms = CtcTerms<T>;

    fn start(&self, tick: &Tick<T>, applied: T) -> Self::State {
        self.output.start(self.terms(tick, self.model.friction().magnitude(tick.velocity())).0, applied)
    }

    // Always: as a function of its own it would keep the registers of the call below for each tick.
    #[inline(always)]
    fn update(&self, state: &mut Self::State, tick: &Tick<T>) -> Command<T, Self::Terms> {
        match self.model.friction().magnitude_without_power(tick.velocity()) {
            Some(mu) => self.command(state, tick, mu),
            None => self.command_for_any_exponent(state, tick),
        }
    }
}
