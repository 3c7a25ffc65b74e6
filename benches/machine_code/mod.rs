//! The highest cost of a linked image for a Cortex-M4F, read from its machine code: instructions
//! and cycles of a function, and its stack.
//!
//! ```text
//! ELF ─► functions ─► instructions ─► blocks ─► longest path ─► bound
//!                                       ▲             ▲
//!                          loop bounds, stated     costs of instructions
//! ```
//!
//! Everything that cannot be followed is a [`Fault`]: a loop without a stated bound, a jump into
//! the middle of one, recursion, a call or jump through a register that the code does not show, an instruction without a
//! cost.

mod bound;
mod constant;
mod cost;
mod decode;
mod facts;
mod fault;
mod graph;
mod image;
mod stack;
#[cfg(test)]
mod tests;
mod trace;

pub use bound::{Bounds, Cost};
pub use facts::{CallFact, Facts, LengthFact, LoopFact};
pub use fault::Fault;
pub use image::{Function, Image, Section};
pub use stack::{Stack, Stacks};
pub use trace::traced;
