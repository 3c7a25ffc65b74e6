//! The developer's verbs: `cargo xtask --help`. CI calls the same ones.

mod ablate;
mod copy;
mod coverage;
mod debian;
mod dist;
mod elsewhere;
mod firmware;
mod fmu;
mod fuzz;
mod generate;
mod libclutch;
mod miri;
mod mutants;
mod neon;
mod panic_path;
mod playground;
mod product;
mod proof;
mod python;
mod rehearse;
mod release;
mod run;
mod site;
mod size;
mod stubs;
mod test;
mod touch;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};
use run::{cargo, root};
use std::path::PathBuf;

/// The developer's verbs.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    /// Checks format, lints and documentation, all without a warning; spelling; licences, duplicates and sources of the
    /// dependencies. Installs the tools for it in .venv.
    Check,
    /// Runs all tests. Installs their needs: Rust targets, a private virtual environment in .venv,
    /// for the wheel a second one in the folder for temporary files, and on Debian, as root, the
    /// package that makes such environments.
    Test,
    /// Runs only the tests of the wheel: builds it, installs it outside this tree, tests it there.
    Wheel,
    /// Runs only what the tests run beside the others: what boards take (the core for their targets, link tests, images,
    /// budgets), the playground's module.
    Boards {
        /// Then fuzzes each reader of bytes with a fixed number of inputs, as CI does; installs what `fuzz` does.
        #[arg(long)]
        fuzz: bool,
    },
    /// Runs the steps of CI: check, package, msrv, semver, then test, with fuzzing beside it.
    Ci,
    /// Runs the benchmarks (criterion) with the arguments that follow: `cargo xtask bench -- law`.
    Bench {
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        rest: Vec<String>,
    },
    /// Builds, flashes and measures the boards' images.
    Firmware {
        #[command(subcommand)]
        verb: firmware::Verb,
    },
    /// Builds the static libraries for C, in target/libclutch; adds their Rust targets. In none of them can a panic be reached.
    Libclutch {
        /// Only these targets.
        targets: Vec<String>,
    },
    /// Builds the files of a release, in target/dist, checks and runs them: here, on an emulated 64-bit Arm processor, and on
    /// an emulated Windows. Installs what that needs: packages of Debian as root, Rust targets, Python packages in .venv.
    Dist {
        /// Only these parts.
        parts: Vec<dist::Part>,
    },
    /// Packs rig and law as FMI 3.0 co-simulation units, in target/fmu.
    Fmu {
        /// The scenario within them; smc_2 if none is given.
        scenario: Option<PathBuf>,
    },
    /// Builds the page that simulates in a browser, target/playground/stick-slip.html, and prints its size; adds its Rust target.
    Playground,
    /// Builds the API documentation, in target/doc.
    Docs,
    /// Builds the documentation as a site with gallery and playground, in target/site; builds playground and wheel for it.
    Site,
    /// Packs the libraries that others build on, and checks them as they were packed.
    Package,
    /// Checks what users build with the oldest Rust that the manifests name; installs it.
    Msrv,
    /// Holds the packages' interfaces against those of the last tag v*. Once there is one, installs
    /// cargo-semver-checks: some minutes.
    Semver,
    /// Finds the rig `bench` anew (docs/bench-rig.md): some minutes on two cores.
    Calibrate {
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        rest: Vec<String>,
    },
    /// Fuzzes each reader of bytes from outside for a number of seconds; installs cargo-fuzz and a
    /// nightly compiler.
    Fuzz {
        /// Seconds for each target.
        #[arg(default_value_t = 60)]
        seconds: u32,
        /// Executions for each target instead, in steps of 10 million; adds a row for each to docs/proof.md.
        #[arg(long)]
        executions: Option<u64>,
        /// Only this target.
        #[arg(long)]
        target: Option<String>,
        /// Watches for panics alone, not for each access of memory: some times as fast.
        #[arg(long)]
        panics: bool,
        /// Inputs of this many bytes at most; else libFuzzer chooses, by the longest of the kept ones.
        #[arg(long)]
        longest: Option<u32>,
        /// Fuzzes nothing: writes the fewest of the inputs kept in target/corpus that reach as much as all of them into
        /// fuzz/corpus, from which every run begins.
        #[arg(long)]
        keep: bool,
    },
    /// Measures the coverage of core and wire by the tests of core, wire and node, and holds it against its floors; writes
    /// the table of docs/proof.md. Installs cargo-llvm-cov.
    Coverage,
    /// Proves properties with a model checker and by trying every value, and sees the control of each fail; writes the table
    /// of docs/proof.md. Needs wasm2c; unpacks CBMC of Debian 13 in target where there is none.
    Prove {
        /// Only these.
        names: Vec<String>,
    },
    /// Tests the mutants of one shard of core, wire and node, and adds a row to docs/proof.md. Installs cargo-mutants.
    Mutants {
        /// Shard k of n, from 0/n on.
        #[arg(long, default_value = "0/20")]
        shard: String,
    },
    /// Runs tests in Miri: those of core and wire as on a machine of the other byte order, those of the lanes, of libclutch
    /// and of the FMI units for their unsafe code; adds a row for each to docs/proof.md.
    Miri {
        /// Those alone whose name has this part: wire, core, lanes, clutch-c, fmi.
        #[arg(default_value = "", hide_default_value = true)]
        part: String,
    },
    /// Runs the tests of lanes with NEON, on an emulated 64-bit Arm processor: five minutes.
    Neon,
    /// Runs the fault campaign on all cores, and rewrites its table in docs/safety.md: a million runs, half an hour.
    Campaign {
        /// Runs.
        #[arg(long, default_value_t = 1_000_000)]
        runs: u64,
        /// Seed of the first.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// File in which it keeps how far it is; it goes on from there.
        #[arg(long, value_name = "FILE")]
        resume: Option<PathBuf>,
        /// Only these runs, by the names that a failure has, and reports on them.
        #[arg(long, value_name = "RUN", num_args = 1.., conflicts_with_all = ["runs", "seed", "resume"])]
        only: Vec<String>,
    },
    /// Takes each check out of the code in turn: the campaign has to fail. Rewrites the table in docs/safety.md.
    Ablate {
        /// Runs after which a check counts as not missed.
        #[arg(default_value_t = 20_000)]
        runs: u64,
    },
    /// Runs `clutch loop` against a board in Python that lies and shares no code with it; rewrites the table in
    /// docs/safety.md: some minutes.
    Lies {
        /// Trials.
        #[arg(default_value_t = 2400)]
        trials: u32,
    },
    /// Holds sampled-data certificates against simulations, an hour on two cores: the table of docs/certified.md, and a
    /// campaign over random sets of gains.
    Certified {
        /// Runs of the campaign.
        #[arg(default_value_t = 10_000)]
        runs: u64,
    },
    /// Runs laws on the rig `bench` from 0.5 to 100 °/s, from rest, under a hand and on a motor, and glide on rigs that are not as
    /// it believes, a quarter of an hour: the tables of docs/smooth.md and its figure.
    Smooth,
    /// Holds the meter of stick-slip against the simulator's events, laws, rates and encoders, and on rigs that are not as it
    /// believes, five minutes: the tables of docs/meter.md.
    Meter,
    /// Holds the watch over friction and load against rigs that drift and rigs that do not, half an hour: the tables of
    /// docs/loop.md.
    Drift,
    /// Identifies random rigs and as many random motor axes, each from about a minute of experiment on the simulated board; as
    /// many of both with ripples of other waves, a tenth as many with each of some encoders and periods, half as many with a lag of
    /// their actuators, and a quarter as many rigs of each kind that is unlike the model: the tables of docs/identify.md, half an
    /// hour.
    Identify {
        /// Rigs.
        #[arg(default_value_t = 200)]
        rigs: u64,
        /// Seed of the first.
        #[arg(default_value_t = 10_001)]
        seed: u64,
    },
    /// Identifies and tunes hidden random rigs and motor axes, and drives them by the loop in virtual time: the tables of
    /// docs/tune.md, most of an hour. Stopped and started again it goes on with the next rig.
    Tune {
        /// Rigs.
        #[arg(default_value_t = 50)]
        rigs: u64,
        /// Seed of the first.
        #[arg(default_value_t = 30_001)]
        seed: u64,
    },
    /// Counts the instructions of a law's step, a servo's tick, a frame and an engine's tick, and holds them against
    /// benches/instructions.toml. Needs valgrind.
    Instructions,
    /// Compares the engines with SciPy over random single intervals: the tables of docs/theory.md, section 10. Fails beyond the
    /// errors that these state.
    Intervals {
        /// Intervals, half of them of extreme parameters.
        #[arg(default_value_t = 12_000)]
        count: u32,
    },
    /// Measures the lateness of a waking thread here, against cyclictest (benches/latency).
    Latency {
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        rest: Vec<String>,
    },
    /// Regenerates the type stub of the Python package's native module.
    Stubs,
    /// Builds the wheel, runs the notebooks with it, and keeps their outputs in them.
    Notebooks,
    /// Counts the files and places in which a fact of each kind is written: a law, a metric, … Two revisions
    /// stand side by side.
    Touch {
        /// Revisions of git.
        #[arg(value_name = "REV", default_value = "HEAD")]
        revisions: Vec<String>,
        /// Lists each file below the table.
        #[arg(long)]
        list: bool,
    },
    /// Adds a law's parameter, two laws, a friction model, a field of the log and a metric in a copy of the last commit, runs its
    /// tests and uses them: a table of what had to be touched. A quarter of an hour.
    Rehearse,
    /// Counts the lines of product code by crate. Two revisions stand side by side.
    Size {
        /// Revisions of git.
        #[arg(value_name = "REV", default_value = "HEAD")]
        revisions: Vec<String>,
    },
    /// Writes what follows from declarations and is kept: Python's classes, tables of the documentation, the schema of
    /// scenario files, headers for C, test vectors of the wire. Tests compare them.
    Generate {
        /// Only compares.
        #[arg(long)]
        check: bool,
    },
    /// Draws the README's figures again, with `clutch reproduce`.
    Figures,
    /// Takes live view, playground and report in Chromium, at the sizes of a desktop and a phone, in light and in dark, and the
    /// scope, into target/screenshots; keeps the first screens in docs/figures. Needs Chromium.
    Screenshots,
}

fn main() -> Result<()> {
    let verb = Cli::parse().verb;
    if matches!(verb, Verb::Test | Verb::Ci) {
        run::without_incremental()?;
    }
    match verb {
        Verb::Check => check(),
        Verb::Test => test::all(&[]),
        Verb::Wheel => test::wheel(),
        Verb::Boards { fuzz } => test::boards(fuzz),
        Verb::Ci => {
            test::targets()?; // the lints of the images need theirs
            check()?;
            release::package()?;
            release::msrv()?;
            release::semver()?;
            test::all(&["--fuzz"])
        }
        Verb::Bench { rest } => cargo(["bench", "--package", "clutch-benches", "--"]).args(rest).run(),
        Verb::Firmware { verb } => firmware::run(&verb),
        Verb::Docs => docs(),
        Verb::Site => site::build().map(drop),
        Verb::Package => release::package(),
        Verb::Msrv => release::msrv(),
        Verb::Semver => release::semver(),
        Verb::Calibrate { rest } => {
            let example = ["run", "--release", "--package", "clutch-sim", "--example", "calibrate", "--"];
            cargo(example).args(rest).run()
        }
        Verb::Fuzz { keep: true, target, .. } => fuzz::keep(target.as_deref()),
        Verb::Fuzz { seconds, executions, target, panics, longest, keep: false } => {
            let watched = if panics { fuzz::Watched::Panics } else { fuzz::Watched::Memory };
            fuzz::all(watched, seconds, executions, target.as_deref(), longest)
        }
        Verb::Coverage => coverage::run(),
        Verb::Prove { names } => proof::prove(&names),
        Verb::Mutants { shard } => mutants::run(&shard),
        Verb::Miri { part } => miri::run(&part),
        Verb::Neon => neon::run(),
        Verb::Certified { runs } => certified(runs),
        Verb::Smooth => smooth(),
        Verb::Meter => meter(),
        Verb::Drift => drift(),
        Verb::Identify { rigs, seed } => identify(rigs, seed),
        Verb::Tune { rigs, seed } => tune(rigs, seed),
        Verb::Campaign { runs, seed, resume, only } => campaign(runs, seed, resume, &only),
        Verb::Ablate { runs } => ablate::all(runs),
        Verb::Lies { trials } => lies(trials),
        Verb::Instructions => {
            cargo(["run", "--release", "--package", "clutch-sim", "--example", "instructions"]).run()
        }
        Verb::Intervals { count } => {
            cargo(["build", "--release", "--package", "clutch-sim", "--example", "intervals"]).run()?;
            let script =
                ["python/tests/intervals.py", "target/release/examples/intervals", &count.to_string()];
            run::program(python::interpreter()?).args(script).run()
        }
        Verb::Latency { rest } => {
            run::program(python::interpreter()?).arg("benches/latency/lateness.py").args(rest).run()
        }
        Verb::Fmu { scenario } => fmu::pack(scenario.as_deref()).map(drop),
        Verb::Dist { parts } => dist::run(&parts),
        Verb::Playground => test::playground().map(drop),
        Verb::Libclutch { targets } => libclutch::run(&targets),
        Verb::Stubs => stubs::generate(&python::interpreter()?),
        Verb::Notebooks => notebooks(),
        Verb::Touch { revisions, list } => touch::print(&revisions, list),
        Verb::Rehearse => rehearse::run(),
        Verb::Size { revisions } => size::print(&revisions),
        Verb::Generate { check } => generate::run(check),
        Verb::Figures => figures(),
        Verb::Screenshots => screenshots(),
    }
}

fn check() -> Result<()> {
    cargo(["fmt", "--all", "--check"]).run()?;
    // The images: a workspace of their own.
    firmware::in_firmware(["fmt", "--all", "--check"]).run()?;
    // And others.
    for manifest in ["fuzz/Cargo.toml", "proofs/Cargo.toml", "tests/no_panic/Cargo.toml"] {
        cargo(["fmt", "--manifest-path", manifest, "--all", "--check"]).run()?;
    }
    let tool = python::checkers()?;
    tool("ruff").args(["format", "--check"]).args(python::SOURCES).run()?;
    tool("ruff").arg("check").args(python::SOURCES).run()?;
    tool("typos").run()?;
    rehearse::check()?;
    for manifest in ["Cargo.toml", "firmware/Cargo.toml"] {
        // A permission that nothing needs any more is an error, too.
        let deny = [
            "--locked",
            "--manifest-path",
            manifest,
            "check",
            "-D",
            "warnings",
            "licenses",
            "bans",
            "sources",
        ];
        tool("cargo-deny").args(deny).run()?;
    }
    cargo(["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]).run()?;
    // The command as a release has it.
    let released = ["--package", "clutch-cli", "--all-targets", "--features", "foxglove,parquet,scope"];
    cargo(["clippy"]).args(released).args(["--", "-D", "warnings"]).run()?;
    // Each feature of the core by itself: the workspace turns on what its crates ask for.
    for features in ["", "linalg", "terse"] {
        cargo(["clippy", "--package", "clutch-core", "--features", features, "--", "-D", "warnings"])
            .run()?;
    }
    // The images, where their targets are; tests build them in any case.
    for (board, target) in firmware::BOARDS.into_iter().filter(|(_, target)| firmware::has(target)) {
        let lint = ["clippy", "--release", "--locked", "--package", board, "--target", target];
        // With the image that measures, which `benches/budget` alone builds.
        let measures: &[&str] = if board == firmware::BOARDS[0].0 { &["--features", "measure"] } else { &[] };
        firmware::in_firmware(lint).args(measures).args(["--", "-D", "warnings"]).run()?;
    }
    elsewhere::check()?;
    docs()
}

fn docs() -> Result<()> {
    cargo(["doc", "--workspace", "--no-deps", "--exclude", "xtask"]).env("RUSTDOCFLAGS", "-D warnings").run()
}

fn notebooks() -> Result<()> {
    let tools = python::interpreter()?;
    let wheel = python::Wheel::install(&tools)?;
    wheel.program(&tools)?.arg(root().join("docs/notebooks.py")).run()
}

fn figures() -> Result<()> {
    let (out, kept) = (root().join("target/figures"), root().join("docs/figures"));
    cargo(["run", "--release", "--", "reproduce", "--out"]).arg(&out).run()?;
    std::fs::create_dir_all(&kept)?;
    for name in ["laws.svg", "fig8.svg", "fig9.svg", "fig10.svg"] {
        std::fs::copy(out.join(name), kept.join(name)).with_context(|| format!("copying {name}"))?;
    }
    let clutch =
        |args: &[&str], file: &str| cargo(["run", "--release", "--"]).args(args).arg(kept.join(file)).run();
    clutch(&["sim", "motor_pid", "--plot"], "motor_pid.svg")?;
    clutch(&["friction", "plot", "stribeck", "lugre", "elasto_plastic", "--out"], "friction.svg")
}

fn screenshots() -> Result<()> {
    let page = test::playground()?.context("there is no playground to take")?.page;
    cargo(["build", "--release", "--package", "clutch-cli", "--features", "scope"]).run()?;
    let take =
        run::program(python::interpreter()?).arg("python/tests/screenshots.py").arg("target/release/clutch");
    take.arg(page).arg("target/screenshots").run()
}

fn certified(runs: u64) -> Result<()> {
    let campaign = table_of("certified", &["campaign", &runs.to_string(), "400000", "500000"])?;
    write_between("docs/certified.md", "campaign", &campaign)?;
    let integrals = table_of("certified", &["campaign-integral", &(runs / 5).to_string()])?;
    write_between("docs/certified.md", "campaign-integral", &integrals)?;
    let motors = table_of("certified", &["campaign-motor", &runs.to_string(), "300000"])?;
    write_between("docs/certified.md", "campaign-motor", &motors)?;
    for table in ["integral", "shell", "delays", "rates", "motor"] {
        write_between("docs/certified.md", table, &table_of("certified", &[table])?)?;
    }
    write_between("docs/certified.md", "part", &table_in("clutch-loop", "part_period", &[])?)?;
    write_between("docs/certified.md", "table", &table_of("certified", &["table"])?)
}

fn smooth() -> Result<()> {
    let cells = root().join("target/smooth.json");
    let cells = cells.to_str().context("the path of this tree is no text")?;
    write_between("docs/smooth.md", "laws", &table_of("smooth", &["laws", cells])?)?;
    cargo(["run", "--release", "--package", "clutch-cli", "--example", "laws_figure", "--"])
        .args([cells, "docs/figures/smooth.svg"])
        .run()?;
    for table in ["plants", "loops", "rest", "troubles", "steps", "motions", "motor", "bristles"] {
        write_between("docs/smooth.md", table, &table_of("smooth", &[table])?)?;
    }
    for table in ["identified", "maps"] {
        write_between("docs/smooth.md", table, &table_in("clutch-identify", table, &[])?)?;
    }
    write_between("docs/smooth.md", "motor_maps", &table_in("clutch-identify", "maps", &["motor"])?)
}

fn drift() -> Result<()> {
    for table in ["drifts", "healthy"] {
        write_between("docs/loop.md", table, &table_in("clutch-loop", "drift", &[table])?)?;
    }
    Ok(())
}

fn meter() -> Result<()> {
    for counts in ["2000", "20000", "200000"] {
        write_between("docs/meter.md", &format!("laws {counts}"), &table_of("meter", &["laws", counts])?)?;
    }
    for table in ["rates", "sources", "edges", "rigs"] {
        write_between("docs/meter.md", table, &table_of("meter", &[table])?)?;
    }
    Ok(())
}

fn identify(rigs: u64, seed: u64) -> Result<()> {
    let page = "docs/identify.md";
    let of = |example| ["clutch-identify", example];
    let braked = "identified_rigs";
    for (example, name, first) in [(braked, "campaign", seed), ("identified_motors", "motors", seed + MOTORS)]
    {
        random_rigs(of(example), page, name, (rigs, first), &[])?;
        random_rigs(of(example), page, &format!("{name}_waves"), (rigs, first + WAVES), &["waves"])?;
        other_loops(of(example), page, &format!("{name}_loops"), (rigs.div_ceil(10), first + LOOPS), &[])?;
    }
    random_rigs(of(braked), page, "campaign_lags", (rigs.div_ceil(2), seed + LAGS), &["lags"])?;
    random_rigs(of("unlike_rigs"), page, "unlike", (rigs.div_ceil(4), seed + UNLIKE), &[])
}

fn tune(rigs: u64, seed: u64) -> Result<()> {
    let (page, of) = ("docs/tune.md", |example| ["clutch-tune", example]);
    random_rigs(of("tuned_rigs"), page, "campaign", (rigs, seed), &[])?;
    other_loops(of("tuned_rigs"), page, "campaign_loops", (rigs.div_ceil(5), seed + LOOPS), &["waves"])?;
    // A reversal takes most of a minute to tune for.
    random_rigs(of("tuned_motors"), page, "motors", ((2 * rigs).div_ceil(5), seed), &[])
}

/// From the seeds of braked rigs to those of motor axes.
const MOTORS: u64 = 20_000;
/// And to those of rigs that are unlike the model.
const UNLIKE: u64 = 40_000;
/// And to those of ripples of other waves, and of other encoders and periods.
const WAVES: u64 = 80_000;
/// See [`WAVES`].
const LOOPS: u64 = 90_000;
/// From the seeds of braked rigs to those of actuators with a lag.
const LAGS: u64 = 130_000;
/// Encoders and periods other than 20 000 counts and 1 ms.
const OTHER_LOOPS: [&str; 8] = [
    "rig.encoder.counts_per_rev=4096",
    "rig.encoder.counts_per_rev=8192 sampling.period_us=500",
    "rig.encoder.counts_per_rev=10000",
    "rig.encoder.counts_per_rev=65536",
    "rig.encoder.counts_per_rev=200000",
    "sampling.period_us=250",
    "sampling.period_us=500",
    "sampling.period_us=2000",
];

/// The campaign of a package's example over random rigs, into its page.
fn random_rigs(
    [package, example]: [&str; 2],
    page: &str,
    part: &str,
    (rigs, seed): (u64, u64),
    words: &[&str],
) -> Result<()> {
    let example = ["run", "--release", "--package", package, "--example", example, "--"];
    let (mut table, mut last) = (Vec::new(), String::new());
    let done = cargo(example).args([rigs.to_string(), seed.to_string()]).args(words).lines(|line| {
        if line.starts_with('|') {
            table.push(line.to_owned());
        } else if line.contains("rigs from seed") {
            line.clone_into(&mut last);
        }
    })?;
    anyhow::ensure!(done, "the campaign failed");
    write_between(page, part, &format!("{}\n\n{last}", table.join("\n")))
}

/// The same rigs with other encoders and periods, and `more`, a row each.
fn other_loops(of: [&str; 2], page: &str, part: &str, (rigs, seed): (u64, u64), more: &[&str]) -> Result<()> {
    let (number, first) = (rigs.to_string(), seed.to_string());
    let mut rows: Vec<String> = Vec::new();
    for set in OTHER_LOOPS.iter().chain(more) {
        let words: Vec<&str> =
            [number.as_str(), first.as_str(), "short"].into_iter().chain(set.split(' ')).collect();
        let table = table_in(of[0], of[1], &words)?;
        rows.extend(table.lines().skip(if rows.is_empty() { 0 } else { 2 }).map(str::to_owned));
    }
    write_between(page, part, &format!("{}\n\n{rigs} rigs from seed {seed} for each row", rows.join("\n")))
}

/// The table that an example of the simulator prints.
fn table_of(example: &str, args: &[&str]) -> Result<String> {
    table_in("clutch-sim", example, args)
}

/// The same of another package.
fn table_in(package: &str, example: &str, args: &[&str]) -> Result<String> {
    let run = ["run", "--release", "--package", package, "--example", example, "--"];
    let (done, text) = cargo(run).args(args).quietly()?;
    anyhow::ensure!(done, "the example {example} failed:\n{text}");
    let table: Vec<&str> =
        text.lines().filter(|l| l.starts_with('|') || l.starts_with("Maps of") || l.is_empty()).collect();
    Ok(table.join("\n"))
}

/// Puts a text between the markers of that name.
fn write_between(page: &str, name: &str, text: &str) -> Result<()> {
    let file = root().join(page);
    let old = std::fs::read_to_string(&file)?;
    let new = generate::between(&old, name, text).with_context(|| page.to_owned())?;
    Ok(std::fs::write(file, new)?)
}

fn campaign(runs: u64, seed: u64, resume: Option<PathBuf>, only: &[String]) -> Result<()> {
    let example = ["run", "--release", "--package", "clutch-loop", "--example", "campaign", "--"];
    if !only.is_empty() {
        return cargo(example).arg("only").args(only).run();
    }
    let kept = resume.map(std::path::absolute).transpose()?;
    let (done, text) = cargo(example).args([runs.to_string(), seed.to_string()]).args(kept).quietly()?;
    if !done {
        anyhow::bail!("the campaign failed:\n{text}");
    }
    let table: Vec<&str> = text.lines().filter(|l| l.starts_with('|')).collect();
    let last = seed + runs - 1;
    write_between("docs/safety.md", "campaign", &format!("Seeds {seed} to {last}:\n\n{}", table.join("\n")))
}

fn lies(trials: u32) -> Result<()> {
    cargo(["build", "--release", "--package", "clutch-cli"]).run()?;
    let script = ["python/tests/lying_board.py", "target/release/clutch", &trials.to_string()];
    let (done, text) = run::program("python3").args(script).quietly()?;
    anyhow::ensure!(done, "the loop believed a lie:\n{text}");
    write_between("docs/safety.md", "lies", text.trim())
}
