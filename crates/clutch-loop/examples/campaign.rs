//! The fault campaign: `cargo run --release -p clutch-loop --example campaign -- [SEEDS [FIRST]]`.
use clutch_core::supervisor::Checks;
use clutch_loop::campaign::{CASES, Expected, runs};
use std::collections::BTreeMap;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let seeds = args.next().map_or(Ok(12), |s| s.parse())?;
    let first = args.next().map_or(Ok(1), |s| s.parse())?;
    let mut rows: BTreeMap<usize, (u64, f64, f64, f64, BTreeMap<String, u64>, u64)> = BTreeMap::new();
    let mut failures = 0;
    for run in runs(first, seeds) {
        let o = run.run(Checks::ALL, false)?;
        let row = rows.entry(run.case).or_default();
        row.0 += 1;
        if let (Some(safe), Some(hit)) = (o.safe, o.hit) {
            row.1 = row.1.max(safe - hit);
        }
        row.2 = row.2.max(o.overrun.to_degrees());
        row.3 = row.3.max(o.largest_error.to_degrees());
        *row.4.entry(o.cause.map_or("none".into(), |c| format!("{c:?}"))).or_default() += 1;
        if let Some(what) = run.judge(&o) {
            row.5 += 1;
            failures += 1;
            if failures < 60 {
                println!("FAILED: {}: {what}", run.name());
            }
        }
    }
    println!(
        "| fault | hazards | runs | must be safe within | was, at most | overrun, at most | named |\n|---|---|---|---|---|---|---|"
    );
    for (case, (n, time, overrun, error, causes, failed)) in rows {
        let c = &CASES[case];
        let causes: Vec<String> = causes.iter().map(|(c, n)| format!("{c} {n}")).collect();
        let within = match c.expected {
            Expected::Safe { within, .. } | Expected::BoardSafe { within } => format!("{} ms", within * 1e3),
            Expected::Tolerated => "tolerated".into(),
        };
        println!(
            "| {} | {} | {n} | {within} | {:.3} ms | {overrun:.3}° ({error:.3}°) | {} | {failed} failed",
            c.name,
            c.hazards,
            time * 1e3,
            causes.join(", ")
        );
    }
    println!("{failures} failures");
    Ok(())
}
