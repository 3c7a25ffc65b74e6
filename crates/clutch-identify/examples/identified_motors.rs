//! Identification of random motor axes that the estimators know nothing of: the second table of docs/identify.md, by `cargo
//! xtask identify`.
//!
//! ```sh
//! cargo run --release --package clutch-identify --example identified_motors -- 200 10001
//! ```

use clutch_identify::experiment::VirtualBoard;
use clutch_identify::motor::experiment::{Programme, experiment};
use clutch_identify::motor::{Report, identify};
use clutch_identify::{Estimate, Finding};
use rayon::prelude::*;

#[path = "random_rig/mod.rs"]
#[allow(dead_code, reason = "its brakes are of other examples")]
mod random_rig;
#[path = "random_rig/rows.rs"]
mod rows;
use random_rig::Outcome;
use random_rig::motor::{Truth, truth};
use rows::{As, print_row};

type Get = (fn(&Report) -> &Finding, fn(&Truth) -> f64);

const ROWS: &[(&str, As, Get)] = &[
    ("T_s/K forwards", As::Percent, (|r| &r.at_rest[0], |t| t.at_rest - t.load)),
    ("T_s/K backwards", As::Percent, (|r| &r.at_rest[1], |t| t.at_rest + t.load)),
    ("T_c/K forwards", As::Percent, (|r| &r.sliding[0], |t| t.sliding - t.load)),
    ("T_c/K backwards", As::Percent, (|r| &r.sliding[1], |t| t.sliding + t.load)),
    ("load T/K", As::Times(1e3, "mV"), (|r| &r.load, |t| t.load)),
    ("C/K", As::Times(1e3, "mV s/rad"), (|r| &r.viscous, |t| t.viscous)),
    ("Stribeck velocity", As::Factor, (|r| &r.stribeck, |t| t.stribeck)),
    ("J/K", As::Percent, (|r| &r.inertia, |t| t.inertia)),
    ("delay", As::Times(1e3, "ms"), (|r| &r.delay, |t| t.delay)),
    ("ripple, rms", As::Times(1.0, ""), (|r| &r.ripple, |t| t.ripple)),
];

fn main() -> Outcome<()> {
    let mut args = std::env::args().skip(1);
    let mut number = |default: u64| args.next().map_or(Ok(default), |text| text.parse::<u64>());
    let (rigs, first) = (number(200)?, number(10_001)?);
    let detail = number(0)? > 0;
    let programme = Programme::default();
    let runs: Vec<Outcome<(Truth, Report)>> = (first..first + rigs)
        .into_par_iter()
        .map(|seed| {
            let truth = truth(seed)?;
            let mut board = VirtualBoard::default();
            let recordings = experiment(&truth.scenario, &programme, &mut |name, part| board.run(name, part))
                .map_err(|e| format!("axis {seed}: {e}"))?;
            let report = identify(&recordings);
            Ok((truth, report))
        })
        .collect();
    let (mut done, mut failed) = (Vec::new(), Vec::new());
    for run in runs {
        match run {
            Ok(run) => done.push(run),
            Err(e) => failed.push(e.to_string()),
        }
    }
    if detail {
        for (truth, report) in &done {
            println!("{} {:?}", truth.scenario.name(), report.found);
            for (name, how, (get, of)) in ROWS {
                match get(report) {
                    Finding::Known(e) => println!("  {name}: {}", how.detail(e, of(truth))),
                    Finding::Refused(why) => println!("  {name}: {why}"),
                }
            }
            report.unexplained.iter().for_each(|line| println!("  unexplained: {line}"));
        }
    }
    rows::print_head();
    for (name, how, (get, of)) in ROWS {
        let known: Vec<(Estimate, f64)> =
            done.iter().filter_map(|(truth, report)| Some((get(report).known()?, of(truth)))).collect();
        print_row(name, *how, &known, done.len());
    }
    let flagged = done.iter().filter(|(_, report)| !report.unexplained.is_empty()).count();
    println!(
        "{rigs} rigs from seed {first}, {:.1} s of experiment each; {} experiments ended early; unexplained ticks on {flagged}",
        programme.seconds(),
        failed.len()
    );
    failed.iter().for_each(|line| println!("{line}"));
    Ok(())
}
