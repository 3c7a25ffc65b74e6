//! The values of a loop that may be seen while it runs: atomics that its threads write.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU8, AtomicU64};

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
}
