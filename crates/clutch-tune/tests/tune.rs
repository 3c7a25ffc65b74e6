//! Gains for a rig: what is given out, what is refused, and that the same comes again.

use clutch_certificate::checker;
use clutch_sim::progress::UNWATCHED;
use clutch_sim::scenario::Value;
use clutch_sim::{Keep, Scenario};
use clutch_tune::{Options, Outcome, Score, Tuned, Verdict, tune};

fn scenario(set: &[(&str, &str)]) -> Scenario {
    let set: Vec<(String, String)> = set.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    let text = Scenario::text("board_smc_2".as_ref()).unwrap().1;
    Scenario::parse("rig", &text, &set).unwrap()
}

fn few() -> Options {
    Options { candidates: 2, ..Options::default() }
}

fn tuned(set: &[(&str, &str)], options: &Options) -> Tuned {
    tune(&scenario(set), None, options, UNWATCHED).unwrap()
}

#[test]
fn the_paper_rig_gets_a_certified_law_that_slides_and_the_same_again() {
    let found = tuned(&[], &few());
    let winner = found.winner().expect("a winner");
    assert_eq!((winner.name.as_str(), &winner.outcome), ("glide in a shell", &Outcome::Chosen));
    let Verdict::Certified { error_rad, shell: true, ref lines } = winner.verdict else {
        panic!("{winner:?}")
    };
    assert!(lines[0].contains("with any inner law") && lines[0].contains("from rest"), "{lines:?}");
    // The proof is the scenario's, and holds.
    let certificate = found.certificate.as_ref().unwrap();
    assert_eq!(checker::check(certificate).unwrap().error_bound, error_rad);
    let scenario = winner.scenario.as_ref().unwrap();
    assert_eq!(scenario.sampled_setup(&scenario.plan().unwrap().bounds).unwrap(), certificate.setup);
    // The file alone gives the run back, on a disc that nobody has seen, and it slides within the bound.
    let seed = [("run.seed".to_owned(), Value::Integer(777))];
    let again = Scenario::from_table("tuned", scenario.canonical().parse().unwrap(), &seed).unwrap();
    let metrics = again.run(Keep::Figures, UNWATCHED).unwrap().metrics;
    assert_eq!(metrics.stick_slip_cycles_per_s, 0.0);
    assert!(metrics.max_error_rad < error_rad && metrics.max_error_rad < 0.1_f64.to_radians(), "{metrics:?}");
    // Each law is in the table, and nothing that was looked at is smoother and certified.
    assert!(found.candidates.len() >= 5, "{:?}", found.candidates);
    let costs: Vec<f64> = found.candidates.iter().filter_map(|c| c.score.cost).collect();
    assert!(costs.windows(2).all(|w| w[0] <= w[1]), "{costs:?}");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let alone = pool.install(|| tuned(&[], &few()));
    let told = |of: &Tuned| -> Vec<_> {
        let all = of.candidates.iter();
        all.map(|c| (c.name.clone(), c.gains.clone(), c.score, c.verdict.clone(), c.outcome.clone()))
            .collect()
    };
    assert_eq!(told(&alone), told(&found));
}

/// Waves near those that it believes in by itself are not worth a word.
#[test]
fn glide_is_told_of_waves_that_are_far_from_its_own() {
    for (lowest, highest, told) in [("40", "60", 50.0), ("300", "400", 340.0)] {
        let band =
            [("rig.ripple.lowest_waves_per_turn", lowest), ("rig.ripple.highest_waves_per_turn", highest)];
        let set = [band[0], band[1], ("rig.ripple.spacing_waves_per_turn", "20"), ("rig.ripple.rms", "0.03")];
        let found = tuned(&set, &few());
        let spec = found.winner().and_then(|winner| winner.scenario.as_ref()).expect("a winner").spec();
        assert_eq!(spec.law.filter().expect("glide's").waves, told, "{lowest}");
    }
}

/// A shell of a coarser encoder is wider and slower; at another period its filter's time is the same.
#[test]
fn another_encoder_and_period_get_a_shell_that_no_edge_trips() {
    for (counts, period, smoothing) in [("8192", "500", 0.1), ("65536", "2000", 0.4)] {
        let set = [("rig.encoder.counts_per_rev", counts), ("sampling.period_us", period)];
        let found = tuned(&set, &few());
        let winner = found.winner().expect("a winner");
        assert_eq!(winner.name, "glide in a shell", "{counts}: {:?}", found.open_shells);
        let params = winner.scenario.as_ref().unwrap().params();
        let (slope, boundary) = (params.shell.slope, params.shell.boundary);
        let clutch_core::VelocityParams::SmoothedDerivative(filter) = params.velocity else {
            panic!("{:?}", params.velocity)
        };
        assert_eq!(filter.smoothing, smoothing, "{counts}");
        let count = core::f64::consts::TAU / counts.parse::<f64>().unwrap();
        let edge = count * (smoothing / (1e-6 * period.parse::<f64>().unwrap()) + slope);
        assert!(edge < 0.6 * boundary, "{counts}: {edge} of {boundary}");
    }
}

#[test]
fn without_a_certificate_nothing_is_given_out_unless_that_is_asked_for() {
    // A lag has no sampled certificate.
    let lag = [("rig.actuator_time_constant_s", "0.001")];
    let found = tuned(&lag, &few());
    assert!(found.winner().is_none() && found.certificate.is_none());
    let why = found.uncovered.as_ref().expect("a reason");
    assert!(why.contains("a lag") && found.open_shells.is_empty(), "{why}");
    // A candidate that sticks where it is judged is refused before anything is proven of it.
    for c in &found.candidates {
        let refused = matches!(&c.outcome, Outcome::Refused { why } if why.contains("it sticks in"));
        assert_eq!(refused, c.score.runs_with_sticks > 0, "{}: {:?}", c.name, c.outcome);
    }
    let found = tuned(&lag, &Options { uncertified: true, ..few() });
    let winner = found.winner().expect("a winner");
    assert!(matches!(winner.verdict, Verdict::Uncertified { .. }), "{winner:?}");
    assert_eq!(found.from_rest.unwrap().runs_with_sticks, 0);
}

#[test]
fn what_sticks_from_rest_is_refused() {
    // Below what 20 000 counts allow, every law sticks.
    let slow = [("rig.base", "bench"), ("reference.ramp.rate_deg_s", "0.2")];
    let found = tuned(&slow, &Options { uncertified: true, candidates: 1, ..Options::default() });
    assert!(found.winner().is_none(), "{:?}", found.winner());
    let refused = |c: &clutch_tune::Candidate| matches!(&c.outcome, Outcome::Refused { why } if why.contains("it sticks in"));
    assert!(found.candidates.iter().any(refused), "{:?}", found.candidates);
}

/// Where one run of eight refuses the smoothest gains of a law, chance does: the next ones are judged, on other discs.
#[test]
fn behind_a_rare_stick_the_next_gains_of_the_law_are_looked_at() {
    let slow = [("rig.base", "bench"), ("reference.ramp.rate_deg_s", "1.0")];
    let found = tuned(&slow, &Options { uncertified: true, candidates: 8, ..Options::default() });
    let rows: Vec<_> = found.candidates.iter().filter(|c| c.name.starts_with("glide")).collect();
    let by = |before: u32| rows.iter().find(|c| c.before == before);
    let (first, second) = (by(0).expect("a first"), by(1).expect("a second"));
    assert_eq!((first.name.as_str(), second.name.as_str()), ("glide", "glide (2)"));
    let refused =
        matches!(&first.outcome, Outcome::Refused { why } if why.contains("it sticks in 1 of 8 runs"));
    assert!(refused, "{first:?}");
    assert!(second.gains != first.gains && second.score != first.score, "{second:?}");
    // Laws that stick everywhere have had their chance.
    for c in found.candidates.iter().filter(|c| c.before > 0) {
        assert!(c.name.starts_with("glide"), "{c:?}");
    }
    let costs: Vec<f64> = found.candidates.iter().filter_map(|c| c.score.cost).collect();
    assert!(costs.windows(2).all(|w| w[0] <= w[1]), "{costs:?}");
}

#[test]
fn mistakes_are_named_by_key_value_and_expectation() {
    let refusal = |set: &[(&str, &str)], options: Options| {
        tune(&scenario(set), None, &options, UNWATCHED).unwrap_err().to_string()
    };
    let rates = |rates: &[f64]| Options { rates_deg_s: rates.to_vec(), ..few() };
    assert!(refusal(&[], rates(&[2.0, -1.0])).contains("rates = -1: expected finite numbers above 0 °/s"));
    let rests = refusal(&[("reference.ramp.rate_deg_s", "0.0")], few());
    assert!(rests.contains("reference.ramp.rate_deg_s = 0: expected finite numbers above 0 °/s"), "{rests}");
    let short = [("run.duration_s", "2.5"), ("run.settle_s", "2.0")];
    let short = tune(&motor(&short), None, &few(), UNWATCHED).unwrap_err().to_string();
    assert!(short.contains("run.duration_s = 2.5: expected at least run.settle_s + 1 s"), "{short}");
    let none = refusal(&[], Options { candidates: 0, ..few() });
    assert!(none.contains("candidates = 0: expected a whole number from 1 to 10000"), "{none}");
    let to_and_fro = tune(&motor(&[]), None, &rates(&[2.0]), UNWATCHED).unwrap_err().to_string();
    assert!(
        to_and_fro.contains("rates = 2: expected none, as [reference.sine] has velocities"),
        "{to_and_fro}"
    );
    let actuator = "{both={brake_gain_nm_v=0.14,motor_gain_nm_v=0.02}}";
    let both = [("rig.actuator", actuator), ("model.actuator", actuator), ("output.lowest_v", "-10.0")];
    let both = refusal(&both, few());
    assert!(both.contains("rig.actuator = both: expected a brake or a motor"), "{both}");
}

fn motor(set: &[(&str, &str)]) -> Scenario {
    let set: Vec<(String, String)> = set.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    let text = Scenario::text("motor_pid".as_ref()).unwrap().1;
    Scenario::parse("axis", &text, &set).unwrap()
}

const RAMP: (&str, &str) = ("reference", "{ramp={rate_deg_s=2.0}}");

#[test]
fn a_motor_axis_on_a_ramp_gets_a_certified_law_and_an_output_that_goes_forwards() {
    // A load that pushes backwards, friction and inertia within some per cent.
    let set = [
        RAMP,
        ("model.drive_torque_nm", "-0.003"),
        ("rig.drive.table.points_s_nm", "[[0.0, -0.003]]"),
        ("bounds.friction_percent", "5.0"),
        ("bounds.inertia_percent", "2.0"),
        ("bounds.drive_torque_percent", "50.0"),
    ];
    let found = tune(&motor(&set), None, &few(), UNWATCHED).unwrap();
    // Two loads, two inertias, two frictions.
    assert_eq!(found.corners.len(), 8);
    let winner = found.winner().expect("a winner");
    let Verdict::Certified { error_rad, .. } = winner.verdict else { panic!("{winner:?}") };
    let certificate = found.certificate.as_ref().unwrap();
    assert_eq!(checker::check(certificate).unwrap().error_bound, error_rad);
    // Friction of 28.5 mN m less a load of up to 4.5 holds 0.48 V.
    let [lowest, highest] = found.output_v.expect("limits");
    assert!((-0.48..-0.46).contains(&lowest) && (2.9..3.1).contains(&highest), "{lowest} {highest}");
    let scenario = winner.scenario.as_ref().unwrap();
    let output = scenario.params().output;
    assert_eq!([output.lowest, output.highest], [lowest, highest]);
    assert_eq!(scenario.sampled_setup(&scenario.plan().unwrap().bounds).unwrap(), certificate.setup);
    // On a corner of the box that nobody has tried the error stays within the bound.
    let seed = [
        ("run.seed".to_owned(), Value::Integer(777)),
        ("run.settle_s".to_owned(), Value::Float(0.0)),
        ("rig.inertia_kg_m2".to_owned(), Value::Float(0.0017 * 0.98)),
        ("rig.actuator.motor.preload_nm".to_owned(), Value::Float(0.25 * 1.05)),
    ];
    let again = Scenario::from_table("tuned", scenario.canonical().parse().unwrap(), &seed).unwrap();
    let metrics = again.run(Keep::Figures, UNWATCHED).unwrap().metrics;
    assert!(metrics.max_error_rad < error_rad, "{metrics:?}");
    // A motor that may turn round has no certificate, and the reason names the limit that would do.
    let text = scenario.canonical();
    let wide = [("output.lowest_v".to_owned(), "-2.0".to_owned())];
    let wide = Scenario::parse("wide", &text, &wide).unwrap();
    let why = wide.sampled_setup(&wide.plan().unwrap().bounds).unwrap_err().to_string();
    assert!(
        why.contains("-2 V at a motor, which may turn the shaft round") && why.contains("-0.47"),
        "{why}"
    );
}

#[test]
fn along_a_path_that_turns_round_the_error_decides_and_nothing_is_certified() {
    let set = [("run.duration_s", "6.0"), ("run.settle_s", "1.0")];
    let found = tune(&motor(&set), None, &few(), UNWATCHED).unwrap();
    assert!(found.winner().is_none() && found.rates_deg_s.is_empty() && found.output_v.is_none());
    assert!(found.uncovered.as_ref().unwrap().contains("a path that is no ramp"), "{:?}", found.uncovered);
    assert!(found.candidates.iter().any(|c| c.name == "glide with micro-steps"), "{:?}", found.candidates);
    let found = tune(&motor(&set), None, &Options { uncertified: true, ..few() }, UNWATCHED).unwrap();
    let winner = found.winner().expect("a winner");
    // It rests at each reversal, and is not refused for it; its cost is that of its errors, and of its voltage's travel.
    assert!(winner.score.runs_with_sticks > 0);
    let Score { rms_error_rad, max_error_rad, control_variation_v_s, .. } = winner.score;
    // Each is the largest of all runs, and the cost that of one.
    let most =
        30.0 * rms_error_rad.to_degrees() + 10.0 * max_error_rad.to_degrees() + 1e-3 * control_variation_v_s;
    let cost = winner.score.cost.unwrap();
    assert!(cost <= most + 1e-9 && cost > 0.5 * most, "{cost} {most}");
    let own = motor(&set).run(Keep::Figures, UNWATCHED).unwrap().metrics;
    assert!(winner.score.max_error_rad < 0.5 * own.max_error_rad, "{:?} {own:?}", winner.score);
}
