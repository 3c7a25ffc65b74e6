//! All tests, and their number at the end.

use crate::firmware;
use crate::fuzz;
use crate::python;
use crate::run::{cargo, program, root};
use crate::stubs;
use anyhow::{Result, bail};

/// Targets for which the core must compile: a core without atomics, one with a floating-point unit,
/// and RISC-V.
const TARGETS: [&str; 3] = ["thumbv6m-none-eabi", "thumbv7em-none-eabihf", "riscv32imac-unknown-none-elf"];

/// Checks that need the targets: two builds each, the two link tests, the example, two boards, the budgets.
const SKIPPED_WITHOUT_TARGETS: u64 = 2 * TARGETS.len() as u64 + 6;

#[derive(Default)]
struct Tally {
    passed: u64,
    failed: u64,
    skipped: u64,
    /// The failed tests, by name.
    failures: Vec<String>,
}

impl Tally {
    /// Reads the closing lines of libtest (`test result: ok. 3 passed; 0 failed; …`) and of
    /// pytest (`3 passed, 1 skipped in 2.1s`), and the names of the failed tests
    /// (`test NAME ... FAILED`, `FAILED NAME - why`).
    fn read(&mut self, line: &str) {
        if let Some(name) = line.strip_prefix("test ").and_then(|l| l.strip_suffix(" ... FAILED")) {
            self.failures.push(name.to_owned());
        } else if line.starts_with("FAILED ") || line.starts_with("ERROR ") {
            self.failures.push(line.to_owned());
        }
        let closing = line.starts_with("test result:") || (line.contains(" in ") && line.contains("passed"));
        if !closing {
            return;
        }
        let words: Vec<&str> = line.split([' ', ';', ',', '=']).filter(|w| !w.is_empty()).collect();
        for pair in words.windows(2) {
            let [count, word] = pair else { continue };
            let Ok(count) = count.parse::<u64>() else { continue };
            match *word {
                "passed" => self.passed += count,
                "failed" | "errors" | "error" => self.failed += count,
                "ignored" | "skipped" => self.skipped += count,
                _ => {}
            }
        }
    }

    /// The line that ends a run of tests; an error if any failed.
    fn end(self, sound: bool) -> Result<()> {
        let Tally { passed, failed, skipped, failures } = self;
        let sound = sound && failed == 0;
        println!();
        for name in failures {
            println!("failed: {name}");
        }
        if !sound {
            println!("tests failed; what they said is above");
        }
        println!("{passed} passed, {failed} failed, {skipped} skipped");
        if sound { Ok(()) } else { std::process::exit(1) }
    }

    fn check(&mut self, name: &str, holds: bool) {
        println!("{name}: {}", if holds { "ok" } else { "FAILED" });
        if holds {
            self.passed += 1;
        } else {
            self.failed += 1;
            self.failures.push(name.to_owned());
        }
    }
}

/// Runs everything, counts, and fails at the end if anything failed.
pub(crate) fn all() -> Result<()> {
    let mut tally = Tally::default();
    let mut sound = true;
    // Tests that need a program skip themselves without it, on a user's machine and not in CI.
    if std::env::var_os("CI").is_some() {
        // The program, and the Debian package that has it.
        for (name, package) in [
            ("gcc", "gcc"),
            ("strace", "strace"),
            ("qemu-system-arm", "qemu-system-arm"),
            ("arm-none-eabi-gcc", "gcc-arm-none-eabi"),
        ] {
            if program(name).args(["--version"]).quietly().is_err() {
                python::install_debian(package)?;
            }
        }
    }

    // Before the tests: some build images for an emulated board.
    let embedded = targets()?;
    let mut rust = |args: &[&str]| -> Result<()> {
        sound &= cargo(["test"]).args(args).lines(|l| tally.read(l))?;
        Ok(())
    };
    // The wheel's module only links inside of Python; it is tested there, below.
    rust(&["--workspace", "--exclude", "clutch-py", "--no-fail-fast"])?;
    // The core as firmware takes it, without the features that the workspace turns on.
    rust(&["--package", "clutch-core", "--lib", "--no-fail-fast"])?;

    for target in embedded {
        for features in ["", "linalg"] {
            let build = [
                "build",
                "--release",
                "--package",
                "clutch-core",
                "--target",
                target,
                "--features",
                features,
            ];
            let (built, text) = cargo(build).quietly()?;
            if !built {
                println!("{text}");
            }
            let with = if features.is_empty() { "no feature" } else { features };
            tally.check(&format!("clutch-core builds for {target} with {with}"), built);
        }
    }
    if embedded.is_empty() {
        tally.skipped += SKIPPED_WITHOUT_TARGETS;
    }
    if embedded.contains(&firmware::TARGET) {
        no_panic(&mut tally)?;
        let example = ["build", "--release", "--package", "clutch-core", "--example", "own_friction"];
        let (built, text) = cargo(example).args(["--target", firmware::TARGET]).quietly()?;
        if !built {
            println!("{text}");
        }
        tally.check("the example with friction numbers of one's own builds for a Cortex-M4F", built);
        for board in firmware::BOARDS {
            let (built, text) = firmware::image(board).quietly()?;
            if !built {
                println!("{text}");
            }
            tally.check(&format!("the images of {board} build"), built);
        }
        // As a test, not as a benchmark: the figures are the machine code's, not this machine's.
        // With the packages of the tests above, whose builds serve here, too.
        let budget = cargo(["test", "--workspace", "--exclude", "clutch-py", "--bench", "budget"]);
        tally.check("bounds, measurements, memory and stack keep their budgets", budget.lines(|_| ())?);
    }

    if std::env::var_os("CI").is_some() {
        fuzz::install()?;
        for target in fuzz::TARGETS {
            tally.check(&format!("fuzzing {target} for 20 s finds nothing"), fuzz::one(target, 20)?);
        }
    } else {
        println!(
            "skipped: fuzzing, which needs a nightly compiler; `cargo xtask fuzz` installs it and fuzzes"
        );
        tally.skipped += fuzz::TARGETS.len() as u64;
    }

    sound &= python(&mut tally)?;

    tally.end(sound)
}

/// The Python part alone.
pub(crate) fn wheel() -> Result<()> {
    let mut tally = Tally::default();
    let sound = python(&mut tally)?;
    tally.end(sound)
}

/// Adds the embedded targets. Without rustup they are skipped on a user's machine, not in CI.
pub(crate) fn targets() -> Result<&'static [&'static str]> {
    match program("rustup").args(["target", "add"]).args(TARGETS).quietly() {
        Ok((true, _)) => Ok(&TARGETS),
        other if std::env::var_os("CI").is_none() => {
            let why = other.map_or_else(|e| e.to_string(), |(_, text)| text);
            println!("skipped: builds for embedded targets, because rustup cannot add them: {}", why.trim());
            Ok(&[])
        }
        other => bail!("rustup cannot add the targets {TARGETS:?}: {other:?}"),
    }
}

/// The wheel: built from its source distribution, installed outside of this tree, tested there.
fn python(tally: &mut Tally) -> Result<bool> {
    let binary = python::binary()?;
    cargo(["build", "--package", "clutch-log", "--example", "write_demo"]).run()?;
    let bits = root().join("target/bits");
    cargo(["run", "--package", "clutch-tests", "--example", "bits", "--"]).arg(&bits).run()?;
    let tools = python::interpreter()?;
    tally.check("the type stub is what the native module gives", stubs::generate(&tools, true)?);
    let tool = |name: &str, args: &[&str]| program(python::beside(&tools, name)).args(args).quietly();
    let mut quiet = |name: &str, (holds, text): (bool, String)| {
        if !holds {
            println!("{text}");
        }
        tally.check(name, holds);
    };
    quiet(
        "ruff finds nothing in the Python sources",
        tool("ruff", &[&["check"], &python::SOURCES[..]].concat())?,
    );
    let wheel = python::Wheel::install(&tools)?;
    let settings = root().join("pyproject.toml");
    let settings = settings.to_string_lossy();
    let strict = ["-m", "mypy", "--strict", "--config-file", &settings, "-p", "clutch"];
    quiet(
        "mypy --strict finds nothing in the installed package",
        wheel.program(&tools)?.args(strict).quietly()?,
    );
    let stubtest = ["-m", "mypy.stubtest", "--mypy-config-file", &settings, "clutch._clutch"];
    quiet(
        "the type stub agrees with the module at run time",
        wheel.program(&tools)?.args(stubtest).quietly()?,
    );
    wheel
        .program(&tools)?
        .args(["-m", "pytest", "--color=no", "-q"])
        .arg(root().join("python/tests"))
        .env("CLUTCH_BIN", binary)
        .env("CLUTCH_LOG_DEMO", root().join("target/debug/examples/write_demo"))
        .env("CLUTCH_BITS", bits)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .lines(|l| tally.read(l))
}

/// The core links without a reachable panic; the same with one put in does not.
fn no_panic(tally: &mut Tally) -> Result<()> {
    let image = || {
        cargo(["build", "--release", "--manifest-path", "tests/no_panic/Cargo.toml"]).args([
            "--target",
            "thumbv7em-none-eabihf",
            "--target-dir",
            "target/no_panic",
        ])
    };
    let (links, text) = image().quietly()?;
    if !links {
        println!("{text}");
    }
    tally.check("no panic is reachable in clutch-core (link test)", links);
    let (links, text) = image().args(["--features", "control"]).quietly()?;
    let refused = !links && text.contains("__panic_path_survived");
    tally.check("the link test sees a panic that is put in (control)", refused);
    Ok(())
}
