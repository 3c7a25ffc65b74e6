//! Fuzzing, with cargo-fuzz.

use crate::proof::{add_row, grouped};
use crate::run::{Program, program, root};
use anyhow::{Result, bail};
use std::time::Instant;

/// Targets in `fuzz/fuzz_targets`, each with the number of inputs that CI tries, those of the corpus among them: as many
/// as took 20 s at most with the memory watched.
pub(crate) const TARGETS: [(&str, u32); 4] =
    [("decoder", 700_000), ("log", 110_000), ("request", 200_000), ("board_controller", 7000)];

/// The defects for which a fuzzed target is watched.
#[derive(Clone, Copy)]
pub(crate) enum Watched {
    /// Panics, and each access of memory, by the address sanitizer.
    Memory,
    /// Panics alone, which takes less time and is what CI does: what is fuzzed has no unsafe code but that of its libraries.
    Panics,
}

impl Watched {
    /// The sanitizer, as cargo-fuzz has its name.
    fn sanitizer(self) -> &'static str {
        match self {
            Watched::Memory => "address",
            Watched::Panics => "none",
        }
    }

    /// In the table of docs/proof.md.
    fn name(self) -> &'static str {
        match self {
            Watched::Memory => "panics, memory",
            Watched::Panics => "panics",
        }
    }
}

/// Fuzzes every target, or only one, for `seconds` each; or for so many executions, reported in docs/proof.md.
pub(crate) fn all(watched: Watched, seconds: u32, executions: Option<u64>, only: Option<&str>) -> Result<()> {
    install()?;
    for (target, _) in TARGETS.iter().filter(|(t, _)| only.is_none_or(|o| o == *t)) {
        match executions {
            None if one(target, watched, &[&format!("-max_total_time={seconds}")])? => {}
            Some(executions) => counted(target, watched, executions)?,
            None => bail!("fuzzing {target} found something: see above"),
        }
    }
    Ok(())
}

/// Fuzzes one target in steps, so that a run that is ended early has reported what it did.
fn counted(target: &str, watched: Watched, executions: u64) -> Result<()> {
    const STEP: u64 = 10_000_000;
    let (begun, mut done) = (Instant::now(), 0);
    let mut held = true;
    while held && done < executions {
        let step = STEP.min(executions - done);
        held = one(target, watched, &[&format!("-runs={step}")])?;
        done += step;
        println!("{target}: {done} executions, {} s", begun.elapsed().as_secs());
    }
    let corpus = std::fs::read_dir(root().join("target/corpus").join(target))?.count();
    let found = if held { "nothing" } else { "an input: see target/" };
    let seconds = begun.elapsed().as_secs();
    let watched = watched.name();
    let row = format!(
        "| `{target}` | {watched} | {} | {seconds} s | {corpus} | {found} |",
        grouped(&done.to_string())
    );
    add_row("fuzz", &row)?;
    if held { Ok(()) } else { bail!("fuzzing {target} found something: see above") }
}

/// Fuzzes one target until `end`, options of libFuzzer; true if it held.
pub(crate) fn one(target: &str, watched: Watched, end: &[&str]) -> Result<bool> {
    // The first of its two folders is what libFuzzer fills; the one in the tree is only read.
    let (found, seeds) = (format!("target/corpus/{target}"), format!("fuzz/corpus/{target}"));
    std::fs::create_dir_all(root().join(&found))?;
    // A target need not have any.
    let seeds = root().join(&seeds).is_dir().then_some(seeds);
    cargo_fuzz(&["run", "--sanitizer", watched.sanitizer(), target, &found])
        .args(seeds)
        .arg("--")
        .args(end)
        .args(["-print_final_stats=1"])
        .lines(|_| ())
}

/// Builds every target.
pub(crate) fn build(watched: Watched) -> Result<()> {
    cargo_fuzz(&["build", "--sanitizer", watched.sanitizer()]).run()
}

fn cargo_fuzz(args: &[&str]) -> Program {
    program("rustup").args(["run", "nightly", "cargo", "fuzz"]).args(args)
}

/// Adds the nightly compiler and cargo-fuzz where they are missing.
pub(crate) fn install() -> Result<()> {
    let arguments = ["toolchain", "install", "nightly", "--profile", "minimal", "--no-self-update"];
    let has = |words: &[&str]| program("rustup").args(words).quietly().is_ok_and(|(ok, _)| ok);
    if !has(&["run", "nightly", "rustc", "--version"]) {
        program("rustup").args(arguments).run()?;
    }
    if !has(&["run", "nightly", "cargo", "fuzz", "--version"]) {
        program("cargo").args(["install", "cargo-fuzz", "--locked", "--version", "0.13.2"]).run()?;
    }
    Ok(())
}
