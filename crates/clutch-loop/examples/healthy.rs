//! Healthy runs for as many simulated hours as you like; fails if one ends by a check that no bad line explains.
//!
//! `cargo run --release -p clutch-loop --example healthy -- [HOURS [FIRST_SEED]]`

use clutch_loop::healthy::{HealthyShaft, is_nuisance};
use std::collections::BTreeMap;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let hours: f64 = args.next().map_or(Ok(10.0), |s| s.parse())?;
    let first: u64 = args.next().map_or(Ok(1), |s| s.parse())?;
    let (mut periods, mut runs, mut nuisance) = (0, 0_u64, 0);
    let mut ends = BTreeMap::<String, u64>::new();
    // Periods of 1 ms in which control was on.
    while (periods as f64) < hours * 3.6e6 {
        let run = HealthyShaft { seed: first + runs, seconds: 20 };
        let report = run.run()?;
        periods += report.answers;
        runs += 1;
        let cause = report.cause.map_or("went on".to_owned(), |c| format!("{c:?}"));
        if report.cause.is_some_and(is_nuisance) {
            nuisance += 1;
            eprintln!("FAILED: seed {}: {cause} after {} periods", run.seed, report.answers);
        }
        *ends.entry(cause).or_default() += 1;
    }
    println!(
        "{runs} runs, {:.2} h under control, {nuisance} ended though nothing was broken; {ends:?}",
        periods as f64 / 3.6e6
    );
    if nuisance > 0 { Err("healthy runs were ended".into()) } else { Ok(()) }
}
