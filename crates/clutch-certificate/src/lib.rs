#![doc = include_str!("../README.md")]

pub mod checker;
pub mod file;
mod invariant;
mod modes;
mod pieces;
mod rows;
mod search;
pub mod setup;
mod simplex;
mod stability;
mod units;

pub use search::{Found, OpenCell, Options, search};
pub use setup::{Case, Cell, Certificate, Form, Gains, ModeId, Proof, Setup};
pub use stability::{Stability, largest, stability};

#[cfg(test)]
mod tests {
    use super::*;

    /// The paper's shaft at 2 °/s with a law.
    pub(crate) fn setup(law: Gains) -> Setup {
        Setup {
            period_s: 0.001,
            counts_per_rev: 20_000,
            inertia: [0.0017; 2],
            drive_torque: [0.047_088; 2],
            viscous_damping: [0.001; 2],
            brake_gain: [0.14; 2],
            sliding: [0.15; 2],
            at_rest: [0.2; 2],
            rest_not_below_sliding: true,
            stribeck: [0.001, 1.0],
            ripple: 0.0,
            torque_noise: 0.0,
            delay_ticks: 0,
            converter_step: 20.0 / 4096.0,
            volts: [0.0, 9.995],
            rate: 2.0_f64.to_radians(),
            smoothing: 0.2,
            law,
            from_rest: false,
            start_volts: [2.24, 2.25],
        }
    }

    /// Numbers between two ends, the same for the same seed: a multiplier of Knuth's.
    pub(crate) fn uniform(seed: u64) -> impl FnMut(f64, f64) -> f64 {
        let mut state = seed;
        move |low, high| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            low + (high - low) * ((state >> 11) as f64 / (1_u64 << 53) as f64)
        }
    }
}
