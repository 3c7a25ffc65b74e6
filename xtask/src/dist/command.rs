//! The command, with its manual.

use super::machine::{Machine, Results};
use super::tools::{STATIC, STATIC_ARM64, Tools, WINDOWS, names_no_folder};
use super::{Made, VERSION, copy, folder, images, licences, name, tar, wheels, work};
use crate::run::{program, root};
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};

/// The program, as cargo's options name it, with all its options.
const COMMAND: [&str; 6] =
    ["--package", "clutch-cli", "--bin", "clutch", "--features", "foxglove,parquet,scope"];

/// The one that runs here.
pub(super) fn here(tools: &Tools) -> Result<PathBuf> {
    Ok(tools.build(STATIC, &COMMAND)?.join("clutch"))
}

pub(super) fn make(tools: &Tools) -> Result<Vec<Made>> {
    let build = |target: &str| tools.build(target, &COMMAND);
    let linux = here(tools)?;
    let arm64 = build(STATIC_ARM64)?.join("clutch");
    let windows = build(WINDOWS)?.join("clutch.exe");

    // A program that is linked to a C library would not begin: neither machine has musl's.
    let here = Machine::here().results(&[&linux], "command")?;
    let on_arm64 = Machine::arm64(None).results(&[&arm64], "command-arm64")?;
    let on_windows = Machine::windows()?.results(&[&windows], "command-windows")?;
    let same = |results: &Results| results.same_as(&here);
    let libraries = wheels::libraries(&windows)?.len();
    let libraries = format!("asks for {libraries} libraries of Windows alone");
    Ok(vec![
        Made { file: packed(&linux, &linux, "x86_64-linux")?, checked: vec![here.told(), hil(&linux)?] },
        Made {
            file: packed(&arm64, &linux, "aarch64-linux")?,
            checked: vec![same(&on_arm64)?, bits(tools)?],
        },
        Made {
            file: packed(&windows, &linux, "x86_64-windows")?,
            checked: vec![libraries, same(&on_windows)?],
        },
    ])
}

/// Where the command for Linux looks for images of boards, beside itself.
const IMAGES: &str = "share/clutch/images";

/// Check that the command drives an emulated board, as it is unpacked and outside of this tree.
fn hil(linux: &Path) -> Result<String> {
    let unpacked = work("hil")?;
    copy(linux, &unpacked)?;
    images::stripped(&unpacked.join(IMAGES))?;
    let empty = work("hil-from")?;
    let clutch = program(unpacked.join("clutch")).within(&empty).without("CLUTCH_IMAGES");
    clutch.args(["hil", "board_smc_2", "--quiet"]).run()?;
    Ok("follows the path of board_smc_2 on the emulated board, from an empty folder".to_owned())
}

/// Packs the command for a system: with what the one that runs here prints, manual and completions, and for Linux with
/// the images of the boards.
fn packed(command: &Path, here: &Path, system: &str) -> Result<PathBuf> {
    let whole = format!("clutch-{VERSION}-{system}");
    let packed = work(system)?.join(&whole);
    names_no_folder(command)?;
    copy(command, &packed)?;
    licences(&packed)?;
    if !system.ends_with("windows") {
        images::stripped(&packed.join(IMAGES))?;
        program(here).args(["man", "--quiet", "--out"]).arg(packed.join("man")).run()?;
        std::fs::create_dir_all(packed.join("completion"))?;
        for shell in ["bash", "zsh", "fish"] {
            let script = program(here).args(["completion", shell]).output()?;
            std::fs::write(packed.join("completion").join(format!("clutch.{shell}")), script)?;
        }
        return tar(&packed, &format!("{whole}.tar.gz"));
    }
    let archive = folder().join(format!("{whole}.zip"));
    let within = packed.parent().context("a folder within another")?;
    program("python3").within(within).args(["-m", "zipfile", "-c"]).arg(&archive).arg(name(&packed)).run()?;
    Ok(archive)
}

/// Check of the runs of docs/bits.md, more than a million ticks: a 64-bit Arm processor gives the hashes there.
fn bits(tools: &Tools) -> Result<String> {
    let built = tools.build(STATIC_ARM64, &["--package", "clutch-tests", "--example", "bits"])?;
    let table = Machine::arm64(None).program(&built.join("examples/bits")).arg(work("bits")?).output()?;
    let table = String::from_utf8_lossy(&table).into_owned();
    let page = std::fs::read_to_string(root().join("docs/bits.md"))?;
    ensure!(
        page.contains(table.trim()),
        "docs/bits.md has another table than a 64-bit Arm processor:\n{table}"
    );
    let runs = table.lines().count() - 2;
    Ok(format!("on {}: the hashes of the {runs} runs of docs/bits.md", Machine::arm64(None).name))
}
