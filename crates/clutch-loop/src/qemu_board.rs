//! The emulated board: a Cortex-M4F in `qemu-system-arm`, asked in lockstep.

use crate::lockstep_board::LockstepBoard;
use clutch_node::controller_lockstep::{Exchange, LONGEST};
use clutch_wire::{BoardState, Decoder, Message, STATUS_STATE, Set, encode};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{CWD, FileType, Mode, mknodat};
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};

/// The emulator's command.
pub const PROGRAM: &str = "qemu-system-arm";

/// Longest time for an answer: it takes microseconds, but a machine may stall.
const PATIENCE_S: u32 = 20;

/// The emulated board could not be started, or ended.
#[derive(Debug, thiserror::Error)]
pub enum QemuError {
    /// No emulator.
    #[error(
        "{PROGRAM} was not found. Install it (on Debian and Ubuntu: apt-get install qemu-system-arm), or run \
         `clutch sim`, which needs none"
    )]
    NoProgram,
    /// No image.
    #[error("{}: no such file. Build the emulated board's image: cargo xtask firmware build", path.display())]
    NoImage {
        /// The path at which it was looked for.
        path: PathBuf,
    },
    /// The system.
    #[error("the emulated board could not be {what}: {error}")]
    System {
        /// The action that was tried.
        what: &'static str,
        /// The system's answer.
        error: std::io::Error,
    },
    /// It has ended.
    #[error("the emulated board has ended ({status}): {said}")]
    Ended {
        /// Its exit status.
        status: String,
        /// The text that the emulator printed.
        said: String,
    },
    /// It does not answer.
    #[error("the emulated board has not answered for {PATIENCE_S} s")]
    Silent,
    /// It answers something else.
    #[error("the emulated board's answer is none: {0}")]
    Garbled(&'static str),
}

fn system(what: &'static str) -> impl Fn(std::io::Error) -> QemuError {
    move |error| QemuError::System { what, error }
}

/// A folder of its own that is gone with it.
struct Folder(PathBuf);

impl Folder {
    fn new() -> std::io::Result<Folder> {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("clutch-board-{}-{number}", std::process::id()));
        std::fs::create_dir(&path)?;
        Ok(Folder(path))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn found(image: &Path) -> Result<PathBuf, QemuError> {
    image.canonicalize().map_err(|_| QemuError::NoImage { path: image.to_owned() })
}

fn started(image: &Path, folder: &Folder, serial: &[&str]) -> Result<Child, QemuError> {
    Command::new(PROGRAM)
        .args(["-machine", "mps2-an386", "-display", "none", "-monitor", "none"])
        .args(serial)
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(image)
        .current_dir(&folder.0)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => QemuError::NoProgram,
            _ => QemuError::System { what: "started", error },
        })
}

/// An error if it has ended.
fn alive(child: &mut Child) -> Result<(), QemuError> {
    let Some(status) = child.try_wait().map_err(system("looked at"))? else { return Ok(()) };
    let mut said = String::new();
    if let Some(mut stderr) = child.stderr.take() {
        let _ = stderr.read_to_string(&mut said); // the status alone says enough, too
    }
    Err(QemuError::Ended { status: status.to_string(), said: said.trim().to_owned() })
}

/// A board that is emulated, in lockstep.
pub struct QemuBoard {
    child: Child,
    requests: File,
    answers: File,
    buffer: Box<[u8; LONGEST]>,
    _folder: Folder,
}

impl QemuBoard {
    /// Starts a board with an image.
    ///
    /// # Errors
    /// No emulator, no image, no memory.
    pub fn start(image: &Path) -> Result<QemuBoard, QemuError> {
        let image = image.canonicalize().map_err(|_| QemuError::NoImage { path: image.to_owned() })?;
        let folder = Folder::new().map_err(system("given a folder"))?;
        // Both ends of both files are open here: opening waits for nobody.
        let open = |name: &str| -> std::io::Result<File> {
            let path = folder.0.join(name);
            mknodat(CWD, &path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0)?;
            OpenOptions::new().read(true).write(true).open(path)
        };
        let requests = open("to_fw").map_err(system("given its lines"))?;
        let answers = open("from_fw").map_err(system("given its lines"))?;
        let child = started(&image, &folder, &["-serial", "null"])?;
        Ok(QemuBoard { child, requests, answers, buffer: Box::new([0; LONGEST]), _folder: folder })
    }

    /// A request, and the board's answer.
    ///
    /// # Errors
    /// It has ended, or does not answer.
    pub fn exchange(&mut self, request: &Exchange<'_>) -> Result<Exchange<'_>, QemuError> {
        let length = request.write(&mut *self.buffer).ok_or(QemuError::Garbled("the request is too long"))?;
        self.requests.write_all(&self.buffer[..length]).map_err(system("asked"))?;
        let mut used = 0;
        loop {
            self.wait()?;
            used += self.answers.read(&mut self.buffer[used..]).map_err(system("heard"))?;
            match Exchange::length(&self.buffer[..used]) {
                Some(length) if length > LONGEST => return Err(QemuError::Garbled("it is too long")),
                Some(length) if length <= used => break,
                _ => {}
            }
        }
        Exchange::read(&self.buffer[..used]).ok_or(QemuError::Garbled("it is cut off"))
    }

    /// Waits for bytes; looks now and then whether the emulator lives.
    fn wait(&mut self) -> Result<(), QemuError> {
        let second = Timespec { tv_sec: 1, tv_nsec: 0 };
        for _ in 0..PATIENCE_S {
            let mut fds = [PollFd::new(&self.answers, PollFlags::IN)];
            match poll(&mut fds, Some(&second)) {
                Ok(0) | Err(rustix::io::Errno::INTR) => {}
                Ok(_) => return Ok(()),
                Err(error) => return Err(system("heard")(error.into())),
            }
            alive(&mut self.child)?;
        }
        Err(QemuError::Silent)
    }

    /// Lets the board's processor fail, as a test of what its last word is: the answer's frames.
    ///
    /// # Errors
    /// As [`QemuBoard::exchange`].
    pub fn fail(&mut self) -> Result<Exchange<'_>, QemuError> {
        self.exchange(&Exchange { time_ns: u64::MAX, lateness_us: 0, host: &[], daq: &[] })
    }

    /// The exit code of the emulator; waits for its end.
    ///
    /// # Errors
    /// The system's.
    pub fn ended(mut self) -> std::io::Result<Option<i32>> {
        Ok(self.child.wait()?.code())
    }
}

impl Drop for QemuBoard {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A board that is emulated, on its two serial lines. It keeps its own time; in lockstep it is waited for
/// until it has said what it has to say.
pub struct QemuSerialBoard {
    child: Child,
    host: UnixStream,
    daq: UnixStream,
    from_host_line: Decoder,
    from_rig: Decoder,
    said_to_host: Vec<u8>,
    said_to_daq: Vec<u8>,
    _folder: Folder,
}

/// A setting that no board has: its refusal shows that what came before has been heard.
const BARRIER: Message = Message::Set(Set { run: 0, key: u16::MAX, value: 0 });

impl QemuSerialBoard {
    /// Starts a board with an image.
    ///
    /// # Errors
    /// No emulator, no image, no memory.
    pub fn start(image: &Path) -> Result<QemuSerialBoard, QemuError> {
        let image = found(image)?;
        let folder = Folder::new().map_err(system("given a folder"))?;
        let listen = |name: &str| UnixListener::bind(folder.0.join(name));
        let host = listen("host").map_err(system("given its lines"))?;
        let daq = listen("daq").map_err(system("given its lines"))?;
        let line = |name: &str| format!("socket,id={name},path={name}");
        let (h, d) = (line("host"), line("daq"));
        let serial = ["-chardev", &h, "-serial", "chardev:host", "-chardev", &d, "-serial", "chardev:daq"];
        let mut child = started(&image, &folder, &serial)?;
        let mut accept = |listener: &UnixListener| -> Result<UnixStream, QemuError> {
            listener.set_nonblocking(true).map_err(system("reached"))?;
            for _ in 0..PATIENCE_S * 100 {
                match listener.accept() {
                    Ok((stream, _)) => {
                        stream.set_nonblocking(true).map_err(system("reached"))?;
                        return Ok(stream);
                    }
                    Err(e) if e.kind() == std::io::ErrorKind::WouldBlock => alive(&mut child)?,
                    Err(error) => return Err(QemuError::System { what: "reached", error }),
                }
                std::thread::sleep(std::time::Duration::from_millis(10));
            }
            Err(QemuError::Silent)
        };
        let (host, daq) = (accept(&host)?, accept(&daq)?);
        Ok(QemuSerialBoard {
            child,
            host,
            daq,
            from_host_line: Decoder::new(),
            from_rig: Decoder::new(),
            said_to_host: Vec::new(),
            said_to_daq: Vec::new(),
            _folder: folder,
        })
    }

    /// Sends a request to the board, and gives its answer.
    ///
    /// # Errors
    /// It has ended, or does not answer.
    pub fn exchange(&mut self, request: &Exchange<'_>) -> Result<Exchange<'_>, QemuError> {
        self.said_to_host.clear();
        self.said_to_daq.clear();
        // Each frame of encoder and converter makes it say one of these to the host, but for samples before
        // consent.
        let said = |m: &Message| match m {
            Message::Telemetry(_)
            | Message::Hello(_)
            | Message::Configured(_)
            | Message::Armed(_)
            | Message::Pong(_)
            | Message::Stopped(_)
            | Message::Fault(_) => true,
            Message::Refused(m) => m.request != Set::KIND,
            _ => false,
        };
        let decoder = &mut self.from_rig;
        let ready = BoardState::Ready as u8;
        let heard = |m: &Message| !matches!(m, Message::Sample(s) if s.status & STATUS_STATE == ready);
        let frames = request.daq.iter().filter_map(|b| decoder.push(*b)?.ok()).filter(heard).count();
        write(&mut self.daq, request.daq)?;
        self.hear(frames, said)?;
        if !request.host.is_empty() {
            write(&mut self.host, request.host)?;
            write(&mut self.host, encode(&BARRIER).as_bytes())?;
            let barrier = |m: &Message| matches!(m, Message::Refused(r) if r.request == Set::KIND);
            self.hear(1, barrier)?;
        }
        // It wrote to the other line before it told the host of it.
        read(&mut self.daq, &mut self.said_to_daq)?;
        Ok(Exchange { time_ns: u64::MAX, lateness_us: 0, host: &self.said_to_host, daq: &self.said_to_daq })
    }

    /// Hears the board's words to the host until so many are of a kind.
    fn hear(&mut self, mut count: usize, counts: impl Fn(&Message) -> bool) -> Result<(), QemuError> {
        let mut silent = 0;
        while count > 0 {
            let second = Timespec { tv_sec: 1, tv_nsec: 0 };
            let mut fds = [PollFd::new(&self.host, PollFlags::IN)];
            let ready = poll(&mut fds, Some(&second)).map_err(|e| system("heard")(e.into()))?;
            if ready == 0 {
                alive(&mut self.child)?;
                silent += 1;
                if silent >= PATIENCE_S {
                    return Err(QemuError::Silent);
                }
            }
            let before = self.said_to_host.len();
            read(&mut self.host, &mut self.said_to_host)?;
            for byte in &self.said_to_host[before..] {
                if let Some(Ok(message)) = self.from_host_line.push(*byte) {
                    count -= usize::from(count > 0 && counts(&message));
                }
            }
        }
        Ok(())
    }
}

/// Reads the bytes that are there.
fn read(stream: &mut UnixStream, into: &mut Vec<u8>) -> Result<(), QemuError> {
    let mut buffer = [0; 1024];
    loop {
        match stream.read(&mut buffer) {
            Ok(0) => return Err(QemuError::Garbled("a line was closed")),
            Ok(count) => into.extend_from_slice(&buffer[..count]),
            Err(e) if e.kind() == std::io::ErrorKind::WouldBlock => return Ok(()),
            Err(error) => return Err(QemuError::System { what: "heard", error }),
        }
    }
}

fn write(stream: &mut UnixStream, mut bytes: &[u8]) -> Result<(), QemuError> {
    while !bytes.is_empty() {
        match stream.write(bytes) {
            Ok(count) => bytes = &bytes[count..],
            Err(e) if e.kind() == std::io::ErrorKind::WouldBlock => std::thread::yield_now(),
            Err(error) => return Err(QemuError::System { what: "asked", error }),
        }
    }
    Ok(())
}

impl Drop for QemuSerialBoard {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl LockstepBoard for QemuBoard {
    fn exchange(&mut self, request: &Exchange<'_>) -> Result<Exchange<'_>, String> {
        QemuBoard::exchange(self, request).map_err(|e| e.to_string())
    }
}

impl LockstepBoard for QemuSerialBoard {
    fn exchange(&mut self, request: &Exchange<'_>) -> Result<Exchange<'_>, String> {
        QemuSerialBoard::exchange(self, request).map_err(|e| e.to_string())
    }
}
