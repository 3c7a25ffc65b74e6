//! A view of a run while it goes on.
//!
//! The thread that runs a loop copies its records into a ring, and does nothing else for those who look on: a view that is
//! slow misses records, and the loop does not notice.

use crate::live_gains::LiveGains;
use crate::log_thread::Ring;
use clutch_log::{Header, Record};
use clutch_sim::Scenario;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Records that wait for a view: more than half a second of them at 10 kHz.
const RING: usize = 1 << 14;

/// A ring for the records of a run that is looked at, and its other end.
#[must_use]
pub fn ring() -> (Ring, rtrb::Consumer<Record>) {
    rtrb::RingBuffer::new(RING)
}

/// One that looks on.
pub trait Onlooker: fmt::Debug + Send + Sync {
    /// A run begins, with the header that its log has or would have, and the gains that may be changed while it goes on. Its
    /// records go into the ring until that is dropped.
    fn begin(&self, header: &Header, scenario: &Scenario, gains: Option<Arc<dyn LiveGains>>) -> Ring;
}

/// One that looks on at runs in computed time, which then go no faster than a clock, and may be ended by it.
#[derive(Clone, Debug)]
pub struct Looking {
    /// The one.
    pub onlooker: Arc<dyn Onlooker>,
    /// Set to end a run as an operator does.
    pub stop: Arc<AtomicBool>,
}

impl Looking {
    /// A run begins.
    #[must_use]
    pub fn begin(&self, header: &Header, scenario: &Scenario) -> Played {
        Played {
            ring: self.onlooker.begin(header, scenario, None),
            stop: self.stop.clone(),
            started: None,
            told: false,
        }
    }
}

/// A run in computed time that is looked at.
#[derive(Debug)]
pub struct Played {
    ring: Ring,
    stop: Arc<AtomicBool>,
    /// The clock's time at the run's time 0.
    started: Option<Instant>,
    /// True if the stop has been reported.
    told: bool,
}

/// The longest sleep after which a stop is looked for.
const NAP: Duration = Duration::from_millis(20);

impl Played {
    /// Shows a record, not before its time has come; at once where the run has been stopped.
    pub fn show(&mut self, record: &Record) {
        let at = Duration::from_nanos(record.time_ns());
        let begun = || Instant::now().checked_sub(at).unwrap_or_else(Instant::now);
        let started = *self.started.get_or_insert_with(begun);
        while !self.stop.load(Ordering::Relaxed) {
            let early = at.saturating_sub(started.elapsed());
            if early.is_zero() {
                break;
            }
            std::thread::sleep(early.min(NAP));
        }
        // One that finds the ring full is not seen.
        let _ = self.ring.push(*record);
    }

    /// True once, when somebody has stopped the run.
    pub fn stopped(&mut self) -> bool {
        !self.told && self.stop.load(Ordering::Relaxed) && {
            self.told = true;
            true
        }
    }
}
