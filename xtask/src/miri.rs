//! Tests in Miri, which sees what memory and numbers must not do: docs/proof.md.

use crate::proof::add_row;
use crate::run::program;
use anyhow::{Result, ensure};

/// A machine of the other byte order.
const BIG_ENDIAN: &str = "s390x-unknown-linux-gnu";

/// Tests that take millions of steps, by a part of their names: Miri is some hundred times slower than a machine.
const LONG: [&str; 8] =
    ["feasibility", "observer", "reference", "real::", "stick_slip", "supervisor", "any_", "no_flip"];

/// Runs the unit tests of core and wire as on a machine of the other byte order, but for the long ones, and adds a row for
/// each to the table.
pub(crate) fn run() -> Result<()> {
    let add = ["component", "add", "miri", "rust-src", "--toolchain", "nightly"];
    program("rustup").args(add).run()?;
    for package in ["clutch-wire", "clutch-core"] {
        let (mut passed, mut left_out) = (0_u64, 0_u64);
        let held = program("rustup")
            .args(["run", "nightly", "cargo", "miri", "test", "--lib", "--target", BIG_ENDIAN])
            .args(["--target-dir", "target/miri", "--package", package, "--"])
            .args(LONG.iter().flat_map(|long| ["--skip", long]))
            .env("MIRIFLAGS", "-Zmiri-disable-isolation")
            .env("PROPTEST_CASES", "4")
            .env("PROPTEST_DISABLE_FAILURE_PERSISTENCE", "1")
            .lines(|line| {
                let number = |unit: &str| -> Option<u64> {
                    line.split(';')
                        .find_map(|l| l.trim().strip_suffix(unit))?
                        .rsplit(' ')
                        .next()?
                        .parse()
                        .ok()
                };
                passed += number(" passed").unwrap_or(0);
                left_out += number(" filtered out").unwrap_or(0);
            })?;
        ensure!(held, "Miri found something: see above");
        add_row("miri", &format!("| `{package}` | {BIG_ENDIAN} | {passed} passed, {left_out} left out |"))?;
    }
    Ok(())
}
