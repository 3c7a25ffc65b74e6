//! The paper's Table 3: stick-slip with sliding mode against PD, in the experiment.

use super::PaperLaw;
use super::runs::{Case, Runs, Source, mean};
use crate::metrics::Metrics;
use serde::Serialize;

/// Table 3: rate in °/s, reduction in per cent.
pub const TABLE3: [(f64, f64); 3] = [(10.0, 88.6), (6.0, 88.9), (2.0, 83.8)];

/// One row of Table 3.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table3Row {
    /// Rate, °/s.
    pub rate_deg_s: f64,
    /// Stick-slip cycles per second under PD, mean of the seeds.
    pub pd_cycles_per_s: f64,
    /// The same under SMC.
    pub smc_cycles_per_s: f64,
    /// Reduction, per cent: `100 (1 − SMC/PD)` of the means.
    pub reduction_percent: f64,
    /// Standard deviation of the reduction from seed to seed, percentage points.
    pub spread_points: f64,
    /// Reduction of the cycles that the encoder's silences show, per cent: an experimenter sees no others.
    pub counted_reduction_percent: f64,
    /// The paper's.
    pub paper_percent: f64,
}

/// Reduction of stick-slip, per cent: what (32) means, not the ratio that it prints.
#[must_use]
pub fn reduction(smc_cycles: f64, pd_cycles: f64) -> f64 {
    if pd_cycles > 0.0 { 100.0 * (1.0 - smc_cycles / pd_cycles) } else { 0.0 }
}

/// Cases that a reduction compares: SMC and PD.
pub(super) fn compared(source: Source, rate: f64) -> [Case; 2] {
    [PaperLaw::Smc, PaperLaw::Pd].map(|law| Case::new(source, law, rate))
}

/// The reduction of the means.
pub(super) fn reduced(runs: &Runs, source: Source, rate: f64) -> f64 {
    let [smc, pd] = compared(source, rate).map(|case| runs.mean(case, &Metrics::STICK_SLIP));
    reduction(smc, pd)
}

/// Cases that the table asks to run.
pub(super) fn cases() -> impl Iterator<Item = Case> {
    TABLE3.into_iter().flat_map(|(rate, _)| compared(Source::Experiment, rate))
}

pub(super) fn of(runs: &Runs) -> Vec<Table3Row> {
    let row = |(rate_deg_s, paper_percent)| {
        let [smc, pd] =
            compared(Source::Experiment, rate_deg_s).map(|case| runs.seeds(case, &Metrics::STICK_SLIP));
        let [smc_counted, pd_counted] =
            compared(Source::Experiment, rate_deg_s).map(|case| runs.counted(case));
        let each: Vec<f64> = smc.iter().zip(&pd).map(|(s, p)| reduction(*s, *p)).collect();
        let centre = mean(&each);
        let squares: Vec<f64> = each.iter().map(|x| (x - centre) * (x - centre)).collect();
        Table3Row {
            rate_deg_s,
            pd_cycles_per_s: mean(&pd),
            smc_cycles_per_s: mean(&smc),
            reduction_percent: reduced(runs, Source::Experiment, rate_deg_s),
            spread_points: libm::sqrt(mean(&squares)),
            counted_reduction_percent: reduction(smc_counted, pd_counted),
            paper_percent,
        }
    };
    TABLE3.into_iter().map(row).collect()
}
