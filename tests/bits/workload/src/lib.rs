//! The workload of the test of equal bits on every machine: a servo in `f32` along a path, its
//! counts given, every output of every tick as bytes, and a running hash of them.
#![no_std]

mod job;
mod record;
mod repeat;
mod workload;

pub use job::{HEADER, Job, SETTING, setting_from_bytes, setting_to_bytes};
pub use record::{FIELDS, Field, Kind, RECORD, hash, hashed};
pub use repeat::{Failed, Files, repeat};
pub use workload::Workload;
