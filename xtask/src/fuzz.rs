//! Fuzzing, with cargo-fuzz.
//!
//! What runs have kept is in `target/corpus`; the tree has, in `fuzz/corpus`, inputs by hand, a folder for each target, and the
//! fewest of the kept ones that reach as much, a file for each: an input a line, in hexadecimal, the shortest first.

use crate::proof::{add_row, grouped};
use crate::run::{Program, program, root};
use anyhow::{Context, Result, bail, ensure};
use std::fmt::Write;
use std::path::{Path, PathBuf};
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

/// Fuzzes every target, or only one, for `seconds` each; or for so many executions, reported in docs/proof.md. No input is
/// above `longest` bytes.
pub(crate) fn all(
    watched: Watched,
    seconds: u32,
    executions: Option<u64>,
    only: Option<&str>,
    longest: Option<u32>,
) -> Result<()> {
    install()?;
    let time = format!("-max_total_time={seconds}");
    for (target, _) in TARGETS.iter().filter(|(t, _)| only.is_none_or(|o| o == *t)) {
        match executions {
            None if one(target, watched, for_long(target), &[&time, &length(longest)])? => {}
            Some(executions) => counted(target, watched, executions, longest)?,
            None => bail!("fuzzing {target} found something: see above"),
        }
    }
    Ok(())
}

/// Fuzzes one target in steps, so that a run that is ended early has reported what it did.
fn counted(target: &str, watched: Watched, executions: u64, longest: Option<u32>) -> Result<()> {
    const STEP: u64 = 10_000_000;
    let (begun, mut done) = (Instant::now(), 0);
    let mut held = true;
    while held && done < executions {
        let step = STEP.min(executions - done);
        held = one(target, watched, for_long(target), &[&format!("-runs={step}"), &length(longest)])?;
        done += step;
        println!("{target}: {done} executions, {} s", begun.elapsed().as_secs());
    }
    let corpus = std::fs::read_dir(root().join("target/corpus").join(target))?.count();
    let found = if held { "nothing" } else { "an input: see target/" };
    let seconds = begun.elapsed().as_secs();
    let watched = match longest {
        Some(bytes) => format!("{}; inputs up to {bytes} bytes", watched.name()),
        None => watched.name().to_string(),
    };
    let row = format!(
        "| `{target}` | {watched} | {} | {seconds} s | {corpus} | {found} |",
        grouped(&done.to_string())
    );
    add_row("fuzz", &row)?;
    if held { Ok(()) } else { bail!("fuzzing {target} found something: see above") }
}

/// The longest input, as an option of libFuzzer, which chooses one itself for 0.
fn length(longest: Option<u32>) -> String {
    format!("-max_len={}", longest.unwrap_or(0))
}

/// How a target is built to run for long. Half of the time of a board would go into reporting what it compares to the fuzzer,
/// most of it each byte of a frame with zero; the target makes frames itself, so that they are found without. CI builds all
/// alike, once.
fn for_long(target: &str) -> &'static [&'static str] {
    if target == "board_controller" { &["--no-trace-compares"] } else { &[] }
}

/// Fuzzes one target, built with options of cargo-fuzz, until `end`, options of libFuzzer; true if it held.
pub(crate) fn one(target: &str, watched: Watched, built: &[&str], end: &[&str]) -> Result<bool> {
    // The first of the folders is what libFuzzer fills; the others are only read.
    let found = format!("target/corpus/{target}");
    std::fs::create_dir_all(root().join(&found))?;
    cargo_fuzz(&["run", "--sanitizer", watched.sanitizer()])
        .args(built)
        .args([target, &found])
        .args(seeds(target)?)
        .arg("--")
        .args(end)
        .args(["-print_final_stats=1"])
        .lines(|_| ())
}

/// The inputs of the tree, as folders: those by hand, which a target need not have, and those that runs have found.
fn seeds(target: &str) -> Result<Vec<String>> {
    let by_hand = format!("fuzz/corpus/{target}");
    let unpacked = format!("target/seeds/{target}");
    // Of a new target no run has kept any.
    if list(target).is_file() {
        unpack(&list(target), &root().join(&unpacked))?;
    }
    Ok([by_hand, unpacked].into_iter().filter(|folder| root().join(folder).is_dir()).collect())
}

/// The file of a target's inputs.
fn list(target: &str) -> PathBuf {
    root().join("fuzz/corpus").join(target).with_extension("hex")
}

/// Puts the fewest of all kept inputs of a target that reach as much as all into its list.
pub(crate) fn keep(only: Option<&str>) -> Result<()> {
    install()?;
    for (target, _) in TARGETS.iter().filter(|(t, _)| only.is_none_or(|o| o == *t)) {
        let fewest = format!("target/fewest/{target}");
        let folder = root().join(&fewest);
        empty(&folder)?;
        let kept = format!("target/corpus/{target}");
        std::fs::create_dir_all(root().join(&kept))?;
        // How often a run passes each place of the code counts, too; of a board, where that would keep five times as many, the
        // place alone.
        let counts = if for_long(target).is_empty() { "-use_counters=1" } else { "-use_counters=0" };
        let held = cargo_fuzz(&["run", "--sanitizer", Watched::Panics.sanitizer()])
            .args(for_long(target))
            .args([*target, &fewest, &kept])
            .args(seeds(target)?)
            .args(["--", "-set_cover_merge=1", counts])
            .lines(|_| ())?;
        ensure!(held, "the inputs of {target} were not merged: see above");
        let inputs = pack(&folder, &list(target))?;
        println!("{target}: {inputs} inputs are in {}", list(target).display());
    }
    Ok(())
}

/// A folder with nothing in it.
fn empty(folder: &Path) -> Result<()> {
    if folder.is_dir() {
        std::fs::remove_dir_all(folder)?;
    }
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())
}

/// Writes the files of a folder as lines of hexadecimal; their number.
fn pack(folder: &Path, list: &Path) -> Result<usize> {
    let mut inputs = std::fs::read_dir(folder)?
        .map(|entry| Ok(std::fs::read(entry?.path())?))
        .collect::<Result<Vec<Vec<u8>>>>()?;
    inputs.sort_by(|a, b| a.len().cmp(&b.len()).then(a.cmp(b)));
    let mut text = String::new();
    // An empty line would be a line of no input.
    for input in inputs.iter().filter(|input| !input.is_empty()) {
        for byte in input {
            write!(text, "{byte:02x}")?;
        }
        text.push('\n');
    }
    std::fs::write(list, &text)?;
    Ok(text.lines().count())
}

/// Writes the inputs of a list as files of a folder, and no other ones.
fn unpack(list: &Path, folder: &Path) -> Result<()> {
    empty(folder)?;
    let text = std::fs::read_to_string(list).with_context(|| list.display().to_string())?;
    for (number, line) in text.lines().enumerate() {
        let bytes = line
            .as_bytes()
            .chunks(2)
            .map(|pair| u8::from_str_radix(std::str::from_utf8(pair)?, 16).map_err(anyhow::Error::from))
            .collect::<Result<Vec<u8>>>()
            .with_context(|| format!("{}, line {}", list.display(), number + 1))?;
        ensure!(line.len() % 2 == 0, "{}, line {}: half a byte", list.display(), number + 1);
        std::fs::write(folder.join(format!("{number:04}")), bytes)?;
    }
    Ok(())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_gives_the_inputs_that_it_was_made_of() {
        let folder = std::env::temp_dir().join(format!("clutch-fuzz-list-{}", std::process::id()));
        let (from, list, to) = (folder.join("from"), folder.join("list.hex"), folder.join("to"));
        empty(&from).unwrap();
        for (name, bytes) in [("a", &b"\x00\xff\n"[..]), ("b", b"\x07"), ("c", b"")] {
            std::fs::write(from.join(name), bytes).unwrap();
        }
        assert_eq!(pack(&from, &list).unwrap(), 2);
        unpack(&list, &to).unwrap();
        assert_eq!(std::fs::read(to.join("0000")).unwrap(), b"\x07");
        assert_eq!(std::fs::read(to.join("0001")).unwrap(), b"\x00\xff\n");
        assert_eq!(std::fs::read_dir(&to).unwrap().count(), 2);
        std::fs::write(&list, "07\n0\n").unwrap();
        let error = unpack(&list, &to).unwrap_err().to_string();
        assert!(error.ends_with("line 2: half a byte"), "{error}");
        std::fs::remove_dir_all(&folder).unwrap();
    }

    /// So every target begins with inputs that runs have found.
    #[test]
    fn every_target_has_inputs_in_the_tree() {
        for (target, _) in TARGETS {
            let text = std::fs::read_to_string(list(target)).unwrap();
            assert!(text.lines().count() > 20, "{target}");
            assert!(text.lines().all(|line| line.len() >= 2), "{target}");
        }
    }
}
