//! A run that can go in lanes, at its beginning, and what the runs of a block have in common.

use super::alike::Alike;
use super::servo::Steered;
use crate::run::{Prepared, RunSpec};
use clutch_core::law::LawParams;
use clutch_core::reference::Reference;
use clutch_core::{ActuatorKind, FixedCounts, FrictionParams};
use std::mem::{Discriminant, discriminant};

/// A run that can go in lanes, at its beginning.
pub(super) struct Candidate<'a> {
    /// Its place among the runs that were handed in.
    pub(super) place: usize,
    pub(super) common: Common,
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
    pub(super) fn of(place: usize, spec: &RunSpec<'a>) -> Option<Self> {
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
