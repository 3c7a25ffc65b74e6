//! Certified bounds against the worst error seen: `cargo xtask certified`.
//!
//! ```sh
//! cargo run --release --package clutch-sim --example certified -- table
//! cargo run --release --package clutch-sim --example certified -- campaign 10000
//! ```
//!
//! `table` looks for the certificate of each set of gains of a fixed grid, checks it, and simulates plants of its box; `integral`
//! does so for PI, `shell` for shells, with laws within that do their worst, `delays` for PD with two and three ticks of delay,
//! `rates` for paths up to 100 °/s, `motor` for motor axes. `campaign` draws sets and shells, too, with tolerances, ripple and noise, and counts broken bounds; `campaign-integral`
//! draws PI alone, `campaign-motor` motor axes. Each of the seeds that are given begins a share of the runs; shares can also be
//! asked for one by one, and run beside each other.

mod adversary;

use adversary::{Adversary, Way};
use clutch_certificate::{Options, Setup, checker, largest, search};
use clutch_core::friction::{FrictionParams, StribeckParams};
use clutch_core::{BrakeActuator, MotorActuator, PlantParams, Real, Servo};
use clutch_sim::drive::DriveParams;
use clutch_sim::progress::UNWATCHED;
use clutch_sim::run::Start;
use clutch_sim::{Keep, RigParams, Scenario, simulate_servo};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::error::Error;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Gains with their filter.
#[derive(Clone, Copy)]
enum Gains {
    Pd(f64, f64, f64),
    Pid(f64, f64, f64, f64),
    Smc(f64, f64, f64, f64, f64),
    Shell(f64, f64, f64),
    /// The same on a motor axis: with feed-forward of its friction, V, and an integral.
    MotorPid([f64; 3], f64, f64),
    MotorShell(f64, f64, f64),
}

/// PD: K_p, K_d, K_Kal. PID: K_p, K_i, K_d, K_Kal. SMC: K_p, K_d, f, ε, K_Kal. Shell: f, S, K_Kal.
const GRID: &[Gains] = &[
    Gains::Pd(5000.0, 50.0, 0.2),
    Gains::Pd(5000.0, 50.0, 0.5),
    Gains::Pd(5000.0, 50.0, 1.0),
    Gains::Pd(10000.0, 50.0, 1.0),
    Gains::Pd(2500.0, 25.0, 0.5),
    Gains::Pd(2500.0, 12.9, 0.7),
    Gains::Pd(1250.0, 12.9, 0.5),
    Gains::Pd(625.0, 12.9, 0.7),
    Gains::Pd(1000.0, 6.0, 0.7),
    Gains::Pd(1660.0, 25.0, 0.7),
    Gains::Pd(1660.0, 12.9, 0.712),
    Gains::Pd(2367.0, 14.5, 0.67),
    Gains::Pd(1250.0, 12.9, 0.7),
    Gains::Pd(1000.0, 12.9, 0.5),
    Gains::Pd(2500.0, 25.0, 1.0),
    Gains::Smc(5.0, 50.0, 70.0, 0.2, 0.5),
    Gains::Smc(4.0, 100.0, 50.0, 0.2, 0.3),
    Gains::Smc(5.0, 400.0, 70.0, 0.1, 0.5),
];

impl Gains {
    fn title(self) -> String {
        match self {
            Gains::Pd(kp, kd, kappa) => format!("PD {kp}/{kd}/{kappa}"),
            Gains::Pid(kp, ki, kd, kappa) => format!("{kp}/{ki}/{kd}/{kappa}"),
            Gains::Smc(kp, kd, f, eps, kappa) => format!("SMC {kp}/{kd}/{f}/{eps}/{kappa}"),
            Gains::Shell(f, s, kappa) => format!("{f}/{s}/{kappa}"),
            Gains::MotorPid([kp, ki, kd], kappa, ahead) => format!("PID {kp}/{ki}/{kd}/{kappa}, {ahead} V"),
            Gains::MotorShell(f, s, kappa) => format!("shell {f}/{s}/{kappa}"),
        }
    }

    fn keys(self) -> (&'static str, Vec<(String, String)>) {
        let key = |key: &str, x: f64| (key.to_owned(), format!("{x:?}"));
        let smoothing = |x| key("velocity.smoothed_derivative.smoothing", x);
        match self {
            Gains::Pd(kp, kd, kappa) => {
                ("pd_2", vec![key("law.pd.kp_v_rad", kp), key("law.pd.kd_v_s_rad", kd), smoothing(kappa)])
            }
            Gains::Pid(kp, ki, kd, kappa) => (
                "bench_pid_2",
                vec![
                    ("rig.base".to_owned(), "paper".to_owned()),
                    key("law.pid.kp_v_rad", kp),
                    key("law.pid.ki_v_rad_s", ki),
                    key("law.pid.kd_v_s_rad", kd),
                    smoothing(kappa),
                ],
            ),
            Gains::Smc(kp, kd, f, eps, kappa) => (
                "smc_2",
                vec![
                    key("law.smc.kp_v", kp),
                    key("law.smc.kd_v_s_rad", kd),
                    key("law.smc.slope_1_s", f),
                    key("law.smc.boundary_rad_s", eps),
                    smoothing(kappa),
                ],
            ),
            // The law within is the adversary.
            Gains::Shell(f, s, kappa) => {
                ("pd_2", vec![key("shell.slope_1_s", f), key("shell.boundary_rad_s", s), smoothing(kappa)])
            }
            Gains::MotorPid([kp, ki, kd], kappa, ahead) => {
                let law = [
                    key("law.pid.kp_v_rad", kp),
                    key("law.pid.ki_v_rad_s", ki),
                    key("law.pid.kd_v_s_rad", kd),
                    key("law.pid.coulomb_v", ahead),
                    smoothing(kappa),
                ];
                ("motor_pid", forwards().into_iter().chain(law).collect())
            }
            Gains::MotorShell(f, s, kappa) => {
                let shell = [key("shell.slope_1_s", f), key("shell.boundary_rad_s", s), smoothing(kappa)];
                ("motor_pid", forwards().into_iter().chain(shell).collect())
            }
        }
    }
}

/// A ramp, and an output that cannot turn the axis round.
fn forwards() -> Vec<(String, String)> {
    [
        ("reference", "{ ramp = { rate_deg_s = 2.0 } }"),
        ("output.lowest_v", "-0.3"),
        ("output.highest_v", "4.0"),
        ("model.friction.stribeck.stribeck_velocity_rad_s", "0.003"),
        ("rig.friction.stribeck.stribeck_velocity_rad_s", "0.003"),
    ]
    .map(|(key, text)| (key.to_owned(), text.to_owned()))
    .to_vec()
}

/// A scenario of a set.
fn scenario(gains: Gains, more: &[(&str, f64)]) -> Outcome<Scenario> {
    let (name, mut keys) = gains.keys();
    for (key, x) in more {
        let text = if key.ends_with("_ticks") { format!("{x}") } else { format!("{x:?}") };
        keys.push(((*key).to_owned(), text));
    }
    let built_in = clutch_sim::scenario::BUILT_IN.iter().find(|b| b.name == name);
    Ok(Scenario::parse(name, built_in.map_or("", |b| b.toml), &keys)?)
}

/// A plant's place in the box.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    /// Every parameter at an end of its side.
    Corner,
    /// Every parameter anywhere on its side.
    Within,
    /// Each parameter for itself: at an end one time in two.
    Mixed,
}

/// A number of a side of the box.
fn number_of(place: Place, rng: &mut Pcg64, [low, high]: [f64; 2]) -> f64 {
    let which = match place {
        Place::Corner => u32::from(!rng.random::<bool>()),
        Place::Within => 2,
        Place::Mixed => rng.random_range(0..4),
    };
    match which {
        0 => low,
        1 => high,
        _ => low + (high - low) * rng.random::<f64>(),
    }
}

/// A rig of the box.
fn plant(base: &RigParams, model: &PlantParams, setup: &Setup, place: Place, rng: &mut Pcg64) -> RigParams {
    let within = |rng: &mut Pcg64, side: [f64; 2]| number_of(place, rng, side);
    let mut rig = base.clone();
    rig.inertia = within(rng, setup.inertia);
    rig.viscous_damping = within(rng, setup.viscous_damping);
    match &mut rig.drive {
        DriveParams::Weight(weight) => weight.mass *= within(rng, setup.drive_torque) / model.drive_torque,
        DriveParams::Table(load) => load.points.0 = vec![(0.0, within(rng, setup.drive_torque))],
        _ => {}
    }
    let (mut mu_s, mut mu_d) = (model_friction(model).mu_static, model_friction(model).mu_dynamic);
    let scale = setup.sliding.map(|x| x / mu_d);
    let gain = setup.brake_gain;
    if rng.random::<bool>() {
        // The whole curve by one factor.
        let factor = within(rng, scale);
        (mu_s, mu_d) = (mu_s * factor, mu_d * factor);
    } else {
        mu_d *= within(rng, scale);
        mu_s = within(rng, setup.at_rest).max(mu_d);
    }
    rig.friction = FrictionParams::Stribeck(StribeckParams {
        mu_static: mu_s,
        mu_dynamic: mu_d,
        ..model_friction(model)
    });
    rig.actuator = match &setup.motor {
        Some(motor) => {
            let gain = within(rng, motor.gain);
            MotorActuator { gain, preload: motor.preload, load_share: 0.0 }.into()
        }
        None => BrakeActuator { gain: within(rng, gain), ..Default::default() }.into(),
    };
    rig
}

fn model_friction(model: &PlantParams) -> StribeckParams {
    match model.friction {
        FrictionParams::Stribeck(f) => f,
        _ => StribeckParams::default(),
    }
}

/// A run of a plant of the box.
struct Trial {
    /// Length, s.
    seconds: f64,
    /// Seed of the plant, of its disc and noise, and of a bad law.
    seed: u64,
    /// The plant's place in the box.
    place: Place,
    /// `true` if law and path are computed in single precision.
    single: bool,
}

/// The largest |e| of a trial, rad, and its sticks per second.
fn run(scenario: &Scenario, setup: &Setup, trial: &Trial) -> Outcome<(f64, f64)> {
    if trial.single { run_in::<f32>(scenario, setup, trial) } else { run_in::<f64>(scenario, setup, trial) }
}

fn run_in<T: Real>(scenario: &Scenario, setup: &Setup, trial: &Trial) -> Outcome<(f64, f64)> {
    let &Trial { seconds, seed, place, .. } = trial;
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut spec = scenario.spec();
    spec.rig = plant(&spec.rig, &spec.model, setup, place, &mut rng);
    spec.run.seed = seed;
    spec.run.duration = seconds;
    spec.run.settle = 0.0;
    let run = if spec.shell.boundary > 0.0 {
        let way = Way::ALL[(seed % 7) as usize];
        let [lowest, highest] = [spec.output.lowest, spec.output.highest];
        let law =
            Adversary { way, seed, lowest, highest, slope: spec.shell.slope, motor: setup.motor.is_some() };
        let servo = Servo::<T, _>::with_law(&spec.servo()?.cast(), law).map_err(|e| e.cast::<f64>())?;
        simulate_servo(&spec, &servo, Keep::Figures, UNWATCHED)?
    } else {
        clutch_sim::run::simulate_watched::<T>(&spec, Keep::Figures, UNWATCHED)?
    };
    Ok((run.metrics.max_error_rad, run.metrics.stick_slip_cycles_per_s))
}

/// Processor time of this thread, s; 0 where the system does not report it.
fn cpu_seconds() -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    told.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(0.0) * 1e-9
}

/// Certified and seen of a set; degrees.
struct Row {
    radius: f64,
    certified: Option<f64>,
    open: String,
    seen: f64,
    sticks: f64,
    cells: usize,
    seconds_per_cell: f64,
}

fn measure(scenario: &Scenario, runs: u64) -> Outcome<Row> {
    measure_with(scenario, runs, &Options::default())
}

fn measure_with(scenario: &Scenario, runs: u64, options: &Options) -> Outcome<Row> {
    let sampled = scenario.sampled(&scenario.plan()?.bounds);
    let radius = sampled.stability.as_ref().map_or(f64::NAN, largest);
    let refused = sampled.stable() == Some(false) && !sampled.any_law();
    let setup = sampled.setup?;
    let began = cpu_seconds();
    if refused {
        let open = "refused: unstable".to_owned();
        return Ok(Row {
            radius,
            certified: None,
            open,
            seen: worst(scenario, &setup, runs)?.0,
            sticks: 0.0,
            cells: 0,
            seconds_per_cell: 0.0,
        });
    }
    let found = search(&setup, options, false);
    let cells = found.certificate.cells.len() + found.open.len();
    let seconds_per_cell = (cpu_seconds() - began) / cells.max(1) as f64;
    let certified = if found.complete() {
        Some(checker::check(&found.certificate)?.error_bound.to_degrees())
    } else {
        None
    };
    let open = found.open.first().map_or(String::new(), |c| {
        let how = if c.grew { "grew" } else { "did not settle" };
        format!("μ_d {:.4} … {:.4} {how}", c.sliding[0], c.sliding[1])
    });
    let (seen, sticks) = worst(scenario, &setup, runs)?;
    Ok(Row { radius, certified, open, seen, sticks, cells, seconds_per_cell })
}

/// The largest error of runs, degrees, and the most sticks per second.
fn worst(scenario: &Scenario, setup: &Setup, runs: u64) -> Outcome<(f64, f64)> {
    let (mut seen, mut sticks) = (0.0_f64, 0.0_f64);
    for seed in 0..runs {
        let trial = Trial { seconds: 3.0, seed, place: Place::Mixed, single: false };
        let (error, cycles) = run(scenario, setup, &trial)?;
        seen = seen.max(error.to_degrees());
        sticks = sticks.max(cycles);
    }
    Ok((seen, sticks))
}

/// The grid's table, or the rows of sets whose title holds a text.
fn table(of: &str) -> Outcome<()> {
    println!(
        "| set | delay | °/s | ρ | certified, ° | seen, ° | ratio | most sticks/s | cells | CPU s per cell |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut ratios = Vec::new();
    let mut tried = 0;
    for (k, gains) in GRID.iter().enumerate() {
        for delay in [0, 1] {
            // Each set at one of two rates, in turn.
            let rate = if (k + delay) % 2 == 0 { 2.0 } else { 20.0 };
            if gains.title().contains(of) {
                let delay = delay as f64;
                let keys = [
                    ("rig.delay_ticks", delay),
                    ("reference.ramp.rate_deg_s", rate),
                    ("bounds.friction_percent", 40.0),
                ];
                // Unstable gains are refused for that.
                let row = measure(&scenario(*gains, &keys)?, 200)?;
                let certified = row.certified.map_or_else(|| row.open.clone(), |c| format!("{c:.4}"));
                let ratio = row.certified.map(|c| c / row.seen);
                println!(
                    "| {} | {delay} | {rate} | {:.3} | {certified} | {:.4} | {} | {:.1} | {} | {:.2} |",
                    gains.title(),
                    row.radius,
                    row.seen,
                    ratio.map_or("–".to_owned(), |r| format!("{r:.2}")),
                    row.sticks,
                    row.cells,
                    row.seconds_per_cell
                );
                if row.radius < 1.0 {
                    tried += 1;
                    ratios.extend(ratio);
                }
            }
        }
    }
    ratios.sort_by(f64::total_cmp);
    println!(
        "| of {tried} with ρ < 1 | | | | {} certified | | median {:.2}, largest {:.2} | | | |",
        ratios.len(),
        ratios.get(ratios.len() / 2).unwrap_or(&f64::NAN),
        ratios.last().unwrap_or(&f64::NAN)
    );
    Ok(())
}

/// Laws that a campaign draws.
#[derive(Clone, Copy, PartialEq)]
enum Drawn {
    /// PD, SMC (31) and shells.
    Any,
    /// PID.
    Integral,
    /// PD and PID with feed-forward, and shells, on motor axes.
    Motor,
}

/// Gains, loop, box and start at random.
fn draw(drawn: Drawn, rng: &mut Pcg64) -> Outcome<Scenario> {
    let delayed = rng.random::<bool>();
    let delay = f64::from(u8::from(delayed));
    let mut between = |low: f64, high: f64| low * libm::pow(high / low, rng.random::<f64>());
    let kind = between(1.0, 4.0);
    let gains = if drawn == Drawn::Motor {
        if kind < 2.0 {
            let f = if delayed { between(20.0, 60.0) } else { between(30.0, 100.0) };
            Gains::MotorShell(f, between(0.1, 0.3), between(0.2, 0.7))
        } else {
            let kp = between(300.0, 2000.0);
            // Three of four without an integral, which takes long.
            let ki = if kind < 3.5 { 0.0 } else { kp * between(2.0, 15.0) };
            let ahead = 0.6 * between(0.5, 1.3);
            Gains::MotorPid([kp, ki, kp * between(0.006, 0.016)], between(0.2, 1.0), ahead)
        }
    } else if drawn == Drawn::Integral {
        let kp = between(800.0, 4000.0);
        Gains::Pid(kp, kp * between(2.0, 15.0), kp * between(0.005, 0.012), between(0.3, 1.0))
    } else if kind < 1.4 {
        // With delay a shell closes where it is thick for its slope.
        let f = if delayed { between(20.0, 60.0) } else { between(30.0, 150.0) };
        Gains::Shell(f, between(0.06, 0.2), between(0.5, 1.0))
    } else if kind < 3.4 {
        let kp = between(800.0, 8000.0);
        Gains::Pd(kp, kp * between(0.005, 0.015), between(0.2, 1.0))
    } else {
        Gains::Smc(
            between(4.0, 7.0),
            between(20.0, 400.0),
            between(40.0, 80.0),
            between(0.1, 0.25),
            between(0.2, 0.7),
        )
    };
    let mut percent = |most: f64| if rng.random::<bool>() { most * rng.random::<f64>() } else { 0.0 };
    let (friction, inertia, torque, gain) = (percent(15.0), percent(5.0), percent(5.0), percent(5.0));
    let (noise, ripple) = (percent(0.001), percent(0.05));
    let damping = percent(50.0);
    let rate = 2.0 * libm::pow(15.0, rng.random::<f64>());
    let mut keys = vec![
        ("rig.delay_ticks", delay),
        ("reference.ramp.rate_deg_s", rate),
        ("rig.torque_noise_nm", noise),
        ("bounds.friction_percent", friction),
        ("bounds.inertia_percent", inertia),
        ("bounds.drive_torque_percent", torque),
        ("bounds.viscous_damping_percent", damping),
    ];
    if drawn == Drawn::Motor {
        let load = 0.004 * (2.0 * rng.random::<f64>() - 1.0);
        keys.extend([
            ("model.drive_torque_nm", load),
            ("bounds.motor_gain_percent", gain),
            (
                "model.friction.stribeck.stribeck_velocity_rad_s",
                0.0005 * libm::pow(20.0, rng.random::<f64>()),
            ),
        ]);
    } else {
        keys.push(("bounds.brake_gain_percent", gain));
    }
    let scenario = scenario(gains, &keys)?;
    let mut table = scenario.table().clone();
    let start = if rng.random::<bool>() { Start::Rest } else { Start::OnPath };
    let run = table.entry("run").or_insert_with(|| toml::Value::Table(toml::Table::new()));
    if let toml::Value::Table(run) = run {
        run.insert("start".into(), start.name().into());
    }
    if ripple == 0.0 {
        return Ok(Scenario::from_table("campaign", table, &[])?);
    }
    // A band of five waves, of which the largest departure is √10 times the root mean square.
    let waves = format!(
        "rms = {:?}\nlowest_waves_per_turn = 120\nhighest_waves_per_turn = 600\nspacing_waves_per_turn = 120\n",
        ripple / libm::sqrt(10.0)
    );
    if let Some(toml::Value::Table(rig)) = table.get_mut("rig") {
        rig.insert("ripple".into(), toml::Value::Table(waves.parse()?));
    }
    Ok(Scenario::from_table("campaign", table, &[])?)
}

/// Shells on the paper's rig, with every adversary.
const SHELLS: [(Gains, f64, f64, f64); 9] = [
    (Gains::Shell(100.0, 0.1, 1.0), 0.0, 2.0, 0.0),
    (Gains::Shell(100.0, 0.1, 1.0), 0.0, 2.0, 40.0),
    (Gains::Shell(100.0, 0.1, 1.0), 0.0, 20.0, 0.0),
    (Gains::Shell(100.0, 0.1, 1.0), 1.0, 2.0, 0.0),
    (Gains::Shell(100.0, 0.1, 0.5), 0.0, 2.0, 0.0),
    (Gains::Shell(100.0, 0.05, 1.0), 0.0, 2.0, 0.0),
    (Gains::Shell(50.0, 0.1, 1.0), 0.0, 2.0, 0.0),
    (Gains::Shell(50.0, 0.1, 1.0), 1.0, 2.0, 0.0),
    (Gains::Shell(50.0, 0.1, 1.0), 1.0, 2.0, 40.0),
];

/// PID on the paper's rig: delay in ticks, rate in °/s, tolerance of friction in %.
const INTEGRALS: [(Gains, f64, f64, f64); 8] = [
    (Gains::Pid(1250.0, 10_000.0, 12.9, 0.4), 0.0, 2.0, 0.0),
    (Gains::Pid(1250.0, 10_000.0, 12.9, 0.4), 0.0, 20.0, 0.0),
    (Gains::Pid(1250.0, 10_000.0, 12.9, 0.4), 0.0, 2.0, 40.0),
    (Gains::Pid(1250.0, 10_000.0, 12.9, 0.4), 1.0, 2.0, 0.0),
    (Gains::Pid(2370.0, 25_000.0, 14.5, 0.67), 0.0, 2.0, 0.0),
    (Gains::Pid(2370.0, 25_000.0, 14.5, 0.67), 0.0, 20.0, 0.0),
    (Gains::Pid(2370.0, 25_000.0, 14.5, 0.67), 0.0, 2.0, 40.0),
    (Gains::Pid(2370.0, 25_000.0, 14.5, 0.67), 1.0, 2.0, 0.0),
];

/// PD with two and three ticks of delay on the paper's rig. Delay in ticks, rate in °/s, tolerance of friction in %.
const DELAYS: [(Gains, f64, f64, f64); 14] = [
    (Gains::Pd(1660.0, 12.9, 0.712), 2.0, 2.0, 0.0),
    (Gains::Pd(1660.0, 12.9, 0.712), 2.0, 20.0, 0.0),
    (Gains::Pd(1660.0, 25.0, 0.7), 2.0, 2.0, 0.0),
    (Gains::Pd(1250.0, 12.9, 0.7), 2.0, 2.0, 0.0),
    (Gains::Pd(1250.0, 12.9, 0.5), 2.0, 2.0, 0.0),
    (Gains::Pd(1000.0, 20.0, 1.0), 2.0, 2.0, 0.0),
    (Gains::Pd(1000.0, 20.0, 0.7), 2.0, 2.0, 0.0),
    (Gains::Pd(1000.0, 20.0, 0.7), 2.0, 20.0, 0.0),
    (Gains::Pd(1000.0, 12.9, 0.5), 2.0, 2.0, 0.0),
    (Gains::Pd(1000.0, 12.9, 0.5), 2.0, 20.0, 0.0),
    (Gains::Pd(625.0, 12.9, 0.7), 2.0, 2.0, 0.0),
    (Gains::Pd(625.0, 12.9, 0.7), 2.0, 20.0, 0.0),
    (Gains::Pd(1000.0, 20.0, 0.7), 3.0, 2.0, 0.0),
    (Gains::Pd(625.0, 12.9, 0.7), 3.0, 2.0, 0.0),
];

/// Fast paths on the paper's rig: delay in ticks, rate in °/s, tolerance of friction in %.
const RATES: [(Gains, f64, f64, f64); 8] = [
    (Gains::Pd(1660.0, 12.9, 0.712), 0.0, 50.0, 40.0),
    (Gains::Pd(1660.0, 12.9, 0.712), 1.0, 50.0, 40.0),
    (Gains::Pd(1660.0, 12.9, 0.712), 0.0, 100.0, 40.0),
    (Gains::Pd(1660.0, 12.9, 0.712), 1.0, 100.0, 40.0),
    (Gains::Pid(2370.0, 25_000.0, 14.5, 0.67), 0.0, 50.0, 0.0),
    (Gains::Pid(2370.0, 25_000.0, 14.5, 0.67), 0.0, 100.0, 0.0),
    (Gains::Shell(100.0, 0.1, 1.0), 0.0, 50.0, 0.0),
    (Gains::Shell(50.0, 0.1, 1.0), 0.0, 50.0, 0.0),
];

/// Motor axes: delay in ticks, rate in °/s, tolerance of friction in %.
const MOTORS: [(Gains, f64, f64, f64); 10] = [
    (Gains::MotorPid([500.0, 0.0, 8.0], 0.5, 0.0), 0.0, 2.0, 0.0),
    (Gains::MotorPid([500.0, 0.0, 8.0], 0.5, 0.6), 0.0, 2.0, 0.0),
    (Gains::MotorPid([500.0, 0.0, 8.0], 0.5, 0.6), 0.0, 2.0, 30.0),
    (Gains::MotorPid([500.0, 0.0, 8.0], 0.5, 0.6), 1.0, 20.0, 30.0),
    (Gains::MotorPid([1500.0, 0.0, 16.0], 0.7, 0.6), 1.0, 2.0, 30.0),
    (Gains::MotorPid([500.0, 5000.0, 8.0], 0.5, 0.6), 0.0, 2.0, 0.0),
    (Gains::MotorShell(50.0, 0.2, 0.2), 0.0, 2.0, 0.0),
    (Gains::MotorShell(50.0, 0.2, 0.2), 0.0, 2.0, 30.0),
    (Gains::MotorShell(50.0, 0.2, 0.2), 1.0, 2.0, 30.0),
    (Gains::MotorShell(50.0, 0.2, 0.2), 0.0, 20.0, 0.0),
];

/// The column of a table with laws of several kinds.
const ANY_LAW: &str = "law";

/// Sets, each with its delay, rate and tolerance.
fn sets(sets: &[(Gains, f64, f64, f64)], columns: &str) -> Outcome<()> {
    println!(
        "| {columns} | delay | °/s | friction | certified, ° | seen, ° | ratio | cells | CPU s per cell |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for &(gains, delay, rate, friction) in sets {
        let keys = [
            ("rig.delay_ticks", delay),
            ("reference.ramp.rate_deg_s", rate),
            ("bounds.friction_percent", friction),
        ];
        let row = measure(&scenario(gains, &keys)?, 210)?;
        let title = match gains {
            Gains::Pid(..) if columns == ANY_LAW => format!("PID {}", gains.title()),
            Gains::Shell(..) if columns == ANY_LAW => format!("shell {}", gains.title()),
            _ => gains.title(),
        };
        println!(
            "| {title} | {delay} | {rate} | ±{friction} % | {} | {:.4} | {} | {} | {:.2} |",
            row.certified.map_or_else(|| row.open.clone(), |c| format!("{c:.4}")),
            row.seen,
            row.certified.map_or("–".to_owned(), |c| format!("{:.2}", c / row.seen)),
            row.cells,
            row.seconds_per_cell
        );
    }
    Ok(())
}

/// Those of two and three ticks, and what becomes of an open one with eight times the work.
fn delays() -> Outcome<()> {
    println!("| law | delay | °/s | ρ | certified, ° | with eight times the work | seen, ° | ratio |");
    println!("|---|---|---|---|---|---|---|---|");
    for (gains, delay, rate, friction) in DELAYS {
        let keys = [
            ("rig.delay_ticks", delay),
            ("reference.ramp.rate_deg_s", rate),
            ("bounds.friction_percent", friction),
        ];
        let scenario = scenario(gains, &keys)?;
        let row = measure(&scenario, 210)?;
        let said = |row: &Row| row.certified.map_or_else(|| row.open.clone(), |c| format!("{c:.4}"));
        let (mut best, mut more) = (row.certified, "–".to_owned());
        if best.is_none() {
            let work = 8 * Options::default().work;
            let again = measure_with(&scenario, 0, &Options { work, ..Options::default() })?;
            (best, more) = (again.certified, said(&again));
        }
        println!(
            "| {} | {delay} | {rate} | {:.3} | {} | {more} | {:.4} | {} |",
            gains.title(),
            row.radius,
            said(&row),
            row.seen,
            best.map_or("–".to_owned(), |c| format!("{:.2}", c / row.seen))
        );
    }
    Ok(())
}

/// Counts of a campaign, or of a share of it.
#[derive(Default)]
struct Tally {
    sets: u64,
    unstable: u64,
    certified: u64,
    shells: u64,
    runs: u64,
    from_rest: u64,
    single: u64,
    corners: u64,
    stuck: u64,
    broken: u64,
    nearest: f64,
    nearest_from_rest: f64,
}

impl Tally {
    /// Of both.
    fn with(&self, share: &Tally) -> Tally {
        Tally {
            sets: self.sets + share.sets,
            unstable: self.unstable + share.unstable,
            certified: self.certified + share.certified,
            shells: self.shells + share.shells,
            runs: self.runs + share.runs,
            from_rest: self.from_rest + share.from_rest,
            single: self.single + share.single,
            corners: self.corners + share.corners,
            stuck: self.stuck + share.stuck,
            broken: self.broken + share.broken,
            nearest: self.nearest.max(share.nearest),
            nearest_from_rest: self.nearest_from_rest.max(share.nearest_from_rest),
        }
    }
}

impl std::fmt::Display for Tally {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Tally { sets, unstable, certified, shells, runs, from_rest, single, corners, .. } = self;
        let Tally { stuck, broken, nearest, nearest_from_rest, .. } = self;
        let open = sets - unstable - certified;
        write!(f, "| {sets} | {unstable} | {open} | {certified} | {shells} | {runs} | {from_rest} ")?;
        write!(f, "| {corners} | {single} | {stuck} | {broken} ")?;
        write!(f, "| {:.1} %, {:.1} % |", 100.0 * nearest, 100.0 * nearest_from_rest)
    }
}

const TALLY: &str = "\
| sets drawn | refused as unstable | not closed | certified | of these shells | runs | from rest | at a corner | in f32 | with sticks | broken bounds | nearest to its bound: in motion, from rest |
|---|---|---|---|---|---|---|---|---|---|---|---|";

/// Random sets; those that are certified, and linearly stable or a shell, are run with random plants of their boxes. The
/// line on the error output after each set is a result by itself; a campaign goes on from it at the seed that it names. Half of
/// the runs are from rest: a set of a start of which a share has enough runs is passed over.
fn campaign(drawn: Drawn, wanted: u64, first_seeds: &[u64]) -> Outcome<()> {
    let wanted = wanted.div_ceil(first_seeds.len() as u64);
    let mut tally = Tally::default();
    for first in first_seeds {
        let (mut share, mut seed) = (Tally::default(), *first);
        while share.runs < wanted {
            seed += 1;
            a_set(drawn, seed, wanted, &mut share)?;
            eprintln!("{share} next seed {seed}");
        }
        tally = tally.with(&share);
    }
    println!("{TALLY}\n{tally}");
    if tally.broken > 0 { Err("bounds are broken".into()) } else { Ok(()) }
}

/// Runs of a certified set.
const RUNS_OF_A_SET: u64 = 200;

/// Draws a set; if it is certified, runs it with random plants of its box.
fn a_set(drawn: Drawn, seed: u64, wanted: u64, tally: &mut Tally) -> Outcome<()> {
    let work = if drawn == Drawn::Integral { Options::default().work } else { 300_000_000 };
    let options = Options { refinements: 0, work, ..Options::default() };
    let scenario = draw(drawn, &mut Pcg64::seed_from_u64(seed))?;
    let rest = scenario.spec().run.start == Start::Rest;
    let of_this_start = if rest { tally.from_rest } else { tally.runs - tally.from_rest };
    if 2 * of_this_start >= wanted {
        return Ok(());
    }
    tally.sets += 1;
    let sampled = scenario.sampled(&scenario.plan()?.bounds);
    if !sampled.bound_suffices() {
        tally.unstable += 1;
        return Ok(());
    }
    let shell = sampled.any_law();
    let setup = sampled.setup?;
    let found = search(&setup, &options, false);
    if !found.complete() {
        return Ok(());
    }
    let bound = checker::check(&found.certificate)?.error_bound;
    tally.certified += 1;
    tally.shells += u64::from(shell);
    for k in 0..RUNS_OF_A_SET {
        // Each place in both scalars, with every bad law: of those there are seven.
        let place = if k % 2 == 0 { Place::Corner } else { Place::Within };
        let trial = Trial { seconds: 2.0, seed: 1000 * seed + k, place, single: k / 2 % 2 == 1 };
        let (error, sticks) = run(&scenario, &setup, &trial)?;
        tally.runs += 1;
        tally.from_rest += u64::from(rest);
        tally.corners += u64::from(place == Place::Corner);
        tally.single += u64::from(trial.single);
        let nearest = if rest { &mut tally.nearest_from_rest } else { &mut tally.nearest };
        *nearest = nearest.max(error / bound);
        tally.stuck += u64::from(sticks > 0.0);
        if error > bound {
            tally.broken += 1;
            let (error, bound) = (error.to_degrees(), bound.to_degrees());
            println!("broken: set {seed}, run {k}: {error:.4}° of {bound:.4}°");
        }
    }
    Ok(())
}

fn main() -> Outcome<()> {
    let mut words = std::env::args().skip(1);
    let verb = words.next();
    match verb.as_deref() {
        Some("table") => table(&words.next().unwrap_or_default()),
        Some("integral") => sets(&INTEGRALS, "K_p, K_i, K_d, K_Kal"),
        Some("shell") => sets(&SHELLS, "f, S, K_Kal"),
        Some("delays") => delays(),
        Some("rates") => sets(&RATES, ANY_LAW),
        Some("motor") => sets(&MOTORS, ANY_LAW),
        Some(name @ ("campaign" | "campaign-integral" | "campaign-motor")) => {
            let drawn = match name {
                "campaign" => Drawn::Any,
                "campaign-integral" => Drawn::Integral,
                _ => Drawn::Motor,
            };
            let numbers = words.map(|word| word.parse()).collect::<Result<Vec<u64>, _>>()?;
            match numbers.as_slice() {
                [] => campaign(drawn, 10_000, &[0]),
                [runs] => campaign(drawn, *runs, &[0]),
                [runs, first_seeds @ ..] => campaign(drawn, *runs, first_seeds),
            }
        }
        _ => {
            let verbs = "table [SET], integral, shell, delays, rates, motor, or campaign, campaign-integral or \
                 campaign-motor [RUNS [FIRST_SEED …]]";
            Err(format!("expected {verbs}").into())
        }
    }
}
