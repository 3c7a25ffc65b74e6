//! Identification of random rigs that the estimators know nothing of: the table of docs/identify.md, by `cargo xtask
//! identify`.
//!
//! ```sh
//! cargo run --release --package clutch-identify --example identified_rigs -- 200 10001
//! ```

use clutch_identify::experiment::{Programme, VirtualBoard, experiment};
use clutch_identify::{Estimate, Finding, Report, identify};
use rayon::prelude::*;

#[path = "random_rig/mod.rs"]
#[allow(dead_code, reason = "its motors are of another example")]
mod random_rig;
#[path = "random_rig/rows.rs"]
mod rows;
use random_rig::{Outcome, Truth, truth};
use rows::{As, print_row};

type Get = (fn(&Report) -> &Finding, fn(&Truth) -> f64);

const ROWS: &[(&str, As, Get)] = &[
    ("T/J", As::Percent, (|r| &r.pull, |t| t.pull)),
    ("delay", As::Times(1e3, "ms"), (|r| &r.delay, |t| t.delay)),
    ("v_hold = T/(μ_d K)", As::Percent, (|r| &r.hold, |t| t.hold)),
    ("ripple, rms", As::Times(1.0, ""), (|r| &r.ripple, |t| t.ripple)),
    ("μ_s/μ_d", As::Percent, (|r| &r.ratio, |t| t.ratio)),
    ("Stribeck velocity", As::Factor, (|r| &r.stribeck, |t| t.stribeck)),
    ("C/J", As::Times(1.0, "1/s"), (|r| &r.damping, |t| t.damping)),
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
            let recordings =
                experiment(&truth.scenario, &programme, &mut |name, scenario| board.run(name, scenario))
                    .map_err(|e| format!("rig {seed}: {e}"))?;
            let report = identify(&recordings);
            Ok((truth, report))
        })
        .collect();
    let mut failed = Vec::new();
    let mut done = Vec::new();
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
        "{} rigs from seed {first}, {:.1} s of experiment each; {} experiments ended early; unexplained ticks on {flagged}",
        rigs,
        programme.seconds(),
        failed.len()
    );
    failed.iter().for_each(|line| println!("{line}"));
    Ok(())
}
