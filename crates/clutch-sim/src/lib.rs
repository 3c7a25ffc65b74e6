#![doc = include_str!("../README.md")]

pub mod detected;
pub mod drive;
pub mod engine;
mod fleet;
pub mod friction_lab;
pub mod friction_map;
#[cfg_attr(target_family = "wasm", allow(dead_code, reason = "it has no vectors for lanes"))]
mod lane;
#[cfg_attr(
    target_family = "wasm",
    allow(dead_code, unused_variables, reason = "it has no vectors for lanes")
)]
mod lanes;
pub mod meter;
pub mod metrics;
pub mod moving_rig;
mod number;
pub mod paper;
pub mod picture;
pub mod pool;
pub mod progress;
pub mod reaching;
pub mod referee;
pub mod rig;
pub mod ripple;
pub mod run;
mod run_spec;
pub mod scenario;
mod scenario_error;
pub mod smooth_speed;
pub mod sweep;
pub mod system;
mod tables;
mod unposed;

pub use fleet::Fleet;
pub use metrics::Metrics;
pub use moving_rig::MovingRig;
pub use number::number;
pub use rig::RigParams;
pub use run::{
    Keep, Run, RunError, RunParams, RunSpec, SAMPLE_COLUMNS, SampleColumn, Start, Values, simulate,
    simulate_prepared, simulate_servo,
};
pub use scenario::Scenario;
pub use scenario_error::ScenarioError;
pub use tables::{Points, Text, expected, nearest, written};
