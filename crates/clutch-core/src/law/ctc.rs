//! Computed-torque control: the plant (1) solved for the voltage.
//!
//! ```text
//! τ = −K (K_p e + K_d ė)                                          (10)
//! u = [T_u − J (θ̈_d − τ) − C_d θ̇] / (μ(θ̇) K_COF)                  (9), (11)
//! ```
//!
//! `θ̇` is the measured velocity, `θ̇_d − ė`, and `μ` is taken without its sign: a shaft at
//! rest is about to move, so `μ = μ_s` there. A brake that drags drags in (11), too. With a motor the torque
//! `J (θ̈_d − τ) + C_d θ̇ − T_u`, and the friction of a shaft that goes the path's way, are what the motor gives.

use super::{Asked, Beside, Command, ControlLaw, Damping, Listed, Output, OutputParams, OutputState, Surface, Tick};
use crate::friction::{FrictionModel, Stribeck, StribeckParams};
use crate::params::{Range, Table};
use crate::{ActuatorKind, Arithmetic, Each, Micros, ParamError, Plant, PlantParams, Real};

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
    /// (11) as it is printed will do: a brake that does not drag.
    printed: bool,
    /// `printed`, and the friction is the curve below; `quick` if that is computed without a power.
    curved: bool,
    quick: bool,
    curve: Stribeck<T>,
    output: Output<T>,
}

impl<T: Real> Ctc<T> {
    /// Checks gains, the plant that the law believes in, and output stage.
    ///
    /// # Errors
    /// The first parameter out of range; with a brake, a friction that can be 0, by which (11) divides.
    pub fn new(
        p: &CtcParams<T>,
        model: &PlantParams<T>,
        output: &OutputParams<T>,
        period: Micros,
    ) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let model = Plant::new(model)?;
        model.check_solvable()?;
        let printed = model.actuator().kind() == ActuatorKind::Brake && model.actuator().preload() == T::ZERO;
        let curve = model.friction().curve();
        let curved = printed && curve.is_some();
        let quick = curved && curve.is_some_and(|curve| curve.is_quick());
        let curve = match curve {
            Some(curve) => curve,
            // Not asked.
            None => Stribeck::new(&StribeckParams::default())?,
        };
        Ok(Ctc { params: *p, model, printed, curved, quick, curve, output: Output::new(output, period)? })
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
        let all = |is: fn(&Self) -> bool| {
            L::all(L::ONE.less_or_equal(each(&|law| if is(law) { T::ONE } else { T::ZERO })))
        };
        let [printed, curved, quick] = [all(|law| law.printed), all(|law| law.curved), all(|law| law.quick)];
        let curve = Stribeck::in_lanes(&|get| each(&|law| get(&law.curve)));
        Some(Ctc { params, model, printed, curved, quick, curve, output })
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn terms(&self, tick: &Tick<T>, mu: T) -> (T, [T; 3]) {
        let (friction_torque, terms) = self.demand(tick, mu);
        (friction_torque / (mu * self.model.actuator().brake_gain()), terms)
    }

    /// As [`Ctc::terms`], with any friction and actuator.
    fn terms_for_any(&self, tick: &Tick<T>) -> (T, [T; 3]) {
        let mu = self.model.friction().level(tick.velocity());
        if self.printed { self.terms(tick, mu) } else { self.terms_for_any_actuator(tick, mu) }
    }

    /// Apart: what is printed does not pay for it.
    #[cold]
    #[inline(never)]
    fn terms_for_any_actuator(&self, tick: &Tick<T>, mu: T) -> (T, [T; 3]) {
        let (friction_torque, terms) = self.demand(tick, mu);
        let actuator = self.model.actuator();
        (actuator.volts_for(-friction_torque, mu, actuator.way(tick.target_velocity)), terms)
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn demand(&self, tick: &Tick<T>, mu: T) -> (T, [T; 3]) {
        let (p, m) = (&self.params, self.model.params());
        let accel_demand = -(p.outer_gain * (p.kp * tick.error + p.kd * tick.error_rate));
        let friction_torque = m.drive_torque
            - m.inertia * (tick.target_acceleration - accel_demand)
            - m.viscous_damping * tick.velocity();
        (friction_torque, [accel_demand, friction_torque, mu])
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn command(&self, state: &mut OutputState<T>, (demand, terms): (T, [T; 3])) -> Command<T, [T; 3]> {
        let (voltage, limit) = self.output.apply(state, demand);
        Command { voltage, limit, terms }
    }

    /// Apart: a call of the power among what a tick computes makes the others slower, too.
    #[cold]
    #[inline(never)]
    fn command_by_power(&self, state: &mut OutputState<T>, tick: &Tick<T>) -> Command<T, [T; 3]> {
        if !self.curved {
            return self.command_for_any(state, tick);
        }
        self.command(state, self.terms(tick, self.curve.level_by_power(tick.velocity())))
    }

    /// Apart: a curve does not pay for the choice of a friction.
    #[cold]
    #[inline(never)]
    fn command_for_any(&self, state: &mut OutputState<T>, tick: &Tick<T>) -> Command<T, [T; 3]> {
        self.command(state, self.terms_for_any(tick))
    }
}

impl<T: Arithmetic> ControlLaw<T> for Ctc<T> {
    type State = OutputState<T>;
    type Terms = [T; 3];
    const TERMS: &'static [&'static str] = &["accel_demand_rad_s2", "friction_torque_demand_nm", "mu_model"];

    fn start(&self, tick: &Tick<T>, applied: T) -> Self::State {
        self.output.start(self.terms_for_any(tick).0, applied)
    }

    // Always: as a function of its own it would keep the registers of the call below for each tick.
    #[inline(always)]
    fn update(&self, state: &mut Self::State, tick: &Tick<T>) -> Command<T, Self::Terms> {
        if self.quick {
            let mu = self.curve.quick_level(tick.velocity());
            return self.command(state, self.terms(tick, mu));
        }
        self.command_by_power(state, tick)
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

    fn damping(p: &CtcParams<T>) -> Option<Damping<T>> {
        Some(Damping::Acceleration(p.outer_gain * p.kd))
    }

    fn surface(&self, asked: &Asked<'_, T>) -> Option<Surface<T>> {
        let (p, m) = (&self.params, self.model.params());
        // (11) is u = [T − J θ̈_d − C θ̇ − J K K_d σ] / (μ K_COF) with the model's values.
        let gain = m.inertia * p.outer_gain * p.kd;
        (gain > T::ZERO && p.kp > T::ZERO).then(|| {
            let mu = self.model.friction().envelope().high;
            let (lowest, highest) = self.output.limits();
            let actuator = self.model.actuator();
            let inertia = m.inertia * asked.acceleration;
            let slope = p.kp / p.kd;
            let drag = m.viscous_damping * (asked.velocity + (asked.fastest)(slope));
            let (torque, friction) = (m.drive_torque, mu * actuator.preload());
            let per_volt = actuator.motor_gain();
            // Torques at which the voltage reaches its ends.
            let (upper, lower) = match actuator.kind() {
                ActuatorKind::Motor => {
                    let farther = highest.max(-lowest) * per_volt * (T::ONE + mu * actuator.load_share());
                    (farther + torque.abs() + friction + inertia + drag, T::ZERO)
                }
                ActuatorKind::Brake | ActuatorKind::Both => {
                    let braked = highest * mu * actuator.brake_gain() + friction;
                    let driven = (-lowest).max(T::ZERO) * per_volt;
                    (braked - torque + inertia + drag, torque + driven + inertia)
                }
            };
            Surface { layer: upper.max(lower) / gain, ..Surface::affine(slope, (lowest, highest), T::ONE) }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ActuatorParams, CoulombParams, FrictionParams};

    #[test]
    fn a_friction_without_a_curve_is_inverted_by_its_level() {
        let friction =
            FrictionParams::from(CoulombParams { mu_static: 0.3, mu_dynamic: 0.25 });
        let model = PlantParams { friction, actuator: ActuatorParams::brake(0.2), ..PlantParams::default() };
        let law =
            Ctc::new(&CtcParams::default(), &model, &OutputParams::default(), Micros(1000)).unwrap();
        // Coulomb's level is one of sliding, at rest, too.
        for (rate, mu) in [(0.5, 0.25), (0.0, 0.25)] {
            let tick = Tick { target_velocity: rate, ..Tick::default() };
            let command = law.update(&mut law.start(&tick, 0.0), &tick);
            // (11) without an error: drive less damping, over friction and gain.
            let volts = (model.drive_torque - model.viscous_damping * rate) / (mu * 0.2);
            assert!((command.terms[2] - mu).abs() < 1e-15, "{:?}", command.terms);
            assert!((command.voltage - volts).abs() < 1e-12, "{} V, {volts} V", command.voltage);
        }
    }
}
