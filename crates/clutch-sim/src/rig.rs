//! Rigs: the shaft with its brake, its sensor and its converter.

use crate::drive::{Drive, DriveParams};
use crate::engine::{ExactFlow, Model};
use crate::ripple::{Ripple, RippleParams, RunoutParams};
use clutch_core::friction::{FrictionModel, FrictionParams};
use clutch_core::law::OutputParams;
use clutch_core::params::{Params, Range};
use clutch_core::{
    ActuatorKind, ActuatorParams, Dac, DacParams, Encoder, EncoderParams, ParamError, Plant, PlantParams,
    SpeedLimit, params,
};
use std::fmt;

clutch_core::words! {
    /// Rig that a scenario's own is laid over.
    pub enum RigBase {
        /// The paper's shaft with a perfect sensor and a perfect converter.
        Ideal = "ideal",
        /// The paper's simulation: Table 1, an encoder that floors, a 12-bit converter over ±10 V.
        Paper = "paper" default,
        /// A stand-in for the paper's experiment: friction other than the laws believe, uneven along the disc, and
        /// a tick of delay. Found by `cargo xtask calibrate`; docs/bench-rig.md.
        Bench = "bench",
    }
}

params! {
    /// The angle sensor: `counts = ⌊θ N/2π⌋`.
    #[derive(Copy)]
    pub struct RigEncoder<f64>: Default {
        /// `true` if it gives whole counts, rounded down; else it resolves 2⁻¹⁶ counts.
        quantised: bool = true, "quantised" "" NONE, Range::ANY;
    }
    flat {
        /// Its resolution.
        sensor: EncoderParams;
    }
}

params! {
    /// The converter from codes to volts; the paper's has 12 bit over ±10 V, 4.88 mV a step.
    #[derive(Copy)]
    pub struct RigDac<f64>: Default {
        /// `true` if it rounds to its steps; else the law's voltage goes out as it is.
        quantised: bool = true, "quantised" "" NONE, Range::ANY;
    }
    flat {
        /// Its bits and its range.
        converter: DacParams;
    }
}

params! {
    /// The shaft as it is, with its drive, brake, encoder and converter. The defaults are the paper's.
    ///
    /// `J θ̈ = T_u + T(v_a) − μ(θ̇) N(v_a) − C_d θ̇`, which is (1) with the paper's brake, `T = 0` and
    /// `N = K_COF max(v_a, 0)`. The plant that law and certificate believe in is another thing: the model.
    pub struct RigParams<f64> {
        /// Rig whose values stand where the scenario has none.
        base: RigBase, "base" "" NONE, Range::ANY;
        /// Total moment of inertia, in (1).
        inertia: f64 = 0.0017, "inertia_kg_m2" "J" KG_M2, Range::divisor();
        /// Viscous damping, in (1).
        viscous_damping: f64 = 0.001, "viscous_damping_nm_s_rad" "C_d" NM_S_RAD, Range::at_least(0.0);
        /// Root mean square of a random torque, normally distributed, held from sample to sample.
        torque_noise: f64 = 0.0, "torque_noise_nm" "" NM, Range::at_least(0.0);
        /// Whole sampling periods from sample to voltage.
        delay_ticks: u32 = 0, "delay_ticks" "" TICKS, Range::within(0.0, 1000.0);
        /// First-order lag from the voltage to the actuator; absent if there is none. It needs the engine
        /// `dormand_prince`.
        actuator_time_constant: Option<f64>, "actuator_time_constant_s" "" S, Range::above(0.0);
    }
    nested {
        /// Effect of a voltage on the shaft.
        actuator: ActuatorParams, "actuator";
        /// Friction of pad on disc.
        friction: FrictionParams, "friction";
        /// The drive of the shaft.
        drive: DriveParams, "drive";
        /// The angle sensor.
        encoder: RigEncoder, "encoder";
        /// The converter.
        dac: RigDac, "dac";
    }
    optional {
        /// Friction along the disc; absent if it is even.
        ripple: RippleParams, "ripple";
        /// Friction in waves along the disc, beside a ripple; absent if it has none.
        runout: RunoutParams, "runout";
    }
    flat {
        /// Highest speed that a path may ask for.
        speed: SpeedLimit;
    }
}

/// Rigs as they differ from the defaults of their rows.
const BASES: [(RigBase, &str); 3] = [
    (RigBase::Ideal, include_str!("../rigs/ideal.toml")),
    (RigBase::Paper, include_str!("../rigs/paper.toml")),
    (RigBase::Bench, include_str!("../rigs/bench.toml")),
];

impl RigParams {
    /// The rig that a base names.
    #[must_use]
    pub fn named(base: RigBase) -> Self {
        let table = RigParams::base_table(base);
        crate::tables::read_known("rig", &table)
    }

    /// The table of a base, as a scenario would say it: the keys in which it differs from the paper's rig.
    pub(crate) fn base_table(base: RigBase) -> toml::Table {
        let text = BASES.iter().find(|(b, _)| *b == base).map_or("", |(_, text)| text);
        let mut table: toml::Table = text.parse().unwrap_or_default();
        table.insert("base".into(), base.name().into());
        table
    }

    /// The paper's simulation.
    #[must_use]
    pub fn paper() -> Self {
        RigParams::named(RigBase::Paper)
    }

    /// The paper's shaft with a perfect sensor and a perfect converter.
    #[must_use]
    pub fn ideal() -> Self {
        RigParams::named(RigBase::Ideal)
    }

    /// The stand-in for the paper's experiment.
    #[must_use]
    pub fn bench() -> Self {
        RigParams::named(RigBase::Bench)
    }
}

impl Default for RigParams {
    /// The paper's.
    fn default() -> Self {
        RigParams::paper()
    }
}

/// The viscous damping that bristles lack to take energy out of every motion: [`Rig::not_passive`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NotPassive {
    /// N m s/rad.
    pub lacks: f64,
    /// The voltage that presses hardest, V; none if all press alike.
    pub at: Option<f64>,
}

impl fmt::Display for NotPassive {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(volts) = self.at {
            write!(f, "at {volts} V ")?;
        }
        write!(
            f,
            "the bristles of the friction can give energy: they are passive with {} N m s/rad more of \
             rig.viscous_damping_nm_s_rad, or with a lower damping_s_rad",
            crate::number(self.lacks)
        )
    }
}

/// A checked rig.
#[derive(Clone, Debug)]
pub struct Rig {
    /// The plant that engines integrate; its driving torque is the one at the start.
    pub model: Model,
    /// The drive of the shaft.
    pub drive: Drive,
    /// The encoder.
    pub encoder: Encoder,
    /// The converter.
    pub dac: Dac<f64>,
    /// The parameters it was built from.
    pub params: RigParams,
}

impl Rig {
    /// The reason that the exact flow cannot move it; `None` if it can.
    pub(crate) fn refuses_exact_flow(&self) -> Option<&'static str> {
        let lags = self.params.actuator_time_constant.is_some();
        ExactFlow::refuses(&self.model, self.drive.is_constant(), lags)
    }

    /// Checks the parameters; `seed` decides ripple phases and a hand's motion.
    ///
    /// # Errors
    /// The first parameter out of range, by name.
    pub fn new(p: &RigParams, seed: u64) -> Result<Rig, ParamError> {
        p.check()?;
        let drive = Drive::new(&p.drive, seed)?;
        let plant = Plant::new(&PlantParams {
            inertia: p.inertia,
            drive_torque: drive.torque(0.0, 0.0),
            viscous_damping: p.viscous_damping + drive.damping(),
            actuator: p.actuator,
            friction: p.friction,
        })?;
        let ripple = Ripple::new(p.ripple.as_ref(), p.runout.as_ref(), seed)?;
        Ok(Rig {
            model: Model { plant, ripple },
            drive,
            encoder: Encoder::new(p.encoder.sensor.counts_per_rev)?,
            dac: Dac::new(&p.dac.converter)?,
            params: p.clone(),
        })
    }

    /// `θ̈` of (1) at a time (s), a position from the encoder's zero at the start (rad), a velocity
    /// (rad/s) and a voltage at the pad, rad/s²; 0 at rest as long as friction holds. Torque noise,
    /// delay and lag, which are not the shaft's, are left out.
    #[must_use]
    pub fn acceleration(&self, time: f64, position: f64, velocity: f64, volts: f64) -> f64 {
        let p = self.model.plant.params();
        let factor = self.model.friction_factor(position);
        let torque = self.drive.torque(time, position) + self.model.plant.actuator().torque(volts);
        let friction = if velocity == 0.0 {
            let holds = self.model.break_away_torque(position, volts);
            torque.max(-holds).min(holds)
        } else {
            factor * self.model.plant.friction_torque(velocity, volts)
        };
        (torque - friction - p.viscous_damping * velocity) / p.inertia
    }

    /// Voltage that holds the resting shaft wherever it is on the disc, V: with a brake a quarter more than the
    /// static limit, with a motor the voltage that balances the driving torque of the start; within the converter's range.
    #[must_use]
    pub fn resting_voltage(&self) -> f64 {
        let plant = &self.model.plant;
        let actuator = plant.actuator();
        let volts = match actuator.kind() {
            ActuatorKind::Motor => plant.holding_voltage_static(),
            ActuatorKind::Brake | ActuatorKind::Both => {
                let swing = self.model.ripple.as_ref().map_or(0.0, Ripple::largest);
                let (gain, torque) = (actuator.brake_gain(), plant.params().drive_torque.abs());
                let held = torque / (plant.friction().at_rest() * gain);
                (1.25 * held / (1.0 - swing) - actuator.preload() / gain).max(0.0)
            }
        };
        self.reached(volts)
    }

    /// Voltage that holds the sliding shaft at a velocity, V: actuator, friction and viscous drag carry
    /// the driving torque of the start.
    #[must_use]
    pub fn sliding_voltage(&self, velocity: f64) -> f64 {
        let plant = &self.model.plant;
        let (p, actuator) = (plant.params(), plant.actuator());
        let mu = plant.friction().level(velocity);
        if velocity == 0.0 && actuator.kind() == ActuatorKind::Motor {
            return self.resting_voltage();
        }
        let way = if velocity < 0.0 { -1.0 } else { 1.0 };
        let volts = actuator.volts_for(p.viscous_damping * velocity - p.drive_torque, mu, way);
        self.reached(if actuator.kind().two_sided() { volts } else { volts.max(0.0) })
    }

    /// Bristles that can give energy at a voltage within the output's limits; none if they take it out of every motion.
    #[must_use]
    pub fn not_passive(&self, output: &OutputParams) -> Option<NotPassive> {
        let plant = &self.model.plant;
        let bristles = plant.friction().bristles()?;
        let [low, high] = [output.lowest, output.highest].map(|volts| plant.actuator().normal(volts));
        let (normal, volts) = if low > high { (low, output.lowest) } else { (high, output.highest) };
        let lacks = bristles.passive_from() * normal - plant.params().viscous_damping;
        // A motor presses by its torque, if at all.
        let at = (normal > plant.actuator().normal(0.0)).then_some(volts);
        (lacks > 0.0).then_some(NotPassive { lacks, at })
    }

    /// A voltage within the converter's range; 0 for none, as where there is no friction to divide by.
    fn reached(&self, volts: f64) -> f64 {
        let converter = &self.params.dac.converter;
        if volts.is_finite() { volts.max(converter.lowest).min(converter.highest) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_bad_parameter_is_named() {
        let rig = RigParams::paper;
        for (bad, field) in [
            (RigParams { torque_noise: -1.0, ..rig() }, "torque_noise"),
            (RigParams { delay_ticks: 1001, ..rig() }, "delay_ticks"),
            (RigParams { actuator_time_constant: Some(0.0), ..rig() }, "actuator_time_constant"),
            (RigParams { speed: SpeedLimit { speed_limit: f64::NAN }, ..rig() }, "speed_limit"),
            (
                RigParams {
                    encoder: RigEncoder { sensor: EncoderParams { counts_per_rev: 0 }, quantised: true },
                    ..rig()
                },
                "counts_per_rev",
            ),
        ] {
            assert_eq!(Rig::new(&bad, 1).unwrap_err().field(), field);
        }
    }
}
