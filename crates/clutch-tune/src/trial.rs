//! Trials: a candidate on simulated rigs at the corners of the bounds, and its score.

use clutch_core::reference::ReferenceParams;
use clutch_identify::Corner;
use clutch_sim::progress::{Progress, Report};
use clutch_sim::run::{RunError, simulate_watched};
use clutch_sim::scenario::ScalarKind;
use clutch_sim::{Keep, Scenario, ScenarioError};
use rayon::prelude::*;
use serde::Serialize;

/// Rigs and discs of a trial.
#[derive(Clone, Debug)]
pub(crate) struct Trial<'a> {
    /// Rates of the ramp; none: the scenario's own path, as long as its run, behind its settling time.
    pub(crate) rates_deg_s: &'a [f64],
    pub(crate) corners: &'a [Corner],
    /// Seeds of the discs.
    pub(crate) discs: std::ops::RangeInclusive<u64>,
    /// Length of each run on a ramp, s, of which the settling time does not count.
    pub(crate) seconds: f64,
}

/// Time from the start of a run that does not count, s.
pub(crate) const SETTLE_S: f64 = 1.0;
/// A shaft that is as far off its path does not follow it, rad.
const FAR: f64 = 0.5;
/// Weight of the root mean square of the error, cycles/s per degree.
const PER_DEGREE: f64 = 30.0;
/// Weight of the longest stick, cycles/s per second.
const PER_SECOND: f64 = 50.0;
/// Weight of the voltage's variation, cycles/s per V/s: a law that chatters is not smooth.
const PER_VOLT_PER_SECOND: f64 = 1e-3;
/// Weight of the largest error along a path that is no ramp, per degree.
const PER_DEGREE_AT_MOST: f64 = 10.0;

/// The worst run of a trial. All figures but [`Score::cost`] are the largest of all runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Score {
    /// On a ramp cycles/s + 30 × RMS error in degrees + longest stick over 20 ms; along another path, which may rest and turn
    /// round, 30 × RMS error + 10 × largest error in degrees; and a thousandth of the voltage's V/s. Of the run where this sum is largest; none if a run left its path.
    pub cost: Option<f64>,
    /// Stick-slip cycles a second.
    pub cycles_per_s: f64,
    /// Root mean square of the error, rad.
    pub rms_error_rad: f64,
    /// Largest error, rad.
    pub max_error_rad: f64,
    /// Longest stick, s.
    pub longest_stick_s: f64,
    /// Total variation of the voltage, per time, V/s.
    pub control_variation_v_s: f64,
    /// Runs.
    pub runs: u32,
    /// Runs in which the shaft stuck.
    pub runs_with_sticks: u32,
    /// Simulated time, s.
    pub simulated_s: f64,
}

impl Score {
    /// For sorting: smaller is better, and a run that left its path is worst.
    pub(crate) fn order(&self) -> f64 {
        self.cost.unwrap_or(f64::INFINITY)
    }

    /// The runs of both.
    fn with(self, other: Score) -> Score {
        Score {
            cost: self.cost.zip(other.cost).map(|(a, b)| a.max(b)),
            cycles_per_s: self.cycles_per_s.max(other.cycles_per_s),
            rms_error_rad: self.rms_error_rad.max(other.rms_error_rad),
            max_error_rad: self.max_error_rad.max(other.max_error_rad),
            longest_stick_s: self.longest_stick_s.max(other.longest_stick_s),
            control_variation_v_s: self.control_variation_v_s.max(other.control_variation_v_s),
            runs: self.runs + other.runs,
            runs_with_sticks: self.runs_with_sticks + other.runs_with_sticks,
            simulated_s: self.simulated_s + other.simulated_s,
        }
    }
}

/// The scores of several candidates, in their order: each run by itself, on all cores.
pub(crate) fn scores(
    candidates: &[&Scenario],
    trial: &Trial<'_>,
    report: Report<'_>,
) -> Result<Vec<Score>, ScenarioError> {
    let rates: Vec<Option<f64>> = match trial.rates_deg_s {
        [] => vec![None],
        rates => rates.iter().copied().map(Some).collect(),
    };
    let mut runs = Vec::new();
    for (n, candidate) in candidates.iter().enumerate() {
        for corner in trial.corners {
            for rate in &rates {
                runs.extend(trial.discs.clone().map(|disc| (n, *candidate, *corner, *rate, disc)));
            }
        }
    }
    let total = runs.len() as u64;
    let _ = report(Progress { total, finished: 0 });
    let one = |(n, candidate, corner, rate, disc): (usize, &Scenario, Corner, Option<f64>, u64)| {
        let score = run(candidate, corner, rate, disc, trial.seconds, report)?;
        let _ = report(Progress { total, finished: 1 });
        Ok::<_, ScenarioError>((n, score))
    };
    let done = runs.into_par_iter().map(one).collect::<Result<Vec<_>, _>>()?;
    let start = Score { cost: Some(0.0), ..Score::default() };
    let mut scores = vec![start; candidates.len()];
    for (n, score) in done {
        scores[n] = scores[n].with(score);
    }
    Ok(scores)
}

/// One run, at a rate of the ramp or along the scenario's path.
fn run(
    candidate: &Scenario,
    corner: Corner,
    rate_deg_s: Option<f64>,
    disc: u64,
    seconds: f64,
    report: Report<'_>,
) -> Result<Score, ScenarioError> {
    let mut spec = candidate.spec();
    corner.apply(&mut spec.rig);
    spec.run.seed = disc;
    if let Some(rate) = rate_deg_s {
        spec.reference = ReferenceParams::ramp(rate.to_radians());
        (spec.run.duration, spec.run.settle) = (seconds, SETTLE_S);
    }
    let watch = |_: Progress| report(Progress { total: 0, finished: 0 });
    let run = match candidate.scalar() {
        ScalarKind::F32 => simulate_watched::<f32>(&spec, Keep::Figures, &watch),
        ScalarKind::F64 => simulate_watched::<f64>(&spec, Keep::Figures, &watch),
    };
    let own = Score { runs: 1, simulated_s: spec.run.duration, ..Score::default() };
    let m = match run {
        Ok(run) => run.metrics,
        // Gains may drive a shaft so far that no engine follows.
        Err(RunError::Motion(_)) => return Ok(own),
        Err(e) => return Err(candidate.run_error(&e)),
    };
    let longest = m.longest_stick_s.unwrap_or(0.0);
    let roughness = match rate_deg_s {
        Some(_) => m.stick_slip_cycles_per_s + PER_SECOND * longest,
        // Where a path turns round every shaft rests: the error alone tells what that costs.
        None => PER_DEGREE_AT_MOST * m.max_error_rad.to_degrees(),
    };
    let chatter = PER_VOLT_PER_SECOND * m.control_variation_v_s;
    let cost = roughness + chatter + PER_DEGREE * m.rms_error_rad.to_degrees();
    let follows = m.max_error_rad < FAR && cost.is_finite();
    Ok(Score {
        cost: follows.then_some(cost),
        cycles_per_s: m.stick_slip_cycles_per_s,
        rms_error_rad: m.rms_error_rad,
        max_error_rad: m.max_error_rad,
        longest_stick_s: longest,
        control_variation_v_s: m.control_variation_v_s,
        runs_with_sticks: u32::from(m.stick_time_fraction > 0.0),
        ..own
    })
}
