//! The lowest smooth rate and its causes, held against the simulator: without the cause the shaft goes slower.

use clutch_sim::progress::UNWATCHED;
use clutch_sim::smooth_speed::{
    Axis, Failing, SmoothSpeed, Trials, Wall, gain_map, lowest_smooth_speed, rate_map,
};
use clutch_sim::{Keep, Scenario};

/// A built-in scenario with other values.
fn scenario(name: &str, set: &[(&str, &str)]) -> Scenario {
    let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    let (origin, text) = Scenario::text(name.as_ref()).unwrap();
    Scenario::parse(&origin, &text, &set).unwrap_or_else(|e| panic!("{e}"))
}

fn lowest(name: &str, set: &[(&str, &str)], rates: &[f64]) -> SmoothSpeed {
    let trials = Trials::new("test", rates, 5).unwrap();
    lowest_smooth_speed(&scenario(name, set), &trials, UNWATCHED).unwrap()
}

/// The rate, with infinity for none.
fn rate(found: &SmoothSpeed) -> f64 {
    found.rate_deg_s.unwrap_or(f64::INFINITY)
}

const EVEN: (&str, &str) = ("rig.ripple.rms", "0.0");
const IDEAL: (&str, &str) = ("rig.encoder.quantised", "false");

#[test]
fn an_unstable_sampled_loop_is_the_cause_and_what_makes_it_stable_makes_it_slower() {
    let rates = [2.0, 4.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0];
    let paper = lowest("bench_pd_2", &[], &rates);
    assert_eq!((paper.cause, rate(&paper) >= 15.0), (Some(Wall::SampledLoop), true), "{paper:?}");
    // With the rig's own mean friction: 1.0227.
    assert!((paper.evidence.spectral_radius.unwrap() - 1.0227).abs() < 1e-4, "{paper:?}");
    for stable in [("velocity.smoothed_derivative.smoothing", "1.0"), ("rig.delay_ticks", "0")] {
        let found = lowest("bench_pd_2", &[stable], &rates);
        assert!(found.evidence.spectral_radius.unwrap() < 1.0, "{stable:?} {found:?}");
        assert!(rate(&found) <= 8.0 && found.cause != Some(Wall::SampledLoop), "{stable:?} {found:?}");
    }
    // The removal of what is no cause takes nothing away: the sticks at 6 and 10 °/s stay.
    for other in [EVEN, IDEAL] {
        let found = lowest("bench_pd_2", &[other], &rates);
        assert!(rate(&found) > 10.0 && found.cause == Some(Wall::SampledLoop), "{other:?} {found:?}");
    }
}

/// On an even disc with a perfect sensor and converter and no delay nothing is left but friction. A law that begins at its
/// balance, all but a millirad: a large departure sticks and slips on above the edge, too.
const PURE: [(&str, &str); 9] = [
    EVEN,
    IDEAL,
    ("rig.dac.quantised", "false"),
    ("rig.delay_ticks", "0"),
    ("velocity.smoothed_derivative.smoothing", "1.0"),
    ("law.pid.kp_v_rad", "500.0"),
    ("law.pid.ki_v_rad_s", "0.0"),
    ("law.pid.bias_v", "3.3"),
    ("rig.friction.stribeck.stribeck_velocity_rad_s", "0.01"),
];

#[test]
fn the_stribeck_edge_is_where_the_closed_form_has_it() {
    let rates: Vec<f64> = (1..=40).map(|i| f64::from(i) / 10.0).collect();
    let with = |kd, more: &[(&str, &str)]| {
        lowest("bench_pid_2", &[&PURE[..], &[("law.pid.kd_v_s_rad", kd)], more].concat(), &rates)
    };
    let base = with("10.0", &[]);
    let edge = base.evidence.stribeck_edge_deg_s.unwrap();
    assert_eq!(base.evidence.causes, [Wall::StribeckEdge], "{base:?}");
    assert!((rate(&base) / edge - 1.0).abs() < 0.1, "{edge} {base:?}");
    // v_s ln[(μ_s/μ_d − 1) v_h/(K_d v_s)], of which C_d takes half a percent of the argument.
    let holds: f64 = 0.2094 * 9.81 * 0.024 / (0.104 * 0.14);
    let printed: f64 = 0.01 * ((0.203 / 0.104 - 1.0) * holds / (10.0 * 0.01)).ln();
    assert!((edge / printed.to_degrees() - 1.0).abs() < 0.01, "{edge} {printed}");
    for removed in [
        ("rig.friction.stribeck.stribeck_velocity_rad_s", "0.001"),
        ("rig.friction.stribeck.stribeck_velocity_rad_s", "1.0"),
        ("rig.friction.stribeck.mu_static", "0.104"),
    ] {
        let found = with("10.0", &[removed]);
        assert!(rate(&found) < 0.5 * rate(&base), "{removed:?}: {found:?}");
    }
    // More damping moves the edge, and the shaft with it.
    let damped = with("30.0", &[]);
    assert!((rate(&damped) / damped.evidence.stribeck_edge_deg_s.unwrap() - 1.0).abs() < 0.1, "{damped:?}");
    assert!(rate(&damped) < 0.8 * rate(&base), "{damped:?}");
}

#[test]
fn the_encoders_edge_goes_with_a_finer_encoder() {
    let with = |counts| lowest("bench_glide_2", &[("rig.encoder.counts_per_rev", counts)], &[0.7, 3.0]);
    let coarse = with("10000");
    assert_eq!((coarse.rate_deg_s, coarse.cause), (Some(3.0), Some(Wall::EncoderEdge)), "{coarse:?}");
    // (Stribeck's 4.0 1/s and the ripple's 39.7 1/s) times 51 ms.
    assert!((coarse.evidence.growth_between_edges.unwrap() - 2.245).abs() < 0.01, "{coarse:?}");
    let fine = with("80000");
    assert_eq!((fine.rate_deg_s, fine.evidence.causes.is_empty()), (Some(0.7), true), "{fine:?}");
}

#[test]
fn the_jolt_of_an_edge_goes_with_the_edge_and_with_the_gain() {
    let rates = [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0];
    let with = |kd, more: &[(&str, &str)]| {
        let gains = [
            ("velocity.smoothed_derivative.smoothing", "0.712"),
            ("law.pd.kp_v_rad", "2000.0"),
            ("law.pd.kd_v_s_rad", kd),
        ];
        lowest("bench_pd_2", &[&gains, more].concat(), &rates)
    };
    let (stiff, soft) = (with("38.0", &[]), with("19.0", &[]));
    for found in [&stiff, &soft] {
        assert_eq!(found.evidence.causes, [Wall::EdgeJolt], "{found:?}");
        let ratio = rate(found) / found.evidence.edge_jolt_deg_s.unwrap();
        assert!((0.7..1.4).contains(&ratio), "{found:?}");
    }
    assert!(rate(&soft) < 0.7 * rate(&stiff), "{soft:?} {stiff:?}");
    let (ideal, even) = (with("38.0", &[IDEAL]), with("38.0", &[EVEN]));
    assert!(rate(&ideal) < 0.4 * rate(&stiff) && ideal.evidence.edge_jolt_deg_s.is_none(), "{ideal:?}");
    assert!(rate(&even) >= 0.6 * rate(&stiff) && even.cause == Some(Wall::EdgeJolt), "{even:?}");
}

#[test]
fn ripple_along_the_disc_is_the_cause_where_an_even_disc_is_smooth() {
    let rates = [1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 15.0, 20.0];
    let with = |kp, kd, more: &[(&str, &str)]| {
        let gains = [
            ("velocity.smoothed_derivative.smoothing", "0.712"),
            ("law.pd.kp_v_rad", kp),
            ("law.pd.kd_v_s_rad", kd),
        ];
        lowest("bench_pd_2", &[&gains, more].concat(), &rates)
    };
    let told = |found: &SmoothSpeed| (found.cause, found.evidence.even_disc_smooth);
    let soft = with("812.3", "7.0", &[]);
    assert_eq!(told(&soft), (Some(Wall::Ripple), Some(true)), "{soft:?}");
    assert_eq!(soft.evidence.causes, [Wall::Ripple], "{soft:?}");
    // The less ripple, the slower; on an even disc something else is left.
    let (half, even) = (with("812.3", "7.0", &[("rig.ripple.rms", "0.075")]), with("812.3", "7.0", &[EVEN]));
    assert!(rate(&even) < 0.5 * rate(&soft) && rate(&half) < rate(&soft), "{soft:?} {half:?} {even:?}");
    assert!(even.cause != Some(Wall::Ripple), "{even:?}");
    // A finer encoder does not help.
    let fine = with("812.3", "7.0", &[IDEAL]);
    assert!(rate(&fine) > 0.5 * rate(&soft) && fine.cause == Some(Wall::Ripple), "{fine:?}");
    // A weakly damped loop sticks on an even disc, too.
    let weak = with("3693.0", "10.0", &[]);
    assert_eq!(told(&weak), (None, Some(false)), "{weak:?}");
    // Where another cause holds, nothing is asked.
    let jolt = with("2000.0", "38.0", &[]);
    assert_eq!(told(&jolt), (Some(Wall::EdgeJolt), None), "{jolt:?}");
}

#[test]
fn a_rate_is_smooth_where_the_runs_figures_have_no_stick_and_the_search_finds_the_lowest() {
    let rates = [1.0, 2.0, 3.0, 4.0, 6.0];
    let trials = Trials::new("test", &rates, 4).unwrap();
    let set = [
        ("velocity.smoothed_derivative.smoothing", "0.712"),
        ("law.pd.kp_v_rad", "1660.0"),
        ("law.pd.kd_v_s_rad", "12.9"),
    ];
    let base = scenario("bench_pd_2", &set);
    let x = Axis { key: "law.pd.kd_v_s_rad".to_owned(), values: vec![12.9, 25.0] };
    let map = rate_map(&base, x.clone(), &trials, UNWATCHED).unwrap();
    for (kd, column) in x.values.iter().zip(&map.columns) {
        for (rate, tried) in rates.iter().zip(&column.rates) {
            for seed in 1..=4 {
                let more = [
                    ("law.pd.kd_v_s_rad", kd.to_string()),
                    ("reference.ramp.rate_deg_s", rate.to_string()),
                    ("run.seed", seed.to_string()),
                ];
                let more = more.each_ref().map(|(key, value)| (*key, value.as_str()));
                let run = scenario("bench_pd_2", &[&set[..], &more].concat());
                let sticks = run.run(Keep::Figures, UNWATCHED).unwrap().metrics.stick_time_fraction > 0.0;
                let told = tried.failures.iter().find(|f| f.seed == seed);
                assert_eq!(told.map(|f| f.failing), sticks.then_some(Failing::Sticks), "{rate} {seed}");
                assert!(told.is_none_or(|f| f.rate_deg_s == *rate && (1.0..5.0).contains(&f.time_s)));
            }
        }
        let fails = |i: usize| !column.rates[i].failures.is_empty();
        let first = (0..rates.len()).find(|i| !fails(*i));
        let holes: Vec<f64> =
            first.map_or(vec![], |i| (i..rates.len()).filter(|i| fails(*i)).map(|i| rates[i]).collect());
        let here = [("law.pd.kd_v_s_rad", kd.to_string())];
        let here = here.each_ref().map(|(key, value)| (*key, value.as_str()));
        let found =
            lowest_smooth_speed(&scenario("bench_pd_2", &[&set[..], &here].concat()), &trials, UNWATCHED)
                .unwrap();
        assert_eq!(found.rate_deg_s, first.map(|i| rates[i]), "{found:?}");
        assert_eq!(found.holes.iter().map(|f| f.rate_deg_s).collect::<Vec<_>>(), holes, "{found:?}");
        assert_eq!(found.below.map(|f| f.rate_deg_s), first.and_then(|i| rates[..i].last().copied()));
    }
    // A cell of a map is the search by itself.
    let y = Axis { key: "law.pd.kp_v_rad".to_owned(), values: vec![1660.0] };
    let cells = gain_map(&base, (x, y), &trials, UNWATCHED).unwrap().cells;
    assert_eq!(cells[0][0], lowest_smooth_speed(&base, &trials, UNWATCHED).unwrap());
}

#[test]
fn a_hole_above_the_lowest_smooth_rate_is_told() {
    let set = [("law.pd.kp_v_rad", "2500.0"), ("law.pd.kd_v_s_rad", "12.5")];
    let found = lowest("bench_pd_2", &set, &[3.0, 4.0, 20.0]);
    assert_eq!(found.rate_deg_s, Some(4.0), "{found:?}");
    assert_eq!(found.holes.iter().map(|f| f.rate_deg_s).collect::<Vec<_>>(), [20.0], "{found:?}");
}

#[test]
fn a_shaft_that_nobody_holds_strays() {
    let set = [("law.pd.kp_v_rad", "0.0"), ("law.pd.kd_v_s_rad", "0.0")];
    let found = lowest("bench_pd_2", &set, &[2.0, 20.0]);
    assert_eq!(
        (found.rate_deg_s, found.below.map(|f| f.failing)),
        (None, Some(Failing::Strays)),
        "{found:?}"
    );
}

#[test]
fn what_cannot_be_searched_is_refused_by_its_key() {
    let refused = |name: &str, set: &[(&str, &str)]| {
        lowest_smooth_speed(&scenario(name, set), &Trials::default(), UNWATCHED).unwrap_err().to_string()
    };
    let path = refused("minimum_jerk", &[]);
    assert!(path.starts_with("minimum_jerk: reference: expected a ramp"), "{path}");
    let fast = lowest_smooth_speed(
        &scenario("bench_pd_2", &[]),
        &Trials::new("x", &[1.0, 1e9], 1).unwrap(),
        UNWATCHED,
    );
    assert!(fast.unwrap_err().to_string().contains("reference.ramp.rate_deg_s = 1000000000"));
    for (rates, discs, said) in [
        (&[][..], 1, "rates = none: expected at least one rate"),
        (&[1.0, -2.0], 1, "rates = -2: expected finite numbers above 0 °/s"),
        (&[f64::NAN], 1, "rates = NaN: expected finite"),
        (&[1.0], 0, "discs = 0: expected a whole number from 1"),
        (&[1.0], -1, "discs = -1: expected a whole number from 1"),
    ] {
        let error = Trials::new("test", rates, discs).unwrap_err().to_string();
        assert!(error.starts_with("test: ") && error.contains(said), "{error}");
    }
    let map = |x: &str, y: &str, values: &[f64]| {
        let axis = |key: &str| Axis { key: key.to_owned(), values: values.to_vec() };
        let trials = Trials::new("test", &[20.0], 1).unwrap();
        gain_map(&scenario("bench_pd_2", &[]), (axis(x), axis(y)), &trials, UNWATCHED)
            .unwrap_err()
            .to_string()
    };
    let (kp, kd) = ("law.pd.kp_v_rad", "law.pd.kd_v_s_rad");
    assert!(map(kp, kd, &[-1.0]).contains("law.pd.kp_v_rad = -1: expected"), "{}", map(kp, kd, &[-1.0]));
    assert!(map(kp, "law.pd.kd", &[1.0]).contains("kd_v_s_rad"), "{}", map(kp, "law.pd.kd", &[1.0]));
    assert!(map(kp, kp, &[1.0]).contains("named twice"));
    assert!(map(kp, kd, &[]).contains("at least one value"));
    for own in ["reference.ramp.rate_deg_s", "run.seed"] {
        assert!(map(own, kd, &[1.0]).contains("rates and seeds of its own"), "{}", map(own, kd, &[1.0]));
    }
}
