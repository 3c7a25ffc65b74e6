//! A rig with a mass added.

use super::Outcome;
use clutch_identify::added::Added;
use clutch_sim::Scenario;
use clutch_sim::drive::DriveParams;

/// The scenario's rig with a mass hung beside its weight.
pub(crate) fn heavier(scenario: &Scenario, added: &Added) -> Outcome<Scenario> {
    let rig = scenario.spec().rig;
    let DriveParams::Weight(weight) = rig.drive else { return Err("no weight drives it".into()) };
    let set = [
        ("rig.drive.weight.mass_kg", weight.mass + added.mass),
        ("rig.inertia_kg_m2", rig.inertia + added.mass * added.radius * added.radius),
    ];
    let set: Vec<(String, String)> =
        set.into_iter().map(|(key, x)| (key.to_owned(), format!("{x:?}"))).collect();
    Ok(Scenario::parse(scenario.name(), &scenario.canonical(), &set)?)
}
