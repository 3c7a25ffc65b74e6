//! The loop's process is killed: the board saves itself, and the log is saved.

use crate::harness::{Board, Random, alone, clutch, folder, read_log, run, start, unless_held_up};
use rustix::process::Signal;
use std::time::{Duration, Instant};

/// Three cycles of a millisecond.
const WATCHDOG_S: f64 = 3e-3;
/// What a crash may cost of the log.
const LOST_S: f64 = 0.1;

#[test]
fn after_kill_9_at_twenty_random_instants_the_board_is_safe_and_the_log_is_recovered() {
    let _alone = alone();
    let folder = folder("crash");
    let (log, saved) = (folder.join("run.mcap"), folder.join("saved.mcap"));
    let seed = 0x5eed_0009;
    let mut random = Random(seed);
    // In real time, as on hardware; one board for all, since a board outlives its controllers.
    let board = Board::start(&["board_smc_2"]);
    let (mut missing, mut noticed) = (Vec::new(), Vec::new());
    for i in 0..20 {
        let after = random.between(0.2, 1.2);
        let what = format!("kill {i} of seed {seed:#x}, {after:.6} s after the first code");
        let (lost, reached) = unless_held_up(&what, || {
            let from = board.heard();
            let mut controller = start(clutch(&[
                "loop",
                "board_smc_2",
                "--port",
                &board.port,
                "--log",
                log.to_str().unwrap(),
            ]));
            // A controller that is gone before the board runs was held up in its first cycles.
            let running = loop {
                if !controller.is_running() {
                    let done = controller.done();
                    return Err(format!("the run ended by itself: {:?}\n{}", done.code, done.out));
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
                return Err(format!("the run ended by itself: {:?}\n{}", done.code, done.out));
            }
            let safe = board.wait_for(from, "Faulted");
            let silent = board.wait_for(from, "after the last code").text;
            let _ = board.wait_for(from, "client left");
            let silent: f64 = silent.split_whitespace().next().and_then(|ms| ms.parse().ok()).expect("ms");
            // By the board's clock: time from the last code to the safe output.
            assert!(
                silent <= WATCHDOG_S * 1e3 + 0.001 && silent > 0.0,
                "{what}: the board took {silent} ms after the last code"
            );
            // The board faulted before it was killed: the machine held the controller up.
            let reached = safe.seen.saturating_duration_since(killed);
            if safe.seen < killed {
                return Err("the watchdog had gone off before the kill".to_owned());
            }

            let cut = read_log(&log);
            assert!(!cut.complete, "{what}: a log that was cut must not look finished");
            let _ = std::fs::remove_file(&saved);
            let told = run(&["log", "recover", log.to_str().unwrap(), saved.to_str().unwrap()]).expect(0);
            let recovered = read_log(&saved);
            assert!(recovered.complete, "{what}: {:?} {}", recovered.end, told.out);
            assert_eq!(recovered.samples, cut.samples, "{what}");
            assert_eq!(recovered.commands, cut.commands, "{what}");
            run(&["log", "info", saved.to_str().unwrap()]).expect(0).prints(&["recovered: original"]);
            run(&["replay", saved.to_str().unwrap()]).expect(0).prints(&["identical over "]);

            // The board's clock stands in both: in the samples of the log, and in what the board says.
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
    println!("missing of the log, s: median {:.4}, most {:.4}", missing[10], missing[19]);
    println!("wall time from kill to the board's word: median {:?}, most {:?}", noticed[10], noticed[19]);
    assert!(missing[19] <= LOST_S, "seed {seed:#x}: {} s of the log are missing: {missing:?}", missing[19]);
    assert!(noticed[10] < Duration::from_millis(200), "{noticed:?}");
    let said = board.end();
    assert!(said.matches("Faulted").count() >= 20, "{said}");
}
