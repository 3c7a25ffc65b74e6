//! What the code does not say of itself, and somebody has to vouch for.

use serde::Deserialize;

/// Stated bounds.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Facts {
    /// Of loops.
    #[serde(default, rename = "loop")]
    pub loops: Vec<LoopFact>,
    /// Of calls.
    #[serde(default, rename = "call")]
    pub calls: Vec<CallFact>,
    /// Of lengths given to memcpy and its like.
    #[serde(default, rename = "length")]
    pub lengths: Vec<LengthFact>,
}

/// How often a loop goes round.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopFact {
    /// Part of the name of the function in whose machine code it is.
    #[serde(rename = "in")]
    pub function: String,
    /// Part of the name of a function that the loop's head was inlined from; without it, any loop.
    pub of: Option<String>,
    /// Executions of the head at most, each time that the loop is entered from outside.
    pub most: Option<u64>,
    /// For memcpy and its like: bytes that each round does; the head is executed once more.
    pub step: Option<u64>,
    /// Why that holds.
    pub why: String,
}

/// How often a function is called.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CallFact {
    /// Part of the name of the calling function.
    #[serde(rename = "in")]
    pub function: String,
    /// Part of the name of the called one.
    pub of: String,
    /// Calls at most, all places together, each time that the calling function is called.
    pub most: u64,
    /// Why that holds.
    pub why: String,
}

/// How long the memory is that a function has copied, moved or set.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LengthFact {
    /// Part of the name of the calling function.
    #[serde(rename = "in")]
    pub function: String,
    /// Bytes at most.
    pub most: u64,
    /// Why that holds.
    pub why: String,
}
