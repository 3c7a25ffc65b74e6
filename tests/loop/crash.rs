//! The loop's process is killed: the board saves itself, and the log is saved.

use crate::harness::{Board, Done, Random, alone, clutch, folder, read_log, run, start, unless_held_up};
use clutch_log::{Header, Record, SampleRecord};
use clutch_loop::log_thread::LogThread;
use rustix::process::Signal;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Three cycles of a millisecond.
const WATCHDOG_S: f64 = 3e-3;
/// The part of the log that a crash may cost.
const LOST_S: f64 = 0.1;

fn ended_by_itself(done: &Done) -> String {
    let last = done.out.lines().last().unwrap_or_default();
    format!("the run ended by itself, {:?}: {last}", done.code)
}

#[test]
fn after_kill_9_at_twenty_random_instants_the_board_is_safe_and_the_log_is_recovered() {
    kills(20, 1.2, &folder("crash"), |_| {});
}

/// A disk whose sync takes 1.5 s: in front of the C library's `fdatasync`.
const SLOW_SYNC: &str = r#"
#include <time.h>
int fdatasync(int file) {
    (void)file;
    struct timespec slow = {1, 500000000};
    nanosleep(&slow, 0);
    return 0;
}
"#;

/// `CLUTCH_KILLS=30` for the figure in docs/log.md.
#[test]
fn after_kill_9_beside_a_slow_disk_as_little_is_lost() {
    let folder = folder("crash-slow");
    let (source, slow) = (folder.join("slow.c"), folder.join("slow.so"));
    std::fs::write(&source, SLOW_SYNC).unwrap();
    let mut compile = Command::new("cc");
    let compiled = compile.args(["-shared", "-fPIC", "-o"]).args([&slow, &source]).status();
    if !compiled.is_ok_and(|status| status.success()) {
        println!("skipped: there is no C compiler");
        return;
    }
    // It is there: a log of a simulation waits for the disk at its beginning and at its end.
    let log = folder.join("sim.mcap");
    let mut sim = clutch(&["sim", "pd_2", "--log", log.to_str().unwrap()]);
    let begin = Instant::now();
    let _ = sim.env("LD_PRELOAD", &slow);
    let _ = start(sim).done().expect(0);
    assert!(begin.elapsed() > Duration::from_secs(3), "{:?}", begin.elapsed());
    let count = std::env::var("CLUTCH_KILLS").map_or(5, |n| n.parse().expect("a number"));
    // Beyond the first sync that runs beside the loop.
    kills(count, 2.2, &folder, |controller| {
        let _ = controller.env("LD_PRELOAD", &slow);
    });
}

/// Kills the loop at random instants up to `latest`, s; `prepare` changes how its process is started.
fn kills(count: usize, latest: f64, folder: &Path, prepare: impl Fn(&mut Command)) {
    let _alone = alone();
    let (log, saved) = (folder.join("run.mcap"), folder.join("saved.mcap"));
    let seed = 0x5eed_0009;
    let mut random = Random(seed);
    // In real time, as on hardware; one board for all, since a board outlives its controllers. TCP,
    // as the kernel hands a pseudo-terminal's bytes over in a thread that a busy machine holds up.
    let board = Board::start(&["board_smc_2", "--listen", "tcp://127.0.0.1:0"]);
    let (mut missing, mut noticed) = (Vec::new(), Vec::new());
    for i in 0..count {
        let after = random.between(0.2, latest);
        let what = format!("kill {i} of seed {seed:#x}, {after:.6} s after the first code");
        let (lost, reached) = unless_held_up(&what, || {
            let from = board.heard();
            // The loop's own checks are not the subject, and must not end it before the kill.
            let patience = ["--set", "safety.limits.late=120", "--set", "safety.limits.silence_cycles=50"];
            let _ = std::fs::remove_file(&log); // of an attempt that the machine spoiled
            let args = ["loop", "board_smc_2", "--port", &board.port, "--log", log.to_str().unwrap()];
            let mut controller = clutch(&[&args[..], &patience].concat());
            prepare(&mut controller);
            let mut controller = start(controller);
            // A controller that is gone before the board runs was held up in its first cycles.
            let running = loop {
                if !controller.is_running() {
                    let done = controller.done();
                    return Err(ended_by_itself(&done));
                }
                let lines = board.text();
                if lines.lines().skip(from).any(|line| line.ends_with("Running")) {
                    break board.wait_for(from, "Running");
                }
                std::thread::sleep(Duration::from_micros(500));
            };
            let due = running.seen + Duration::from_secs_f64(after);
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            let alive = controller.is_running();
            let killed = Instant::now();
            if alive {
                controller.signal(Signal::KILL);
            }
            let done = controller.done();
            if !alive || done.code.is_some() {
                return Err(ended_by_itself(&done));
            }
            let safe = board.wait_for(from, "Faulted");
            let silent = board.wait_for(from, "after the last code").text;
            let _ = board.wait_for(from, "client left");
            let silent: f64 = silent.split_whitespace().next().and_then(|ms| ms.parse().ok()).expect("ms");
            // The board faulted before the kill: the machine held the controller up. One that faults as a code comes, which
            // was late, did not hear silence either, though its line may have come after the kill.
            let reached = safe.seen.saturating_duration_since(killed);
            if safe.seen < killed || silent == 0.0 {
                return Err("the board had faulted before the kill".to_owned());
            }
            // By the board's clock: time from the last code to the safe output.
            assert!(
                silent <= WATCHDOG_S * 1e3 + 0.001 && silent > 0.0,
                "{what}: the board took {silent} ms after the last code"
            );

            let cut = read_log(&log);
            assert!(!cut.complete, "{what}: a log that was cut must not look finished");
            let _ = std::fs::remove_file(&saved);
            let told = run(&["log", "recover", log.to_str().unwrap(), saved.to_str().unwrap()]).expect(0);
            let recovered = read_log(&saved);
            assert!(recovered.complete, "{what}: {:?} {}", recovered.tail, told.out);
            assert_eq!(recovered.samples, cut.samples, "{what}");
            assert_eq!(recovered.commands, cut.commands, "{what}");
            run(&["log", "info", saved.to_str().unwrap()]).expect(0).prints(&["recovered: original"]);
            run(&["replay", saved.to_str().unwrap()]).expect(0).prints(&["identical over "]);

            // The board's clock stands in both: in the samples of the log, and in the board's
            // output.
            let last = recovered
                .samples
                .last()
                .map_or_else(|| (running.time() * 1e6) as u32, |sample| sample.board_time_us);
            let last_code = ((safe.time() - silent * 1e-3) * 1e6) as u64 as u32;
            let lost = f64::from(last_code.wrapping_sub(last) as i32) * 1e-6;
            Ok((lost, reached))
        });
        missing.push(lost);
        noticed.push(reached);
    }
    missing.sort_by(f64::total_cmp);
    noticed.sort();
    let (middle, most) = (count / 2, missing[count - 1]);
    println!("missing of the log, s: median {:.4}, most {most:.4}, of {count}", missing[middle]);
    println!(
        "wall time from kill to the board's report: median {:?}, most {:?}",
        noticed[middle],
        noticed[count - 1]
    );
    assert!(most <= LOST_S, "seed {seed:#x}: {most} s of the log are missing: {missing:?}");
    assert!(noticed[middle] < Duration::from_millis(200), "{noticed:?}");
    let said = board.end();
    assert!(said.matches("Faulted").count() >= count, "{said}");
}

/// The highest cost of a crash, at each chunk of a log that is written in real time: the time of
/// the newest record less that of the newest in the file, just before the file grows.
#[test]
fn less_waits_for_the_file_than_a_crash_may_cost() {
    let _alone = alone();
    let log = folder("waiting").join("run.mcap");
    let (thread, mut ring) = LogThread::start(&log, &Header::default(), Arc::default()).unwrap();
    let begin = Instant::now();
    let (mut size, mut saved_ns, mut worst) = (0, 0, Vec::new());
    for tick in 0..2_000 {
        let due = begin + Duration::from_millis(tick);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        let grown = std::fs::metadata(&log).unwrap().len();
        if grown > size {
            let newest = read_log(&log).samples.last().map_or(0, |sample| sample.time_ns);
            if newest > saved_ns {
                worst.push((tick * 1_000_000 - saved_ns) as f64 * 1e-9);
            }
            (size, saved_ns) = (grown, newest);
        }
        let sample = SampleRecord { tick, time_ns: tick * 1_000_000, ..SampleRecord::default() };
        ring.push(Record::Sample(sample)).expect("the ring has room");
    }
    drop(ring);
    let _ = thread.finish().unwrap();
    // The median: a busy machine may hold the log's thread up now and then.
    worst.sort_by(f64::total_cmp);
    println!("waiting for the file, s, before each of {} chunks: {worst:.3?}", worst.len());
    let median = worst[worst.len() / 2];
    assert!(worst.len() >= 10 && median <= 0.9 * LOST_S, "{median} s: {worst:?}");
}
