//! A run as numbers: what the host planned is what the board builds, or it is refused.

use crate::desk::{PATHS, Plan, key};
use clutch_core::edge_timed::EdgeTimedParams;
use clutch_core::law::{
    CtcParams, DobParams, LawParams, OutputParams, PdParams, PidParams, SmcIntegralParams, SmcParams,
    SmcSignParams, SuperTwistingParams,
};
use clutch_core::params::{Choice, Params};
use clutch_core::reference::{Interpolation, Knot, ReferenceParams, Table};
use clutch_core::{
    CountsOverTimeParams, FixedCounts, Micros, ObserverParams, SafeState, Servo, ServoParams,
    SmoothedDerivativeParams, SupervisorParams, VelocityParams,
};
use clutch_core::{FNV_64, LimitParams, fnv1a_64};
use clutch_settings::{
    Built, MAX_KNOTS, Misfit, Refusing, RunSettings, SETTINGS, SETTINGS_HASH, Setting, Settings, Unsupported,
};
use proptest::prelude::*;

const FIRST_KNOT: u16 = 0x1000;

const fn knot(time_us: u64, position: i64) -> Knot {
    Knot { time_us, position: FixedCounts(position) }
}

/// Starts late, within a count, and goes to and fro.
const KNOTS: [Knot; 5] = [
    knot(20_000, (3 << 16) + 12_345),
    knot(300_000, 400 << 16),
    knot(450_500, 800 << 16),
    knot(700_000, (650 << 16) + 7),
    knot(900_000, 1000 << 16),
];

/// The settings after a way over the wire.
fn sent(pairs: &[(u16, u64)]) -> Settings {
    let mut settings = Settings::default();
    for (key, value) in pairs {
        assert!(settings.set(*key, *value), "{key:#06x} = {value:#x}");
    }
    settings
}

#[track_caller]
fn the_same(plan: &Plan) -> (Settings, Built) {
    let settings = sent(&plan.pairs());
    let built = settings.build().unwrap();
    assert_eq!(built.servo, Servo::new(&plan.servo).unwrap());
    assert_eq!(built.supervisor, plan.supervisor());
    (settings, built)
}

fn pairs(settings: &Settings) -> Vec<(u16, u64)> {
    let mut pairs = Vec::new();
    settings.each(|key, value| pairs.push((key, value)));
    pairs
}

/// The settings of a plan with one number changed.
fn with(name: &str, value: u64) -> Settings {
    let mut settings = sent(&Plan::new().pairs());
    assert!(settings.set(key(name), value));
    settings
}

#[test]
fn each_law_is_built_as_it_was_planned() {
    let other = [
        LawParams::Pd(PdParams { kp: 1.5, kd: 0.25 }),
        LawParams::Ctc(CtcParams { outer_gain: 3.0, kp: 70.0, kd: 1.25 }),
        LawParams::Smc(SmcParams { kp: 20.0, kd: 3.0, slope: 11.0, boundary: 0.5 }),
        LawParams::SmcSign(SmcSignParams { kp: 20.0, kd: 3.0, slope: 11.0 }),
        LawParams::SuperTwisting(SuperTwistingParams { k1: 20.0, k2: 3.0, slope: 11.0, boundary: 0.5 }),
        LawParams::SmcIntegral(SmcIntegralParams {
            kp: 20.0,
            kd: 3.0,
            slope: 11.0,
            integral: 7.0,
            boundary: 0.5,
        }),
        LawParams::Dob(DobParams { kp: 20.0, kd: 3.0, bandwidth: 11.0 }),
        LawParams::Pid(PidParams { ki: 3.0, tracking_time: 0.5, bias: 2.5, ..PidParams::default() }),
    ];
    for law in LawParams::<f32>::all().into_iter().chain(other) {
        let plan = Plan { servo: ServoParams { law, ..Plan::new().servo }, ..Plan::new() };
        the_same(&plan);
    }
}

#[test]
fn each_safe_state_is_built_as_it_was_planned() {
    for on_fault in [
        SafeState::hold(4.5),
        SafeState::ramp(100.0, 5.5),
        SafeState::Release,
        SafeState::hold_then_release(5.0, 1.5),
    ] {
        the_same(&Plan { limits: SupervisorParams::new(on_fault), ..Plan::new() });
    }
}

#[test]
fn each_path_is_the_planned_one_bit_for_bit_from_its_first_whole_count_on() {
    let table = |interpolation| ReferenceParams::Table(Table { knots: &KNOTS, interpolation });
    let others = [
        ReferenceParams::Hold,
        ReferenceParams::ramp(0.3),
        table(Interpolation::Linear),
        table(Interpolation::Cubic),
    ];
    for reference in others.into_iter().chain(PATHS) {
        // Within a count; and far off, where the whole counts do not fit an encoder's 32 bits.
        for start in [0, 40_000, -40_000, (-3_000_000_000 << 16) + 5] {
            let plan = Plan { reference, start: FixedCounts(start), ..Plan::new() };
            let (settings, built) = the_same(&plan);
            let path = plan.path();
            let mut moves = false;
            for tick in 0..1000 {
                let (target, planned) = (built.path.target(settings.knots(), tick), path(tick));
                assert_eq!(target.position, planned.position, "{reference:?} at {tick}");
                let bits = |t: clutch_core::Target<f32>| (t.velocity.to_bits(), t.acceleration.to_bits());
                assert_eq!(bits(target), bits(planned), "{reference:?} at {tick}");
                moves |= target.velocity != 0.0;
            }
            assert_eq!(moves, reference != ReferenceParams::Hold, "{reference:?}");
            let first = built.path.target(settings.knots(), 0).position;
            assert!((0..1 << 16).contains(&first.0), "{reference:?} begins within a count: {first:?}");
        }
    }
}

proptest! {
    #[test]
    fn any_numbers_that_a_run_can_have_arrive_bit_for_bit(
        period in 500_u32..10_000,
        smoothing in 0.01_f32..=1.0,
        inertia in 1e-4_f32..1e-2,
        kp in 0.0_f32..1e6,
        kd in 0.0_f32..1e3,
        highest in 1.0_f32..9.9,
        bumpless_time in 0.0_f32..2.0,
        jumps in 1_u32..=128,
        following_error in 1e-3_f32..1.0,
        start: i64,
        times: [u32; 5],
        ticks: u64,
    ) {
        let new = Plan::new();
        let model = clutch_core::PlantParams { inertia, ..new.servo.model };
        let plan = Plan {
            servo: ServoParams {
                period: Micros(period),
                velocity: VelocityParams::SmoothedDerivative(SmoothedDerivativeParams { smoothing }),
                law: LawParams::Pd(PdParams { kp, kd }),
                output: OutputParams { highest, on_invalid: highest, bumpless_time, ..new.servo.output },
                model,
                ..new.servo
            },
            limits: SupervisorParams {
                limits: LimitParams { jumps, following_error, ..new.limits.limits },
                ..new.limits
            },
            start: FixedCounts(start),
            watchdog: Micros(times[0]),
            silence: Micros(times[2]),
            host_silence: Micros(times[3]),
            ticks,
            ..new
        };
        let settings = sent(&plan.pairs());
        let built = settings.build().unwrap();
        prop_assert_eq!((built.times, built.ticks), (plan.run_params().times, ticks));
        prop_assert_eq!(pairs(&settings), plan.pairs());
        prop_assert_eq!(built.servo, Servo::new(&plan.servo).unwrap());
        prop_assert_eq!(built.supervisor, plan.supervisor());
    }
}

#[test]
fn a_setting_that_was_left_out_is_named_whichever_it_is() {
    let reference = ReferenceParams::Table(Table { knots: &KNOTS, interpolation: Interpolation::Linear });
    for law in LawParams::<f32>::all() {
        let plan = Plan { reference, servo: ServoParams { law, ..Plan::new().servo }, ..Plan::new() };
        let all = plan.pairs();
        for missing in 0..all.len() {
            let (mut rest, (key, _)) = (all.clone(), all[missing]);
            rest.remove(missing);
            assert_eq!(sent(&rest).build().unwrap_err(), Misfit::Missing(key), "without {key:#06x}");
        }
    }
}

#[test]
fn settings_come_in_any_order() {
    let mut pairs = Plan::new().pairs();
    pairs.reverse();
    let built = sent(&pairs).build().unwrap();
    assert_eq!(built.servo, Servo::new(&Plan::new().servo).unwrap());
}

/// The host's words on settings that a board refuses.
fn refusal(settings: &Settings) -> String {
    let misfit = settings.build().unwrap_err();
    let lacks = !matches!(misfit, Misfit::Unfit { .. });
    Refusing { settings, bits: misfit.bits(), lacks }.to_string()
}

#[test]
fn a_number_that_a_constructor_refuses_is_told_with_key_value_and_expectation() {
    let real = |x: f32| u64::from(x.to_bits());
    for (name, value, text) in [
        (
            "rig.encoder.counts_per_rev",
            3,
            "3: expected a whole number from 4 to 16 777 216 counts per revolution",
        ),
        ("sampling.period_us", 0, "0: expected a whole number from 1 to 1 000 000 µs"),
        ("rig.dac.bits", 17, "17: expected a whole number from 1 to 16 bits"),
        ("safety.limits.jumps", 129, "129: expected a whole number from 1 to 128 within 128 periods"),
        (
            "model.inertia_kg_m2",
            real(-1.0),
            "-1: expected a finite number above 0 kg m² whose inverse is finite, too",
        ),
        ("law.pd.kp_v_rad", real(f32::NAN), "NaN: expected a finite number of at least 0 V/rad"),
        ("safety.limits.jump_deg", real(-1.0_f32.to_radians()), "-1: expected a finite number above 0 °"),
        (
            "output.on_invalid_v",
            real(10.5),
            "10.5: expected a voltage from lowest_v to highest_v (it does not follow them)",
        ),
        ("reference.ramp.rate_deg_s", real(f32::INFINITY), "inf: expected a finite number, °/s"),
        ("start_counts_x65536", 65536, "65536: expected a whole number from 0 to 65 535"),
        (
            "rig.dac.bits",
            256 + 12,
            "268: the board lacks it, or knows no such value: expected a whole number from 1 to 16 bits",
        ),
        ("bounds.brake_gain_nm_v.high", real(f32::INFINITY), "inf: expected a finite number, N m/V"),
        ("bounds.inertia_kg_m2.low", real(f32::NAN), "NaN: expected a finite number, kg m²"),
        ("bounds.friction.low", real(f32::NAN), "NaN: expected a finite number"),
    ] {
        assert_eq!(refusal(&with(name, value)), format!("{name} = {text}"));
    }
    let (laws, none) = (laws(), laws().len());
    let text = format!(
        "law = {none}: the board lacks it, or knows no such value: expected one of: {}",
        laws.join(", ")
    );
    assert_eq!(refusal(&with("law", none as u64)), text);
    let pairs = Plan::new().pairs();
    assert_eq!(refusal(&sent(&pairs[1..])), "ticks: missing");
}

#[test]
fn points_of_a_table_have_to_rise_in_time() {
    let reference = ReferenceParams::Table(Table { knots: &KNOTS, interpolation: Interpolation::Cubic });
    let mut settings = sent(&Plan { reference, ..Plan::new() }.pairs());
    assert!(settings.set(FIRST_KNOT + 2 * 3, KNOTS[2].time_us));
    let key = key("reference.table.points_s_deg");
    assert_eq!(settings.build().unwrap_err(), Misfit::Unfit { key, relation: 2, value: 3.0 });
    let text = "reference.table.points_s_deg = 5 points: expected times of at least 0 s that rise from point to point";
    assert_eq!(refusal(&settings), text);
}

#[test]
fn settings_are_found_by_their_keys_in_the_order_of_the_declarations() {
    let names: Vec<String> = Setting::all().map(|s| s.name.to_string()).collect();
    assert_eq!(names.len(), SETTINGS);
    assert_eq!(SETTINGS, <RunSettings<'static> as Params<f32>>::INFO.places());
    assert!((0..SETTINGS as u16).all(|key| Setting::of(key).unwrap().key == key));
    assert!(Setting::of(SETTINGS as u16).is_none() && Setting::of(u16::MAX).is_none());
    for (i, name) in names.iter().enumerate() {
        assert!(!names[..i].contains(name), "{name} twice");
    }
    // The host's settings are named as a scenario names them.
    let plan = Plan::new();
    let sent: Vec<String> = plan.pairs().iter().map(|(key, _)| names[usize::from(*key)].clone()).collect();
    for name in ["ticks", "sampling.period_us", "law", "law.pd.kd_v_s_rad", "safety.on_fault.hold.volts_v"] {
        assert!(sent.contains(&name.to_owned()), "{name}");
    }
    assert!(!sent.iter().any(|name| name.starts_with("law.smc")), "{sent:?}");
}

/// The names of the laws.
fn laws() -> Vec<&'static str> {
    <LawParams as Choice<f64>>::CHOICE.options.iter().map(|option| option.key).collect()
}

#[test]
fn the_hash_is_that_of_names_types_and_units() {
    let text: String = Setting::all().map(|s| format!("{}:{}:{}\n", s.name, s.kind(), s.unit())).collect();
    assert_eq!(SETTINGS_HASH, fnv1a_64(FNV_64, text.as_bytes()), "{text}");
    let laws = format!("\nlaw:{}:\nlaw.pd.kp_v_rad:f32:V/rad\n", laws().join("/"));
    assert!(text.contains(&laws), "{text}");
}

#[test]
fn settings_have_a_key_each_and_there_are_no_others() {
    let last = FIRST_KNOT + 2 * MAX_KNOTS as u16 - 1;
    for key in 0..=u16::MAX {
        let known = usize::from(key) < SETTINGS || (FIRST_KNOT..=last).contains(&key);
        assert_eq!(Settings::knows(key), known, "{key:#06x}");
        assert_eq!(Settings::default().set(key, 0), known, "{key:#06x}");
    }
}

#[test]
fn a_table_has_as_many_points_as_there_is_room_for_and_not_one_more() {
    let knots: Vec<Knot> = (0..=MAX_KNOTS as u64).map(|i| knot(i * 1000, i as i64 * 65_536)).collect();
    let reference = |n: usize| -> ReferenceParams<'static, f32> {
        let knots = knots[..n].to_vec().leak();
        ReferenceParams::Table(Table { knots, interpolation: Interpolation::Cubic })
    };
    let plan = Plan { reference: reference(MAX_KNOTS), ..Plan::new() };
    let (settings, built) = the_same(&plan);
    assert_eq!(built.path.target(settings.knots(), 255), plan.path()(255));
    let many = Plan { reference: reference(MAX_KNOTS + 1), ..Plan::new() };
    assert_eq!(Settings::new(&many.run_params()).unwrap_err(), Unsupported::Knots(MAX_KNOTS + 1));
    // And a host that does not count.
    let points = key("reference.table.points_s_deg");
    for many in [MAX_KNOTS as u64 + 1, 1 << 32, u64::MAX] {
        let mut settings = sent(&plan.pairs());
        assert!(settings.set(points, many));
        assert_eq!(settings.build().unwrap_err(), Misfit::Unknown(points));
    }
}

#[test]
fn a_table_without_points_is_refused() {
    let reference = ReferenceParams::Table(Table { knots: &[], interpolation: Interpolation::Linear });
    let settings = sent(&Plan { reference, ..Plan::new() }.pairs());
    assert_eq!(refusal(&settings), "reference.table.points_s_deg = 0 points: expected at least one point");
}

#[test]
fn another_velocity_than_5_is_not_for_boards_and_its_key_is_named() {
    for velocity in [
        VelocityParams::CountsOverTime(CountsOverTimeParams::default()),
        VelocityParams::EdgeTimed(EdgeTimedParams::default()),
        VelocityParams::Observer(ObserverParams::default()),
    ] {
        let plan = Plan { servo: ServoParams { velocity, ..Plan::new().servo }, ..Plan::new() };
        let refused = Settings::new(&plan.run_params()).unwrap_err();
        let key = format!("velocity.{}: expected velocity.smoothed_derivative", velocity.name());
        assert!(refused.to_string().starts_with(&key), "{refused}");
    }
}
