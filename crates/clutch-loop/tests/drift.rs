//! The watch over friction and load: what leaves the bounds is reported on its side and in time, what does not leave them is not.
#![allow(clippy::unwrap_used, reason = "tests")]

use clutch_core::friction::FrictionModel;
use clutch_core::law::LawParams;
use clutch_core::{Bounds, Interval, Plant};
use clutch_loop::drift::{Alarm, Drift, DriftReport};
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_loop::healthy::HealthyShaft;
use clutch_loop::station::ControllerStation;
use clutch_loop::virtual_time::{VirtualLoop, VirtualOptions};
use clutch_node::ControllerNode;
use clutch_sim::detected::Detector;
use clutch_sim::rig::Rig;
use clutch_sim::scenario::BUILT_IN;
use clutch_sim::{Keep, Scenario};

const SAFETY: &str = "[safety]\nreason = \"a weight drives the shaft\"\n[safety.on_fault.hold]\nvolts_v = 9.99\n\
     [safety.limits]\nfollowing_error_deg = 20.0\nsaturation_time_s = 5.0\n";

/// A law on the paper's rig, on a ramp from rest.
fn ramp(law: &str, rate: f64, set: &[(&str, &str)]) -> Scenario {
    let text = format!(
        "name = \"drift\"\n[rig]\nbase = \"paper\"\n[law.{law}]\n[reference.ramp]\nrate_deg_s = {rate:?}\n\
         [bounds]\nfriction_percent = 5.0\ndrive_torque_percent = 5.0\n[run]\nduration_s = 16.0\nstart = \"rest\"\n{SAFETY}"
    );
    let set: Vec<_> = set.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    Scenario::parse("drift", &text, &set).unwrap()
}

fn built_in(name: &str, set: &[(&str, &str)]) -> Scenario {
    let set: Vec<_> = set.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    Scenario::parse(name, BUILT_IN.iter().find(|b| b.name == name).unwrap().toml, &set).unwrap()
}

/// A run in virtual time, under a watch with these bounds.
fn watched(scenario: &Scenario, bounds: &Bounds<f64>, faults: &[&str]) -> (Vec<Alarm>, DriftReport) {
    let built = BuiltRun::<f64>::new(scenario, 7).unwrap();
    let path = from_scenario::path::<f64>(scenario).unwrap();
    let options = VirtualOptions {
        latency_ns: 50_000,
        duration: scenario.spec().run.duration,
        faults: faults.iter().map(|fault| fault.parse().unwrap()).collect(),
        record: true,
        ..VirtualOptions::default()
    };
    let node = ControllerNode::new(built.controller, built.servo, built.supervisor);
    let mut world = VirtualLoop::new(scenario, options, ControllerStation::new(node, &path)).unwrap();
    let report = world.run(&path).unwrap();
    assert_eq!(report.cause, None, "control went on");
    let (samples, commands) = report.samples_and_commands();
    let mut drift = Drift::new(scenario, bounds).unwrap();
    let mut detector = Detector::new(&scenario.spec(), Keep::Trace).unwrap();
    let alarms = drift.watch_log(&mut detector, samples.iter().zip(&commands));
    (alarms, *drift.report())
}

fn run(scenario: &Scenario, faults: &[&str]) -> (Vec<Alarm>, DriftReport) {
    watched(scenario, &scenario.plan().unwrap().bounds, faults)
}

#[test]
fn friction_that_leaves_the_bounds_is_told_once_within_seconds_and_on_its_side() {
    for rate in [2.0, 10.0] {
        let scenario = ramp("ctc", rate, &[]);
        for (fault, truth) in [("dac-scale:at=5,factor=0.8", 0.8), ("dac-scale:at=5,factor=1.2", 1.2)] {
            let (alarms, report) = run(&scenario, &[fault]);
            let [alarm] = alarms[..] else { panic!("{rate} {fault}: {alarms:?}") };
            assert_eq!((report.alarms, report.first), (1, Some(alarm)));
            let delay = alarm.tick as f64 * 1e-3 - 5.0;
            assert!((0.5..6.0).contains(&delay), "{rate} {fault}: {delay} s");
            let seen = report.last.unwrap();
            assert!((seen.friction - truth).abs() < 0.005, "{rate} {fault}: {seen:?}");
            assert!(seen.least < truth && truth < seen.most && seen.outside(), "{seen:?}");
            assert_eq!(seen.friction > 1.0, truth > 1.0);
            // 5 % of friction over 5 % of load.
            assert!(
                (seen.low - 0.95 / 1.05).abs() < 2e-3 && (seen.high - 1.05 / 0.95).abs() < 2e-3,
                "{seen:?}"
            );
            assert!((report.range.0 - truth.min(1.0)).abs() < 0.02, "{report:?}");
        }
    }
}

#[test]
fn what_comes_back_within_the_bounds_and_leaves_again_is_told_again() {
    let scenario = ramp("ctc", 10.0, &[]);
    let (alarms, report) =
        run(&scenario, &["dac-scale:at=3,for=3,factor=0.8", "dac-scale:at=10,for=6,factor=1.25"]);
    let [below, above] = alarms[..] else { panic!("{alarms:?}") };
    assert!((3_000..6_100).contains(&below.tick) && below.seen.most < below.seen.low, "{below:?}");
    assert!((10_000..13_000).contains(&above.tick) && above.seen.least > above.seen.high, "{above:?}");
    let line = report.alarm_line().unwrap();
    assert!(report.words().contains(", left"), "{}", report.words());
    assert!(line.starts_with("DRIFT at ") && line.ends_with("; 2 times in all"), "{line}");
    assert!(
        line.contains("friction over load is 0.8") && line.contains(", below the bound of 0.90"),
        "{line}"
    );
}

#[test]
fn what_stays_within_the_bounds_is_not_told() {
    for fault in ["dac-scale:at=5,factor=0.95", "dac-scale:at=5,factor=1.07"] {
        let (alarms, report) = run(&ramp("ctc", 2.0, &[]), &[fault]);
        assert!(alarms.is_empty() && report.windows > 20, "{fault}: {alarms:?}");
    }
    // The part of the friction that changes along the disc is not the mean's.
    let wide = [("bounds.friction_percent", "30.0"), ("bounds.drive_torque_percent", "0.0")];
    let (alarms, _) = run(&ramp("ctc", 2.0, &wide), &["dac-scale:at=5,factor=0.8"]);
    assert!(alarms.is_empty(), "{alarms:?}");
    let along = [wide[0], wide[1], ("bounds.ripple_percent", "25.0")];
    let (alarms, _) = run(&ramp("ctc", 2.0, &along), &["dac-scale:at=5,factor=0.8"]);
    assert_eq!(alarms.len(), 1);
    assert!((alarms[0].seen.low - 1.25 / 1.3).abs() < 2e-3, "{alarms:?}");
}

#[test]
fn load_is_told_as_friction_the_other_way_round() {
    for (load, ratio) in [(0.85, 1.0 / 0.85), (1.2, 1.0 / 1.2)] {
        let torque = 0.047_088 * load;
        let points = format!("[[5.0, 0.047088], [5.001, {torque:?}]]");
        let scenario =
            ramp("ctc", 2.0, &[("rig.drive", &format!("{{ table = {{ points_s_nm = {points} }} }}"))]);
        let (alarms, report) = run(&scenario, &[]);
        assert_eq!(alarms.len(), 1, "{load}: {alarms:?}");
        let seen = report.last.unwrap();
        assert!((seen.friction - ratio).abs() < 0.01, "{load}: {seen:?}");
    }
}

/// Bounds that are the shaft itself, of whose friction the interval must not miss the truth.
#[test]
fn shafts_that_stick_lose_samples_or_start_from_rest_are_no_drift() {
    let exact = [("bounds.friction_percent", "0.0"), ("bounds.drive_torque_percent", "0.0")];
    let mut one_sided = 0;
    for law in ["pd", "smc", "ctc", "pid", "glide"] {
        for rate in [0.5, 2.0, 20.0] {
            let scenario = ramp(law, rate, &exact);
            let (alarms, report) = run(&scenario, &["drop:p=0.002", "jitter:p=1,ms=0.3"]);
            assert!(alarms.is_empty(), "{law} at {rate}: {alarms:?}");
            one_sided += report.one_sided;
            if let Some(seen) = report.last {
                assert!(
                    seen.least < 1.0 && 1.0 < seen.most && seen.low == seen.high,
                    "{law} at {rate}: {seen:?}"
                );
            }
        }
    }
    // A PD that sticks lets go of the shaft, after which it may have had any friction.
    assert!(one_sided > 0);
    let (alarms, report) = run(&built_in("board_minimum_jerk", &[]), &[]);
    assert!(alarms.is_empty() && report.windows > 20, "{alarms:?} {report:?}");
    assert!(report.words().contains("; bounds 1 to 1, not left"), "{}", report.words());
}

/// The sign function lets go of the pad for whole gaps, in which there is no friction.
#[test]
fn gaps_without_a_grip_leave_the_truth_within_the_interval() {
    let point = |x: f64| Interval { low: x, high: x };
    let (mut windows, mut one_sided) = (0, 0);
    for seed in [8, 30, 48, 56] {
        let scenario = HealthyShaft { seed, seconds: 60 }.scenario().unwrap();
        let spec = scenario.spec();
        assert!(matches!(spec.law, LawParams::SmcSign(_)), "{:?}", spec.law);
        let rig = Rig::new(&spec.rig, spec.run.seed).unwrap();
        let (plant, model) = (&rig.model.plant, Plant::new(&spec.model).unwrap());
        let more = plant.friction().sliding() / model.friction().sliding();
        let truth = Bounds {
            inertia: point(plant.params().inertia),
            drive_torque: point(rig.drive.range().0),
            viscous_damping: point(plant.params().viscous_damping),
            brake_gain: point(plant.actuator().brake_gain() * more),
            ..scenario.plan().unwrap().bounds
        };
        // What `[bounds]` says of friction is in the gain.
        let exact = ("bounds.friction_percent".to_owned(), "0.0".to_owned());
        let scenario = Scenario::parse("exact", &scenario.canonical(), &[exact]).unwrap();
        let (alarms, report) = watched(&scenario, &truth, &[]);
        assert!(alarms.is_empty(), "seed {seed}: {alarms:?}");
        windows += report.windows;
        one_sided += report.one_sided;
    }
    assert!(windows > 400 && one_sided > windows / 2, "{one_sided} of {windows} windows");
}

#[test]
fn a_shaft_that_stands_tells_nothing() {
    let still = [("reference", "{ hold = {} }")];
    let (alarms, report) = run(&built_in("board_smc_2", &still), &["dac-scale:at=2,factor=1.5"]);
    assert!(alarms.is_empty() && report.windows == 0 && report.last.is_none());
    assert_eq!(
        report.words(),
        "not determined: too little motion without a stand, or hardly a friction beside the damping"
    );
    assert_eq!(report.to_json()["last"], serde_json::Value::Null);
}

#[test]
fn a_motor_axis_is_watched_both_ways_and_one_without_friction_says_so() {
    let bounds = [("bounds.friction_percent", "10.0"), ("run.duration_s", "22.0")];
    for name in ["motor_ctc", "motor_pid", "motor_pid_coulomb", "motor_smc"] {
        let (alarms, report) = run(&built_in(name, &bounds), &[]);
        assert!(alarms.is_empty() && report.windows > 20, "{name}: {alarms:?}");
        let seen = report.last.unwrap();
        assert!((seen.friction - 1.0).abs() < 0.01, "{name}: {seen:?}");
    }
    // A weaker motor is more friction.
    let (alarms, report) = run(&built_in("motor_pid", &bounds), &["dac-scale:at=8,factor=0.75"]);
    assert_eq!(alarms.len(), 1, "{alarms:?}");
    assert!((report.last.unwrap().friction - 1.0 / 0.75).abs() < 0.02, "{report:?}");
    assert!(report.alarm_line().unwrap().contains("friction, with drive and motor as in the model is"));
    // A motor and a drive that are known no closer leave more room.
    let wide = [bounds[0], bounds[1], ("bounds.motor_gain_percent", "40.0")];
    let (alarms, _) = run(&built_in("motor_pid", &wide), &["dac-scale:at=8,factor=0.75"]);
    assert!(alarms.is_empty(), "{alarms:?}");

    let free = [("model.actuator.motor.preload_nm", "0.0"), ("rig.actuator.motor.preload_nm", "0.0")];
    let (alarms, report) = run(&built_in("motor_pid", &free), &[]);
    assert!(alarms.is_empty() && report.last.is_none());
    assert_eq!(report.words(), "not determined: the model has no friction");
}

/// Where damping decides the motion, friction is not determined by it.
#[test]
fn hardly_a_friction_beside_the_damping_tells_nothing() {
    let actuator = "brake_gain_nm_v = 0.2684\nmotor_gain_nm_v = 0.04248\npreload_nm = 0.0\n";
    let friction = "mu_dynamic = 0.15508\nmu_static = 0.15508\nstribeck_velocity_rad_s = 0.036066\nstribeck_exponent = 0.5\n";
    let text = format!(
        "name = \"free\"\n[rig]\nbase = \"paper\"\n[rig.actuator.both]\n{actuator}[rig.friction.stribeck]\n{friction}\
         [rig.drive.weight]\nmass_kg = 4.247337e-6\n[model]\ndrive_torque_nm = 1e-6\n[model.actuator.both]\n{actuator}\
         [model.friction.stribeck]\n{friction}[law.glide]\nkp_1_s = 20.19\n[velocity.edge_timed]\n[output]\nlowest_v = -10.0\n\
         [reference.ramp]\nrate_deg_s = 13.667\n[bounds]\nfriction_percent = 5.0\n[run]\nduration_s = 16.0\nstart = \"on_path\"\n{SAFETY}"
    );
    let (alarms, report) = run(&Scenario::parse("free", &text, &[]).unwrap(), &[]);
    // At the start alone the brake presses.
    assert!(alarms.is_empty() && report.windows < 3, "{}: {alarms:?}", report.words());
}

#[test]
fn an_inertia_that_is_not_the_models_is_told_apart_from_friction_by_the_bounds() {
    // Half the way of a sine at 20 °/s and 2 Hz is acceleration: with the inertia's interval, the truth stays inside.
    let sine = [
        ("reference", "{ sine = { rate_deg_s = 20.0, amplitude_deg = 1.2, frequency_hz = 2.0 } }"),
        ("rig.inertia_kg_m2", "0.00204"),
        ("bounds.friction_percent", "0.0"),
        ("bounds.drive_torque_percent", "0.0"),
    ];
    let scenario = ramp("ctc", 20.0, &sine);
    let bounds = scenario.plan().unwrap().bounds;
    let bounds = Bounds { inertia: Interval { low: 0.0017, high: 0.00204 }, ..bounds };
    let (alarms, report) = watched(&scenario, &bounds, &[]);
    assert!(alarms.is_empty() && report.windows > 20, "{alarms:?}");
}
