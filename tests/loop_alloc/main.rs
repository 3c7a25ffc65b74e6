//! Between its first and its last cycle the control thread neither allocates nor frees: an
//! allocator that watches it.

use clutch_core::{DacCode, Target};
use clutch_log::Source;
use clutch_loop::control_loop::{self, ConfiguredRun, LoopOptions, LoopReport, OnDrift, Pace};
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_loop::live_gains::Change;
use clutch_loop::log_thread::LogThread;
use clutch_loop::onlooker;
use clutch_loop::port::{Endpoint, Port, PseudoTerminal, SerialOptions};
use clutch_loop::preflight::Talk;
use clutch_loop::realtime::{RealtimeOptions, WaitMode};
use clutch_loop::sim_board::PATIENT_BOARD;
use clutch_loop::sim_board_server::{self, ServeOptions};
use clutch_loop::station::ControllerStation;
use clutch_loop::watch::Watch;
use clutch_node::ControllerNode;
use clutch_sim::Scenario;
use clutch_sim::scenario::BUILT_IN;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::hint::black_box;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// The system's allocator, and counts of a watched thread's requests.
struct Watching;

thread_local! {
    /// True if this thread is between its first and its last cycle.
    static INSIDE: Cell<bool> = const { Cell::new(false) };
}
static TAKEN: AtomicU64 = AtomicU64::new(0);
static GIVEN_BACK: AtomicU64 = AtomicU64::new(0);
/// Size of the last allocation, bytes: a hint where to look.
static SIZE: AtomicU64 = AtomicU64::new(0);

fn note(counter: &AtomicU64, size: usize) {
    // A thread that ends has lost its flag, and is not a control thread.
    if INSIDE.try_with(Cell::get).unwrap_or(false) {
        counter.fetch_add(1, Ordering::Relaxed);
        SIZE.store(size as u64, Ordering::Relaxed);
    }
}

// SAFETY: every call goes to the system's allocator as it came; counting touches no memory of it.
unsafe impl GlobalAlloc for Watching {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(&TAKEN, layout.size());
        // SAFETY: the caller keeps the contract, which is the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        note(&TAKEN, layout.size());
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        note(&TAKEN, size);
        // SAFETY: as above.
        unsafe { System.realloc(memory, layout, size) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        note(&GIVEN_BACK, layout.size());
        // SAFETY: as above.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Watching = Watching;

/// One run at a time: the counters are the process's.
static ONE: Mutex<()> = Mutex::new(());

struct Watched {
    report: LoopReport,
    taken: u64,
    given_back: u64,
}

/// Two seconds of the loop against the simulated board on a pseudo-terminal, with a log and one that looks on. In tick
/// `spoilt` the path, which the control thread asks, allocates.
fn watched(name: &str, pace: Pace, spoilt: Option<u64>) -> Watched {
    let built_in = BUILT_IN.iter().find(|b| b.name == "board_smc_2").expect("a built-in scenario");
    let set = [("run.duration_s".to_owned(), "2".to_owned())];
    let scenario = Scenario::parse(built_in.name, built_in.toml, &set).unwrap();
    let log = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("loop-alloc-{name}.mcap"));

    // The board, in a thread beside.
    let (mut terminal, _) = PseudoTerminal::open().unwrap();
    let address = terminal.address();
    let stop = Arc::new(AtomicBool::new(false));
    let (flag, rig) = (stop.clone(), scenario.clone());
    let options = ServeOptions {
        faults: Vec::new(),
        seed: 1,
        patient: true,
        wait: WaitMode::Sleep,
        passed: Arc::default(),
    };
    let board =
        std::thread::spawn(move || sim_board_server::serve(&rig, &options, &mut terminal, &flag, |_| ()));

    let mut port = Port::open(&address, &SerialOptions::default()).unwrap().port;
    let built = BuiltRun::<f64>::new(&scenario, 0).unwrap();
    let path = from_scenario::path::<f64>(&scenario).unwrap();
    let path = |tick: u64| -> Target<f64> {
        if Some(tick) == spoilt {
            drop(black_box(Box::new(tick)));
        }
        (path.path)(tick)
    };
    let node = ControllerNode::new(built.controller, built.servo, built.supervisor);
    let mut station = ControllerStation::new(node, &path);
    let hello = Talk::new(&mut port, &mut station).discover(Duration::from_secs(5)).unwrap();
    assert_eq!(hello.board, PATIENT_BOARD);
    let mut built = BuiltRun::<f64>::new(&scenario, hello.run.wrapping_add(1).max(1)).unwrap();
    built.controller.boot = hello.boot;
    // As much as a session gives a patient board: a stalled machine is not the subject.
    built.controller.silence = clutch_core::Micros(5_500_000);
    let node = ControllerNode::new(built.controller, built.servo, built.supervisor);
    let mut station = ControllerStation::new(node, &path);
    let mut talk = Talk::new(&mut port, &mut station);
    talk.configure(DacCode(hello.boot_code)).unwrap();
    let clock = talk.clock(None).unwrap();

    let watch = Arc::new(Watch::default());
    let header = from_scenario::header(&scenario, &built.servo, Source::Loop, &address.to_string(), "test");
    let (log_thread, ring) = LogThread::start(&log, &header, watch.clone()).unwrap();
    // One that looks on, and a change of gains that is on its way.
    let (shown, seen) = onlooker::ring();
    let (mut tuning, changes) = rtrb::RingBuffer::new(1);
    let change = Change { servo: built.servo, parameter: 7, value: 3.0, error_bound: None };
    tuning.push(change).expect("there is room for one");
    let options = LoopOptions {
        // The machine's settings are not the subject, and locked memory would stay locked.
        realtime: RealtimeOptions { thread_priority: 0, lock_memory: false, ..RealtimeOptions::default() },
        pace,
        settle: 0.5,
        on_drift: OnDrift::Report,
        hooks: (|| INSIDE.set(true), || INSIDE.set(false)),
    };
    for counter in [&TAKEN, &GIVEN_BACK, &SIZE] {
        counter.store(0, Ordering::Relaxed);
    }
    let (ticks, detector, drift) = (built.ticks, built.detector, built.drift);
    let report = std::thread::scope(|scope| {
        let (station, port, watch) = (&mut station, &mut port, &*watch);
        let (ring, shown, changes, patient) = (Some(ring), Some(shown), Some(changes), true);
        let configured = ConfiguredRun {
            station,
            port,
            ring,
            shown,
            changes,
            watch,
            ticks,
            clock,
            detector,
            drift,
            patient,
        };
        scope.spawn(move || control_loop::run(configured, &options)).join().unwrap()
    });
    stop.store(true, Ordering::Relaxed);
    let _ = board.join().unwrap().unwrap();
    let logged = log_thread.finish().unwrap();
    assert!(logged.records > 2 * report.ticks, "the log was not written: {logged:?}");
    assert!(seen.slots() as u64 > 2 * report.ticks, "{} records were shown", seen.slots());
    assert_eq!(report.changed, 1);
    let taken = TAKEN.load(Ordering::Relaxed);
    let given_back = GIVEN_BACK.load(Ordering::Relaxed);
    println!("{name}: {} ticks, {taken} taken, {given_back} given back", report.ticks);
    Watched { report, taken, given_back }
}

#[track_caller]
fn asked_nothing(w: &Watched) {
    let size = SIZE.load(Ordering::Relaxed);
    assert!(w.report.ticks > 1000, "too short to say much: {:?}", w.report);
    assert_eq!(
        (w.taken, w.given_back),
        (0, 0),
        "allocations and frees in the loop, the last of {size} bytes"
    );
}

#[test]
fn a_loop_paced_by_the_sample_does_not_allocate() {
    let _one = ONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    asked_nothing(&watched("sample", Pace::Sample, None));
}

#[test]
fn a_loop_paced_by_the_clock_does_not_allocate() {
    let _one = ONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    asked_nothing(&watched("clock", Pace::Clock, None));
}

#[test]
fn an_allocation_in_one_cycle_is_seen() {
    let _one = ONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let w = watched("spoilt", Pace::Sample, Some(700));
    assert!(w.report.ticks > 700, "{:?}", w.report);
    assert_eq!((w.taken, w.given_back), (1, 1), "one box in tick 700");
}
