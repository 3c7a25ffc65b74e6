//! Identification of random rigs that the estimators know nothing of: the table of docs/identify.md, by `cargo xtask
//! identify`.
//!
//! ```sh
//! cargo run --release --package clutch-identify --example identified_rigs -- 200 10001
//! ```

use clutch_identify::experiment::{PartRunner, Programme, experiment};
use clutch_identify::{Report, identify};
use clutch_sim::Scenario;

#[path = "random_rig/campaign.rs"]
mod campaign;
#[path = "random_rig/mod.rs"]
#[allow(dead_code, reason = "its motors are of another example")]
mod random_rig;
#[path = "random_rig/rows.rs"]
mod rows;
use campaign::{Campaign, Row};
use random_rig::{Outcome, Set, Truth, named, truth_with};
use rows::As;

const ROWS: &[Row<Truth, Report>] = &[
    ("T/J", As::Percent, |r| &r.pull, |t| t.pull),
    ("delay", As::Times(1e3, "ms"), |r| &r.delay, |t| t.delay),
    ("lag", As::Times(1e3, "ms"), |r| &r.lag, |t| t.lag),
    ("v_hold = T/(μ_d K)", As::Percent, |r| &r.hold, |t| t.hold),
    ("ripple, rms", As::Times(1.0, ""), |r| &r.ripple, |t| t.ripple),
    ("μ_s/μ_d", As::Percent, |r| &r.ratio, |t| t.ratio),
    ("Stribeck velocity", As::Factor, |r| &r.stribeck, |t| t.stribeck),
    ("C/J", As::Times(1.0, "1/s"), |r| &r.damping, |t| t.damping),
];

fn main() -> Outcome<()> {
    let run = |seed, set: &Set| {
        let truth = truth_with(seed, set)?;
        let mut runner = PartRunner::default();
        let run = &mut |name: &str, part: &Scenario| runner.run(name, part);
        let report = identify(&experiment(&truth.scenario, &Programme::default(), run)?);
        Ok((truth, report))
    };
    let found = |truth: &Truth, report: &Report| format!("{}: {:?}", named(&truth.scenario), report.found);
    let seconds = Programme::default().seconds();
    Campaign { rows: ROWS, seconds, run, found, unexplained: |report| &report.unexplained }.print()
}
