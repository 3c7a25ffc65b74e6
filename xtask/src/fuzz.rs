//! Fuzzing, with cargo-fuzz.

use crate::run::program;
use anyhow::{Result, bail};

/// Targets in `fuzz/fuzz_targets`.
pub(crate) const TARGETS: [&str; 3] = ["decoder", "log", "board_controller"];

/// Fuzzes every target for `seconds` each.
pub(crate) fn all(seconds: u32) -> Result<()> {
    install()?;
    for target in TARGETS {
        if !one(target, seconds)? {
            bail!("fuzzing {target} found something: see above");
        }
    }
    Ok(())
}

/// Fuzzes one target; true if it held.
pub(crate) fn one(target: &str, seconds: u32) -> Result<bool> {
    let time = format!("-max_total_time={seconds}");
    // Sanitizers do not work with a static C library.
    let arguments = ["run", "nightly", "cargo", "fuzz", "run", target, "--", &time, "-print_final_stats=1"];
    program("rustup").args(arguments).lines(|_| ())
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
