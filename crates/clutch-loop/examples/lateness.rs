//! The lateness of a thread that wakes at 1 kHz on this machine, in the loop's own wait modes.
//!
//! `benches/latency/lateness.py` runs it in turn with cyclictest. Alone:
//!
//! ```sh
//! cargo run --release -p clutch-loop --example lateness -- --mode spin --cycles 5000
//! ```
//!
//! Options: `--mode sleep|spin`, `--spin-us N`, `--cycles N`, `--period-us N`, `--priority N`,
//! `--cpu N`, `--out FILE` (each cycle's lateness, ns, one a line). An allocation inside the
//! measured loop ends it with an error.

use clutch_loop::realtime::{CycleStats, RealtimeOptions, WaitMode, enter, monotonic_ns, sleep_until};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::error::Error;
use std::io::Write;

/// Counts the calling thread's allocations.
struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: passes everything on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // A thread that is ending has no counter any more; what it allocates is not measured.
        let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn main() -> Result<(), Box<dyn Error>> {
    let (mut mode, mut spin_us, mut cycles, mut period_us) =
        ("sleep".to_owned(), 200_u32, 5000_usize, 1000_u64);
    let (mut priority, mut cpu, mut out) = (80_u8, None, None);
    let mut args = std::env::args().skip(1);
    while let Some(name) = args.next() {
        let value = args.next().ok_or_else(|| format!("{name}: expected a value after it"))?;
        match name.as_str() {
            "--mode" => mode = value,
            "--spin-us" => spin_us = value.parse()?,
            "--cycles" => cycles = value.parse()?,
            "--period-us" => period_us = value.parse()?,
            "--priority" => priority = value.parse()?,
            "--cpu" => cpu = Some(value.parse()?),
            "--out" => out = Some(value),
            _ => return Err(format!("{name}: no such option").into()),
        }
    }
    let wait = match mode.as_str() {
        "sleep" => WaitMode::Sleep,
        "spin" => WaitMode::SleepSpin { spin_us },
        _ => return Err(format!("--mode = {mode:?}: expected sleep or spin").into()),
    };

    // All memory first: what `enter` finds is locked.
    let mut samples = vec![1_u64; cycles];
    let mut stats = CycleStats::new();
    let options = RealtimeOptions { thread_priority: priority, lock_memory: true, cpu_affinity: cpu, wait };
    for note in enter(&options) {
        eprintln!("note: {note}");
    }

    let before = ALLOCATIONS.get();
    let period = period_us * 1000;
    let mut deadline = monotonic_ns() + 10 * period;
    for sample in &mut samples {
        sleep_until(deadline, wait);
        let late = monotonic_ns() - deadline;
        *sample = late;
        stats.record(late);
        deadline += period;
        // An overrun: the cycles that are past are left out, as in the loop.
        let now = monotonic_ns();
        if now > deadline {
            deadline += (now - deadline).div_ceil(period) * period;
        }
    }
    let allocations = ALLOCATIONS.get() - before;

    println!("{mode}: {}; allocations in the loop: {allocations}", stats.summary());
    if let Some(path) = out {
        let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
        for sample in samples {
            writeln!(file, "{sample}")?;
        }
        file.flush()?;
    }
    if allocations > 0 {
        return Err("the loop allocated".into());
    }
    Ok(())
}
