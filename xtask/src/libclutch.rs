//! libclutch: static libraries for C, in target/libclutch.

use crate::panic_path;
use crate::run::{cargo, program, root};
use anyhow::{Context, Result, bail, ensure};
use std::path::{Path, PathBuf};

/// Targets of the libraries: what is programmed in C most, with a floating-point unit and without.
pub(crate) const TARGETS: [&str; 6] = [
    "thumbv6m-none-eabi",
    "thumbv7em-none-eabihf",
    "thumbv8m.main-none-eabihf",
    "riscv32imac-unknown-none-elf",
    "x86_64-unknown-linux-gnu",
    "aarch64-unknown-linux-gnu",
];

/// The function that a panic would call, and that nobody has.
const SURVIVED: &[u8] = b"clutch_panic_path_survived";

/// Builds the libraries of these targets, all unless some are given, and lays the header beside them.
pub(crate) fn run(targets: &[String]) -> Result<()> {
    let targets: Vec<&str> =
        if targets.is_empty() { TARGETS.to_vec() } else { targets.iter().map(String::as_str).collect() };
    if let Some(unknown) = targets.iter().find(|target| !TARGETS.contains(target)) {
        bail!("no target {unknown}: expected one of {}", TARGETS.join(", "));
    }
    add(&targets)?;
    for target in &targets {
        println!("{}", built(target)?.display());
    }
    let header = folder().join("include/clutch.h");
    std::fs::create_dir_all(folder().join("include"))?;
    std::fs::copy(root().join("crates/clutch-c/include/clutch.h"), &header)?;
    println!("{}", header.display());
    arduino(&targets)
}

/// Targets that Arduino's cores have, and where its builder looks for their library.
const ARDUINO: [(&str, &str); 3] = [
    ("thumbv6m-none-eabi", "cortex-m0plus"),
    ("thumbv7em-none-eabihf", "cortex-m4/fpv4-sp-d16-hard"),
    ("thumbv8m.main-none-eabihf", "cortex-m33/fpv5-sp-d16-hard"),
];

/// The library for Arduino, to be copied into the folder of a sketchbook's libraries.
fn arduino(targets: &[&str]) -> Result<()> {
    let (from, to) = (root().join("examples/arduino/Clutch"), folder().join("arduino/Clutch"));
    for (target, place) in ARDUINO.iter().filter(|(target, _)| targets.contains(target)) {
        let place = to.join("src").join(place);
        std::fs::create_dir_all(&place)?;
        std::fs::copy(folder().join(target).join("libclutch.a"), place.join("libclutch.a"))?;
    }
    if !to.exists() {
        return Ok(());
    }
    std::fs::create_dir_all(to.join("examples/Axis"))?;
    for file in ["library.properties", "src/ClutchAxis.h", "examples/Axis/Axis.ino"] {
        std::fs::copy(from.join(file), to.join(file)).with_context(|| file.to_owned())?;
    }
    std::fs::copy(root().join("crates/clutch-c/include/clutch.h"), to.join("src/clutch.h"))?;
    println!("{}", to.display());
    Ok(())
}

/// Adds the targets to the compiler.
pub(crate) fn add(targets: &[&str]) -> Result<()> {
    program("rustup").args(["target", "add"]).args(targets).run().context("rustup cannot add the targets")
}

/// The folder of the libraries.
pub(crate) fn folder() -> PathBuf {
    root().join("target/libclutch")
}

/// Builds the library of a target; its path. One in which a panic can be reached is refused.
pub(crate) fn built(target: &str) -> Result<PathBuf> {
    let built = compiled(target, "staticlib", &folder().join("build"))?;
    if names(&built, SURVIVED)? {
        bail!("a panic can be reached in libclutch for {target}\n{}", panicking(target, &built)?);
    }
    let library = folder().join(target).join("libclutch.a");
    std::fs::create_dir_all(folder().join(target))?;
    std::fs::copy(&built, &library)?;
    Ok(library)
}

/// The functions of a library that call for a panic, where they can be named: on Arm cores.
fn panicking(target: &str, library: &Path) -> Result<String> {
    if !target.starts_with("thumb") {
        return Ok(format!("cargo xtask libclutch {} names the function", TARGETS[1]));
    }
    panic_path::no_objdump().map_or_else(|| panic_path::of_library(library), Ok)
}

/// True if a panic that is put in is seen, and the functions that are named for it. Built where nobody takes it for a library.
pub(crate) fn sees_a_panic(target: &str) -> Result<(bool, String)> {
    let library = compiled(target, "staticlib,control", &root().join("target/libclutch_control"))?;
    Ok((names(&library, SURVIVED)?, panicking(target, &library)?))
}

fn compiled(target: &str, features: &str, cache: &Path) -> Result<PathBuf> {
    let args = ["rustc", "--locked", "--package", "clutch-c", "--profile", "c", "--crate-type", "staticlib"];
    let build = cargo(args).args(["--features", features, "--target", target, "--target-dir"]).arg(cache);
    let (done, text) = build.silently()?;
    ensure!(done, "libclutch does not build for {target}:\n{text}");
    Ok(cache.join(target).join("c/libclutch.a"))
}

/// True if a file has this text in it.
fn names(file: &Path, text: &[u8]) -> Result<bool> {
    Ok(std::fs::read(file)?.windows(text.len()).any(|window| window == text))
}
