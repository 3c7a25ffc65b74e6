//! Hidden motor axes, each identified, tuned, and driven by the loop in virtual time: the second table of docs/tune.md, by `cargo
//! xtask tune`.
//!
//! ```sh
//! cargo run --release --package clutch-tune --example tuned_motors -- 20 30001
//! ```

#[path = "course/mod.rs"]
#[allow(dead_code, reason = "what only the other example asks")]
mod course;
#[path = "../../clutch-identify/examples/random_rig/mod.rs"]
#[allow(dead_code, reason = "its brakes are of another example")]
mod random_rig;

use clutch_identify::RigFile;
use clutch_identify::experiment::PartRunner;
use clutch_identify::motor::experiment::{Programme, experiment};
use clutch_identify::motor::identify;
use clutch_identify::motor::rig_file::rig_file;
use clutch_sim::Scenario;
use clutch_sim::progress::UNWATCHED;
use clutch_sim::scenario::{Table, Value};
use clutch_tune::{Options, Tuned, Verdict, tune};
use course::{Kept, degrees, drive, known, largest_ripple, median, on_hidden};
use random_rig::asked::Asked;
use random_rig::motor::{Truth, truth_with};
use random_rig::{Outcome, Set};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// The task that an axis is tuned for: name, path, and time of the loop's run with its settling time, s.
const PATHS: [(&str, &str, [f64; 2]); 3] = [
    ("a ramp at 2 °/s", "[reference.ramp]\nrate_deg_s = 2.0", [10.0, 1.0]),
    ("a ramp at 4 °/s", "[reference.ramp]\nrate_deg_s = 4.0", [10.0, 1.0]),
    (
        "to and fro by 2°, at 0.5 °/s at most",
        "[reference.sine]\nrate_deg_s = 0.0\namplitude_deg = 1.0\nfrequency_hz = 0.0795775",
        [26.0, 1.0],
    ),
];

/// An axis from the experiment to the loop, for one path.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Course {
    /// The law that was given out.
    law: Option<String>,
    /// The proven bound on the error, rad.
    bound: Option<f64>,
    /// Quantities of the true axis outside of the box that the certificate speaks of.
    outside: Vec<String>,
    /// The loop with it.
    tuned: Option<Run>,
    /// The loop with the gains from a text book that the axis came with.
    untuned: Run,
    tuning_s: f64,
    /// Where nothing was given out, the outcome of each law.
    outcome: Vec<String>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Run {
    /// Largest error from the start on, rad.
    largest: f64,
    /// Largest and root mean square error behind the settling time, rad.
    error: f64,
    rms: f64,
    cycles_per_s: f64,
    volts_per_s: f64,
    ended: Option<String>,
}

/// The same scenario along another path, as long as the loop's run.
fn along(scenario: &Scenario, path: &str, [seconds, settle]: [f64; 2]) -> Outcome<Scenario> {
    let mut table = scenario.table().clone();
    table.remove("reference");
    table.extend(path.parse::<Table>()?);
    let set = [
        ("run.duration_s".to_owned(), Value::Float(seconds)),
        ("run.settle_s".to_owned(), Value::Float(settle)),
    ];
    Ok(Scenario::from_table(scenario.name(), table, &set)?)
}

fn in_the_loop(scenario: &Scenario) -> Outcome<Run> {
    let driven = drive(scenario)?;
    let m = driven.metrics;
    Ok(Run {
        largest: driven.largest_error,
        error: m.max_error_rad,
        rms: m.rms_error_rad,
        cycles_per_s: m.stick_slip_cycles_per_s,
        volts_per_s: m.control_variation_v_s,
        ended: driven.ended,
    })
}

/// Quantities of the axis outside of the box of a tuned scenario; all torques are over the torque per volt.
fn outside(tuned: &Scenario, truth: &Truth) -> Outcome<Vec<String>> {
    let Ok(setup) = tuned.sampled_setup(&tuned.plan()?.bounds) else {
        return Ok(vec!["not covered".to_owned()]);
    };
    let Some(motor) = setup.motor else { return Ok(vec!["no motor".to_owned()]) };
    let gain = motor.gain[0];
    let friction = |volts: f64| volts * gain / motor.preload;
    let between = |x: f64, [low, high]: [f64; 2]| (low..=high).contains(&x);
    // A load that is taken for none counts as friction, which then has to hold both ways.
    let [load, counted] =
        if setup.drive_torque[1] == 0.0 { [0.0, truth.load.abs()] } else { [truth.load, 0.0] };
    let both =
        |x: f64, ends: [f64; 2]| between(friction(x - counted), ends) && between(friction(x + counted), ends);
    let held = [
        ("J/K", between(truth.inertia * gain, setup.inertia)),
        ("T/K", between(load * gain, setup.drive_torque)),
        ("T_c/K", both(truth.sliding, setup.sliding)),
        ("T_s/K", both(truth.at_rest, setup.at_rest)),
        ("C/K", truth.viscous * gain <= setup.viscous_damping[1]),
        ("Stribeck velocity", truth.stribeck <= setup.stribeck[0]),
        ("delay", (truth.delay - f64::from(setup.delay_ticks) * setup.period_s).abs() < 1e-9),
        ("ripple", largest_ripple(&truth.scenario)? <= setup.ripple),
    ];
    Ok(held.into_iter().filter(|(_, holds)| !holds).map(|(name, _)| name.to_owned()).collect())
}

fn course(seed: u64, set: &Set) -> Outcome<Vec<Course>> {
    let truth = truth_with(seed, set)?;
    let mut runner = PartRunner::default();
    let run = &mut |name: &str, part: &Scenario| runner.run(name, part);
    let report = identify(&experiment(&truth.scenario, &Programme::default(), run)?);
    let file = RigFile::parse("rig.toml", &rig_file(&report, &truth.scenario)?)?;
    let rig = truth.scenario.table().get("model").and_then(Value::as_table).and_then(|m| m.get("actuator"));
    let rig = Table::from_iter(rig.map(|actuator| ("actuator".to_owned(), actuator.clone())));
    let known = known(&truth.scenario, rig)?;
    PATHS
        .iter()
        .map(|(_, path, times)| {
            let scenario = along(&known, path, *times)?;
            let start = Instant::now();
            let options = Options { uncertified: true, ..Options::default() };
            let found: Tuned = tune(&scenario, Some(&file), &options, UNWATCHED)?;
            let tuning_s = start.elapsed().as_secs_f64();
            let winner = found.winner();
            let tuned = winner.and_then(|w| w.scenario.as_ref());
            let tuned = tuned.map(|w| in_the_loop(&on_hidden(w, &truth.scenario, *times)?)).transpose()?;
            let bound = match winner.map(|w| &w.verdict) {
                Some(Verdict::Certified { error_rad, .. }) => Some(*error_rad),
                _ => None,
            };
            let winning = winner.and_then(|w| w.scenario.as_ref()).filter(|_| bound.is_some());
            let outside = winning.map_or(Ok(Vec::new()), |w| outside(w, &truth))?;
            let untuned = in_the_loop(&along(&truth.scenario, path, *times)?)?;
            let law = winner.map(|w| w.name.clone());
            let of = found.candidates.iter().filter(|_| winner.is_none());
            let outcome = of.map(|c| format!("{}: {:?}", c.name, c.outcome)).collect();
            Ok(Course { law, bound, outside, tuned, untuned, tuning_s, outcome })
        })
        .collect()
}

/// Rows of a path: the tuned laws, and the text-book gains.
fn rows(name: &str, of: &[&Course]) -> String {
    let row = |law: &str, runs: &[&Run]| {
        let good: Vec<&&Run> = runs.iter().filter(|r| r.ended.is_none()).collect();
        let stick = good.iter().filter(|r| r.cycles_per_s > 0.0).count();
        format!(
            "| {name} | {law} | {} of {} | {stick} | {:.2} | {} | {} | {:.0} |\n",
            good.len(),
            of.len(),
            median(good.iter().map(|r| r.cycles_per_s).collect()),
            degrees(good.iter().map(|r| r.error)),
            degrees(good.iter().map(|r| r.rms)),
            median(good.iter().map(|r| r.volts_per_s).collect()),
        )
    };
    let mut names: Vec<&str> = of.iter().filter_map(|c| c.law.as_deref()).collect();
    names.sort_unstable();
    let mut counted: Vec<(usize, &str)> =
        names.chunk_by(|a, b| a == b).map(|chunk| (chunk.len(), chunk[0])).collect();
    counted.sort_unstable_by(|a, b| b.cmp(a));
    let laws: Vec<String> = counted.iter().map(|(n, law)| format!("{law} ({n})")).collect();
    let tuned: Vec<&Run> = of.iter().filter_map(|c| c.tuned.as_ref()).collect();
    let untuned: Vec<&Run> = of.iter().map(|c| &c.untuned).collect();
    row(&format!("tuned: {}", laws.join(", ")), &tuned) + &row("PID, text-book gains", &untuned)
}

/// The certificates of a ramp in a sentence.
fn certified(name: &str, done: &[Vec<Course>], path: usize) -> String {
    let of: Vec<&Course> = done.iter().map(|course| &course[path]).collect();
    let count = |f: &dyn Fn(&Course) -> bool| of.iter().filter(|c| f(c)).count();
    format!(
        "Of {name} {} of {} are certified, in a shell or as sampled, for errors up to {} (median, largest); {} of these axes lie in \
         the certified box, and {} bounds were broken.",
        count(&|c| c.bound.is_some()),
        of.len(),
        degrees(of.iter().filter_map(|c| c.bound)),
        count(&|c| c.bound.is_some() && c.outside.is_empty()),
        count(&|c| c.bound.zip(c.tuned.as_ref()).is_some_and(|(bound, run)| run.largest > bound)),
    )
}

fn main() -> Outcome<()> {
    let asked = Asked::of_the_line([20, 30_001], &[])?;
    let (axes, first) = (asked.rigs, asked.first);
    let mut kept = Kept::open(&asked.other())?;
    let mut done: Vec<Vec<Course>> = Vec::new();
    for seed in first..first + axes {
        let set = asked.set_of(seed);
        match kept.course(seed, |seed| course(seed, &set)) {
            Ok(course) => {
                for (c, (name, ..)) in course.iter().zip(PATHS) {
                    println!("axis {seed}, {name}: {c:?}");
                }
                done.push(course);
            }
            Err(e) => println!("axis {seed}: failed: {e}"),
        }
    }
    println!(
        "| path | law | to the end | axes that stick | cycles/s, median | error: median, largest | RMS: median, largest | V/s, median |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (n, (name, ..)) in PATHS.iter().enumerate() {
        print!("{}", rows(name, &done.iter().map(|course| &course[n]).collect::<Vec<_>>()));
    }
    let ramps: Vec<String> = (0..2).map(|n| certified(PATHS[n].0, &done, n)).collect();
    let tuning: Vec<f64> = done.iter().flatten().map(|c| c.tuning_s).collect();
    println!(
        "{axes} rigs from seed {first}, {} of them to the end: {:.1} s of experiment in virtual time; tuning takes {:.0} s here \
         (median; {:.0} s at most). {}",
        done.len(),
        Programme::default().seconds(),
        median(tuning.clone()),
        tuning.iter().copied().fold(0.0, f64::max),
        ramps.join(" "),
    );
    Ok(())
}
