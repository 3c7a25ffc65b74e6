//! The files of a release, in target/dist: built, and checked by running them, here or in an emulator.

mod command;
mod images;
mod machine;
mod pages;
mod sbom;
mod tools;
mod wheels;

use crate::run::{program, root};
use crate::{fmu, libclutch};
use anyhow::{Context, Result, anyhow, ensure};
use clap::ValueEnum;
use std::cell::LazyCell;
use std::path::{Path, PathBuf};
use tools::{LINUX, LINUX_ARM64, Tools, WINDOWS, names_no_folder};

/// A part of a release.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum Part {
    /// Source distribution and wheels, for Linux on x86-64 and 64-bit Arm and for Windows.
    Wheels,
    /// The command with its manual, for the same systems.
    Command,
    /// libclutch.
    C,
    /// Images of the boards.
    Firmware,
    /// Units for simulators.
    Fmu,
    /// The page that simulates in a browser.
    Playground,
    /// The documentation, with the playground.
    Docs,
    /// Bills of materials of command, libclutch, units, images and playground; a wheel has its own within.
    Sbom,
}

/// A file of a release.
struct Made {
    file: PathBuf,
    /// Checks that it passed.
    checked: Vec<String>,
}

/// Version of all files.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Width of the summary.
const COLUMNS: usize = 80;

/// Builds and checks these parts, all unless some are given. The files of an earlier call are gone.
pub(crate) fn run(parts: &[Part]) -> Result<()> {
    ensure!(
        cfg!(all(target_os = "linux", target_arch = "x86_64")),
        "files of a release are built and checked on Linux on x86-64"
    );
    let parts = if parts.is_empty() { Part::value_variants() } else { parts };
    let out = folder();
    let _ = std::fs::remove_dir_all(&out);
    std::fs::create_dir_all(&out)?;
    // Installed for the parts that take them.
    let tools = LazyCell::new(Tools::new);
    let tools = || tools.as_ref().map_err(|why| anyhow!("{why:#}"));
    let mut made = Vec::new();
    for part in parts {
        made.extend(match part {
            Part::Wheels => wheels::make(tools()?)?,
            Part::Command => command::make(tools()?)?,
            Part::C => vec![c()?],
            Part::Firmware => vec![images::make(tools()?)?],
            Part::Fmu => units(tools()?)?,
            Part::Playground => vec![pages::playground()?],
            Part::Docs => vec![pages::documentation()?],
            Part::Sbom => sbom::make(tools()?)?,
        });
    }
    let sums = checksums(&made)?;
    println!("\n{}", out.display());
    for Made { file, checked } in made.iter().chain([&sums]) {
        print!("{}", row(file, checked)?);
    }
    Ok(())
}

/// The folder of all of it.
fn folder() -> PathBuf {
    root().join("target/dist")
}

/// A folder in which it is put together and tried.
fn work(name: &str) -> Result<PathBuf> {
    let folder = root().join("target/dist-work").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    Ok(folder)
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Name and size of a file, and below them what was checked.
fn row(file: &Path, checked: &[String]) -> Result<String> {
    let (name, size) = (name(file), bytes(std::fs::metadata(file)?.len()));
    let mut text = format!("{name:<width$}{size:>10}\n", width = COLUMNS - 10);
    for check in checked {
        let mut line = "   ".to_owned();
        for word in check.split(' ') {
            if line.chars().count() + 1 + word.chars().count() > COLUMNS {
                text += &format!("{line}\n");
                line = "     ".to_owned();
            }
            line += &format!(" {word}");
        }
        text += &format!("{line}\n");
    }
    Ok(text)
}

/// A size in decimal units.
fn bytes(size: u64) -> String {
    match size {
        0..1_000_000 => format!("{:.1} kB", size as f64 / 1e3),
        _ => format!("{:.1} MB", size as f64 / 1e6),
    }
}

/// Writes the sums of all files, as `sha256sum --check` reads them.
fn checksums(made: &[Made]) -> Result<Made> {
    let names: Vec<String> = made.iter().map(|made| name(&made.file)).collect();
    let sums = program("sha256sum").within(&folder()).args(names).output()?;
    let file = folder().join("SHA256SUMS");
    std::fs::write(&file, sums)?;
    program("sha256sum").within(&folder()).args(["--check", "--quiet", "SHA256SUMS"]).run()?;
    Ok(Made { file, checked: vec![format!("sums of {} files", made.len())] })
}

/// Packs a folder; the same files give the same archive.
fn tar(folder: &Path, archive: &str) -> Result<PathBuf> {
    let date = program("git").args(["log", "-1", "--format=@%ct"]).output()?;
    let archive = self::folder().join(archive);
    program("tar")
        .args(["--sort=name", "--owner=0", "--group=0", "--numeric-owner"])
        .arg(format!("--mtime={}", String::from_utf8_lossy(&date).trim()))
        .args(["--use-compress-program", "gzip -9 --no-name", "-cf"])
        .arg(&archive)
        .arg("-C")
        .arg(folder.parent().context("a folder within another")?)
        .arg(name(folder))
        .run()?;
    Ok(archive)
}

/// Lays the licences into a folder.
fn licences(folder: &Path) -> Result<()> {
    for file in ["LICENSE-MIT", "LICENSE-APACHE"] {
        copy(&root().join(file), folder)?;
    }
    Ok(())
}

/// Copies a file into a folder, which is made where there is none.
fn copy(file: &Path, folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder)?;
    std::fs::copy(file, folder.join(name(file))).with_context(|| file.display().to_string())?;
    Ok(())
}

/// The libraries for C.
fn c() -> Result<Made> {
    libclutch::run(&[])?;
    let (built, packed) = (libclutch::folder(), work("libclutch")?.join(format!("libclutch-{VERSION}")));
    for target in libclutch::TARGETS {
        copy(&built.join(target).join("libclutch.a"), &packed.join(target))?;
    }
    copy(&built.join("include/clutch.h"), &packed.join("include"))?;
    program("cp").arg("-r").arg(built.join("arduino")).arg(&packed).run()?;
    licences(&packed)?;
    let file = tar(&packed, &format!("libclutch-{VERSION}.tar.gz"))?;
    let targets = libclutch::TARGETS.len();
    Ok(Made { file, checked: vec![format!("{targets} targets, in none can a panic be reached")] })
}

/// The units for simulators, each for three systems; FMPy runs them on this one.
fn units(tools: &Tools) -> Result<Vec<Made>> {
    let library = ["--package", "clutch-fmi", "--lib"];
    let linux = tools.build(LINUX, &[&library[..], &["--example", "describe"]].concat())?;
    let libraries = [
        ("x86_64-linux", linux.join("libclutch_fmi.so")),
        ("aarch64-linux", tools.build(LINUX_ARM64, &library)?.join("libclutch_fmi.so")),
        ("x86_64-windows", tools.build(WINDOWS, &library)?.join("clutch_fmi.dll")),
    ];
    libraries.iter().try_for_each(|(_, library)| names_no_folder(library))?;
    let packed = work("fmu")?;
    fmu::packed(None, &linux.join("examples/describe"), &libraries, &packed)?;
    fmu::UNITS.iter().map(|name| unit(tools, &packed.join(name))).collect()
}

/// Prints what is wrong with a unit, else the number of rows that one second of it has.
const SIMULATED: &str = "\
import sys, fmpy
from fmpy.validation import validate_fmu
wrong = validate_fmu(sys.argv[1])
rows = fmpy.simulate_fmu(sys.argv[1], stop_time=1.0, output_interval=1e-3)
sys.exit(str(wrong)) if wrong else print(len(rows))
";

fn unit(tools: &Tools, packed: &Path) -> Result<Made> {
    copy(packed, &folder())?;
    let rows = tools.script(SIMULATED).arg(packed).output()?;
    let rows = String::from_utf8_lossy(&rows).trim().to_owned();
    let checked = format!("FMPy finds it valid, and simulates {rows} steps on this machine");
    Ok(Made { file: folder().join(name(packed)), checked: vec![checked] })
}
