//! The values of a loop that may be seen while it runs: atomics that its threads write.

use crate::drift::{Alarm, Seen};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU8, AtomicU32, AtomicU64, Ordering, fence};

/// The values that a watcher sees while the loop runs.
#[derive(Debug, Default)]
pub struct Watch {
    /// Set to end the run in the safe state.
    pub stop: Arc<AtomicBool>,
    /// [`clutch_core::supervisor::State`] as a number.
    pub state: AtomicU8,
    /// Ticks so far.
    pub tick: AtomicU64,
    /// Error, 1e-9 rad.
    pub error_nrad: AtomicI64,
    /// Brake voltage, mV.
    pub millivolts: AtomicI64,
    /// Samples lost.
    pub lost: AtomicU64,
    /// Answers later than the deadline.
    pub late_answers: AtomicU64,
    /// Records that did not fit into the ring.
    pub log_dropped: AtomicU64,
    /// Set by the log thread when it could not go on.
    pub log_ended: AtomicBool,
    /// Alarms of drift.
    pub drift: SharedAlarm,
    /// The newest sample that was left without an answer, by its number and 1; 0 before.
    pub passed: Arc<AtomicU32>,
}

/// An alarm of drift from one thread for another.
#[derive(Debug, Default)]
pub struct SharedAlarm {
    /// Two for each alarm.
    shown: AtomicU64,
    /// Tick and figures of the last one, as bits.
    bits: [AtomicU64; 6],
}

impl SharedAlarm {
    /// Shows an alarm.
    pub fn show(&self, alarm: &Alarm) {
        let Seen { friction, least, most, low, high } = alarm.seen;
        let bits = [alarm.tick].into_iter().chain([friction, least, most, low, high].map(f64::to_bits));
        self.shown.fetch_add(1, Ordering::Relaxed);
        fence(Ordering::Release);
        self.bits.iter().zip(bits).for_each(|(to, bits)| to.store(bits, Ordering::Relaxed));
        self.shown.fetch_add(1, Ordering::Release);
    }

    /// The number of alarms so far, and the last of them.
    #[must_use]
    pub fn last(&self) -> (u64, Alarm) {
        loop {
            let number = self.shown.load(Ordering::Acquire);
            let [tick, bits @ ..] = self.bits.each_ref().map(|bits| bits.load(Ordering::Relaxed));
            let [friction, least, most, low, high] = bits.map(f64::from_bits);
            fence(Ordering::Acquire);
            // Odd while one is written.
            if number.is_multiple_of(2) && self.shown.load(Ordering::Relaxed) == number {
                return (number / 2, Alarm { tick, seen: Seen { friction, least, most, low, high } });
            }
            std::hint::spin_loop();
        }
    }
}
