//! Rigs: the shaft with its brake, its sensor and its converter.

use crate::drive::{Drive, DriveParams};
use crate::engine::Model;
use clutch_core::{Dac, DacParams, Encoder, GRAVITY, ParamError, Plant, PlantParams, StribeckParams};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Friction that varies along the disc: a band of waves with equal amplitudes and random phases.
///
/// A disc is closed, so each wave fits a whole number of times into a turn.
#[derive(Clone, Debug, PartialEq)]
pub struct RippleParams {
    /// Root mean square of the variation, as a share of the friction.
    pub rms: f64,
    /// Waves per turn of the longest wave; a multiple of the spacing.
    pub lowest: u32,
    /// Waves per turn of the shortest wave; a multiple of the spacing.
    pub highest: u32,
    /// Waves per turn from one wave to the next: the pattern repeats that often in a turn.
    pub spacing: u32,
}

/// The factor `1 + amplitude Σ_n sin(n θ + φ_n)` on friction, `n = lowest … highest`.
#[derive(Clone, Debug, PartialEq)]
pub struct Ripple {
    amplitude: f64,
    spacing: f64,
    /// Multiples of the spacing before the first wave.
    skipped: u32,
    /// Sine and cosine of each wave's phase.
    phases: Vec<(f64, f64)>,
}

impl Ripple {
    /// Checks the parameters; `seed` decides the phases.
    ///
    /// # Errors
    /// `spacing` 0; `lowest` or `highest` no multiple of it, out of order, or more than 64 waves;
    /// an `rms` with which friction could reach 0.
    pub fn new(p: &RippleParams, seed: u64) -> Result<Ripple, ParamError> {
        let bad = |field, value, expected| Err(ParamError { field, value, expected });
        if p.spacing == 0 {
            return bad("spacing_waves_per_turn", 0.0, "at least 1 wave per turn");
        }
        if p.lowest == 0 || !p.lowest.is_multiple_of(p.spacing) {
            return bad(
                "lowest_waves_per_turn",
                f64::from(p.lowest),
                "a multiple of the spacing, above 0 waves per turn",
            );
        }
        if p.highest < p.lowest
            || !p.highest.is_multiple_of(p.spacing)
            || (p.highest - p.lowest) / p.spacing >= 64
            || p.highest / p.spacing > 1000
        {
            return bad(
                "highest_waves_per_turn",
                f64::from(p.highest),
                "a multiple of the spacing, not below the lowest, less than 64 spacings above it and at most 1000 spacings, waves per turn",
            );
        }
        let waves = (p.highest - p.lowest) / p.spacing + 1;
        let amplitude = p.rms * libm::sqrt(2.0 / f64::from(waves));
        if !(p.rms >= 0.0 && amplitude * f64::from(waves) < 1.0) {
            return bad("rms", p.rms, "at least 0 and, times the root of twice the number of waves, below 1");
        }
        let mut rng = Pcg64::seed_from_u64(seed ^ 0x7269_7070_6c65);
        let phases = (0..waves).map(|_| libm::sincos(core::f64::consts::TAU * rng.random::<f64>())).collect();
        Ok(Ripple { amplitude, spacing: f64::from(p.spacing), skipped: p.lowest / p.spacing - 1, phases })
    }

    /// The factor at a position.
    #[must_use]
    pub fn factor(&self, position: f64) -> f64 {
        // The sines of all multiples from one sine and cosine, by the addition theorem.
        let (s1, c1) = libm::sincos(self.spacing * position);
        let next = |(s, c): (f64, f64)| (s * c1 + c * s1, c * c1 - s * s1);
        let mut wave = (s1, c1);
        for _ in 0..self.skipped {
            wave = next(wave);
        }
        let mut sum = 0.0;
        for (sp, cp) in &self.phases {
            sum += wave.0 * cp + wave.1 * sp;
            wave = next(wave);
        }
        1.0 + self.amplitude * sum
    }

    /// Largest departure from 1 that the factor can have.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.amplitude * self.phases.len() as f64
    }
}

/// Parameters of a rig, SI and radians.
#[derive(Clone, Debug, PartialEq)]
pub struct RigParams {
    /// `J` in (1), kg m².
    pub inertia: f64,
    /// `C_d` in (1), N m s/rad.
    pub viscous_damping: f64,
    /// `K_COF` in (18), N m/V.
    pub brake_gain: f64,
    /// The friction law (2).
    pub friction: StribeckParams,
    /// Friction along the disc; none = even.
    pub ripple: Option<RippleParams>,
    /// What drives the shaft.
    pub drive: DriveParams,
    /// Torque noise, held from sample to sample: root mean square, N m.
    pub torque_noise: f64,
    /// Encoder: counts per revolution.
    pub counts_per_rev: u32,
    /// Whether the encoder floors to whole counts; an ideal sensor resolves 2⁻¹⁶ of them.
    pub encoder_quantised: bool,
    /// The converter.
    pub dac: DacParams,
    /// Whether the converter rounds to its steps.
    pub dac_quantised: bool,
    /// Whole sampling periods from sample to voltage.
    pub delay_ticks: u32,
    /// First-order lag from voltage to normal force, s; none = at once.
    pub actuator_time_constant: Option<f64>,
    /// Highest speed that a path may ask for, rad/s.
    pub speed_limit: f64,
}

impl RigParams {
    /// The paper's simulation: Table 1, an encoder of 20 000 counts per revolution that floors,
    /// a 12-bit converter over ±10 V.
    #[must_use]
    pub fn paper() -> Self {
        let plant = PlantParams::<f64>::default();
        RigParams {
            inertia: plant.inertia,
            viscous_damping: plant.viscous_damping,
            brake_gain: plant.brake_gain,
            friction: plant.friction,
            ripple: None,
            drive: DriveParams::Weight { mass: 0.2, gravity: GRAVITY, pulley_radius: 0.024 },
            torque_noise: 0.0,
            counts_per_rev: 20_000,
            encoder_quantised: true,
            dac: DacParams::default(),
            dac_quantised: true,
            delay_ticks: 0,
            actuator_time_constant: None,
            speed_limit: 360.0_f64.to_radians(),
        }
    }

    /// The paper's shaft with a perfect sensor and a perfect converter.
    #[must_use]
    pub fn ideal() -> Self {
        // A fine grid of counts, each divided by 2¹⁶: 6e-12 rad.
        RigParams {
            counts_per_rev: 1 << 24,
            encoder_quantised: false,
            dac_quantised: false,
            ..RigParams::paper()
        }
    }

    /// A stand-in for the paper's experiment: friction other than the laws believe, uneven along
    /// the disc, and a tick of delay. Found by `cargo xtask calibrate`; see docs/bench-rig.md.
    #[must_use]
    pub fn bench() -> Self {
        RigParams {
            friction: StribeckParams {
                mu_static: 0.203,
                mu_dynamic: 0.104,
                stribeck_velocity: 0.00144,
                stribeck_exponent: 1.0,
            },
            ripple: Some(RippleParams { rms: 0.15, lowest: 136, highest: 544, spacing: 34 }),
            drive: DriveParams::Weight { mass: 0.2 * 1.047, gravity: GRAVITY, pulley_radius: 0.024 },
            delay_ticks: 1,
            ..RigParams::paper()
        }
    }

    /// The rig of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "ideal" => Some(RigParams::ideal()),
            "paper" => Some(RigParams::paper()),
            "bench" => Some(RigParams::bench()),
            _ => None,
        }
    }

    /// Names of the built-in rigs.
    pub const NAMES: [&'static str; 3] = ["ideal", "paper", "bench"];
}

/// A checked rig.
#[derive(Clone, Debug)]
pub struct Rig {
    /// What engines integrate; its driving torque is the one at the start.
    pub model: Model,
    /// What drives the shaft.
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
        let bad = |field, value, expected| Err(ParamError { field, value, expected });
        let drive = Drive::new(&p.drive, seed)?;
        let plant = Plant::new(&PlantParams {
            inertia: p.inertia,
            drive_torque: drive.torque(0.0, 0.0),
            viscous_damping: p.viscous_damping,
            brake_gain: p.brake_gain,
            friction: p.friction,
        })?;
        if !(p.torque_noise >= 0.0 && p.torque_noise.is_finite()) {
            return bad("torque_noise", p.torque_noise, "a finite torque of at least 0 N m");
        }
        if p.delay_ticks > 1000 {
            return bad("delay_ticks", f64::from(p.delay_ticks), "0 to 1000 periods");
        }
        if let Some(t) = p.actuator_time_constant
            && !(t > 0.0 && t.is_finite())
        {
            return bad("actuator_time_constant", t, "a finite time above 0 s");
        }
        if !(p.speed_limit > 0.0 && p.speed_limit.is_finite()) {
            return bad("speed_limit", p.speed_limit, "a finite number above 0 rad/s");
        }
        let ripple = p.ripple.as_ref().map(|r| Ripple::new(r, seed)).transpose()?;
        Ok(Rig {
            model: Model { plant, ripple },
            drive,
            encoder: Encoder::new(p.counts_per_rev)?,
            dac: Dac::new(&p.dac)?,
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
        if volts.is_finite() { volts.min(self.params.dac.highest) } else { 0.0 }
    }

    /// Voltage that holds the sliding shaft at a velocity, V: friction and viscous drag carry
    /// the driving torque of the start.
    #[must_use]
    pub fn sliding_voltage(&self, velocity: f64) -> f64 {
        let p = self.model.plant.params();
        let mu = self.model.plant.friction().magnitude(velocity);
        let volts = (p.drive_torque - p.viscous_damping * velocity) / (mu * p.brake_gain);
        // Without friction there is no such voltage.
        if volts.is_finite() { volts.max(0.0).min(self.params.dac.highest) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_along_the_disc_has_its_rms_closes_after_a_turn_and_repeats_with_its_seed() {
        let p = RippleParams { rms: 0.15, lowest: 160, highest: 640, spacing: 40 };
        let r = Ripple::new(&p, 3).unwrap();
        let n = 100_000;
        let tau = core::f64::consts::TAU;
        let off = |i: i32| r.factor(tau * f64::from(i) / f64::from(n)) - 1.0;
        let square: f64 = (0..n).map(|i| off(i) * off(i)).sum();
        assert!((libm::sqrt(square / f64::from(n)) - 0.15).abs() < 1e-9);
        assert!((r.factor(0.3) - r.factor(0.3 + tau)).abs() < 1e-10);
        assert_eq!(r, Ripple::new(&p, 3).unwrap());
        assert_ne!(r, Ripple::new(&p, 4).unwrap());
    }

    #[test]
    fn the_recurrence_is_the_sum_of_sines() {
        let p = RippleParams { rms: 0.1, lowest: 82, highest: 246, spacing: 41 };
        let r = Ripple::new(&p, 9).unwrap();
        for i in 0..100 {
            let x = f64::from(i) * 0.37;
            let direct: f64 = r
                .phases
                .iter()
                .enumerate()
                .map(|(j, (sp, cp))| libm::sin(41.0 * (j + 2) as f64 * x + libm::atan2(*sp, *cp)))
                .sum();
            assert!((r.factor(x) - 1.0 - r.amplitude * direct).abs() < 1e-11);
        }
    }

    #[test]
    fn each_bad_parameter_is_named() {
        let good = RippleParams { rms: 0.1, lowest: 160, highest: 640, spacing: 40 };
        for (bad, field) in [
            (RippleParams { rms: 0.4, ..good.clone() }, "rms"),
            (RippleParams { rms: f64::NAN, ..good.clone() }, "rms"),
            (RippleParams { lowest: 170, ..good.clone() }, "lowest_waves_per_turn"),
            (RippleParams { highest: 120, ..good.clone() }, "highest_waves_per_turn"),
            (RippleParams { spacing: 0, ..good }, "spacing_waves_per_turn"),
        ] {
            assert_eq!(Ripple::new(&bad, 1).unwrap_err().field, field);
        }
        let rig = RigParams::paper;
        for (bad, field) in [
            (RigParams { torque_noise: -1.0, ..rig() }, "torque_noise"),
            (RigParams { delay_ticks: 1001, ..rig() }, "delay_ticks"),
            (RigParams { actuator_time_constant: Some(0.0), ..rig() }, "actuator_time_constant"),
            (RigParams { speed_limit: f64::NAN, ..rig() }, "speed_limit"),
            (RigParams { counts_per_rev: 0, ..rig() }, "counts_per_rev"),
        ] {
            assert_eq!(Rig::new(&bad, 1).unwrap_err().field, field);
        }
    }
}
