//! Runs that end before their time.

use crate::harness::{Board, Running, alone, clutch, folder, read_log, replays_identically, run, start};
use rustix::process::Signal;
use std::path::{Path, PathBuf};
use std::time::Duration;

fn logged(name: &str) -> PathBuf {
    folder(name).join("run.mcap")
}

/// A loop with a log on a board, 0.3 s after control began.
fn runs_for_a_while(board: &Board, log: &Path) -> Running {
    let log = log.to_str().unwrap();
    let arguments = ["loop", "board_smc_2", "--patient", "--port", &board.port, "--log", log];
    let running = start(clutch(&arguments));
    let _ = board.wait_for(0, "Running");
    std::thread::sleep(Duration::from_millis(300));
    running
}

fn a_signal_ends_in_the_safe_state(name: &str, signal: Signal) {
    let _alone = alone();
    let log = logged(name);
    let board = Board::start(&["board_smc_2", "--patient"]);
    let running = runs_for_a_while(&board, &log);
    running.signal(signal);
    let _ = running.done().expect(4).prints(&[
        "stopped by the operator",
        "the board is in its safe state",
        "clutch replay ",
    ]);
    let _ = board.wait_for(0, "Stopped");
    let read = read_log(&log);
    assert!(read.complete, "{:?}", read.tail);
    let operator = clutch_log::names::CAUSES.iter().find(|(_, name)| *name == "Operator").unwrap().0;
    assert!(read.events.iter().any(|event| event.cause == operator), "{:?}", read.events);
    replays_identically(&log);
    assert!(!board.end().contains("Faulted"));
}

#[test]
fn sigterm_ends_in_the_safe_state_with_a_whole_log() {
    a_signal_ends_in_the_safe_state("sigterm", Signal::TERM);
}

#[test]
fn ctrl_c_ends_in_the_safe_state_with_a_whole_log() {
    a_signal_ends_in_the_safe_state("sigint", Signal::INT);
}

fn an_unplugged_port_is_told(name: &str, listen: &[&str]) {
    let _alone = alone();
    let log = logged(name);
    let mut board = Board::start(&[&["board_smc_2", "--patient"], listen].concat());
    let running = runs_for_a_while(&board, &log);
    board.kill();
    let _ = running.done().expect(3).prints(&[
        &board.port,
        "unplugged, or the board's program has ended",
        "check cable and power, start the board, then start again",
        "the board did not confirm its safe state; its watchdog takes it there",
    ]);
    let read = read_log(&log);
    assert!(read.complete, "{:?}", read.tail);
    let lost = clutch_log::EventKind::PortLost as u8;
    assert!(read.events.iter().any(|event| event.kind == lost), "{:?}", read.events);
    replays_identically(&log);
}

#[test]
fn a_pseudo_terminal_that_goes_away_is_told_as_unplugged() {
    an_unplugged_port_is_told("unplugged-pty", &[]);
}

#[test]
fn a_tcp_connection_that_goes_away_is_told_as_unplugged() {
    an_unplugged_port_is_told("unplugged-tcp", &["--listen", "tcp://127.0.0.1:0"]);
}

#[test]
fn every_stall_of_the_loop_is_counted_and_harmless() {
    const STALLS: u64 = 10;
    let _alone = alone();
    // A strict board; limits so loose that a stall of 15 ms ends nothing.
    let limits = [
        "--set=safety.limits.silence_cycles=100",
        "--set=safety.limits.watchdog_cycles=100",
        "--set=safety.limits.valid_cycles=60",
        "--set=safety.limits.late=128",
        "--set=safety.limits.overruns=128",
        "--set=safety.limits.following_error_deg=20",
    ];
    let board = Board::start(&[&["board_smc_2"], &limits[..]].concat());
    let arguments = ["loop", "board_smc_2", "--port", &board.port, "--duration", "4", "--json"];
    let running = start(clutch(&[&arguments[..], &limits[..]].concat()));
    let _ = board.wait_for(0, "Running");
    for _ in 0..STALLS {
        std::thread::sleep(Duration::from_millis(120));
        running.signal(Signal::STOP);
        std::thread::sleep(Duration::from_millis(15));
        running.signal(Signal::CONT);
    }
    let done = running.done().expect(0);
    let misses = done.json()["deadline_misses"].as_u64().unwrap();
    // The machine's own stalls are counted, too.
    assert!(misses >= STALLS, "{misses} misses counted for {STALLS} stalls");
}

#[test]
fn a_drift_is_told_on_standard_error_and_ends_the_run_on_request() {
    let _alone = alone();
    let log = logged("drift");
    let log = log.to_str().unwrap();
    let loops = ["loop", "board_smc_2", "--set", "reference.ramp.rate_deg_s=10", "--set", "run.settle_s=0"];
    let drifts = ["--uncertified", "--fault", "dac-scale:at=2,factor=0.85", "--duration", "30"];
    let ends = ["--on-drift", "stop", "--log", log];
    let done = run(&[&loops[..], &drifts, &ends].concat()).expect(4);
    let done = done.says(&["DRIFT at ", "friction over load is 0.8", ", below the bound of 1"]).prints(&[
        "friction over load: 0.8",
        "DRIFT at ",
        "stopped as friction over load left the bounds; the board is in its safe state",
    ]);
    // The same at the time and in the summary, in lines of a terminal.
    assert!(done.err.lines().all(|line| line.chars().count() <= 80), "{}", done.err);
    let told = done.err.find("DRIFT at ").map(|at| done.err[at..].to_owned()).expect("the line");
    let told = told.split_inclusive("the bound of 1").next().expect("its end");
    let _ = done.prints(&[told]);
    let _ = run(&["replay", log]).expect(0).prints(&["identical over ", told]);
    let wide = ["replay", log, "--set", "bounds.friction_percent=40"];
    assert!(!run(&wide).expect(0).prints(&["bounds 0.6 to 1.4"]).out.contains("DRIFT"));
    let _ = run(&["loop", "--on-drift", "perhaps"]).expect(64).says(&["--on-drift", "report, stop"]);
}
