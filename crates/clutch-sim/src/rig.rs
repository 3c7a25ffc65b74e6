//! Rigs: the shaft with its brake, its sensor and its converter.

use crate::drive::{Drive, DriveParams};
use crate::engine::Model;
use crate::ripple::{Ripple, RippleParams};
use clutch_core::friction::{FrictionModel, FrictionParams};
use clutch_core::params::{Params, Range};
use clutch_core::{
    BrakeGeometry, Dac, DacParams, Encoder, EncoderParams, ParamError, Plant, PlantParams, SpeedLimit, params,
};

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
    /// `J θ̈ = T_u − μ(θ̇) K_COF max(v_a, 0) − C_d θ̇` (1). The plant that law and certificate believe in is another
    /// thing: the model.
    pub struct RigParams<f64> {
        /// Rig whose values stand where the scenario has none.
        base: RigBase, "base" "" NONE, Range::ANY;
        /// Total moment of inertia, in (1).
        inertia: f64 = 0.0017, "inertia_kg_m2" "J" KG_M2, Range::divisor();
        /// Viscous damping, in (1).
        viscous_damping: f64 = 0.001, "viscous_damping_nm_s_rad" "C_d" NM_S_RAD, Range::at_least(0.0);
        /// Brake torque per volt and unit of μ, (18), 0.14 in each base: a number, or what the geometry of the brake gives.
        brake_gain: Option<f64>, "brake_gain_nm_v" "K_COF" NM_V, Range::above(0.0);
        /// Root mean square of a random torque, normally distributed, held from sample to sample.
        torque_noise: f64 = 0.0, "torque_noise_nm" "" NM, Range::at_least(0.0);
        /// Whole sampling periods from sample to voltage.
        delay_ticks: u32 = 0, "delay_ticks" "" TICKS, Range::within(0.0, 1000.0);
        /// First-order lag from voltage to normal force; absent if there is none. It needs the engine
        /// `dormand_prince`.
        actuator_time_constant: Option<f64>, "actuator_time_constant_s" "" S, Range::above(0.0);
    }
    nested {
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
        /// Geometry of the brake, in the place of `brake_gain_nm_v`.
        brake_geometry: BrakeGeometry, "brake_geometry";
        /// Friction along the disc; absent if it is even.
        ripple: RippleParams, "ripple";
    }
    flat {
        /// Highest speed that a path may ask for.
        speed: SpeedLimit;
    }
    relations(p) {
        /// The gain is given once.
        ONE_GAIN: brake_gain, "either brake_gain_nm_v or a table brake_geometry, not both" =>
            p.brake_gain.is_some() != p.brake_geometry.is_some();
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

    /// `K_COF`, given or by the geometry, N m/V.
    ///
    /// # Errors
    /// A geometry that gives none; both or none given.
    pub fn gain(&self) -> Result<f64, ParamError> {
        match (&self.brake_geometry, self.brake_gain) {
            (Some(geometry), None) => geometry.brake_gain(),
            (None, Some(gain)) => Ok(gain),
            (_, gain) => Err(RigParams::ONE_GAIN.error(gain.unwrap_or(f64::NAN))),
        }
    }
}

impl Default for RigParams {
    /// The paper's.
    fn default() -> Self {
        RigParams::paper()
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
            viscous_damping: p.viscous_damping,
            brake_gain: p.gain()?,
            friction: p.friction,
        })?;
        let ripple = p.ripple.as_ref().map(|r| Ripple::new(r, seed)).transpose()?;
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
        let torque = self.drive.torque(time, position);
        let friction = if velocity == 0.0 {
            let holds = self.model.break_away_torque(position, volts);
            torque.max(-holds).min(holds)
        } else {
            factor * self.model.plant.brake_torque(velocity, volts)
        };
        (torque - friction - p.viscous_damping * velocity) / p.inertia
    }

    /// Voltage that holds the resting shaft wherever it is on the disc, V: a quarter more than the
    /// static limit, within the converter's range.
    #[must_use]
    pub fn resting_voltage(&self) -> f64 {
        let swing = self.model.ripple.as_ref().map_or(0.0, Ripple::largest);
        let volts = 1.25 * self.model.plant.holding_voltage_static() / (1.0 - swing);
        if volts.is_finite() { volts.min(self.params.dac.converter.highest) } else { 0.0 }
    }

    /// Voltage that holds the sliding shaft at a velocity, V: friction and viscous drag carry
    /// the driving torque of the start.
    #[must_use]
    pub fn sliding_voltage(&self, velocity: f64) -> f64 {
        let p = self.model.plant.params();
        let mu = self.model.plant.friction().level(velocity);
        let volts = (p.drive_torque - p.viscous_damping * velocity) / (mu * p.brake_gain);
        // Without friction there is no such voltage.
        if volts.is_finite() { volts.max(0.0).min(self.params.dac.converter.highest) } else { 0.0 }
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
