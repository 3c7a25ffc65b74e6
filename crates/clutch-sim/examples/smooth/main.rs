//! Smooth motion on the rig `bench`, law by law and rate by rate: the tables of docs/smooth.md, by `cargo xtask smooth`.
//!
//! ```sh
//! cargo run --release --package clutch-sim --example smooth -- laws    # or plants, rest, troubles, steps, motions, motor, bristles
//! ```

mod bristles;
mod laws;
mod loops;
mod motor;
mod steps;
mod troubles;

use clutch_sim::sweep::{Row, Sweep};
use clutch_sim::{Keep, Metrics};
use laws::GLIDE;
use std::error::Error;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use toml::{Table, Value};

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Discs on which no number of the law was chosen.
const FRESH: Range<i64> = 9001..9041;
/// The fewer of the motor axis.
const FRESH_MOTORS: Range<i64> = 9001..9011;

/// The rate below which glide goes in micro-steps, where it does, °/s.
const STEPS_BELOW: (&str, f64) = ("law.glide.micro_below_deg_s", 0.95);

/// Keys whose values are whole numbers.
const WHOLE: [&str; 4] =
    ["rig.encoder.counts_per_rev", "sampling.period_us", "rig.delay_ticks", "law.glide.filter.delay_ticks"];

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

/// The model's friction, at rest and in motion, for starts from rest. The friction of `bench` is 0.203 and 0.104.
const BELIEFS: &[(&str, [f64; 2])] = &[
    ("right", [0.203, 0.104]),
    ("1.4 times the rig's", [0.2842, 0.1456]),
    ("0.6 times the rig's", [0.1218, 0.0624]),
    ("Table 1", [0.2, 0.15]),
];

/// Runs of a law on `bench` along a ramp, one for each seed.
fn runs(law: &str, keys: &[(&str, f64)], seeds: Range<i64>) -> Outcome<Vec<Metrics>> {
    runs_of(&format!("[rig]\nbase = \"bench\"\n\n{law}\n\n[reference.ramp]\nrate_deg_s = 2.0\n"), keys, seeds)
}

/// Runs of a scenario without a name, one for each seed.
fn runs_of(scenario: &str, keys: &[(&str, f64)], seeds: Range<i64>) -> Outcome<Vec<Metrics>> {
    let mut base: Table = format!("name = \"smooth\"\n\n{scenario}").parse()?;
    let mut names: Vec<String> = vec!["run.seed".into()];
    names.extend(keys.iter().map(|(key, _)| (*key).to_owned()));
    let rows = seeds.map(|seed| {
        let mut row = vec![Value::Integer(seed)];
        row.extend(keys.iter().map(|(key, value)| {
            if WHOLE.contains(key) { Value::Integer(*value as i64) } else { Value::Float(*value) }
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
/// error (°), travel of the voltage (V/s), share of the time stuck.
struct Summary {
    cycles: f64,
    most: f64,
    discs: usize,
    error: f64,
    rms: f64,
    travel: f64,
    stuck: f64,
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
            stuck: mean(|m| m.stick_time_fraction),
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

fn plants() -> Outcome<()> {
    println!("| the rig | cycles/s | discs of 40 | largest error | RMS | V/s |");
    println!("|---|---|---|---|---|---|");
    for (title, keys) in PLANTS {
        print_row(title, &runs(GLIDE, keys, FRESH)?);
    }
    let minute = [("run.duration_s", 61.0)];
    for (title, scalar) in
        [("a minute each", ""), ("a minute each, `f32`", "\n\n[sampling]\nscalar = \"f32\"")]
    {
        print_row(title, &runs(&format!("{GLIDE}{scalar}"), &minute, FRESH)?);
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
    let glide = format!("{GLIDE}\n\n[run]\nstart = \"rest\"");
    for (title, [at_rest, sliding]) in BELIEFS {
        let keys = |settle| {
            [
                ("run.duration_s", 1.0),
                ("run.settle_s", settle),
                ("model.friction.stribeck.mu_static", *at_rest),
                ("model.friction.stribeck.mu_dynamic", *sliding),
            ]
        };
        let all = Summary::of(&runs(&glide, &keys(0.0), 1..201)?);
        let later = Summary::of(&runs(&glide, &keys(0.15), 1..201)?);
        println!("| {title} | {:.2} | {:.0} | {} | {:.3}° |", all.cycles, all.most, later.discs, all.error);
    }
    Ok(())
}

fn main() -> Outcome<()> {
    let mut args = std::env::args().skip(1);
    match args.next().as_deref() {
        Some("laws") => laws::laws(args.next().as_deref()),
        Some("plants") => plants(),
        Some("rest") => rest(),
        Some("troubles") => troubles::troubles(),
        Some("loops") => loops::loops(),
        Some("steps") => steps::steps(),
        Some("motions") => steps::motions(),
        Some("motor") => motor::motor(),
        Some("bristles") => bristles::bristles(),
        _ => Err("expected laws, plants, rest, troubles, loops, steps, motions, motor or bristles".into()),
    }
}
