//! The runs that go together in lanes, and those that go alone.

use super::block::Block;
use super::motion::Alike;
use super::servo::Steered;
use super::vector::at;
use crate::engine::EngineKind;
use crate::lane::MOST_LANES;
use crate::metrics::{Detected, Metrics};
use crate::run::{Prepared, RunSpec};
use clutch_core::law::LawParams;
use clutch_core::reference::Reference;
use clutch_core::{ActuatorKind, FixedCounts, FrictionParams};
use fearless_simd::Level;
use std::mem::{Discriminant, discriminant};

/// Runs in a block: enough to fill vectors with those in the layer, few enough for a core's own memory.
const BLOCK: usize = 256;
/// Periods of all runs of a block together, so that each block ends within a second or so.
const LONGEST: u64 = 1 << 22;
/// Runs below which lanes would stay empty: they are faster alone.
const FEWEST: usize = 3;

/// A run that can go in lanes, at its beginning.
pub(super) struct Candidate<'a> {
    /// Its place among the runs that were handed in.
    place: usize,
    common: Common,
    pub(super) steered: Steered<'a>,
    pub(super) prepared: Prepared<'a, f64>,
    /// The path as it would be from 0, and its beginning.
    pub(super) path: Reference<'a, f64>,
    pub(super) start: FixedCounts,
}

/// Settings that the runs of a block have in common.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Common {
    pub(super) motion: Alike,
    pub(super) ticks: u64,
    pub(super) settle: f64,
    pub(super) whole_counts: bool,
    pub(super) whole_codes: bool,
    laws_in_lanes: bool,
    law: Discriminant<LawParams>,
    /// Actuator and friction of the model.
    model: (ActuatorKind, Discriminant<FrictionParams>),
}

impl<'a> Candidate<'a> {
    /// A run that lanes can do; none if it has to go alone, be it to say what is wrong with it.
    fn of(place: usize, spec: &RunSpec<'a>) -> Option<Self> {
        let steered = Steered::of(spec)?;
        let prepared = spec.prepare::<f64>().ok()?;
        let rig = prepared.moving.rig();
        let encoder = steered.servo.encoder();
        Some(Candidate {
            place,
            common: Common {
                motion: Alike::of(rig, prepared.engine, spec.period.seconds())?,
                ticks: spec.run.ticks(spec.period),
                settle: spec.run.settle,
                whole_counts: rig.params.encoder.quantised,
                whole_codes: rig.params.dac.quantised,
                laws_in_lanes: steered.in_lanes(),
                law: discriminant(&spec.law),
                model: (spec.model.actuator.kind(), discriminant(&spec.model.friction)),
            },
            path: Reference::new(&spec.reference, FixedCounts(0), encoder, spec.period).ok()?,
            start: spec.run.start_position(),
            steered,
            prepared,
        })
    }
}

/// Runs in lanes what can be, by the instructions of a level. `runs` are the specifications by their places; `done` gets
/// the figures of a run by its place, as they come. A run that it gets none of has to go alone. False once `stop`, which is
/// asked every few milliseconds, says so; no more figures come then.
pub(crate) fn run_all(
    level: Level,
    runs: &[(usize, RunSpec<'_>)],
    stop: &dyn Fn() -> bool,
    done: &mut dyn FnMut(usize, EngineKind, Metrics, Detected),
) -> bool {
    let mut candidates = Vec::new();
    for (place, spec) in runs {
        if stop() {
            return false;
        }
        candidates.extend(Candidate::of(*place, spec));
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
