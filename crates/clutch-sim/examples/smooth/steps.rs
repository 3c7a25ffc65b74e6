//! Glide with micro-steps: the tables `steps` and `motions` of docs/smooth.md.

use super::laws::GLIDE;
use super::motor::{self, Axis, TEXT_BOOK, TO_AND_FRO};
use super::{FRESH, FRESH_MOTORS, Outcome, STEPS_BELOW, Summary, runs, runs_of, shown};
use clutch_sim::Metrics;

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
    // A settling of two counts, and time enough for ten.
    let time =
        |rate: f64| [("run.settle_s", (0.05 / rate).max(1.0)), ("run.duration_s", (0.25 / rate).max(5.0))];
    for rate in RATES {
        let mut keys = vec![("reference.ramp.rate_deg_s", rate)];
        keys.extend(time(rate));
        let without = runs(GLIDE, &keys, FRESH)?;
        keys.push(STEPS_BELOW);
        print_row(&format!("{rate} °/s"), &runs(GLIDE, &keys, FRESH)?, Some(&without));
    }
    for (title, rig) in RIGS {
        let rate = 0.5;
        let mut keys = vec![("reference.ramp.rate_deg_s", rate)];
        keys.extend(time(rate));
        keys.extend_from_slice(rig);
        let without = runs(GLIDE, &keys, FRESH)?;
        keys.push(STEPS_BELOW);
        print_row(&format!("0.5 °/s, {title}"), &runs(GLIDE, &keys, FRESH)?, Some(&without));
    }
    let single = format!("{GLIDE}\n\n[sampling]\nscalar = \"f32\"");
    let rate = ("reference.ramp.rate_deg_s", 0.5);
    let without = runs(&single, &[rate], FRESH)?;
    print_row("0.5 °/s, `f32`", &runs(&single, &[rate, STEPS_BELOW], FRESH)?, Some(&without));
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

/// Motions that are no ramps, and the motor axis.
pub(super) fn motions() -> Outcome<()> {
    println!("| motion | largest error | RMS | steps/s | largest step | longest rest | V/s |");
    println!("|---|---|---|---|---|---|---|");
    for (title, path) in BRAKE {
        let scenario = format!("[rig]\nbase = \"bench\"\n\n{GLIDE}\n\n{path}\n");
        print_row(title, &runs_of(&scenario, &[STEPS_BELOW], FRESH)?, None);
        print_row("the same without steps", &runs_of(&scenario, &[], FRESH)?, None);
    }
    for stribeck in [0.001, 0.003, 0.01] {
        let axis = Axis { counts: 20_000.0, stribeck };
        let runs = |law, more: &[(&str, f64)]| motor::runs(&axis, law, TO_AND_FRO, more, FRESH_MOTORS);
        let title = format!("motor, 0.5 °/s to and fro, v_s {stribeck} rad/s");
        print_row(&title, &runs(GLIDE, &[STEPS_BELOW])?, None);
        print_row("the same without steps", &runs(GLIDE, &[])?, None);
        print_row("PID with feed-forward", &runs(TEXT_BOOK, &[])?, None);
    }
    Ok(())
}
