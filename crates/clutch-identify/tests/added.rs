//! Torque and inertia one by one, from two experiments.

use clutch_identify::added::{Added, Separate, separate};
use clutch_identify::experiment::{PartRunner, Programme, experiment};
use clutch_identify::{Finding, Report, identify};
use clutch_sim::Scenario;

#[path = "../examples/random_rig/mod.rs"]
#[allow(dead_code, reason = "its motors are of other tests")]
mod random_rig;
use random_rig::added::heavier;
use random_rig::truth;

fn found(scenario: &Scenario) -> Report {
    let mut runner = PartRunner::default();
    identify(&experiment(scenario, &Programme::default(), &mut |name, part| runner.run(name, part)).unwrap())
}

fn why(separate: &Separate) -> &str {
    match &separate.torque {
        Finding::Refused(why) => why,
        Finding::Known(e) => panic!("{e:?}"),
    }
}

#[test]
fn a_known_mass_separates_torque_inertia_and_friction_and_another_change_is_seen() {
    let truth = truth(10_001).unwrap();
    let rig = truth.scenario.spec().rig;
    let torque = truth.pull * rig.inertia;
    let added = Added { mass: 0.06, radius: 0.024, gravity: 9.81 };
    let (alone, with) = (found(&truth.scenario), found(&heavier(&truth.scenario, &added).unwrap()));
    let told = separate(&alone, &with, &added);
    let grip = torque / truth.hold;
    let truths = [torque, rig.inertia, grip, truth.ratio * grip, rig.viscous_damping];
    for ((key, _, _, finding), truth) in told.rows().into_iter().zip(truths) {
        let e = finding.known().unwrap_or_else(|| panic!("{key}: {finding:?}"));
        assert!(e.holds(truth), "{key}: {truth}: {e:?}");
    }
    assert!(told.torque.known().unwrap().share() < 0.05, "{told:?}");

    // The same torque with more inertia, the same recordings twice, and one of them without rides.
    let flywheel = separate(&alone, &with, &Added { mass: 0.0072, radius: 0.2, ..added });
    assert!(why(&flywheel).contains("did anything else change"), "{flywheel:?}");
    assert!(why(&separate(&alone, &alone, &added)).contains("a heavier mass"));
    let bare = Report { hold: Finding::Refused("no ride".to_owned()), ..with };
    assert!(why(&separate(&alone, &bare, &added)).contains("both need releases and a ride"));
    let none = Added { radius: 0.0, ..added }.check().unwrap_err();
    assert_eq!(none.to_string(), "radius = 0: expected a number above 0, in m");
}
