//! Computed-torque control: the plant (1) solved for the voltage.
//!
//! ```text
//! τ = −K (K_p e + K_d ė)                                          (10)
//! u = [T_u − J (θ̈_d − τ) − C_d θ̇] / (μ(θ̇) K_COF)                  (9), (11)
//! ```
//!
//! `θ̇` is the measured velocity, `θ̇_d − ė`, and `μ` is taken without its sign: a shaft at
//! rest is about to move, so `μ = μ_s` there.

use super::{Asked, Beside, Command, ControlLaw, Listed, Output, OutputParams, OutputState, Surface, Tick};
use crate::friction::FrictionModel;
use crate::params::{Range, Table};
use crate::{Arithmetic, Each, Micros, ParamError, Plant, PlantParams, Real};

crate::params! {
    /// Computed-torque control (11): the plant that `Model` describes, solved for the voltage. The gains'
    /// defaults are Table 2's.
    ///
    /// `τ = −K (K_p e + K_d ė)`, `u = [T_u − J (θ̈_d − τ) − C_d θ̇]/(μ(θ̇) K_COF)`.
    pub struct CtcParams<T>: Default {
        /// Outer gain of (10).
        outer_gain: T = 90.0, "outer_gain" "K" NONE, Range::at_least(0.0);
        /// Proportional gain of (10).
        kp: T = 100.0, "kp_1_s2" "K_p" PER_S2, Range::at_least(0.0);
        /// Derivative gain of (10).
        kd: T = 0.7, "kd_1_s" "K_d" PER_S, Range::at_least(0.0);
    }
}

/// The law (11), checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ctc<T> {
    params: CtcParams<T>,
    model: Plant<T>,
    output: Output<T>,
}

impl<T: Real> Ctc<T> {
    /// Checks gains, the plant that the law believes in, and output stage.
    ///
    /// # Errors
    /// The first parameter out of range; a friction that can be 0, by which (11) divides.
    pub fn new(
        p: &CtcParams<T>,
        model: &PlantParams<T>,
        output: &OutputParams<T>,
        period: Micros,
    ) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let model = Plant::new(model)?;
        model.friction().check_divisor()?;
        Ok(Ctc { params: *p, model, output: Output::new(output, period)? })
    }

    /// The believed plant. It differs from the true one wherever friction is not known.
    #[must_use]
    pub fn model(&self) -> &Plant<T> {
        &self.model
    }
}

impl<T: Arithmetic> Ctc<T> {
    /// The laws of several lanes as one; none if the frictions that they believe in are not of one model.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> Option<Ctc<L>> {
        let params = CtcParams {
            outer_gain: each(&|law| law.params.outer_gain),
            kp: each(&|law| law.params.kp),
            kd: each(&|law| law.params.kd),
        };
        let output = Output::in_lanes(&|get| each(&|law| get(&law.output)));
        let model = Plant::in_lanes(&|get| each(&|law| get(&law.model)))?;
        Some(Ctc { params, model, output })
    }

    #[inline]
    fn terms(&self, tick: &Tick<T>, mu: T) -> (T, [T; 3]) {
        let (p, m) = (&self.params, self.model.params());
        let accel_demand = -(p.outer_gain * (p.kp * tick.error + p.kd * tick.error_rate));
        let friction_torque = m.drive_torque
            - m.inertia * (tick.target_acceleration - accel_demand)
            - m.viscous_damping * tick.velocity();
        (friction_torque / (mu * m.brake_gain), [accel_demand, friction_torque, mu])
    }

    #[inline]
    fn command(&self, state: &mut OutputState<T>, tick: &Tick<T>, mu: T) -> Command<T, [T; 3]> {
        let (demand, terms) = self.terms(tick, mu);
        let (voltage, limit) = self.output.apply(state, demand);
        Command { voltage, limit, terms }
    }

    /// Apart: a call of the power among what a tick computes makes the others slower, too.
    #[cold]
    #[inline(never)]
    fn command_for_any_friction(&self, state: &mut OutputState<T>, tick: &Tick<T>) -> Command<T, [T; 3]> {
        self.command(state, tick, self.model.friction().level(tick.velocity()))
    }
}

impl<T: Arithmetic> ControlLaw<T> for Ctc<T> {
    type State = OutputState<T>;
    type Terms = [T; 3];
    const TERMS: &'static [&'static str] = &["accel_demand_rad_s2", "friction_torque_demand_nm", "mu_model"];

    fn start(&self, tick: &Tick<T>, applied: T) -> Self::State {
        self.output.start(self.terms(tick, self.model.friction().level(tick.velocity())).0, applied)
    }

    // Always: as a function of its own it would keep the registers of the call below for each tick.
    #[inline(always)]
    fn update(&self, state: &mut Self::State, tick: &Tick<T>) -> Command<T, Self::Terms> {
        match self.model.friction().quick_level(tick.velocity()) {
            Some(mu) => self.command(state, tick, mu),
            None => self.command_for_any_friction(state, tick),
        }
    }
}

impl<T: Real> Listed<T> for Ctc<T> {
    type Params = CtcParams<T>;
    const TITLE: &'static str = "CTC (11)";

    fn build(p: &CtcParams<T>, beside: &Beside<'_, T>) -> Result<Self, ParamError<T>> {
        Ctc::new(p, beside.model, beside.output, beside.period)
    }

    fn output(&self) -> &Output<T> {
        &self.output
    }

    fn surface(&self, asked: &Asked<'_, T>) -> Option<Surface<T>> {
        let (p, m) = (&self.params, self.model.params());
        // (11) is u = [T − J θ̈_d − C θ̇ − J K K_d σ] / (μ K_COF) with the model's values.
        let gain = m.inertia * p.outer_gain * p.kd;
        (gain > T::ZERO && p.kp > T::ZERO).then(|| {
            let mu = self.model.friction().envelope().high;
            let highest = self.output.highest();
            let inertia = m.inertia * asked.acceleration;
            let slope = p.kp / p.kd;
            let drag = m.viscous_damping * (asked.velocity + (asked.fastest)(slope));
            let upper = highest * mu * m.brake_gain - m.drive_torque + inertia + drag;
            let lower = m.drive_torque + inertia;
            Surface::affine(slope, upper.max(lower) / gain, highest)
        })
    }
}
