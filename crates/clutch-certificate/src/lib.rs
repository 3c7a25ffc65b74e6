#![doc = include_str!("../README.md")]

pub mod checker;
mod coordinates;
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
pub use setup::{Case, Cell, Certificate, Form, Gains, ModeId, Motor, Proof, Setup};
pub use stability::{Stability, largest, stability};

#[cfg(test)]
mod tests {
    /// Numbers between two ends, the same for the same seed: a multiplier of Knuth's.
    pub(crate) fn uniform(seed: u64) -> impl FnMut(f64, f64) -> f64 {
        let mut state = seed;
        move |low, high| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            low + (high - low) * ((state >> 11) as f64 / (1_u64 << 53) as f64)
        }
    }
}
