//! The watch over friction and load against shafts whose friction and load are known: the tables of docs/loop.md, by
//! `cargo xtask drift`.
//!
//! ```sh
//! cargo run --release --package clutch-loop --example drift -- drifts       # or: healthy
//! ```

use clutch_core::friction::FrictionModel;
use clutch_core::{Bounds, Interval, Plant, Real};
use clutch_loop::drift::{Alarm, Drift, DriftReport};
use clutch_loop::faults::{Fault, FaultKind};
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_loop::healthy::HealthyShaft;
use clutch_loop::station::ControllerStation;
use clutch_loop::virtual_time::{VirtualLoop, VirtualOptions};
use clutch_node::ControllerNode;
use clutch_sim::detected::Detector;
use clutch_sim::rig::Rig;
use clutch_sim::scenario::{BUILT_IN, ScalarKind};
use clutch_sim::{Keep, Scenario};
use std::error::Error;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// Laws, by their names for readers, and their part of a scenario.
const LAWS: [(&str, &str); 5] = [
    ("PD", "[law.pd]"),
    ("CTC", "[law.ctc]"),
    ("SMC", "[law.smc]"),
    (
        "PI with feed-forward",
        "[law.pid]\nkp_v_rad = 2370.0\nki_v_rad_s = 25000.0\nkd_v_s_rad = 14.5\nbias_v = 2.24\n\n[velocity.smoothed_derivative]\nsmoothing = 0.67",
    ),
    ("glide", "[law.glide.filter]\ndelay_ticks = 1"),
];
/// The model is the rig, but for its ripple.
const BENCH: &str = "[rig]\nbase = \"bench\"\n[model]\ndrive_torque_nm = 0.04930114\n[model.friction.stribeck]\nmu_static = 0.203\n\
     mu_dynamic = 0.104\nstribeck_velocity_rad_s = 0.00144\nstribeck_exponent = 1.0\n";
/// Drive of `bench`, N m.
const DRIVE: f64 = 0.2094 * 9.81 * 0.024;
const SAFETY: &str = "[safety]\nreason = \"a weight drives the shaft\"\n[safety.on_fault.hold]\nvolts_v = 9.99\n\
     [safety.limits]\nfollowing_error_deg = 20.0\nsaturation_time_s = 5.0\n";
/// The drift begins, s; and the run ends.
const BEGINS: f64 = 10.0;
const LENGTH: f64 = 70.0;
/// Seeds of the discs.
const DISCS: std::ops::Range<u64> = 4001..4005;

/// A change of the rig: friction and load as shares of what they were, by so much more each second from then on.
#[derive(Clone, Copy)]
struct Change {
    name: &'static str,
    friction: f64,
    load: f64,
    rise: f64,
}

const CHANGES: [Change; 8] = [
    change("friction + 20 %", 1.2, 1.0, 0.0),
    change("friction − 20 %", 0.8, 1.0, 0.0),
    change("load + 15 %", 1.0, 1.15, 0.0),
    change("load − 15 %", 1.0, 0.85, 0.0),
    change("friction + 1 %/s", 1.0, 1.0, 0.01),
    change("friction − 1 %/s", 1.0, 1.0, -0.01),
    change("friction + 5 %/s", 1.0, 1.0, 0.05),
    change("friction − 5 %/s", 1.0, 1.0, -0.05),
];

const fn change(name: &'static str, friction: f64, load: f64, rise: f64) -> Change {
    Change { name, friction, load, rise }
}

impl Change {
    /// Friction over load at a time after the beginning.
    fn ratio(&self, time: f64) -> f64 {
        (self.friction + self.rise * time.min(RAMP)) / self.load
    }

    /// The faults that make the friction: with a brake without preload, the converter's voltage is the friction.
    fn faults(&self) -> Vec<Fault> {
        let step = 0.1;
        let mut faults = Vec::new();
        for i in 0..(RAMP / step) as u32 {
            let at = f64::from(i) * step;
            let kind = FaultKind::DacScale(self.friction + self.rise * at);
            faults.push(Fault { lasting: step, ..Fault::new(kind, BEGINS + at) });
        }
        let end = FaultKind::DacScale(self.friction + self.rise * RAMP);
        faults.push(Fault::new(end, BEGINS + RAMP));
        faults
    }
}

/// Time for which a friction goes on to change, s.
const RAMP: f64 = 30.0;

fn main() -> Outcome<()> {
    match std::env::args().nth(1).as_deref() {
        Some("drifts") => drifts(),
        Some("healthy") => healthy(std::env::args().nth(2).map_or(Ok(150), |n| n.parse())?),
        _ => Err("expected drifts, or healthy and a number of drawn runs".into()),
    }
}

/// A run in virtual time under the watch of `drift`: the alarms, and what was seen.
fn watch(run: &Scenario, faults: &[Fault], drift: Drift) -> Outcome<(Vec<Alarm>, DriftReport)> {
    match run.scalar() {
        ScalarKind::F32 => watch_in::<f32>(run, faults, drift),
        ScalarKind::F64 => watch_in::<f64>(run, faults, drift),
    }
}

fn watch_in<T: Real>(
    run: &Scenario,
    faults: &[Fault],
    mut drift: Drift,
) -> Outcome<(Vec<Alarm>, DriftReport)> {
    let built = BuiltRun::<T>::new(run, 7)?;
    let path = from_scenario::path::<T>(run)?;
    let duration = run.spec().run.duration;
    let faults = faults.to_vec();
    let options =
        VirtualOptions { latency_ns: 50_000, duration, faults, record: true, ..VirtualOptions::default() };
    let node = ControllerNode::new(built.controller, built.servo, built.supervisor);
    let mut world = VirtualLoop::new(run, options, ControllerStation::new(node, &path))?;
    let report = world.run(&path)?;
    let mut detector = Detector::new(&run.spec(), Keep::Trace)?;
    let (samples, commands) = report.samples_and_commands();
    let alarms = drift.watch_log(&mut detector, samples.iter().zip(&commands));
    Ok((alarms, *drift.report()))
}

/// Everything on all cores, in order.
fn on_all_cores<A: Sync, B: Send>(all: &[A], each: impl Fn(&A) -> Outcome<B> + Sync) -> Outcome<Vec<B>> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some(one) = all.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let place = std::ptr::from_ref(one) as usize - all.as_ptr() as usize;
                    let result = each(one);
                    done.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((place, result));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    done.sort_by_key(|(place, _)| *place);
    done.into_iter().map(|(_, result)| result).collect()
}

/// Changes in flight, within bounds of ±5 % on friction and on load: from 0.905 to 1.105 of friction over load.
fn drifts() -> Outcome<()> {
    let (low, high) = (0.95 / 1.05, 1.05 / 0.95);
    let mut runs = Vec::new();
    for rate in [2.0, 10.0] {
        for law in LAWS {
            for change in CHANGES {
                runs.extend(DISCS.map(|seed| (rate, law, change, seed)));
            }
        }
    }
    let told = on_all_cores(&runs, |(rate, (_, law), change, seed)| {
        let drive = if change.load == 1.0 {
            String::new()
        } else {
            let (t, load) = (BEGINS, DRIVE * change.load);
            format!("[rig.drive.table]\npoints_s_nm = [[{t:?}, {DRIVE:?}], [{:?}, {load:?}]]\n", t + 0.001)
        };
        let text = format!(
            "name = \"drift\"\n{BENCH}{drive}{law}\n[reference.ramp]\nrate_deg_s = {rate:?}\n[bounds]\nfriction_percent = 5.0\n\
             drive_torque_percent = 5.0\n[run]\nduration_s = {LENGTH:?}\nseed = {seed}\n{SAFETY}"
        );
        let scenario = Scenario::parse("drift", &text, &[])?;
        let drift = Drift::new(&scenario, &scenario.plan()?.bounds)?;
        let faults = if change.load == 1.0 { change.faults() } else { Vec::new() };
        let (alarms, report) = watch(&scenario, &faults, drift)?;
        // The time at which the bounds are left.
        let inside = |time: f64| (low..=high).contains(&change.ratio(time));
        let left = (0..3000).map(|i| f64::from(i) * 0.01).find(|t| !inside(*t));
        let at = |alarm: &Alarm| alarm.tick as f64 * report.period - BEGINS;
        let early = alarms.iter().filter(|a| left.is_none_or(|left| at(a) < left)).count();
        let delay = left.and_then(|left| alarms.iter().map(at).find(|t| *t >= left).map(|t| t - left));
        Ok((delay, early))
    })?;
    let mut all_early = 0;
    println!("| law, °/s | {} |", CHANGES.map(|c| c.name).join(" | "));
    println!("|---|{}", "---|".repeat(CHANGES.len()));
    let mut told = told.chunks(DISCS.count());
    for rate in [2.0, 10.0] {
        for (law, _) in LAWS {
            let mut row = format!("| {law}, {rate} |");
            for _ in CHANGES {
                let cell = told.next().unwrap_or(&[]);
                all_early += cell.iter().map(|(_, early)| early).sum::<usize>();
                let mut delays: Vec<f64> = cell.iter().filter_map(|(delay, _)| *delay).collect();
                delays.sort_by(f64::total_cmp);
                row += &match delays.last() {
                    None => format!(" 0 of {} |", cell.len()),
                    Some(last) => {
                        let median = delays[delays.len() / 2];
                        format!(" {} of {}; {median:.1} s, {last:.1} s |", delays.len(), cell.len())
                    }
                };
            }
            println!("{row}");
        }
    }
    eprintln!("alarms before the bounds were left: {all_early} in {} runs", runs.len());
    if all_early == 0 { Ok(()) } else { Err("false alarms".into()) }
}

/// A group of runs in which nothing drifts.
struct Group {
    name: String,
    runs: Vec<Scenario>,
}

/// Watches of shafts that stay as they are, against bounds that are the shaft itself: an interval that misses the truth by
/// the least is an alarm.
fn healthy(drawn: u64) -> Outcome<()> {
    let mut groups = vec![Group {
        name: "drawn from ±40 % of friction, half to twice the load, every law of the list that follows a path, on all kinds of paths".to_owned(),
        runs: (1..=drawn).map(|seed| HealthyShaft { seed, seconds: 60 }.scenario()).collect::<Result<_, _>>()?,
    }];
    for (name, law) in LAWS {
        let mut runs = Vec::new();
        for rate in [1.0, 2.0, 5.0, 10.0, 20.0] {
            for seed in 5001..5007 {
                let start = if seed % 2 == 0 { "rest" } else { "on_path" };
                let text = format!(
                    "name = \"healthy\"\n{BENCH}{law}\n[reference.ramp]\nrate_deg_s = {rate:?}\n[run]\nduration_s = 120.0\n\
                     start = \"{start}\"\nseed = {seed}\n{SAFETY}"
                );
                runs.push(Scenario::parse("healthy", &text, &[])?);
            }
        }
        groups.push(Group { name: format!("`bench`, {name}, 1 to 20 °/s"), runs });
    }
    let laws_on = |set: &[(&str, &str)], name: &str| -> Outcome<Group> {
        let mut runs = Vec::new();
        for (_, law) in LAWS {
            for rate in ["2.0", "10.0"] {
                let text = format!(
                    "name = \"healthy\"\n{BENCH}{law}\n[reference.ramp]\nrate_deg_s = 1.0\n[run]\nduration_s = 120.0\nseed = 6001\n{SAFETY}"
                );
                let rate = ("reference.ramp.rate_deg_s", rate);
                let set = [rate].into_iter().chain(set.iter().copied());
                let set: Vec<_> = set.map(|(k, v)| (k.to_owned(), v.to_owned())).collect();
                runs.push(Scenario::parse("healthy", &text, &set)?);
            }
        }
        Ok(Group { name: format!("`bench`, {name}"), runs })
    };
    groups.push(laws_on(&[("rig.torque_noise_nm", "0.001")], "torque noise of 1 mN m")?);
    groups.push(laws_on(&[("rig.actuator_time_constant_s", "0.003")], "lag of 3 ms")?);
    groups.push(laws_on(&[("rig.delay_ticks", "3")], "delay of 3 periods")?);
    groups.push(laws_on(&[("rig.inertia_kg_m2", "0.00204")], "inertia + 20 %")?);
    groups.push(laws_on(&[("rig.encoder.counts_per_rev", "200000")], "200 000 counts")?);
    groups.push(laws_on(&[("sampling.scalar", "f32")], "single precision")?);
    let mut motors = Group { name: "motor axes, to and fro, four laws".to_owned(), runs: Vec::new() };
    for built_in in BUILT_IN.iter().filter(|b| b.name.starts_with("motor_")) {
        for frequency in ["0.02", "0.05", "0.1", "0.2"] {
            let set = [("run.duration_s", "300.0"), ("reference.sine.frequency_hz", frequency)];
            let set = set.map(|(k, v)| (k.to_owned(), v.to_owned()));
            motors.runs.push(Scenario::parse("healthy", built_in.toml, &set)?);
        }
    }
    groups.push(motors);

    println!(
        "| shafts | runs | hours | windows | without an upper end | runs without a window | false alarms |"
    );
    println!("|---|---|---|---|---|---|---|");
    let mut sum = [0.0; 6];
    for group in &groups {
        let seen = on_all_cores(&group.runs, |scenario| {
            let exact = |key: &str| (format!("bounds.{key}_percent"), "0.0".to_owned());
            let keys = ["friction", "drive_torque", "inertia", "brake_gain", "viscous_damping", "motor_gain"];
            let point = Scenario::parse("exact", &scenario.canonical(), &keys.map(exact))?;
            let (alarms, report) = watch(scenario, &[], Drift::new(&point, &truth(&point)?)?)?;
            for alarm in &alarms {
                eprintln!("{}: {}\n{}", group.name, report.alarm_words(alarm), scenario.canonical());
            }
            Ok((scenario.spec().run.duration / 3600.0, report, alarms.len()))
        })?;
        let row: [f64; 6] = [
            seen.len() as f64,
            seen.iter().map(|s| s.0).sum(),
            seen.iter().map(|s| s.1.windows as f64).sum(),
            seen.iter().map(|s| s.1.one_sided as f64).sum(),
            seen.iter().filter(|s| s.1.windows == 0).count() as f64,
            seen.iter().map(|s| s.2 as f64).sum(),
        ];
        sum.iter_mut().zip(row).for_each(|(sum, x)| *sum += x);
        print_row(&group.name, &row);
    }
    print_row("all", &sum);
    if sum[5] == 0.0 { Ok(()) } else { Err("false alarms".into()) }
}

fn print_row(name: &str, [runs, hours, windows, one_sided, untold, alarms]: &[f64; 6]) {
    let share = 100.0 * one_sided / windows.max(1.0);
    println!("| {name} | {runs} | {hours:.2} | {windows} | {share:.0} % | {untold} runs | {alarms} |");
}

/// Bounds that hold the rig and nothing else.
fn truth(scenario: &Scenario) -> Outcome<Bounds<f64>> {
    let spec = scenario.spec();
    let rig = Rig::new(&spec.rig, spec.run.seed)?;
    let (plant, model) = (&rig.model.plant, Plant::new(&spec.model)?);
    let point = |x: f64| Interval { low: x, high: x };
    // The mean that the model has is given; what the rig has more of it, its gain has.
    let more = plant.friction().sliding() / model.friction().sliding();
    let (drive, _) = rig.drive.range();
    Ok(Bounds {
        inertia: point(plant.params().inertia),
        drive_torque: point(drive),
        viscous_damping: point(plant.params().viscous_damping),
        brake_gain: point(plant.actuator().brake_gain() * more),
        motor_gain: point(plant.actuator().motor_gain()),
        ..scenario.plan()?.bounds
    })
}
