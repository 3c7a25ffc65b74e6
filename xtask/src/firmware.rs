//! Images of the boards: built, flashed, measured.

use crate::run::{Program, cargo, program, root};
use anyhow::{Context, Result, bail};
use clap::{Subcommand, ValueEnum};
use std::path::{Path, PathBuf};

/// The programs of the boards.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";
/// Packages of the boards. One by one: together each would get the library features that the other
/// wants.
pub(crate) const BOARDS: [&str; 2] = ["clutch-qemu-mps2", "clutch-nucleo-g474re"];
const CHIP: &str = "STM32G474RETx";

#[derive(Subcommand)]
pub(crate) enum Verb {
    /// Builds the images of all boards, in target/firmware; adds the Rust target.
    Build,
    /// Builds the NUCLEO-G474RE's image and flashes it, with probe-rs.
    Flash {
        /// The role of the board.
        #[arg(long, value_enum)]
        role: Role,
    },
    /// Prints the flash and memory that the images take.
    Size,
    /// Prints the longest path through each law, the codec and the whole tick, in instructions and
    /// cycles, against the counts of the emulator (docs/timing.md).
    Budget,
    /// Prints the deepest stack.
    Stack,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum Role {
    /// The board closes the loop itself: clutch loop --board.
    Controller,
    /// The board samples and obeys: clutch loop --port.
    Daq,
}

pub(crate) fn run(verb: &Verb) -> Result<()> {
    match verb {
        Verb::Build => build().map(drop),
        Verb::Flash { role } => flash(*role),
        Verb::Size => report("size"),
        Verb::Budget => report("budget"),
        Verb::Stack => report("stack"),
    }
}

/// True if the boards' Rust target is installed.
pub(crate) fn has_target() -> bool {
    let libraries = program("rustc").args(["--print", "target-libdir", "--target", TARGET]).quietly();
    libraries.is_ok_and(|(known, text)| known && Path::new(text.trim()).is_dir())
}

/// Builds a board's images.
pub(crate) fn image(board: &str) -> Program {
    in_firmware(["build", "--release", "--locked", "--package", board])
}

/// A cargo in the folder of the images, where a file has the flags.
pub(crate) fn in_firmware<const N: usize>(args: [&str; N]) -> Program {
    cargo(args).within(&root().join("firmware")).env("CARGO_TARGET_DIR", root().join("target/firmware"))
}

/// Builds all images; gives their folder.
fn build() -> Result<PathBuf> {
    program("rustup").args(["target", "add", TARGET]).run().context(
        "the boards' Rust target is missing, and there is no rustup to add it: install thumbv7em-none-eabihf",
    )?;
    for board in BOARDS {
        image(board).run()?;
    }
    let images = root().join("target/firmware").join(TARGET).join("release");
    println!("\nimages: {}", images.display());
    Ok(images)
}

fn flash(role: Role) -> Result<()> {
    if program("probe-rs").args(["--version"]).quietly().is_err() {
        bail!("probe-rs is not installed: `cargo install probe-rs-tools --locked`, or see https://probe.rs");
    }
    let image = build()?.join(match role {
        Role::Controller => "nucleo-controller",
        Role::Daq => "nucleo-daq",
    });
    program("probe-rs").args(["download", "--chip", CHIP, "--verify"]).arg(&image).run()?;
    program("probe-rs").args(["reset", "--chip", CHIP]).run()
}

fn report(what: &str) -> Result<()> {
    cargo(["bench", "--package", "clutch-benches", "--bench", "budget", "--", what]).run()
}
