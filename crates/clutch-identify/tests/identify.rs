//! Estimates of shafts that the estimators know nothing of, and refusals.

use clutch_identify::experiment::{PartRunner, Programme, experiment, remedy};
use clutch_identify::recording::Scale;
use clutch_identify::release::{fall, releases};
use clutch_identify::rig_file::rig_file;
use clutch_identify::{DAMPINGS, Finding, Recorded, Recording, Report, RigFile, believed, identify};
use clutch_sim::Scenario;

#[path = "../examples/random_rig/mod.rs"]
#[allow(dead_code, reason = "its motors are of other tests")]
mod random_rig;
use random_rig::unlike::{Unlike, recordings as unlike};
use random_rig::waves;

/// A rig that is not as the scenario's model has it: T/J, v_hold, μ_s/μ_d, C/J follow.
const RIG: &str = r#"
name = "unlike Table 1"
[rig]
base = "bench"
delay_ticks = 1
inertia_kg_m2 = 0.0014
viscous_damping_nm_s_rad = 0.0021
[rig.friction.stribeck]
mu_static = 0.185
mu_dynamic = 0.118
stribeck_velocity_rad_s = 0.002
[rig.ripple]
rms = 0.08
[law.smc]
[reference.ramp]
rate_deg_s = 2.0
[bounds]
friction_percent = 60.0
inertia_percent = 40.0
drive_torque_percent = 25.0
viscous_damping_percent = 99.0
[run]
seed = 77
start = "rest"
[safety]
reason = "a weight drives the shaft"
[safety.on_fault.hold]
volts_v = 9.99
"#;

fn recordings(set: &[(&str, &str)]) -> Vec<Recording> {
    let set: Vec<(String, String)> = set.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    let scenario = Scenario::parse("rig", RIG, &set).unwrap();
    let mut runner = PartRunner::default();
    experiment(&scenario, &Programme::default(), &mut |name, part| runner.run(name, part)).unwrap()
}

fn assert_known(finding: &Finding, truth: f64, within: f64) {
    let e = finding.known().unwrap_or_else(|| panic!("{finding:?}"));
    assert!(e.holds(truth), "{truth}: {e:?}");
    assert!((e.value - truth).abs() <= within, "{truth} ± {within}: {e:?}");
    assert!(e.low < e.value && e.value < e.high, "{e:?}");
}

fn refusal(finding: &Finding) -> &str {
    match finding {
        Finding::Refused(why) => why,
        Finding::Known(e) => panic!("{e:?}"),
    }
}

fn part<'a>(all: &'a [Recording], name: &str) -> Vec<&'a Recording> {
    all.iter().filter(|r| r.name == name).collect()
}

fn of(all: &[Recording], names: &[&str]) -> Report {
    let some: Vec<Recording> = names.iter().flat_map(|name| part(all, name)).cloned().collect();
    identify(&some)
}

#[test]
fn a_hidden_rig_is_found_and_what_a_log_does_not_show_is_refused() {
    let all = recordings(&[]);
    let torque = 0.2094 * 9.81 * 0.024;
    let hold = torque / (0.118 * 0.14);
    let report = identify(&all);
    assert_known(&report.pull, torque / 0.0014, 0.01 * torque / 0.0014);
    assert_known(&report.delay, 1e-3, 0.15e-3);
    assert_known(&report.hold, hold, 0.004 * hold);
    assert_known(&report.ripple, 0.08, 0.01);
    assert_known(&report.ratio, 0.185 / 0.118, 0.05);
    assert_known(&report.damping, 1.5, 0.4);
    assert!(report.unexplained.is_empty(), "{:?}", report.unexplained);
    assert!(refusal(&report.each).contains("mass"));

    // Part by part: no estimate without its experiment, and the experiment has a name.
    let no_fall = of(&all, &["crawl", "ride_5", "ride_60"]);
    assert!(refusal(&no_fall.pull).contains("0 V for 30 ms"), "{no_fall:?}");
    assert!(refusal(&no_fall.hold).contains("releases"), "{no_fall:?}");
    let one_rate = of(&all, &["releases", "ride_5"]);
    assert!(refusal(&one_rate.damping).contains("60 °/s"), "{one_rate:?}");
    assert_known(&one_rate.hold, hold, 0.01 * hold);
    assert!(refusal(&one_rate.ratio).contains("crawl"), "{one_rate:?}");
    assert!(refusal(&one_rate.stribeck).contains("break-aways"), "{one_rate:?}");
}

/// A dead time of one period beside a lag: releases from two voltages determine both, and neither spoils what else is found.
#[test]
fn a_lag_is_told_apart_from_a_dead_time() {
    let torque = 0.2094 * 9.81 * 0.024;
    let hold = torque / (0.118 * 0.14);
    let scenario = Scenario::parse("rig", RIG, &[]).unwrap();
    let lag_of = |all: &[Recording]| -> Report {
        let report = identify(all);
        assert_known(&report.pull, torque / 0.0014, 0.01 * torque / 0.0014);
        assert_known(&report.hold, hold, 0.01 * hold);
        assert_known(&report.ratio, 0.185 / 0.118, 0.1);
        assert_known(&report.damping, 1.5, 0.4);
        report
    };
    for lag in [0.001, 0.0025] {
        let all = recordings(&[("rig.actuator_time_constant_s", &lag.to_string())]);
        let report = lag_of(&all);
        assert_known(&report.lag, lag, 0.25 * lag);
        assert_known(&report.delay, 1e-3 + lag, 0.5e-3);
        assert!(report.unexplained.is_empty(), "{:?}", report.unexplained);
        // The rig that is believed in has both.
        let file = RigFile::parse("rig.toml", &rig_file(&report, &scenario).unwrap()).unwrap();
        let rig = believed(&scenario, Some(&file)).unwrap().scenario.params().rig.clone();
        assert_eq!(
            (rig.delay_ticks, rig.actuator_time_constant),
            (1, Some(report.lag.known().unwrap().value))
        );
        // From one voltage they are one.
        let one = of(&all, &["releases", "crawl", "ride_5", "ride_60"]);
        assert!(refusal(&one.lag).contains("from a voltage higher or lower"), "{:?}", one.lag);
    }
    let without = lag_of(&recordings(&[]));
    let none = without.lag.known().unwrap();
    assert!(none.low <= 0.0 && none.high < 0.2e-3, "{none:?}");
    let file = RigFile::parse("rig.toml", &rig_file(&without, &scenario).unwrap()).unwrap();
    let lagging =
        Scenario::parse("rig", RIG, &[("rig.actuator_time_constant_s".into(), "0.002".into())]).unwrap();
    let rig = believed(&lagging, Some(&file)).unwrap().scenario.params().rig.clone();
    assert_eq!((rig.delay_ticks, rig.actuator_time_constant), (1, None));
}

/// The filter of the rides takes waves of a ripple that the encoder sees.
#[test]
fn an_encoder_that_sees_no_short_wave_is_enough() {
    let torque = 0.2094 * 9.81 * 0.024;
    let hold = torque / (0.118 * 0.14);
    let report = identify(&recordings(&[("rig.encoder.counts_per_rev", "5000")]));
    assert_known(&report.pull, torque / 0.0014, 0.02 * torque / 0.0014);
    let told = report.hold.known().expect("rides").value;
    assert!((told - hold).abs() < 0.003 * hold, "{told} for {hold}");
}

/// Ripples of one wave that the law glide does not believe in; on a disc of 900 the shaft nearly stops at 5 °/s.
#[test]
fn a_ripple_of_other_waves_is_seen_as_what_it_is() {
    let torque = 0.2094 * 9.81 * 0.024;
    let hold = torque / (0.118 * 0.14);
    for (n, ripple) in [(30, "0.14"), (650, "0.1"), (900, "0.12")] {
        let keys = waves(n, n, n);
        let mut set: Vec<(&str, &str)> = keys.iter().map(|(k, v)| (k.as_str(), v.as_str())).collect();
        set.push(("rig.ripple.rms", ripple));
        let report = identify(&recordings(&set));
        assert_known(&report.hold, hold, 0.01 * hold);
        assert_known(&report.damping, 0.0021 / 0.0014, 0.3);
        assert_known(&report.pull, torque / 0.0014, 0.01 * torque / 0.0014);
        the_believed_disc_has_these_waves(&report, n);
        assert_eq!(report.unexplained.is_empty(), n != 900, "{:?}", report.unexplained);
        if n == 900 {
            assert!(
                report.unexplained[0].contains("ride_5: the shaft nearly stops"),
                "{:?}",
                report.unexplained
            );
            assert_eq!(report.found.2.len(), 2, "{:?}", report.found);
        }
    }
}

fn the_believed_disc_has_these_waves(report: &Report, n: u32) {
    // Four steps to the octave.
    let near = |waves: f64| (waves / f64::from(n)).log2().abs() < 0.25;
    assert!(report.waves.is_some_and(near), "{:?} for {n}", report.waves);
    let scenario = Scenario::parse("rig", RIG, &[]).unwrap();
    let file = RigFile::parse("rig.toml", &rig_file(report, &scenario).unwrap()).unwrap();
    assert_eq!(file.waves, report.waves);
    let ripple = believed(&scenario, Some(&file)).unwrap().scenario.spec().rig.ripple.expect("a ripple");
    let number = (ripple.highest - ripple.lowest) / ripple.spacing + 1;
    assert!(near(0.5 * f64::from(ripple.lowest + ripple.highest)) && number == 4, "{ripple:?}");
}

/// Between two delays that are tried a shaft goes on by counts of a fine encoder.
#[test]
fn a_steady_torque_is_one_under_a_fine_encoder() {
    let torque = 0.2094 * 9.81 * 0.024;
    for counts in ["65536", "200000"] {
        let all = recordings(&[("rig.encoder.counts_per_rev", counts)]);
        let report = of(&all, &["releases"]);
        assert_known(&report.pull, torque / 0.0014, 0.003 * torque / 0.0014);
        assert_known(&report.delay, 1e-3, 0.05e-3);
    }
}

#[test]
fn a_coarse_encoder_under_a_narrow_jump_is_part_of_the_remedy() {
    let with = |counts: &str| {
        let set = [("rig.encoder.counts_per_rev".to_owned(), counts.to_owned())];
        remedy(&Scenario::parse("rig", RIG, &set).unwrap())
    };
    let said = "safety.limits.jump_deg = 0.15 is 1.7 counts of this encoder";
    assert!(with("4096").contains(said) && with("4096").ends_with("as 0.27"), "{}", with("4096"));
    assert!(!with("20000").contains("jump_deg"), "{}", with("20000"));
}

/// A ride whose rate comes down to that of another is not ridden twice, and none becomes shorter.
#[test]
fn a_limit_lowers_the_rates_of_the_rides() {
    for (fastest, rides) in [
        (5.0, vec![(5.0, 10.0)]),
        (10.0, vec![(10.0, 7.0), (5.0, 10.0)]),
        (20.0, vec![(20.0, 7.0), (5.0, 10.0)]),
        (30.0, vec![(20.0, 7.0), (5.0, 10.0), (30.0, 5.0)]),
        (60.0, vec![(20.0, 7.0), (5.0, 10.0), (60.0, 5.0)]),
    ] {
        assert_eq!(Programme::within(Some(fastest)).unwrap().rides, rides);
    }
}

/// Steps of the converter are no ripple.
#[test]
fn an_even_disc_may_have_none() {
    let report = identify(&recordings(&[("rig.ripple.rms", "0.0")]));
    let ripple = report.ripple.known().expect("rides");
    assert!(ripple.holds(0.0) && ripple.high < 0.02, "{ripple:?}");
}

#[test]
fn a_count_that_no_fall_explains_is_named() {
    let all = recordings(&[]);
    let mut bad: Vec<Recording> = part(&all, "releases").into_iter().cloned().collect();
    let found = releases(&bad[0]);
    assert_eq!(found.len(), 12);
    assert!(fall(&found, DAMPINGS, None).is_ok());
    // The fifth release loses ten counts on its way.
    let first = found[4].place.1 as usize;
    for tick in &mut bad[0].ticks[first + 20..] {
        tick.counts -= 10;
    }
    let at = fall(&releases(&bad[0]), DAMPINGS, None).unwrap_err();
    assert_eq!(at.name, "releases");
    assert!((first..first + 40).contains(&(at.tick as usize)), "{at:?} for {first}");
    let report = identify(&bad);
    assert!(refusal(&report.pull).contains(&format!("tick {}", at.tick)), "{report:?}");
}

#[test]
fn a_rig_that_is_unlike_the_model_is_refused_with_its_cause_and_the_experiment_that_tells_it() {
    let of = |kind, seed| {
        let (truth, parts) = unlike(kind, seed).unwrap();
        (truth, identify(&parts.unwrap()))
    };
    for kind in [Unlike::Ramp, Unlike::Hand] {
        let (_, report) = of(kind, 201);
        for finding in [&report.pull, &report.hold, &report.ratio, &report.stribeck, &report.damping] {
            let why = refusal(finding);
            assert!(why.contains("a torque that varies") && why.contains("a weight"), "{kind:?}: {why}");
        }
    }
    let (truth, report) = of(Unlike::Stiff, 205);
    let why = refusal(&report.hold);
    assert!(why.contains("the later the slower") && why.contains("bristles"), "{why}");
    assert_eq!((refusal(&report.ratio), report.map.len()), (why, 0));
    assert_known(&report.pull, truth.pull, 0.01 * truth.pull);
    let (truth, report) = of(Unlike::Runout, 201);
    assert!(report.unexplained[0].contains("not square to its shaft"), "{:?}", report.unexplained);
    assert_known(&report.hold, truth.hold, 0.1 * truth.hold);
    assert!(report.hold.known().unwrap().share() > 0.02, "{:?}", report.hold);
}

#[test]
fn tables_of_others_are_read_and_their_mistakes_named() {
    let scale = Scale { period: 0.001, counts_per_rev: 20_000, motor: false, volts: (-1.0, 11.0) };
    let read = |text: &str| Recording::from_csv("t.csv", text, ("n", "u"), &scale);
    let good = read("t,n,u\n0,0,4.5\n1,1,4.5\n2,3,4.4\n").unwrap();
    assert_eq!(good.ticks[2], Recorded { counts: 3, volts: 4.4 });
    assert!((good.step_volts - 0.1).abs() < 1e-12);
    for (text, said) in [
        ("t,m,u\n0,0,4.5\n", "t.csv: has no column \"n\": expected one of: t, m, u"),
        ("n,u\n0,4.5\n0.5,4.5\n", "t.csv: line 3: counts = 0.5: expected a whole number of counts"),
        ("n,u\n0,4.5\n1,high\n", "t.csv: line 3, column \"u\" = \"high\": expected a number"),
        (
            "n,u\n0,4.5\n1,4500\n",
            "t.csv: line 3, column \"u\" = 4500: expected volts within output.lowest_v and output.highest_v of the scenario, and not far \
             beyond: -1 to 11",
        ),
        ("n,u\n0,inf\n", "t.csv: line 2, column \"u\" = \"inf\": expected a number"),
        ("n,u\n0,4.5\n", "t.csv: has no samples under control"),
        (
            "n,u\n0,4.5\n1,4.5\n-20000,4.5\n2,4.5\n",
            "t.csv: line 4: counts go on by -20001 in one period: expected at most half a turn, 10000",
        ),
    ] {
        assert_eq!(read(text).unwrap_err().to_string(), said);
    }
    // A counter of 32 bits that wraps goes on; a weight that turns the shaft backwards turns the recording.
    let counts = |text: &str| read(text).unwrap().ticks.iter().map(|t| t.counts).collect::<Vec<_>>();
    assert_eq!(counts("n,u\n2147483647,4.5\n-2147483648,4.5\n"), [2_147_483_647, 2_147_483_648]);
    assert_eq!(counts("n,u\n0,4.5\n-1,4.5\n-3,4.5\n"), [-1, 0, 2]);
}

#[test]
fn nothing_panics_on_recordings_that_make_no_sense() {
    use rand::{RngExt, SeedableRng};
    let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
    for n in [2_usize, 3, 50, 3000] {
        for _ in 0..20 {
            let mut counts = 0;
            let ticks = (0..n).map(|_| {
                counts += rng.random_range(-2..=40_i64) * i64::from(rng.random_bool(0.3));
                let volts = [0.0, 2.0, -1.0, rng.random_range(-10.0..10.0)][rng.random_range(0..4)];
                Recorded { counts, volts }
            });
            let ticks = ticks.collect();
            let recording = Recording {
                name: "noise".to_owned(),
                motor: false,
                period: 0.001,
                counts_per_rev: 20_000,
                step_volts: 0.005,
                volts_before: 3.0,
                glides_at: None,
                first_tick: 0,
                ticks,
            };
            let _ = identify(&[recording.clone(), recording]);
        }
    }
}
