//! Glide on the rig `bench`: smooth where the paper's laws stick, with one belief and one set of gains. The whole table is in
//! docs/smooth.md; these are its first rows, with fewer discs.

use clutch_core::law::Limit;
use clutch_sim::progress::UNWATCHED;
use clutch_sim::{Keep, Metrics, Scenario};
use toml::Value;

/// The built-in scenario.
fn bench() -> toml::Table {
    clutch_sim::scenario::BUILT_IN.iter().find(|b| b.name == "bench_glide_2").unwrap().toml.parse().unwrap()
}

/// Runs of the built-in scenario with keys changed, one for each disc from `first` on.
fn discs(first: i64, n: i64, keys: &[(&str, Value)]) -> Vec<Metrics> {
    discs_of(&bench(), first, n, keys)
}

/// As [`discs`], of any scenario.
fn discs_of(base: &toml::Table, first: i64, n: i64, keys: &[(&str, Value)]) -> Vec<Metrics> {
    let run = |seed| {
        let mut set = vec![("run.seed".to_owned(), Value::Integer(seed))];
        set.extend(keys.iter().map(|(key, value)| ((*key).to_owned(), value.clone())));
        let scenario = Scenario::from_table("glide", base.clone(), &set).unwrap();
        scenario.run(Keep::Figures, UNWATCHED).unwrap().metrics
    };
    (first..first + n).map(run).collect()
}

fn most(runs: &[Metrics], of: fn(&Metrics) -> f64) -> f64 {
    runs.iter().map(of).fold(0.0, f64::max)
}

fn never_sticks(runs: &[Metrics], degrees: f64, about: &str) {
    assert_eq!(most(runs, |m| m.stick_time_fraction), 0.0, "{about}");
    let error = most(runs, |m| m.max_error_rad).to_degrees();
    assert!(error <= degrees, "{about}: {error}°");
}

const RATE: &str = "reference.ramp.rate_deg_s";

#[test]
fn at_2_deg_s_it_never_sticks_in_either_scalar_and_wears_nothing_out() {
    for scalar in ["f64", "f32"] {
        let runs = discs(1, 40, &[("sampling.scalar", scalar.into())]);
        never_sticks(&runs, 0.03, scalar);
        let travel = runs.iter().map(|m| m.control_variation_v_s).sum::<f64>() / 40.0;
        assert!(travel <= 30.0, "{travel} V/s in {scalar}");
    }
}

#[test]
fn the_same_gains_serve_every_rate() {
    for (rate, degrees) in [(1.5, 0.03), (4.0, 0.06), (6.0, 0.055), (10.0, 0.08), (20.0, 0.1), (100.0, 0.1)] {
        never_sticks(&discs(1, 10, &[(RATE, rate.into())]), degrees, &format!("{rate} °/s"));
    }
    // Hardly ever at 1 °/s, where a count takes 18 ms.
    let runs = discs(1, 40, &[(RATE, 1.0.into())]);
    let cycles = runs.iter().map(|m| m.stick_slip_cycles_per_s).sum::<f64>() / 40.0;
    assert!(cycles <= 0.08, "{cycles} cycles/s at 1 °/s");
}

#[test]
fn friction_load_inertia_damping_and_a_lag_that_is_told_change_nothing() {
    let friction = |times: f64| {
        vec![
            ("rig.friction.stribeck.mu_static", (0.203 * times).into()),
            ("rig.friction.stribeck.mu_dynamic", (0.104 * times).into()),
        ]
    };
    let one = |key: &'static str, value: f64| vec![(key, Value::Float(value))];
    for keys in [
        friction(0.8),
        friction(1.2),
        one("rig.drive.weight.mass_kg", 0.23034),
        one("rig.inertia_kg_m2", 0.00204),
        one("rig.viscous_damping_nm_s_rad", 0.003),
        one("rig.friction.stribeck.stribeck_velocity_rad_s", 0.00288),
        one("rig.friction.stribeck.mu_static", 0.26),
        vec![("rig.actuator_time_constant_s", 0.003.into()), ("law.glide.filter.lag_s", 0.003.into())],
    ] {
        never_sticks(&discs(1, 8, &keys), 0.03, &format!("{keys:?}"));
    }
}

#[test]
fn from_rest_it_is_smooth_within_150_ms_whatever_friction_it_believes() {
    let start = |settle: f64, times: f64| {
        let keys = [
            ("run.start", "rest".into()),
            ("run.duration_s", 1.0.into()),
            ("run.settle_s", settle.into()),
            ("model.friction.stribeck.mu_static", (0.2 * times).into()),
            ("model.friction.stribeck.mu_dynamic", (0.15 * times).into()),
        ];
        discs(1, 50, &keys)
    };
    // Table 1; 0.89, 1.4 and 0.6 times the friction of the bench, 0.104. A law that believes too little starts less well.
    for (times, sticks) in [(1.0, 0.8), (0.614, 1.0), (0.971, 0.8), (0.416, 1.3)] {
        let all = start(0.0, times);
        assert!(most(&all, |m| m.stick_slip_cycles_per_s) <= 4.0);
        let mean = all.iter().map(|m| m.stick_slip_cycles_per_s).sum::<f64>() / 50.0;
        assert!(mean <= sticks, "{times}: {mean} sticks");
        let error = most(&all, |m| m.max_error_rad).to_degrees();
        assert!(error <= 0.13, "{times}: {error}°");
        assert_eq!(most(&start(0.15, times), |m| m.stick_time_fraction), 0.0, "{times}");
    }
}

#[test]
fn below_the_rates_at_which_it_slides_it_steps_by_parts_of_a_count() {
    let below = ("law.glide.micro_below_deg_s", Value::Float(0.95));
    // A count is 0.018°.
    for (rate, degrees) in [(0.05, 0.005), (0.2, 0.006), (0.5, 0.012), (0.7, 0.015)] {
        for scalar in ["f64", "f32"] {
            let keys = [(RATE, rate.into()), ("sampling.scalar", scalar.into()), below.clone()];
            let error = most(&discs(1, 4, &keys), |m| m.max_error_rad).to_degrees();
            assert!(error <= degrees, "{rate} °/s in {scalar}: {error}°");
        }
    }
    // Above, nothing changes.
    let at = |keys: &[(&str, Value)]| discs(1, 2, keys).iter().map(|m| m.max_error_rad).collect::<Vec<_>>();
    assert_eq!(at(&[(RATE, 1.0.into())]), at(&[(RATE, 1.0.into()), below.clone()]));
    // An actuator that lags lets go for longer, of which it is not told.
    let keys = [(RATE, 0.3.into()), ("rig.actuator_time_constant_s", 0.001.into()), below];
    let error = most(&discs(1, 4, &keys), |m| m.max_error_rad).to_degrees();
    assert!(error <= 0.02, "{error}°");
}

#[test]
fn paths_that_begin_and_end_at_rest_or_crawl_and_a_load_that_grows_keep_within_0_15_degrees() {
    let part = |toml: &str| Value::Table(toml.parse().unwrap());
    let below = ("law.glide.micro_below_deg_s", Value::Float(0.95));
    let along = |path: &str| {
        let mut table = bench();
        table.insert("reference".into(), part(path));
        table
    };
    let jerk = along("[minimum_jerk]\ndistance_deg = 20.0\nduration_s = 10.0\n");
    let from_rest = [
        ("run.start", "rest".into()),
        ("run.duration_s", 11.0.into()),
        ("run.settle_s", 0.0.into()),
        below.clone(),
    ];
    let sine = along("[sine]\nrate_deg_s = 2.0\namplitude_deg = 0.95493\nfrequency_hz = 0.25\n");
    let twenty = [("run.duration_s", 20.0.into()), below];
    // 15 % more weight after 3 s.
    let grows = "[table]\npoints_s_nm = [[0.0, 0.0493011], [3.0, 0.0493011], [3.001, 0.0566963]]\n";
    let mut loaded = bench();
    loaded["rig"].as_table_mut().unwrap().insert("drive".into(), part(grows));
    for (scenario, keys) in [(jerk, &from_rest[..]), (sine, &twenty), (loaded, &[])] {
        let error = most(&discs_of(&scenario, 1, 40, keys), |m| m.max_error_rad).to_degrees();
        assert!(error <= 0.15, "{:?}, {:?}: {error}°", scenario["reference"], scenario["rig"]);
    }
}

/// A path of two moves with a rest of eight seconds after each, on a rig that differs from `bench` by keys.
fn two_moves(keys: &[(&str, Value)], seed: i64) -> clutch_sim::Run {
    let mut table = bench();
    let path = "[table]\npoints_s_deg = [[0, 0], [5, 10], [13, 10], [18, 20], [26, 20]]\n";
    table.insert("reference".into(), Value::Table(path.parse().unwrap()));
    let mut set = vec![
        ("run.seed".to_owned(), Value::Integer(seed)),
        ("run.start".to_owned(), "rest".into()),
        ("run.duration_s".to_owned(), 26.0.into()),
        ("run.settle_s".to_owned(), 0.0.into()),
    ];
    set.extend(keys.iter().map(|(key, value)| ((*key).to_owned(), value.clone())));
    let scenario = Scenario::from_table("glide", table, &set).unwrap();
    scenario.run(Keep::Trace, UNWATCHED).unwrap()
}

#[test]
fn a_path_that_comes_to_rest_is_held_and_left_again() {
    let even = [
        ("rig.friction.stribeck.mu_static", 0.104.into()),
        ("rig.friction.stribeck.mu_dynamic", 0.104.into()),
        ("rig.delay_ticks", Value::Integer(0)),
        ("law.glide.filter.delay_ticks", Value::Integer(0)),
    ];
    for seed in 1..5 {
        // The bench, and a rig whose friction at rest is no higher than in motion: it creeps unless it is held.
        for keys in [&[][..], &even[..]] {
            let run = two_moves(keys, seed);
            let trace = &run.trace;
            for rest in [6000..13_000, 19_000..26_000] {
                let held = &trace.position[rest.clone()];
                assert!(held.iter().all(|p| *p == held[0]), "disc {seed} creeps");
                let volts = &trace.voltage[rest];
                assert!(
                    volts.iter().all(|v| (2.0..9.0).contains(v)),
                    "disc {seed}: {} V",
                    volts[volts.len() - 1]
                );
            }
            let error = run.metrics.max_error_rad.to_degrees();
            let at = trace.error.iter().position(|e| e.abs() == run.metrics.max_error_rad).unwrap();
            assert!(error < 0.2, "disc {seed}: {error}° at {} s, {} rows", trace.time[at], keys.len());
        }
    }
}

/// Under a fine encoder an edge comes in nearly every period of a motion, and none around a reversal: no number ends there.
#[test]
fn a_reversal_under_a_fine_encoder_leaves_every_number_finite() {
    let text = Scenario::text("motor_glide".as_ref()).unwrap().1;
    for (stribeck, scalar, steps) in
        [("0.001", "f64", "0.95"), ("0.01", "f32", "0.95"), ("0.01", "f64", "0.0"), ("0.001", "f32", "0.0")]
    {
        let set = [
            ("rig.encoder.counts_per_rev", "200000"),
            ("rig.friction.stribeck.stribeck_velocity_rad_s", stribeck),
            ("law.glide.micro_below_deg_s", steps),
            ("sampling.scalar", scalar),
            ("run.duration_s", "12.0"),
        ];
        let set = set.map(|(key, value)| (key.to_owned(), value.to_owned()));
        let run = Scenario::parse("motor", &text, &set).unwrap().run(Keep::Trace, UNWATCHED).unwrap();
        let finite = |xs: &[f64]| xs.iter().all(|x| x.is_finite());
        let trace = &run.trace;
        assert!(finite(&trace.demand) && finite(&trace.error_rate), "{stribeck}, {scalar}, {steps}");
        for (name, values) in &trace.terms {
            assert!(finite(values), "{name}: {stribeck}, {scalar}, {steps}");
        }
        // It does turn round, and not one demand was refused as no number.
        assert!(trace.target_velocity.iter().any(|v| *v < 0.0));
        assert!(!trace.limit.contains(&Limit::Invalid), "{stribeck}, {scalar}, {steps}");
    }
}
