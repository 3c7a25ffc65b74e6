//! Rig and law of a scenario as FMI 3.0 co-simulation units (Functional Mock-up Interface, Modelica Association, 2022).
//!
//! One library has both: the token with which a simulator instantiates it says which. A master that steps the law, hands its voltage on
//! and steps the rig, once a period, computes what `clutch sim` computes, bit for bit.
//!
//! | file | what |
//! |---|---|
//! | `variables` | the variables of each unit, and their description |
//! | `unit` | rig and law, stepped |
//! | `instance` | a unit with its parameters and its state of the protocol |
//! | `fmi3` | the functions that a simulator calls |

mod fmi3;
mod instance;
#[cfg(test)]
mod tests;
mod unit;
mod variables;

pub use variables::{Part, description};
