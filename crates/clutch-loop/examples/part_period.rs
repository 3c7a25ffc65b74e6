//! Certified bounds where a code comes into force part of a period after its sample, which no proof covers: the table of
//! docs/certified.md.
//!
//! ```sh
//! cargo run --release --package clutch-loop --example part_period -- 40 600000
//! ```
//!
//! Sets of PD from rest that are certified without delay and with one period of it are driven by the loop in virtual time,
//! on plants of their box, over a line of any latency up to a period. The table holds errors against both bounds.

use clutch_certificate::{Options, checker, search};
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_loop::station::ControllerStation;
use clutch_loop::virtual_time::{VirtualLoop, VirtualOptions, VirtualReport};
use clutch_node::ControllerNode;
use clutch_sim::Scenario;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::error::Error;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Runs of a set, and their length, s.
const RUNS: u64 = 200;
const SECONDS: f64 = 2.0;
/// Rows of the table: equal shares of a period.
const SHARES: usize = 4;

/// Gains, path and box of a set; the plant is the paper's.
struct Set {
    keys: Vec<(String, String)>,
    /// Friction, inertia, drive torque and brake gain: departures from the paper's, %.
    percent: [f64; 4],
}

fn key(key: &str, x: f64) -> (String, String) {
    (key.to_owned(), format!("{x:?}"))
}

impl Set {
    fn draw(rng: &mut Pcg64) -> Set {
        let mut between = |low: f64, high: f64| low * (high / low).powf(rng.random());
        let kp = between(800.0, 8000.0);
        let mut keys = vec![
            key("law.pd.kp_v_rad", kp),
            key("law.pd.kd_v_s_rad", kp * between(0.005, 0.015)),
            key("velocity.smoothed_derivative.smoothing", between(0.2, 1.0)),
            key("reference.ramp.rate_deg_s", between(2.0, 30.0)),
            key("run.duration_s", SECONDS),
            key("run.settle_s", 0.0),
        ];
        keys.push(("run.start".to_owned(), "rest".to_owned()));
        keys.push(("safety.reason".to_owned(), "\"a weight drives the shaft\"".to_owned()));
        keys.push(key("safety.on_fault.hold.volts_v", 9.99));
        keys.push(key("safety.limits.following_error_deg", 20.0));
        keys.push(key("safety.limits.saturation_time_s", SECONDS));
        let percent = [15.0, 5.0, 5.0, 5.0].map(|most: f64| most * rng.random::<f64>());
        let names = ["friction", "inertia", "drive_torque", "brake_gain"];
        keys.extend(names.iter().zip(percent).map(|(name, x)| key(&format!("bounds.{name}_percent"), x)));
        Set { keys, percent }
    }

    fn scenario(&self, more: Vec<(String, String)>) -> Outcome<Scenario> {
        let built_in = clutch_sim::scenario::BUILT_IN.iter().find(|b| b.name == "pd_2").ok_or("no pd_2")?;
        Ok(Scenario::parse("pd_2", built_in.toml, &[self.keys.clone(), more].concat())?)
    }

    /// The bound with a delay of so many periods, rad; none where the loop is unstable or the search did not close.
    fn bound(&self, ticks: u32) -> Outcome<Option<f64>> {
        let scenario = self.scenario(vec![("rig.delay_ticks".to_owned(), ticks.to_string())])?;
        let sampled = scenario.sampled(&scenario.plan()?.bounds);
        if !sampled.bound_suffices() {
            return Ok(None);
        }
        let options = Options { refinements: 0, work: 300_000_000, ..Options::default() };
        let found = search(&sampled.setup?, &options, false);
        Ok(if found.complete() { Some(checker::check(&found.certificate)?.error_bound) } else { None })
    }

    /// A run on a plant of the box, half of them at a corner, over a line that takes `latency_ns` to and fro.
    fn run(&self, seed: u64, latency_ns: u64, rng: &mut Pcg64) -> Outcome<VirtualReport> {
        let corner = seed.is_multiple_of(2);
        let mut off = |percent: f64| {
            let at = if corner { f64::from(rng.random::<bool>()) } else { rng.random::<f64>() };
            1.0 + percent / 100.0 * (2.0 * at - 1.0)
        };
        let [friction, inertia, torque, gain] = self.percent.map(&mut off);
        let scenario = self.scenario(vec![
            key("rig.friction.stribeck.mu_static", 0.2 * friction),
            key("rig.friction.stribeck.mu_dynamic", 0.15 * friction),
            key("rig.inertia_kg_m2", 0.0017 * inertia),
            key("rig.drive.weight.mass_kg", 0.2 * torque),
            key("rig.actuator.brake.gain_nm_v", 0.14 * gain),
            ("run.seed".to_owned(), seed.to_string()),
        ])?;
        let built = BuiltRun::<f64>::new(&scenario, 7)?;
        let path = from_scenario::path::<f64>(&scenario)?;
        let node = ControllerNode::new(built.controller, built.servo, built.supervisor);
        let options = VirtualOptions {
            latency_ns: latency_ns / 2,
            seed,
            duration: SECONDS,
            ..VirtualOptions::default()
        };
        let mut world = VirtualLoop::new(&scenario, options, ControllerStation::new(node, &path))?;
        Ok(world.run(&path)?)
    }
}

/// Runs whose delay is within a share of a period.
#[derive(Clone, Copy, Default)]
struct Row {
    runs: u64,
    stuck: u64,
    ended: u64,
    above_none: u64,
    above_both: u64,
    nearest: f64,
}

fn main() -> Outcome<()> {
    let mut words = std::env::args().skip(1);
    let mut number = |default: u64| words.next().map_or(Ok(default), |word| word.parse::<u64>());
    let (wanted, first) = (number(40)?, number(600_000)?);
    let (mut drawn, mut certified) = (0, 0);
    let mut rows = [Row::default(); SHARES];
    while certified < wanted {
        let seed = first + drawn;
        drawn += 1;
        let set = Set::draw(&mut Pcg64::seed_from_u64(seed));
        let Some(bounds) = set.bound(0)?.zip(set.bound(1)?) else { continue };
        certified += 1;
        for k in 0..RUNS {
            let mut rng = Pcg64::seed_from_u64(1000 * seed + k);
            let part = rng.random::<f64>();
            let report = set.run(1000 * seed + k, (part * 1e6) as u64, &mut rng)?;
            let error = report.errors.iter().fold(0.0_f64, |most, e| most.max(e.abs()));
            let row = &mut rows[(part * SHARES as f64) as usize];
            row.runs += 1;
            row.stuck += u64::from(report.metrics.stick_slip_cycles_per_s > 0.0);
            row.ended += u64::from(report.cause.is_some());
            row.above_none += u64::from(error > bounds.0);
            row.above_both += u64::from(error > bounds.0.max(bounds.1));
            row.nearest = row.nearest.max(error / bounds.0.max(bounds.1));
        }
        eprintln!("{certified} of {wanted} sets, seed {seed}: {bounds:?}");
    }
    println!(
        "| delay, periods | runs | with sticks | ended by the supervisor | above the bound without delay | above the larger of both bounds \
         | nearest to the larger |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (k, row) in rows.iter().enumerate() {
        let [from, to] = [k, k + 1].map(|k| k as f64 / SHARES as f64);
        println!(
            "| {from} to {to} | {} | {} | {} | {} | {} | {:.1} % |",
            row.runs,
            row.stuck,
            row.ended,
            row.above_none,
            row.above_both,
            100.0 * row.nearest
        );
    }
    println!("\n{drawn} sets drawn from seed {first}, {certified} of them certified both ways");
    Ok(())
}
