//! The fault campaign in virtual time, the supervisor's sensitivity, and the contents of its logs.

use clutch_core::supervisor::{Arrival, Cause, Checks, State};
use clutch_log::names;
use clutch_loop::campaign::{CASES, Expected, RunId, Table, runs};
use clutch_loop::faults::{Fault, FaultKind};
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_loop::replay::replay;
use clutch_loop::station::ControllerStation;
use clutch_loop::to_log::PRESENT_CODE;
use clutch_loop::virtual_time::{VirtualLoop, VirtualOptions};
use clutch_node::ControllerNode;
use clutch_sim::{Keep, Scenario};
use std::collections::BTreeSet;

/// The first seed and the number of seeds: 12 seeds are more than 2 000 runs.
const SEEDS: (u64, u64) = (1, 12);

#[test]
fn every_fault_ends_in_the_safe_state_in_time_and_is_named() {
    println!("seeds {} to {}", SEEDS.0, SEEDS.0 + SEEDS.1 - 1);
    let mut wrong = Vec::new();
    let (mut count, mut table) = (0, Table::default());
    for run in runs(SEEDS.0, SEEDS.1) {
        count += 1;
        let report = run.run(Checks::ALL, false).expect("the tables of the campaign are right");
        table.add(&run, &report);
        if let Some(what) = run.judge(&report) {
            wrong.push(format!("{}: {what}", run.name()));
        }
    }
    assert!(count >= 2000, "only {count} runs");
    assert!(wrong.is_empty(), "{} of {count} runs:\n{}", wrong.len(), wrong.join("\n"));
    // Everything above is virtual time and our own mathematics: the table is the same everywhere.
    let page = include_str!("../../docs/safety.md");
    let block =
        page.split("<!-- campaign:begin -->").nth(1).and_then(|p| p.split("<!-- campaign:end -->").next());
    let block = block.expect("the markers of the table in docs/safety.md").trim();
    assert_eq!(
        block,
        table.to_string().trim(),
        "docs/safety.md has another table: `cargo xtask campaign` writes it"
    );
}

#[test]
fn without_any_one_of_its_checks_the_campaign_fails() {
    for cause in Cause::CHECKS {
        let fails = |run: RunId| {
            let report = run.run(Checks::ALL.without(cause), false).expect("the tables are right");
            run.judge(&report).is_some()
        };
        // The seeds of the campaign; the first run that fails is enough.
        let found = runs(SEEDS.0, 3).find(|run| fails(*run));
        match found {
            Some(run) => println!("without {cause:?} fails: {}", run.name()),
            None => panic!("without the check {cause:?} nothing fails: no case needs it"),
        }
    }
}

#[test]
fn each_run_leaves_a_log_that_replays_bit_for_bit() {
    let folder = std::env::temp_dir().join(format!("clutch-campaign-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    let path = folder.join("run.mcap");
    for run in runs(SEEDS.0, SEEDS.1) {
        // A law or a path that a test breaks is not in the log; its effect is.
        let broken_inside = matches!(
            run.case().broken,
            clutch_loop::campaign::Broken::LawNotFinite
                | clutch_loop::campaign::Broken::TargetNotFinite
                | clutch_loop::campaign::Broken::TargetHuge
        );
        let report = run.run(Checks::ALL, true).expect("the tables are right");
        let scenario = run.scenario().expect("the tables are right");
        let built = BuiltRun::<f64>::new(&scenario, 7).expect("the scenario has a safe state");
        let mut header =
            from_scenario::header(&scenario, &built.servo, clutch_log::Source::Loop, "virtual", "test");
        header.extra.push((PRESENT_CODE.to_owned(), report.present.to_string()));
        let mut log = clutch_log::LogWriter::create(&path, &header).expect("a temporary file");
        for record in &report.records {
            log.write(record).expect("a temporary file");
        }
        log.finish().expect("a temporary file");
        let log = clutch_log::read(&path, &clutch_log::Limits::default())
            .unwrap_or_else(|e| panic!("{}: the log is not readable: {e}", run.name()));
        assert!(log.complete && log.samples.len() > 100, "{}: {} samples", run.name(), log.samples.len());
        if !broken_inside {
            let replayed = replay(&log, &scenario).expect("its own scenario");
            assert_eq!(replayed.first, None, "{}: the replay differs", run.name());
        }
        if let (Expected::Safe { .. }, Some(cause)) = (run.case().expected, report.cause) {
            let named = log.events.iter().any(|e| e.cause == cause as u8 && e.to == State::Faulted as u8);
            assert!(named, "{}: the log does not name {cause:?}", run.name());
        }
    }
    std::fs::remove_dir_all(folder).expect("the temporary folder");
}

#[test]
fn without_latency_the_loop_is_the_simulation_bit_for_bit() {
    for law in ["pd", "ctc", "smc"] {
        for rig in ["paper", "bench"] {
            for scalar in ["f32", "f64"] {
                let text = format!(
                    "name = \"equal\"\n[rig]\nbase = \"{rig}\"\n[law.{law}]\n[reference.ramp]\nrate_deg_s = 2.0\n\
                     [sampling]\nscalar = \"{scalar}\"\n[run]\nduration_s = 3.0\nstart = \"rest\"\n\
                     [safety]\nreason = \"a weight\"\n[safety.on_fault.hold]\nvolts_v = 4.5\n\
                     [safety.limits]\nfollowing_error_deg = 5.0\n"
                );
                // The simulation's brake at rest begins where the board's does not: at another
                // voltage. With a delay of a period that would show.
                let scenario = Scenario::parse("equal", &text, &[]).expect("a scenario");
                if rig == "paper" {
                    equal(&scenario, &format!("{law}, {rig}, {scalar}"));
                }
            }
        }
    }
}

fn equal(scenario: &Scenario, what: &str) {
    let run = scenario.run(Keep::Trace, clutch_sim::progress::UNWATCHED).expect("a simulation");
    let report = match scenario.scalar() {
        clutch_sim::scenario::ScalarKind::F32 => world::<f32>(scenario),
        clutch_sim::scenario::ScalarKind::F64 => world::<f64>(scenario),
    };
    assert_eq!(report.cause, None, "{what}: control ended");
    let mut ticks = 0;
    let commands = report.records.iter().filter_map(|r| match r {
        clutch_log::Record::Command(c) if c.source == 0 => Some(c),
        _ => None,
    });
    for (c, code) in commands.zip(&run.trace.code) {
        assert_eq!(c.code, *code, "{what}: tick {}", c.tick);
        ticks += 1;
    }
    assert!(ticks > 2900, "{what}: {ticks} ticks");
    for (k, (loop_error, simulated)) in report.errors.iter().zip(&run.trace.error[1..]).enumerate() {
        assert!(
            (loop_error - simulated).abs() < 1e-12,
            "{what}: the shaft is elsewhere at tick {}: {loop_error} rad instead of {simulated} rad",
            k + 1
        );
    }
}

fn world<T: clutch_core::Real>(scenario: &Scenario) -> clutch_loop::virtual_time::VirtualReport {
    let built = BuiltRun::<T>::new(scenario, 7).expect("a safe state");
    let params = VirtualOptions { record: true, duration: 2.999, ..VirtualOptions::default() };
    let path = from_scenario::path::<T>(scenario).expect("a path");
    let node = ControllerNode::new(built.controller, built.servo, built.supervisor);
    let mut world =
        VirtualLoop::new(scenario, params, ControllerStation { node, path: &path }).expect("a rig");
    world.run(&path).expect("a run")
}

#[test]
fn the_log_calls_states_causes_and_arrivals_as_the_core_does() {
    let named = |table: names::Names, number: u8| {
        table.iter().find(|(n, _)| *n == number).map(|(_, name)| (*name).to_owned())
    };
    for state in [
        State::Disconnected,
        State::Ready,
        State::Armed,
        State::Running,
        State::Holding,
        State::Released,
        State::Faulted,
    ] {
        assert_eq!(named(names::STATES, state as u8), Some(format!("{state:?}")));
    }
    for cause in Cause::CHECKS.into_iter().chain([Cause::None, Cause::Operator, Cause::Done]) {
        assert_eq!(named(names::CAUSES, cause as u8), Some(format!("{cause:?}")));
    }
    for arrival in [
        Arrival::Fresh,
        Arrival::Missing,
        Arrival::Duplicate,
        Arrival::Reordered,
        Arrival::Late,
        Arrival::Implausible,
    ] {
        assert_eq!(named(names::ARRIVALS, arrival as u8), Some(format!("{arrival:?}")));
    }
    let numbers: BTreeSet<u8> = names::CAUSES.iter().map(|(n, _)| *n).collect();
    assert_eq!(numbers.len(), 21, "a cause of the log that the core does not have");
}

#[test]
fn healthy_runs_of_every_law_and_path_are_never_ended() {
    // Ten simulated minutes on both rigs, at 2 and 20 °/s, without a fault.
    for law in ["pd", "ctc", "smc"] {
        for rig in ["paper", "bench"] {
            for (rate, seed) in [(2.0, 1), (2.0, 2), (6.0, 3), (20.0, 4), (20.0, 5)] {
                let text = format!(
                    "name = \"healthy\"\n[rig]\nbase = \"{rig}\"\n[law.{law}]\n[reference.ramp]\nrate_deg_s = {rate:?}\n\
                     [run]\nduration_s = 20.0\nstart = \"rest\"\nseed = {seed}\n\
                     [safety]\nreason = \"a weight\"\n[safety.on_fault.hold]\nvolts_v = 9.0\n"
                );
                let scenario = Scenario::parse("healthy", &text, &[]).expect("a scenario");
                let built = BuiltRun::<f32>::new(&scenario, 7).expect("a safe state");
                let params =
                    VirtualOptions { latency_ns: 80_000, seed, duration: 20.0, ..VirtualOptions::default() };
                let path = from_scenario::path::<f32>(&scenario).expect("a path");
                let node = ControllerNode::new(built.controller, built.servo, built.supervisor);
                let mut world = VirtualLoop::new(&scenario, params, ControllerStation { node, path: &path })
                    .expect("a rig");
                let report = world.run(&path).expect("a run");
                assert_eq!(report.cause, None, "{law} at {rate} °/s on {rig}, seed {seed}: a nuisance trip");
            }
        }
    }
}

/// A motor axis in virtual time, with other friction, load and fault than its built-in scenario.
fn motor(name: &str, set: &[(&str, String)], faults: Vec<Fault>) -> Option<Cause> {
    let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
    let scenario = Scenario::load(name.as_ref(), &set).unwrap_or_else(|e| panic!("{e}"));
    let built = BuiltRun::<f32>::new(&scenario, 7).expect("a safe state");
    let params = VirtualOptions { latency_ns: 80_000, duration: 10.0, faults, ..VirtualOptions::default() };
    let path = from_scenario::path::<f32>(&scenario).expect("a path");
    let node = ControllerNode::new(built.controller, built.servo, built.supervisor);
    let mut world =
        VirtualLoop::new(&scenario, params, ControllerStation { node, path: &path }).expect("a rig");
    world.run(&path).expect("a run").cause
}

#[test]
fn a_sound_motor_axis_with_any_friction_and_load_ends_without_a_fault() {
    for name in ["motor_pid", "motor_pid_coulomb", "motor_smc", "motor_ctc"] {
        for preload in [0.0, 0.01, 0.1, 0.25] {
            for load in [0.0, 0.01, -0.01] {
                for start in ["rest", "on_path"] {
                    // The law knows the load: SMC and PID have no other way to carry it at the start.
                    let set = [
                        ("rig.actuator.motor.preload_nm", preload.to_string()),
                        ("model.actuator.motor.preload_nm", preload.to_string()),
                        ("rig.drive.table.points_s_nm", format!("[[0.0, {load:?}]]")),
                        ("model.drive_torque_nm", format!("{load:?}")),
                        ("run.start", format!("\"{start}\"")),
                        ("safety.limits.following_error_deg", "3.0".to_owned()),
                        ("safety.on_fault", "{release={}}".to_owned()),
                    ];
                    let cause = motor(name, &set, Vec::new());
                    assert_eq!(cause, None, "{name}, preload {preload} N m, load {load} N m, start {start}");
                }
            }
        }
    }
}

#[test]
fn a_frozen_encoder_of_a_motor_axis_ends_control_before_the_axis_has_gone_far() {
    for name in ["motor_pid", "motor_pid_coulomb", "motor_smc", "motor_ctc"] {
        for at in [1.0, 3.0, 6.5] {
            let cause = motor(name, &[], vec![Fault::new(FaultKind::EncoderFreeze, at)]);
            let seen = matches!(cause, Some(Cause::StandStill | Cause::FollowingError));
            assert!(seen, "{name}, frozen at {at} s: {cause:?}");
        }
    }
}

#[test]
fn the_cases_have_names_of_their_own() {
    let names: BTreeSet<&str> = CASES.iter().map(|c| c.name).collect();
    assert_eq!(names.len(), CASES.len());
}
