//! Rigs that are unlike the model, each in one way: the table of refusals in docs/identify.md, by `cargo xtask identify`.
//!
//! ```sh
//! cargo run --release --package clutch-identify --example unlike_rigs -- 50 50001
//! ```

use clutch_identify::{Finding, Report, identify};
use rayon::prelude::*;

#[path = "random_rig/mod.rs"]
#[allow(dead_code, reason = "its motors are of another example")]
mod random_rig;
use random_rig::unlike::{KINDS, recordings};
use random_rig::{Outcome, Truth};

/// A rig's report; none where a check ended the experiment.
type Found = (Truth, Option<Report>);

/// T/J, v_hold, μ_s/μ_d and C/J, each with its truth.
fn findings<'a>(truth: &Truth, report: &'a Report) -> [(&'a Finding, f64); 4] {
    [
        (&report.pull, truth.pull),
        (&report.hold, truth.hold),
        (&report.ratio, truth.ratio),
        (&report.damping, truth.damping),
    ]
}

fn misses(truth: &Truth, report: &Report) -> bool {
    findings(truth, report).iter().any(|(finding, truth)| finding.known().is_some_and(|e| !e.holds(*truth)))
}

fn row(name: &str, word: &str, found: &[Found]) -> String {
    let reports = || found.iter().filter_map(|(truth, report)| Some((truth, report.as_ref()?)));
    let named = |r: &Report| r.unexplained.iter().any(|line| line.contains(word));
    let told = |r: &Report| r.hold.known().is_some();
    let numbers = [
        reports().filter(|(_, r)| named(r) && !told(r)).count(),
        reports().filter(|(_, r)| named(r) && told(r)).count(),
        reports().filter(|(_, r)| !named(r) && !r.unexplained.is_empty()).count(),
        found.len() - reports().count(),
        reports().filter(|(_, r)| r.unexplained.is_empty()).count(),
        reports().filter(|(truth, r)| r.unexplained.is_empty() && misses(truth, r)).count(),
    ];
    let numbers: Vec<String> = numbers.iter().map(usize::to_string).collect();
    format!("| {name} | {} |", numbers.join(" | "))
}

fn print_details(first: u64, found: &[Found]) {
    for (seed, (truth, report)) in (first..).zip(found) {
        let Some(report) = report else {
            println!("rig {seed}: ended by a check");
            continue;
        };
        let of = findings(truth, report).map(|(finding, truth)| match finding {
            Finding::Known(e) if e.holds(truth) => format!("{:+.2} %", 100.0 * (e.value / truth - 1.0)),
            Finding::Known(e) => format!("{:+.2} % MISSED", 100.0 * (e.value / truth - 1.0)),
            Finding::Refused(_) => "–".to_owned(),
        });
        println!("rig {seed}: {}; {}", of.join(", "), report.unexplained.join("; "));
    }
}

fn main() -> Outcome<()> {
    let mut args = std::env::args().skip(1);
    let mut number = |default: u64| args.next().map_or(Ok(default), |text| text.parse::<u64>());
    let (rigs, first) = (number(50)?, number(50_001)?);
    let detail = number(0)? > 0;
    println!(
        "| rig | cause named, friction refused | cause named, found with its interval | another reason named | ended by a check | \
         nothing said | of these an interval misses |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (kind, name, word) in KINDS {
        let runs = (first..first + rigs).into_par_iter().map(|seed| {
            let (truth, parts) = recordings(kind, seed).map_err(|e| format!("{name}, rig {seed}: {e}"))?;
            Ok((truth, parts.map(|parts| identify(&parts))))
        });
        let found = runs.collect::<Outcome<Vec<Found>>>()?;
        println!("{}", row(name, word, &found));
        if detail {
            print_details(first, &found);
        }
    }
    println!("\n{rigs} rigs from seed {first}, of each kind");
    Ok(())
}
