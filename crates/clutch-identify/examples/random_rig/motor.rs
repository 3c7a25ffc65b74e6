//! Random motor axes, of which campaigns know nothing but what they measure.

use super::{Outcome, Set};
use clutch_sim::Scenario;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Torque per volt, N m/V.
const GAIN: f64 = 0.05;

/// An axis, as nobody knows it; torques in volts.
pub(crate) struct Truth {
    pub(crate) scenario: Scenario,
    /// Dead time and lag together, s.
    pub(crate) delay: f64,
    pub(crate) at_rest: f64,
    pub(crate) sliding: f64,
    pub(crate) load: f64,
    pub(crate) viscous: f64,
    pub(crate) inertia: f64,
    pub(crate) stribeck: f64,
    pub(crate) ripple: f64,
}

/// The axis of a seed.
pub(crate) fn truth(seed: u64) -> Outcome<Truth> {
    truth_with(seed, &[])
}

/// The same with other values of some keys.
pub(crate) fn truth_with(seed: u64, set: &Set) -> Outcome<Truth> {
    let mut rng = Pcg64::seed_from_u64(seed ^ 0x6d6f_746f);
    let inertia = 0.0017 * rng.random_range(0.7..1.3_f64);
    let sliding = rng.random_range(0.02..0.045_f64); // N m
    let ratio = rng.random_range(1.15..2.0_f64);
    let stribeck = 0.0005 * 20.0_f64.powf(rng.random_range(0.0..1.0_f64));
    let viscous = rng.random_range(0.0003..0.003_f64);
    let ripple = rng.random_range(0.03..0.17_f64);
    let load = rng.random_range(-0.004..0.004_f64); // N m
    let delay = rng.random_range(0..=2_u32);
    let text = format!(
        "name = \"axis {seed}\"\n[rig]\nbase = \"bench\"\ndelay_ticks = {delay}\ninertia_kg_m2 = {inertia:?}\n\
         viscous_damping_nm_s_rad = {viscous:?}\n[rig.drive.table]\npoints_s_nm = [[0.0, {load:?}]]\n\
         [rig.actuator.motor]\ngain_nm_v = {GAIN}\npreload_nm = 0.25\n\
         [rig.friction.stribeck]\nmu_static = {:?}\nmu_dynamic = {:?}\nstribeck_velocity_rad_s = {stribeck:?}\n\
         [rig.ripple]\nrms = {ripple:?}\n\
         [model]\ndrive_torque_nm = 0.0\n[model.actuator.motor]\ngain_nm_v = {GAIN}\npreload_nm = 0.25\n\
         [model.friction.stribeck]\nmu_static = 0.2\nmu_dynamic = 0.12\nstribeck_velocity_rad_s = 0.01\n\
         [law.pid]\nkp_v_rad = 200.0\nki_v_rad_s = 2000.0\nkd_v_s_rad = 4.0\n[reference.ramp]\nrate_deg_s = 2.0\n\
         [output]\nlowest_v = -10.0\non_invalid_v = 0.0\n\
         [bounds]\nfriction_percent = 90.0\ninertia_percent = 40.0\nviscous_damping_percent = 99.0\n\
         [run]\nseed = {seed}\nstart = \"rest\"\n\
         [safety]\nreason = \"friction holds the axis\"\n[safety.on_fault.release]\n",
        ratio * sliding / 0.25,
        sliding / 0.25,
    );
    let scenario = Scenario::parse("axis", &text, set)?;
    let lag = scenario.params().rig.actuator_time_constant.unwrap_or(0.0);
    Ok(Truth {
        delay: f64::from(delay) * scenario.spec().period.seconds::<f64>() + lag,
        scenario,
        at_rest: ratio * sliding / GAIN,
        sliding: sliding / GAIN,
        load: load / GAIN,
        viscous: viscous / GAIN,
        inertia: inertia / GAIN,
        stribeck,
        ripple,
    })
}
