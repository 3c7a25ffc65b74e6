//! The simulated board in real time, on a pseudo-terminal or a TCP address.
//!
//! Its samples fall due by the machine's clock. Its simulation never runs ahead of them: when
//! the machine wakes the board late, the board's clock is set back by as much, so that the shaft's
//! motion between two samples is always one period. A patient board also waits for a controller
//! that has not answered yet, as a busy machine holds either up; without faults on request, a run
//! then goes on as if the machine had not stalled. These waits are counted, and their time is summed up.

use crate::faults::{Direction, Fault};
use crate::faulty_line::FaultyLine;
use crate::port::{ClientEvent, Endpoint};
use crate::realtime::{WaitMode, monotonic_ns};
use crate::sim_board::{SimBoard, SimBoardError};
use crate::sim_board_greeting::Greeting;
use clutch_node::Outbox;
use clutch_sim::Scenario;
use clutch_wire::BoardState;
use std::hash::{BuildHasher, Hasher};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

/// Longest time for which a patient board waits.
pub const PATIENCE: Duration = Duration::from_secs(5);

/// Time before the sample at which a patient board's clock waits, ns.
const WAIT_NS: u64 = 100_000;

/// A wake-up that is later than this sets the board's clock back, ns.
const SLIP_NS: u64 = 500_000;

/// Options of the simulated board.
#[derive(Clone, Debug)]
pub struct ServeOptions {
    /// The faults of line and board.
    pub faults: Vec<Fault>,
    /// Seed of what goes wrong at random.
    pub seed: u64,
    /// True if the board's clock waits for the controller.
    pub patient: bool,
    /// The way in which it waits for its next sample.
    pub wait: WaitMode,
    /// The newest sample that a loop in this process left without an answer, by its number and 1; 0 before.
    pub passed: Arc<AtomicU32>,
}

/// A notice of the board while it runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ServeNotice {
    /// A client came or left.
    Client(ClientEvent),
    /// A client was sent away, for this reason.
    Dismissed(&'static str),
    /// The board's state changed, at a time of its own clock, s.
    State(BoardState, f64),
    /// The board went to its safe state on a fault, so long after the last code that it applied
    /// (after consent, if there was none), s.
    Faulted(f64),
}

/// The report of a simulated board.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ServeReport {
    /// Samples taken since the last configuration.
    pub samples: u64,
    /// Times that the board's clock waited.
    pub waits: u64,
    /// For how long in all, s.
    pub waited: f64,
    /// Frames and samples that faults have hit.
    pub hits: u64,
}

/// The board could not go on.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The board or its rig.
    #[error(transparent)]
    Board(#[from] SimBoardError),
    /// The line.
    #[error("the simulated board's line failed: {0}")]
    Line(#[from] std::io::Error),
}

/// True if the newest sample is to be answered, and the answer has not come. One that the loop does not believe gets none.
fn awaits(options: &ServeOptions, board: &SimBoard) -> bool {
    let passed = options.passed.load(Ordering::Relaxed);
    board.node().unanswered().is_some_and(|sample| u32::from(sample) + 1 != passed)
}

/// Writes what the line takes now.
fn send(endpoint: &mut dyn Endpoint, unsent: &mut Vec<u8>) -> std::io::Result<()> {
    if !unsent.is_empty() {
        let sent = endpoint.write(unsent)?;
        unsent.drain(..sent);
        // A client that does not read is as good as none.
        if unsent.len() > 65_536 {
            unsent.clear();
        }
    }
    Ok(())
}

/// Runs a simulated board until `stop`.
///
/// # Errors
/// The scenario has no safe state, the rig cannot be simulated, the line fails.
pub fn serve(
    scenario: &Scenario,
    options: &ServeOptions,
    endpoint: &mut dyn Endpoint,
    stop: &AtomicBool,
    mut notice: impl FnMut(ServeNotice),
) -> Result<ServeReport, ServeError> {
    let patient = options.patient && !options.faults.iter().any(|f| f.kind.silences());
    // Keys of the system's random numbers: nobody can guess it.
    let boot = std::hash::RandomState::new().build_hasher().finish() as u32;
    let mut board = SimBoard::new(scenario, &options.faults, boot, patient)?;
    let mut up = FaultyLine::new(Direction::Up, 0, &options.faults, options.seed);
    let mut down = FaultyLine::new(Direction::Down, 0, &options.faults, options.seed);
    let mut report = ServeReport::default();
    let start = monotonic_ns();
    // By how much the board's clock is behind the machine's, ns.
    let mut slipped = start;
    let mut out = Outbox::default();
    let mut buffer = [0; 1024];
    let mut state = board.node().state();
    let mut present = false;
    let mut greeting = Greeting::new();
    let mut waiting_since: Option<u64> = None;
    // Bytes that the line did not take at once.
    let mut unsent: Vec<u8> = Vec::new();
    while !stop.load(Ordering::Relaxed) {
        while let Some(event) = endpoint.service()? {
            present = event == ClientEvent::Connected;
            greeting.client();
            notice(ServeNotice::Client(event));
            if event == ClientEvent::Left {
                waiting_since = None;
            }
        }
        let now = monotonic_ns().saturating_sub(slipped);
        let next = [board.next_ns(), up.next_ns(), down.next_ns()].into_iter().flatten().min();
        // Not longer than this without looking for clients.
        let idle = now + 5_000_000;
        let until = next.unwrap_or(idle).min(idle);
        if until > now {
            let _ = endpoint.wait(until + slipped, options.wait);
        }
        let (heard, dismissed) = greeting.read(endpoint, &mut buffer)?;
        if let Some(reason) = dismissed {
            notice(ServeNotice::Dismissed(reason));
        }
        // Nothing happens to a board while its simulation is held up: when this thread woke late, the
        // clock of the board is where the next thing falls due.
        let woke = monotonic_ns().saturating_sub(slipped);
        let now = board.next_ns().map_or(woke, |due| woke.min(due));
        if woke - now > SLIP_NS {
            slipped += woke - now;
        }
        down.send(now, board.armed_for(now), &heard);
        while let Some(bytes) = down.arrived(now) {
            board.receive(now, &bytes, &mut out)?;
        }
        if board.next_ns().is_some_and(|due| due <= now) {
            let wall = monotonic_ns();
            let since = *waiting_since.get_or_insert(wall);
            if patient && present && awaits(options, &board) && wall - since < PATIENCE.as_nanos() as u64 {
                // The clock stands still, a little before the sample, until the answer comes.
                slipped = wall - now + WAIT_NS;
                report.waits += u64::from(since == wall);
                continue;
            }
            report.waited += if patient { (wall - since) as f64 / 1e9 } else { 0.0 };
            waiting_since = None;
            board.step(now, &mut out)?;
        }
        if board.node().state() != state {
            state = board.node().state();
            notice(ServeNotice::State(state, now as f64 / 1e9));
            if state == BoardState::Faulted {
                let silent = ((now / 1000) as u32).wrapping_sub(board.node().fed_us());
                notice(ServeNotice::Faulted(f64::from(silent) / 1e6));
            }
        }
        if !out.as_bytes().is_empty() {
            up.send(now, board.armed_for(now), out.as_bytes());
            out.clear();
        }
        while let Some(bytes) = up.arrived(now) {
            unsent.extend(bytes);
        }
        send(endpoint, &mut unsent)?;
    }
    report.samples = board.samples();
    report.hits = up.hits().0 + down.hits().0 + u64::from(board.first_hit_ns().is_some());
    Ok(report)
}
