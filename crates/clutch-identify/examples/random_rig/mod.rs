//! Random rigs, of which campaigns know nothing but what they measure.

use clutch_sim::Scenario;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::error::Error;

pub(crate) mod added;
pub(crate) mod bristles;
pub(crate) mod motor;
pub(crate) mod unlike;

/// A rig, and a campaign's findings of it.
pub(crate) type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// A rig, as nobody knows it.
pub(crate) struct Truth {
    pub(crate) scenario: Scenario,
    pub(crate) delay: f64,
    pub(crate) pull: f64,
    pub(crate) hold: f64,
    pub(crate) ripple: f64,
    pub(crate) ratio: f64,
    pub(crate) stribeck: f64,
    pub(crate) damping: f64,
}

/// The rig of a seed.
pub(crate) fn truth(seed: u64) -> Outcome<Truth> {
    let mut rng = Pcg64::seed_from_u64(seed ^ 0x6964_656e);
    let inertia = 0.0017 * rng.random_range(0.7..1.3_f64);
    let mass = 0.2 * rng.random_range(0.8..1.2_f64);
    let dynamic = rng.random_range(0.08..0.16_f64);
    let ratio = rng.random_range(1.15..2.2_f64);
    let stribeck = 0.0005 * 10.0_f64.powf(rng.random_range(0.0..1.0_f64));
    let viscous = rng.random_range(0.0003..0.003_f64);
    let ripple = rng.random_range(0.03..0.17_f64);
    let delay = rng.random_range(0..=2_u32);
    let text = format!(
        "name = \"rig {seed}\"\n[rig]\nbase = \"bench\"\ndelay_ticks = {delay}\ninertia_kg_m2 = {inertia:?}\n\
         viscous_damping_nm_s_rad = {viscous:?}\n[rig.drive.weight]\nmass_kg = {mass:?}\n\
         [rig.friction.stribeck]\nmu_static = {:?}\nmu_dynamic = {dynamic:?}\nstribeck_velocity_rad_s = {stribeck:?}\n\
         [rig.ripple]\nrms = {ripple:?}\n[law.smc]\n[reference.ramp]\nrate_deg_s = 2.0\n\
         [bounds]\nfriction_percent = 60.0\ninertia_percent = 40.0\ndrive_torque_percent = 25.0\n\
         viscous_damping_percent = 99.0\n[run]\nseed = {seed}\nstart = \"rest\"\n\
         [safety]\nreason = \"a weight drives the shaft\"\n[safety.on_fault.hold]\nvolts_v = 9.99\n",
        ratio * dynamic,
    );
    let scenario = Scenario::parse("rig", &text, &[])?;
    let torque = mass * 9.81 * 0.024;
    let gain = clutch_core::Actuator::<f64>::new(&scenario.spec().rig.actuator)?.brake_gain();
    Ok(Truth {
        scenario,
        delay: f64::from(delay) * 1e-3,
        pull: torque / inertia,
        hold: torque / (dynamic * gain),
        ripple,
        ratio,
        stribeck,
        damping: viscous / inertia,
    })
}
