//! Identification of random motor axes that the estimators know nothing of: the second table of docs/identify.md, by `cargo
//! xtask identify`.
//!
//! ```sh
//! cargo run --release --package clutch-identify --example identified_motors -- 200 10001
//! ```

use clutch_identify::experiment::PartRunner;
use clutch_identify::motor::experiment::{Programme, experiment};
use clutch_identify::motor::{Report, identify};
use clutch_sim::Scenario;

#[path = "random_rig/campaign.rs"]
mod campaign;
#[path = "random_rig/mod.rs"]
#[allow(dead_code, reason = "its brakes are of other examples")]
mod random_rig;
#[path = "random_rig/rows.rs"]
mod rows;
use campaign::{Campaign, Row};
use random_rig::motor::{Truth, truth_with};
use random_rig::{Outcome, Set, named};
use rows::As;

const ROWS: &[Row<Truth, Report>] = &[
    ("T_s/K forwards", As::Percent, |r| &r.at_rest[0], |t| t.at_rest - t.load),
    ("T_s/K backwards", As::Percent, |r| &r.at_rest[1], |t| t.at_rest + t.load),
    ("T_c/K forwards", As::Percent, |r| &r.sliding[0], |t| t.sliding - t.load),
    ("T_c/K backwards", As::Percent, |r| &r.sliding[1], |t| t.sliding + t.load),
    ("load T/K", As::Times(1e3, "mV"), |r| &r.load, |t| t.load),
    ("C/K", As::Times(1e3, "mV s/rad"), |r| &r.viscous, |t| t.viscous),
    ("Stribeck velocity", As::Factor, |r| &r.stribeck, |t| t.stribeck),
    ("J/K", As::Percent, |r| &r.inertia, |t| t.inertia),
    ("delay", As::Times(1e3, "ms"), |r| &r.delay, |t| t.delay),
    ("ripple, rms", As::Times(1.0, ""), |r| &r.ripple, |t| t.ripple),
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
