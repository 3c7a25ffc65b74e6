//! What the code does not say of itself, and somebody has to vouch for.
//!
//! Functions are named by a part of their names; with a `$` at the end, by the end of their names.

use serde::Deserialize;

/// Stated bounds.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// Of loops.
    pub loops: Vec<LoopFact>,
    /// Of calls.
    pub calls: Vec<CallFact>,
    /// Of lengths given to memcpy and its like.
    pub lengths: Vec<LengthFact>,
}

impl Facts {
    /// Their names.
    pub fn names(&self) -> impl Iterator<Item = String> {
        let loops = self.loops.iter().map(LoopFact::name);
        loops.chain(self.calls.iter().map(CallFact::name)).chain(self.lengths.iter().map(LengthFact::name))
    }
}

impl LoopFact {
    pub(super) fn name(&self) -> String {
        let part =
            |word: &str, of: &Option<String>| of.as_ref().map_or(String::new(), |o| format!(" {word} {o}"));
        let by = (!self.by.is_empty()).then(|| self.by.join("/"));
        format!("loop in {}{}{}", self.function, part("of", &self.of), part("by", &by))
    }
}

impl CallFact {
    pub(super) fn name(&self) -> String {
        format!("calls in {} of {}", self.function, self.of)
    }
}

impl LengthFact {
    pub(super) fn name(&self) -> String {
        format!("length in {} of {}", self.function, self.of)
    }
}

/// How often a loop goes round, each time that it is entered from outside.
///
/// `most` executions of its head; with `by`, `most` executions of instructions of these names. The second way holds however often the compiler has unrolled the loop: it is divided
/// by how many such instructions each way round has at least.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopFact {
    /// Part of the name of the function in whose machine code it is.
    #[serde(rename = "in")]
    pub function: String,
    /// Part of the name of a function that the loop's head was inlined from; without it, any loop.
    pub of: Option<String>,
    /// Whether it has another loop within; without it, either.
    pub outer: Option<bool>,
    /// The instructions that are counted; without them, the head.
    #[serde(default)]
    pub by: Vec<String>,
    /// How many at most.
    pub most: Option<u64>,
    /// For memcpy and its like, instead: bytes that one of them does.
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
    /// Name of the called one, whole: those for aligned memory have names of their own.
    pub of: String,
    /// Bytes at most.
    pub most: u64,
    /// Why that holds.
    pub why: String,
}

/// Whether `name` is one that `pattern` means.
pub(super) fn means(pattern: &str, name: &str) -> bool {
    pattern.strip_suffix('$').map_or_else(|| name.contains(pattern), |end| name.ends_with(end))
}
