//! Lanes against runs alone.

use super::run_all;
use crate::engine::exact_flow::{Flow, LINEAR_ABOVE, State};
use crate::lane::Lane;
use crate::lane::elementary::Powers;
use crate::lane::vector::{InLanes, at, levels};
use crate::metrics::Detected;
use crate::progress::UNWATCHED;
use crate::run::Keep;
use crate::scenario::{BUILT_IN, Scenario};
use clutch_core::law::Limit;
use fearless_simd::Level;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::cell::Cell;

/// Few, where each step is interpreted.
const FEW: bool = cfg!(miri);

/// A function of numbers, in lanes.
struct Of<'a>(Function, &'a [f64]);

#[derive(Clone, Copy, Debug)]
enum Function {
    Exp,
    Log,
    NearExp,
    NearExpm1,
    NearLog1p,
    Sin,
    Cos,
    Power(f64),
}

impl InLanes for Of<'_> {
    type Output = Vec<f64>;

    fn run<V: Powers>(self) -> Vec<f64> {
        let Of(function, numbers) = self;
        let of = |some: &[f64]| {
            let x = V::of(|i| some[i.min(some.len() - 1)]);
            let y = match function {
                Function::Exp => x.exp(),
                Function::Log => x.log(),
                Function::NearExp => x.near_exp(),
                Function::NearExpm1 => x.near_expm1(),
                Function::NearLog1p => x.near_log1p(),
                Function::Sin => x.sin(),
                Function::Cos => x.sincos().1,
                Function::Power(y) => x.powf(V::splat(y)),
            };
            (0..some.len()).map(|i| y.lane(i)).collect::<Vec<_>>()
        };
        numbers.chunks(V::WIDTH).flat_map(of).collect()
    }
}

/// Numbers of all magnitudes up to `largest`, and those around which the functions change their way.
fn numbers(largest: f64, signs: &[f64]) -> Vec<f64> {
    let mut rng = Pcg64::seed_from_u64(7);
    let mut all: Vec<f64> = (0..if FEW { 40 } else { 400_000 })
        .map(|i| {
            let even = largest * rng.random::<f64>();
            let magnitude =
                if i % 2 == 0 { even } else { libm::exp(libm::log(largest) - 90.0 * rng.random::<f64>()) };
            magnitude * signs[rng.random_range(0..signs.len())]
        })
        .collect();
    let edges = [0.5, 1.5, 1.0, 2.0, 19.5, 20.5, 55.5, 56.0, 57.0].map(|n| n * core::f64::consts::LN_2);
    // Multiples of an eighth of a turn, and of half of that.
    let eighths = (1..40).map(|n| f64::from(n) * core::f64::consts::FRAC_PI_8);
    let far = [1e3, 1e5].map(|turns| turns * core::f64::consts::FRAC_PI_2);
    let edges = edges.into_iter().chain(eighths).chain(far).chain([
        0.25,
        0.2929,
        0.414_213_6,
        1.0,
        3.725_290_298_461_914e-9,
        5.551_115_123_125_783e-17,
    ]);
    let steps: i64 = if FEW { 1 } else { 2000 };
    for edge in edges.filter(|edge| *edge < largest) {
        for step in -steps..steps {
            let near = f64::from_bits(edge.to_bits().wrapping_add_signed(step * 2_097_152 + step));
            all.extend(signs.iter().map(|sign| sign * near));
        }
    }
    all
}

#[test]
fn elementary_functions_have_the_bits_of_libm_at_every_level() {
    type Alone = Box<dyn Fn(f64) -> f64>;
    type Plain = fn(f64) -> f64;
    let cases: [(Function, Plain, Vec<f64>); 6] = [
        (Function::Exp, libm::exp, numbers(700.0, &[1.0, -1.0])),
        (Function::Log, libm::log, numbers(1e300, &[1.0])),
        (Function::Sin, libm::sin, numbers(1.6e6, &[1.0, -1.0])),
        (Function::Cos, libm::cos, numbers(1.6e6, &[1.0, -1.0])),
        // Some beyond what lanes reduce.
        (Function::Sin, |x| libm::sincos(x).0, numbers(1e300, &[1.0, -1.0])),
        (Function::Cos, |x| libm::sincos(x).1, numbers(60.0, &[1.0, -1.0])),
    ];
    let cases = cases.into_iter().map(|(f, alone, numbers)| (f, Box::new(alone) as Alone, numbers));
    // Some that lanes have, and some that they leave to scalars.
    let powers = [1.0 / 17.0, 1.0 / 18.0, -0.4999, 1e-9, 1.7, -3.3, 7.99, 0.5, 1.0, 2.0, -1.0, 0.0, 9.5];
    let powers = powers.into_iter().map(|y: f64| {
        let largest = if y.abs() < 0.5 { 1e300 } else { 1e25 };
        let few = numbers(largest, &[1.0]).into_iter().step_by(5).chain([f64::MIN_POSITIVE, 1e-310]);
        (Function::Power(y), Box::new(move |x| libm::pow(x, y)) as Alone, few.collect())
    });
    for (function, alone, numbers) in cases.chain(powers) {
        for (_, level) in levels() {
            let together = at(level, Of(function, &numbers)).unwrap();
            for (x, y) in numbers.iter().zip(together) {
                assert_eq!(alone(*x).to_bits(), y.to_bits(), "{function:?} of {x:e} at {level:?}");
            }
        }
    }
}

#[test]
fn near_functions_are_near_and_have_the_bits_of_one_number_at_every_level() {
    type Plain = fn(f64) -> f64;
    let above_minus_1 = || numbers(1e300, &[1.0]).into_iter().chain(numbers(0.999_999, &[-1.0])).collect();
    let cases: [(Function, Plain, Plain, Vec<f64>); 3] = [
        (Function::NearExp, f64::near_exp, libm::exp, numbers(700.0, &[1.0, -1.0])),
        (Function::NearExpm1, f64::near_expm1, libm::expm1, numbers(700.0, &[1.0, -1.0])),
        (Function::NearLog1p, f64::near_log1p, libm::log1p, above_minus_1()),
    ];
    for (function, near, exactly, numbers) in cases {
        for x in &numbers {
            let (near, exactly) = (near(*x), exactly(*x));
            // Beyond 1 the rounding of an argument is that of a result.
            let bound = 3e-14 + 4e-16 * if matches!(function, Function::NearLog1p) { 0.0 } else { x.abs() };
            assert!(
                (near - exactly).abs() <= bound * exactly.abs(),
                "{function:?} of {x:e}: {near:e}, {exactly:e}"
            );
        }
        for (_, level) in levels() {
            let together = at(level, Of(function, &numbers)).unwrap();
            for (x, y) in numbers.iter().zip(together) {
                assert_eq!(near(*x).to_bits(), y.to_bits(), "{function:?} of {x:e} at {level:?}");
            }
        }
    }
}

/// The first piece of a motion without a layer and without drag, in each lane: whether there is one in all, whether it
/// stops in all, and how long it is in the last.
struct Slows {
    drive: f64,
    speed: f64,
    rest: f64,
}

impl InLanes for Slows {
    type Output = (bool, bool, f64);

    fn run<V: Powers>(self) -> Self::Output {
        let drive = V::splat(self.drive);
        let edge = V::splat(LINEAR_ABOVE);
        let flow = Flow { drive, excess: drive, drag: V::ZERO, stribeck: V::ZERO, edge };
        let piece = flow.easy(&State::at(V::splat(self.speed)), V::splat(self.rest));
        (V::all(piece.done), V::all(piece.stops), piece.state.time.lane(V::WIDTH - 1))
    }
}

#[test]
fn a_motion_that_stops_just_as_the_period_ends_stops_in_lanes_too() {
    // In exact numbers it would reach 0 an ulp after the end; rounded it is there at the end.
    let (drive, speed, rest) = (-8.497_374_274_981_322, 0.008_497_374_274_981_323, 1e-3);
    let alone = Flow { drive, excess: drive, drag: 0.0, stribeck: 0.0, edge: LINEAR_ABOVE };
    let (end, stops) = alone.run(State::at(speed), rest).unwrap();
    assert!(stops && end.time == rest, "alone: {stops}, at {} s", end.time);
    for (_, level) in levels() {
        let (done, stops, time) = at(level, Slows { drive, speed, rest }).unwrap();
        assert_eq!((done, stops, time), (true, true, rest), "{level:?}");
    }
}

/// A built-in scenario with values for some keys. The drive of what goes in lanes is a weight.
pub(crate) fn built_in(name: &str, set: &[(String, String)]) -> Scenario {
    let built_in = BUILT_IN.iter().find(|b| b.name == name).unwrap();
    let weight = "[rig.drive.weight]\nmass_kg = 0.001\n";
    let toml = built_in
        .toml
        .replace("points_s_nm = [[0.0, 0.0]]", "")
        .replace("[rig.drive.table]        # no load\n", weight);
    Scenario::parse(name, &toml, set).unwrap()
}

/// Scenarios around a built-in one, each with other values for some keys.
fn around(name: &str, keys: &[(&str, f64, f64)], more: &[(&str, &str)], n: u64) -> Vec<Scenario> {
    let mut rng = Pcg64::seed_from_u64(11);
    let mut one = |i: u64| {
        let mut set: Vec<(String, String)> =
            more.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        set.extend(keys.iter().map(|(key, low, high)| {
            ((*key).to_owned(), format!("{}", low + (high - low) * rng.random::<f64>()))
        }));
        set.push(("run.seed".into(), (i + 1).to_string()));
        built_in(name, &set)
    };
    (0..n).map(&mut one).collect()
}

type Told = Vec<(usize, crate::Metrics, Detected)>;

/// Figures of those that go in lanes; false if it was stopped.
fn together(level: Level, scenarios: &[Scenario], stop: &dyn Fn() -> bool) -> (Told, bool) {
    let specs: Vec<_> = scenarios.iter().map(Scenario::spec).enumerate().collect();
    let mut told = Vec::new();
    let whole = run_all(level, specs.into_iter(), stop, &mut |place, _, m, d| told.push((place, m, d)));
    (told, whole)
}

/// Figures of runs in lanes, at every level, against each run alone; how many went in lanes.
fn same_bits(scenarios: &[Scenario]) -> usize {
    let alone: Vec<_> = scenarios
        .iter()
        .map(|s| s.run(Keep::Figures, UNWATCHED).unwrap())
        .map(|r| (r.metrics, r.detected))
        .collect();
    let mut went = 0;
    for (_, level) in levels() {
        let (together, whole) = together(level, scenarios, &|| false);
        assert!(whole);
        went = together.len();
        for (place, metrics, detected) in together {
            let bits = |m: &crate::Metrics, d: &Detected| -> Vec<_> {
                crate::metrics::figure_columns(m, d).map(|(name, x)| (name, x.map(f64::to_bits))).collect()
            };
            let (m, d) = &alone[place];
            assert_eq!(bits(&metrics, &detected), bits(m, d), "run {place} at {level:?}");
        }
    }
    went
}

/// Ranges of keys that a case draws from, and values that all its runs have.
type Case<'a> = (&'a str, &'a [(&'a str, f64, f64)], &'a [(&'a str, &'a str)]);

#[test]
fn runs_in_lanes_have_the_bits_of_runs_alone() {
    let pd = [("law.pd.kp_v_rad", 500.0, 8000.0), ("law.pd.kd_v_s_rad", 2.0, 80.0)];
    let smc = [("law.smc.kp_v", 2.3, 6.0), ("law.smc.kd_v_s_rad", 1.0, 500.0)];
    let ctc = [("law.ctc.kp_1_s2", 500.0, 3000.0)];
    let rigs = [
        ("rig.friction.stribeck.stribeck_velocity_rad_s", 1e-4, 0.02),
        ("rig.friction.stribeck.mu_static", 0.05, 0.4),
        ("rig.viscous_damping_nm_s_rad", 0.0, 0.3),
        ("reference.ramp.rate_deg_s", 0.5, 60.0),
    ];
    let stiff = [("rig.friction.stribeck.stribeck_velocity_rad_s", 1e-6, 3e-5)];
    let light = [("rig.inertia_kg_m2", 1e-5, 1e-4), ("law.pd.kd_v_s_rad", 0.1, 2.0)];
    let voltage = [("law.voltage.start_v", 0.5, 3.0)];
    let open = ("output.bumpless_time_s", "0.1");
    let path = |path: &'static str| ("reference", path);
    let sine = "{ sine = { rate_deg_s = 5.0, amplitude_deg = 0.5, frequency_hz = 1.0 } }";
    let jerk = "{ minimum_jerk = { distance_deg = 8.0, duration_s = 2.0 } }";
    let cases: [Case<'_>; 22] = [
        ("pd_2", &stiff, &[]),
        ("pd_2", &stiff, &[("sampling.period_us", "20000")]),
        ("pd_2", &light, &[]),
        ("pd_2", &pd, &[("sampling.period_us", "10000"), ("rig.viscous_damping_nm_s_rad", "0.5")]),
        ("pd_2", &pd, &[path(sine), ("rig.delay_ticks", "1"), ("run.settle_s", "0")]),
        ("pd_2", &pd, &[path(jerk), open, ("rig.delay_ticks", "7")]),
        ("pd_2", &pd, &[("rig.encoder.counts_per_rev", "400"), ("rig.friction.stribeck.mu_static", "0.1")]),
        ("pd_2", &voltage, &[("law", "{ voltage = {} }")]),
        ("pd_2", &[("rig.drive.weight.mass_kg", 0.1, 0.3)], &[("law", "{ hold = {} }")]),
        ("smc_2", &[("rig.friction.stribeck.mu_dynamic", 0.1, 0.2)], &[("law", "{ smc_sign = {} }")]),
        (
            "bench_pid_2",
            &[("law.pid.kp_v_rad", 500.0, 3000.0)],
            &[("rig.base", "\"paper\""), ("law.pid.kd_v_s_rad", "0")],
        ),
        ("pd_2", &pd, &[]),
        ("pd_2", &pd, &[("reference.ramp.rate_deg_s", "20")]),
        ("pd_2", &[("rig.drive.weight.mass_kg", 0.05, 0.3)], &[("rig.friction.coulomb.mu_static", "0.2")]),
        ("pd_2", &rigs, &[]),
        ("pd_2", &pd, &[("rig.delay_ticks", "2"), ("rig.dac.quantised", "false")]),
        ("pd_2", &pd, &[("rig.encoder.quantised", "false"), ("run.start", "rest")]),
        ("smc_2", &smc, &[]),
        ("ctc_2", &ctc, &[]),
        ("bench_pid_2", &[("law.pid.kp_v_rad", 500.0, 3000.0)], &[("rig.base", "\"paper\"")]),
        ("motor_pid", &[("law.pid.kp_v_rad", 5.0, 60.0)], &[]),
        ("motor_smc", &[("law.smc.kp_v", 1.0, 3.0)], &[]),
    ];
    let mut went = 0;
    for (name, keys, more) in cases {
        let more: Vec<_> = more.iter().copied().chain([("run.duration_s", "2.5")]).collect();
        let n = same_bits(&around(name, keys, &more, 19));
        assert_eq!(n, 19, "{name} {keys:?} {more:?}");
        went += n;
    }
    assert_eq!(went, 19 * cases.len());
}

/// The shortest run of all: for an interpreter that looks at each step.
#[test]
fn a_few_periods_have_the_bits_of_runs_alone() {
    let rates = [("reference.ramp.rate_deg_s", 1.0, 30.0)];
    let short = [("run.duration_s", "0.01"), ("run.settle_s", "0"), ("output.bumpless_time_s", "0")];
    assert_eq!(same_bits(&around("smc_2", &rates, &short, 9)), 9);
}

/// Laws whose memory limits hold: their name, what a case draws for them, and the same for one that saturates.
type Remembers<'a> = (&'a str, &'a [(&'a str, f64, f64)], &'a [(&'a str, f64, f64)]);

const REMEMBER: [Remembers<'static>; 3] = [
    (
        "{ super_twisting = {} }",
        &[
            ("law.super_twisting.k1_v_rt_s_rad", 1.0, 6.0),
            ("law.super_twisting.k2_v_s", 5.0, 40.0),
            ("law.super_twisting.boundary_rad_s", 0.0, 0.05),
        ],
        &[("law.super_twisting.k1_v_rt_s_rad", 10.0, 100.0), ("law.super_twisting.k2_v_s", 100.0, 1000.0)],
    ),
    (
        "{ smc_integral = {} }",
        &[
            ("law.smc_integral.kp_v", 3.0, 8.0),
            ("law.smc_integral.kd_v_s_rad", 0.0, 40.0),
            ("law.smc_integral.integral_1_s2", 0.0, 6000.0),
        ],
        &[("law.smc_integral.kp_v", 20.0, 80.0), ("law.smc_integral.boundary_rad_s", 0.01, 0.3)],
    ),
    (
        "{ dob = {} }",
        &[
            ("law.dob.kp_1_s2", 3000.0, 20_000.0),
            ("law.dob.kd_1_s", 100.0, 400.0),
            ("law.dob.bandwidth_rad_s", 5.0, 60.0),
        ],
        &[("law.dob.kp_1_s2", 1e5, 1e6), ("law.dob.bandwidth_rad_s", 100.0, 500.0)],
    ),
];

/// Values that all runs of a case have.
type Values<'a> = &'a [(&'a str, &'a str)];

/// Keys of which a case draws values, with their ranges.
type Drawn<'a> = &'a [(&'a str, f64, f64)];

/// Numbers of ticks in which runs alone got what the law asked for, the lowest voltage, and the highest.
fn limits(scenarios: &[Scenario]) -> [usize; 3] {
    let traces: Vec<_> = scenarios.iter().map(|s| s.run(Keep::Trace, UNWATCHED).unwrap().trace).collect();
    [Limit::None, Limit::Lowest, Limit::Highest]
        .map(|limit| traces.iter().flat_map(|t| &t.limit).filter(|l| **l == limit).count())
}

#[test]
fn laws_whose_memory_limits_hold_have_the_bits_of_runs_alone() {
    let sine = ("reference", "{ sine = { rate_deg_s = 15.0, amplitude_deg = 2.0, frequency_hz = 1.0 } }");
    let to_and_fro =
        ("reference", "{ sine = { rate_deg_s = 0.0, amplitude_deg = 5.0, frequency_hz = 0.8 } }");
    let narrow = [("output.highest_v", "2.6"), ("output.on_invalid_v", "2.6")];
    let rest = ("run.start", "rest");
    let bench = ("rig.base", "\"bench\"");
    let late = [("rig.delay_ticks", "3"), ("output.bumpless_time_s", "0.1")];
    let both = "{ both = { brake_gain_nm_v = 0.14, motor_gain_nm_v = 0.02, preload_nm = 0.01 } }";
    let both = [("rig.actuator", both), ("model.actuator", both), ("output.lowest_v", "-10.0")];
    let gear =
        [("rig.actuator.motor.load_share", "0.2"), ("model.actuator.motor.load_share", "0.2"), to_and_fro];
    let narrow_motor = [("output.lowest_v", "-1.3"), ("output.highest_v", "1.2"), to_and_fro];
    for (law, usual, saturates) in REMEMBER {
        let law = [("law", law)];
        let cases: [(&str, bool, &[Values<'_>]); 10] = [
            ("pd_2", false, &[]),
            ("pd_2", false, &[&[sine, rest], &narrow]),
            ("pd_2", false, &[&late, &[("reference.ramp.rate_deg_s", "20")]]),
            ("pd_2", false, &[&[bench]]),
            ("pd_2", true, &[&[sine]]),
            ("pd_2", true, &[&[bench, rest]]),
            ("pd_2", true, &[&both, &[sine]]),
            ("motor_pid", false, &[&[to_and_fro]]),
            ("motor_pid", true, &[&gear]),
            ("motor_pid", true, &[&narrow_motor, &late[..1]]),
        ];
        let mut met = [0; 3];
        for (name, full, more) in cases {
            let keys = if full { saturates } else { usual };
            let keys: Vec<_> = keys.iter().copied().chain([("run.start_counts", -5000.0, 5000.0)]).collect();
            let short = [("run.duration_s", "1.6"), ("run.settle_s", "0.2")];
            let more = [&law[..], &more.concat(), &short].concat();
            let scenarios = around(name, &keys, &more, 11);
            assert_eq!(same_bits(&scenarios), 11, "{name} {more:?}");
            let found = limits(&scenarios);
            if full {
                assert!(found.iter().all(|n| *n > 0), "{name} {more:?}: {found:?}");
            }
            met = [0, 1, 2].map(|i| met[i] + found[i]);
        }
        assert!(met.iter().all(|n| *n > 1000), "{law:?}: {met:?}");
    }
}

#[test]
fn servos_that_are_computed_one_by_one_beside_motion_in_lanes_have_the_bits_of_runs_alone() {
    let bench = ("rig.base", "\"bench\"");
    let sine = ("reference", "{ sine = { rate_deg_s = 2.0, amplitude_deg = 0.3, frequency_hz = 1.0 } }");
    let drag = [("rig.friction.stribeck.mu_dynamic", 0.12, 0.18)];
    let fine = [("rig.encoder.quantised", "false"), ("rig.dac.quantised", "false")];
    let points: Vec<String> =
        (0..720).map(|i| format!("[{}, {}]", f64::from(i) / 2.0, 1.0 + 0.1 * f64::from(i % 7))).collect();
    let map = format!("{{ rig = \"another\", points_deg_factor = [{}] }}", points.join(", "));
    let map = [("friction_map", map.as_str())];
    let late = [("rig.delay_ticks", "2"), ("output.bumpless_time_s", "0.1"), ("run.start", "rest")];
    let cases: [(&str, Drawn<'_>, &[Values<'_>]); 13] = [
        ("pd_2", &drag, &[&map]), // which the law does not ask
        ("bench_glide_2", &[("reference.ramp.rate_deg_s", 0.1, 5.0)], &[]),
        ("bench_glide_2", &[("run.start_counts", -5000.0, 5000.0)], &[&late]),
        ("bench_glide_2", &[("run.start_counts", -5000.0, 5000.0)], &[&map]),
        ("pd_2", &drag, &[&[("law", "{ glide = {} }")]]),
        ("pd_2", &drag, &[&[("law", "{ glide = {} }"), sine, bench]]),
        ("pd_2", &drag, &[&[("velocity.counts_over_time", "{}"), bench]]),
        ("pd_2", &drag, &[&[("velocity.edge_timed", "{}"), bench]]),
        ("pd_2", &drag, &[&[("velocity.edge_timed", "{}")], &fine]),
        ("smc_2", &[("law.smc.kp_v", 2.3, 6.0)], &[&[("velocity.observer", "{}")], &late]),
        ("smc_2", &[("shell.boundary_rad_s", 0.05, 0.3)], &[&[bench]]),
        ("motor_pid", &[("shell.boundary_rad_s", 0.5, 3.0)], &[]),
        ("motor_pid", &[("rig.inertia_kg_m2", 1e-4, 1e-3)], &[&[("law", "{ glide = {} }")]]),
    ];
    for (name, keys, more) in cases {
        let more = [&more.concat()[..], &[("run.duration_s", "1.5"), ("run.settle_s", "0.2")]].concat();
        assert_eq!(same_bits(&around(name, keys, &more, 11)), 11, "{name} {keys:?} {more:?}");
    }
}

#[test]
fn runs_in_steps_have_the_bits_of_runs_alone() {
    let pd = [("law.pd.kp_v_rad", 500.0, 8000.0), ("law.pd.kd_v_s_rad", 2.0, 80.0)];
    let smc = [("law.smc.kp_v", 2.3, 6.0), ("law.smc.kd_v_s_rad", 1.0, 500.0)];
    let rigs = [
        ("rig.friction.stribeck.stribeck_velocity_rad_s", 1e-4, 0.02),
        ("rig.friction.stribeck.mu_static", 0.12, 0.4),
        ("rig.viscous_damping_nm_s_rad", 0.0, 0.3),
        ("rig.ripple.rms", 0.0, 0.18),
        ("reference.ramp.rate_deg_s", 0.5, 60.0),
    ];
    let motor = [("law.pid.kp_v_rad", 5.0, 60.0), ("rig.actuator_time_constant_s", 1e-7, 0.01)];
    let bench = ("rig.base", "\"bench\"");
    let runout = ("rig.runout", "{ amplitude = 0.05, waves_per_turn = 2, phase_deg = 30.0 }");
    let lags = ("rig.actuator_time_constant_s", "0.002");
    let dormand_prince = ("run.engine", "dormand_prince");
    let cases: [Case<'_>; 12] = [
        ("pd_2", &pd, &[bench]),
        ("pd_2", &pd, &[bench, ("reference.ramp.rate_deg_s", "20")]),
        ("pd_2", &rigs, &[bench]),
        ("pd_2", &rigs, &[bench, runout, lags]),
        ("pd_2", &[("rig.actuator_time_constant_s", 1e-7, 0.02)], &[]),
        ("pd_2", &pd, &[runout]),
        ("pd_2", &[("rig.friction.stribeck.stribeck_exponent", 0.5, 2.0)], &[]),
        ("pd_2", &pd, &[bench, ("run.start", "rest"), ("rig.friction.coulomb.mu_static", "0.2")]),
        ("pd_2", &pd, &[dormand_prince]),
        ("smc_2", &smc, &[bench]),
        ("ctc_2", &[("law.ctc.kp_1_s2", 500.0, 3000.0)], &[bench, lags]),
        ("motor_pid", &motor, &[("run.settle_s", "0.5")]),
    ];
    for (name, keys, more) in cases {
        let more: Vec<_> = more.iter().copied().chain([("run.duration_s", "1.6")]).collect();
        assert_eq!(same_bits(&around(name, keys, &more, 19)), 19, "{name} {keys:?} {more:?}");
    }
}

#[test]
fn fifty_thousand_periods_on_a_rippled_disc_have_the_bits_of_runs_alone() {
    let pd = [("law.pd.kp_v_rad", 4000.0, 6000.0), ("law.pd.kd_v_s_rad", 40.0, 60.0)];
    let more = [("run.duration_s", "6"), ("rig.base", "\"bench\"")];
    assert_eq!(same_bits(&around("pd_2", &pd, &more, 9)), 9);
}

#[test]
fn a_million_periods_that_stick_have_the_bits_of_runs_alone() {
    let pd = [("law.pd.kp_v_rad", 4000.0, 6000.0), ("law.pd.kd_v_s_rad", 40.0, 60.0)];
    assert_eq!(same_bits(&around("pd_2", &pd, &[("run.duration_s", "65")], 16)), 16);
}

#[test]
fn a_run_that_is_not_for_lanes_goes_alone() {
    for more in [
        ("rig.torque_noise_nm", "0.001"),
        ("rig.friction", "{ dahl = {} }"),
        ("rig.drive", "{ sine = { mean_nm = 0.05, amplitude_nm = 0.01, frequency_hz = 1.0 } }"),
    ] {
        let scenarios = around("pd_2", &[], &[more, ("run.duration_s", "1.5")], 3);
        assert_eq!(together(levels()[0].1, &scenarios, &|| false), (vec![], true), "{more:?}");
    }
}

#[test]
fn a_run_that_is_stopped_is_not_told() {
    let scenarios = around("pd_2", &[], &[("run.duration_s", "5")], 9);
    for after in [0, 5, 9, 10, 11] {
        let asked = Cell::new(0);
        let stop = || asked.replace(asked.get() + 1) >= after;
        assert_eq!(together(levels()[0].1, &scenarios, &stop), (vec![], false), "after {after} questions");
    }
}

#[test]
fn a_shaft_that_runs_away_goes_alone() {
    // Nothing brakes it: after 11 s it is beyond what counts in lanes hold.
    let more = [
        ("law.pd.kp_v_rad", "0.0"),
        ("law.pd.kd_v_s_rad", "0.0"),
        ("rig.encoder.counts_per_rev", "16000000"),
        ("run.duration_s", "15"),
    ];
    assert_eq!(same_bits(&around("pd_2", &[], &more, 3)), 0);
}

#[test]
fn runs_that_have_little_in_common_go_in_groups() {
    let mut scenarios = around("pd_2", &[], &[("run.duration_s", "1.5")], 4);
    scenarios.extend(around("smc_2", &[], &[("run.duration_s", "1.5")], 5));
    scenarios.extend(around("pd_2", &[], &[("run.duration_s", "2")], 11));
    // Too few to fill lanes, and one that has none.
    scenarios.extend(around("pd_2", &[], &[("run.duration_s", "1.6")], 2));
    scenarios.extend(around("pd_2", &[], &[("run.duration_s", "1.5"), ("rig.torque_noise_nm", "0.001")], 1));
    assert_eq!(same_bits(&scenarios), 20);
}
