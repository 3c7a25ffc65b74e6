//! Broken boards and lines, over a real pseudo-terminal: the loop ends in the safe state and names
//! the cause. The campaign in virtual time has the numbers; this shows that the real line behaves
//! the same.

use crate::harness::{Board, alone, folder, read_log, replays_identically, run, unless_held_up};

const FAST: &str = "reference.ramp.rate_deg_s=20";

/// A fault, the causes that fit it with words that name them, and the latest tick at which control
/// may end: the fault comes at tick 500.
fn ends_with(name: &str, fault: &str, causes: &[(&str, &str)], latest: u64) {
    let _alone = alone();
    let log = folder(&format!("fault-{name}")).join("run.mcap");
    let path = log.to_str().unwrap();
    let (report, code) = unless_held_up(name, || {
        let board = Board::start(&["board_smc_2", "--set", FAST, "--fault", fault]);
        let args = [
            "loop",
            "board_smc_2",
            "--set",
            FAST,
            "--set",
            "run.settle_s=0",
            "--duration",
            "2",
            "--port",
            &board.port,
            "--log",
            path,
            "--json",
        ];
        let _ = std::fs::remove_file(path); // of an attempt that the machine spoiled
        let done = run(&args);
        let report = done.json();
        let ticks = report["ticks"].as_u64().expect("a number");
        if ticks < 490 {
            return Err(format!("it ended at tick {ticks}, before the fault: {}", report["cause_text"]));
        }
        let _ = board.end();
        let cause = report["cause"].as_str().unwrap_or_default();
        let held_up = ["Late", "Lost", "Deadline", "Silence"].contains(&cause);
        if held_up && causes.iter().all(|(name, _)| *name != cause) {
            return Err(format!("it ended at tick {ticks}: {}", report["cause_text"]));
        }
        Ok((report, done.code))
    });
    println!("{fault}: {} at tick {}", report["cause_text"], report["ticks"]);
    assert_eq!(code, Some(3), "{report:#}");
    assert_eq!(report["state"], "Faulted", "{report:#}");
    let (cause, text) = (report["cause"].as_str().unwrap(), report["cause_text"].as_str().unwrap());
    assert!(
        causes.iter().any(|(name, words)| *name == cause && text.contains(words)),
        "{fault}: {cause}, \"{text}\"; expected one of {causes:?}"
    );
    assert!(report["ticks"].as_u64().unwrap() <= latest, "{fault}: {report:#}");

    let read = read_log(&log);
    assert!(read.complete, "{:?}", read.tail);
    let number = clutch_log::names::CAUSES.iter().find(|(_, name)| *name == cause).unwrap().0;
    assert!(read.events.iter().any(|event| event.cause == number), "{:?}", read.events);
    // No command leaves the converter's range.
    assert!(read.commands.iter().all(|c| c.code < 4096 && (0.0..=10.0).contains(&c.voltage)));
    replays_identically(&log);
}

#[test]
fn a_frozen_encoder_is_found() {
    let causes = [("StandStill", "encoder frozen"), ("FollowingError", "following error")];
    ends_with("freeze", "freeze:at=0.5", &causes, 511);
}

#[test]
fn a_silent_line_is_found() {
    ends_with("silence", "silence:at=0.5", &[("Silence", "fell silent")], 503);
}

#[test]
fn a_board_that_was_reset_is_found() {
    ends_with("reset", "reset:at=0.5", &[("Silence", "fell silent")], 503);
}

#[test]
fn a_line_that_corrupts_every_frame_is_found() {
    ends_with("corrupt", "corrupt:p=1,at=0.5", &[("Silence", "fell silent")], 503);
}

#[test]
fn a_converter_that_lets_go_is_found() {
    let causes = [("TooFast", "ahead of the fastest shaft"), ("Jump", "jumped")];
    ends_with("dac-stuck", "dac-stuck:at=0.5,volts=0", &causes, 600);
}
