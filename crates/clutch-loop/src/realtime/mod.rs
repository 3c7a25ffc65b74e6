//! The control thread's clock and its rank among other threads, on Linux.
//!
//! [`enter`] asks the kernel for everything a control thread needs. It never fails: what the
//! system refuses comes back as a sentence that says what it costs and what to do, and the loop
//! runs all the same. [`sleep_until`] and [`wait_readable`] wait against absolute deadlines, so
//! that one late cycle does not shift those after it.
//!
//! The meaning of the settings and the setup of a machine are in `docs/realtime.md`. The lateness of
//! a thread's wake-up on the machine at hand is measured by `benches/latency/lateness.py`.
//!
//! Nothing in [`monotonic_ns`], [`sleep_until`], [`wait_readable`] and [`CycleStats::record`]
//! allocates or takes a lock.

mod stats;
mod system;
mod wake;

pub use stats::{CycleStats, CycleSummary};
pub use system::describe_system;
pub use wake::SampleWake;

use rustix::event::{PollFd, PollFlags, poll};
use rustix::fd::BorrowedFd;
use rustix::io::Errno;
use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, getrlimit};
use rustix::thread::{
    CapabilitySet, ClockId, CpuSet, capabilities, clock_nanosleep_absolute, sched_getaffinity,
    sched_setaffinity, set_current_timer_slack,
};
use rustix::time::{Timespec, clock_gettime};
use std::fs::File;
use std::hint::{black_box, spin_loop};
use std::io::{self, Write};
use std::num::NonZeroU64;
use std::path::Path;
use std::sync::OnceLock;

/// Priority of the control thread unless told otherwise: above the kernel's threaded interrupts
/// (50) it would starve the very driver it waits for.
pub const DEFAULT_PRIORITY: u8 = 49;

/// The highest priority that the control thread may have under SCHED_FIFO: Linux knows 1 to 99.
pub const HIGHEST_PRIORITY: u8 = 99;

/// Stack touched in advance, bytes. The control thread's stack must be at least four times this;
/// that of a Rust thread is 2 MiB.
pub const PREFAULTED_STACK: usize = 128 * 1024;

/// Time before the deadline at which spinning begins unless another is given, µs.
pub const SPIN_US: u32 = 150;

clutch_core::words! {
    /// The way in which a thread waits, by its name.
    pub enum Wait {
        /// The kernel wakes the loop.
        Sleep = "sleep" default,
        /// The loop wakes early and spins.
        Spin = "spin",
    }
}

impl Wait {
    /// The mode, with the time before the deadline at which spinning begins, µs.
    #[must_use]
    pub const fn mode(self, spin_us: u32) -> WaitMode {
        match self {
            Wait::Sleep => WaitMode::Sleep,
            Wait::Spin => WaitMode::SleepSpin { spin_us },
        }
    }
}

/// The way in which a thread waits for its deadline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WaitMode {
    /// The kernel's timer alone: no processor time, but the wake-up is late by tens of
    /// microseconds.
    #[default]
    Sleep,
    /// Wakes early and reads the clock until the deadline. More exact, at the price of processor
    /// time: `spin_us` of each period. A SCHED_FIFO thread that spins more than 95 % of the time is
    /// stopped by the kernel's real-time throttling.
    SleepSpin {
        /// Time before the deadline at which spinning begins, µs. Longer than nearly all wake-ups are
        /// late: see `benches/latency/lateness.py`.
        spin_us: u32,
    },
}

/// The control thread's requests to the kernel. The names are those of ros2_control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RealtimeOptions {
    /// Priority under SCHED_FIFO, 1 to [`HIGHEST_PRIORITY`]. 0 stays with the ordinary scheduler.
    pub thread_priority: u8,
    /// Keep all memory of the process in RAM.
    pub lock_memory: bool,
    /// The core the thread stays on; `None` lets the kernel move it.
    pub cpu_affinity: Option<usize>,
    /// The way in which the thread waits.
    pub wait: WaitMode,
}

impl Default for RealtimeOptions {
    fn default() -> Self {
        RealtimeOptions {
            thread_priority: DEFAULT_PRIORITY,
            lock_memory: true,
            cpu_affinity: None,
            wait: WaitMode::Sleep,
        }
    }
}

/// Makes the calling thread a control thread, as far as the system allows.
///
/// Applies SCHED_FIFO, locked and pre-faulted memory, the pinned core and a timer slack of 1 ns.
/// With a `thread_priority` above 0 it also holds `/dev/cpu_dma_latency` at 0 until the process
/// ends, so that the processor does not enter deep sleep states, from which it wakes late.
///
/// Call it on the control thread, after all threads it needs have been started and all memory has
/// been allocated. Threads started by it later run under the ordinary scheduler.
///
/// Returns one sentence for each thing the system refused, with the remedy. An empty list: all
/// was granted.
#[must_use]
pub fn enter(options: &RealtimeOptions) -> Vec<String> {
    let mut notes = Vec::new();
    if let Some(core) = options.cpu_affinity {
        notes.extend(pin(core));
    }
    // SCHED_FIFO ignores the slack; the ordinary scheduler adds 50 µs without this.
    if let Err(error) = set_current_timer_slack(NonZeroU64::new(1)) {
        notes.push(format!("timer slack: not set to 1 ns ({error}); wake-ups may be 50 µs later"));
    }
    touch_stack();
    if options.lock_memory {
        notes.extend(lock_memory());
    }
    if options.thread_priority > 0 {
        notes.extend(stay_awake());
        // Last: from here on this thread may keep others from running.
        notes.extend(set_fifo(options.thread_priority));
    }
    notes
}

fn pin(core: usize) -> Option<String> {
    let allowed = sched_getaffinity(None).ok();
    let may = |core: usize| allowed.as_ref().is_none_or(|set| core < CpuSet::MAX_CPU && set.is_set(core));
    let refusal = if core >= CpuSet::MAX_CPU || !may(core) {
        "no such core, or one that is kept from this process".to_owned()
    } else {
        let mut set = CpuSet::new();
        set.set(core);
        match sched_setaffinity(None, &set) {
            Ok(()) => return None,
            Err(error) => error.to_string(),
        }
    };
    let cores = allowed.map_or_else(String::new, |set| {
        let list: Vec<usize> = (0..CpuSet::MAX_CPU).filter(|&core| set.is_set(core)).collect();
        format!("; this process may use {}", ranges(&list))
    });
    Some(format!("cpu_affinity = {core}: refused ({refusal}){cores}. The kernel may move the thread"))
}

/// `0-3, 6` for [0, 1, 2, 3, 6].
fn ranges(list: &[usize]) -> String {
    let mut out = String::new();
    let mut rest = list.iter().copied().peekable();
    while let Some(first) = rest.next() {
        let mut last = first;
        while rest.peek() == Some(&(last + 1)) {
            last += 1;
            rest.next();
        }
        let comma = if out.is_empty() { "" } else { ", " };
        out += &if first == last { format!("{comma}{first}") } else { format!("{comma}{first}-{last}") };
    }
    out
}

/// Touches the pages below, so that no later call meets one that is not there yet.
#[inline(never)]
fn touch_stack() {
    let mut block = [1_u8; PREFAULTED_STACK];
    black_box(&mut block);
}

fn lock_memory() -> Option<String> {
    let privileged = capabilities(None).is_ok_and(|sets| sets.effective.contains(CapabilitySet::IPC_LOCK));
    let limit = getrlimit(Resource::Memlock).current;
    let kib = limit.unwrap_or(u64::MAX) / 1024;
    let remedy = "allow it with the line `@realtime - memlock unlimited` in \
                  /etc/security/limits.d/realtime.conf, add yourself to the group realtime, log in again";
    // Below a limit, locking what comes later would turn the first allocation beyond it into an
    // out-of-memory abort: a crash in place of a page fault.
    let (flags, partly) = if privileged || limit.is_none() {
        (MlockAllFlags::CURRENT | MlockAllFlags::FUTURE, None)
    } else {
        (
            MlockAllFlags::CURRENT,
            Some(format!(
                "lock_memory: only the memory in use now is locked, as there is a limit ({kib} KiB). Later memory may \
                 cost a page fault; {remedy}"
            )),
        )
    };
    match mlockall(flags) {
        Ok(()) => partly,
        Err(error) => Some(format!(
            "lock_memory: refused ({error}; the limit is {kib} KiB). A page that was moved out of RAM delays a cycle by milliseconds; \
             {remedy}"
        )),
    }
}

/// The file that keeps the processor awake. It is in force while it is open.
static AWAKE: OnceLock<Option<File>> = OnceLock::new();

fn stay_awake() -> Option<String> {
    let driver = std::fs::read_to_string("/sys/devices/system/cpu/cpuidle/current_driver").ok()?;
    if driver.trim() == "none" {
        return None;
    }
    let hold = || -> io::Result<File> {
        let mut file = File::options().write(true).open("/dev/cpu_dma_latency")?;
        file.write_all(&0_i32.to_ne_bytes())?;
        Ok(file)
    };
    let mut refused = None;
    let held = AWAKE.get_or_init(|| match hold() {
        Ok(file) => Some(file),
        Err(error) => {
            refused = Some(error);
            None
        }
    });
    if held.is_some() {
        return None;
    }
    let why = refused.map_or_else(|| "refused before".to_owned(), |error| error.to_string());
    Some(format!(
        "/dev/cpu_dma_latency: refused ({why}). The processor may sleep deeply between cycles and wake late; give \
         your group write permission to this file by a udev rule (docs/realtime.md), or run as root"
    ))
}

fn set_fifo(priority: u8) -> Option<String> {
    // The system's `sched_param` is the priority alone. Its call and not the C library's, which musl always refuses.
    let param = libc::c_int::from(priority);
    let policy = libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK;
    // SAFETY: `param` lives through the call, which only reads it; 0 names the calling thread.
    let result =
        unsafe { libc::syscall(libc::SYS_sched_setscheduler, 0 as libc::pid_t, policy, &raw const param) };
    if result == 0 {
        return None;
    }
    let error = io::Error::last_os_error();
    let remedy = match error.raw_os_error() {
        Some(libc::EINVAL) => "expected 1 to 99, or 0 for the ordinary scheduler".to_owned(),
        _ => {
            let limit = getrlimit(Resource::Rtprio).current.unwrap_or(u64::MAX).min(99);
            format!(
                "your limit is {limit}. Allow it with the line `@realtime - rtprio 98` in \
                 /etc/security/limits.d/realtime.conf, add yourself to the group realtime, log in again; or give \
                 the program CAP_SYS_NICE: sudo setcap cap_sys_nice,cap_ipc_lock=ep PROGRAM"
            )
        }
    };
    Some(format!(
        "thread_priority = {priority}: refused ({error}). Any busy program can delay a cycle by milliseconds; {remedy}"
    ))
}

/// Time of CLOCK_MONOTONIC, ns. Read without a system call where the kernel offers that (vDSO).
#[must_use]
pub fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    // Both are never negative on this clock.
    (now.tv_sec as u64).wrapping_mul(1_000_000_000).wrapping_add(now.tv_nsec as u64)
}

fn timespec(ns: u64) -> Timespec {
    // At most 1.8·10¹⁰ s and below 10⁹ ns: both fit.
    Timespec { tv_sec: (ns / 1_000_000_000) as i64, tv_nsec: (ns % 1_000_000_000) as _ }
}

/// The time at which sleeping ends and spinning begins, ns.
fn sleep_end(until_ns: u64, mode: WaitMode) -> u64 {
    match mode {
        WaitMode::Sleep => until_ns,
        WaitMode::SleepSpin { spin_us } => until_ns.saturating_sub(u64::from(spin_us).saturating_mul(1000)),
    }
}

/// Returns at the instant `ns` of [`monotonic_ns`], or at once if it is past.
///
/// ```
/// use clutch_loop::realtime::{WaitMode, monotonic_ns, sleep_until};
/// let next = monotonic_ns() + 1_000_000;
/// sleep_until(next, WaitMode::SleepSpin { spin_us: 100 });
/// assert!(monotonic_ns() >= next);
/// ```
pub fn sleep_until(ns: u64, mode: WaitMode) {
    let end = sleep_end(ns, mode);
    let request = timespec(end);
    while monotonic_ns() < end {
        match clock_nanosleep_absolute(ClockId::Monotonic, &request) {
            // A signal: the deadline has not moved, sleep on.
            Ok(()) | Err(Errno::INTR) => {}
            Err(_) => break, // cannot be for this clock; the spinning below still keeps the deadline
        }
    }
    while monotonic_ns() < ns {
        spin_loop();
    }
}

/// The result of [`wait_readable`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Readiness {
    /// A read will not come back empty: bytes, or the news that the other side is gone.
    Readable,
    /// The deadline passed.
    Timeout,
    /// The other side is gone and nothing is left to read.
    HungUp,
}

/// Waits until `fd` can be read, but not beyond the instant `until_ns` of [`monotonic_ns`].
///
/// With [`WaitMode::SleepSpin`] the last `spin_us` before the deadline are spent asking again and
/// again, without sleep: for a loop paced by the board's samples, choose `until_ns` and `spin_us`
/// such that the sample is expected in that window.
#[must_use]
pub fn wait_readable(fd: BorrowedFd<'_>, until_ns: u64, mode: WaitMode) -> Readiness {
    let end = sleep_end(until_ns, mode);
    loop {
        let now = monotonic_ns();
        let seen = poll_once(fd, end.saturating_sub(now));
        if let Some(seen) = seen {
            return seen;
        }
        let now = monotonic_ns();
        if now >= until_ns {
            return Readiness::Timeout;
        }
        if now >= end {
            spin_loop();
        }
    }
}

fn poll_once(fd: BorrowedFd<'_>, timeout_ns: u64) -> Option<Readiness> {
    let mut fds = [PollFd::from_borrowed_fd(fd, PollFlags::IN)];
    match poll(&mut fds, Some(&timespec(timeout_ns))) {
        Ok(0) | Err(Errno::INTR | Errno::AGAIN) => None,
        Ok(_) => {
            let seen = fds[0].revents();
            // Bytes first: what came before the hang-up still counts.
            Some(if seen.contains(PollFlags::IN) { Readiness::Readable } else { Readiness::HungUp })
        }
        Err(_) => Some(Readiness::HungUp),
    }
}

/// A file's only line, without its end; `None` if it cannot be read or is empty.
pub(crate) fn line(path: &Path) -> Option<String> {
    let text = std::fs::read_to_string(path).ok()?;
    let text = text.trim();
    (!text.is_empty()).then(|| text.to_owned())
}

#[cfg(test)]
mod tests;
