//! Stick-slip as a loop on hardware knows it, against the simulator's events. docs/meter.md has the whole table, by
//! `cargo xtask meter`; these are some of its cells, with fewer discs.

use clutch_sim::detected::Verdict;
use clutch_sim::progress::UNWATCHED;
use clutch_sim::{Keep, Run, Scenario};
use toml::Value;

/// A built-in scenario at a rate, on a disc, with keys changed.
fn run(name: &str, rate_deg_s: f64, seed: i64, keys: &[(&str, Value)]) -> Run {
    let base = clutch_sim::scenario::BUILT_IN.iter().find(|b| b.name == name).unwrap();
    let mut set = vec![
        ("reference.ramp.rate_deg_s".to_owned(), Value::Float(rate_deg_s)),
        ("run.seed".to_owned(), Value::Integer(seed)),
    ];
    set.extend(keys.iter().map(|(key, value)| ((*key).to_owned(), value.clone())));
    let scenario = Scenario::from_table(name, base.toml.parse().unwrap(), &set).unwrap();
    scenario.run(Keep::Trace, UNWATCHED).unwrap()
}

/// Cycles of a run in truth, at least and at most.
fn cycles(run: &Run) -> [f64; 3] {
    let d = &run.detected;
    let [least, most] = [d.least_cycles_per_s, d.most_cycles_per_s].map(Option::unwrap);
    [run.metrics.stick_slip_cycles_per_s, least, most].map(|x| x * run.metrics.measured_s)
}

#[test]
fn the_truth_lies_between_the_bounds_on_every_disc() {
    let (mut all, mut sure) = (0.0, 0.0);
    for name in ["pd_2", "smc_2", "bench_pd_2", "bench_smc_2", "bench_glide_2"] {
        for rate in [0.5, 2.0, 4.0, 10.0, 20.0] {
            for seed in 1..=3 {
                let run = run(name, rate, seed, &[]);
                let [truth, least, most] = cycles(&run);
                // The end of the run may cut one off, whose gap nobody saw the end of.
                assert!(least <= truth + 0.01 && truth <= most + 1.01, "{name}, {rate} °/s, {seed}: {run:?}");
                all += truth;
                sure += least;
            }
        }
    }
    assert!(all > 3_000.0 && sure > 1_000.0, "{sure} sure of {all}");
}

/// Of micro-steps a coarse count holds several: counts show that the shaft has stuck, and no more.
#[test]
fn micro_steps_are_a_lower_bound_and_no_number() {
    let micro = |below: f64| ("law.glide.micro_below_deg_s", Value::Float(below));
    for (rate, counts) in [(0.1, 20_000), (0.5, 20_000), (0.5, 200_000)] {
        let encoder = ("rig.encoder.counts_per_rev", Value::Integer(counts));
        let run = run("bench_glide_2", rate, 3, &[micro(0.95), encoder]);
        let Verdict::AtLeast(least) = run.detected.verdict() else {
            panic!("{rate} °/s, {counts}: {:?}", run.detected)
        };
        let truth = run.metrics.stick_slip_cycles_per_s;
        // A step of half a coarse count goes over several fine ones, each of which shows it.
        let hidden = if counts > 20_000 { 1.0 } else { 1.1 };
        assert!(least > 1.0 && truth >= hidden * least, "{rate} °/s, {counts}: {truth} of at least {least}");
        assert_eq!(run.detected.most_cycles_per_s, None);
        assert!(run.detected.reason().unwrap().contains("micro-steps"), "{:?}", run.detected.reason());
    }
    // Above the rate below which there are any it slides, and a number is told.
    assert_eq!(run("bench_glide_2", 2.0, 3, &[micro(0.95)]).detected.verdict(), Verdict::Told(0.0));
}

/// A motor turns a shaft round within a count, to and fro, and it never sticks: no voltage says that it surely did.
#[test]
fn a_motor_that_turns_a_shaft_round_within_a_count_is_no_sure_stick() {
    let pd = |kp: f64, kd: f64| {
        let gains = format!("law = {{ pd = {{ kp_v_rad = {kp:?}, kd_v_s_rad = {kd:?} }} }}\n");
        ("law", gains.parse::<toml::Table>().unwrap()["law"].clone())
    };
    let ramp = |rate: f64| {
        let path = format!("x = {{ ramp = {{ rate_deg_s = {rate:?} }} }}\n");
        ("reference", path.parse::<toml::Table>().unwrap()["x"].clone())
    };
    let mut turned = 0;
    for (gains, counts) in [(pd(5000.0, 50.0), 20_000), (pd(5000.0, 50.0), 2_000), (pd(800.0, 41.0), 2_000)] {
        for rate in [5.0, 10.0, 20.0] {
            let keys = [
                gains.clone(),
                ramp(rate),
                ("rig.encoder.counts_per_rev", Value::Integer(counts)),
                ("safety.limits.jump_deg", Value::Float(1.5)),
                ("run.duration_s", Value::Float(5.0)),
            ];
            let run = run("motor_pid", rate, 1, &keys);
            let [truth, least, most] = cycles(&run);
            assert!(
                least <= truth + 0.01 && truth <= most + 1.01,
                "{rate} °/s: {truth} in {least} to {most}"
            );
            turned += usize::from(run.trace.velocity.iter().any(|v| *v < 0.0));
        }
    }
    assert!(turned > 3, "{turned} runs turn round");
}

/// A silence that began before the settling time counts from there on.
#[test]
fn the_time_stuck_that_the_encoder_shows_is_no_more_than_the_whole() {
    let hold = "x = { hold = {} }".parse::<toml::Table>().unwrap()["x"].clone();
    let keys = [
        ("law", hold),
        ("run.start", Value::String("rest".to_owned())),
        ("run.settle_s", Value::Float(0.2)),
        ("run.duration_s", Value::Float(2.0)),
    ];
    for rate in [0.05, 0.1, 0.15, 0.5] {
        let share = run("smc_2", rate, 1, &keys).detected.stick_time_fraction;
        assert!((0.9..=1.0).contains(&share) || rate < 0.1 && share <= 1.0, "{rate} °/s: {share}");
    }
}

#[test]
fn a_stick_in_each_count_shows_no_silence_and_the_voltage_tells_it() {
    // Even edges, 36 ms apart, and a stick in every one of them.
    let run = run("pd_2", 0.5, 1, &[]);
    let [truth, ..] = cycles(&run);
    assert!(truth > 100.0, "{truth}");
    assert_eq!(run.detected.stick_slip_cycles_per_s, 0.0);
    let Verdict::Told(told) = run.detected.verdict() else { panic!("{:?}", run.detected) };
    assert!((told * run.metrics.measured_s - truth).abs() <= 0.05 * truth, "{told} {truth}");
}

#[test]
fn with_a_tenth_of_the_counts_it_says_that_it_cannot_tell() {
    // A count takes 0.36 s: friction along the disc changes within it as much as the voltage does.
    let run = run("bench_pd_2", 0.5, 1, &[("rig.encoder.counts_per_rev", Value::Integer(2_000))]);
    let [truth, ..] = cycles(&run);
    assert!(truth > 5.0 && run.detected.stick_slip_cycles_per_s == 0.0, "{run:?}");
    assert_eq!(run.detected.verdict(), Verdict::CannotTell);
    assert_eq!(run.detected.words(), "cannot tell");
    assert!(run.detected.reason().is_some());
}

#[test]
fn of_smooth_motion_it_says_that_there_is_none() {
    for (rate, seed) in [(2.0, 1), (4.0, 1), (20.0, 1), (20.0, 3001)] {
        let run = run("bench_glide_2", rate, seed, &[]);
        assert_eq!(run.metrics.stick_slip_cycles_per_s, 0.0);
        assert_eq!(run.detected.verdict(), Verdict::Told(0.0), "{rate} °/s, {seed}: {:?}", run.detected);
        assert_eq!((run.detected.words(), run.detected.reason()), ("0".into(), None));
    }
}

#[test]
fn stairs_are_silences_in_which_the_shaft_fell_a_count_behind() {
    // At 2 °/s PD sticks for two and three counts; at 10 °/s for less.
    let slow = run("bench_pd_2", 2.0, 1, &[]);
    assert!(slow.detected.stairs_per_s > 10.0, "{:?}", slow.detected);
    assert!(slow.detected.stairs_per_s <= slow.detected.stick_slip_cycles_per_s, "{:?}", slow.detected);
    let smooth = run("bench_glide_2", 2.0, 1, &[]);
    assert_eq!(smooth.detected.stairs_per_s, 0.0);
}
