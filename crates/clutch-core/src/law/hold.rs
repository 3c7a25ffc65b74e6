//! A voltage that holds the resting shaft, from the model alone.
//!
//! ```text
//! brake: u = m |T_u| / (μ_s K_COF), less what it holds without a voltage      motor: u = −T_u/k_t
//! ```

use super::{Beside, Command, ControlLaw, Listed, Output, OutputParams, OutputState, Tick};
use crate::friction::FrictionModel;
use crate::params::{Range, Table};
use crate::{ActuatorKind, Arithmetic, Each, Micros, ParamError, Plant, PlantParams, Real};

crate::params! {
    /// A voltage that holds the resting shaft, whatever the encoder says: with a brake a multiple of the lowest that does,
    /// with a motor the one that balances the drive.
    pub struct HoldParams<T>: Default {
        /// Multiple of the driving torque that a brake holds; 1 leaves nothing for the converter's rounding.
        margin: T = 1.25, "margin" "m" NONE, Range::at_least(1.0);
    }
}

/// The law, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold<T> {
    volts: T,
    output: Output<T>,
}

impl<T: Real> Hold<T> {
    /// Checks parameters, believed plant and output stage.
    ///
    /// # Errors
    /// The first parameter out of range; with a brake, a friction at rest that can be 0.
    pub fn new(
        p: &HoldParams<T>,
        model: &PlantParams<T>,
        output: &OutputParams<T>,
        period: Micros,
    ) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let model = Plant::new(model)?;
        let (actuator, friction) = (model.actuator(), model.friction());
        model.check_solvable()?;
        let volts = match actuator.kind() {
            ActuatorKind::Motor => model.holding_voltage_static(),
            ActuatorKind::Brake | ActuatorKind::Both => {
                let torque = -(p.margin * model.params().drive_torque.abs());
                actuator.volts_for(torque, friction.at_rest(), T::ONE).max(T::ZERO)
            }
        };
        Ok(Hold { volts, output: Output::new(output, period)? })
    }
}

impl<T: Arithmetic> Hold<T> {
    /// The laws of several lanes as one.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> Hold<L> {
        Hold {
            volts: each(&|law| law.volts),
            output: Output::in_lanes(&|get| each(&|law| get(&law.output))),
        }
    }
}

impl<T: Arithmetic> ControlLaw<T> for Hold<T> {
    type State = OutputState<T>;
    type Terms = [T; 1];
    const TERMS: &'static [&'static str] = &["holding_v"];

    fn start(&self, _: &Tick<T>, applied: T) -> Self::State {
        self.output.start(self.volts, applied)
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn update(&self, state: &mut Self::State, _: &Tick<T>) -> Command<T, [T; 1]> {
        let (voltage, limit) = self.output.apply(state, self.volts);
        Command { voltage, limit, terms: [self.volts] }
    }
}

impl<T: Real> Listed<T> for Hold<T> {
    type Params = HoldParams<T>;
    const TITLE: &'static str = "hold, open loop";
    const FOLLOWS: bool = false;

    fn build(p: &HoldParams<T>, beside: &Beside<'_, T>) -> Result<Self, ParamError<T>> {
        Hold::new(p, beside.model, beside.output, beside.period)
    }

    fn output(&self) -> &Output<T> {
        &self.output
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MotorActuator;

    fn volts(model: &PlantParams) -> f64 {
        let output = OutputParams { lowest: -10.0, ..OutputParams::default() };
        Hold::new(&HoldParams::default(), model, &output, Micros(1000)).unwrap().volts
    }

    #[test]
    fn a_brake_holds_a_quarter_more_than_it_has_to_and_a_motor_what_it_has_to() {
        let brake = PlantParams::<f64>::default();
        assert!((volts(&brake) - 1.25 * 1.681714).abs() < 1e-6);
        let motor = MotorActuator { gain: 0.05, preload: 0.3, load_share: 0.0 };
        let motor = PlantParams { actuator: motor.into(), ..brake };
        assert!((volts(&motor) + 0.047088 / 0.05).abs() < 1e-12);
    }
}
