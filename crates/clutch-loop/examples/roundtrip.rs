//! Request and reply of a 20-byte frame through a pseudo-terminal: [`Port`] against the plainest
//! blocking loop of read and write.
//!
//! Both talk to the same kind of echo, a thread that reads and writes without waiting for more;
//! they take turns, a block of requests each, in one run. So the ratios hold on a busy machine,
//! the absolute numbers do not.
//!
//! ```sh
//! cargo run --release -p clutch-loop --example roundtrip
//! ```
//!
//! Options: `--blocks N`, `--requests N` (in a block), `--priority N` (0: ordinary scheduler).

use clutch_loop::port::{Address, Port, SerialOptions};
use clutch_loop::realtime::{
    CycleStats, CycleSummary, Readiness, RealtimeOptions, WaitMode, enter, monotonic_ns, wait_readable,
};
use rustix::fd::{AsFd, AsRawFd, OwnedFd};
use rustix::pty::{OpenptFlags, grantpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::error::Error;
use std::ffi::CString;
use std::path::PathBuf;
use std::thread;

/// Bytes of a frame of the cycle at the most.
const FRAME: usize = 20;

/// One read(2), as a C program would write it.
fn plain_read(fd: &OwnedFd, buf: &mut [u8]) -> isize {
    // SAFETY: `buf` is valid for its length, the descriptor is open.
    unsafe { libc::read(fd.as_raw_fd(), buf.as_mut_ptr().cast(), buf.len()) }
}

/// One write(2).
fn plain_write(fd: &OwnedFd, buf: &[u8]) -> isize {
    // SAFETY: `buf` is valid for its length, the descriptor is open.
    unsafe { libc::write(fd.as_raw_fd(), buf.as_ptr().cast(), buf.len()) }
}

/// A raw pseudo-terminal with an echo behind it; its slave's path and an open slave, blocking.
fn echo(priority: u8) -> Result<(CString, OwnedFd), Box<dyn Error>> {
    let master = rustix::pty::openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
    grantpt(&master)?;
    unlockpt(&master)?;
    let path = ptsname(&master, Vec::new())?;
    let slave = rustix::fs::open(
        &path,
        rustix::fs::OFlags::RDWR | rustix::fs::OFlags::NOCTTY | rustix::fs::OFlags::CLOEXEC,
        rustix::fs::Mode::empty(),
    )?;
    let mut modes = tcgetattr(&slave)?;
    modes.make_raw();
    tcsetattr(&slave, OptionalActions::Now, &modes)?;
    thread::spawn(move || {
        let options = RealtimeOptions { thread_priority: priority, lock_memory: false, ..Default::default() };
        let _ = enter(&options); // the requesting thread reports
        let mut buf = [0; 256];
        loop {
            let count = plain_read(&master, &mut buf);
            if count <= 0 || plain_write(&master, &buf[..count as usize]) != count {
                return;
            }
        }
    });
    Ok((path, slave))
}

/// A block of requests over the plain blocking loop.
fn plain(slave: &OwnedFd, requests: usize, stats: &mut CycleStats) {
    let (frame, mut reply) = ([0x55; FRAME], [0; FRAME]);
    for _ in 0..requests {
        let start = monotonic_ns();
        assert_eq!(plain_write(slave, &frame), FRAME as isize);
        let mut got = 0;
        while got < FRAME {
            let count = plain_read(slave, &mut reply[got..]);
            assert!(count > 0, "the echo is gone");
            got += count as usize;
        }
        stats.record(monotonic_ns() - start);
    }
}

/// The same over [`Port`], waiting with a deadline.
fn ours(port: &mut Port, mode: WaitMode, requests: usize, stats: &mut CycleStats) -> std::io::Result<()> {
    let (frame, mut reply) = ([0x55; FRAME], [0; FRAME]);
    for _ in 0..requests {
        let start = monotonic_ns();
        assert_eq!(port.write(&frame)?, FRAME);
        let until = start + 1_000_000_000;
        let mut got = 0;
        while got < FRAME {
            assert_ne!(wait_readable(port.as_fd(), until, mode), Readiness::Timeout, "no reply within 1 s");
            got += port.read(&mut reply[got..])?;
        }
        stats.record(monotonic_ns() - start);
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let (mut blocks, mut requests, mut priority) = (200_usize, 200_usize, 49_u8);
    let mut args = std::env::args().skip(1);
    while let Some(name) = args.next() {
        let value = args.next().ok_or_else(|| format!("{name}: expected a value after it"))?;
        match name.as_str() {
            "--blocks" => blocks = value.parse()?,
            "--requests" => requests = value.parse()?,
            "--priority" => priority = value.parse()?,
            _ => return Err(format!("{name}: no such option").into()),
        }
    }
    let (_, slave) = echo(priority)?;
    let (path, second_slave) = echo(priority)?;
    let path = PathBuf::from(path.into_string()?);
    let opened = Port::open(&Address::Serial { path, baud: 921_600 }, &SerialOptions::default())?;
    let mut port = opened.port;
    drop(second_slave);

    let mut stats = [CycleStats::new(), CycleStats::new(), CycleStats::new()];
    let options = RealtimeOptions { thread_priority: priority, ..Default::default() };
    for note in opened.notes.into_iter().chain(enter(&options)) {
        eprintln!("note: {note}");
    }
    // Spinning all the time to the reply: the 1 s deadline less 1 s.
    let spin = WaitMode::SleepSpin { spin_us: 1_000_000 };
    let mut warm = CycleStats::new();
    for block in 0..=blocks {
        // The first block warms up. The order turns, so that none always follows the same.
        let [a, b, c] = &mut stats;
        let (a, b, c) = if block == 0 {
            plain(&slave, requests, &mut warm);
            continue;
        } else {
            (a, b, c)
        };
        for turn in 0..3 {
            match (block + turn) % 3 {
                0 => plain(&slave, requests, a),
                1 => ours(&mut port, WaitMode::Sleep, requests, b)?,
                _ => ours(&mut port, spin, requests, c)?,
            }
        }
    }

    let [floor, sleep, spin] = stats.map(|stats| stats.summary());
    let row = |name: &str, s: CycleSummary| {
        let us = |ns: u64| ns as f64 / 1000.0;
        let ratio = |ns: u64, floor: u64| ns as f64 / floor.max(1) as f64;
        println!(
            "{name:<22}{:>9.1}{:>9.1}{:>9.1}{:>10.1}{:>10.2}{:>8.2}",
            us(s.p50_ns),
            us(s.p99_ns),
            us(s.p99_9_ns),
            us(s.max_ns),
            ratio(s.p50_ns, floor.p50_ns),
            ratio(s.p99_ns, floor.p99_ns),
        );
    };
    println!("request and reply of {FRAME} bytes through a pseudo-terminal, {} each", floor.count);
    println!("µs{:>29}{:>9}{:>9}{:>10}{:>10}{:>8}", "p50", "p99", "p99.9", "max", "p50 ×", "p99 ×");
    row("plain, blocking", floor);
    row("Port, sleeping", sleep);
    row("Port, spinning", spin);
    Ok(())
}
