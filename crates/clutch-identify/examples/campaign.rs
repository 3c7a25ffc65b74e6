//! Identification of random rigs that the estimators know nothing of: the table of docs/identify.md, by `cargo xtask
//! identify`.
//!
//! ```sh
//! cargo run --release --package clutch-identify --example campaign -- 200 10001
//! ```

use clutch_identify::experiment::{Programme, VirtualBoard, experiment};
use clutch_identify::{Estimate, Finding, Report, identify};
use clutch_sim::Scenario;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use std::error::Error;

type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// A rig, as nobody knows it.
struct Truth {
    scenario: Scenario,
    delay: f64,
    pull: f64,
    hold: f64,
    ripple: f64,
    ratio: f64,
    stribeck: f64,
    damping: f64,
}

fn truth(seed: u64) -> Outcome<Truth> {
    let mut rng = Pcg64::seed_from_u64(seed ^ 0x6964_656e);
    let inertia = 0.0017 * rng.random_range(0.7..1.3_f64);
    let mass = 0.2 * rng.random_range(0.8..1.2_f64);
    let dynamic = rng.random_range(0.08..0.16_f64);
    let ratio = rng.random_range(1.15..2.2_f64);
    let stribeck = 0.0005 * 10.0_f64.powf(rng.random_range(0.0..1.0_f64));
    let viscous = rng.random_range(0.0003..0.003_f64);
    let ripple = rng.random_range(0.03..0.17_f64);
    let delay = rng.random_range(0..=2_u32);
    let text = format!(
        "name = \"rig {seed}\"\n[rig]\nbase = \"bench\"\ndelay_ticks = {delay}\ninertia_kg_m2 = {inertia:?}\n\
         viscous_damping_nm_s_rad = {viscous:?}\n[rig.drive.weight]\nmass_kg = {mass:?}\n\
         [rig.friction.stribeck]\nmu_static = {:?}\nmu_dynamic = {dynamic:?}\nstribeck_velocity_rad_s = {stribeck:?}\n\
         [rig.ripple]\nrms = {ripple:?}\n[law.smc]\n[reference.ramp]\nrate_deg_s = 2.0\n\
         [bounds]\nfriction_percent = 60.0\ninertia_percent = 40.0\ndrive_torque_percent = 25.0\n\
         viscous_damping_percent = 99.0\n[run]\nseed = {seed}\nstart = \"rest\"\n\
         [safety]\nreason = \"a weight drives the shaft\"\n[safety.on_fault.hold]\nvolts_v = 9.99\n",
        ratio * dynamic,
    );
    let scenario = Scenario::parse("rig", &text, &[])?;
    let torque = mass * 9.81 * 0.024;
    let gain = clutch_core::Actuator::<f64>::new(&scenario.spec().rig.actuator)?.brake_gain();
    Ok(Truth {
        scenario,
        delay: f64::from(delay) * 1e-3,
        pull: torque / inertia,
        hold: torque / (dynamic * gain),
        ripple,
        ratio,
        stribeck,
        damping: viscous / inertia,
    })
}

/// How an error is told.
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
        // Of a factor: the larger end over the value.
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
