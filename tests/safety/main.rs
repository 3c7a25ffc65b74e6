//! The fault campaign in virtual time, the supervisor's sensitivity, and the contents of its logs.

use clutch_core::supervisor::{Arrival, Cause, Checks, State};
use clutch_log::names;
use clutch_loop::campaign::RunId;
use clutch_loop::campaign::grammar::{Draw, Trouble, What};
use clutch_loop::campaign::oracle::{Fate, Promise, judge};
use clutch_loop::campaign::table::Table;
use clutch_loop::faults::{Fault, FaultKind};
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_loop::replay::replay;
use clutch_loop::station::ControllerStation;
use clutch_loop::to_log::PRESENT_CODE;
use clutch_loop::virtual_time::{VirtualLoop, VirtualOptions};
use clutch_node::ControllerNode;
use clutch_sim::{Keep, Scenario};
use std::collections::BTreeSet;

/// Runs of the campaign that the tests make, by seed; `cargo xtask campaign` makes a million.
const SEEDS: std::ops::Range<u64> = 1..3001;

/// Runs that have failed once, in their minimal form: each line has one, and the reason.
const FAILED_ONCE: &str = include_str!("failed_once.txt");

/// The fault of a run, if it has one.
fn wrong(run: &RunId, checks: Checks) -> Option<String> {
    let draw = run.draw();
    let report = draw.run(run.seed, checks, false).expect("the grammar makes scenarios");
    judge(&draw, &report)
}

#[test]
fn every_trouble_of_the_grammar_ends_or_is_borne_as_promised() {
    let (mut wrong, mut table) = (Vec::new(), Table::default());
    for run in SEEDS.map(RunId::from) {
        let draw = run.draw();
        let report = draw.run(run.seed, Checks::ALL, false).expect("the grammar makes scenarios");
        table.add(&draw, &report);
        wrong.extend(judge(&draw, &report).map(|what| format!("{run}: {what}")));
    }
    println!("{table}");
    assert_eq!(table.runs(), SEEDS.end - SEEDS.start);
    assert!(wrong.is_empty(), "{} runs:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn what_has_failed_once_is_mended() {
    for line in FAILED_ONCE.lines().filter(|l| !l.starts_with('#')) {
        let name = line.split_whitespace().next().expect("a run in each line");
        let run = name.parse().unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(wrong(&run, Checks::ALL), None, "{line}");
    }
}

/// A promise that names a cause, and so can miss it.
fn needs(draw: &Draw, cause: Cause) -> bool {
    let needs = |t: &Trouble| {
        let promise = Promise::of(&draw.healthy, t);
        matches!(promise.fate, Fate::Ends(_)) && promise.causes.contains(&cause)
    };
    draw.troubles.len() == 1 && draw.troubles.iter().any(needs)
}

#[test]
fn without_any_one_of_its_checks_the_campaign_fails() {
    for cause in Cause::CHECKS {
        // Runs that may name it first, then any: the first that fails is enough.
        let likely = (1..20_000).map(RunId::from).filter(|run| needs(&run.draw(), cause)).take(400);
        let any = SEEDS.map(RunId::from).take(1000);
        let found = likely.chain(any).find(|run| wrong(run, Checks::ALL.without(cause)).is_some());
        match found {
            Some(run) => println!("without {cause:?} fails: {run}"),
            None => panic!("without the check {cause:?} nothing fails: no trouble needs it"),
        }
    }
}

#[test]
fn the_name_of_a_run_says_what_it_leaves_out() {
    let run: RunId = "17-second-delay".parse().expect("a name");
    assert_eq!((run.seed, run.to_string()), (17, "17-second-delay".to_owned()));
    assert!(run.draw().troubles.len() <= 1);
    let error = "17-cake".parse::<RunId>().expect_err("no such part").to_string();
    assert!(error.contains("\"17-cake\": expected a seed") && error.contains("second, first"), "{error}");
    // Trouble that does not matter is left out, trouble that matters is not.
    let two = (1..).map(RunId::from).find(|run| run.draw().troubles.len() == 2).expect("some have two");
    let minimal = two.minimal(|run| run.draw().troubles.contains(&two.draw().troubles[1]));
    assert_eq!(minimal.draw().troubles, two.draw().troubles[1..]);
}

#[test]
fn each_run_leaves_a_log_that_replays_bit_for_bit() {
    let folder = std::env::temp_dir().join(format!("clutch-campaign-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    let path = folder.join("run.mcap");
    for run in SEEDS.take(500).map(RunId::from) {
        let draw = run.draw();
        // A law or a path that a test breaks is not in the log; its effect is.
        let inside = |t: &Trouble| {
            matches!(t.what, What::LawNotFinite | What::TargetNotFinite | What::TargetHuge | What::StopLost)
        };
        let report = draw.run(run.seed, Checks::ALL, true).expect("the grammar makes scenarios");
        let scenario = draw.scenario(run.seed).expect("the grammar makes scenarios");
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
            .unwrap_or_else(|e| panic!("{run}: the log is not readable: {e}"));
        assert!(log.complete, "{run}");
        if !draw.troubles.iter().any(inside) && report.answers > 0 {
            let replayed =
                replay(&log, &scenario, clutch_sim::progress::UNWATCHED).expect("its own scenario");
            assert_eq!(replayed.first, None, "{run}: the replay differs");
        }
        if let Some(cause) = report.cause.filter(|_| report.answers > 0) {
            let named = log.events.iter().any(|e| e.cause == cause as u8 && e.to == State::Faulted as u8);
            assert!(named, "{run}: the log does not name {cause:?}");
        }
    }
    std::fs::remove_dir_all(folder).expect("the temporary folder");
}

#[test]
fn without_latency_the_loop_is_the_simulation_bit_for_bit() {
    for scalar in ["f32", "f64"] {
        // PID, whose integral begins with the board's voltage at rest, is below.
        for law in ["pd", "ctc", "smc"] {
            // On `bench` the brake at rest begins elsewhere than the board's: with its delay of a period that shows.
            let text = format!(
                "name = \"equal\"\n[rig]\nbase = \"paper\"\n[law.{law}]\n[reference.ramp]\nrate_deg_s = 2.0\n\
                 [sampling]\nscalar = \"{scalar}\"\n[run]\nduration_s = 3.0\nstart = \"rest\"\n\
                 [safety]\nreason = \"a weight\"\n[safety.on_fault.hold]\nvolts_v = 4.5\n\
                 [safety.limits]\nfollowing_error_deg = 5.0\n"
            );
            let scenario = Scenario::parse("equal", &text, &[]).expect("a scenario");
            equal(&scenario, &format!("{law}, {scalar}"));
        }
        for name in ["motor_pid", "motor_pid_coulomb", "motor_smc", "motor_ctc", "motor_glide"] {
            // With the first reversal.
            let set = [
                ("sampling.scalar", scalar),
                ("run.duration_s", "3.0"),
                ("reference.sine.frequency_hz", "0.2"),
            ];
            let set = set.map(|(key, value)| (key.to_owned(), value.to_owned()));
            let scenario = Scenario::load(name.as_ref(), &set).expect("a scenario");
            let volts = equal(&scenario, &format!("{name}, {scalar}"));
            assert!(volts.iter().any(|v| *v > 0.0) && volts.iter().any(|v| *v < 0.0), "{name}, {scalar}");
        }
    }
}

/// Holds the loop against the simulation; its voltages.
fn equal(scenario: &Scenario, what: &str) -> Vec<f64> {
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
    run.trace.voltage
}

fn world<T: clutch_core::Real>(scenario: &Scenario) -> clutch_loop::virtual_time::VirtualReport {
    let built = BuiltRun::<T>::new(scenario, 7).expect("a safe state");
    let params = VirtualOptions { record: true, duration: 2.999, ..VirtualOptions::default() };
    let path = from_scenario::path::<T>(scenario).expect("a path");
    let node = ControllerNode::new(built.controller, built.servo, built.supervisor);
    let mut world = VirtualLoop::new(scenario, params, ControllerStation::new(node, &path)).expect("a rig");
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
fn healthy_runs_on_ramps_are_never_ended() {
    // Thirteen simulated minutes on both rigs, at 2 to 20 °/s, without a fault.
    for law in ["pd", "ctc", "smc", "pid"] {
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
                let mut world =
                    VirtualLoop::new(&scenario, params, ControllerStation::new(node, &path)).expect("a rig");
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
    let mut world = VirtualLoop::new(&scenario, params, ControllerStation::new(node, &path)).expect("a rig");
    world.run(&path).expect("a run").cause
}

#[test]
fn a_sound_motor_axis_with_any_friction_and_load_ends_without_a_fault() {
    for name in ["motor_pid", "motor_pid_coulomb", "motor_smc", "motor_ctc", "motor_glide"] {
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
    for name in ["motor_pid", "motor_pid_coulomb", "motor_smc", "motor_ctc", "motor_glide"] {
        for at in [1.0, 3.0, 6.5] {
            let cause = motor(name, &[], vec![Fault::new(FaultKind::EncoderFreeze, at)]);
            let seen = matches!(cause, Some(Cause::StandStill | Cause::FollowingError));
            assert!(seen, "{name}, frozen at {at} s: {cause:?}");
        }
    }
}
