//! The meter of stick-slip against the simulator's events: the tables of docs/meter.md, by `cargo xtask meter`.
//!
//! ```sh
//! cargo run --release --package clutch-sim --example meter -- laws 20000    # or rates, sources, edges, rigs
//! ```

use clutch_core::edge_timed::{EdgeTimed, EdgeTimedParams, waves_seen};
use clutch_core::{Counts, Encoder, FixedCounts, Plant};
use clutch_sim::detected::Verdict;
use clutch_sim::engine::EventKind;
use clutch_sim::meter::Meter;
use clutch_sim::sweep::{Row, Sweep};
use clutch_sim::{Keep, Run, Scenario};
use std::error::Error;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use toml::{Table, Value};

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Rates of the paths, °/s.
const RATES: [f64; 10] = [0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0, 6.0, 10.0, 20.0];
/// Encoders, counts per turn.
const ENCODERS: [i64; 3] = [2_000, 20_000, 200_000];
/// Discs on which the meter was made, and discs that no number of it was chosen on.
const MADE_ON: std::ops::Range<i64> = 1..11;
const HELD_OUT: std::ops::Range<i64> = 3001..3011;
/// Length of a run and its settling time, s.
const LENGTH: (f64, f64) = (9.0, 1.0);

/// PI with feed-forward, and the source of its velocity.
macro_rules! pi {
    ($velocity:literal) => {
        concat!(
            "[law.pid]\nkp_v_rad = 2370.0\nki_v_rad_s = 25000.0\nkd_v_s_rad = 14.5\nbias_v = 2.24\n\n",
            $velocity
        )
    };
}

/// Laws that follow a path, by their names for readers, and their part of a scenario.
const LAWS: &[(&str, &str)] = &[
    ("PD", "[law.pd]"),
    ("CTC", "[law.ctc]"),
    ("SMC", "[law.smc]"),
    ("SMC, sign", "[law.smc_sign]"),
    (
        "SMC with an integral",
        "[law.smc_integral]\nkp_v = 10.0\nslope_1_s = 61.0\nintegral_1_s2 = 4250.0\nboundary_rad_s = 0.51\n\n[velocity.smoothed_derivative]\nsmoothing = 0.27",
    ),
    (
        "super-twisting",
        "[law.super_twisting]\nk1_v_rt_s_rad = 4.4\nk2_v_s = 42.0\nslope_1_s = 37.0\n\n[velocity.smoothed_derivative]\nsmoothing = 0.34",
    ),
    (
        "DOB",
        "[law.dob]\nkp_1_s2 = 6700.0\nkd_1_s = 150.0\nbandwidth_rad_s = 120.0\n\n[velocity.smoothed_derivative]\nsmoothing = 0.41",
    ),
    ("PI with feed-forward", pi!("[velocity.smoothed_derivative]\nsmoothing = 0.67")),
    ("PI, edge-timed", pi!("[velocity.edge_timed]\ndelay_ticks = 1\nripple_waves_per_turn = WAVES")),
    ("glide", "[law.glide.filter]\ndelay_ticks = 1\nripple_waves_per_turn = WAVES"),
    (
        "glide in a shell",
        "[law.glide.filter]\ndelay_ticks = 1\nripple_waves_per_turn = WAVES\n\n[shell]\nslope_1_s = 50.0\nboundary_rad_s = 0.1",
    ),
];

/// Other sources of the velocity, and micro-steps: rows of their own.
const SOURCES: &[(&str, &str)] = &[
    ("PI, M/T", pi!("[velocity.counts_over_time]")),
    ("PI, observer", pi!("[velocity.observer]")),
    ("SMC, M/T", "[law.smc]\n\n[velocity.counts_over_time]"),
    ("SMC, observer", "[law.smc]\n\n[velocity.observer]"),
    ("SMC, edge-timed", "[law.smc]\n\n[velocity.edge_timed]\ndelay_ticks = 1\nripple_waves_per_turn = WAVES"),
    (
        "glide, steps below 0.95 °/s",
        "[law.glide]\nmicro_below_deg_s = 0.95\n\n[law.glide.filter]\ndelay_ticks = 1\nripple_waves_per_turn = WAVES",
    ),
];

/// Departures of the rig from what it is and is believed to be.
const RIGS: &[(&str, &[(&str, f64)])] = &[
    ("bench", &[]),
    (
        "friction − 20 %",
        &[("rig.friction.stribeck.mu_static", 0.1624), ("rig.friction.stribeck.mu_dynamic", 0.0832)],
    ),
    (
        "friction + 20 %",
        &[("rig.friction.stribeck.mu_static", 0.2436), ("rig.friction.stribeck.mu_dynamic", 0.1248)],
    ),
    ("friction at rest 1.1 times that in motion", &[("rig.friction.stribeck.mu_static", 0.1144)]),
    ("friction at rest 2.5 times that in motion", &[("rig.friction.stribeck.mu_static", 0.26)]),
    ("Stribeck velocity × 7", &[("rig.friction.stribeck.stribeck_velocity_rad_s", 0.01)]),
    ("inertia + 20 %", &[("rig.inertia_kg_m2", 0.00204)]),
    ("inertia − 20 %", &[("rig.inertia_kg_m2", 0.00136)]),
    ("inertia − 40 %", &[("rig.inertia_kg_m2", 0.00102)]),
    ("ripple of 19 %, in place of 15", &[("rig.ripple.rms", 0.19)]),
    ("torque noise of 1 mN m", &[("rig.torque_noise_nm", 0.001)]),
    ("no delay", &[("rig.delay_ticks", 0.0)]),
    ("delay of 2 periods", &[("rig.delay_ticks", 2.0)]),
    ("delay of 3 periods", &[("rig.delay_ticks", 3.0)]),
    ("lag of 1 ms", &[("rig.actuator_time_constant_s", 0.001)]),
    ("lag of 3 ms", &[("rig.actuator_time_constant_s", 0.003)]),
];
/// Laws and rates for them.
const ON_RIGS: [&str; 5] = ["PD", "CTC", "SMC", "PI with feed-forward", "glide"];
const RATES_ON_RIGS: [f64; 4] = [0.2, 1.0, 4.0, 10.0];

/// Agreement of the meter with the truth over some runs. A stick is one of the simulator's, after settling, within a gap
/// between two edges.
#[derive(Clone, Default)]
struct Score {
    sticks: usize,
    /// Gaps that hold a stick.
    stuck_gaps: usize,
    sure: usize,
    sure_right: usize,
    possible: usize,
    possible_right: usize,
    calls: usize,
    calls_right: usize,
    runs: usize,
    told: usize,
    told_right: usize,
    /// From a stick's beginning to the call, and to the edge at which it is sure, s.
    to_call: Vec<f64>,
    to_edge: Vec<f64>,
    /// Calls of the edge-timed velocity, for each of [`SLOW`].
    slow: [Slow; SLOW.len()],
}

/// Gaps that the edge-timed velocity calls, those of them with a stick, and the times from its beginning, s.
#[derive(Clone, Default)]
struct Slow {
    calls: usize,
    right: usize,
    to_call: Vec<f64>,
}

/// Velocities at which it calls a stick, as shares of the path's.
const SLOW: [f64; 3] = [0.0, 0.1, 0.3];

impl Score {
    fn add(&mut self, o: Score) {
        self.sticks += o.sticks;
        self.stuck_gaps += o.stuck_gaps;
        self.sure += o.sure;
        self.sure_right += o.sure_right;
        self.possible += o.possible;
        self.possible_right += o.possible_right;
        self.calls += o.calls;
        self.calls_right += o.calls_right;
        self.runs += o.runs;
        self.told += o.told;
        self.told_right += o.told_right;
        self.to_call.extend(o.to_call);
        self.to_edge.extend(o.to_edge);
        for (own, other) in self.slow.iter_mut().zip(o.slow) {
            own.calls += other.calls;
            own.right += other.right;
            own.to_call.extend(other.to_call);
        }
    }

    fn of(scenario: &Scenario, run: &Run) -> Outcome<Score> {
        let spec = scenario.spec();
        let encoder = Encoder::new::<f64>(spec.rig.encoder.sensor.counts_per_rev)?;
        let per_radian: f64 = encoder.counts_per_radian();
        let period: f64 = spec.period.seconds();
        let mut meter =
            Meter::new(Plant::new(&spec.model)?, (&spec.law, &spec.velocity), encoder, spec.period);
        let sticks: Vec<(f64, i32)> = run
            .events
            .iter()
            .filter(|e| e.kind == EventKind::Stick)
            .map(|e| (e.time, (e.position * per_radian).floor() as i32))
            .collect();
        let shares = shares(scenario, run)?;
        let mut score = Score { runs: 1, ..Score::default() };
        for (k, (counts, volts)) in run.trace.counts.iter().zip(&run.trace.voltage).enumerate() {
            let Some(gap) = meter.sample(k as u64, Counts(*counts), *volts) else { continue };
            let (begin, end) = (gap.begin as f64 * period, gap.end as f64 * period);
            if begin < spec.run.settle {
                continue;
            }
            let count = run.trace.counts[gap.begin as usize];
            let within: Vec<f64> = sticks
                .iter()
                .filter(|(t, at)| *at == count && *t >= begin - period && *t <= end)
                .map(|(t, _)| *t)
                .collect();
            let call = run.detections.iter().find(|k| **k >= gap.begin && **k < gap.end);
            let one = |yes: bool| usize::from(yes);
            score.sticks += within.len();
            score.stuck_gaps += one(!within.is_empty());
            score.sure += one(gap.sure);
            score.sure_right += one(gap.sure && !within.is_empty());
            score.possible += one(gap.possible);
            score.possible_right += one(gap.possible && !within.is_empty());
            score.calls += one(call.is_some());
            score.calls_right += one(call.is_some() && !within.is_empty());
            for (slow, below) in score.slow.iter_mut().zip(SLOW) {
                let call = (gap.begin..gap.end).find(|k| shares[*k as usize] <= below);
                slow.calls += one(call.is_some());
                slow.right += one(call.is_some() && !within.is_empty());
                // A call before the stick is one at once.
                let late = within.first().zip(call).map(|(first, k)| k as f64 * period - first);
                slow.to_call.extend(late.map(|late| late.max(0.0)));
            }
            if let Some(first) = within.first() {
                score.to_call.extend(call.map(|k| *k as f64 * period - first));
                score.to_edge.extend(gap.sure.then_some(end - first));
            }
        }
        // All of the run, with what its end cuts off.
        let (d, truth) = (&run.detected, run.metrics.stick_slip_cycles_per_s);
        if let Verdict::Told(told) = d.verdict() {
            score.told = 1;
            // Two cycles that may be told apart from none, and one that the end of the run cuts off.
            let band = 0.2 * d.most_cycles_per_s.unwrap_or(0.0) + 3.0 / run.metrics.measured_s;
            score.told_right = usize::from((told - truth).abs() <= band);
        }
        Ok(score)
    }
}

/// The edge-timed velocity of each sample of a run, as a share of the path's, by a filter that believes what the meter does.
fn shares(scenario: &Scenario, run: &Run) -> Outcome<Vec<f64>> {
    let spec = scenario.spec();
    let counts_per_rev = spec.rig.encoder.sensor.counts_per_rev;
    let encoder = Encoder::new::<f64>(counts_per_rev)?;
    let defaults = EdgeTimedParams::<f64>::default();
    let params = EdgeTimedParams { delay: 1, waves: waves_seen(defaults.waves, counts_per_rev), ..defaults };
    let filter = EdgeTimed::new(&params, &Plant::new(&spec.model)?, encoder, spec.period)?;
    let (counts, volts) = (&run.trace.counts, &run.trace.voltage);
    let rate = run.trace.target_velocity.first().copied().unwrap_or(0.0);
    let at = |k: usize| FixedCounts::from_counts(counts[k].into());
    let mut state = filter.start(at(0), run.trace.start_voltage, rate);
    let pace = filter.per_period(rate);
    let share = |k: usize| {
        if k > 0 {
            filter.update(&mut state, at(k), volts[k - 1], rate);
        }
        state.velocity() / pace
    };
    Ok((0..counts.len()).map(share).collect())
}

/// The scenario of a law on `bench`; the filter's waves have to be resolved by the encoder.
fn scenario(law: &str, counts: i64) -> Outcome<Table> {
    let law = law.replace("WAVES", if counts < 10_000 { "90.0" } else { "340.0" });
    let (duration, settle) = LENGTH;
    Ok(format!(
        "name = \"meter\"\n\n[rig]\nbase = \"bench\"\n\n[rig.encoder]\ncounts_per_rev = {counts}\n\n{law}\n\n[reference.ramp]\nrate_deg_s = 2.0\n\n[run]\nduration_s = {duration:?}\nsettle_s = {settle:?}\n"
    )
    .parse()?)
}

/// The score of a law at a rate with an encoder, over some discs; `keys` are the rig's departures.
fn score(
    law: &str,
    counts: i64,
    rate: f64,
    keys: &[(&str, f64)],
    discs: std::ops::Range<i64>,
) -> Outcome<Score> {
    let mut names: Vec<String> = vec!["run.seed".into(), "reference.ramp.rate_deg_s".into()];
    names.extend(keys.iter().map(|(key, _)| (*key).to_owned()));
    let rows = discs.map(|seed| {
        let mut row = vec![Value::Integer(seed), Value::Float(rate)];
        row.extend(keys.iter().map(|(key, value)| {
            if key.ends_with("ticks") { Value::Integer(*value as i64) } else { Value::Float(*value) }
        }));
        row
    });
    let sweep = Sweep::new("meter", scenario(law, counts)?, names, rows.collect())?;
    let total = Mutex::new((Score::default(), None));
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    sweep.run(threads, Keep::Trace, &AtomicBool::new(false), &|i, row| {
        let scored: Outcome<Score> =
            row.map_err(Into::into).and_then(|Row { run, .. }| Score::of(&sweep.scenario(i)?, &run));
        if let Ok(mut total) = total.lock() {
            match scored {
                Ok(score) => total.0.add(score),
                Err(error) => total.1 = Some(error.to_string()),
            }
        }
    });
    let (score, error) = total.into_inner().map_err(|_| "a run has panicked")?;
    error.map_or(Ok(score), |error| Err(error.into()))
}

/// A share with its denominator; none of nothing.
fn share(a: usize, b: usize) -> String {
    if b == 0 { "–".into() } else { format!("{:.2} ({a}/{b})", a as f64 / b as f64) }
}

/// Median and ninth decile, ms.
fn times(of: &mut [f64]) -> String {
    of.sort_by(f64::total_cmp);
    let at = |share: f64| of.get((share * of.len() as f64) as usize).map(|t| t * 1e3);
    match (at(0.5), at(0.9)) {
        (Some(a), Some(b)) => format!("{a:.0}, {b:.0}"),
        _ => "–".into(),
    }
}

/// Sticks, and bounds and silences, of every law at every rate.
fn laws(counts: i64) -> Outcome<()> {
    let rates: Vec<String> = RATES.iter().map(|rate| format!("{rate} °/s")).collect();
    println!("| law | {} |", rates.join(" | "));
    println!("|---|{}", "---|".repeat(RATES.len()));
    for (title, law) in LAWS.iter().chain(SOURCES) {
        let mut cells = Vec::new();
        for rate in RATES {
            let s = score(law, counts, rate, &[], MADE_ON)?;
            cells.push(format!("{}: {}…{}, {}", s.stuck_gaps, s.sure, s.possible, s.calls));
        }
        println!("| {title} | {} |", cells.join(" | "));
    }
    Ok(())
}

/// Precision, recall and latency over all laws, by encoder and rate.
fn rates() -> Outcome<()> {
    println!(
        "| counts | discs | °/s | sticks | silence: precision | recall | ms | sure: precision | recall | ms | possible: precision | recall | runs told | told right |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for counts in ENCODERS {
        for (discs, range) in [("1–10", MADE_ON), ("3001–3010", HELD_OUT)] {
            let mut total = Score::default();
            for rate in RATES {
                let mut s = Score::default();
                for (_, law) in LAWS {
                    s.add(score(law, counts, rate, &[], range.clone())?);
                }
                total.add(s.clone());
                print_row(&format!("{counts} | {discs} | {rate}"), s);
            }
            print_row(&format!("{counts} | {discs} | all"), total);
        }
    }
    Ok(())
}

fn print_row(title: &str, mut s: Score) {
    println!(
        "| {title} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
        s.sticks,
        share(s.calls_right, s.calls),
        share(s.calls_right, s.stuck_gaps),
        times(&mut s.to_call),
        share(s.sure_right, s.sure),
        share(s.sure_right, s.stuck_gaps),
        times(&mut s.to_edge),
        share(s.possible_right, s.possible),
        share(s.possible_right, s.stuck_gaps),
        share(s.told, s.runs),
        share(s.told_right, s.told),
    );
}

/// Other sources of the velocity and micro-steps, by encoder, over all rates.
fn sources() -> Outcome<()> {
    println!(
        "| counts | law | sticks | silence: precision | recall | ms | sure: precision | recall | ms | possible: precision | recall | runs told | told right |"
    );
    println!("|---|{}", "---|".repeat(12));
    for counts in ENCODERS {
        for (title, law) in SOURCES {
            let mut s = Score::default();
            for rate in RATES {
                s.add(score(law, counts, rate, &[], HELD_OUT)?);
            }
            print_row(&format!("{counts} | {title}"), s);
        }
    }
    Ok(())
}

/// The edge-timed velocity as a detector, beside silence and what is sure.
fn edges() -> Outcome<()> {
    let below = SLOW.map(|share| match share {
        0.0 => " at rest: precision | recall | ms |".to_owned(),
        share => format!(" below {share} of the path's: precision | recall | ms |"),
    });
    println!(
        "| counts | °/s | gaps with a stick | silence: precision | recall | ms | sure: recall | ms |{}",
        below.concat()
    );
    println!("|{}", "---|".repeat(8 + 3 * SLOW.len()));
    for counts in ENCODERS {
        for rate in RATES_ON_RIGS {
            let mut s = Score::default();
            for (_, law) in LAWS.iter().filter(|(name, _)| ON_RIGS.contains(name)) {
                s.add(score(law, counts, rate, &[], HELD_OUT)?);
            }
            let stuck = s.stuck_gaps;
            let slow = s.slow.iter_mut().map(|slow| {
                let (precision, recall) = (share(slow.right, slow.calls), share(slow.right, stuck));
                format!(" {precision} | {recall} | {} |", times(&mut slow.to_call))
            });
            let slow: String = slow.collect();
            println!(
                "| {counts} | {rate} | {stuck} | {} | {} | {} | {} | {} |{slow}",
                share(s.calls_right, s.calls),
                share(s.calls_right, stuck),
                times(&mut s.to_call),
                share(s.sure_right, stuck),
                times(&mut s.to_edge),
            );
        }
    }
    Ok(())
}

/// The same with rigs that are not as believed.
fn rigs() -> Outcome<()> {
    println!("| the rig | sticks | sure: precision | recall | possible: precision | recall | told right |");
    println!("|---|---|---|---|---|---|---|");
    for (title, keys) in RIGS {
        let mut s = Score::default();
        for (_, law) in LAWS.iter().filter(|(name, _)| ON_RIGS.contains(name)) {
            for rate in RATES_ON_RIGS {
                s.add(score(law, 20_000, rate, keys, HELD_OUT)?);
            }
        }
        println!(
            "| {title} | {} | {} | {} | {} | {} | {} |",
            s.sticks,
            share(s.sure_right, s.sure),
            share(s.sure_right, s.stuck_gaps),
            share(s.possible_right, s.possible),
            share(s.possible_right, s.stuck_gaps),
            share(s.told_right, s.told),
        );
    }
    Ok(())
}

fn main() -> Outcome<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match args.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["laws", counts] => laws(counts.parse()?),
        ["rates"] => rates(),
        ["sources"] => sources(),
        ["edges"] => edges(),
        ["rigs"] => rigs(),
        _ => Err("expected laws and an encoder, rates, sources, edges, or rigs".into()),
    }
}
