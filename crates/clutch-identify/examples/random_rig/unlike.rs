//! Random rigs that are unlike the model, each in one way.

use super::bristles::bristled;
use super::{Outcome, Truth, truth};
use clutch_identify::Recording;
use clutch_identify::experiment::{ExperimentError, PartRunner, Programme, experiment};
use clutch_sim::Scenario;
use clutch_sim::drive::DriveParams;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// The way in which a rig is unlike the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Unlike {
    /// A torque that rises or falls by 3 to 20 % over the experiment.
    Ramp,
    /// A sine of 2 to 15 % of the torque, 0.05 to 5 Hz.
    Sine,
    /// A hand: a random part of 5 to 16 % of the torque, 0.2 to 5 Hz.
    Hand,
    /// Bristles whose stiffness does not scale with the force, which let go after 0.5 to 5 counts.
    Stiff,
    /// Bristles whose stiffness scales with the force (LuGre), which let go after 0.2 to 1 counts.
    Scaling,
    /// A disc not square to its shaft: one wave or two in a turn, of 3 to 15 % of friction.
    Runout,
}

/// All of them, their names, and a word by which a report names the cause.
pub(crate) const KINDS: [(Unlike, &str, &str); 6] = [
    (Unlike::Ramp, "torque that rises or falls by 3 to 20 % in a minute", "a torque that varies"),
    (Unlike::Sine, "sine of 2 to 15 % of the torque, 0.05 to 5 Hz", "a torque that varies"),
    (Unlike::Hand, "hand, 5 to 16 % rms, 0.2 to 5 Hz", "a torque that varies"),
    (
        Unlike::Stiff,
        "bristles that do not scale with the force, 0.5 to 5 counts",
        "bristles that do not scale",
    ),
    (Unlike::Scaling, "bristles that scale with it (LuGre), 0.2 to 1 counts", "bristles"),
    (Unlike::Runout, "run-out of 3 to 15 %, one wave or two", "not square"),
];

fn chosen(base: &Scenario, without: &str, set: &[(&str, f64)]) -> Result<Scenario, ExperimentError> {
    let mut table = base.table().clone();
    if let Some(toml::Value::Table(rig)) = table.get_mut("rig") {
        let _ = rig.remove(without);
    }
    let set: Vec<(String, toml::Value)> =
        set.iter().map(|(key, x)| ((*key).to_owned(), toml::Value::Float(*x))).collect();
    Ok(Scenario::from_table(base.name(), table, &set)?)
}

/// Recordings of the experiment on the rig of a seed; or none, if a check ended it.
pub(crate) fn recordings(kind: Unlike, seed: u64) -> Outcome<(Truth, Option<Vec<Recording>>)> {
    let truth = truth(seed)?;
    let mut rng = Pcg64::seed_from_u64(seed ^ 0x756e_6c69);
    let rig = truth.scenario.spec().rig;
    let DriveParams::Weight(weight) = rig.drive else { return Err("no weight drives it".into()) };
    let torque = weight.mass * weight.gravity * weight.pulley_radius;
    let count = std::f64::consts::TAU / f64::from(rig.encoder.sensor.counts_per_rev);
    let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let (part, turns) = (rng.random::<f64>(), rng.random::<f64>());
    // The first number evenly, the second in the logarithm.
    let share = |least: f64, most: f64| least + (most - least) * part;
    let spaced = |least: f64, most: f64| least * (most / least).powf(turns);
    let programme = Programme::default();
    let mut runner = PartRunner::default();
    let mut elapsed = 0.0;
    let mut rests_at = 0.0;
    let mut run = |name: &str, base: &Scenario| {
        let begins = elapsed;
        elapsed += base.spec().run.duration;
        let unlike = match kind {
            Unlike::Ramp => {
                let rate = sign * share(0.03, 0.2) * torque / programme.seconds();
                let from = torque + rate * (begins - 0.5 * programme.seconds());
                chosen(
                    base,
                    "drive",
                    &[("rig.drive.ramp.from_nm", from), ("rig.drive.ramp.rate_nm_s", rate)],
                )?
            }
            Unlike::Sine => {
                let frequency = spaced(0.05, 5.0);
                let sine = [
                    ("rig.drive.sine.mean_nm", torque),
                    ("rig.drive.sine.amplitude_nm", share(0.02, 0.15) * torque),
                    ("rig.drive.sine.frequency_hz", frequency),
                    ("rig.drive.sine.phase_turns", (begins * frequency).fract()),
                ];
                chosen(base, "drive", &sine)?
            }
            Unlike::Hand => {
                let hand = [
                    ("rig.drive.hand.mean_nm", torque),
                    ("rig.drive.hand.rms_nm", share(0.05, 0.16) * torque),
                    ("rig.drive.hand.lowest_frequency_hz", 0.2),
                    ("rig.drive.hand.highest_frequency_hz", 5.0),
                ];
                chosen(base, "drive", &hand)?
            }
            Unlike::Stiff => {
                return bristled(name, base, torque, spaced(0.5, 5.0) * count, &mut rests_at);
            }
            Unlike::Scaling => {
                let dynamic = torque
                    / truth.hold
                    / clutch_core::Actuator::<f64>::new(&rig.actuator)
                        .map_err(|e| ExperimentError::Runs(e.to_string()))?
                        .brake_gain();
                let stiffness = dynamic / (spaced(0.2, 1.0) * count);
                let bristles = [
                    ("rig.friction.lugre.mu_static", truth.ratio * dynamic),
                    ("rig.friction.lugre.mu_dynamic", dynamic),
                    ("rig.friction.lugre.stribeck_velocity_rad_s", truth.stribeck),
                    ("rig.friction.lugre.stribeck_exponent", 1.0),
                    ("rig.friction.lugre.stiffness_1_rad", stiffness),
                    ("rig.friction.lugre.damping_s_rad", 2e-3 * stiffness),
                ];
                chosen(base, "friction", &bristles)?
            }
            Unlike::Runout => {
                let mut waves = base.table().clone();
                let runout = [("amplitude", share(0.03, 0.15)), ("phase_deg", 360.0 * turns)];
                let mut runout: toml::Table =
                    runout.into_iter().map(|(k, x)| (k.to_owned(), toml::Value::Float(x))).collect();
                runout.insert("waves_per_turn".into(), toml::Value::Integer(if sign > 0.0 { 1 } else { 2 }));
                if let Some(toml::Value::Table(rig)) = waves.get_mut("rig") {
                    rig.insert("runout".into(), toml::Value::Table(runout));
                }
                Scenario::from_table(base.name(), waves, &[])?
            }
        };
        runner.run(name, &unlike)
    };
    match experiment(&truth.scenario, &programme, &mut run) {
        Ok(recordings) => Ok((truth, Some(recordings))),
        Err(ExperimentError::Ended { .. }) => Ok((truth, None)),
        Err(e) => Err(e.into()),
    }
}
