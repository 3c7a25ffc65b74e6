//! Glide on other encoders, periods and delays: the table `loops` of docs/smooth.md.

use super::laws::GLIDE;
use super::{FRESH, Outcome, Summary, runs, shown};

/// Rates of the paths, °/s.
const RATES: [f64; 4] = [1.0, 2.0, 4.0, 10.0];
const COUNTS: &str = "rig.encoder.counts_per_rev";
const PERIOD: &str = "sampling.period_us";
const DELAYS: [&str; 2] = ["rig.delay_ticks", "law.glide.filter.delay_ticks"];

/// One departure from 20 000 counts, 1 ms and a delay of one period, of which the law is told.
fn loops_tried() -> Vec<(String, Vec<(&'static str, f64)>)> {
    let one = |title: String, key, value| (title, vec![(key, value)]);
    let mut all = vec![("20 000 counts, 1 ms, one period".to_owned(), Vec::new())];
    // An encoder sees no wave shorter than twenty counts.
    let coarse = vec![(COUNTS, 4096.0), ("law.glide.filter.ripple_waves_per_turn", 200.0)];
    all.push(("4096 counts, 200 waves believed for 340".to_owned(), coarse));
    all.extend([8192, 10_000, 65_536, 200_000].map(|n| one(format!("{n} counts"), COUNTS, f64::from(n))));
    all.extend([250, 500, 2000].map(|us| one(format!("{us} µs"), PERIOD, f64::from(us))));
    all.extend([0, 2, 3].map(|ticks| {
        let keys = DELAYS.map(|key| (key, f64::from(ticks))).to_vec();
        (format!("delay of {ticks} periods, told"), keys)
    }));
    all.push(one("delay of 2 periods, one believed".to_owned(), DELAYS[0], 2.0));
    all
}

/// A row for each loop.
pub(super) fn loops() -> Outcome<()> {
    let rates: Vec<String> = RATES.iter().map(|rate| format!("{rate} °/s")).collect();
    println!("| the loop: cycles/s (discs of 40), largest error, V/s | {} |", rates.join(" | "));
    println!("|---|{}", "---|".repeat(RATES.len()));
    for (title, keys) in loops_tried() {
        let at = |rate| -> Outcome<String> {
            let keys: Vec<_> = keys.iter().copied().chain([("reference.ramp.rate_deg_s", rate)]).collect();
            let s = Summary::of(&runs(GLIDE, &keys, FRESH)?);
            Ok(format!("{} ({}), {:.3}°, {:.0}", shown(s.cycles), s.discs, s.error, s.travel))
        };
        let cells = RATES.into_iter().map(at).collect::<Outcome<Vec<_>>>()?;
        println!("| {title} | {} |", cells.join(" | "));
    }
    Ok(())
}
