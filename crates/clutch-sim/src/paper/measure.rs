//! Measurements of a statement, and those that agree with it.

use super::runs::{Case, Runs, Source};
use super::{PaperLaw, table3};
use crate::metrics::{Figure, Metrics};

/// The subject of a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Settings of rigs and runs.
    Setting,
    /// The outcome of a computation from numbers of the paper alone.
    Arithmetic,
    /// The outcome on the paper's model, or where friction is known exactly.
    Simulation,
    /// The outcome in the experiment, for which the rig `bench` stands.
    Experiment,
}

/// The quantity measured. Rates are in °/s; figures are in the unit that people are shown.
#[derive(Clone, Copy, Debug)]
pub enum Measure {
    /// A setting, and its unit.
    Setting(fn() -> f64, &'static str),
    /// The outcome of a computation, and its unit.
    Arithmetic(fn() -> f64, &'static str),
    /// The largest of all seeds at all rates.
    Most(&'static Figure<Metrics>, Source, PaperLaw, &'static [f64]),
    /// The mean of the seeds, at the rate where it is least.
    Least(&'static Figure<Metrics>, Source, PaperLaw, &'static [f64]),
    /// The mean of the seeds in the experiment, over that in the simulation.
    ExperimentOverSimulation(&'static Figure<Metrics>, PaperLaw, f64),
    /// The reduction of stick-slip by SMC against PD, at the rate where it is least.
    Reduction(Source, &'static [f64]),
}

impl Measure {
    /// The subject of the statement.
    #[must_use]
    pub fn kind(&self) -> Kind {
        match self {
            Measure::Setting(..) => Kind::Setting,
            Measure::Arithmetic(..) => Kind::Arithmetic,
            Measure::Most(_, source, ..) | Measure::Least(_, source, ..) | Measure::Reduction(source, _) => {
                match source {
                    Source::Simulation | Source::KnownFriction => Kind::Simulation,
                    Source::Experiment => Kind::Experiment,
                }
            }
            Measure::ExperimentOverSimulation(..) => Kind::Experiment,
        }
    }

    /// Its unit.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        match self {
            Measure::Setting(_, unit) | Measure::Arithmetic(_, unit) => unit,
            Measure::Most(figure, ..) | Measure::Least(figure, ..) => figure.shown_unit,
            Measure::ExperimentOverSimulation(..) => "times",
            Measure::Reduction(..) => "%",
        }
    }

    /// Cases that have to run for it.
    pub(super) fn cases(&self) -> Vec<Case> {
        match *self {
            Measure::Setting(..) | Measure::Arithmetic(..) => Vec::new(),
            Measure::Most(_, source, law, rates) | Measure::Least(_, source, law, rates) => {
                rates.iter().map(|rate| Case::new(source, law, *rate)).collect()
            }
            Measure::ExperimentOverSimulation(_, law, rate) => {
                [Source::Experiment, Source::Simulation].map(|source| Case::new(source, law, rate)).to_vec()
            }
            Measure::Reduction(source, rates) => {
                rates.iter().flat_map(|rate| table3::compared(source, *rate)).collect()
            }
        }
    }

    /// The value that came out; NaN of runs that were not made.
    pub(super) fn of(&self, runs: &Runs) -> f64 {
        let least = |values: &mut dyn Iterator<Item = f64>| values.reduce(f64::min).unwrap_or(f64::NAN);
        match *self {
            Measure::Setting(value, _) | Measure::Arithmetic(value, _) => value(),
            Measure::Most(figure, ..) => {
                let all = self.cases().into_iter().flat_map(|case| runs.seeds(case, figure));
                all.reduce(f64::max).unwrap_or(f64::NAN)
            }
            Measure::Least(figure, ..) => {
                least(&mut self.cases().into_iter().map(|case| runs.mean(case, figure)))
            }
            Measure::ExperimentOverSimulation(figure, law, rate) => {
                let mean = |source| runs.mean(Case::new(source, law, rate), figure);
                mean(Source::Experiment) / mean(Source::Simulation)
            }
            Measure::Reduction(source, rates) => {
                least(&mut rates.iter().map(|rate| table3::reduced(runs, source, *rate)))
            }
        }
    }
}

/// Measurements that agree with a statement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Agrees {
    /// Up to this.
    AtMost(f64),
    /// From this on.
    AtLeast(f64),
    /// The first, or off it by no more than the second.
    Around(f64, f64),
}

impl Agrees {
    /// As an interval; none = unbounded.
    #[must_use]
    pub fn band(self) -> [Option<f64>; 2] {
        match self {
            Agrees::AtMost(high) => [None, Some(high)],
            Agrees::AtLeast(low) => [Some(low), None],
            Agrees::Around(x, by) => [Some(x - by), Some(x + by)],
        }
    }
}
