//! Starts `clutch`, and reads its output.

pub(crate) use clutch_tests::command as program;

use clutch_loop::port::{Endpoint, PseudoTerminal};
use clutch_loop::realtime::{WaitMode, monotonic_ns};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, RwLock, RwLockReadGuard, RwLockWriteGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

static MACHINE: RwLock<()> = RwLock::new(());

/// The machine for this test alone: two loops and a compiler on two cores disturb each other.
pub(crate) fn alone() -> RwLockWriteGuard<'static, ()> {
    program();
    MACHINE.write().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// For a test in which nothing runs in real time.
pub(crate) fn beside_others() -> RwLockReadGuard<'static, ()> {
    program();
    MACHINE.read().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// A folder of a test's own, empty.
pub(crate) fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("loop").join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).expect("the folder can be made");
    path
}

/// A text without its lines, which are broken between words.
pub(crate) fn flat(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The end of a command.
#[derive(Debug)]
pub(crate) struct Done {
    pub(crate) code: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Done {
    /// Fails unless it ended with this code.
    #[track_caller]
    pub(crate) fn expect(self, code: i32) -> Done {
        assert_eq!(self.code, Some(code), "exit code\n{}\n{}", self.out, self.err);
        self
    }

    /// Fails unless the message on standard error has all these words.
    #[track_caller]
    pub(crate) fn says(self, words: &[&str]) -> Done {
        let err = flat(&self.err);
        for word in words {
            assert!(err.contains(&flat(word)), "expected \"{word}\" in:\n{}\n{}", self.err, self.out);
        }
        self
    }

    /// Fails unless standard output has all these words.
    #[track_caller]
    pub(crate) fn prints(self, words: &[&str]) -> Done {
        let out = flat(&self.out);
        for word in words {
            assert!(out.contains(&flat(word)), "expected \"{word}\" in:\n{}\n{}", self.out, self.err);
        }
        self
    }

    /// Standard output as JSON.
    #[track_caller]
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|e| panic!("{e}:\n{}\n{}", self.out, self.err))
    }
}

/// A command that runs.
pub(crate) struct Running {
    child: Child,
    out: JoinHandle<String>,
    err: JoinHandle<String>,
}

fn reader(mut pipe: impl Read + Send + 'static) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        let _ = pipe.read_to_end(&mut bytes); // a child that was killed ends it too
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

pub(crate) fn start(mut command: Command) -> Running {
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let out = reader(child.stdout.take().expect("piped"));
    let err = reader(child.stderr.take().expect("piped"));
    Running { child, out, err }
}

impl Running {
    pub(crate) fn signal(&self, signal: Signal) {
        let pid = Pid::from_child(&self.child);
        kill_process(pid, signal).expect("the process is there");
    }

    pub(crate) fn is_running(&mut self) -> bool {
        self.child.try_wait().expect("a child").is_none()
    }

    /// Waits for its end, but not for ever.
    pub(crate) fn done(mut self) -> Done {
        let end = Instant::now() + Duration::from_secs(120);
        while self.is_running() {
            if Instant::now() > end {
                let _ = self.child.kill();
                let (out, err) = (self.out.join().unwrap(), self.err.join().unwrap());
                panic!("the command did not end within two minutes:\n{out}\n{err}");
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        let code = self.child.wait().expect("a child").code();
        Done { code, out: self.out.join().unwrap(), err: self.err.join().unwrap() }
    }
}

/// `clutch` with these arguments.
pub(crate) fn clutch(args: &[&str]) -> Command {
    let mut command = Command::new(program());
    command.args(args);
    command
}

/// Runs `clutch` to its end.
pub(crate) fn run(args: &[&str]) -> Done {
    start(clutch(args)).done()
}

/// True if this user may start programs that ordinary ones do not hold up.
fn may_have_priority() -> bool {
    static MAY: OnceLock<bool> = OnceLock::new();
    *MAY.get_or_init(|| {
        let mut chrt = Command::new("chrt");
        chrt.args(["-f", "40", "true"]).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
    })
}

/// A line that a board printed, and when it was read.
#[derive(Clone, Debug)]
pub(crate) struct Line {
    pub(crate) text: String,
    pub(crate) seen: Instant,
}

impl Line {
    /// The board's time in front of a line, s.
    #[track_caller]
    pub(crate) fn time(&self) -> f64 {
        let number = self.text.split_whitespace().next().and_then(|word| word.parse().ok());
        number.unwrap_or_else(|| panic!("no time in \"{}\"", self.text))
    }
}

/// `clutch daq` in a process of its own.
pub(crate) struct Board {
    child: Child,
    lines: Arc<Mutex<Vec<Line>>>,
    reader: Option<JoinHandle<()>>,
    /// Its address.
    pub(crate) port: String,
}

impl Board {
    pub(crate) fn start(args: &[&str]) -> Board {
        // A real board shares no processor with a compiler.
        let mut command = if may_have_priority() {
            let mut command = Command::new("chrt");
            command.args(["-f", "40"]).arg(program());
            command
        } else {
            Command::new(program())
        };
        command.arg("daq").args(args);
        let mut child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::inherit())
            .spawn()
            .expect("the board starts");
        let out = child.stdout.take().expect("piped");
        let lines = Arc::new(Mutex::new(Vec::new()));
        let heard = lines.clone();
        let reader = std::thread::spawn(move || {
            for text in BufReader::new(out).lines().map_while(Result::ok) {
                heard.lock().unwrap().push(Line { text, seen: Instant::now() });
            }
        });
        let mut board = Board { child, lines, reader: Some(reader), port: String::new() };
        board.port = board.wait_for(0, "").text;
        board
    }

    /// Lines so far.
    pub(crate) fn heard(&self) -> usize {
        self.lines.lock().unwrap().len()
    }

    /// The first line from number `from` on that has this word; waits for it.
    #[track_caller]
    pub(crate) fn wait_for(&self, from: usize, word: &str) -> Line {
        let end = Instant::now() + Duration::from_secs(20);
        while Instant::now() < end {
            let found = self.lines.lock().unwrap().iter().skip(from).find(|l| l.text.contains(word)).cloned();
            match found {
                Some(line) => return line,
                None => std::thread::sleep(Duration::from_micros(500)),
            }
        }
        panic!("the board did not say \"{word}\":\n{}", self.text());
    }

    pub(crate) fn text(&self) -> String {
        self.lines.lock().unwrap().iter().map(|line| line.text.clone() + "\n").collect()
    }

    /// As when somebody pulls the plug.
    pub(crate) fn kill(&mut self) {
        self.child.kill().expect("the board runs");
        let _ = self.child.wait();
    }

    /// Interrupts it; gives its whole output.
    pub(crate) fn end(mut self) -> String {
        let _ = kill_process(Pid::from_child(&self.child), Signal::TERM);
        let status = self.child.wait().expect("a child");
        if let Some(reader) = self.reader.take() {
            reader.join().expect("the reader ends with the board");
        }
        let text = self.text();
        assert!(status.success(), "{status}:\n{text}");
        text
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Another device on a pseudo-terminal: it answers bytes with bytes.
pub(crate) struct Device {
    pub(crate) path: PathBuf,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Device {
    pub(crate) fn start(mut answer: impl FnMut(&[u8]) -> Vec<u8> + Send + 'static) -> Device {
        let (mut terminal, path) = PseudoTerminal::open().expect("a pseudo-terminal");
        let stop = Arc::new(AtomicBool::new(false));
        let flag = stop.clone();
        let thread = std::thread::spawn(move || {
            let mut buffer = [0; 1024];
            while !flag.load(Ordering::Relaxed) {
                while terminal.service().expect("the line is there").is_some() {}
                let count = terminal.read(&mut buffer).expect("the line is there");
                if count > 0 {
                    let answer = answer(&buffer[..count]);
                    let _ = terminal.write(&answer);
                }
                let _ = terminal.wait(monotonic_ns() + 5_000_000, WaitMode::Sleep);
            }
        });
        Device { path, stop, thread: Some(thread) }
    }

    pub(crate) fn port(&self) -> &str {
        self.path.to_str().expect("a path of the system")
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Reads a log.
#[track_caller]
pub(crate) fn read_log(path: &Path) -> clutch_log::Log {
    clutch_log::read(path, &clutch_log::Limits::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// Replays a log with the command: its outputs are the same.
#[track_caller]
pub(crate) fn replays_identically(log: &Path) {
    run(&["replay", log.to_str().unwrap()]).expect(0).prints(&["identical over "]);
}

/// Repeats a run that the machine, and not the loop, has spoilt. A user who may not have priority, on a machine that
/// builds beside the test, needs dozens of attempts, most of which end at once.
pub(crate) fn unless_held_up<R>(what: &str, mut attempt: impl FnMut() -> Result<R, String>) -> R {
    const PATIENCE: Duration = Duration::from_secs(180);
    let (begin, mut reasons) = (Instant::now(), String::new());
    while begin.elapsed() < PATIENCE {
        match attempt() {
            Ok(done) => return done,
            Err(reason) => {
                println!("{what}: repeated, as {reason}");
                reasons += &format!("{reason}\n");
                std::thread::sleep(Duration::from_millis(100));
            }
        }
    }
    panic!("{what}: held up for {PATIENCE:?}; this needs a quieter machine:\n{reasons}");
}

/// xorshift64*.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    /// From `low` to below `high`.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }
}
