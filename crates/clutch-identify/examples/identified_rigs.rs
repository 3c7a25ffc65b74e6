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
mod random_rig;
use random_rig::{Outcome, Truth, truth};

/// The form in which an error is told.
#[derive(Clone, Copy)]
enum As {
    Percent,
    Factor,
    Times(f64, &'static str),
}

impl As {
    fn error(self, found: f64, truth: f64) -> f64 {
        match self {
            As::Percent => 100.0 * (found / truth - 1.0).abs(),
            As::Factor => (found / truth).max(truth / found),
            As::Times(by, _) => by * (found - truth).abs(),
        }
    }

    fn shown(self, error: f64) -> String {
        match self {
            As::Percent => format!("{error:.2} %"),
            As::Factor => format!("× {error:.2}"),
            As::Times(_, unit) => format!("{error:.3} {unit}").trim_end().to_owned(),
        }
    }
}

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

fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(at.saturating_sub(1).min(sorted.len().saturating_sub(1))).copied().unwrap_or(f64::NAN)
}

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
                    Finding::Known(e) => println!(
                        "  {name}: {:.6} for {:.6}, {}{} [{:.6}, {:.6}]",
                        e.value,
                        of(truth),
                        how.shown(how.error(e.value, of(truth))),
                        if e.holds(of(truth)) { "" } else { " MISSED" },
                        e.low,
                        e.high
                    ),
                    Finding::Refused(why) => println!("  {name}: {why}"),
                }
            }
            report.unexplained.iter().for_each(|line| println!("  unexplained: {line}"));
        }
    }
    println!(
        "| parameter | told | error, median | p90 | largest | interval holds it | half width of the interval, median |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (name, how, (get, of)) in ROWS {
        let known: Vec<(Estimate, f64)> =
            done.iter().filter_map(|(truth, report)| Some((get(report).known()?, of(truth)))).collect();
        let sorted = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values
        };
        let errors = sorted(known.iter().map(|(e, truth)| how.error(e.value, *truth)).collect());
        // The half of a factor is the larger end over the value.
        let half = |e: &Estimate| match how {
            As::Factor => e.high / e.value,
            As::Percent => 50.0 * (e.high - e.low) / e.value,
            As::Times(by, _) => 0.5 * by * (e.high - e.low),
        };
        let halves = sorted(known.iter().map(|(e, _)| half(e)).collect());
        let held = known.iter().filter(|(e, truth)| e.holds(*truth)).count();
        println!(
            "| {name} | {} of {} | {} | {} | {} | {held} of {} | {} |",
            known.len(),
            done.len(),
            how.shown(quantile(&errors, 0.5)),
            how.shown(quantile(&errors, 0.9)),
            how.shown(quantile(&errors, 1.0)),
            known.len(),
            how.shown(quantile(&halves, 0.5)),
        );
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
