//! Glide with micro-steps: the tables `steps` and `motions` of docs/smooth.md.

use super::{LAWS, Outcome, Summary, runs, runs_of, shown};
use clutch_sim::Metrics;

/// The rate below which the shaft steps.
const BELOW: (&str, f64) = ("law.glide.micro_below_deg_s", 0.95);

/// Rates of the ramps, °/s.
const RATES: [f64; 7] = [0.9, 0.7, 0.5, 0.3, 0.1, 0.05, 0.01];

/// Departures of the rig, of which the law is not told.
const RIGS: &[(&str, &[(&str, f64)])] = &[
    (
        "friction − 20 %",
        &[("rig.friction.stribeck.mu_static", 0.1624), ("rig.friction.stribeck.mu_dynamic", 0.0832)],
    ),
    ("load + 10 %", &[("rig.drive.weight.mass_kg", 0.23034)]),
    ("inertia − 20 %", &[("rig.inertia_kg_m2", 0.00136)]),
    ("μ_s/μ_d = 2.5", &[("rig.friction.stribeck.mu_static", 0.26)]),
    ("torque noise of 1 mN m", &[("rig.torque_noise_nm", 0.001)]),
    ("lag of 0.5 ms", &[("rig.actuator_time_constant_s", 0.0005)]),
    ("lag of 1 ms", &[("rig.actuator_time_constant_s", 0.001)]),
    ("lag of 3 ms, told", &[("rig.actuator_time_constant_s", 0.003), ("law.glide.filter.lag_s", 0.003)]),
    (
        "2 000 counts",
        &[("rig.encoder.counts_per_rev", 2000.0), ("law.glide.filter.ripple_waves_per_turn", 90.0)],
    ),
    ("200 000 counts", &[("rig.encoder.counts_per_rev", 200_000.0)]),
];

/// Figures of micro-steps: a stick is a rest between two of them.
fn print_row(title: &str, of: &[Metrics], without: Option<&[Metrics]>) {
    let s = Summary::of(of);
    let largest = of.iter().map(|m| m.stair_height_rad).fold(0.0, f64::max).to_degrees();
    let longest = of.iter().map(|m| m.longest_stick_s.unwrap_or(0.0)).fold(0.0, f64::max) * 1e3;
    let without = without.map_or(String::new(), |runs| {
        let s = Summary::of(runs);
        format!(" {}, {:.3}° |", shown(s.cycles), s.error)
    });
    println!(
        "| {title} | {:.4}° | {:.4}° | {} | {largest:.4}° | {longest:.0} ms | {:.0} |{without}",
        s.error,
        s.rms,
        shown(s.cycles),
        s.travel
    );
}

/// Rates, and rigs that are not as believed.
pub(super) fn steps() -> Outcome<()> {
    println!(
        "| ramp on `bench` | largest error | RMS | steps/s | largest step | longest rest | V/s | without steps: sticks/s, largest error |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let glide = LAWS[0].1;
    // A settling of two counts, and time enough for ten.
    let time =
        |rate: f64| [("run.settle_s", (0.05 / rate).max(1.0)), ("run.duration_s", (0.25 / rate).max(5.0))];
    for rate in RATES {
        let mut keys = vec![("reference.ramp.rate_deg_s", rate)];
        keys.extend(time(rate));
        let without = runs(glide, &keys, 3001..3041)?;
        keys.push(BELOW);
        print_row(&format!("{rate} °/s"), &runs(glide, &keys, 3001..3041)?, Some(&without));
    }
    for (title, rig) in RIGS {
        let rate = 0.5;
        let mut keys = vec![("reference.ramp.rate_deg_s", rate)];
        keys.extend(time(rate));
        keys.extend_from_slice(rig);
        let without = runs(glide, &keys, 3001..3041)?;
        keys.push(BELOW);
        print_row(&format!("0.5 °/s, {title}"), &runs(glide, &keys, 3001..3041)?, Some(&without));
    }
    let single = format!("{glide}\n\n[sampling]\nscalar = \"f32\"");
    let rate = ("reference.ramp.rate_deg_s", 0.5);
    let without = runs(&single, &[rate], 3001..3041)?;
    print_row("0.5 °/s, `f32`", &runs(&single, &[rate, BELOW], 3001..3041)?, Some(&without));
    Ok(())
}

/// The brake's rig with a path that begins and ends at rest, and one that crawls twice in a period.
const BRAKE: &[(&str, &str)] = &[
    (
        "20° in 10 s with least jerk, from rest to rest",
        "[reference.minimum_jerk]\ndistance_deg = 20.0\nduration_s = 10.0\n\n[run]\nduration_s = 11.0\nsettle_s = 0.0\nstart = \"rest\"",
    ),
    (
        "2 ± 1.5 °/s at 0.25 Hz",
        "[reference.sine]\nrate_deg_s = 2.0\namplitude_deg = 0.95493\nfrequency_hz = 0.25\n\n[run]\nduration_s = 20.0",
    ),
];

/// A geared axis: 50 and 30 mN m of friction, no load.
const MOTOR: &str = r#"
[rig]
base = "bench"
actuator.motor = { gain_nm_v = 0.05, preload_nm = 0.25 }
friction.stribeck = { mu_static = 0.2, mu_dynamic = 0.12, stribeck_velocity_rad_s = 0.003 }
drive.table = { points_s_nm = [[0.0, 0.0]] }

[model]
drive_torque_nm = 0.0
actuator.motor = { gain_nm_v = 0.05, preload_nm = 0.25 }
friction.stribeck = { mu_static = 0.2, mu_dynamic = 0.12, stribeck_velocity_rad_s = 0.003 }

[output]
lowest_v = -10.0
on_invalid_v = 0.0
"#;

/// To and fro at 0.5 °/s at most, a period of 63 s, from rest.
const TO_AND_FRO: &str = "[reference.sine]\nrate_deg_s = 0.0\namplitude_deg = 5.0\nfrequency_hz = 0.0159155\n\n[run]\nduration_s = 66.0\nsettle_s = 2.0\nstart = \"rest\"";

/// PID with feed-forward of friction, gains from a text book: 17 N m/rad, 100 N m/(rad s), 0.3 N m s/rad.
const PID: &str = "[law.pid]\nkp_v_rad = 340.0\nki_v_rad_s = 2000.0\nkd_v_s_rad = 6.0\ncoulomb_v = 0.6";

/// Motions that are no ramps, and the motor axis.
pub(super) fn motions() -> Outcome<()> {
    println!("| motion | largest error | RMS | steps/s | largest step | longest rest | V/s |");
    println!("|---|---|---|---|---|---|---|");
    let glide = LAWS[0].1;
    for (title, path) in BRAKE {
        let scenario = format!("[rig]\nbase = \"bench\"\n\n{glide}\n\n{path}\n");
        print_row(title, &runs_of(&scenario, &[BELOW], 3001..3041)?, None);
        print_row("the same without steps", &runs_of(&scenario, &[], 3001..3041)?, None);
    }
    for v_s in [0.001, 0.003, 0.01] {
        let keys = [("rig.friction.stribeck.stribeck_velocity_rad_s", v_s)];
        let with = [keys[0], BELOW];
        let scenario = |law: &str| format!("{MOTOR}\n{law}\n\n{TO_AND_FRO}\n");
        let title = format!("motor, 0.5 °/s to and fro, v_s {v_s} rad/s");
        print_row(&title, &runs_of(&scenario(glide), &with, 3001..3011)?, None);
        print_row("the same without steps", &runs_of(&scenario(glide), &keys, 3001..3011)?, None);
        print_row("PID with feed-forward", &runs_of(&scenario(PID), &keys, 3001..3011)?, None);
    }
    Ok(())
}
