//! Lanes by the instructions of another processor: 64-bit Arm, emulated.

use crate::debian;
use crate::run::{cargo, program};
use anyhow::{Result, ensure};

/// Linked statically, by what comes with the compiler: no library of that machine is needed.
const TARGET: &str = "aarch64-unknown-linux-musl";

/// Runs the tests of lanes with NEON: each run of a sweep has the bits of its run alone there, too.
pub(crate) fn run() -> Result<()> {
    debian::need(&[("qemu-aarch64", "qemu-user")])?;
    program("rustup").args(["target", "add", TARGET]).run()?;
    let tests = ["test", "--locked", "--package", "clutch-sim", "--lib", "--target", TARGET];
    let held = cargo(tests)
        .args(["--target-dir", "target/arm64", "lanes::tests"])
        .env("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_LINKER", "rust-lld")
        .env("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_RUNNER", "qemu-aarch64")
        .lines(|_| ())?;
    ensure!(held, "lanes differ from runs alone with NEON: see above");
    Ok(())
}
