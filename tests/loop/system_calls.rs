//! The control thread's system calls while it runs, as strace sees them.

use crate::harness::{alone, folder, program, start};
use clutch_wire::{Decoder, Message};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// The system calls of the control thread in order: name, and what strace says behind it.
fn control_thread(trace: &Path) -> Vec<(String, String)> {
    let text = std::fs::read_to_string(trace).unwrap();
    // strace writes strings in hexadecimal.
    let name: String = b"clutch-control".iter().map(|byte| format!("\\x{byte:02x}")).collect();
    let named = |line: &&str| line.contains("PR_SET_NAME") && line.contains(&name);
    let thread = text.lines().find(named).expect("the control thread gives itself its name");
    let thread = thread.split_whitespace().next().unwrap().to_owned() + " ";
    let is_name =
        |name: &str| !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
    text.lines()
        .filter(|line| line.starts_with(&thread))
        // thread, time of day, call
        .filter_map(|line| line[thread.len()..].trim_start().split_once(' '))
        .filter_map(|(_, call)| call.split_once('('))
        .filter(|(name, _)| is_name(name))
        .map(|(name, rest)| (name.to_owned(), rest.to_owned()))
        .collect()
}

/// The messages of each write in order.
fn written(calls: &[(String, String)]) -> Vec<Vec<Message>> {
    let bytes = |rest: &str| -> Vec<u8> {
        let quoted = rest.split('"').nth(1).unwrap_or_default();
        quoted.split("\\x").skip(1).map(|hex| u8::from_str_radix(hex, 16).unwrap()).collect()
    };
    let messages = |bytes: Vec<u8>| {
        let mut decoder = Decoder::new();
        bytes.iter().filter_map(|byte| decoder.push(*byte)?.ok()).collect()
    };
    calls.iter().filter(|(name, _)| name == "write").map(|(_, rest)| messages(bytes(rest))).collect()
}

/// The names of a second's calls, without those that begin and end the run.
fn cycles(calls: &[(String, String)]) -> Vec<String> {
    let calls: Vec<&str> = calls.iter().map(|(name, _)| name.as_str()).collect();
    let writes: Vec<usize> =
        calls.iter().enumerate().filter(|(_, name)| **name == "write").map(|(i, _)| i).collect();
    assert!(writes.len() > 900, "{} writes in a second of 1 kHz", writes.len());
    calls[writes[100]..writes[writes.len() - 10]].iter().map(|name| (*name).to_owned()).collect()
}

fn traced(pace: &str) -> Option<Vec<(String, String)>> {
    let works = Command::new("strace").args(["-o", "/dev/null", "true"]).output();
    if !works.is_ok_and(|done| done.status.success()) {
        assert!(
            std::env::var_os("CI").is_none(),
            "strace is missing or may not trace: CI must not skip this"
        );
        println!("skipped: strace is missing, or may not trace");
        return None;
    }
    let trace = folder(&format!("strace-{pace}")).join("trace");
    let mut command = Command::new("strace");
    command.args(["-f", "-tt", "-xx", "-s", "256", "-e", "trace=all", "-o"]).arg(&trace).arg(program());
    command.args(["loop", "board_smc_2", "--duration", "1", "--set", "run.settle_s=0", "--pace", pace]);
    // The tracer makes every call slow: late answers are not the subject.
    command.args(["--set", "safety.limits.overruns=128", "--set", "safety.limits.late=128"]);
    let log = trace.with_file_name("run.mcap");
    command.arg("--log").arg(log);
    // One that looks on costs no call.
    command.arg("--live");
    let _ = start(command).done().expect(0);
    Some(control_thread(&trace))
}

fn count(calls: &[String]) -> BTreeMap<&str, usize> {
    let mut counts = BTreeMap::new();
    for call in calls {
        *counts.entry(call.as_str()).or_insert(0) += 1;
    }
    counts
}

/// The most that happens between two writes of an answer. A ping once a second is one write more.
fn per_cycle(calls: &[String], name: &str) -> usize {
    calls
        .split(|call| call == "write")
        .map(|cycle| cycle.iter().filter(|c| *c == name).count())
        .max()
        .unwrap_or(0)
}

/// Between two writes a board that waits for its answer would take one more sample.
fn the_end_is_written_with_the_last_answer(calls: &[(String, String)]) {
    let writes = written(calls);
    let answers = writes.iter().filter(|w| matches!(w[..], [Message::Actuate(_), ..])).count();
    assert!(answers > 900, "{answers} answers in a second of 1 kHz");
    let end = writes.iter().find(|w| w.iter().any(|m| matches!(m, Message::Stop(_)))).unwrap();
    assert!(matches!(end[..], [Message::Actuate(_), Message::Stop(_)]), "{end:?}");
}

#[test]
fn a_cycle_paced_by_the_sample_is_one_wait_one_read_one_write() {
    let _alone = alone();
    let Some(trace) = traced("sample") else { return };
    the_end_is_written_with_the_last_answer(&trace);
    let calls = cycles(&trace);
    let counts = count(&calls);
    println!("{counts:?}");
    let (reads, writes, waits) = (counts["read"], counts["write"], counts["ppoll"]);
    assert!(counts.keys().all(|name| ["read", "write", "ppoll"].contains(name)), "{counts:?}");
    assert!(reads <= writes + writes / 100 && waits <= writes + writes / 50 + 2, "{counts:?}");
    assert!(per_cycle(&calls, "read") <= 2 && per_cycle(&calls, "ppoll") <= 3, "{counts:?}");
}

#[test]
fn a_cycle_paced_by_the_clock_is_one_sleep_one_read_one_write() {
    let _alone = alone();
    let Some(trace) = traced("clock") else { return };
    the_end_is_written_with_the_last_answer(&trace);
    let calls = cycles(&trace);
    let counts = count(&calls);
    println!("{counts:?}");
    let allowed = ["read", "write", "ppoll", "clock_nanosleep"];
    assert!(counts.keys().all(|name| allowed.contains(name)), "{counts:?}");
    // The two clocks drift: a cycle may find no sample, and then sleeps and reads once more.
    let (reads, sleeps) = (counts["read"], counts["clock_nanosleep"]);
    assert!(sleeps <= reads + 2, "{counts:?}");
    assert!(counts["write"] <= reads + 2, "{counts:?}");
    assert!(counts.get("ppoll").copied().unwrap_or(0) == 0, "{counts:?}");
}
