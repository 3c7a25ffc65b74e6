//! Rigs: the shaft with its brake, its sensor and its converter.

use crate::drive::{Drive, DriveParams};
use crate::engine::Model;
use clutch_core::{Dac, DacParams, Encoder, GRAVITY, ParamError, Plant, PlantParams, StribeckParams};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Friction that varies along the disc: a sum of waves with random phases.
#[derive(Clone, Debug, PartialEq)]
pub struct RippleParams {
    /// Amplitude of each wave, as a share of the friction.
    pub amplitude: f64,
    /// Wave number of the first wave, 1/rad: waves per turn over 2π. The others are its multiples.
    pub wave_number: f64,
    /// How many waves.
    pub waves: u32,
}

/// The factor `1 + Σ_j amplitude · sin(j · wave_number · θ + φ_j)` on friction.
#[derive(Clone, Debug, PartialEq)]
pub struct Ripple {
    amplitude: f64,
    wave_number: f64,
    /// Sine and cosine of each wave's phase.
    phases: Vec<(f64, f64)>,
}

impl Ripple {
    /// Checks the parameters; `seed` decides the phases.
    ///
    /// # Errors
    /// `waves` outside 1…32; `wave_number` not above 0; an `amplitude` with which friction could
    /// reach 0 or below.
    pub fn new(p: &RippleParams, seed: u64) -> Result<Ripple, ParamError> {
        let bad = |field, value, expected| Err(ParamError { field, value, expected });
        if !(1..=32).contains(&p.waves) {
            return bad("waves", f64::from(p.waves), "1 to 32 waves");
        }
        if !(p.wave_number > 0.0 && p.wave_number.is_finite()) {
            return bad("wave_number", p.wave_number, "a finite number above 0 1/rad");
        }
        if !(p.amplitude >= 0.0 && p.amplitude * f64::from(p.waves) < 1.0) {
            return bad("amplitude", p.amplitude, "at least 0 and, times the number of waves, below 1");
        }
        let mut rng = Pcg64::seed_from_u64(seed ^ 0x7269_7070_6c65);
        let phases =
            (0..p.waves).map(|_| libm::sincos(core::f64::consts::TAU * rng.random::<f64>())).collect();
        Ok(Ripple { amplitude: p.amplitude, wave_number: p.wave_number, phases })
    }

    /// The factor at a position.
    #[must_use]
    pub fn factor(&self, position: f64) -> f64 {
        // sin(jx + φ) from sin x, cos x by the addition theorem: one sine for all waves.
        let (s1, c1) = libm::sincos(self.wave_number * position);
        let (mut s, mut c, mut sum) = (s1, c1, 0.0);
        for (sp, cp) in &self.phases {
            sum += s * cp + c * sp;
            (s, c) = (s * c1 + c * s1, c * c1 - s * s1);
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
                mu_static: 0.194,
                mu_dynamic: 0.105,
                stribeck_velocity: 0.00103,
                stribeck_exponent: 1.0,
            },
            ripple: Some(RippleParams { amplitude: 0.12, wave_number: 164.0, waves: 4 }),
            drive: DriveParams::Weight { mass: 0.2 * 1.033, gravity: GRAVITY, pulley_radius: 0.024 },
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

    /// Voltage that holds the sliding shaft at a velocity, V: friction and viscous drag carry
    /// the driving torque of the start.
    #[must_use]
    pub fn sliding_voltage(&self, velocity: f64) -> f64 {
        let p = self.model.plant.params();
        let mu = self.model.plant.friction().magnitude(velocity);
        ((p.drive_torque - p.viscous_damping * velocity) / (mu * p.brake_gain)).max(0.0)
    }
}
