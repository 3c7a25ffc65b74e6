//! Facts that the code does not show, and for which somebody has to vouch.
//!
//! Functions are named by a part of their names; with a `$` at the end, by the end of their names.

use serde::Deserialize;

/// Stated bounds.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// Bounds of loops.
    pub loops: Vec<LoopFact>,
    /// Bounds of calls.
    pub calls: Vec<CallFact>,
    /// Bounds of lengths given to memcpy and the like.
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

/// The number of rounds of a loop, each time that it is entered from outside.
///
/// `most` executions of its head; with `by`, `most` executions of instructions of these names. The
/// second way holds however often the compiler has unrolled the loop: it is divided by the least
/// number of such instructions on each way round.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopFact {
    /// Part of the name of the function in whose machine code it is.
    #[serde(rename = "in")]
    pub function: String,
    /// Part of the name of a function that the loop's head was inlined from; without it, any loop.
    pub of: Option<String>,
    /// True if it has another loop within; without this field, either.
    pub outer: Option<bool>,
    /// The instructions that are counted; without them, the head.
    #[serde(default)]
    pub by: Vec<String>,
    /// Highest number.
    pub most: Option<u64>,
    /// For memcpy and its like, instead or as well: bytes that one of them does. The lower number holds.
    pub step: Option<u64>,
    /// Reason why that holds.
    pub why: String,
}

/// The number of calls of a function.
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
    /// Reason why that holds.
    pub why: String,
}

/// The length of memory that a function has copied, moved or set.
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
    /// True if they are what is left of a longer copy in pieces of one byte more.
    #[serde(default)]
    pub rest: bool,
    /// Reason why that holds.
    pub why: String,
}

/// True if `pattern` matches `name`.
pub(super) fn means(pattern: &str, name: &str) -> bool {
    pattern.strip_suffix('$').map_or_else(|| name.contains(pattern), |end| name.ends_with(end))
}
