//! Random rigs, of which campaigns know nothing but what they measure.

use clutch_sim::Scenario;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::error::Error;

pub(crate) mod added;
pub(crate) mod asked;
pub(crate) mod bristles;
pub(crate) mod motor;
pub(crate) mod unlike;

/// A rig, and a campaign's findings of it.
pub(crate) type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// A rig, as nobody knows it.
pub(crate) struct Truth {
    pub(crate) scenario: Scenario,
    /// Dead time and lag together, s.
    pub(crate) delay: f64,
    pub(crate) lag: f64,
    pub(crate) pull: f64,
    pub(crate) hold: f64,
    pub(crate) ripple: f64,
    pub(crate) ratio: f64,
    pub(crate) stribeck: f64,
    pub(crate) damping: f64,
}

/// Keys of a scenario and their values, in the place of a rig's own.
pub(crate) type Set = [(String, String)];

/// A ripple of waves unlike those of `bench`, for a seed: one wave of 24 to 900 a turn, or three from it on to twice as many.
pub(crate) fn other_waves(seed: u64) -> Vec<(String, String)> {
    let mut rng = Pcg64::seed_from_u64(seed ^ 0x7761_7665);
    let lowest = (24.0 * (900.0_f64 / 24.0).powf(rng.random_range(0.0..1.0_f64))).round() as u32;
    let (lowest, spacing, highest) = match (rng.random_bool(0.5), lowest / 2) {
        (true, half) if 4 * half <= 900 => (2 * half, half, 4 * half),
        _ => (lowest, lowest, lowest),
    };
    waves(lowest, spacing, highest)
}

/// A lag of the actuator, for a seed: 0.3 to 3 ms, the same number of each size.
pub(crate) fn lag(seed: u64) -> Vec<(String, String)> {
    let mut rng = Pcg64::seed_from_u64(seed ^ 0x6c61_6773);
    let seconds = 0.3e-3 * 10.0_f64.powf(rng.random_range(0.0..1.0_f64));
    vec![("rig.actuator_time_constant_s".to_owned(), format!("{seconds:?}"))]
}

/// The keys of a ripple's waves.
pub(crate) fn waves(lowest: u32, spacing: u32, highest: u32) -> Vec<(String, String)> {
    let keys = [("lowest", lowest), ("spacing", spacing), ("highest", highest)];
    keys.map(|(which, n)| (format!("rig.ripple.{which}_waves_per_turn"), n.to_string())).to_vec()
}

/// Name and waves of a rig.
pub(crate) fn named(rig: &Scenario) -> String {
    let waves = rig.spec().rig.ripple.map(|r| format!("{} to {} waves", r.lowest, r.highest));
    format!("{}, {}", rig.name(), waves.unwrap_or_else(|| "even".to_owned()))
}

/// The rig of a seed.
pub(crate) fn truth(seed: u64) -> Outcome<Truth> {
    truth_with(seed, &[])
}

/// The same with other values of some keys.
pub(crate) fn truth_with(seed: u64, set: &Set) -> Outcome<Truth> {
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
    let scenario = Scenario::parse("rig", &text, set)?;
    let torque = mass * 9.81 * 0.024;
    let gain = clutch_core::Actuator::<f64>::new(&scenario.spec().rig.actuator)?.brake_gain();
    let lag = scenario.params().rig.actuator_time_constant.unwrap_or(0.0);
    Ok(Truth {
        delay: f64::from(delay) * scenario.spec().period.seconds::<f64>() + lag,
        lag,
        scenario,
        pull: torque / inertia,
        hold: torque / (dynamic * gain),
        ripple,
        ratio,
        stribeck,
        damping: viscous / inertia,
    })
}
