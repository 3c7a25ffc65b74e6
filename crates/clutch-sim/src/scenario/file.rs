//! The scenario file: what its tables and keys are called, in their units, and what each becomes.
//!
//! Every key that has a unit carries it as a suffix. A unit in the file other than SI (°, %, µs)
//! is turned into SI here and nowhere else.

use super::Safety;
use crate::drive::DriveParams;
use crate::engine::EngineKind;
use crate::rig::{RigParams, RippleParams};
use crate::run::{RunParams, Start};
use clutch_core::law::{CtcParams, LawParams, OutputParams, PdParams, SmcParams, SmcSignParams};
use clutch_core::reference::{
    Chirp, Interpolation, JerkLimited, Knot, MinimumJerk, ReferenceParams, Sine, Table, Trapezoid,
};
use clutch_core::{
    BrakeGeometry, DacParams, Encoder, FixedCounts, Micros, ObserverParams, ParamError, PlantParams,
    SafeState, SmoothedDerivativeParams, StribeckParams, SupervisorParams, Tolerances, VelocityParams,
};
use serde::{Deserialize, Serialize};

/// Scalar that the servo runs in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ScalarKind {
    /// Single precision, as on a board.
    F32,
    /// Double precision.
    #[default]
    F64,
}

/// A whole file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    pub(super) name: String,
    pub(super) rig: RigFile,
    #[serde(default)]
    pub(super) model: ModelFile,
    pub(super) law: LawFile,
    #[serde(default)]
    pub(super) velocity: VelocityFile,
    #[serde(default)]
    pub(super) output: OutputFile,
    pub(super) reference: ReferenceFile,
    #[serde(default)]
    pub(super) sampling: SamplingFile,
    #[serde(default)]
    pub(super) bounds: BoundsFile,
    #[serde(default)]
    pub(super) run: RunFile,
    /// Only what drives a board needs it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) safety: Option<SafetyFile>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FrictionFile {
    mu_static: f64,
    mu_dynamic: f64,
    stribeck_velocity_rad_s: f64,
    stribeck_exponent: f64,
}

impl FrictionFile {
    fn new(p: &StribeckParams) -> Self {
        FrictionFile {
            mu_static: p.mu_static,
            mu_dynamic: p.mu_dynamic,
            stribeck_velocity_rad_s: p.stribeck_velocity,
            stribeck_exponent: p.stribeck_exponent,
        }
    }

    fn params(&self) -> StribeckParams {
        StribeckParams {
            mu_static: self.mu_static,
            mu_dynamic: self.mu_dynamic,
            stribeck_velocity: self.stribeck_velocity_rad_s,
            stribeck_exponent: self.stribeck_exponent,
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GeometryFile {
    inner_radius_m: f64,
    torque_constant_nm_a: f64,
    pad_area_m2: f64,
    lever_area_m2: f64,
    armature_resistance_ohm: f64,
    contact_radius_m: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RippleFile {
    rms: f64,
    lowest_waves_per_turn: u32,
    highest_waves_per_turn: u32,
    spacing_waves_per_turn: u32,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WeightFile {
    mass_kg: f64,
    gravity_m_s2: f64,
    pulley_radius_m: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SpringFile {
    stiffness_nm_rad: f64,
    rest_deg: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DriveTableFile {
    points_s_nm: Vec<(f64, f64)>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HandFile {
    mean_nm: f64,
    rms_nm: f64,
    lowest_frequency_hz: f64,
    highest_frequency_hz: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum DriveFile {
    Weight(WeightFile),
    Spring(SpringFile),
    Table(DriveTableFile),
    Hand(HandFile),
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EncoderFile {
    counts_per_rev: u32,
    quantised: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DacFile {
    bits: u8,
    lowest_v: f64,
    highest_v: f64,
    quantised: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RigFile {
    pub(super) base: String,
    inertia_kg_m2: f64,
    viscous_damping_nm_s_rad: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    brake_gain_nm_v: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    brake_geometry: Option<GeometryFile>,
    torque_noise_nm: f64,
    delay_ticks: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    actuator_time_constant_s: Option<f64>,
    speed_limit_deg_s: f64,
    friction: FrictionFile,
    #[serde(skip_serializing_if = "Option::is_none")]
    ripple: Option<RippleFile>,
    drive: DriveFile,
    encoder: EncoderFile,
    dac: DacFile,
}

impl RigFile {
    pub(super) fn new(base: &str, p: &RigParams) -> Self {
        RigFile {
            base: base.to_owned(),
            inertia_kg_m2: p.inertia,
            viscous_damping_nm_s_rad: p.viscous_damping,
            brake_gain_nm_v: Some(p.brake_gain),
            brake_geometry: None,
            torque_noise_nm: p.torque_noise,
            delay_ticks: p.delay_ticks,
            actuator_time_constant_s: p.actuator_time_constant,
            speed_limit_deg_s: p.speed_limit.to_degrees(),
            friction: FrictionFile::new(&p.friction),
            ripple: p.ripple.as_ref().map(|r| RippleFile {
                rms: r.rms,
                lowest_waves_per_turn: r.lowest,
                highest_waves_per_turn: r.highest,
                spacing_waves_per_turn: r.spacing,
            }),
            drive: match &p.drive {
                DriveParams::Weight { mass, gravity, pulley_radius } => DriveFile::Weight(WeightFile {
                    mass_kg: *mass,
                    gravity_m_s2: *gravity,
                    pulley_radius_m: *pulley_radius,
                }),
                DriveParams::Spring { stiffness, rest } => DriveFile::Spring(SpringFile {
                    stiffness_nm_rad: *stiffness,
                    rest_deg: rest.to_degrees(),
                }),
                DriveParams::Table(points) => {
                    DriveFile::Table(DriveTableFile { points_s_nm: points.clone() })
                }
                DriveParams::Hand { mean, rms, lowest_frequency, highest_frequency } => {
                    DriveFile::Hand(HandFile {
                        mean_nm: *mean,
                        rms_nm: *rms,
                        lowest_frequency_hz: *lowest_frequency,
                        highest_frequency_hz: *highest_frequency,
                    })
                }
            },
            encoder: EncoderFile { counts_per_rev: p.counts_per_rev, quantised: p.encoder_quantised },
            dac: DacFile {
                bits: p.dac.bits,
                lowest_v: p.dac.lowest,
                highest_v: p.dac.highest,
                quantised: p.dac_quantised,
            },
        }
    }

    pub(super) fn params(&self) -> Result<RigParams, ParamError> {
        Ok(RigParams {
            inertia: self.inertia_kg_m2,
            viscous_damping: self.viscous_damping_nm_s_rad,
            brake_gain: match (&self.brake_geometry, self.brake_gain_nm_v) {
                (None, Some(gain)) => gain,
                (Some(g), None) => BrakeGeometry {
                    inner_radius: g.inner_radius_m,
                    torque_constant: g.torque_constant_nm_a,
                    pad_area: g.pad_area_m2,
                    lever_area: g.lever_area_m2,
                    armature_resistance: g.armature_resistance_ohm,
                    contact_radius: g.contact_radius_m,
                }
                .brake_gain()?,
                // The merge with the base takes care that one of the two is there, and one only.
                (_, gain) => {
                    let value = gain.unwrap_or(f64::NAN);
                    let expected = "either brake_gain_nm_v or a table brake_geometry, not both";
                    return Err(ParamError { field: "brake_gain", value, expected });
                }
            },
            friction: self.friction.params(),
            ripple: self.ripple.as_ref().map(|r| RippleParams {
                rms: r.rms,
                lowest: r.lowest_waves_per_turn,
                highest: r.highest_waves_per_turn,
                spacing: r.spacing_waves_per_turn,
            }),
            drive: match &self.drive {
                DriveFile::Weight(w) => DriveParams::Weight {
                    mass: w.mass_kg,
                    gravity: w.gravity_m_s2,
                    pulley_radius: w.pulley_radius_m,
                },
                DriveFile::Spring(s) => {
                    DriveParams::Spring { stiffness: s.stiffness_nm_rad, rest: s.rest_deg.to_radians() }
                }
                DriveFile::Table(t) => DriveParams::Table(t.points_s_nm.clone()),
                DriveFile::Hand(h) => DriveParams::Hand {
                    mean: h.mean_nm,
                    rms: h.rms_nm,
                    lowest_frequency: h.lowest_frequency_hz,
                    highest_frequency: h.highest_frequency_hz,
                },
            },
            torque_noise: self.torque_noise_nm,
            counts_per_rev: self.encoder.counts_per_rev,
            encoder_quantised: self.encoder.quantised,
            dac: DacParams { bits: self.dac.bits, lowest: self.dac.lowest_v, highest: self.dac.highest_v },
            dac_quantised: self.dac.quantised,
            delay_ticks: self.delay_ticks,
            actuator_time_constant: self.actuator_time_constant_s,
            speed_limit: self.speed_limit_deg_s.to_radians(),
        })
    }
}

/// What laws and observers believe; Table 1 where nothing else is said.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct ModelFile {
    inertia_kg_m2: f64,
    drive_torque_nm: f64,
    viscous_damping_nm_s_rad: f64,
    brake_gain_nm_v: f64,
    mu_static: f64,
    mu_dynamic: f64,
    stribeck_velocity_rad_s: f64,
    stribeck_exponent: f64,
}

impl Default for ModelFile {
    fn default() -> Self {
        let p = PlantParams::default();
        ModelFile {
            inertia_kg_m2: p.inertia,
            drive_torque_nm: p.drive_torque,
            viscous_damping_nm_s_rad: p.viscous_damping,
            brake_gain_nm_v: p.brake_gain,
            mu_static: p.friction.mu_static,
            mu_dynamic: p.friction.mu_dynamic,
            stribeck_velocity_rad_s: p.friction.stribeck_velocity,
            stribeck_exponent: p.friction.stribeck_exponent,
        }
    }
}

impl ModelFile {
    pub(super) fn params(&self) -> PlantParams {
        PlantParams {
            inertia: self.inertia_kg_m2,
            drive_torque: self.drive_torque_nm,
            viscous_damping: self.viscous_damping_nm_s_rad,
            brake_gain: self.brake_gain_nm_v,
            friction: StribeckParams {
                mu_static: self.mu_static,
                mu_dynamic: self.mu_dynamic,
                stribeck_velocity: self.stribeck_velocity_rad_s,
                stribeck_exponent: self.stribeck_exponent,
            },
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct PdFile {
    kp_v_rad: f64,
    kd_v_s_rad: f64,
}

impl Default for PdFile {
    fn default() -> Self {
        let p = PdParams::default();
        PdFile { kp_v_rad: p.kp, kd_v_s_rad: p.kd }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct CtcFile {
    outer_gain: f64,
    kp_1_s2: f64,
    kd_1_s: f64,
}

impl Default for CtcFile {
    fn default() -> Self {
        let p = CtcParams::default();
        CtcFile { outer_gain: p.outer_gain, kp_1_s2: p.kp, kd_1_s: p.kd }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct SmcFile {
    kp_v: f64,
    kd_v_s_rad: f64,
    slope_1_s: f64,
    boundary_rad_s: f64,
}

impl Default for SmcFile {
    fn default() -> Self {
        let p = SmcParams::default();
        SmcFile { kp_v: p.kp, kd_v_s_rad: p.kd, slope_1_s: p.slope, boundary_rad_s: p.boundary }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct SmcSignFile {
    kp_v: f64,
    kd_v_s_rad: f64,
    slope_1_s: f64,
}

impl Default for SmcSignFile {
    fn default() -> Self {
        let p = SmcSignParams::default();
        SmcSignFile { kp_v: p.kp, kd_v_s_rad: p.kd, slope_1_s: p.slope }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum LawFile {
    Pd(PdFile),
    Ctc(CtcFile),
    Smc(SmcFile),
    SmcSign(SmcSignFile),
}

impl LawFile {
    pub(super) fn params(&self) -> LawParams {
        match self {
            LawFile::Pd(p) => LawParams::Pd(PdParams { kp: p.kp_v_rad, kd: p.kd_v_s_rad }),
            LawFile::Ctc(p) => {
                LawParams::Ctc(CtcParams { outer_gain: p.outer_gain, kp: p.kp_1_s2, kd: p.kd_1_s })
            }
            LawFile::Smc(p) => LawParams::Smc(SmcParams {
                kp: p.kp_v,
                kd: p.kd_v_s_rad,
                slope: p.slope_1_s,
                boundary: p.boundary_rad_s,
            }),
            LawFile::SmcSign(p) => {
                LawParams::SmcSign(SmcSignParams { kp: p.kp_v, kd: p.kd_v_s_rad, slope: p.slope_1_s })
            }
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct SmoothedDerivativeFile {
    smoothing: f64,
}

impl Default for SmoothedDerivativeFile {
    fn default() -> Self {
        SmoothedDerivativeFile { smoothing: SmoothedDerivativeParams::default().smoothing }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct ObserverFile {
    disturbance_walk_nm_rt_s: f64,
}

impl Default for ObserverFile {
    fn default() -> Self {
        ObserverFile { disturbance_walk_nm_rt_s: ObserverParams::default().disturbance_walk }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum VelocityFile {
    SmoothedDerivative(SmoothedDerivativeFile),
    Observer(ObserverFile),
}

impl Default for VelocityFile {
    fn default() -> Self {
        VelocityFile::SmoothedDerivative(SmoothedDerivativeFile::default())
    }
}

impl VelocityFile {
    pub(super) fn params(&self) -> VelocityParams {
        match self {
            VelocityFile::SmoothedDerivative(p) => {
                VelocityParams::SmoothedDerivative(SmoothedDerivativeParams { smoothing: p.smoothing })
            }
            VelocityFile::Observer(p) => {
                VelocityParams::Observer(ObserverParams { disturbance_walk: p.disturbance_walk_nm_rt_s })
            }
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct OutputFile {
    lowest_v: f64,
    highest_v: f64,
    on_invalid_v: f64,
    bumpless_time_s: f64,
}

impl Default for OutputFile {
    fn default() -> Self {
        let p = OutputParams::default();
        OutputFile {
            lowest_v: p.lowest,
            highest_v: p.highest,
            on_invalid_v: p.on_invalid,
            bumpless_time_s: p.bumpless_time,
        }
    }
}

impl OutputFile {
    pub(super) fn params(&self) -> OutputParams {
        OutputParams {
            lowest: self.lowest_v,
            highest: self.highest_v,
            on_invalid: self.on_invalid_v,
            bumpless_time: self.bumpless_time_s,
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum ReferenceFile {
    Hold(HoldFile),
    Ramp(RampFile),
    Trapezoid(TrapezoidFile),
    JerkLimited(JerkLimitedFile),
    MinimumJerk(MinimumJerkFile),
    Sine(SineFile),
    Chirp(ChirpFile),
    Table(TableFile),
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HoldFile {}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RampFile {
    rate_deg_s: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TrapezoidFile {
    distance_deg: f64,
    speed_deg_s: f64,
    acceleration_deg_s2: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JerkLimitedFile {
    distance_deg: f64,
    speed_deg_s: f64,
    acceleration_deg_s2: f64,
    jerk_deg_s3: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MinimumJerkFile {
    distance_deg: f64,
    duration_s: f64,
}

fn quarter_turn_behind() -> f64 {
    -0.25
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SineFile {
    rate_deg_s: f64,
    amplitude_deg: f64,
    frequency_hz: f64,
    #[serde(default = "quarter_turn_behind")]
    phase_turns: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ChirpFile {
    rate_deg_s: f64,
    amplitude_deg: f64,
    from_hz: f64,
    to_hz: f64,
    duration_s: f64,
    #[serde(default = "quarter_turn_behind")]
    phase_turns: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TableFile {
    points_s_deg: Vec<(f64, f64)>,
    #[serde(default)]
    interpolation: Interpolation,
}

impl ReferenceFile {
    /// Points of a table in the core's terms; none for other paths.
    pub(super) fn knots(&self, encoder: Encoder) -> Result<Vec<Knot>, ParamError> {
        let ReferenceFile::Table(t) = self else { return Ok(Vec::new()) };
        let bad = |value, expected| ParamError { field: "points", value, expected };
        t.points_s_deg
            .iter()
            .enumerate()
            .map(|(i, (time, angle))| {
                if !(*time >= 0.0 && *time < 1e12) {
                    return Err(bad(i as f64, "times of at least 0 s"));
                }
                let counts = angle.to_radians() * encoder.counts_per_radian::<f64>();
                if !counts.is_finite() || counts.abs() >= 1e12 {
                    return Err(bad(i as f64, "finite angles below 1e12 counts, °"));
                }
                let time_us = libm::rint(time * 1e6) as u64;
                Ok(Knot { time_us, position: FixedCounts::from_real(counts) })
            })
            .collect()
    }

    pub(super) fn params<'a>(&self, knots: &'a [Knot]) -> ReferenceParams<'a> {
        let rad = f64::to_radians;
        match self {
            ReferenceFile::Hold(_) => ReferenceParams::Hold,
            ReferenceFile::Ramp(p) => ReferenceParams::Ramp(rad(p.rate_deg_s)),
            ReferenceFile::Trapezoid(p) => ReferenceParams::Trapezoid(Trapezoid {
                distance: rad(p.distance_deg),
                speed: rad(p.speed_deg_s),
                acceleration: rad(p.acceleration_deg_s2),
            }),
            ReferenceFile::JerkLimited(p) => ReferenceParams::JerkLimited(JerkLimited {
                distance: rad(p.distance_deg),
                speed: rad(p.speed_deg_s),
                acceleration: rad(p.acceleration_deg_s2),
                jerk: rad(p.jerk_deg_s3),
            }),
            ReferenceFile::MinimumJerk(p) => ReferenceParams::MinimumJerk(MinimumJerk {
                distance: rad(p.distance_deg),
                duration: p.duration_s,
            }),
            ReferenceFile::Sine(p) => ReferenceParams::Sine(Sine {
                rate: rad(p.rate_deg_s),
                amplitude: rad(p.amplitude_deg),
                frequency: p.frequency_hz,
                phase: p.phase_turns,
            }),
            ReferenceFile::Chirp(p) => ReferenceParams::Chirp(Chirp {
                rate: rad(p.rate_deg_s),
                amplitude: rad(p.amplitude_deg),
                from: p.from_hz,
                to: p.to_hz,
                duration: p.duration_s,
                phase: p.phase_turns,
            }),
            ReferenceFile::Table(p) => {
                ReferenceParams::Table(Table { knots, interpolation: p.interpolation })
            }
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct SamplingFile {
    pub(super) period_us: u32,
    pub(super) scalar: ScalarKind,
}

impl Default for SamplingFile {
    fn default() -> Self {
        SamplingFile { period_us: 1000, scalar: ScalarKind::F64 }
    }
}

/// How well the believed plant is known, and the reaching rate that the certificate shall give.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct BoundsFile {
    inertia_percent: f64,
    drive_torque_percent: f64,
    viscous_damping_percent: f64,
    brake_gain_percent: f64,
    friction_percent: f64,
    pub(super) reach_rate_rad_s2: f64,
}

impl BoundsFile {
    pub(super) fn tolerances(&self) -> Tolerances {
        Tolerances {
            inertia: self.inertia_percent / 100.0,
            drive_torque: self.drive_torque_percent / 100.0,
            viscous_damping: self.viscous_damping_percent / 100.0,
            brake_gain: self.brake_gain_percent / 100.0,
            friction: self.friction_percent / 100.0,
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HoldStateFile {
    volts_v: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RampStateFile {
    rate_v_s: f64,
    volts_v: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ReleaseStateFile {}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HoldThenReleaseStateFile {
    volts_v: f64,
    after_s: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum SafeStateFile {
    Hold(HoldStateFile),
    Ramp(RampStateFile),
    Release(ReleaseStateFile),
    HoldThenRelease(HoldThenReleaseStateFile),
}

impl SafeStateFile {
    fn params(&self) -> SafeState {
        match self {
            SafeStateFile::Hold(p) => SafeState::Hold { volts: p.volts_v },
            SafeStateFile::Ramp(p) => SafeState::Ramp { volts_per_s: p.rate_v_s, volts: p.volts_v },
            SafeStateFile::Release(_) => SafeState::Release,
            SafeStateFile::HoldThenRelease(p) => {
                SafeState::HoldThenRelease { volts: p.volts_v, after: p.after_s }
            }
        }
    }
}

/// What the supervisor watches, and how long the board waits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct LimitsFile {
    jump_deg: f64,
    jumps: u32,
    good_samples: u32,
    following_error_deg: f64,
    following_time_s: f64,
    saturation_time_s: f64,
    stand_still_counts: f64,
    friction_margin: f64,
    lost: u32,
    late: u32,
    disorder: u32,
    silence_cycles: u32,
    watchdog_cycles: u32,
    valid_cycles: u32,
    deadline_us: u32,
    overruns: u32,
}

impl Default for LimitsFile {
    fn default() -> Self {
        let p = SupervisorParams::<f64>::new(SafeState::Release);
        let degrees = |x: f64| (x.to_degrees() * 1e9).round() / 1e9;
        LimitsFile {
            jump_deg: degrees(p.jump),
            jumps: p.jumps,
            good_samples: p.good_samples,
            following_error_deg: degrees(p.following_error),
            following_time_s: p.following_time,
            saturation_time_s: p.saturation_time,
            stand_still_counts: p.stand_still,
            friction_margin: p.friction_margin,
            lost: p.lost,
            late: p.late,
            disorder: p.disorder,
            silence_cycles: p.silence_cycles,
            watchdog_cycles: 3,
            valid_cycles: 2,
            deadline_us: p.deadline.0,
            overruns: p.overruns,
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SafetyFile {
    pub(super) reason: String,
    on_fault: SafeStateFile,
    #[serde(default)]
    limits: LimitsFile,
}

impl SafetyFile {
    pub(super) fn safety(&self, speed_limit: f64) -> Safety {
        let l = &self.limits;
        Safety {
            reason: self.reason.clone(),
            watchdog_cycles: l.watchdog_cycles,
            valid_cycles: l.valid_cycles,
            supervisor: SupervisorParams {
                on_fault: self.on_fault.params(),
                speed_limit,
                jump: l.jump_deg.to_radians(),
                jumps: l.jumps,
                good_samples: l.good_samples,
                following_error: l.following_error_deg.to_radians(),
                following_time: l.following_time_s,
                saturation_time: l.saturation_time_s,
                stand_still: l.stand_still_counts,
                friction_margin: l.friction_margin,
                lost: l.lost,
                late: l.late,
                disorder: l.disorder,
                silence_cycles: l.silence_cycles,
                deadline: Micros(l.deadline_us),
                overruns: l.overruns,
            },
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct RunFile {
    duration_s: f64,
    settle_s: f64,
    start: Start,
    #[serde(skip_serializing_if = "Option::is_none")]
    start_counts: Option<f64>,
    seed: u64,
    engine: EngineKind,
}

impl Default for RunFile {
    fn default() -> Self {
        let p = RunParams::default();
        RunFile {
            duration_s: p.duration,
            settle_s: p.settle,
            start: p.start,
            start_counts: p.start_counts,
            seed: p.seed,
            engine: p.engine,
        }
    }
}

impl RunFile {
    pub(super) fn params(&self) -> RunParams {
        RunParams {
            duration: self.duration_s,
            settle: self.settle_s,
            start: self.start,
            start_counts: self.start_counts,
            seed: self.seed,
            engine: self.engine,
        }
    }
}
