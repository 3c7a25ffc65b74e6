//! Helpers that the acceptance tests share.

#[path = "bits/native.rs"]
pub mod bits;
mod command;
pub mod firmware;
mod libclutch;

pub use command::command;
pub use libclutch::{compiled, libclutch};

/// The README's example runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}

use clutch_core::{Plant, PlantParams};
use clutch_sim::drive::Drive;
use clutch_sim::engine::{DormandPrince, Engine, Event, ExactFlow, Input, Model, Shaft, Volts};

/// Both engines, by name.
pub fn engines() -> [(&'static str, Box<dyn Engine>); 2] {
    [("Dormand–Prince", Box::new(DormandPrince::default())), ("exact flow", Box::new(ExactFlow))]
}

/// A plant with friction even along the disc.
///
/// # Panics
/// If a parameter is out of range.
#[must_use]
pub fn model(params: &PlantParams) -> Model {
    Model { plant: Plant::new(params).expect("parameters of a test are in range"), ripple: None }
}

/// Moves a shaft for `ticks` periods of 1 ms under a constant drive and voltage.
///
/// # Panics
/// If the engine gives up.
pub fn advance(
    engine: &mut dyn Engine,
    model: &Model,
    drive: &Drive,
    volts: f64,
    shaft: &mut Shaft,
    ticks: u64,
) -> Vec<Event> {
    let mut events = Vec::new();
    for k in 0..ticks {
        let input = Input {
            time: k as f64 * 1e-3,
            duration: 1e-3,
            origin: 0.0,
            volts: Volts::Held(volts),
            drive,
            noise: 0.0,
        };
        engine.advance(model, &input, shaft, &mut events).expect("the motion can be followed");
    }
    events
}

/// Fails with both numbers and the statement if they are further apart than `tolerance`.
///
/// # Panics
/// If they are.
pub fn assert_near(what: &str, measured: f64, expected: f64, tolerance: f64) {
    assert!(
        (measured - expected).abs() <= tolerance,
        "{what}: {measured} instead of {expected} ± {tolerance:e}"
    );
}
