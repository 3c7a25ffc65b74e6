//! Lowest rate at which a scenario moves without a stick, and the reason why a slower one does not.
//!
//! A rate is smooth if on each disc the shaft goes with the path from the settling time to the end of the run and never
//! comes to rest. Rates are tried from the lowest up: a rate that is not smooth shows it soon, on its hardest disc, while one
//! that is costs a whole run of every disc. Nothing says that a rate above a smooth one is smooth, too: the rates above are
//! tried as well, and those that are not are reported as holes.

mod cause;
mod failure;
mod map;

pub use cause::{ENCODER_LIMIT, Evidence, Wall};
pub use failure::{Failing, Failure};
pub use map::{Axis, Column, GainMap, RateMap, Tried, gain_map, law_keys, rate_map};

use crate::progress::Report;
use crate::scenario::Scenario;
use crate::scenario_error::ScenarioError;
use clutch_core::reference::ReferenceParams;
use serde::Serialize;
use toml::Value;

/// Key of the rate.
pub const RATE: &str = "reference.ramp.rate_deg_s";
/// Rates that are tried unless others are asked for, °/s.
pub const RATES_DEG_S: [f64; 12] = [0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 15.0, 20.0];
/// Discs that are tried unless another number is asked for.
pub const DISCS: u32 = 10;
/// Most discs that may be asked for.
const MOST_DISCS: u32 = 10_000;

/// Rates and discs that are tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Trials {
    rates_deg_s: Vec<f64>,
    discs: u32,
    above: u32,
}

impl Default for Trials {
    fn default() -> Self {
        Trials { rates_deg_s: RATES_DEG_S.to_vec(), discs: DISCS, above: DISCS }
    }
}

impl Trials {
    /// Ramps at `rates_deg_s` (°/s), in any order, each on the discs of the seeds 1 to `discs`.
    ///
    /// # Errors
    /// The fault, with `origin` before it.
    pub fn new(origin: &str, rates_deg_s: &[f64], discs: i64) -> Result<Trials, ScenarioError> {
        let wrong =
            |key, value: String, expected: &str| Err(ScenarioError::value(origin, key, &value, expected));
        let mut rates = rates_deg_s.to_vec();
        rates.sort_by(f64::total_cmp);
        rates.dedup();
        if rates.is_empty() {
            return wrong("rates", "none".to_owned(), "at least one rate, °/s");
        }
        if let Some(bad) = rates.iter().find(|rate| !(rate.is_finite() && **rate > 0.0)) {
            return wrong("rates", bad.to_string(), "finite numbers above 0 °/s");
        }
        let expected = format!("a whole number from 1 to {MOST_DISCS}");
        let Some(discs) = u32::try_from(discs).ok().filter(|n| (1..=MOST_DISCS).contains(n)) else {
            return wrong("discs", discs.to_string(), &expected);
        };
        Ok(Trials { rates_deg_s: rates, discs, above: discs })
    }

    /// With as many discs at the rates above the lowest smooth one, those that stuck below first.
    #[must_use]
    pub fn above(mut self, discs: u32) -> Trials {
        self.above = discs.min(self.discs);
        self
    }

    /// The rates, rising, °/s.
    #[must_use]
    pub fn rates_deg_s(&self) -> &[f64] {
        &self.rates_deg_s
    }

    /// The number of discs.
    #[must_use]
    pub fn discs(&self) -> u32 {
        self.discs
    }

    /// All seeds, beginning with one of them.
    fn seeds(&self, first: u64) -> impl Iterator<Item = u64> {
        let others = (1..=u64::from(self.discs)).filter(move |seed| *seed != first);
        std::iter::once(first).chain(others)
    }
}

/// The lowest smooth rate of those that were tried, and the reason why a slower one is not.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SmoothSpeed {
    /// The lowest rate at which every disc is smooth, °/s; none if there is no such rate.
    pub rate_deg_s: Option<f64>,
    /// The first of the causes that hold at the rate below; none if none does, or no rate below was tried.
    pub cause: Option<Wall>,
    /// The run that was not smooth at the next lower rate; none if it was smooth at the lowest.
    pub below: Option<Failure>,
    /// Rates above the lowest smooth one that are not smooth, with the first run that showed it.
    pub holes: Vec<Failure>,
    /// The ground from which the causes follow, at the rate below; at the lowest if that is smooth.
    pub evidence: Evidence,
    /// Discs that each rate up to the lowest smooth one was tried on.
    pub discs: u32,
    /// Discs that each rate above it was tried on.
    pub discs_above: u32,
    /// The rates that were to be tried, °/s.
    pub rates_deg_s: Vec<f64>,
    /// Number of runs, but for one on an even disc.
    pub runs: u64,
}

/// Finds the lowest smooth rate. The scenario's own rate and seed do not matter. `report` gets each run.
///
/// # Errors
/// The path is no ramp, the law follows none, or the scenario refuses a rate; the end of `report`'s patience.
pub fn lowest_smooth_speed(
    scenario: &Scenario,
    trials: &Trials,
    report: Report<'_>,
) -> Result<SmoothSpeed, ScenarioError> {
    check(scenario)?;
    let (mut runs, mut hardest, mut below, mut found) = (0, 1, None, None);
    let lowest = trials.rates_deg_s[0];
    let mut at = (lowest, scenario.at_rate(lowest)?);
    let mut holes = Vec::new();
    for rate in &trials.rates_deg_s {
        let rung = scenario.at_rate(*rate)?;
        let discs = if found.is_some() { trials.above } else { trials.discs };
        let mut failure = None;
        for seed in trials.seeds(hardest).take(discs as usize) {
            runs += 1;
            failure = rung.disc(*rate, seed, report)?;
            if failure.is_some() {
                break;
            }
        }
        match (failure, found) {
            (Some(failure), None) => (hardest, below, at) = (failure.seed, Some(failure), (*rate, rung)),
            (Some(failure), Some(_)) => holes.push(failure),
            (None, None) => found = Some(*rate),
            (None, Some(_)) => {}
        }
    }
    let evidence = Evidence::new(at.0, &at.1)?.with(below.as_ref(), &at.1, report)?;
    Ok(SmoothSpeed {
        rate_deg_s: found,
        cause: below.and_then(|_| evidence.causes.first().copied()),
        below,
        holes,
        evidence,
        discs: trials.discs,
        discs_above: trials.above,
        rates_deg_s: trials.rates_deg_s.clone(),
        runs,
    })
}

/// A rate can be asked of a ramp alone, and only of a law that follows one.
fn check(scenario: &Scenario) -> Result<(), ScenarioError> {
    if !matches!(scenario.params().reference, ReferenceParams::Ramp(_)) {
        return Err(
            scenario.refuse("reference", "expected a ramp, [reference.ramp]: its rate is what is looked for")
        );
    }
    if !scenario.params().law.follows() {
        return Err(scenario
            .refuse("law", "expected a law that follows a path: an open-loop voltage has no lowest rate"));
    }
    Ok(())
}

impl Scenario {
    /// The scenario at another rate, °/s.
    fn at_rate(&self, rate_deg_s: f64) -> Result<Scenario, ScenarioError> {
        self.changed(&[(RATE.to_owned(), Value::Float(rate_deg_s))])
    }
}
