//! The runs that go together in lanes, and those that go alone.

use super::block::Block;
use super::candidate::Candidate;
use crate::engine::EngineKind;
use crate::lane::MOST_LANES;
use crate::lane::vector::at;
use crate::metrics::{Detected, Metrics};
use crate::run::RunSpec;
use fearless_simd::Level;

/// Runs in a block: enough to fill vectors with those in the layer, few enough for a core's own memory.
const BLOCK: usize = 256;
/// Periods of all runs of a block together, so that each block ends within a second or so.
const LONGEST: u64 = 1 << 22;
/// Runs below which lanes would stay empty: they are faster alone.
const FEWEST: usize = 3;

/// Runs in lanes what can be, by the instructions of a level. `runs` are the specifications by their places; `done` gets
/// the figures of a run by its place, as they come. A run that it gets none of has to go alone. False once `stop`, which is
/// asked every few milliseconds, says so; no more figures come then.
pub(crate) fn run_all<'a>(
    level: Level,
    runs: impl Iterator<Item = (usize, RunSpec<'a>)>,
    stop: &dyn Fn() -> bool,
    done: &mut dyn FnMut(usize, EngineKind, Metrics, Detected),
) -> bool {
    let mut candidates = Vec::with_capacity(runs.size_hint().1.unwrap_or(0));
    for (place, spec) in runs {
        if stop() {
            return false;
        }
        candidates.extend(Candidate::of(place, &spec));
    }
    let mut left: Vec<&Candidate<'_>> = candidates.iter().collect();
    while let Some(first) = left.first() {
        let common = first.common;
        let (rows, others): (Vec<_>, Vec<_>) = left.into_iter().partition(|c| c.common == common);
        left = others;
        let block = (LONGEST / common.ticks.max(1)).clamp(MOST_LANES as u64, BLOCK as u64) as usize;
        for rows in rows.chunks(block).filter(|rows| rows.len() >= FEWEST) {
            let Some(figures) = at(level, Block { rows, common, stop }) else { return true };
            let Some(figures) = figures else { return false };
            for (row, figures) in rows.iter().zip(figures) {
                if stop() {
                    return false;
                }
                if let Some((metrics, detected)) = figures {
                    done(row.place, common.motion.engine, metrics, detected);
                }
            }
        }
    }
    true
}
