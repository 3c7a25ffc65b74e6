//! Many runs at once: two, four or eight of them in the lanes of a vector, each with the bits of its run alone. Shafts under
//! the voltages of agents ([`Fleet`](crate::Fleet)) go through a period by the same code.
//!
//! ```text
//! rows of a sweep ─► group (same law, same length, …) ─► block of chunks, a vector each
//!     each period:  encoder ─► (5) ─► law ─► converter ─► linear motion          in lanes, every run; servos one by one
//!                                                     │                          where they have no lanes
//!                                                     └─► above the layer, or    in lanes, the runs that need it, gathered
//!                                                     │   through it
//!                                                     └─► Dormand–Prince's steps in lanes, the runs that need them
//!                                                     └─► what follows a stop    one by one
//! ```
//!
//! Arithmetic, law, output stage, actuator and the pieces of the exact flow are the very functions of one run, over
//! [`Lane`](crate::lane::Lane) instead of `f64`. Nothing is fused, and nothing is summed across lanes; each elementary function has the bits
//! that it has of one number. A run or a shaft that leaves what lanes can do (a position beyond ±2³⁰ counts, a number that is none) runs again
//! alone.

mod alike;
mod block;
mod candidate;
pub(crate) mod fleet;
mod group;
mod in_steps;
mod layer;
mod motion;
mod push;
mod servo;
mod shafts;
mod silence;
mod steps;
#[cfg(test)]
pub(crate) mod tests;

pub(crate) use group::run_all;
