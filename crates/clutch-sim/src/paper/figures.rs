//! The paper's figures 8 to 10: positional errors over time.

use super::PaperLaw;
use super::runs::{Case, Runs, Source};

/// Number, law, rates in °/s.
const FIGURES: [(u32, PaperLaw, &[f64]); 3] = [
    (8, PaperLaw::Pd, &[100.0, 20.0, 2.0]),
    (9, PaperLaw::Ctc, &[20.0, 2.0]),
    (10, PaperLaw::Smc, &[20.0, 6.0, 2.0]),
];

/// One panel of a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct PanelData {
    /// Rate of the ramp, °/s.
    pub rate_deg_s: f64,
    /// True if it is the experiment's column.
    pub experiment: bool,
    /// Time, s.
    pub time_s: Vec<f64>,
    /// Position error, °.
    pub error_deg: Vec<f64>,
}

/// One of the paper's figures: panels by rows, simulation left and experiment right.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureData {
    /// Its number in the paper.
    pub number: u32,
    /// The law.
    pub law: PaperLaw,
    /// The panels.
    pub panels: Vec<PanelData>,
}

/// A figure's panels.
fn panels(law: PaperLaw, rates: &'static [f64]) -> impl Iterator<Item = Case> {
    let columns = [Source::Simulation, Source::Experiment];
    rates.iter().flat_map(move |rate| columns.map(|source| Case::new(source, law, *rate)))
}

/// Cases that the figures ask to run.
pub(super) fn cases() -> impl Iterator<Item = Case> {
    FIGURES.into_iter().flat_map(|(_, law, rates)| panels(law, rates))
}

pub(super) fn of(runs: &Runs) -> Vec<FigureData> {
    let panel = |case: Case| {
        let trace = runs.trace(case)?.clone();
        Some(PanelData {
            rate_deg_s: case.rate_deg_s(),
            experiment: case.source == Source::Experiment,
            time_s: trace.time_s,
            error_deg: trace.error_deg,
        })
    };
    let figure = |(number, law, rates)| FigureData {
        number,
        law,
        panels: panels(law, rates).filter_map(panel).collect(),
    };
    FIGURES.into_iter().map(figure).collect()
}
