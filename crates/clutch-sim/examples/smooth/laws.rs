//! Laws against rates: the table `laws` of docs/smooth.md, and the cells of its figure.

use super::{Outcome, Summary, runs, shown};
use serde_json::json;

/// Rates of the paths, °/s.
const RATES: [f64; 9] = [100.0, 20.0, 10.0, 6.0, 4.0, 2.0, 1.5, 1.0, 0.5];

/// A law.
pub(super) struct Law {
    /// The law's name for readers.
    pub(super) title: &'static str,
    /// The same in a figure.
    short: &'static str,
    /// Its part of a scenario.
    pub(super) scenario: &'static str,
}

/// The law glide.
pub(super) const GLIDE: &str = LAWS[0].scenario;

/// PI with feed-forward, and the source of its velocity.
macro_rules! pi {
    ($velocity:literal) => {
        concat!(
            "[law.pid]\nkp_v_rad = 2370.0\nki_v_rad_s = 25000.0\nkd_v_s_rad = 14.5\nbias_v = 2.24\n\n",
            $velocity
        )
    };
}

/// Every law; glide first.
pub(super) const LAWS: &[Law] = &[
    Law { title: "glide", short: "glide", scenario: "[law.glide.filter]\ndelay_ticks = 1" },
    Law {
        title: "glide, `f32`",
        short: "glide, f32",
        scenario: "[law.glide.filter]\ndelay_ticks = 1\n\n[sampling]\nscalar = \"f32\"",
    },
    Law {
        title: "PI with feed-forward, (5)",
        short: "PI, (5)",
        scenario: pi!("[velocity.smoothed_derivative]\nsmoothing = 0.67"),
    },
    Law {
        title: "the same, edge-timed",
        short: "PI, edges",
        scenario: pi!("[velocity.edge_timed]\ndelay_ticks = 1"),
    },
    Law { title: "the same, M/T", short: "PI, M/T", scenario: pi!("[velocity.counts_over_time]") },
    Law {
        title: "PD 1660/12.9, (5)",
        short: "PD, (5)",
        scenario: "[law.pd]\nkp_v_rad = 1660.0\nkd_v_s_rad = 12.9\n\n[velocity.smoothed_derivative]\nsmoothing = 0.712",
    },
    Law {
        title: "DOB 6700/150/120, (5)",
        short: "DOB, (5)",
        scenario: "[law.dob]\nkp_1_s2 = 6700.0\nkd_1_s = 150.0\nbandwidth_rad_s = 120.0\n\n[velocity.smoothed_derivative]\nsmoothing = 0.41",
    },
    Law {
        title: "DOB 12000/400/100, edge-timed",
        short: "DOB, edges",
        scenario: "[law.dob]\nkp_1_s2 = 12000.0\nkd_1_s = 400.0\nbandwidth_rad_s = 100.0\n\n[velocity.edge_timed]\ndelay_ticks = 1",
    },
    Law {
        title: "SMC with an integral 10/0/61/4250/0.51, (5)",
        short: "SMC with ∫, (5)",
        scenario: "[law.smc_integral]\nkp_v = 10.0\nslope_1_s = 61.0\nintegral_1_s2 = 4250.0\nboundary_rad_s = 0.51\n\n[velocity.smoothed_derivative]\nsmoothing = 0.27",
    },
    Law {
        title: "SMC with an integral 10/38/16.3/1460/0.18, edge-timed",
        short: "SMC with ∫, edges",
        scenario: "[law.smc_integral]\nkp_v = 10.0\nkd_v_s_rad = 38.0\nslope_1_s = 16.3\nintegral_1_s2 = 1460.0\nboundary_rad_s = 0.18\n\n[velocity.edge_timed]\ndelay_ticks = 1",
    },
    Law {
        title: "super-twisting 4.4/42/37, (5)",
        short: "super-twisting, (5)",
        scenario: "[law.super_twisting]\nk1_v_rt_s_rad = 4.4\nk2_v_s = 42.0\nslope_1_s = 37.0\n\n[velocity.smoothed_derivative]\nsmoothing = 0.34",
    },
    Law {
        title: "super-twisting 5.35/46.8/19.3, edge-timed",
        short: "super-twisting, edges",
        scenario: "[law.super_twisting]\nk1_v_rt_s_rad = 5.35\nk2_v_s = 46.8\nslope_1_s = 19.3\n\n[velocity.edge_timed]\ndelay_ticks = 1",
    },
    Law {
        title: "super-twisting 8.4/230/26, layer 0.063, edge-timed",
        short: "the same, layer",
        scenario: "[law.super_twisting]\nk1_v_rt_s_rad = 8.4\nk2_v_s = 230.0\nslope_1_s = 26.0\nboundary_rad_s = 0.063\n\n[velocity.edge_timed]\ndelay_ticks = 1",
    },
    Law { title: "SMC of Table 2, (5)", short: "Table 2: SMC, (5)", scenario: "[law.smc]" },
    Law { title: "the same, observer", short: "SMC, observer", scenario: "[law.smc]\n\n[velocity.observer]" },
    Law {
        title: "the same, edge-timed",
        short: "SMC, edges",
        scenario: "[law.smc]\n\n[velocity.edge_timed]\ndelay_ticks = 1",
    },
    Law { title: "the same, M/T", short: "SMC, M/T", scenario: "[law.smc]\n\n[velocity.counts_over_time]" },
    Law { title: "CTC of Table 2, (5)", short: "Table 2: CTC, (5)", scenario: "[law.ctc]" },
    Law { title: "PD of Table 2, (5)", short: "Table 2: PD, (5)", scenario: "[law.pd]" },
];

/// Two tables, and the same as JSON in a file if one is named.
pub(super) fn laws(file: Option<&str>) -> Outcome<()> {
    let rates: Vec<String> = RATES.iter().map(|rate| format!("{rate} °/s")).collect();
    let head = |first: &str| {
        println!("| {first} | {} |", rates.join(" | "));
        println!("|---|{}", "---|".repeat(RATES.len()));
    };
    head("law, velocity from: cycles/s (discs), largest error");
    let mut rows = Vec::new();
    for law in LAWS {
        let at = |rate| -> Outcome<Summary> {
            Ok(Summary::of(&runs(law.scenario, &[("reference.ramp.rate_deg_s", rate)], 1..41)?))
        };
        let found = RATES.into_iter().map(at).collect::<Outcome<Vec<_>>>()?;
        let cell = |s: &Summary| format!("{} ({}), {:.3}°", shown(s.cycles), s.discs, s.error);
        println!("| {} | {} |", law.title, found.iter().map(cell).collect::<Vec<_>>().join(" | "));
        rows.push((law, found));
    }
    println!();
    head("the same: RMS error, V/s, share of time stuck");
    for (law, found) in &rows {
        let cell = |s: &Summary| format!("{:.4}°, {:.0}, {} %", s.rms, s.travel, shown(100.0 * s.stuck));
        println!("| {} | {} |", law.title, found.iter().map(cell).collect::<Vec<_>>().join(" | "));
    }
    let Some(file) = file else { return Ok(()) };
    let all = |of: fn(&Summary) -> f64| -> Vec<Vec<f64>> {
        rows.iter().map(|(_, found)| found.iter().map(of).collect()).collect()
    };
    let cells = json!({
        "laws": LAWS.iter().map(|law| law.short).collect::<Vec<_>>(),
        "rates_deg_s": RATES,
        "cycles_per_s": all(|s| s.cycles),
        "max_error_deg": all(|s| s.error),
        "travel_v_s": all(|s| s.travel),
        "stuck_percent": all(|s| 100.0 * s.stuck),
    });
    Ok(std::fs::write(file, serde_json::to_string(&cells)?)?)
}
