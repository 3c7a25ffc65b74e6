//! Images of the boards: built, flashed, measured.

use crate::panic_path;
use crate::python;
use crate::run::{Program, cargo, program, root};
use anyhow::{Context, Result, bail};
use clap::{Subcommand, ValueEnum};
use std::path::{Path, PathBuf};

/// The compiler's target for a Cortex-M4F.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";
/// Packages of the boards, and their targets. One by one: together each would get the library features that the other
/// wants.
pub(crate) const BOARDS: [(&str, &str); 3] = [
    ("clutch-qemu-mps2", TARGET),
    ("clutch-nucleo-g474re", TARGET),
    ("clutch-pico-rp2040", "thumbv6m-none-eabi"),
];

/// The run of `nucleo-alone`, if none is named.
const RUN: &str = "firmware/nucleo-g474re/src/alone_run.rs";

#[derive(Subcommand)]
pub(crate) enum Verb {
    /// Builds the images of all boards, in target/firmware; adds the Rust targets.
    Build {
        /// The run of `nucleo-alone`, as of `clutch scenario rust`; default: that of the tree.
        #[arg(long, value_name = "FILE")]
        run: Option<PathBuf>,
    },
    /// Builds a board's image and flashes it, with probe-rs.
    Flash {
        /// The board.
        #[arg(long, value_enum, default_value = "nucleo")]
        board: Flashed,
        /// The role of the board.
        #[arg(long, value_enum)]
        role: Role,
        /// With the role alone: the run that is compiled in, as of `clutch scenario rust`; default: that of the tree.
        #[arg(long, value_name = "FILE")]
        run: Option<PathBuf>,
    },
    /// Prints the flash and memory that the images take.
    Size,
    /// Prints the longest path through each law, the codec and the whole tick, in instructions and
    /// cycles, against the counts of the emulator (docs/timing.md).
    Budget,
    /// Prints the deepest stack.
    Stack,
    /// Runs the Pico's image on rp2040js, an emulator that shares no code with the model of its chip (docs/firmware.md):
    /// each code is that of the model. Asks for npm, and for an image that is built.
    Rp2040js,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum Flashed {
    /// A NUCLEO-G474RE.
    Nucleo,
    /// A Raspberry Pi Pico, with a probe at its debug pins.
    Pico,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum Role {
    /// The board closes the loop itself: clutch loop --board.
    Controller,
    /// The board samples and obeys: clutch loop --port.
    Daq,
    /// The board closes the loop without a host, with a run that is compiled in; NUCLEO alone.
    Alone,
}

pub(crate) fn run(verb: &Verb) -> Result<()> {
    match verb {
        Verb::Build { run } => build(run.as_deref()),
        Verb::Flash { board, role, run } => flash(*board, *role, run.as_deref()),
        Verb::Size => report("size"),
        Verb::Budget => report("budget"),
        Verb::Stack => report("stack"),
        Verb::Rp2040js => {
            if !fetch_rp2040js() {
                bail!("npm cannot fetch rp2040js");
            }
            cargo(["build", "--package", "clutch-cli"]).run()?;
            let (same, text) = on_rp2040js(&root().join("target/debug/clutch"))?;
            print!("{text}");
            if same { Ok(()) } else { bail!("the codes differ, or there are none") }
        }
    }
}

/// True if the Rust target is installed.
pub(crate) fn has(target: &str) -> bool {
    let libraries = program("rustc").args(["--print", "target-libdir", "--target", target]).quietly();
    libraries.is_ok_and(|(known, text)| known && Path::new(text.trim()).is_dir())
}

/// Builds a board's images.
pub(crate) fn image((board, target): (&str, &str)) -> Program {
    in_firmware(["build", "--release", "--locked", "--package", board, "--target", target])
}

/// The same, with a run for `nucleo-alone` if one is named: build.rs of the board reads it, in its own folder.
fn image_of(board: (&str, &str), run: Option<&Path>) -> Result<Program> {
    Ok(match run {
        Some(run) => image(board).env("CLUTCH_RUN", std::path::absolute(run)?),
        None => image(board),
    })
}

/// A cargo in the folder of the images, where a file has the flags.
pub(crate) fn in_firmware<const N: usize>(args: [&str; N]) -> Program {
    cargo(args).within(&root().join("firmware")).env("CARGO_TARGET_DIR", root().join("target/firmware"))
}

/// The folder of a target's images.
pub(crate) fn folder(target: &str) -> PathBuf {
    root().join("target/firmware").join(target).join("release")
}

/// Builds all images, `nucleo-alone` with a run if one is named.
pub(crate) fn build(run: Option<&Path>) -> Result<()> {
    for board in BOARDS {
        build_one(board, run)?;
    }
    for (board, target) in BOARDS {
        println!("images of {board}: {}", folder(target).display());
    }
    Ok(())
}

fn build_one(board: (&str, &str), run: Option<&Path>) -> Result<()> {
    program("rustup").args(["target", "add", board.1]).run().with_context(|| {
        format!("the board's Rust target is missing, and there is no rustup to add it: install {}", board.1)
    })?;
    image_of(board, run)?.run().or_else(|why| bail!("{why:#}\n{}", panicking(board, run)?))
}

/// The places that keep a board's images from being linked because they call for a panic; nothing, if they are kept by another
/// error.
pub(crate) fn panicking(board: (&str, &str), run: Option<&Path>) -> Result<String> {
    let target = board.1;
    let named = root().join("target/firmware_named");
    let image = panic_path::in_spite(image_of(board, run)?, target).arg("--target-dir").arg(&named);
    let (built, _) = image.silently()?;
    if !built {
        return Ok(String::new());
    }
    if let Some(why) = panic_path::no_objdump() {
        return Ok(why);
    }
    let mut places = String::new();
    for file in std::fs::read_dir(named.join(target).join("release"))? {
        let path = file?.path();
        if path.is_file() && std::fs::read(&path)?.starts_with(b"\x7fELF") {
            places += &panic_path::of_image(&path)?.unwrap_or_default();
        }
    }
    Ok(places)
}

fn flash(board: Flashed, role: Role, run: Option<&Path>) -> Result<()> {
    let (package, name, chip) = match board {
        Flashed::Nucleo => (BOARDS[1], "nucleo", "STM32G474RETx"),
        Flashed::Pico => (BOARDS[2], "pico", "RP2040"),
    };
    let role = match role {
        Role::Alone if name == "pico" => {
            bail!("--role alone: expected with --board nucleo, which has a button")
        }
        Role::Alone => "alone",
        _ if run.is_some() => {
            bail!("--run: expected with --role alone, the image that has a run compiled in")
        }
        Role::Controller => "controller",
        Role::Daq => "daq",
    };
    if program("probe-rs").args(["--version"]).quietly().is_err() {
        bail!("probe-rs is not installed: `cargo install probe-rs-tools --locked`, or see https://probe.rs");
    }
    if role == "alone" {
        // Whose run it is, and what is known of its gains.
        let of_tree = root().join(RUN);
        let run = run.unwrap_or(&of_tree);
        let text = std::fs::read_to_string(run).with_context(|| format!("--run {}", run.display()))?;
        text.lines().map_while(|line| line.strip_prefix("//!")).for_each(|line| println!("{}", line.trim()));
    }
    build_one(package, run)?;
    let image = folder(package.1).join(format!("{name}-{role}"));
    program("probe-rs").args(["download", "--chip", chip, "--verify"]).arg(&image).run()?;
    program("probe-rs").args(["reset", "--chip", chip]).run()
}

fn rp2040js() -> PathBuf {
    root().join("firmware/pico-rp2040/emulator")
}

/// True if rp2040js is there, or could be fetched.
pub(crate) fn fetch_rp2040js() -> bool {
    let install = ["install", "--no-package-lock", "--no-audit", "--no-fund", "--loglevel=error"];
    rp2040js().join("node_modules/rp2040js").exists()
        || program("npm").args(install).within(&rp2040js()).quietly().is_ok_and(|(fetched, _)| fetched)
}

/// Records what passes between a run and the model of the Pico's chip, and replays it on rp2040js; true if each code is the same.
pub(crate) fn on_rp2040js(command: &Path) -> Result<(bool, String)> {
    let record = root().join("target/rp2040js");
    std::fs::create_dir_all(&record)?;
    let image = folder("thumbv6m-none-eabi").join("pico-controller");
    let run = program(command).args([
        "hil",
        "examples/pico_smc_2.toml",
        "--set",
        "run.duration_s=1.2",
        "--quiet",
        "--image",
    ]);
    let run = run.arg(&image).env("RECORD", &record).env("PYTHON", python::interpreter()?);
    let (ran, text) = run.env("CLUTCH_PYTHON", rp2040js().join("record.sh")).quietly()?;
    if !ran {
        return Ok((false, text));
    }
    let replay = program("node").arg(rp2040js().join("replay.mjs")).arg(&image);
    replay.args([record.join("requests"), record.join("answers")]).quietly()
}

fn report(what: &str) -> Result<()> {
    let bench = cargo(["bench", "--package", "clutch-benches", "--bench", "budget", "--", what]);
    bench.env("CLUTCH_PYTHON", python::interpreter()?).run()
}
