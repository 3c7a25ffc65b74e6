//! The effect of a voltage on shafts in lanes.

use crate::engine::exact_flow::Pushed;
use crate::lane::Lane;
use clutch_core::friction::FrictionModel;
use clutch_core::{ActuatorKind, Plant};

/// Actuators of the shafts in the lanes of one vector, with what their voltages are multiplied by.
pub(super) enum Push<V: Lane> {
    /// Brakes, which make no torque: the bits are those of any actuator.
    Brake { gain: V, preload: V, holds: V, preload_holds: V },
    /// Any others.
    Other,
}

impl<V: Lane> Push<V> {
    pub(super) fn of(plant: &Plant<V>) -> Self {
        let (actuator, at_rest) = (plant.actuator(), plant.friction().at_rest());
        if !matches!(actuator.kind(), ActuatorKind::Brake) {
            return Push::Other;
        }
        let (gain, preload) = (actuator.brake_gain(), actuator.preload());
        Push::Brake { gain, preload, holds: at_rest * gain, preload_holds: at_rest * preload }
    }

    /// Torque and friction under voltages that are numbers, V, and under torques of drives, N m.
    #[inline(always)]
    pub(super) fn at(&self, volts: V, drive: V, plant: &Plant<V>) -> Pushed<V> {
        match self {
            Push::Brake { gain, preload, holds, preload_holds } => {
                let volts = V::select(V::ZERO.less(volts), volts, V::ZERO);
                Pushed {
                    torque: drive,
                    normal: *gain * volts + *preload,
                    holds: *holds * volts + *preload_holds,
                }
            }
            Push::Other => {
                let actuator = plant.actuator();
                Pushed {
                    torque: drive + actuator.torque(volts),
                    normal: actuator.normal(volts),
                    holds: plant.break_away_torque(volts),
                }
            }
        }
    }
}
