//! Builds and runs the images.

use anyhow::{Context, Result, bail};
use std::collections::BTreeMap;
use std::fmt::{Display, Formatter};
use std::io::{BufRead, BufReader, Lines};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::rc::Rc;

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

impl Counts {
    /// These and others, of the same code.
    pub(crate) fn and(&self, other: &Counts) -> Counts {
        let sum = |c: &Counts| c.mean * c.calls as u64;
        let calls = self.calls + other.calls;
        Counts {
            calls,
            least: self.least.min(other.least),
            mean: (sum(self) + sum(other)) / calls.max(1) as u64,
            most: self.most.max(other.most),
        }
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

/// Runs the image, and hands over the addresses executed within the given ranges, in their order, while it runs: the
/// emulator's log of them has more than a gigabyte.
pub(crate) fn trace<T>(
    image: &Path,
    ranges: &[(u32, u32)],
    follow: impl FnOnce(&mut dyn Iterator<Item = u32>) -> T,
) -> Result<T> {
    let filter: Vec<String> = ranges.iter().map(|(a, n)| format!("{a:#x}+{n:#x}")).collect();
    let mut run = qemu(image)
        .args(["-d", "in_asm,exec,nochain", "-dfilter", &filter.join(","), "-D", "/dev/stdout"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped()) // some lines, the console of the board
        .spawn()?;
    let log = run.stdout.take().context("the emulator has no output")?;
    let mut executed = Executed::new(BufReader::new(log));
    let followed = follow(&mut executed);
    executed.by_ref().for_each(drop);
    let failure = executed.failure;
    let run = run.wait_with_output()?;
    if !run.status.success() {
        bail!("the traced image ended with {}: {}", run.status, String::from_utf8_lossy(&run.stderr));
    }
    failure.map_or(Ok(followed), Err)
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
struct Executed<R> {
    lines: Lines<R>,
    /// The block that is being translated.
    translated: Vec<u32>,
    /// By the place of their translation, which another block may take later.
    blocks: BTreeMap<String, Rc<[u32]>>,
    /// The block that is executed, and how much of it has been.
    block: Option<(Rc<[u32]>, usize)>,
    /// The reason why the log went no further.
    failure: Option<anyhow::Error>,
}

impl<R: BufRead> Executed<R> {
    fn new(log: R) -> Self {
        Executed {
            lines: log.lines(),
            translated: Vec::new(),
            blocks: BTreeMap::new(),
            block: None,
            failure: None,
        }
    }

    fn read(&mut self, line: &str) -> Result<()> {
        let hex = |text: &str| u32::from_str_radix(text, 16).ok();
        if let Some(rest) = line.strip_prefix("Trace 0: ") {
            let place = rest.split(' ').next().unwrap_or_default();
            let begin = rest.split('/').nth(1).and_then(hex);
            if self.translated.first().copied() == begin {
                self.blocks.insert(place.to_owned(), std::mem::take(&mut self.translated).into());
            }
            let block = self.blocks.get(place).filter(|block| block.first().copied() == begin);
            self.block = Some((block.with_context(|| format!("no block for {line}"))?.clone(), 0));
        } else if let Some((address, _)) = line.strip_prefix("0x").and_then(|rest| rest.split_once(": ")) {
            // Without a disassembler a block is one line of bytes.
            let one = !line.contains("OBJD");
            let address = hex(address).filter(|_| one).with_context(|| format!("no instruction: {line}"))?;
            self.translated.push(address);
        } else if line.starts_with("IN: ") {
            self.translated.clear();
        } else if !line.trim_matches('-').is_empty() {
            bail!("not a line of a trace: {line}");
        }
        Ok(())
    }
}

impl<R: BufRead> Iterator for Executed<R> {
    type Item = u32;

    fn next(&mut self) -> Option<u32> {
        while self.failure.is_none() {
            if let Some((block, done)) = &mut self.block {
                if let Some(address) = block.get(*done) {
                    *done += 1;
                    return Some(*address);
                }
                self.block = None;
            }
            let read = match self.lines.next()? {
                Ok(line) => self.read(&line),
                Err(error) => Err(error.into()),
            };
            self.failure = read.err();
        }
        None
    }
}
