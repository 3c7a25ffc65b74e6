//! Glide on a rig that was identified first: the table `identified` of docs/smooth.md.
//!
//! Each disc of `bench`, with inertia and friction less and a load more than believed, is identified by the product's own
//! experiment on the simulated board, in virtual time. Glide then rides it as it was believed before, and as it was told.

use clutch_identify::experiment::{PartRunner, Programme, experiment};
use clutch_identify::rig_file::rig_file;
use clutch_identify::{Estimate, Report, RigFile, identify};
use clutch_sim::progress::UNWATCHED;
use clutch_sim::run::{Keep, simulate_watched};
use clutch_sim::scenario::{Table, Value};
use clutch_sim::{Metrics, Scenario};
use rayon::prelude::*;
use std::error::Error;

type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// Discs on which no number of the law was chosen.
const DISCS: std::ops::Range<u64> = 9001..9041;
/// Inertia − 20 %, friction − 20 %, load + 10 %.
const RIG: &str = "[rig]\nbase = \"bench\"\ninertia_kg_m2 = 0.00136\n\n[rig.friction.stribeck]\nmu_static = 0.1624\n\
    mu_dynamic = 0.0832\n\n[rig.drive.weight]\nmass_kg = 0.23034\n";
/// Knowledge before: Table 1, and how far a rig may be from it.
const KNOWN: &str = "[bounds]\nfriction_percent = 60.0\ninertia_percent = 40.0\ndrive_torque_percent = 25.0\n\
    viscous_damping_percent = 99.0\n\n[safety]\nreason = \"a weight drives the shaft\"\n\n[safety.on_fault.hold]\nvolts_v = 9.99\n";

/// A ride of glide at 2 °/s from rest; the experiment takes its rig, bounds and safe state.
fn scenario(seed: u64) -> Outcome<Scenario> {
    let law = "[law.glide.filter]\ndelay_ticks = 1\n\n[reference.ramp]\nrate_deg_s = 2.0";
    let run = format!("[run]\nseed = {seed}\nduration_s = 5.0\nstart = \"rest\"");
    let text = format!("name = \"identified\"\n\n{RIG}\n{KNOWN}\n{law}\n\n{run}\n");
    Ok(Scenario::parse("identified", &text, &[])?)
}

/// The scenario with what was identified: the model by the rig file, the delay in whole periods.
fn told(scenario: &Scenario, report: &Report) -> Outcome<Scenario> {
    let file = RigFile::parse("rig.toml", &rig_file(report, scenario)?)?;
    let mut table: Table = scenario.table().clone();
    file.put_into(&mut table);
    // They are for boards and certificates, and would refuse this path: where friction is least 10 V may not hold the load.
    for bounded in ["bounds", "safety"] {
        let _ = table.remove(bounded);
    }
    let period: f64 = scenario.spec().period.seconds();
    let lag = file.lag.map_or(0.0, Estimate::if_any);
    let delay = file.delay.ok_or("no delay was told")?.less(lag);
    let ticks = (delay.value / period).round() as i64;
    let keys = ["delay_ticks", "lag_s"].map(|key| format!("law.glide.filter.{key}"));
    let set: Vec<_> = keys.into_iter().zip([Value::Integer(ticks), Value::Float(lag)]).collect();
    Ok(Scenario::from_table("identified", table, &set)?)
}

/// T/J of the rig, 1/s².
const PULL: f64 = 0.23034 * 9.81 * 0.024 / 0.00136;

/// Figures of a ride, and the error of the T/J that the law believes in, as a share.
type Ride = (Metrics, f64);

fn ridden(scenario: &Scenario) -> Outcome<Ride> {
    let spec = scenario.spec();
    let metrics = simulate_watched::<f64>(&spec, Keep::Figures, UNWATCHED)?.metrics;
    Ok((metrics, (spec.model.drive_torque / spec.model.inertia / PULL - 1.0).abs()))
}

fn print_row(title: &str, of: &[Ride]) {
    let mean = |get: fn(&Metrics) -> f64| of.iter().map(|(m, _)| get(m)).sum::<f64>() / of.len() as f64;
    let most = |get: fn(&Ride) -> f64| of.iter().map(get).fold(0.0, f64::max);
    println!(
        "| {title} | {:.2} % | {:.3} | {} | {:.3}° | {:.4}° | {:.0} |",
        100.0 * most(|ride| ride.1),
        mean(|m| m.stick_slip_cycles_per_s),
        of.iter().filter(|(m, _)| m.stick_time_fraction > 0.0).count(),
        most(|ride| ride.0.max_error_rad).to_degrees(),
        mean(|m| m.rms_error_rad * m.rms_error_rad).sqrt().to_degrees(),
        mean(|m| m.control_variation_v_s)
    );
}

fn main() -> Outcome<()> {
    let of = |seed| -> Outcome<(Ride, Ride)> {
        let before = scenario(seed)?;
        let mut runner = PartRunner::default();
        let programme = Programme::default();
        let parts = experiment(&before, &programme, &mut |name, part| runner.run(name, part))?;
        Ok((ridden(&before)?, ridden(&told(&before, &identify(&parts))?)?))
    };
    let found = DISCS.into_par_iter().map(of).collect::<Outcome<Vec<_>>>()?;
    println!("| the law is told | T/J off by, most | cycles/s | discs of 40 | largest error | RMS | V/s |");
    println!("|---|---|---|---|---|---|---|");
    print_row("nothing", &found.iter().map(|disc| disc.0).collect::<Vec<_>>());
    print_row("what `clutch identify` gives", &found.iter().map(|disc| disc.1).collect::<Vec<_>>());
    Ok(())
}
