//! Names of functions that call for a panic, where none may be reached.

use crate::run::{Program, program};
use anyhow::Result;
use std::path::Path;

/// They name places in an image; a Debian package has them that a user may not have.
const OBJDUMP: &str = "arm-none-eabi-objdump";
const ADDR2LINE: &str = "arm-none-eabi-addr2line";

/// The function that a panic calls in an image, and that no image has.
const SURVIVED: &str = "__panic_path_survived";

/// True if functions can be named here.
pub(crate) fn has_objdump() -> bool {
    program(OBJDUMP).args(["--version"]).silently().is_ok_and(|(runs, _)| runs)
}

/// The reason why functions are not named, if they cannot be.
pub(crate) fn no_objdump() -> Option<String> {
    (!has_objdump()).then(|| format!("{OBJDUMP} would name the functions that panic; it is not installed"))
}

/// Links an image in spite of a panic.
pub(crate) fn in_spite(image: Program, target: &str) -> Program {
    let flags = format!("target.{target}.rustflags=[\"-C\", \"link-arg=--defsym={SURVIVED}=0\"]");
    image.args(["--config", &flags])
}

/// The places of an image, linked in spite of a panic, that call for one: with all that is compiled into their caller,
/// the innermost first. None if no call is seen in its machine code.
pub(crate) fn of_image(linked: &Path) -> Result<Option<String>> {
    let calls = calls(linked, &[])?;
    if calls.is_empty() {
        return Ok(None);
    }
    let addresses: Vec<String> = calls.into_iter().map(|(_, at)| format!("0x{at}")).collect();
    let (_, text) = program(ADDR2LINE)
        .args(["-i", "-f", "-C", "-p", "-a", "-e"])
        .arg(linked)
        .args(addresses)
        .silently()?;
    Ok(Some(format!("{}: paths to a panic:\n{text}", linked.display())))
}

/// The functions of a static library for an Arm core that call for a panic.
pub(crate) fn of_library(library: &Path) -> Result<String> {
    let mut functions: Vec<String> = calls(library, &["-r"])?.into_iter().map(|(within, _)| within).collect();
    functions.sort();
    functions.dedup();
    Ok(format!("{}: these functions call for a panic:\n{}\n", library.display(), functions.join("\n")))
}

/// Functions that call what panics, and where.
fn calls(code: &Path, more: &[&str]) -> Result<Vec<(String, String)>> {
    let (read, text) = program(OBJDUMP).args(["-d", "-C"]).args(more).arg(code).silently()?;
    anyhow::ensure!(read, "{OBJDUMP}: {text}");
    let (mut within, mut calls) = ("", Vec::new());
    for line in text.lines() {
        if let Some((_, name)) = line.split_once(" <").filter(|_| line.ends_with(">:")) {
            within = name.trim_end_matches(">:");
        } else if line.contains("core::panicking") && !within.contains("core::panicking") {
            let at = line.split_once(':').map_or("", |(at, _)| at.trim());
            calls.push((within.to_owned(), at.to_owned()));
        }
    }
    Ok(calls)
}
