//! The emulated Cortex-M4F board in the controller role: it behaves like the simulation, bit for
//! bit, and faults of its line end in the safe state.

mod chip;
mod serial;
mod verb;

use clutch_core::supervisor::State;
use clutch_log::{Limits, LogWriter, Record, Source};
use clutch_loop::campaign::{RunId, oracle};
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_loop::lockstep_board::{InProcessBoard, LockstepBoard};
use clutch_loop::lockstep_host::{LockstepHost, lockstep_host};
use clutch_loop::qemu_board::{QemuBoard, QemuSerialBoard};
use clutch_loop::replay::replay;
use clutch_loop::to_log::PRESENT_CODE;
use clutch_loop::virtual_time::{VirtualLoop, VirtualOptions, VirtualReport};
use clutch_node::controller_lockstep::Exchange;
use clutch_sim::progress::UNWATCHED;
use clutch_sim::{Keep, Metrics, Run, Scenario};
use clutch_tests::command;
use clutch_tests::firmware::image;
use clutch_wire::{BoardState, Decoder, Message, StopReason};
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

static MACHINE: RwLock<()> = RwLock::new(());

/// For a test in which time is computed.
fn beside() -> RwLockReadGuard<'static, ()> {
    MACHINE.read().unwrap_or_else(PoisonError::into_inner)
}

/// The machine for this test alone: three programs in real time on two cores need it.
fn alone() -> RwLockWriteGuard<'static, ()> {
    MACHINE.write().unwrap_or_else(PoisonError::into_inner)
}

/// Laws whose first code does not depend on the voltage before it: the board holds with its safe state, the simulation with less.
const LAWS: [&str; 3] = ["pd", "ctc", "smc"];
/// These and PID, whose integral begins with that voltage, where both sides begin alike.
const WITH_PID: [&str; 4] = ["pd", "ctc", "smc", "pid"];

/// A law on the paper's rig at 2 °/s for 10 s, in single precision. Lateness belongs to this machine and is
/// not checked.
fn on_paper(law: &str, seed: u64) -> Scenario {
    lasting(10.0, law, seed)
}

fn lasting(duration: f64, law: &str, seed: u64) -> Scenario {
    let text = format!(
        "name = \"{law} at 2 °/s\"\n[rig]\nbase = \"paper\"\n[law.{law}]\n[reference.ramp]\nrate_deg_s = 2.0\n\
         [sampling]\nscalar = \"f32\"\n[run]\nduration_s = {duration:?}\nstart = \"rest\"\nseed = {seed}\n\
         [safety]\nreason = \"a weight drives the shaft\"\n[safety.on_fault.hold]\nvolts_v = 4.5\n\
         [safety.limits]\nfollowing_error_deg = 5.0\ndeadline_us = 1000000\n"
    );
    Scenario::parse(law, &text, &[]).expect("a scenario")
}

/// A run on a board, in lockstep.
fn on(scenario: &Scenario, board: impl LockstepBoard, patience_us: u32) -> VirtualReport {
    let mut built = BuiltRun::<f32>::new(scenario, 7).expect("a safe state");
    built.controller.silence = clutch_core::Micros(patience_us);
    let ticks = built.ticks + 1;
    let run = &scenario.spec().run;
    let (duration, settle) = (run.duration + 1.0, run.settle);
    let params = VirtualOptions { record: true, duration, ticks, settle, ..VirtualOptions::default() };
    let station = lockstep_host(scenario, &built, board, ticks).expect("a board can run it");
    let path = from_scenario::path::<f32>(scenario).expect("a path");
    VirtualLoop::new(scenario, params, station).expect("a rig").run(&path).expect("the board answers")
}

/// Figures, codes and motion of the board's run are those of the simulation.
fn equal(what: &str, board: &VirtualReport, simulated: &Run) {
    assert_eq!(board.cause, None, "{what}: control ended");
    // The rig's clock began before the run's: a sum of times differs in its last bits, and nothing else does.
    let (ours, theirs) = (board.metrics, simulated.metrics);
    assert!((ours.stick_time_fraction - theirs.stick_time_fraction).abs() < 1e-12, "{what}: time stuck");
    let of_the_run = Metrics { stick_time_fraction: theirs.stick_time_fraction, ..ours };
    assert_eq!(of_the_run, theirs, "{what}: the figures differ");
    let mut compared = 0;
    for record in &board.records {
        let Record::Command(c) = record else { continue };
        let tick = c.tick as usize;
        // After its last tick the board holds.
        if c.state != State::Running as u8 || tick >= simulated.trace.code.len() {
            continue;
        }
        assert_eq!(c.code, simulated.trace.code[tick], "{what}: tick {tick}: another code");
        assert_eq!(c.error, simulated.trace.measured_error[tick], "{what}: tick {tick}: another error");
        assert_eq!(c.error_rate, simulated.trace.error_rate[tick], "{what}: tick {tick}: another error rate");
        assert_eq!(c.demand, simulated.trace.demand[tick], "{what}: tick {tick}: another demand");
        compared += 1;
    }
    assert_eq!(compared, simulated.trace.code.len(), "{what}: ticks");
    assert_eq!(board.board, Some(BoardState::Stopped), "{what}: encoder and converter at the end");
}

fn simulate(scenario: &Scenario) -> Run {
    scenario.run(Keep::Trace, UNWATCHED).expect("a simulation")
}

#[test]
fn ten_seeds_of_the_papers_laws_on_the_board_are_the_simulation_bit_for_bit() {
    let Some(image) = image("mps2-controller") else { return };
    let _beside = beside();
    for seed in 1..=10 {
        for law in LAWS {
            let scenario = on_paper(law, seed);
            let board = on(&scenario, QemuBoard::start(&image).expect("a board"), 3000);
            equal(&format!("{law}, seed {seed}"), &board, &simulate(&scenario));
        }
    }
}

/// The built-in motor axes to and fro, in single precision.
#[test]
fn motors_on_the_board_are_the_simulation_bit_for_bit() {
    let Some(image) = image("mps2-controller") else { return };
    let _beside = beside();
    let set = |key: &str, value: &str| (key.to_owned(), value.to_owned());
    for name in ["motor_pid", "motor_pid_coulomb", "motor_smc", "motor_ctc", "motor_glide"] {
        let in_f32 = [set("sampling.scalar", "f32"), set("safety.limits.deadline_us", "1000000")];
        let scenario = Scenario::load(name.as_ref(), &in_f32).expect("a scenario");
        let simulated = simulate(&scenario);
        // It does go both ways, and is driven both ways.
        let (voltages, velocities) = (&simulated.trace.voltage, &simulated.trace.velocity);
        for both_ways in [voltages, velocities] {
            assert!(both_ways.iter().any(|x| *x > 0.0) && both_ways.iter().any(|x| *x < 0.0), "{name}");
        }
        let board = on(&scenario, QemuBoard::start(&image).expect("a board"), 3000);
        equal(name, &board, &simulated);
    }
}

#[test]
fn over_its_serial_lines_too_the_board_is_the_simulation() {
    let Some(image) = image("mps2-controller") else { return };
    let _beside = beside();
    std::thread::scope(|scope| {
        for law in LAWS {
            let image = &image;
            scope.spawn(move || {
                // Each byte is a call of the system at both ends, many times the work of a run in lockstep.
                let scenario = lasting(3.0, law, 1);
                let board = QemuSerialBoard::start(image).expect("a board");
                equal(law, &on(&scenario, board, 60_000_000), &simulate(&scenario));
            });
        }
    });
}

#[test]
fn every_field_of_every_tick_is_the_one_of_the_same_node_in_this_process() {
    let Some(image) = image("mps2-controller") else { return };
    let _beside = beside();
    for law in WITH_PID {
        let scenario = on_paper(law, 11);
        let board = on(&scenario, QemuBoard::start(&image).expect("a board"), 3000);
        let here = on(&scenario, InProcessBoard::default(), 3000);
        assert_eq!(board.records.len(), here.records.len(), "{law}: records");
        for (theirs, ours) in board.records.iter().zip(&here.records) {
            assert_eq!(theirs, ours, "{law}: tick {}", ours.tick());
        }
    }
}

#[test]
fn every_kind_of_path_on_the_board_is_the_simulation() {
    let Some(image) = image("mps2-controller") else { return };
    let _beside = beside();
    for (name, path) in [
        ("hold", "[reference.hold]\n"),
        (
            "trapezoid",
            "[reference.trapezoid]\ndistance_deg = 20.0\nspeed_deg_s = 10.0\nacceleration_deg_s2 = 40.0\n",
        ),
        ("minimum jerk", "[reference.minimum_jerk]\ndistance_deg = 20.0\nduration_s = 2.5\n"),
        (
            "jerk-limited",
            "[reference.jerk_limited]\ndistance_deg = 20.0\nspeed_deg_s = 10.0\nacceleration_deg_s2 = 40.0\njerk_deg_s3 = 400.0\n",
        ),
        (
            "table",
            "[reference.table]\ninterpolation = \"cubic\"\npoints_s_deg = [[0.0, 0.0], [1.0, 5.0], [2.0, 14.0], [3.0, 15.0]]\n",
        ),
    ] {
        let text = format!(
            "name = \"{name}\"\n[rig]\nbase = \"paper\"\n[law.smc]\n{path}[sampling]\nscalar = \"f32\"\n\
             [run]\nduration_s = 3.0\nstart = \"rest\"\nseed = 5\n[safety]\nreason = \"a weight\"\n\
             [safety.on_fault.hold]\nvolts_v = 4.5\n[safety.limits]\nfollowing_error_deg = 5.0\n"
        );
        let scenario = Scenario::parse(name, &text, &[]).unwrap_or_else(|e| panic!("{name}: {e}"));
        let board = on(&scenario, QemuBoard::start(&image).expect("a board"), 3000);
        equal(name, &board, &simulate(&scenario));
    }
}

#[test]
fn the_boards_log_replays_bit_for_bit_on_this_machine() {
    let Some(image) = image("mps2-controller") else { return };
    let _beside = beside();
    for law in WITH_PID {
        let scenario = on_paper(law, 3);
        let ran = on(&scenario, QemuBoard::start(&image).expect("a board"), 3000);
        let file = scratch(&format!("{law}.mcap"));
        let built = BuiltRun::<f32>::new(&scenario, 7).expect("a safe state");
        let mut header = from_scenario::header(&scenario, &built.servo, Source::Loop, "emulated", "test");
        header.extra.push((PRESENT_CODE.to_owned(), ran.present.to_string()));
        let mut log = LogWriter::create(&file, &header).expect("a file");
        ran.records.iter().for_each(|r| log.write(r).expect("room for it"));
        log.finish().expect("room for it");
        let log = clutch_log::read(&file, &Limits::default()).expect("a log");
        let replayed = replay(&log, &scenario, UNWATCHED).expect("its own scenario");
        assert_eq!(replayed.first, None, "{law}");
        assert!(replayed.commands.len() > 10_000, "{law}: {} ticks", replayed.commands.len());
    }
}

/// Runs the command.
fn clutch(args: &[&str]) -> Output {
    Command::new(command()).args(args).stdin(Stdio::null()).output().expect("the command starts")
}

/// Its output.
fn shown(done: &Output) -> String {
    String::from_utf8_lossy(&done.stdout).into_owned() + &String::from_utf8_lossy(&done.stderr)
}

fn scratch(name: &str) -> PathBuf {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("hil");
    std::fs::create_dir_all(&folder).expect("a folder");
    let file = folder.join(name);
    let _ = std::fs::remove_file(&file); // of a test before
    file
}

#[test]
fn what_breaks_the_boards_line_ends_in_the_safe_state_in_time_and_is_named() {
    let Some(image) = image("mps2-controller") else { return };
    let _beside = beside();
    let (mut count, mut wrong) = (0, Vec::new());
    for run in (1..601).map(RunId::from).filter(|run| run.draw().is_outside()) {
        count += 1;
        let (draw, board) = (run.draw(), QemuBoard::start(&image).expect("a board"));
        match draw.run_on(run.seed, board) {
            Ok(report) => wrong.extend(oracle::judge(&draw, &report).map(|what| format!("{run}: {what}"))),
            Err(error) => wrong.push(format!("{run}: {error}")),
        }
    }
    assert!(count > 150, "only {count} runs");
    assert!(wrong.is_empty(), "{} of {count} runs:\n{}", wrong.len(), wrong.join("\n"));
}

/// The last frames of a processor that fails after a number of exchanges of a run, and the end of
/// the emulator.
struct Failing {
    board: Option<QemuBoard>,
    left: u32,
    last: Vec<u8>,
    code: Option<i32>,
}

impl LockstepBoard for &mut Failing {
    fn exchange(&mut self, request: &Exchange<'_>) -> Result<Exchange<'_>, String> {
        self.left = self.left.saturating_sub(1);
        if self.left > 0 {
            let board = self.board.as_mut().ok_or("it has ended")?;
            return board.exchange(request).map_err(|e| e.to_string());
        }
        let mut board = self.board.take().ok_or("it has ended")?;
        self.last = board.fail().map_err(|e| e.to_string())?.daq.to_vec();
        self.code = board.ended().map_err(|e| e.to_string())?;
        Err("its processor has failed, as ordered".to_owned())
    }
}

#[test]
fn a_processor_that_fails_sends_encoder_and_converter_to_the_safe_state() {
    let Some(image) = image("mps2-controller") else { return };
    let _beside = beside();
    let scenario = on_paper("smc", 1);
    let built = BuiltRun::<f32>::new(&scenario, 7).expect("a safe state");
    let mut failing = Failing {
        board: Some(QemuBoard::start(&image).expect("a board")),
        left: 1500,
        last: Vec::new(),
        code: None,
    };
    let station: LockstepHost<_, _> =
        lockstep_host(&scenario, &built, &mut failing, u64::MAX).expect("a board can run it");
    let path = from_scenario::path::<f32>(&scenario).expect("a path");
    let params = VirtualOptions { duration: 5.0, ..VirtualOptions::default() };
    let ended =
        VirtualLoop::new(&scenario, params, station).expect("a rig").run(&path).expect_err("it fails");
    assert!(ended.to_string().contains("as ordered"), "{ended}");
    let mut decoder = Decoder::new();
    let said: Vec<Message> =
        failing.last.iter().filter_map(|b| decoder.push(*b)).collect::<Result<_, _>>().expect("whole frames");
    let stop = clutch_wire::Stop { run: 7, reason: StopReason::Fault as u8 };
    assert_eq!(said, [Message::Stop(stop)], "the last frame of a processor that fails while it drives");
    assert_eq!(failing.code, Some(101), "the emulator's exit code after a hard fault");
}

#[test]
fn a_processor_that_fails_at_rest_says_nothing() {
    let Some(image) = image("mps2-controller") else { return };
    let _beside = beside();
    let mut board = QemuBoard::start(&image).expect("a board");
    assert!(board.fail().expect("an answer").daq.is_empty());
    assert_eq!(board.ended().expect("it ends"), Some(101));
}

#[test]
fn without_its_image_the_board_says_how_to_build_one() {
    let Err(error) = QemuBoard::start(std::path::Path::new("no/such/image")) else {
        panic!("there is an image")
    };
    assert!(error.to_string().contains("cargo xtask firmware build"), "{error}");
}
