//! Certified bounds of the sampled loop against simulations, which share no code with them; `cargo xtask certified` is the large one.

#[path = "../../crates/clutch-sim/examples/certified/adversary.rs"]
mod adversary;

use adversary::{Adversary, Way};
use clutch_certificate::{Options, Setup, checker, largest, search, stability};
use clutch_core::friction::StribeckParams;
use clutch_core::{BrakeActuator, MotorActuator, Servo};
use clutch_sim::progress::UNWATCHED;
use clutch_sim::run::simulate_watched;
use clutch_sim::{Keep, RunSpec, Scenario, simulate_servo};
use clutch_tests::command;
use std::process::Command;

/// A built-in scenario with other values.
fn scenario(name: &str, set: &[(&str, &str)]) -> Scenario {
    let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    let (origin, text) = Scenario::text(name.as_ref()).unwrap();
    Scenario::parse(&origin, &text, &set).unwrap_or_else(|e| panic!("{e}"))
}

fn setup(scenario: &Scenario) -> Setup {
    scenario.sampled_setup(&scenario.plan().unwrap().bounds).unwrap_or_else(|e| panic!("{e}"))
}

/// The largest |e| of a plant of the box: the seed's lowest digits say which corner of `μ_d`, `μ_s` and `K_COF`.
fn error(scenario: &Scenario, setup: &Setup, seed: u64) -> f64 {
    let spec = spec(scenario, setup, seed);
    simulate_watched::<f64>(&spec, Keep::Figures, UNWATCHED).unwrap().metrics.max_error_rad
}

fn spec<'a>(scenario: &'a Scenario, setup: &Setup, seed: u64) -> RunSpec<'a> {
    let share = |place: u32| (seed / 3_u64.pow(place) % 3) as f64 / 2.0;
    let of = |[low, high]: [f64; 2], place: u32| low + (high - low) * share(place);
    let mut spec = scenario.spec();
    let sliding = of(setup.sliding, 0);
    spec.rig.friction = StribeckParams {
        mu_dynamic: sliding,
        mu_static: of(setup.at_rest, 1).max(sliding),
        stribeck_velocity: setup.stribeck[0],
        ..StribeckParams::default()
    }
    .into();
    spec.rig.actuator = match &setup.motor {
        Some(motor) => {
            // Strong and light, or weak and heavy.
            spec.rig.inertia = of([setup.inertia[1], setup.inertia[0]], 2);
            MotorActuator { gain: of(motor.gain, 2), preload: motor.preload, load_share: 0.0 }.into()
        }
        None => BrakeActuator { gain: of(setup.brake_gain, 2), ..BrakeActuator::default() }.into(),
    };
    spec.run.seed = seed;
    spec.run.duration = 2.0;
    spec.run.settle = 0.0;
    spec
}

#[test]
fn no_plant_of_a_box_breaks_its_certified_bound() {
    let options = Options { refinements: 0, ..Options::default() };
    for (name, set) in [
        ("pd_2", &[("bounds.friction_percent", "10.0"), ("bounds.brake_gain_percent", "5.0")][..]),
        (
            "pd_2",
            &[
                ("law.pd.kp_v_rad", "1660.0"),
                ("law.pd.kd_v_s_rad", "12.9"),
                ("velocity.smoothed_derivative.smoothing", "0.712"),
                ("rig.delay_ticks", "1"),
                ("reference.ramp.rate_deg_s", "20.0"),
                ("bounds.friction_percent", "5.0"),
            ],
        ),
        // PD that is fed forward what a sliding shaft of the model needs.
        (
            "bench_pid_2",
            &[
                ("rig.base", "paper"),
                ("law.pid.kp_v_rad", "1660.0"),
                ("law.pid.ki_v_rad_s", "0.0"),
                ("law.pid.kd_v_s_rad", "12.9"),
                ("law.pid.bias_v", "2.2423"),
                ("law.pid.velocity_v_s_rad", "0.0476"),
                ("velocity.smoothed_derivative.smoothing", "0.712"),
                ("rig.delay_ticks", "1"),
                ("bounds.friction_percent", "5.0"),
            ],
        ),
        // PI, which the model's friction does not concern: from the start it has the voltage that holds.
        (
            "bench_pid_2",
            &[
                ("rig.base", "paper"),
                ("law.pid.kp_v_rad", "2370.0"),
                ("law.pid.ki_v_rad_s", "25000.0"),
                ("law.pid.kd_v_s_rad", "14.5"),
                ("law.pid.derivative_time_s", "0.0"),
                ("velocity.smoothed_derivative.smoothing", "0.67"),
                ("bounds.friction_percent", "5.0"),
            ],
        ),
        (
            "smc_2",
            &[
                ("law.smc.kp_v", "5.0"),
                ("law.smc.kd_v_s_rad", "50.0"),
                ("law.smc.boundary_rad_s", "0.2"),
                ("velocity.smoothed_derivative.smoothing", "0.5"),
                ("bounds.friction_percent", "5.0"),
            ],
        ),
        // A motor axis that goes forwards alone, with its load and a tick of delay.
        (
            "motor_pid",
            &[
                ("reference", "{ramp={rate_deg_s=2.0}}"),
                ("law", "{pd={kp_v_rad=500.0,kd_v_s_rad=8.0}}"),
                ("output.lowest_v", "-0.4"),
                ("output.highest_v", "4.0"),
                ("velocity.smoothed_derivative.smoothing", "0.5"),
                ("rig.delay_ticks", "1"),
                ("model.drive_torque_nm", "-0.002"),
                ("rig.drive.table.points_s_nm", "[[0.0, -0.002]]"),
                ("bounds.friction_percent", "5.0"),
                ("bounds.motor_gain_percent", "3.0"),
                ("bounds.inertia_percent", "3.0"),
            ],
        ),
    ] {
        let scenario = scenario(name, set);
        let setup = setup(&scenario);
        assert!(largest(&stability(&setup).unwrap()) < 1.0);
        let options = Options { patient: !setup.law.remembers(), ..options };
        let found = search(&setup, &options, false);
        assert!(found.complete(), "{name}: {:?}", found.open);
        let bound = checker::check(&found.certificate).unwrap_or_else(|e| panic!("{e}")).error_bound;
        let seen = (0..54).map(|seed| error(&scenario, &setup, seed)).fold(0.0, f64::max);
        // Feed-forward or an integral leaves little to see, and as much to prove.
        let most = if name == "bench_pid_2" { 5.0 } else { 3.0 };
        assert!(seen <= bound && bound < most * seen, "{name}: {seen} rad seen, {bound} certified");
    }
}

/// A law that does its worst with a brake's, or a motor's, voltages.
fn adversary(spec: &RunSpec<'_>, way: Way, seed: u64) -> Adversary {
    let [lowest, highest] = [spec.output.lowest, spec.output.highest];
    let motor = spec.model.actuator.kind().drives_above_0();
    Adversary { way, seed, lowest, highest, motor, slope: spec.shell.slope }
}

#[test]
fn whatever_law_is_within_a_shell_of_a_motor_axis_does_not_break_its_bound() {
    let scenario = scenario(
        "motor_pid",
        &[
            ("reference", "{ramp={rate_deg_s=2.0}}"),
            ("output.lowest_v", "-0.5"),
            ("output.highest_v", "3.0"),
            ("velocity.smoothed_derivative.smoothing", "0.2"),
            ("model.friction.stribeck.stribeck_velocity_rad_s", "0.003"),
            ("bounds.friction_percent", "5.0"),
            ("shell.slope_1_s", "50.0"),
            ("shell.boundary_rad_s", "0.2"),
        ],
    );
    let (bound, worst) = bound_and_worst(&scenario, 2.0);
    assert!(bound < 2.5 * worst, "{worst} rad seen, {bound} certified");
}

/// The certified bound of a shell, and the largest error of runs of so many seconds with laws that do their worst within; no error
/// exceeds the bound.
fn bound_and_worst(scenario: &Scenario, seconds: f64) -> (f64, f64) {
    let setup = setup(scenario);
    let found = search(&setup, &Options { refinements: 0, ..Options::default() }, false);
    assert!(found.complete(), "{:?}: {:?}", setup.law, found.open);
    let bound = checker::check(&found.certificate).unwrap_or_else(|e| panic!("{e}")).error_bound;
    let mut worst = 0.0_f64;
    for seed in 0..63 {
        let mut spec = spec(scenario, &setup, seed);
        spec.run.duration = seconds;
        let way = Way::ALL[(seed % 7) as usize];
        let servo = Servo::with_law(&spec.servo().unwrap(), adversary(&spec, way, seed)).unwrap();
        let seen = simulate_servo(&spec, &servo, Keep::Figures, UNWATCHED).unwrap().metrics.max_error_rad;
        assert!(seen <= bound, "{:?}, {way:?}, seed {seed}: {seen} rad seen, {bound} certified", setup.law);
        worst = worst.max(seen);
    }
    (bound, worst)
}

#[test]
fn whatever_law_is_within_a_shell_does_not_break_its_bound() {
    for (slope, delay, friction, bar) in
        [("100.0", "0", "0.0", 0.115), ("100.0", "0", "10.0", 0.13), ("50.0", "1", "0.0", 0.5)]
    {
        let scenario = scenario(
            "bench_pid_2",
            &[
                ("rig.base", "paper"),
                ("rig.delay_ticks", delay),
                ("bounds.friction_percent", friction),
                ("velocity.smoothed_derivative.smoothing", "1.0"),
                ("shell.slope_1_s", slope),
                ("shell.boundary_rad_s", "0.1"),
            ],
        );
        let sampled = scenario.sampled(&scenario.plan().unwrap().bounds);
        assert!(sampled.any_law() && sampled.bound_suffices() && sampled.stability.is_some());
        let (bound, worst) = bound_and_worst(&scenario, 1.5);
        assert!(bound.to_degrees() <= bar, "{slope} 1/s: {}°", bound.to_degrees());
        assert!(bound < 2.0 * worst, "{slope} 1/s: {worst} rad seen, {bound} certified");
        // Without the shell the worst law does not stay near.
        let mut spec = spec(&scenario, &setup(&scenario), 0);
        spec.shell.boundary = 0.0;
        let servo = Servo::with_law(&spec.servo().unwrap(), adversary(&spec, Way::Nothing, 0)).unwrap();
        let run = simulate_servo(&spec, &servo, Keep::Figures, UNWATCHED).unwrap();
        assert!(run.metrics.max_error_rad > 100.0 * bound);
    }
}

#[test]
fn what_the_sampled_certificate_does_not_cover_is_said_by_name() {
    for (name, key) in [("ctc_2", "(law)"), ("observer_smc_2", "(velocity)"), ("minimum_jerk", "(reference)")]
    {
        let scenario = scenario(name, &[]);
        let why = scenario.sampled_setup(&scenario.plan().unwrap().bounds).unwrap_err().to_string();
        assert!(why.contains(key), "{name}: {why}");
    }
    let filtered = scenario("bench_pid_2", &[("law.pid.derivative_time_s", "0.002")]);
    let why = filtered.sampled_setup(&filtered.plan().unwrap().bounds).unwrap_err().to_string();
    assert!(
        why.contains(
            "(law); it covers PD (4), SMC (31), with boundary layer, PID without derivative_time_s, and"
        ),
        "{why}"
    );
    let fed = scenario("bench_pid_2", &[("law.pid.ki_v_rad_s", "0.0"), ("law.pid.bias_v", "20.0")]);
    let why = fed.sampled_setup(&fed.plan().unwrap().bounds).unwrap_err().to_string();
    assert!(why.contains("a law's 20 V without an error, beyond the limits (output)"), "{why}");
    let ramp = ("reference", "{ramp={rate_deg_s=2.0}}");
    for (set, said) in [
        (
            &[ramp][..],
            "-10 V at a motor, which may turn the shaft round: friction surely holds it from -0.597 V on",
        ),
        (
            &[ramp, ("model.actuator.motor.load_share", "0.1"), ("rig.actuator.motor.load_share", "0.1")],
            "load_share",
        ),
        (
            &[ramp, ("law", "{smc={}}"), ("output.lowest_v", "-0.3")],
            "SMC (31), with boundary layer (law); it covers PD (4), PID without derivative_time_s, and any",
        ),
    ] {
        let motor = scenario("motor_pid", set);
        let why = motor.sampled_setup(&motor.plan().unwrap().bounds).unwrap_err().to_string();
        assert!(why.contains(said), "{why}");
    }
    let delayed = scenario("pd_2", &[("rig.delay_ticks", "4")]);
    assert!(
        delayed.sampled_setup(&delayed.plan().unwrap().bounds).unwrap_err().to_string().contains("4 ticks")
    );
}

/// Each refusal names the key that the reader then changes: one that exists, and that is what it is about.
#[test]
fn a_part_that_is_not_covered_is_named_by_a_key_that_there_is() {
    let ramp = ("reference", "{ramp={rate_deg_s=2.0}}");
    let brake = "{brake={gain_nm_v=0.06, preload_nm=0.05}}";
    let both = "{both={brake_gain_nm_v=0.14, motor_gain_nm_v=0.05}}";
    let lugre = "{lugre={}}";
    type Case<'a> = (&'a str, &'a [(&'a str, &'a str)], &'a str);
    let cases: &[Case<'_>] = &[
        ("ctc_2", &[], "law"),
        ("observer_smc_2", &[], "velocity"),
        ("minimum_jerk", &[], "reference"),
        ("pd_2", &[("reference.ramp.rate_deg_s", "0.0")], "reference.ramp.rate_deg_s"),
        (
            "pd_2",
            &[("model.actuator", both), ("rig.actuator", both), ("output.lowest_v", "-1.0")],
            "model.actuator",
        ),
        ("pd_2", &[("model.actuator", brake), ("rig.actuator", brake)], "model.actuator.brake.preload_nm"),
        ("pd_2", &[("model.friction", lugre), ("rig.friction", lugre)], "model.friction"),
        (
            "motor_pid",
            &[ramp, ("model.actuator.motor.load_share", "0.1"), ("rig.actuator.motor.load_share", "0.1")],
            "model.actuator.motor.load_share",
        ),
        ("motor_pid", &[ramp], "output.lowest_v"),
        ("bench_pid_2", &[("law.pid.ki_v_rad_s", "0.0"), ("law.pid.bias_v", "20.0")], "output"),
        ("pd_2", &[("output.lowest_v", "0.5")], "output"),
        ("pd_2", &[("rig.actuator_time_constant_s", "0.001")], "rig.actuator_time_constant_s"),
        ("pd_2", &[("rig.encoder.quantised", "false")], "rig.encoder.quantised"),
        ("pd_2", &[("output.bumpless_time_s", "0.1")], "output.bumpless_time_s"),
        ("pd_2", &[("rig.delay_ticks", "4")], "rig.delay_ticks"),
        ("pd_2", &[("rig.torque_noise_nm", "0.012")], "rig.torque_noise_nm"),
    ];
    for (name, set, key) in cases {
        let scenario = scenario(name, set);
        let why = scenario.sampled_setup(&scenario.plan().unwrap().bounds).unwrap_err();
        assert_eq!(why.key, *key, "{name}, {set:?}: {why}");
        let mut at = scenario.table();
        for part in key.split('.') {
            match at.get(part) {
                Some(toml::Value::Table(within)) => at = within,
                Some(_) => break,
                // A key without a default is none of a written scenario, but of the schema.
                None => assert!(scenario.meaning(key).is_some(), "{key}"),
            }
        }
    }
}

#[test]
fn a_converter_that_rounds_nothing_gives_all_of_the_output_and_a_noise_beyond_the_drive_is_not_covered() {
    let setup = |set: &[(&str, &str)]| {
        let scenario = scenario("pd_2", set);
        scenario.sampled_setup(&scenario.plan().unwrap().bounds)
    };
    assert!((setup(&[]).unwrap().volts[1] - 10.0 * 2047.0 / 2048.0).abs() < 1e-12);
    assert_eq!(setup(&[("rig.dac.quantised", "false")]).unwrap().volts, [0.0, 10.0]);
    // Four times the root mean square: 0.046 and 0.048 N m against a drive of 0.047.
    assert!(setup(&[("rig.torque_noise_nm", "0.0115")]).is_ok());
    assert_eq!(setup(&[("rig.torque_noise_nm", "0.012")]).unwrap_err().key, "rig.torque_noise_nm");
}

#[test]
fn certify_saves_a_certificate_checks_it_and_refuses_it_for_another_loop() {
    let file = std::env::temp_dir().join(format!("clutch-sampled-{}.json", std::process::id()));
    let run = |args: &[&str]| {
        let output = Command::new(command()).args(["certify", "pd_2"]).args(args).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        (output.status.code(), text, String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let path = file.to_str().unwrap();
    let (code, text, _) = run(&["--sampled", "--save", path]);
    assert_eq!(code, Some(0), "{text}");
    for said in [
        "continuous time: certified",
        "as sampled: |e| stays below 0.0",
        "linearly stable",
        "sticks: not excluded",
    ] {
        assert!(text.contains(said), "{text}");
    }
    let (code, again, _) = run(&["--check", path]);
    assert_eq!((code, format!("{again}wrote {path}\n")), (Some(0), text));
    let (code, _, told) = run(&["--check", path, "--set", "law.pd.kp_v_rad=4999"]);
    assert!(code == Some(1) && told.contains("law: ") && told.contains("4999"), "{told}");
    let (code, text, _) = run(&["--sampled", "--set", "rig.delay_ticks=1"]);
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("UNSTABLE: spectral radius 1.057"), "{text}");
    assert!(text.contains("no bound is looked"), "{text}");
    std::fs::remove_file(file).unwrap();
}
