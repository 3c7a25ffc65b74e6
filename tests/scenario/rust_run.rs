//! A run as Rust (`clutch scenario rust`): whatever a scenario chooses, the module compiles and makes a controller, and the
//! one in the tree is the example's.

use clutch_core::friction::FrictionParams;
use clutch_core::law::LawParams;
use clutch_core::params::Choice;
use clutch_core::supervisor::{BoardMode, Sample};
use clutch_core::{BeginningAt, Counts, DacCode, FixedCounts, Micros, SupervisorState};
use clutch_loop::from_scenario::{BuiltRun, in_single_precision, path};
use clutch_sim::Scenario;
use clutch_tests::command;
use std::collections::HashSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The text that the command prints of a scenario; `more` are options.
fn printed(scenario: &Path, more: &[&str]) -> String {
    let mut rust = Command::new(command());
    rust.args(["scenario", "rust"]).arg(scenario);
    let output = rust.args(more).output().expect("the command starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{} {more:?}: {stderr}", scenario.display());
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn the_run_of_nucleo_alone_is_that_of_the_example() {
    let kept =
        std::fs::read_to_string(root().join("firmware/nucleo-g474re/src/alone_run.rs")).expect("a file");
    let text =
        |text: &str| text.lines().filter(|l| !l.starts_with("//! Written by")).collect::<Vec<_>>().join("\n");
    let now = printed(&root().join("examples/nucleo_smc_2.toml"), &[]);
    let write = "clutch scenario rust examples/nucleo_smc_2.toml > firmware/nucleo-g474re/src/alone_run.rs";
    assert_eq!(text(&kept), text(&now), "write it anew: {write}");
}

#[test]
fn a_run_says_what_is_known_of_its_gains_and_one_that_is_not_certified_has_to_be_asked_for() {
    let kept =
        std::fs::read_to_string(root().join("firmware/nucleo-g474re/src/alone_run.rs")).expect("a file");
    assert!(kept.contains("//! certified_continuous_time: true."), "{kept}");
    let refused =
        Command::new(command()).args(["scenario", "rust", "motor_pid"]).output().expect("a command");
    assert_eq!(refused.status.code(), Some(2));
    let text = String::from_utf8_lossy(&refused.stdout);
    assert!(text.contains("so nothing was") && !text.contains("pub fn"), "{text}");
    let printed = printed(Path::new("motor_pid"), &["--uncertified"]);
    assert!(printed.contains("//! certified_continuous_time: false."), "{printed}");
}

/// Scenarios that between them choose each law, friction, actuator, path and safe state: a name and a text of each.
fn scenarios() -> Vec<(String, String)> {
    const LAW: &str = "[law.pd]\n";
    const PATH: &str = "[reference.ramp]\nrate_deg_s = 2.0\n";
    const SAFE: &str = "[safety.on_fault.hold]\nvolts_v = 4.5\n";
    const MOTOR: &str = "[output]\nlowest_v = -10.0\non_invalid_v = 0.0\n[safety.on_fault.release]\n";
    let mut all = Vec::new();
    let mut add = |name: &str, parts: [&str; 3]| {
        let begin = "name = \"@law@ of */\"\n[safety]\nreason = \"a test\"\n[rig]\nbase = \"paper\"\n";
        all.push((name.to_owned(), [begin, parts[0], parts[1], parts[2]].concat()));
    };
    for law in LawParams::<f32>::all().map(|law| law.name()) {
        add(&format!("law_{law}"), [&format!("[law.{law}]\n"), PATH, SAFE]);
    }
    for friction in FrictionParams::<f32>::all().map(|friction| Choice::<f32>::name(&friction)) {
        add(&format!("friction_{friction}"), [&format!("{LAW}[model.friction.{friction}]\n"), PATH, SAFE]);
    }
    let geometry = "inner_radius_m = 0.045, torque_constant_nm_a = 0.0508, pad_area_m2 = 0.040, \
                    lever_area_m2 = 0.032, armature_resistance_ohm = 0.6, contact_radius_m = 0.034";
    for (actuator, of, safe) in [
        ("geometry", geometry, SAFE),
        ("motor", "gain_nm_v = 0.05, preload_nm = 0.2", MOTOR),
        ("both", "brake_gain_nm_v = 0.14, motor_gain_nm_v = 0.05", MOTOR),
    ] {
        let more = format!("actuator.{actuator} = {{ {of} }}\n[model.actuator.{actuator}]\n");
        let model = of.split(", ").fold(more, |text, row| text + row + "\n");
        add(&format!("actuator_{actuator}"), [&(model + LAW), PATH, safe]);
    }
    for (path, of) in [
        ("hold", ""),
        ("trapezoid", "distance_deg = 20.0\nspeed_deg_s = 10.0\nacceleration_deg_s2 = 40.0\n"),
        (
            "jerk_limited",
            "distance_deg = 20.0\nspeed_deg_s = 10.0\nacceleration_deg_s2 = 40.0\njerk_deg_s3 = 400.0\n",
        ),
        ("minimum_jerk", "distance_deg = 20.0\nduration_s = 4.0\n"),
        ("sine", "rate_deg_s = 3.0\namplitude_deg = 1.0\nfrequency_hz = 0.2\n"),
        ("chirp", "rate_deg_s = 3.0\namplitude_deg = 0.5\nfrom_hz = 0.1\nto_hz = 0.5\nduration_s = 5.0\n"),
        ("table", "points_s_deg = [[0.0, 0.0], [1.0, 2.0], [9.0, 30.0]]\n"),
    ] {
        add(&format!("path_{path}"), [LAW, &format!("[reference.{path}]\n{of}"), SAFE]);
    }
    for (safe, of) in [
        ("release", ""),
        ("ramp", "rate_v_s = 5.0\nvolts_v = 4.5\n"),
        ("hold_then_release", "volts_v = 4.5\nafter_s = 2.0\n"),
    ] {
        add(&format!("safe_{safe}"), [LAW, PATH, &format!("[safety.on_fault.{safe}]\n{of}")]);
    }
    all
}

/// The begin of the program that runs each module: a board on which a shaft moves by a count each period.
const PROGRAM: &str = r#"use clutch_core::{Counts, DacCode, law::Listed, reference::OneKind};
use clutch_node::{Alone, BoardParams, Hardware, ResetCause};

const BOARD: BoardParams = BoardParams {
    board: 7,
    boot: 1,
    counts_per_rev: 20_000,
    dac_bits: 12,
    dac_lowest_mv: -10_000,
    dac_highest_mv: 10_000,
    period_min_us: 500,
    period_max_us: 4000,
    watchdog_max_us: 100_000,
    boot_code: 2900,
    started_by: ResetCause::Power,
    brown_out_low: false,
};

#[derive(Default)]
struct Desk {
    now_us: u64,
    counts: i32,
    code: u16,
}

impl Hardware for Desk {
    fn now_us(&self) -> u64 {
        self.now_us
    }
    fn counts(&mut self) -> Counts {
        Counts(self.counts)
    }
    fn encoder_fault(&self) -> bool {
        false
    }
    fn converter_fault(&self) -> bool {
        false
    }
    fn put_out(&mut self, code: DacCode) {
        self.code = code.0;
    }
    fn feed_watchdog(&mut self) {}
    fn send(&mut self, _: &[u8]) -> bool {
        false
    }
    fn cycles(&self) -> u32 {
        0
    }
}

/// The codes of a run are those of the same scenario's servo and supervisor, built by its file.
fn same<L: Listed<f32>, P: OneKind<f32>>(name: &str, mut alone: Alone<L, P>, codes: &[u16]) {
    let mut desk = Desk { counts: 70, ..Desk::default() };
    for period in 0..1020 {
        desk.now_us += 1000;
        alone.tick(&mut desk, period >= 1000);
    }
    for (tick, code) in codes.iter().enumerate() {
        assert_eq!(desk.code, *code, "{name}: tick {tick}");
        (desk.now_us, desk.counts) = (desk.now_us + 1000, desk.counts + 1);
        alone.tick(&mut desk, false);
    }
}
"#;

/// The codes of the first periods under control on that board, as long as nothing ends it.
fn codes(file: &Path) -> Vec<u16> {
    let scenario = Scenario::load(file, &[]).expect("a scenario");
    let scenario = in_single_precision(&scenario).expect("it can be").unwrap_or(scenario);
    let run = BuiltRun::<f32>::new(&scenario, 1).expect("a run");
    let path = path::<f32>(&scenario).expect("a path");
    let mut state = SupervisorState::default();
    run.supervisor.connect(&mut state);
    run.supervisor.arm(&mut state, DacCode(2900));
    let mut codes = Vec::new();
    for tick in 0..100 {
        let sample = Sample {
            sequence: tick,
            time: Micros(1000 * u32::from(tick)),
            counts: Counts(70 + i32::from(tick)),
            board: BoardMode::Driving,
            ..Sample::default()
        };
        let planned = BeginningAt { planned: &path, origin: FixedCounts::from_counts(70) };
        match run.supervisor.sample(&run.servo, &mut state, &sample, planned).answer {
            Some(code) => codes.push(code.0),
            None => break,
        }
    }
    codes
}

#[test]
fn each_choice_of_a_scenario_is_rust_that_compiles_and_makes_its_controller() {
    let folder = root().join("target/rust_runs");
    let source = folder.join("src");
    std::fs::create_dir_all(&source).expect("a folder");
    let (mut modules, mut runs, mut different) = (String::new(), String::new(), HashSet::new());
    for (name, text) in scenarios() {
        let file = folder.join(format!("{name}.toml"));
        std::fs::write(&file, text).expect("a file");
        std::fs::write(source.join(format!("{name}.rs")), printed(&file, &["--uncertified"]))
            .expect("a file");
        let codes = codes(&file);
        assert!(codes.len() > 5, "{name}: {codes:?}");
        let _ = writeln!(modules, "mod {name};");
        let _ = writeln!(
            runs,
            "    same(\"{name}\", {name}::controller(&BOARD).expect(\"{name}\"), &{codes:?});"
        );
        let other = "BoardParams { dac_bits: 16, ..BOARD }";
        let _ = writeln!(runs, "    assert!({name}::controller(&{other}).is_err(), \"{name}\");");
        different.insert(codes);
    }
    assert!(different.len() > 15, "the choices make {} runs", different.len());
    let program = format!("{modules}{PROGRAM}\nfn main() {{\n{runs}}}\n");
    std::fs::write(source.join("main.rs"), program).expect("a file");
    let manifest = "[package]\nname = \"rust_runs\"\nedition = \"2024\"\n\n[workspace]\n\n[dependencies]\n\
                    clutch-core = { path = \"../../crates/clutch-core\", default-features = false }\n\
                    clutch-node = { path = \"../../crates/clutch-node\" }\n";
    std::fs::write(folder.join("Cargo.toml"), manifest).expect("a file");
    std::fs::copy(root().join("Cargo.lock"), folder.join("Cargo.lock")).expect("a file");
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    let cargo = cargo.args(["run", "--quiet", "--offline", "--target-dir"]).arg(folder.join("target"));
    let run = cargo.current_dir(&folder).env("RUSTFLAGS", "-D warnings").output().expect("cargo starts");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
}
