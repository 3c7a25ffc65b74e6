//! Smooth motion on the rig `bench`, law by law and rate by rate: the tables of docs/smooth.md, by `cargo xtask smooth`.
//!
//! ```sh
//! cargo run --release --package clutch-sim --example smooth -- laws    # or plants, rest, steps, motions
//! ```

mod steps;

use clutch_sim::sweep::{Row, Sweep};
use clutch_sim::{Keep, Metrics};
use std::error::Error;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use toml::{Table, Value};

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Rates of the paths, °/s.
const RATES: [f64; 9] = [100.0, 20.0, 10.0, 6.0, 4.0, 2.0, 1.5, 1.0, 0.5];

/// A law as it is told to readers, and its part of a scenario.
const LAWS: &[(&str, &str)] = &[
    ("glide", "[law.glide.filter]\ndelay_ticks = 1"),
    (
        "PI with feed-forward, (5)",
        "[law.pid]\nkp_v_rad = 2370.0\nki_v_rad_s = 25000.0\nkd_v_s_rad = 14.5\nbias_v = 2.24\n\n[velocity.smoothed_derivative]\nsmoothing = 0.67",
    ),
    (
        "the same, edge-timed",
        "[law.pid]\nkp_v_rad = 2370.0\nki_v_rad_s = 25000.0\nkd_v_s_rad = 14.5\nbias_v = 2.24\n\n[velocity.edge_timed]\ndelay_ticks = 1",
    ),
    (
        "PD 1660/12.9, (5)",
        "[law.pd]\nkp_v_rad = 1660.0\nkd_v_s_rad = 12.9\n\n[velocity.smoothed_derivative]\nsmoothing = 0.712",
    ),
    (
        "DOB 6700/150/120, (5)",
        "[law.dob]\nkp_1_s2 = 6700.0\nkd_1_s = 150.0\nbandwidth_rad_s = 120.0\n\n[velocity.smoothed_derivative]\nsmoothing = 0.41",
    ),
    (
        "DOB 12000/400/100, edge-timed",
        "[law.dob]\nkp_1_s2 = 12000.0\nkd_1_s = 400.0\nbandwidth_rad_s = 100.0\n\n[velocity.edge_timed]\ndelay_ticks = 1",
    ),
    (
        "SMC with an integral 10/0/61/4250/0.51, (5)",
        "[law.smc_integral]\nkp_v = 10.0\nslope_1_s = 61.0\nintegral_1_s2 = 4250.0\nboundary_rad_s = 0.51\n\n[velocity.smoothed_derivative]\nsmoothing = 0.27",
    ),
    (
        "SMC with an integral 10/38/16.3/1460/0.18, edge-timed",
        "[law.smc_integral]\nkp_v = 10.0\nkd_v_s_rad = 38.0\nslope_1_s = 16.3\nintegral_1_s2 = 1460.0\nboundary_rad_s = 0.18\n\n[velocity.edge_timed]\ndelay_ticks = 1",
    ),
    (
        "super-twisting 4.4/42/37, (5)",
        "[law.super_twisting]\nk1_v_rt_s_rad = 4.4\nk2_v_s = 42.0\nslope_1_s = 37.0\n\n[velocity.smoothed_derivative]\nsmoothing = 0.34",
    ),
    (
        "super-twisting 5.35/46.8/19.3, edge-timed",
        "[law.super_twisting]\nk1_v_rt_s_rad = 5.35\nk2_v_s = 46.8\nslope_1_s = 19.3\n\n[velocity.edge_timed]\ndelay_ticks = 1",
    ),
    (
        "super-twisting 8.4/230/26, layer 0.063, edge-timed",
        "[law.super_twisting]\nk1_v_rt_s_rad = 8.4\nk2_v_s = 230.0\nslope_1_s = 26.0\nboundary_rad_s = 0.063\n\n[velocity.edge_timed]\ndelay_ticks = 1",
    ),
    ("SMC of Table 2, (5)", "[law.smc]"),
    ("the same, observer", "[law.smc]\n\n[velocity.observer]"),
    ("the same, edge-timed", "[law.smc]\n\n[velocity.edge_timed]\ndelay_ticks = 1"),
    ("CTC of Table 2, (5)", "[law.ctc]"),
    ("PD of Table 2, (5)", "[law.pd]"),
];

/// Departures of the rig from what it is without them, one at a time, and those that the law is told of.
const PLANTS: &[(&str, &[(&str, f64)])] = &[
    ("as it is", &[]),
    (
        "friction − 20 %",
        &[("rig.friction.stribeck.mu_static", 0.1624), ("rig.friction.stribeck.mu_dynamic", 0.0832)],
    ),
    (
        "friction + 20 %",
        &[("rig.friction.stribeck.mu_static", 0.2436), ("rig.friction.stribeck.mu_dynamic", 0.1248)],
    ),
    ("load + 10 %", &[("rig.drive.weight.mass_kg", 0.23034)]),
    ("inertia + 20 %", &[("rig.inertia_kg_m2", 0.00204)]),
    ("inertia − 20 %", &[("rig.inertia_kg_m2", 0.00136)]),
    ("damping × 3", &[("rig.viscous_damping_nm_s_rad", 0.003)]),
    ("Stribeck velocity × 2", &[("rig.friction.stribeck.stribeck_velocity_rad_s", 0.00288)]),
    ("μ_s/μ_d = 2.5", &[("rig.friction.stribeck.mu_static", 0.26)]),
    ("torque noise of 1 mN m", &[("rig.torque_noise_nm", 0.001)]),
    ("lag of 1 ms, told", &[("rig.actuator_time_constant_s", 0.001), ("law.glide.filter.lag_s", 0.001)]),
    ("lag of 3 ms, told", &[("rig.actuator_time_constant_s", 0.003), ("law.glide.filter.lag_s", 0.003)]),
    (
        "inertia − 20 %, friction − 20 %, load + 10 %",
        &[
            ("rig.inertia_kg_m2", 0.00136),
            ("rig.friction.stribeck.mu_static", 0.1624),
            ("rig.friction.stribeck.mu_dynamic", 0.0832),
            ("rig.drive.weight.mass_kg", 0.23034),
        ],
    ),
    (
        "the same, inertia and load told",
        &[
            ("rig.inertia_kg_m2", 0.00136),
            ("rig.friction.stribeck.mu_static", 0.1624),
            ("rig.friction.stribeck.mu_dynamic", 0.0832),
            ("rig.drive.weight.mass_kg", 0.23034),
            ("model.inertia_kg_m2", 0.00136),
            ("model.drive_torque_nm", 0.05423),
        ],
    ),
];

/// The model's friction as a multiple of Table 1's, for starts from rest.
const BELIEFS: &[(&str, f64)] = &[
    ("Table 1, 1.51 times the rig's", 1.0),
    ("0.93 times the rig's", 0.614),
    ("1.3 times", 0.86),
    ("0.66 times", 0.4373),
];

/// Runs of a law on `bench` along a ramp, one for each seed.
fn runs(law: &str, keys: &[(&str, f64)], seeds: std::ops::Range<i64>) -> Outcome<Vec<Metrics>> {
    runs_of(&format!("[rig]\nbase = \"bench\"\n\n{law}\n\n[reference.ramp]\nrate_deg_s = 2.0\n"), keys, seeds)
}

/// Runs of a scenario without a name, one for each seed.
fn runs_of(scenario: &str, keys: &[(&str, f64)], seeds: std::ops::Range<i64>) -> Outcome<Vec<Metrics>> {
    let mut base: Table = format!("name = \"smooth\"\n\n{scenario}").parse()?;
    let mut names: Vec<String> = vec!["run.seed".into()];
    names.extend(keys.iter().map(|(key, _)| (*key).to_owned()));
    let rows = seeds.map(|seed| {
        let mut row = vec![Value::Integer(seed)];
        row.extend(keys.iter().map(|(key, value)| match *key {
            "rig.encoder.counts_per_rev" => Value::Integer(*value as i64),
            _ => Value::Float(*value),
        }));
        row
    });
    base.entry("run").or_insert(Value::Table(Table::new()));
    let sweep = Sweep::new("smooth", base, names, rows.collect())?;
    let found = Mutex::new(vec![None; sweep.len()]);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    sweep.run(threads, Keep::Figures, &AtomicBool::new(false), &|i, row| {
        if let Ok(mut found) = found.lock() {
            found[i] = Some(row.map(|Row { run, .. }| run.metrics));
        }
    });
    let found = found.into_inner().map_err(|_| "a run has panicked")?;
    found.into_iter().map(|row| Ok(row.ok_or("a run is missing")??)).collect()
}

/// Figures of a set of runs: cycles per second in the mean, the most in a run, discs with a stick, the largest error and RMS
/// error (°), travel of the voltage (V/s).
struct Summary {
    cycles: f64,
    most: f64,
    discs: usize,
    error: f64,
    rms: f64,
    travel: f64,
}

impl Summary {
    fn of(runs: &[Metrics]) -> Summary {
        let n = runs.len() as f64;
        let mean = |of: fn(&Metrics) -> f64| runs.iter().map(of).sum::<f64>() / n;
        let most = |of: fn(&Metrics) -> f64| runs.iter().map(of).fold(0.0, f64::max);
        Summary {
            cycles: mean(|m| m.stick_slip_cycles_per_s),
            most: most(|m| m.stick_slip_cycles_per_s * m.measured_s),
            discs: runs.iter().filter(|m| m.stick_time_fraction > 0.0).count(),
            error: most(|m| m.max_error_rad).to_degrees(),
            rms: mean(|m| m.rms_error_rad * m.rms_error_rad).sqrt().to_degrees(),
            travel: mean(|m| m.control_variation_v_s),
        }
    }
}

/// A number with as many digits as people read.
fn shown(x: f64) -> String {
    if x == 0.0 {
        "0".into()
    } else if x < 0.1 {
        format!("{x:.3}")
    } else if x < 10.0 {
        format!("{x:.1}")
    } else {
        format!("{x:.0}")
    }
}

fn laws() -> Outcome<()> {
    let rates: Vec<String> = RATES.iter().map(|rate| format!("{rate} °/s")).collect();
    println!("| law, velocity from | {} | V/s at 2 °/s |", rates.join(" | "));
    println!("|---|{}---|", "---|".repeat(RATES.len()));
    for (title, law) in LAWS {
        let (mut cells, mut travel) = (Vec::new(), 0.0);
        for rate in RATES {
            let s = Summary::of(&runs(law, &[("reference.ramp.rate_deg_s", rate)], 1..41)?);
            cells.push(format!("{} ({}), {:.3}°", shown(s.cycles), s.discs, s.error));
            if rate == 2.0 {
                travel = s.travel;
            }
        }
        println!("| {title} | {} | {travel:.0} |", cells.join(" | "));
    }
    Ok(())
}

fn plants() -> Outcome<()> {
    println!("| the rig | cycles/s | discs of 40 | largest error | RMS | V/s |");
    println!("|---|---|---|---|---|---|");
    let glide = LAWS[0].1;
    for (title, keys) in PLANTS {
        print_row(title, &runs(glide, keys, 3001..3041)?);
    }
    let minute = [("run.duration_s", 61.0)];
    for (title, scalar) in
        [("a minute each", ""), ("a minute each, `f32`", "\n\n[sampling]\nscalar = \"f32\"")]
    {
        print_row(title, &runs(&format!("{glide}{scalar}"), &minute, 3001..3041)?);
    }
    Ok(())
}

/// A row of the table of rigs.
fn print_row(title: &str, of: &[Metrics]) {
    let s = Summary::of(of);
    let (cycles, discs) = (shown(s.cycles), s.discs);
    println!("| {title} | {cycles} | {discs} | {:.3}° | {:.4}° | {:.0} |", s.error, s.rms, s.travel);
}

fn rest() -> Outcome<()> {
    println!(
        "| friction believed | sticks in the first second, mean | most | discs of 200 that stick after 0.15 s | largest error |"
    );
    println!("|---|---|---|---|---|");
    let glide = format!("{}\n\n[run]\nstart = \"rest\"", LAWS[0].1);
    for (title, times) in BELIEFS {
        let keys = |settle| {
            [
                ("run.duration_s", 1.0),
                ("run.settle_s", settle),
                ("model.friction.stribeck.mu_static", 0.2 * times),
                ("model.friction.stribeck.mu_dynamic", 0.15 * times),
            ]
        };
        let all = Summary::of(&runs(&glide, &keys(0.0), 1..201)?);
        let later = Summary::of(&runs(&glide, &keys(0.15), 1..201)?);
        println!("| {title} | {:.2} | {:.0} | {} | {:.3}° |", all.cycles, all.most, later.discs, all.error);
    }
    Ok(())
}

fn main() -> Outcome<()> {
    match std::env::args().nth(1).as_deref() {
        Some("laws") => laws(),
        Some("plants") => plants(),
        Some("rest") => rest(),
        Some("steps") => steps::steps(),
        Some("motions") => steps::motions(),
        _ => Err("expected laws, plants, rest, steps or motions".into()),
    }
}
