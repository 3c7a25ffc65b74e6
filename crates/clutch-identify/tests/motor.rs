//! Estimates of motor axes that the estimators know nothing of, and refusals.

use clutch_core::ActuatorKind;
use clutch_identify::experiment::PartRunner;
use clutch_identify::motor::Report;
use clutch_identify::{Consent, Estimate, Experiment, Finding, Identified, Recording, RigFile};
use clutch_sim::Scenario;

#[path = "../examples/random_rig/mod.rs"]
#[allow(dead_code, reason = "its brakes are of other tests")]
mod random_rig;
use random_rig::motor::{Truth, truth, truth_with};
use random_rig::waves;

fn recordings(truth: &Truth) -> Vec<Recording> {
    let experiment = Experiment::of(&truth.scenario, &Consent::default()).unwrap();
    let mut runner = PartRunner::default();
    experiment.run(&truth.scenario, &mut |name, part| runner.run(name, part)).unwrap()
}

fn of(recordings: &[Recording]) -> Report {
    match Identified::of(recordings).unwrap() {
        Identified::Motor(report) => report,
        Identified::Brake(_) => panic!("a brake"),
    }
}

fn known(finding: &Finding, truth: f64, within: f64) -> Estimate {
    let e = finding.known().unwrap_or_else(|| panic!("{finding:?}"));
    assert!(e.holds(truth), "{truth}: {e:?}");
    assert!((e.value - truth).abs() <= within, "{truth} ± {within}: {e:?}");
    e
}

/// Both ways, at rest and sliding, within these shares of the truth.
fn friction_is_known(truth: &Truth, report: &Report, (at_rest, sliding): (f64, f64)) {
    for (way, load) in [(0, -truth.load), (1, truth.load)] {
        let _ = known(&report.at_rest[way], truth.at_rest + load, at_rest * truth.at_rest);
        let _ = known(&report.sliding[way], truth.sliding + load, sliding * truth.sliding);
    }
}

fn refusal(finding: &Finding) -> &str {
    match finding {
        Finding::Refused(why) => why,
        Finding::Known(e) => panic!("{e:?}"),
    }
}

#[test]
fn hidden_axes_are_found_and_what_a_log_does_not_show_is_refused() {
    // The first rigs of the campaign; docs/identify.md counts all of them.
    for seed in [10_001, 10_002] {
        let truth = truth(seed).unwrap();
        let all = recordings(&truth);
        let report = of(&all);
        friction_is_known(&truth, &report, (0.03, 0.01));
        let _ = known(&report.load, truth.load, 0.003);
        let _ = known(&report.viscous, truth.viscous, 0.006);
        let _ = known(&report.inertia, truth.inertia, 0.03 * truth.inertia);
        let _ = known(&report.delay, truth.delay, 0.2e-3);
        let _ = known(&report.ripple, truth.ripple, 0.02);
        assert!(refusal(&report.each).contains("known torque"));
        assert!(report.unexplained.is_empty(), "{:?}", report.unexplained);
        the_map_is_the_discs(&truth, &report);
        the_file_holds_the_rig(&truth, &report);
        parts_tell_what_they_can(&all);
    }
}

/// Of a wave as long as the crawl's way no pass knows what is mean there.
#[test]
fn cogging_of_other_waves_is_seen_as_what_it_is() {
    for n in [32, 700] {
        let truth = truth_with(10_001, &waves(n, n, n)).unwrap();
        let report = of(&recordings(&truth));
        friction_is_known(&truth, &report, (0.04, 0.02));
        assert!(
            report.waves.is_some_and(|waves| (waves / f64::from(n)).log2().abs() < 0.25),
            "{:?}",
            report.waves
        );
        let _ = known(&report.load, truth.load, 0.01);
        let _ = known(&report.viscous, truth.viscous, 0.015);
        let _ = known(&report.inertia, truth.inertia, 0.03 * truth.inertia);
    }
}

fn the_map_is_the_discs(truth: &Truth, report: &Report) {
    let rig = clutch_sim::rig::Rig::new(&truth.scenario.spec().rig, truth.scenario.spec().run.seed).unwrap();
    let disc = rig.model.ripple.as_ref().unwrap();
    let ratios: Vec<f64> = report.map.iter().map(|p| p.factor / disc.factor(p.angle)).collect();
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    let square = ratios.iter().map(|r| (r / mean - 1.0).powi(2)).sum::<f64>() / ratios.len() as f64;
    assert!(report.map.len() > 200, "{}", report.map.len());
    // A tenth of what it would be without a map.
    assert!(square.sqrt() < 0.15 * truth.ripple, "{} of {}", square.sqrt(), truth.ripple);
}

fn the_file_holds_the_rig(truth: &Truth, report: &Report) {
    let text = Identified::Motor(report.clone()).rig_file(&truth.scenario).unwrap();
    let file = RigFile::parse("rig.toml", &text).unwrap();
    let mut table = truth.scenario.table().clone();
    file.put_into(&mut table);
    let told = Scenario::from_table("told", table, &[]).unwrap();
    assert_eq!(told.spec().model.actuator.kind(), ActuatorKind::Motor);
    let bounds = told.plan().unwrap().bounds;
    let rig = truth.scenario.spec().rig;
    let holds = |i: clutch_core::Interval, x: f64| assert!((i.low..=i.high).contains(&x), "{x}: {i:?}");
    holds(bounds.inertia, rig.inertia);
    holds(bounds.viscous_damping, rig.viscous_damping);
    holds(bounds.friction_at_rest, 0.05 * truth.at_rest / bounds.preload);
    holds(bounds.friction_sliding, 0.05 * truth.sliding / bounds.preload);
    assert!(bounds.inertia.high / bounds.inertia.low < 1.1, "{:?}", bounds.inertia);
}

fn parts_tell_what_they_can(all: &[Recording]) {
    let some = |of_it: &dyn Fn(&str) -> bool| {
        of(&all.iter().filter(|r| of_it(&r.name)).cloned().collect::<Vec<_>>())
    };
    let without = |name: &str| some(&|other| !other.starts_with(name));
    // Rides set off suddenly, too.
    let no_hops = some(&|name| name == "crawl");
    assert!(refusal(&no_hops.inertia).contains("sudden voltage"), "{no_hops:?}");
    assert!(refusal(&no_hops.delay).contains("hop"), "{no_hops:?}");
    // A slow ride of an integral law breaks away slowly, too.
    let no_crawl = some(&|name| ["hops", "to_and_fro_20", "to_and_fro_60"].contains(&name));
    assert!(refusal(&no_crawl.at_rest[0]).contains("a crawl at 0.5 °/s"), "{no_crawl:?}");
    assert!(no_crawl.sliding[1].known().is_some() && no_crawl.inertia.known().is_some(), "{no_crawl:?}");
    let no_rides = without("to_and_fro");
    assert!(refusal(&no_rides.sliding[0]).contains("even rates both ways"), "{no_rides:?}");
    // Hops alone may bound J/K or not; they are not said to be missing.
    assert!(no_rides.found.0 > 10, "{no_rides:?}");
    if let Finding::Refused(why) = &no_rides.inertia {
        assert!(why.contains("rides at even rates"), "{why}");
    }
    assert!(Identified::Motor(no_rides).rig_file(&truth(1).unwrap().scenario).is_err());
}

/// An axis that turns evenly, as the built-in one does.
#[test]
fn an_even_axis_keeps_its_truth_within_the_intervals_and_a_heavy_one_is_refused() {
    let found = |set: &[(&str, f64)]| {
        let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_owned(), format!("{value:?}"))).collect();
        let scenario = Scenario::load(std::path::Path::new("motor_pid"), &set).unwrap();
        let mut runner = PartRunner::default();
        let experiment = Experiment::of(&scenario, &Consent::default()).unwrap();
        of(&experiment.run(&scenario, &mut |name, part| runner.run(name, part)).unwrap())
    };
    for v_s in [0.0006, 0.002, 0.005] {
        let report = found(&[("rig.friction.stribeck.stribeck_velocity_rad_s", v_s)]);
        let _ = known(&report.viscous, 0.02, 0.001);
        let stribeck = report.stribeck.known().expect("a fall");
        assert!(stribeck.holds(v_s) && stribeck.holds(stribeck.value), "{v_s}: {stribeck:?}");
    }
    // Rides show no friction of it, and hops alone told 0.32 V s²/rad, within 0.00002.
    let heavy = found(&[("rig.inertia_kg_m2", 0.01)]);
    assert!(refusal(&heavy.inertia).contains("rides at even rates"), "{heavy:?}");
}

#[test]
fn limits_are_held_and_bad_ones_named() {
    let truth = truth(10_003).unwrap();
    let experiment = |travel, fastest| {
        Experiment::of(&truth.scenario, &Consent { travel_deg: travel, fastest_deg_s: fastest })
    };
    for (travel, fastest, said) in [
        (Some(3.0), None, "travel = 3 °: expected 10 to 3600 °"),
        (None, Some(f64::NAN), "fastest = NaN °/s: expected 15 to 3600 °/s"),
    ] {
        assert_eq!(experiment(travel, fastest).unwrap_err().to_string(), said);
    }
    let brake = Scenario::load(std::path::Path::new("board_smc_2"), &[]).unwrap();
    let consent = Consent { travel_deg: Some(30.0), fastest_deg_s: None };
    assert!(Experiment::of(&brake, &consent).unwrap_err().to_string().starts_with("travel: is a limit"));
    let of_brake =
        |fastest| Experiment::of(&brake, &Consent { travel_deg: None, fastest_deg_s: Some(fastest) });
    let said = of_brake(61.0).unwrap_err().to_string();
    assert_eq!(said, "fastest = 61 °/s: expected 5 to 60 °/s");

    // Nowhere does the shaft leave the way that was consented to by more than the law's own error.
    let mut runner = PartRunner::default();
    let narrow = experiment(Some(12.0), Some(30.0)).unwrap();
    let all = narrow.run(&truth.scenario, &mut |name, part| runner.run(name, part)).unwrap();
    let degrees = |counts: i64| counts as f64 * 360.0 / 20_000.0;
    let counts = || all.iter().flat_map(|r| r.ticks.iter().map(|t| t.counts));
    assert!(degrees(counts().max().unwrap()) < 13.5 && degrees(counts().min().unwrap()) > -1.5);
    assert!(of(&all).inertia.known().is_some());
    let mixed = [all[0].clone(), Recording { motor: false, ..all[1].clone() }];
    assert!(Identified::of(&mixed).unwrap_err().to_string().contains("expected recordings of one rig"));
}

#[test]
fn nothing_panics_on_recordings_that_make_no_sense() {
    use clutch_identify::Recorded;
    use rand::{RngExt, SeedableRng};
    let mut rng = rand_pcg::Pcg64::seed_from_u64(6);
    for n in [2_usize, 3, 50, 3000] {
        for _ in 0..10 {
            let mut counts = 0;
            let ticks = (0..n).map(|_| {
                counts += rng.random_range(-20..=20_i64) * i64::from(rng.random_bool(0.3));
                let volts = [0.0, 2.0, -1.0, rng.random_range(-10.0..10.0)][rng.random_range(0..4)];
                Recorded { counts, volts }
            });
            let recording = Recording {
                name: "noise".to_owned(),
                motor: true,
                period: 0.001,
                counts_per_rev: 20_000,
                step_volts: 0.005,
                volts_before: 3.0,
                glides_at: None,
                first_tick: 0,
                ticks: ticks.collect(),
            };
            let _ = of(&[recording.clone(), recording]);
        }
    }
}
