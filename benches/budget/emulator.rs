//! Builds and runs the images.

use anyhow::{Context, Result, bail};
use std::collections::BTreeMap;
use std::fmt::{Display, Formatter};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The targets of the boards' cores: a Cortex-M4F, and a Cortex-M0+.
pub(crate) const TARGETS: [&str; 2] = ["thumbv7em-none-eabihf", "thumbv6m-none-eabi"];
const QEMU: &str = "qemu-system-arm";
const BOARD: [&str; 9] = [
    "-machine",
    "mps2-an386",
    "-display",
    "none",
    "-monitor",
    "none",
    "-serial",
    "null",
    "-semihosting-config",
];

/// The image's output for one function.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Counts {
    pub(crate) calls: usize,
    pub(crate) least: u64,
    pub(crate) mean: u64,
    pub(crate) most: u64,
}

impl Display for Counts {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} / {} / {}", self.least, self.mean, self.most)
    }
}

/// The whole output.
pub(crate) struct Measured {
    /// In the order of the measurements.
    pub(crate) names: Vec<String>,
    pub(crate) counts: BTreeMap<String, Counts>,
}

/// The reason why there is nothing to examine; not an error on a machine that lacks the tools.
pub(crate) fn missing(program: &str, option: &str) -> Option<String> {
    let runs = Command::new(program).arg(option).stdout(Stdio::null()).stderr(Stdio::null()).status();
    (!runs.is_ok_and(|s| s.success())).then(|| format!("{program} is not there"))
}

/// A message if the emulator is missing.
pub(crate) fn no_emulator() -> Option<String> {
    missing(QEMU, "--version")
}

/// A message if images cannot be built.
pub(crate) fn no_target() -> Option<String> {
    let missing = TARGETS.into_iter().find(|target| {
        let asked = Command::new("rustc").args(["--print", "target-libdir", "--target", target]).output();
        asked.is_ok_and(|asked| !Path::new(String::from_utf8_lossy(&asked.stdout).trim()).is_dir())
    })?;
    Some(format!("a target is not there: rustup target add {missing}"))
}

/// Builds the images of a board, those that are tested and flashed; the folder that they are in. With `features` also the
/// one that measures, which has no other builder: tests beside may build the board's images at any time.
pub(crate) fn build(
    firmware: &Path,
    (package, goal): (&str, &str),
    features: Option<&str>,
) -> Result<PathBuf> {
    let target = firmware.join("../target/firmware");
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let build = |selected: &[&str]| -> Result<()> {
        let mut command = Command::new(&cargo);
        command.current_dir(firmware).args(["build", "--release", "--locked", "--package", package]);
        command.args(["--target", goal, "--target-dir"]).arg(&target).args(selected);
        // Flags and targets that were meant for the host.
        for name in ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "CARGO_BUILD_TARGET"] {
            command.env_remove(name);
        }
        if !command.status().context("cargo cannot be started")?.success() {
            bail!("the images cannot be built");
        }
        Ok(())
    };
    build(&[])?;
    if let Some(features) = features {
        build(&["--bin", "budget", "--features", features])?;
    }
    Ok(target.join(goal).join("release"))
}

fn qemu(image: &Path) -> Command {
    let mut command = Command::new(QEMU);
    command.args(BOARD).args(["enable=on,target=native", "-kernel"]).arg(image);
    command
}

/// Runs the image so that it counts instructions.
pub(crate) fn measure(image: &Path) -> Result<Measured> {
    let run = qemu(image).args(["-icount", "shift=7,align=off,sleep=off"]).output()?;
    // The console of the emulated board.
    let text = String::from_utf8(run.stderr)?;
    if !run.status.success() {
        bail!("the image ended with {}: {text}", run.status);
    }
    let mut measured = Measured { names: Vec::new(), counts: BTreeMap::new() };
    for line in text.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        match &words[..] {
            // Three instructions: the frame is made and unmade.
            ["nothing", "1" | "3"] => {}
            ["nothing", n] => bail!("an empty function is counted as {n} instructions"),
            ["differs", "0"] => {}
            ["differs", n] => bail!("the law in C answers {n} times otherwise than ours"),
            [name, calls, least, mean, most] => {
                let number = |w: &str| w.parse::<u64>().with_context(|| line.to_owned());
                let counts = Counts {
                    calls: number(calls)? as usize,
                    least: number(least)?,
                    mean: number(mean)?,
                    most: number(most)?,
                };
                measured.names.push((*name).to_owned());
                measured.counts.insert((*name).to_owned(), counts);
            }
            _ => bail!("the image printed: {line}"),
        }
    }
    Ok(measured)
}

/// Runs the image; the addresses executed within the given ranges, in their order.
pub(crate) fn trace(image: &Path, ranges: &[(u32, u32)]) -> Result<Vec<u32>> {
    let log = image.with_extension("trace");
    let filter: Vec<String> = ranges.iter().map(|(a, n)| format!("{a:#x}+{n:#x}")).collect();
    let run = qemu(image)
        .args(["-d", "in_asm,exec,nochain", "-dfilter", &filter.join(","), "-D"])
        .arg(&log)
        .output()?;
    if !run.status.success() {
        bail!("the traced image ended with {}: {}", run.status, String::from_utf8_lossy(&run.stderr));
    }
    let addresses = executed(BufReader::new(std::fs::File::open(&log)?))?;
    std::fs::remove_file(&log)?;
    Ok(addresses)
}

/// The executed addresses of a log, which has a block's instructions when it is translated, and a line whenever it is
/// executed:
///
/// ```text
/// IN: step_pd
/// 0x00007da0:  b580       push     {r7, lr}
///
/// Trace 0: 0x7f821c000240 [00400000/00007da0/00000b01/ff000200] step_pd
/// ```
fn executed(log: impl BufRead) -> Result<Vec<u32>> {
    let (mut addresses, mut translated) = (Vec::new(), Vec::new());
    // By the place of their translation, which another block may take later.
    let mut blocks: BTreeMap<String, Vec<u32>> = BTreeMap::new();
    for line in log.lines() {
        let line = line?;
        let hex = |text: &str| u32::from_str_radix(text, 16).ok();
        if let Some(rest) = line.strip_prefix("Trace 0: ") {
            let place = rest.split(' ').next().unwrap_or_default();
            let begin = rest.split('/').nth(1).and_then(hex);
            if translated.first().copied() == begin {
                blocks.insert(place.to_owned(), std::mem::take(&mut translated));
            }
            let block = blocks.get(place).filter(|block| block.first().copied() == begin);
            addresses.extend(block.with_context(|| format!("no block for {line}"))?);
        } else if let Some((address, _)) = line.strip_prefix("0x").and_then(|rest| rest.split_once(": ")) {
            // Without a disassembler a block is one line of bytes.
            let one = !line.contains("OBJD");
            translated.push(hex(address).filter(|_| one).with_context(|| format!("no instruction: {line}"))?);
        } else if line.starts_with("IN: ") {
            translated.clear();
        } else if !line.trim_matches('-').is_empty() {
            bail!("not a line of a trace: {line}");
        }
    }
    Ok(addresses)
}
