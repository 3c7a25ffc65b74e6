//! Friction along the disc, from a ride to `[friction_map]` of a scenario.

use crate::motor;
use crate::recording::{Recording, at_pad};
use crate::ride::{Place, rides, waves};
use clutch_core::Actuator;
use clutch_sim::Scenario;

/// Friction along the disc where the slowest ride of the recordings went, with T/J – of a motor K/J – and delay as the scenario believes
/// them to be: for recordings without releases or hops, which would determine both. Empty without a ride.
#[must_use]
pub fn map_as_believed(recordings: &[Recording], scenario: &Scenario) -> Vec<Place> {
    let spec = scenario.spec();
    let period: f64 = spec.period.seconds();
    let (ticks, lag) = match spec.law.filter() {
        Some(filter) => (filter.delay, filter.lag),
        None => (spec.rig.delay_ticks, spec.rig.actuator_time_constant.unwrap_or(0.0)),
    };
    let delay = f64::from(ticks) * period;
    if recordings.first().is_some_and(|recording| recording.motor) {
        let gain = Actuator::new(&spec.model.actuator).map_or(0.0, |motor| motor.motor_gain());
        return motor::map_as_believed(recordings, gain / spec.model.inertia, delay);
    }
    let pull = (spec.model.drive_torque / spec.model.inertia).abs();
    let seen = at_pad(recordings, lag);
    let slowest = seen.iter().flat_map(rides).min_by(|a, b| a.rate.total_cmp(&b.rate));
    slowest.map_or_else(Vec::new, |ride| ride.told(pull, delay, waves(&[&ride], pull, delay), None).map)
}

/// The map as a file: `[friction_map]`, which `--map` puts into a scenario. `rig` says of which rig and ride it is.
#[must_use]
pub fn map_file(map: &[Place], rig: &str) -> String {
    let mut points = String::new();
    for chunk in map.chunks(4) {
        let line: Vec<String> = chunk
            .iter()
            .map(|place| format!("[{:.6}, {:.5}]", place.angle.to_degrees(), place.factor))
            .collect();
        points += &format!("    {},\n", line.join(", "));
    }
    format!(
        "# Friction along the disc, over its mean, from the encoder's zero on: for the law glide.\n\
         # clutch sim|loop SCENARIO --map THIS_FILE.toml\n\n\
         [friction_map]\nversion = 1\nrig = {}\npoints_deg_factor = [\n{points}]\n",
        toml::Value::String(if rig.trim().is_empty() { "without a name" } else { rig }.to_owned())
    )
}
