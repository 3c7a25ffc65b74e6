//! The runs behind figures, table and statements.

use super::law::PaperLaw;
use crate::metrics::{Detected, Figure, Metrics};
use crate::progress::{Progress, Report};
use crate::rig::RigParams;
use crate::run::{RunError, RunSpec, simulate};
use clutch_core::PlantParams;
use clutch_core::reference::ReferenceParams;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;

/// Seeds of every run.
pub const SEEDS: [u64; 10] = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10];

/// The rig on which a shaft runs: the two columns of each figure, and the check on what CTC could do if
/// friction were known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    /// On the rig `paper`.
    Simulation,
    /// On the rig `bench`.
    Experiment,
    /// On the rig `bench`, its friction even along the disc and known to the law.
    KnownFriction,
}

/// A case: it runs once for each seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Case {
    pub(super) source: Source,
    pub(super) law: PaperLaw,
    /// A whole number, to be a key: 0.001 °/s.
    rate: u64,
}

impl Case {
    pub(super) fn new(source: Source, law: PaperLaw, rate_deg_s: f64) -> Self {
        Case { source, law, rate: libm::rint(rate_deg_s * 1000.0) as u64 }
    }

    pub(super) fn rate_deg_s(self) -> f64 {
        self.rate as f64 / 1000.0
    }

    pub(super) fn spec(self, seed: u64) -> RunSpec<'static> {
        let bench = RigParams::bench();
        let rig = match self.source {
            Source::Simulation => RigParams::paper(),
            Source::Experiment => bench.clone(),
            Source::KnownFriction => RigParams { ripple: None, delay_ticks: 0, ..bench.clone() },
        };
        let path = ReferenceParams::ramp(self.rate_deg_s().to_radians());
        let mut spec = RunSpec::new(rig, self.law.params(), path);
        if self.source == Source::KnownFriction {
            spec.model = known_model(&bench);
        }
        spec.run.seed = seed;
        spec
    }
}

/// The bench's plant as a law would know it after a perfect measurement.
fn known_model(bench: &RigParams) -> PlantParams {
    let drive = crate::drive::Drive::new(&bench.drive, 0).map_or(0.0, |d| d.torque(0.0, 0.0));
    PlantParams {
        inertia: bench.inertia,
        drive_torque: drive,
        viscous_damping: bench.viscous_damping,
        actuator: bench.actuator,
        friction: bench.friction,
    }
}

/// Error over time: s, °.
#[derive(Clone, Debug)]
pub(super) struct ErrorTrace {
    pub(super) time_s: Vec<f64>,
    pub(super) error_deg: Vec<f64>,
}

/// Results of a case.
struct Done {
    /// One for each seed.
    metrics: Vec<Metrics>,
    /// Stick-slip as the encoder shows it, of each seed, cycles/s.
    counted: Vec<f64>,
    /// Trace of the first seed.
    first: ErrorTrace,
}

/// Results of all cases.
pub(super) struct Runs(BTreeMap<Case, Done>);

impl Runs {
    pub(super) fn all(cases: &BTreeSet<Case>, progress: Report<'_>) -> Result<Self, RunError> {
        let total = (cases.len() * SEEDS.len()) as u64;
        let tell = |finished| match progress(Progress { total, finished }) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(RunError::Stopped),
        };
        tell(0)?;
        let run = |case: Case, seed: u64| {
            let run = simulate::<f64>(&case.spec(seed))?;
            tell(1)?;
            let trace = (seed == SEEDS[0]).then(|| ErrorTrace {
                error_deg: run.trace.error.iter().map(|e| e.to_degrees()).collect(),
                time_s: run.trace.time,
            });
            Ok((run.metrics, run.detected, trace))
        };
        let jobs: Vec<_> = cases.iter().flat_map(|case| SEEDS.map(|seed| (*case, seed))).collect();
        let results: Vec<_> =
            jobs.par_iter().map(|(case, seed)| run(*case, *seed)).collect::<Result<_, RunError>>()?;
        let of_case = cases.iter().zip(results.chunks(SEEDS.len()));
        Ok(Runs(
            of_case
                .filter_map(|(case, seeds)| {
                    let metrics = seeds.iter().map(|(metrics, ..)| *metrics).collect();
                    let counted =
                        seeds.iter().filter_map(|(_, seen, _)| Detected::STICK_SLIP.shown(seen)).collect();
                    let first = seeds.iter().find_map(|(.., trace)| trace.clone())?;
                    Some((*case, Done { metrics, counted, first }))
                })
                .collect(),
        ))
    }

    pub(super) fn trace(&self, case: Case) -> Option<&ErrorTrace> {
        self.0.get(&case).map(|done| &done.first)
    }

    /// A figure of each seed, in the unit that people are shown.
    pub(super) fn seeds(&self, case: Case, figure: &Figure<Metrics>) -> Vec<f64> {
        let done = self.0.get(&case).map_or(&[][..], |done| &done.metrics);
        done.iter().filter_map(|m| figure.shown(m)).collect()
    }

    /// Stick-slip as the encoder shows it, mean of the seeds, cycles/s.
    pub(super) fn counted(&self, case: Case) -> f64 {
        mean(self.0.get(&case).map_or(&[][..], |done| &done.counted))
    }

    /// Its mean over the seeds.
    pub(super) fn mean(&self, case: Case, figure: &Figure<Metrics>) -> f64 {
        mean(&self.seeds(case, figure))
    }
}

/// NaN of nothing: no statement holds of runs that were not made.
pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |sum, x| sum + x) / values.len() as f64
}
