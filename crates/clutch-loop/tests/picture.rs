//! A picture of a log: the stretch that it shows closely, against the run that wrote it; and work on logs that its caller ends.

use clutch_log::{Limits, Log, LogError};
use clutch_loop::picture::pictured;
use clutch_loop::replay::{ReplayError, drift, replay};
use clutch_loop::to_log::{SaveError, save_simulation};
use clutch_sim::picture::{Around, Stick, sticks};
use clutch_sim::progress::UNWATCHED;
use clutch_sim::{Keep, Run, Scenario};
use std::cell::Cell;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

fn saved(name: &str, test: &str) -> (Scenario, Run, Log, PathBuf) {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("picture_{test}"));
    std::fs::create_dir_all(&folder).expect("a folder");
    let file = folder.join("run.mcap");
    let scenario = Scenario::load(Path::new(name), &[]).expect("it is built in");
    let run = scenario.run(Keep::Trace, UNWATCHED).expect("it runs");
    save_simulation(&file, &scenario, &run, "test", None, UNWATCHED).expect("it is written");
    let log = clutch_log::read(&file, &Limits::default()).expect("a log");
    (scenario, run, log, folder)
}

#[test]
fn a_simulations_log_shows_the_sticks_of_the_run() {
    let (scenario, run, log, _) = saved("bench_pd_2", "sticks");
    let shown = pictured(&log, &scenario).expect("a log of the scenario");
    // Those sticks of the run that a sample fell into, to a period.
    let of_run: Vec<Stick> = sticks(&run.events, 5.0);
    let seen = |s: &&Stick| {
        run.trace.time.iter().zip(&run.trace.stuck).any(|(t, stuck)| *stuck && (s.from..=s.to).contains(t))
    };
    let of_run: Vec<&Stick> = of_run.iter().filter(seen).collect();
    assert_eq!(shown.sticks.len(), of_run.len());
    for (a, b) in shown.sticks.iter().zip(of_run) {
        assert!((a.from - b.from).abs() <= 1.001e-3 && (a.to - b.to).abs() <= 1.001e-3, "{a:?} {b:?}");
    }
    let window = shown.window.expect("the law answered");
    let Around::Stick(stick) = window.around else { panic!("{window:?}") };
    assert!(shown.sticks.contains(&stick) && window.from <= stick.from && stick.to <= window.to);
    assert!(window.to - window.from < 0.5, "{window:?}");
}

#[test]
fn without_the_shafts_own_motion_silences_of_the_encoder_count() {
    let (scenario, _, mut log, _) = saved("bench_pd_2", "silences");
    let truly = pictured(&log, &scenario).expect("a log of the scenario").sticks;
    log.truths.clear();
    let shown = pictured(&log, &scenario).expect("a log of the scenario");
    let begins_in = |s: &Stick| truly.iter().any(|t| t.from <= s.from && s.from <= t.to + 0.01);
    assert!(shown.sticks.len() > 50 && shown.sticks.iter().all(begins_in), "{}", shown.sticks.len());
    assert!(shown.window.is_some());
}

#[test]
fn a_log_in_which_no_law_answered_has_no_window() {
    let (scenario, _, mut log, _) = saved("pd_2", "gap");
    log.commands.clear();
    let shown = pictured(&log, &scenario).expect("a log of the scenario");
    assert_eq!(shown.window, None);
}

#[test]
fn work_on_a_log_ends_when_its_caller_says_so_and_half_a_log_is_not_kept() {
    let (scenario, run, log, folder) = saved("smc_2", "drawn");
    // The second question, in the middle of the work, is answered with no.
    let asked = AtomicU32::new(0);
    let second = |_| match asked.fetch_add(1, Ordering::Relaxed) {
        0 => ControlFlow::Continue(()),
        _ => ControlFlow::Break(()),
    };
    let part = folder.join("part.mcap");
    let ended = save_simulation(&part, &scenario, &run, "test", None, &second);
    assert!(matches!(ended, Err(SaveError::Stopped)), "{ended:?}");
    assert!(!part.exists());
    asked.store(0, Ordering::Relaxed);
    assert!(matches!(replay(&log, &scenario, &second), Err(ReplayError::Stopped)));
    asked.store(0, Ordering::Relaxed);
    assert!(matches!(drift(&log, &scenario, &second), Err(ReplayError::Stopped)));
    let asked = Cell::new(0);
    let read = clutch_log::read_while(folder.join("run.mcap"), &Limits::default(), || {
        asked.set(asked.get() + 1);
        if asked.get() < 2 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    assert!(matches!(read, Err(LogError::Stopped { .. })) && asked.get() == 2);
}
