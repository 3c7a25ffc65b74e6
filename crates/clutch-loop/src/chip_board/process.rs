//! The process that carries the chip: Python with the module Unicorn.

use super::{ChipFault, ChipKind};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::io::{BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// The module that the model of the chip needs; the tests' requirements pin a version.
pub const MODULE: &str = "unicorn";

/// The variable that names another interpreter than `python3`.
const INTERPRETER: &str = "CLUTCH_PYTHON";

/// The half of the models that is the same for all chips.
const CORE: &str = include_str!("cortex_m.py");

/// Runs a model without a file: the core's half is a module for the chip's.
const LOADER: &str = "import sys, types
core, chip = sys.argv[1:3]
del sys.argv[1:3]
module = sys.modules['cortex_m'] = types.ModuleType('cortex_m')
exec(compile(core, 'cortex_m.py', 'exec'), module.__dict__)
exec(compile(chip, 'chip.py', 'exec'))
";

/// Longest time for an answer: it takes milliseconds, but a machine may stall.
const PATIENCE_S: u32 = 60;

/// The chip could not be started, or ended.
#[derive(Debug, thiserror::Error)]
pub enum ChipError {
    /// No interpreter.
    #[error(
        "{program}: not found, or older than Python 3.11, which the model of the chip needs; {INTERPRETER} names another interpreter"
    )]
    NoPython {
        /// The interpreter.
        program: String,
    },
    /// No engine.
    #[error(
        "{program} has no module {MODULE}, the engine that carries the chip's core: {program} -m pip install {MODULE}"
    )]
    NoModule {
        /// The interpreter.
        program: String,
    },
    /// No image.
    #[error("{}: no such file. Build the board's image: cargo xtask firmware build", path.display())]
    NoImage {
        /// The path at which it was looked for.
        path: PathBuf,
    },
    /// The image has another name than those of the boards.
    #[error(
        "{}: expected a file whose name begins with nucleo- or pico-: the name says on which chip's model it runs",
        path.display()
    )]
    NoModel {
        /// The image.
        path: PathBuf,
    },
    /// The chip cannot have this fault.
    #[error("chip fault \"{fault}\": an {chip} cannot have it")]
    NoFault {
        /// The fault's name.
        fault: &'static str,
        /// The chip's.
        chip: &'static str,
    },
    /// The system.
    #[error("the model of the chip could not be {what}: {error}")]
    System {
        /// The action that was tried.
        what: &'static str,
        /// The system's answer.
        error: std::io::Error,
    },
    /// It has ended.
    #[error("the model of the chip has ended ({status}): {said}")]
    Ended {
        /// Its exit status.
        status: String,
        /// The text that it printed.
        said: String,
    },
    /// It does not answer.
    #[error("the model of the chip has not answered for {PATIENCE_S} s")]
    Silent,
    /// More bytes than a request can take.
    #[error("{0} bytes at once: more than the chip's line takes")]
    TooLong(usize),
    /// The file of counts cannot be written or read.
    #[error("--count: {0}")]
    Counted(String),
}

fn system(what: &'static str) -> impl Fn(std::io::Error) -> ChipError {
    move |error| ChipError::System { what, error }
}

/// State of the chip, or what happened since the last answer: `Flag` in the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Flags(u16);

impl Flags {
    pub(super) const SAMPLED: u16 = 1;
    pub(super) const IN_FAULT: u16 = 1 << 3;
    pub(super) const SPINNING: u16 = 1 << 4;
    pub(super) const LOCKUP: u16 = 1 << 5;
    pub(super) const FLOATING: u16 = 1 << 6;
    pub(super) const STOPPED: u16 = 1 << 7;
    pub(super) const GUARDED: u16 = 1 << 8;
    pub(super) const LAMP: u16 = 1 << 9;

    pub(super) const fn has(self, flag: u16) -> bool {
        self.0 & flag != 0
    }
}

/// An answer of the chip.
#[derive(Clone, Debug, Default)]
pub(super) struct Answer {
    /// Time at which it wants to run next, ns; all ones if never.
    pub(super) next_ns: u64,
    /// The converter's output.
    pub(super) code: u16,
    pub(super) flags: Flags,
    /// Resets since power-up.
    pub(super) resets: u32,
    /// Bytes that it has sent over its line.
    pub(super) sent: Vec<u8>,
}

/// Tries before the run whether a file can be written after it, and leaves nothing.
fn writable(file: &Path) -> std::io::Result<()> {
    let new = !file.exists();
    std::fs::OpenOptions::new().append(true).create(true).open(file)?;
    if new { std::fs::remove_file(file) } else { Ok(()) }
}

/// Numbers of instructions, as JSON.
pub type Counted = serde_json::Value;

/// The interpreter of the models.
fn interpreter() -> String {
    std::env::var(INTERPRETER).unwrap_or_else(|_| "python3".to_owned())
}

/// The reason why no model of a chip runs on this machine: no interpreter, or none with the engine.
#[must_use]
pub fn no_engine() -> Option<ChipError> {
    let program = interpreter();
    match Command::new(&program).args(["-c", &format!("import {MODULE}")]).output() {
        Ok(asked) if asked.status.success() => None,
        Ok(_) => Some(ChipError::NoModule { program }),
        Err(_) => Some(ChipError::NoPython { program }),
    }
}

/// The process.
pub(super) struct Chip {
    child: Child,
    requests: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    program: String,
    count: Option<PathBuf>,
}

impl Chip {
    /// Starts one with an image, for a run with these faults; instructions are counted into a file, if one is named.
    pub(super) fn start(image: &Path, faults: &[ChipFault], count: Option<&Path>) -> Result<Chip, ChipError> {
        let kind = ChipKind::of(image).ok_or_else(|| ChipError::NoModel { path: image.to_owned() })?;
        if let Some(fault) = faults.iter().find(|fault| !kind.has(fault.kind)) {
            return Err(ChipError::NoFault { fault: fault.kind.name(), chip: kind.name() });
        }
        let image = image.canonicalize().map_err(|_| ChipError::NoImage { path: image.to_owned() })?;
        let program = interpreter();
        let mut command = Command::new(&program);
        // -P: a file in the working directory is no module.
        command.args(["-P", "-c", LOADER, CORE, kind.model()]).arg(image);
        if let Some(file) = count {
            writable(file).map_err(|e| ChipError::Counted(format!("{}: {e}", file.display())))?;
            command.arg("--count").arg(file);
        }
        let piped = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = piped.spawn().map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => ChipError::NoPython { program: program.clone() },
            _ => ChipError::System { what: "started", error },
        })?;
        let (Some(requests), Some(answers)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(system("started")(std::io::ErrorKind::BrokenPipe.into()));
        };
        let answers = BufReader::new(answers);
        Ok(Chip { child, requests: Some(requests), answers, program, count: count.map(Path::to_owned) })
    }

    /// A request, and the chip's answer.
    pub(super) fn exchange(
        &mut self,
        now_ns: u64,
        counts: i32,
        faults: u32,
        bytes: &[u8],
    ) -> Result<Answer, ChipError> {
        let length = u16::try_from(bytes.len()).map_err(|_| ChipError::TooLong(bytes.len()))?;
        let mut request = Vec::with_capacity(18 + bytes.len());
        request.extend_from_slice(&now_ns.to_le_bytes());
        request.extend_from_slice(&counts.to_le_bytes());
        request.extend_from_slice(&faults.to_le_bytes());
        request.extend_from_slice(&length.to_le_bytes());
        request.extend_from_slice(bytes);
        let asked = self.requests.as_mut().map(|pipe| pipe.write_all(&request));
        if !matches!(asked, Some(Ok(()))) {
            return Err(self.ended());
        }
        let next_ns = u64::from_le_bytes(self.hear()?);
        let code = u16::from_le_bytes(self.hear()?);
        let flags = Flags(u16::from_le_bytes(self.hear()?));
        let resets = u32::from_le_bytes(self.hear()?);
        let mut sent = vec![0; usize::from(u16::from_le_bytes(self.hear()?))];
        self.read(&mut sent)?;
        Ok(Answer { next_ns, code, flags, resets, sent })
    }

    fn hear<const N: usize>(&mut self) -> Result<[u8; N], ChipError> {
        let mut bytes = [0; N];
        self.read(&mut bytes)?;
        Ok(bytes)
    }

    fn read(&mut self, mut into: &mut [u8]) -> Result<(), ChipError> {
        while !into.is_empty() {
            // An answer is mostly there as a whole.
            if self.answers.buffer().is_empty() {
                let patience = Timespec { tv_sec: PATIENCE_S.into(), tv_nsec: 0 };
                match poll(&mut [PollFd::new(self.answers.get_ref(), PollFlags::IN)], Some(&patience)) {
                    Ok(0) => return Err(ChipError::Silent),
                    Ok(_) => {}
                    Err(rustix::io::Errno::INTR) => continue,
                    Err(error) => return Err(system("heard")(error.into())),
                }
            }
            let count = self.answers.read(into).map_err(system("heard"))?;
            if count == 0 {
                return Err(self.ended());
            }
            into = into.get_mut(count..).unwrap_or_default();
        }
        Ok(())
    }

    /// Reason for its end.
    fn ended(&mut self) -> ChipError {
        self.requests = None;
        let _ = self.child.kill(); // it has closed a line, so that nothing more is to come of it
        let mut said = String::new();
        if let Some(mut stderr) = self.child.stderr.take() {
            let _ = stderr.read_to_string(&mut said); // the status alone says enough, too
        }
        let status = match self.child.wait() {
            Ok(status) => status.to_string(),
            Err(error) => return ChipError::System { what: "looked at", error },
        };
        if said.contains(&format!("No module named '{MODULE}'")) {
            return ChipError::NoModule { program: self.program.clone() };
        }
        if said.to_lowercase().contains("unknown option") {
            return ChipError::NoPython { program: self.program.clone() };
        }
        let last = said.trim().lines().last().unwrap_or_default().to_owned();
        ChipError::Ended { status, said: last }
    }

    /// Ends it; what it has counted.
    pub(super) fn end(mut self) -> Result<Option<Counted>, ChipError> {
        self.requests = None;
        let status = self.child.wait().map_err(system("ended"))?;
        if !status.success() {
            return Err(self.ended());
        }
        let Some(file) = &self.count else { return Ok(None) };
        let text = std::fs::read_to_string(file).map_err(|e| ChipError::Counted(e.to_string()))?;
        serde_json::from_str(&text).map(Some).map_err(|e| ChipError::Counted(e.to_string()))
    }
}

impl Drop for Chip {
    fn drop(&mut self) {
        self.requests = None;
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
