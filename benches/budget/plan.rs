//! firmware/budget.toml.

use anyhow::{Context, Result};
use clutch_benches::machine_code::{CallFact, Facts, LengthFact, LoopFact};
use serde::Deserialize;
use std::path::Path;

/// The file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Plan {
    pub(crate) core: Core,
    #[serde(rename = "item")]
    pub(crate) items: Vec<Item>,
    #[serde(rename = "peer")]
    pub(crate) peers: Vec<Peer>,
    #[serde(rename = "peer_servo")]
    pub(crate) peer_servos: Vec<PeerServo>,
    /// The emulated board's first, whose stack is bounded as a whole; of those that are flashed, that of a period.
    pub(crate) memory: Vec<Memory>,
    #[serde(rename = "loop")]
    loops: Vec<LoopFact>,
    #[serde(rename = "call")]
    calls: Vec<CallFact>,
    #[serde(rename = "length")]
    lengths: Vec<LengthFact>,
}

/// The core for which cycles become a share of a period.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Core {
    pub(crate) clock_hz: u64,
    pub(crate) period_us: u64,
}

/// A function with a budget.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Item {
    pub(crate) name: String,
    /// The image that it is in; without it, the one that measures.
    pub(crate) image: Option<String>,
    /// Its name in the image.
    pub(crate) symbol: String,
    /// The name of its counts, as the measuring image prints them, or as the runs on the chip have them; empty for what is
    /// not measured.
    #[serde(default)]
    pub(crate) measured: String,
    /// True if its cycles along the executed paths are added up, too.
    #[serde(default)]
    pub(crate) traced: bool,
    /// The function whose call ends the path, after those that it leads through; without any, the return ends it.
    #[serde(default)]
    pub(crate) until: Vec<String>,
    pub(crate) budget: Limit,
    #[serde(default, rename = "loop")]
    loops: Vec<LoopFact>,
    #[serde(default, rename = "call")]
    calls: Vec<CallFact>,
    /// The same code in images that are flashed: rows of their own, on the same statements.
    #[serde(default)]
    flashed: Vec<Flashed>,
}

/// A function of an image that is flashed.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Flashed {
    name: String,
    image: String,
    symbol: String,
    #[serde(default)]
    measured: String,
    #[serde(default)]
    until: Vec<String>,
    budget: Limit,
}

/// A law in C.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Peer {
    /// Name of the item it is compared with.
    pub(crate) name: String,
    /// Its name in the image, and in the image's output.
    pub(crate) symbol: String,
    /// The most instructions that an earlier version in C executed, and its bound.
    pub(crate) historic: Option<Limit>,
}

/// The servo around a law, in C.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PeerServo {
    /// Name of the item it is compared with.
    pub(crate) name: String,
    /// Its name in the image, and in the image's output.
    pub(crate) symbol: String,
    /// The name under which the image prints the counts of our servo for any law, with this one.
    pub(crate) any: String,
}

/// Instructions and cycles.
#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Limit {
    pub(crate) instructions: u64,
    pub(crate) cycles: u64,
}

/// Budgets of an image, bytes.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Memory {
    pub(crate) image: String,
    pub(crate) flash: u64,
    pub(crate) ram: u64,
    pub(crate) stack: u64,
    /// The function of a period, in an image that is flashed.
    #[serde(default = "with_host")]
    pub(crate) period: String,
    /// The stack, in an image that is flashed, of what makes its run while nothing is driven.
    #[serde(default)]
    pub(crate) setup_stack: u64,
    /// That function: of bytes of the host, a configuration among them.
    #[serde(default = "by_host")]
    pub(crate) setup: String,
}

fn with_host() -> String {
    "clutch_node::board_program::tick".to_owned()
}

fn by_host() -> String {
    "clutch_node::board_program::receive".to_owned()
}

impl Plan {
    pub(crate) fn read(path: &Path) -> Result<Plan> {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        let mut plan: Plan = toml::from_str(&text).with_context(|| path.display().to_string())?;
        plan.items = plan.items.into_iter().flat_map(Item::with_flashed).collect();
        Ok(plan)
    }

    /// The facts of every case.
    pub(crate) fn facts(&self) -> Facts {
        Facts { loops: self.loops.clone(), calls: self.calls.clone(), lengths: self.lengths.clone() }
    }

    /// The functions in C.
    pub(crate) fn in_c(&self) -> impl Iterator<Item = &str> {
        let servos = self.peer_servos.iter().map(|p| p.symbol.as_str());
        self.peers.iter().map(|p| p.symbol.as_str()).chain(servos)
    }

    /// Cycles as a share of a period, %.
    pub(crate) fn share(&self, cycles: u64) -> f64 {
        let period = self.core.clock_hz * self.core.period_us / 1_000_000;
        100.0 * cycles as f64 / period as f64
    }
}

impl Item {
    /// It, and the same code in images that are flashed.
    fn with_flashed(mut self) -> impl Iterator<Item = Item> {
        let flashed = std::mem::take(&mut self.flashed);
        let (loops, calls) = (self.loops.clone(), self.calls.clone());
        let flashed = flashed.into_iter().map(move |f| Item {
            name: f.name,
            image: Some(f.image),
            symbol: f.symbol,
            measured: f.measured,
            traced: false,
            until: f.until,
            budget: f.budget,
            loops: loops.clone(),
            calls: calls.clone(),
            flashed: Vec::new(),
        });
        std::iter::once(self).chain(flashed)
    }

    /// The facts of this case.
    pub(crate) fn case(&self) -> Facts {
        Facts { loops: self.loops.clone(), calls: self.calls.clone(), lengths: Vec::new() }
    }
}
