//! Hidden rigs, each identified, tuned, and driven by the loop in virtual time: the table of docs/tune.md, by `cargo xtask
//! tune`.
//!
//! ```sh
//! cargo run --release --package clutch-tune --example tuned_rigs -- 50 30001
//! ```

#[path = "../../clutch-identify/examples/random_rig/mod.rs"]
#[allow(dead_code, reason = "its motors are of another example")]
mod random_rig;

#[path = "course/mod.rs"]
mod course;

use clutch_identify::experiment::{PartRunner, Programme, experiment};
use clutch_identify::rig_file::rig_file;
use clutch_identify::{RigFile, identify};
use clutch_sim::Scenario;
use clutch_sim::progress::UNWATCHED;
use clutch_sim::scenario::Table;
use clutch_tune::{Options, Tuned, Verdict, tune};
use course::{Driven, Kept, degrees, drive, known, largest_ripple, median, on_hidden};
use random_rig::asked::Asked;
use random_rig::{Outcome, Set, Truth, named, truth_with};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Length of the loop's run, s, of which the first second does not count.
const LOOP_S: f64 = 10.0;
const SETTLE_S: f64 = 1.0;

/// A rig from the experiment to the loop: what the table asks of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Course {
    /// Delay of the hidden rig, periods.
    delay_ticks: u32,
    /// The proven bound on the error, rad.
    bound_rad: Option<f64>,
    /// Quantities of the true rig outside of the box that the certificate speaks of.
    outside: Vec<String>,
    /// Largest error of the loop's run, rad, and if it went to its end without a stick after the first second.
    run: Option<(f64, bool)>,
    simulated_s: f64,
    /// Time that tuning took here, s.
    tuning_s: f64,
    /// All of it in words.
    told: String,
}

fn outside(tuned: &Scenario, truth: &Truth) -> Outcome<Vec<&'static str>> {
    let plan = tuned.plan()?;
    let mut names = Vec::new();
    let Ok(setup) = tuned.sampled_setup(&plan.bounds) else { return Ok(vec!["not covered"]) };
    let mut check = |name, holds: bool| {
        if !holds {
            names.push(name);
        }
    };
    // J, T, K and mu count in their ratios alone: those of the box, scaled to the truth's torque and gain.
    let torque = setup.drive_torque[0];
    let between = |x: f64, [low, high]: [f64; 2]| (low..=high).contains(&x);
    let friction = torque / (truth.hold * setup.brake_gain[0]);
    check("T/J", between(torque / truth.pull, setup.inertia));
    check("T/(mu_d K)", between(friction, setup.sliding));
    check("mu_s/mu_d", between(truth.ratio * friction, setup.at_rest));
    check("C/J", truth.damping / truth.pull * torque <= setup.viscous_damping[1]);
    check("Stribeck velocity", truth.stribeck <= setup.stribeck[0]);
    check("delay", (truth.delay - f64::from(setup.delay_ticks) * setup.period_s).abs() < 1e-9);
    check("ripple", largest_ripple(&truth.scenario)? <= setup.ripple);
    Ok(names)
}

fn course(seed: u64, set: &Set) -> Outcome<Course> {
    let truth = truth_with(seed, set)?;
    let mut runner = PartRunner::default();
    let recordings =
        experiment(&truth.scenario, &Programme::default(), &mut |name, part| runner.run(name, part))?;
    let file = rig_file(&identify(&recordings), &truth.scenario)?;
    let file = RigFile::parse("rig.toml", &file)?;
    let start = Instant::now();
    let options = Options { uncertified: true, ..Options::default() };
    let tuned = tune(&known(&truth.scenario, Table::new())?, Some(&file), &options, UNWATCHED)?;
    let tuning_s = start.elapsed().as_secs_f64();
    let winner = tuned.winner().and_then(|w| w.scenario.clone());
    let outside = winner.as_ref().map_or(Ok(Vec::new()), |w| outside(w, &truth))?;
    let run = winner.map(|w| drive(&on_hidden(&w, &truth.scenario, [LOOP_S, SETTLE_S])?)).transpose()?;
    let smooth = |d: &Driven| d.metrics.stick_time_fraction == 0.0 && d.ended.is_none();
    Ok(Course {
        delay_ticks: truth.scenario.params().rig.delay_ticks,
        bound_rad: match tuned.winner().map(|w| &w.verdict) {
            Some(Verdict::Certified { error_rad, .. }) => Some(*error_rad),
            _ => None,
        },
        told: told(&truth, &tuned, run.as_ref(), tuning_s),
        outside: outside.into_iter().map(str::to_owned).collect(),
        run: run.map(|d| (d.largest_error, smooth(&d))),
        simulated_s: tuned.simulated_s,
        tuning_s,
    })
}

/// A rig's course in words: what was given out and what it did; where nothing certified was, what limits.
fn told(truth: &Truth, tuned: &Tuned, run: Option<&Driven>, tuning_s: f64) -> String {
    let mut text = format!(
        "{}, delay {:.1} ms, hold {:.2} V, ratio {:.2}, v_s {:.2} mrad/s, ripple {:.1} %: ",
        named(&truth.scenario),
        1e3 * truth.delay,
        truth.hold,
        truth.ratio,
        1e3 * truth.stribeck,
        100.0 * truth.ripple
    );
    text += &match tuned.winner().map(|w| (&w.name, &w.verdict)) {
        None => "nothing".to_owned(),
        Some((name, Verdict::Certified { error_rad, .. })) => {
            format!("{name}, ≤ {:.3}°", error_rad.to_degrees())
        }
        Some((name, _)) => format!("{name}, UNCERTIFIED"),
    };
    text += &match run {
        None => "; no run".to_owned(),
        Some(d) => format!(
            "; {:.2} cycles/s, error up to {:.3}°{}",
            d.metrics.stick_slip_cycles_per_s,
            d.largest_error.to_degrees(),
            d.ended.as_ref().map_or(String::new(), |cause| format!(", ended by {cause}"))
        ),
    };
    text += &format!("; {tuning_s:.1} s of tuning");
    for (shell, why) in &tuned.open_shells {
        text += &format!("\n    shell f {} S {}: {why}", shell.slope_1_s, shell.boundary_rad_s);
    }
    if tuned.winner().is_none() {
        for c in &tuned.candidates {
            text += &format!("\n    {}: {:?}", c.name, c.outcome);
        }
    }
    text
}

/// A row over some rigs.
fn row(name: &str, of: &[&Course]) -> String {
    let count = |f: &dyn Fn(&Course) -> bool| of.iter().filter(|c| f(c)).count();
    let (n, certified) = (of.len(), count(&|c| c.bound_rad.is_some()));
    format!(
        "| {name} | {n} | {} of {n} | {certified} of {n} | {} of {certified} | {} | {} | {} |",
        count(&|c| c.run.is_some_and(|(_, smooth)| smooth)),
        count(&|c| c.bound_rad.is_some() && c.outside.is_empty()),
        degrees(of.iter().filter_map(|c| c.bound_rad)),
        degrees(of.iter().filter_map(|c| Some(c.run?.0))),
        count(&|c| c.bound_rad.zip(c.run).is_some_and(|(bound, (error, _))| error > bound)),
    )
}

fn main() -> Outcome<()> {
    let asked = Asked::of_the_line([50, 30_001], &["short"])?;
    let (rigs, first) = (asked.rigs, asked.first);
    let mut kept = Kept::open(&asked.other())?;
    let mut done: Vec<Course> = Vec::new();
    // One after another: each takes all cores, and its time is its own.
    for seed in first..first + rigs {
        let set = asked.set_of(seed);
        match kept.course(seed, |seed| course(seed, &set)) {
            Ok(course) => {
                println!("rig {seed}: {}", course.told);
                done.push(course);
            }
            Err(e) => println!("rig {seed}: failed: {e}"),
        }
    }
    println!(
        "| rigs | number | no stick after 1 s | certified in a shell, or as sampled | of these with the rig in the certified box | \
         bound: median, largest | error seen: median, largest | bounds broken |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    if asked.has("short") {
        println!("{}", row(&asked.other(), &done.iter().collect::<Vec<_>>()));
        return Ok(());
    }
    for ticks in 0..=2_u32 {
        let of: Vec<&Course> = done.iter().filter(|c| c.delay_ticks == ticks).collect();
        println!("{}", row(&format!("delay of {ticks} periods"), &of));
    }
    println!("{}", row("all", &done.iter().collect::<Vec<_>>()));
    let experiment_s = Programme::default().seconds();
    let tuning: Vec<f64> = done.iter().map(|c| c.tuning_s).collect();
    println!(
        "{rigs} rigs from seed {first}, {} of them to the end: {experiment_s:.1} s of experiment and {LOOP_S:.0} s of the loop each, in \
         virtual time; tuning simulates {:.0} s of believed rigs (median), and takes {:.0} s here (median; {:.0} s at most)",
        done.len(),
        median(done.iter().map(|c| c.simulated_s).collect()),
        median(tuning.clone()),
        tuning.iter().copied().fold(0.0, f64::max),
    );
    Ok(())
}
