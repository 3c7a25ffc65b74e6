//! The fault campaign on all cores. Prints the table of `docs/safety.md`, and a line for each run that failed, in its minimal
//! form; fails if there is one.
//!
//! `cargo run --release -p clutch-loop --example campaign -- RUNS [SEED [FILE]]` makes runs from a seed on; with a file it
//! goes on where it was ended. `… -- only RUN…` makes single runs, by name, and reports on them; `… -- until RUNS` makes so
//! many, and ends with the first that fails. `… -- row LAW TROUBLE RUNS [SEED]` makes those runs alone that have this law and
//! this trouble, named as in the table, and that have to end: those that came nearest to their promise.

use clutch_core::supervisor::Checks;
use clutch_loop::campaign::oracle::{Fate, Promise};
use clutch_loop::campaign::table::Table;
use clutch_loop::campaign::{RunId, oracle};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

type Failure = Result<(), Box<dyn std::error::Error>>;

/// Runs of a chunk; a campaign that is ended loses those of one chunk on each core.
const CHUNK: u64 = 500;

fn main() -> Failure {
    let args: Vec<String> = std::env::args().skip(1).collect();
    if let [verb, runs @ ..] = &args[..]
        && verb == "only"
    {
        return only(runs);
    }
    if let [verb, runs] = &args[..]
        && verb == "until"
    {
        return until(runs.parse()?);
    }
    if let [verb, law, trouble, runs, rest @ ..] = &args[..]
        && verb == "row"
    {
        let first = rest.first().map_or(Ok(1), |seed| seed.parse())?;
        return row(law, trouble, runs.parse()?, first);
    }
    let number = |i: usize, otherwise| args.get(i).map_or(Ok(otherwise), |s: &String| s.parse::<u64>());
    let (runs, first) = (number(0, 10_000)?, number(1, 1)?);
    let file = args.get(2).map(PathBuf::from);
    let mut so_far = Progress { next: first, ..Progress::default() };
    if let Some(text) = file.as_ref().and_then(|f| std::fs::read_to_string(f).ok()) {
        so_far = Progress::read(&text).ok_or("the file is none of a campaign that was ended")?;
        eprintln!("goes on at seed {}", so_far.next);
    }
    let cores = std::thread::available_parallelism()?.get() as u64;
    while so_far.next < first + runs {
        let end = (so_far.next + CHUNK * cores).min(first + runs);
        so_far.advance(end, cores);
        if let Some(file) = &file {
            so_far.write(file)?;
        }
    }
    let Progress { table, failed, .. } = so_far;
    print!("{table}");
    for run in &failed {
        let minimal = run.minimal(|run| outcome(run).is_some());
        println!("{minimal}: {}", outcome(&minimal).unwrap_or_default());
    }
    eprintln!("seeds {first} to {}: {} runs, {} failures", first + runs - 1, table.runs(), failed.len());
    if failed.is_empty() { Ok(()) } else { Err("the campaign failed".into()) }
}

/// The fault of a run, if it has one.
fn outcome(run: &RunId) -> Option<String> {
    let draw = run.draw();
    match draw.run(run.seed, Checks::ALL, false) {
        Ok(report) => oracle::judge(&draw, &report),
        Err(error) => Some(error.to_string()),
    }
}

fn until(runs: u64) -> Failure {
    let wrong = |seed| {
        let run = RunId::from(seed);
        outcome(&run).map(|what| (run, what))
    };
    match (1..=runs).find_map(wrong) {
        None => Ok(()),
        Some((run, what)) => {
            println!("{run}: {what}");
            Err("the campaign failed".into())
        }
    }
}

/// Runs of one law with one trouble that has to end them, from a seed on.
fn row(law: &str, trouble: &str, runs: usize, first: u64) -> Failure {
    const SHOWN: usize = 5;
    let (mut shown, mut failures, mut seed) = (Vec::new(), 0, first);
    while shown.len() < runs {
        let run = RunId::from(seed);
        let draw = run.draw();
        seed += 1;
        if seed - first == 10_000_000 && shown.is_empty() {
            return Err(format!("no run of ten million has to end by \"{trouble}\" under {law}").into());
        }
        let [only] = &draw.troubles[..] else { continue };
        if draw.healthy.law != law || only.kind() != trouble {
            continue;
        }
        let Fate::Ends(within) = Promise::of(&draw.healthy, only).fate else { continue };
        let report = draw.run(run.seed, Checks::ALL, false)?;
        if let Some(wrong) = oracle::judge(&draw, &report) {
            failures += 1;
            println!("{run}: {wrong}");
        }
        // As the oracle has it: from the draw's instant, not from the first frame that it hits.
        let after = report.safe.map_or(f64::INFINITY, |safe| safe - only.at);
        shown.push((1e3 * after, 1e3 * within, run));
    }
    println!("{} of the seeds {first} to {}: {failures} failures", shown.len(), seed - 1);
    println!("the nearest to their promises:");
    shown.sort_by(|a, b| (a.1 - a.0).total_cmp(&(b.1 - b.0)));
    for (after, within, run) in shown.iter().take(SHOWN) {
        println!("  {after:.2} of {within:.2} ms: {run}: {:?}", run.draw().healthy);
    }
    if failures == 0 { Ok(()) } else { Err("the campaign failed".into()) }
}

fn only(runs: &[String]) -> Failure {
    let mut failures = 0;
    for name in runs {
        let run: RunId = name.parse()?;
        let draw = run.draw();
        let report = draw.run(run.seed, Checks::ALL, false)?;
        println!("{run}: {:?}", draw.healthy);
        for trouble in &draw.troubles {
            println!("  {trouble:?}: {:?}", Promise::of(&draw.healthy, trouble));
        }
        println!(
            "  {:?} hit {:?} tripped {:?} safe {:?} board {:?} error {:.3}° beyond {:.3}° (allowed {:?}) unanswered {} kick {:.2} V",
            report.cause,
            report.hit,
            report.tripped,
            report.safe,
            report.board,
            report.largest_error.to_degrees(),
            report.overrun.to_degrees(),
            oracle::beyond_deg(&draw.healthy, 0.01),
            report.unanswered,
            report.kick,
        );
        let wrong = oracle::judge(&draw, &report);
        failures += u32::from(wrong.is_some());
        println!("  {}", wrong.unwrap_or_else(|| "as promised".to_owned()));
    }
    if failures == 0 { Ok(()) } else { Err("the campaign failed".into()) }
}

/// A campaign on its way.
#[derive(Default)]
struct Progress {
    next: u64,
    table: Table,
    failed: Vec<RunId>,
}

impl Progress {
    /// Makes the runs up to a seed, a share of them on each core.
    fn advance(&mut self, end: u64, cores: u64) {
        let share = (end - self.next).div_ceil(cores);
        let from = self.next;
        let parts = std::thread::scope(|scope| {
            let part = |core: u64| {
                let seeds = (from + core * share).min(end)..(from + (core + 1) * share).min(end);
                scope.spawn(move || made(seeds))
            };
            let threads: Vec<_> = (0..cores).map(part).collect();
            threads.into_iter().map(std::thread::ScopedJoinHandle::join).collect::<Vec<_>>()
        });
        for (table, failed) in parts.into_iter().flatten() {
            self.table.merge(&table);
            self.failed.extend(failed);
        }
        self.next = end;
    }

    fn write(&self, file: &Path) -> Failure {
        let failed: Vec<String> = self.failed.iter().map(ToString::to_string).collect();
        let mut text = String::new();
        writeln!(text, "{} {}", self.next, failed.join(" "))?;
        text += &self.table.written();
        let beside = file.with_extension("new");
        std::fs::write(&beside, text)?;
        Ok(std::fs::rename(beside, file)?)
    }

    fn read(text: &str) -> Option<Progress> {
        let (head, table) = text.split_once('\n')?;
        let mut words = head.split_whitespace();
        let next = words.next()?.parse().ok()?;
        let failed = words.map(|w| w.parse().ok()).collect::<Option<_>>()?;
        Some(Progress { next, table: Table::read(table)?, failed })
    }
}

fn made(seeds: std::ops::Range<u64>) -> (Table, Vec<RunId>) {
    let (mut table, mut failed) = (Table::default(), Vec::new());
    for seed in seeds {
        let run = RunId::from(seed);
        let draw = run.draw();
        match draw.run(seed, Checks::ALL, false) {
            Ok(report) => {
                table.add(&draw, &report);
                if oracle::judge(&draw, &report).is_some() {
                    failed.push(run);
                }
            }
            Err(_) => failed.push(run),
        }
    }
    (table, failed)
}
