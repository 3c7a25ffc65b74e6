//! All tests; the time of each stage and the number of tests at the end.

mod tally;

use crate::debian;
use crate::firmware;
use crate::fmu;
use crate::fuzz;
use crate::libclutch;
use crate::panic_path;
use crate::playground::{self, Playground};
use crate::python;
use crate::run::{Program, beside, cargo, program, root};
use crate::stubs;
use anyhow::{Result, bail};
use std::path::{Path, PathBuf};
use tally::Tally;

/// Targets for which the core must compile: a core without atomics, one with a floating-point unit,
/// and RISC-V.
const TARGETS: [&str; 3] = ["thumbv6m-none-eabi", "thumbv7em-none-eabihf", "riscv32imac-unknown-none-elf"];

/// Checks that need the targets: two builds of the core, one of the nodes and one of the parts of boards each, the four
/// link tests, the libraries with their control, the example, two boards, the other emulator, the budgets.
const SKIPPED_WITHOUT_TARGETS: u64 =
    4 * TARGETS.len() as u64 + libclutch::TARGETS.len() as u64 + 2 * firmware::BOARDS.len() as u64 + 8;

/// The packages that are built for this machine, the command with all its options. Always the same selection: with another
/// one cargo gives libraries other features, and compiles them once more. The wheel's module, which only links inside of
/// Python, is among them, so that the wheel finds most packages of others compiled; it has no test, and no `--lib` may ask
/// for it.
const WORKSPACE: [&str; 3] =
    ["--workspace", "--features", "clutch-cli/foxglove,clutch-cli/parquet,clutch-cli/scope"];

/// The targets tested: all that say so in their manifest. Examples that no test runs are left to `check`, which compiles them,
/// too, and does not link each with the whole house.
const TESTS: &str = "--tests";

/// Runs everything, counts, and fails at the end if anything failed; `more` are options of what runs beside it, [`boards`].
pub(crate) fn all(more: &[&str]) -> Result<()> {
    let mut tally = Tally::new();
    // Downloads come while processors build.
    let (built, tools) = std::thread::scope(|scope| {
        let needs = scope.spawn(needs);
        let built = build(&mut tally)?;
        tally.stage("what tests need, beside their build");
        let tools = needs.join().unwrap_or_else(|_| bail!("what tests need could not be had: see above"))?;
        anyhow::Ok((built, tools))
    })?;
    // Mostly builds, which link for long on one core, beside tests that wait. Those with a clock hold on a loaded machine.
    let boards = beside("boards", more)?;
    // Before the tests: it takes packages of others from their build, in the same folder, which has one build at a time.
    tally.stage("build of the wheel");
    let wheel = python::Wheel::install(&tools);
    let host = if built { host(&mut tally) } else { Ok(false) };
    let wheel = wheel.and_then(|wheel| wheel_of(&mut tally, &tools, &wheel));
    // Also where something above could not be run: what runs beside it comes to its end.
    tally.stage("boards, beside all that");
    let (ended, text) = boards.output()?;
    print!("{text}");
    tally.add(ended, &text);
    tally.end(host? & wheel?)
}

/// All that runs beside the other tests, alone: the checks for boards, the module of the playground; in CI fuzzing.
pub(crate) fn boards(fuzz: bool) -> Result<()> {
    let mut tally = Tally::new();
    // Tests of the wheel want it; built here, it is there when they come.
    tally.stage("module of the playground");
    playground::module()?;
    boards_of(&mut tally, targets()?)?;
    if fuzz {
        fuzzing(&mut tally)?;
    }
    tally.end(true)
}

/// The Python part alone.
pub(crate) fn wheel() -> Result<()> {
    let mut tally = Tally::new();
    tally.stage("Python packages");
    let tools = python::interpreter()?;
    tally.stage("build of the wheel");
    let wheel = python::Wheel::install(&tools)?;
    let sound = wheel_of(&mut tally, &tools, &wheel)?;
    tally.end(sound)
}

/// Builds the playground alone, if its target is there.
pub(crate) fn playground() -> Result<Option<Playground>> {
    cargo(["build"]).args(WORKSPACE).args(["--example", "page"]).run()?;
    let built = playground::build()?;
    built.as_ref().map(playground::sizes).transpose()?;
    Ok(built)
}

/// Runs the tests of a playground alone, with the command that [`compared`] builds.
pub(crate) fn of_playground(built: &Playground) -> Result<()> {
    compared()?;
    let pytest = ["-m", "pytest", "-q", "-p", "no:cacheprovider"];
    let tests = program(python::interpreter()?).args(pytest);
    let tests = tests.arg(root().join("python/tests/test_playground.py"));
    tried(tests, built).env("CLUTCH_BIN", command()).run()
}

/// Tests that are told of a playground.
fn tried(tests: Program, built: &Playground) -> Program {
    tests
        .env("CLUTCH_PLAYGROUND", &built.page)
        .env("CLUTCH_PLAYGROUND_MODULE", &built.module)
        .env("CLUTCH_PLAYGROUND_HERE", example("ask"))
}

/// Programs, targets and packages of Python that tests need; the interpreter that has the packages.
fn needs() -> Result<PathBuf> {
    if std::env::var_os("CI").is_some() {
        programs()?;
    }
    targets()?;
    python::interpreter()
}

/// Installs the programs without which tests skip themselves on a user's machine.
fn programs() -> Result<()> {
    // The program, and the Debian package that has it.
    let needed = [
        ("gcc", "gcc"),
        ("g++", "g++"),
        ("make", "make"),
        ("strace", "strace"),
        ("qemu-system-arm", "qemu-system-arm"),
        ("qemu-aarch64", "qemu-user"),
        ("arm-none-eabi-gcc", "gcc-arm-none-eabi"),
        ("arm-none-eabi-g++", "gcc-arm-none-eabi"),
        ("node", "nodejs"),
        ("chromium", "chromium"),
    ];
    debian::need(&needed)?;
    // The C library of boards, which the compiler only recommends: asked for by a file of it.
    let library = program("arm-none-eabi-gcc").args(["-print-file-name=rdimon.specs"]).silently();
    if !library.is_ok_and(|(_, path)| Path::new(path.trim()).is_absolute()) {
        debian::install(&["libnewlib-arm-none-eabi"])?;
    }
    linuxcnc()
}

/// The folder with LinuxCNC's files, unpacked and not installed: its hundred dependencies are for its windows.
fn linuxcnc_folder() -> PathBuf {
    root().join("target/linuxcnc")
}

/// Fetches and unpacks LinuxCNC's package for developers, with the parser that its tool needs.
fn linuxcnc() -> Result<()> {
    let folder = linuxcnc_folder();
    if folder.join("usr/bin/halcompile").exists() {
        return Ok(());
    }
    std::fs::create_dir_all(&folder)?;
    let packages = ["linuxcnc-uspace-dev", "python3-yapps"];
    let fetch = || program("apt-get").args(["download", "-q"]).args(packages).within(&folder);
    if !fetch().lines(|_| ())? {
        program("apt-get").args(["update", "-q"]).run()?;
        fetch().run()?;
    }
    for entry in std::fs::read_dir(&folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|ending| ending == "deb") {
            program("dpkg").arg("-x").arg(&path).arg(&folder).run()?;
        }
    }
    Ok(())
}

/// Adds the embedded targets, and that of another 64-bit processor. Without rustup they are skipped on a user's machine,
/// not in CI.
pub(crate) fn targets() -> Result<&'static [&'static str]> {
    match program("rustup").args(["target", "add", "aarch64-unknown-linux-musl"]).args(TARGETS).quietly() {
        Ok((true, _)) => Ok(&TARGETS),
        other if std::env::var_os("CI").is_none() => {
            let why = other.map_or_else(|e| e.to_string(), |(_, text)| text);
            println!("skipped: builds for embedded targets, because rustup cannot add them: {}", why.trim());
            Ok(&[])
        }
        other => bail!("rustup cannot add the targets {TARGETS:?}: {other:?}"),
    }
}

/// Builds the tests that run on this machine; true if they build.
fn build(tally: &mut Tally) -> Result<bool> {
    tally.stage("build of the tests");
    compared()?;
    let built = cargo(["test"]).args(WORKSPACE).arg(TESTS).arg("--no-run").lines(|_| ())?;
    tally.check("the tests build", built);
    Ok(built)
}

/// The tests that run on this machine, an emulated board included.
fn host(tally: &mut Tally) -> Result<bool> {
    tally.stage("tests");
    let tests = ["test", "--no-fail-fast"];
    // Some run the command: the one that was built with them. And some a model of a chip, in Python.
    let tested = cargo(tests).args(WORKSPACE).arg(TESTS).env("CLUTCH_BIN", command());
    let tested = tested.env("CLUTCH_PYTHON", python::interpreter()?);
    let unpacked = linuxcnc_folder();
    let tested = if unpacked.exists() { tested.env("CLUTCH_LINUXCNC", unpacked) } else { tested };
    let sound = tested.lines(|l| tally.read(l))?;
    tally.stage("examples in docstrings");
    let sound = sound & cargo(tests).args(WORKSPACE).arg("--doc").lines(|l| tally.read(l))?;
    tally.stage("tests of the core as firmware takes it");
    // Without the features that the workspace turns on.
    let core = ["--package", "clutch-core", "--lib"];
    Ok(sound & cargo(tests).args(core).lines(|l| tally.read(l))?)
}

/// The examples that the tests of the wheel run beside it.
const EXAMPLES: [&str; 6] = ["write_demo", "bits", "intervals", "ask", "page", "describe"];

/// Builds what the wheel is compared with, and the command that tests run: with few optimisations, as the tests.
/// The wheel, with more of them, must give the same bits.
fn compared() -> Result<()> {
    let mut programs = vec!["--bin", "clutch"];
    EXAMPLES.iter().for_each(|name| programs.extend(["--example", name]));
    cargo(["build"]).args(WORKSPACE).args(programs).run()
}

/// An example as [`compared`] builds it.
fn example(name: &str) -> PathBuf {
    root().join("target/debug/examples").join(name)
}

/// The command as [`compared`] builds it.
fn command() -> PathBuf {
    root().join("target/debug/clutch")
}

/// The checks for boards: builds for embedded targets, link tests, images, budgets.
fn boards_of(tally: &mut Tally, embedded: &[&str]) -> Result<()> {
    if embedded.is_empty() {
        tally.skip(SKIPPED_WITHOUT_TARGETS);
        return Ok(());
    }
    tally.stage("builds of the core for boards");
    // A folder of their own, or they would wait while the wheel is built.
    let folder = ["build", "--release", "--target-dir", "target/embedded"];
    let part = |package: &str, args: &[&str]| cargo(folder).args(["--package", package]).args(args).quietly();
    let core = |args: &[&str]| part("clutch-core", args);
    for target in embedded {
        for features in ["", "linalg,defmt"] {
            let with = if features.is_empty() { "no feature" } else { "linalg and defmt" };
            let built = core(&["--target", target, "--features", features])?;
            tally.check_quiet(&format!("clutch-core builds for {target} with {with}"), built);
        }
        // With what clutch-wire, clutch-settings and clutch-node have for it.
        let built = part("clutch-hal", &["--target", target, "--features", "defmt"])?;
        tally.check_quiet(&format!("clutch-hal builds for {target} with defmt"), built);
    }
    no_panic(tally)?;
    libraries(tally)?;
    let example = core(&["--target", firmware::TARGET, "--example", "own_friction"])?;
    tally.check_quiet("the example with friction numbers of one's own builds for a Cortex-M4F", example);
    tally.stage("images");
    for board in firmware::BOARDS {
        let (built, text) = firmware::image(board).quietly()?;
        let text = if built { text } else { text + &firmware::panicking(board, None)? };
        tally.check_quiet(&format!("the images of {} build", board.0), (built, text));
        let small = firmware::image(board).args(SMALL).args(["--target-dir", "../target/firmware_small"]);
        tally.check_quiet(&format!("they build at opt-level s ({})", board.0), small.quietly()?);
    }
    let same = "pico-controller gives the codes on rp2040js that it gives on the model of its chip";
    if firmware::fetch_rp2040js() {
        tally.check_quiet(same, firmware::on_rp2040js(&command())?);
    } else {
        println!("skipped: {same}, because npm cannot fetch it");
        tally.skip(1);
    }
    tally.stage("budgets");
    // As a test, not as a benchmark: the figures are the machine code's, not this machine's.
    let mut said = String::new();
    let budget = cargo(["test"]).args(WORKSPACE).args(["--bench", "budget"]);
    let budget = budget.env("CLUTCH_PYTHON", python::interpreter()?);
    let kept = budget.lines(|line| said.extend([line, "\n"]))?;
    tally.check_seen("bounds, measurements, memory and stack keep their budgets", (kept, said));
    Ok(())
}

/// Builds for size.
const SMALL: [&str; 2] = ["--config", "profile.release.opt-level=\"s\""];

/// The core links without a reachable panic, at both levels that firmware is built at; with one put in it does not, and the
/// function that has it is named.
fn no_panic(tally: &mut Tally) -> Result<()> {
    let image = |verb: &str, args: &[&str]| {
        let manifest =
            ["--release", "--manifest-path", "tests/no_panic/Cargo.toml", "--target", firmware::TARGET];
        cargo([verb]).args(manifest).args(["--target-dir", NO_PANIC]).args(args)
    };
    for (level, args) in [("3", &[][..]), ("s", &SMALL[..])] {
        let (links, text) = image("build", args).quietly()?;
        let text = if links { text } else { text + &panicking(image("build", args))? };
        tally.check_quiet(
            &format!("no panic is reachable in clutch-core at opt-level {level} (link test)"),
            (links, text),
        );
    }
    let with_one = ["--features", "control"];
    let (links, text) = image("build", &with_one).quietly()?;
    let refused = !links && text.contains("__panic_path_survived");
    tally.check("the link test sees a panic that is put in (control)", refused);
    if panic_path::has_objdump() || std::env::var_os("CI").is_some() {
        let named = panicking(image("build", &with_one))?;
        let (one, place) = ("no_panic::control", "tests/no_panic/src/main.rs");
        let told = named.lines().any(|line| line.contains(one) && line.contains(place));
        tally.check_seen(
            "the function with a panic that is put in is named, with its line (control)",
            (told, named),
        );
    } else {
        println!(
            "skipped: the name of a function with a panic: {}",
            panic_path::no_objdump().unwrap_or_default()
        );
        tally.skip(1);
    }
    Ok(())
}

/// The folder of the link test's builds.
const NO_PANIC: &str = "target/no_panic";

/// The places of the link test's image that call for a panic: the image is linked all the same, and read.
fn panicking(image: Program) -> Result<String> {
    if let Some(why) = panic_path::no_objdump() {
        return Ok(why);
    }
    let (built, text) = panic_path::in_spite(image, firmware::TARGET).silently()?;
    let linked = root().join(NO_PANIC).join(firmware::TARGET).join("release/no-panic");
    if !built {
        return Ok(text);
    }
    let seen = panic_path::of_image(&linked)?;
    Ok(seen.unwrap_or_else(|| "no call for a panic is seen in the machine code".to_owned()))
}

/// The libraries for C, and the check that no panic can be reached in them.
fn libraries(tally: &mut Tally) -> Result<()> {
    if libclutch::add(&libclutch::TARGETS).is_err() && std::env::var_os("CI").is_none() {
        println!("skipped: libclutch, because rustup cannot add its targets");
        tally.skip(libclutch::TARGETS.len() as u64 + 1);
        return Ok(());
    }
    for target in libclutch::TARGETS {
        let (holds, text) = match libclutch::built(target) {
            Ok(path) => (true, path.display().to_string()),
            Err(why) => (false, why.to_string()),
        };
        tally.check_quiet(
            &format!("libclutch builds for {target}, without a panic that can be reached"),
            (holds, text),
        );
    }
    let (seen, named) = libclutch::sees_a_panic(firmware::TARGET)?;
    let named_it = named.contains("clutch_control") || panic_path::no_objdump().is_some();
    tally.check_quiet(
        "a panic that is put into libclutch is seen, and its function is named (control)",
        (seen && named_it, named),
    );
    Ok(())
}

/// The defects for which fuzzing beside the tests is watched; `cargo xtask fuzz` watches the memory, too.
const WATCHED: fuzz::Watched = fuzz::Watched::Panics;

/// Each reader of bytes from outside.
fn fuzzing(tally: &mut Tally) -> Result<()> {
    tally.stage("build of the fuzz targets");
    fuzz::install()?;
    fuzz::build(WATCHED)?;
    tally.stage("fuzzing");
    for (target, runs) in fuzz::TARGETS {
        let held = fuzz::one(target, WATCHED, &[], &[&format!("-runs={runs}"), "-seed=1", "-verbosity=0"])?;
        tally.check(&format!("fuzzing {target} with {runs} inputs finds nothing"), held);
    }
    Ok(())
}

/// Files of the wheel's tests that take a minute and more: they come first, or the last of them runs alone at the end.
const LONGEST: [&str; 8] = [
    "test_docs_python.py",
    "test_start.py",
    "test_model.py",
    "test_commands.py",
    "test_plot.py",
    "test_examples.py",
    "test_referee.py",
    "test_types.py",
];

/// The wheel, built from its source distribution and installed outside of this tree, tested there.
fn wheel_of(tally: &mut Tally, tools: &Path, wheel: &python::Wheel) -> Result<bool> {
    tally.stage("types of the wheel");
    tally.check("the type stub is what the native module gives", stubs::hold(tools, wheel)?);
    tally.stage("what the wheel is compared with");
    compared()?;
    let bits = root().join("target/bits");
    program(example("bits")).arg(&bits).run()?;
    let units = fmu::of_built(None, "debug")?;
    tally.stage("build of the playground");
    let playground = playground::build()?;
    tally.stage("tests of the wheel");
    // One more than there are processors: most wait for a process or a clock now and then, and files differ in length.
    let pytest =
        ["-m", "pytest", "--color=no", "-q", "-n", "3", "--dist", "loadfile", "--no-loadscope-reorder"];
    let slowest = ["--durations=10", "--durations-min=5"];
    let folder = root().join("python/tests");
    let tests = wheel.program(tools)?.args(pytest).args(slowest);
    let tests = tests.args(LONGEST.map(|file| folder.join(file))).arg(folder);
    let tests = match &playground {
        Some(built) => tried(tests, built),
        None => tests,
    };
    tests
        .env("CLUTCH_BIN", command())
        .env("CLUTCH_LOG_DEMO", example("write_demo"))
        .env("CLUTCH_BITS", bits)
        .env("CLUTCH_FMU", units)
        .env("CLUTCH_INTERVALS", example("intervals"))
        .lines(|l| tally.read(l))
}
