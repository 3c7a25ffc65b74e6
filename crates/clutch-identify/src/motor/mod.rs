//! A motor axis: experiment, estimators and table of their own.
//!
//! In volts, with `K` the torque per volt: `(J/K) θ̈ = u + T/K − (f + r)/K sgn θ̇ − (C/K) θ̇`. Counts and volts determine each of these
//! quotients, and none of J, K, T, C and friction alone.

pub mod experiment;
pub mod hops;
pub mod passes;
pub mod report;
pub mod rig_file;
pub mod slips;

pub use report::{Report, identify};

use crate::recording::Recording;
use crate::ride::Place;

/// Friction along the way, with K/J (rad/s² per volt) and delay (s) as believed; empty without a pass at an even rate.
#[must_use]
pub(crate) fn map_as_believed(recordings: &[Recording], pull: f64, delay: f64) -> Vec<Place> {
    passes::map(&passes::passes(&report::views(recordings), pull, delay))
}
