//! Tests in Miri, which sees what memory and numbers must not do: docs/proof.md.

use crate::proof::add_row;
use crate::run::program;
use anyhow::{Result, ensure};

/// Tests that run in Miri.
struct Part {
    /// Their name in the table.
    name: &'static str,
    /// The machine that they run as, by the compiler's word, and its processor.
    machine: (&'static str, Option<&'static str>),
    /// Which tests, by options of cargo, and by those of the tests' program.
    tests: &'static [&'static str],
    only: &'static [&'static str],
}

/// A machine of the other byte order, for what has no `unsafe`.
const BIG_ENDIAN: (&str, Option<&str>) = ("s390x-unknown-linux-gnu", None);
/// This one, for what has it; and as its processor may be.
const THIS: (&str, Option<&str>) = ("x86_64-unknown-linux-gnu", None);
const WITH_AVX2: (&str, Option<&str>) = (THIS.0, Some("x86-64-v3"));

const PARTS: [Part; 6] = [
    Part {
        name: "`clutch-wire`",
        machine: BIG_ENDIAN,
        tests: &["--package=clutch-wire", "--lib"],
        only: LONG,
    },
    Part {
        name: "`clutch-core`",
        machine: BIG_ENDIAN,
        tests: &["--package=clutch-core", "--lib"],
        only: LONG,
    },
    Part { name: "lanes of `clutch-sim`", machine: THIS, tests: SIM, only: LANES },
    Part { name: "lanes of `clutch-sim`", machine: WITH_AVX2, tests: SIM, only: LANES },
    Part {
        name: "`clutch-c`",
        machine: THIS,
        // The second package has the feature, the first names no libm.
        tests: &["--package=clutch-tests", "--package=clutch-sim", "--test=clutch_c", SOFT],
        only: &["axis::", "misuse::"],
    },
    Part { name: "`clutch-fmi`", machine: THIS, tests: &["--package=clutch-fmi", "--lib"], only: &[] },
];

const SIM: &[&str] = &["--package=clutch-sim", "--lib", SOFT];

/// Without it a square root is an instruction, which Miri does not know.
const SOFT: &str = "--features=libm/force-soft-floats";

/// Tests that take millions of steps are left out, by a part of their names: Miri is some hundred times slower than a
/// machine.
const LONG: &[&str] = &[
    "--skip=feasibility",
    "--skip=observer",
    "--skip=reference",
    "--skip=real::",
    "--skip=stick_slip",
    "--skip=supervisor",
    "--skip=any_",
    "--skip=no_flip",
];

/// Those that do little in an interpreter.
const LANES: &[&str] = &[
    "lane::scalar",
    "lanes::tests::elementary",
    "lanes::tests::a_few_periods",
    "lanes::tests::a_motion_that_stops",
];

/// Runs each part whose name has a text in it, and adds a row for it to the table.
pub(crate) fn run(part: &str) -> Result<()> {
    let add = ["component", "add", "miri", "rust-src", "--toolchain", "nightly"];
    program("rustup").args(add).run()?;
    ensure!(
        PARTS.iter().any(|p| p.name.contains(part)),
        "miri {part}: expected a part of {}",
        PARTS.map(|p| p.name).join(", ")
    );
    for Part { name, machine: (machine, processor), tests, only } in
        PARTS.into_iter().filter(|p| p.name.contains(part))
    {
        let (mut passed, mut left_out) = (0_u64, 0_u64);
        let folder = format!("target/miri/{}", processor.unwrap_or(machine));
        let flags = processor.map(|processor| format!("-Ctarget-cpu={processor}")).unwrap_or_default();
        let held = program("rustup")
            .args(["run", "nightly", "cargo", "miri", "test", "--target", machine, "--target-dir"])
            .arg(folder)
            .args(tests)
            .arg("--")
            .args(only)
            .env("RUSTFLAGS", flags)
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
        let on = processor.map_or(String::new(), |processor| format!(", {processor}"));
        add_row("miri", &format!("| {name} | {machine}{on} | {passed} passed, {left_out} left out |"))?;
    }
    Ok(())
}
