//! A run as numbers: what the host planned is what the board builds, or it is refused.
#![allow(missing_docs, reason = "the tests' names say what holds")]
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests fail by panics")]

mod desk;

use clutch_core::law::{CtcParams, LawParams, OutputParams, PdParams, SmcParams, SmcSignParams};
use clutch_core::reference::{
    Chirp, Interpolation, JerkLimited, Knot, MinimumJerk, ReferenceParams, Sine, Table, Trapezoid,
};
use clutch_core::{
    FixedCounts, Micros, ObserverParams, SafeState, Servo, ServoParams, SmoothedDerivativeParams,
    SupervisorParams, VelocityParams,
};
use clutch_node::{Built, MAX_KNOTS, Misfit, SETTINGS, Settings, Unsupported};
use desk::Plan;
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

fn key(name: &str) -> u16 {
    SETTINGS.iter().find(|s| s.name == name).unwrap().key
}

/// The settings of a plan with one number changed.
fn with(name: &str, value: u64) -> Settings {
    let mut settings = sent(&Plan::new().pairs());
    assert!(settings.set(key(name), value));
    settings
}

#[test]
fn each_law_is_built_as_it_was_planned() {
    for law in [
        LawParams::Pd(PdParams { kp: 1.5, kd: 0.25 }),
        LawParams::Ctc(CtcParams { outer_gain: 3.0, kp: 70.0, kd: 1.25 }),
        LawParams::Smc(SmcParams { kp: 20.0, kd: 3.0, slope: 11.0, boundary: 0.5 }),
        LawParams::SmcSign(SmcSignParams { kp: 20.0, kd: 3.0, slope: 11.0 }),
    ] {
        let plan = Plan { servo: ServoParams { law, ..Plan::new().servo }, ..Plan::new() };
        the_same(&plan);
    }
}

#[test]
fn each_safe_state_is_built_as_it_was_planned() {
    for on_fault in [
        SafeState::Hold { volts: 4.5 },
        SafeState::Ramp { volts_per_s: 100.0, volts: 5.5 },
        SafeState::Release,
        SafeState::HoldThenRelease { volts: 5.0, after: 1.5 },
    ] {
        the_same(&Plan { limits: SupervisorParams::new(on_fault), ..Plan::new() });
    }
}

#[test]
fn each_path_is_the_planned_one_bit_for_bit_from_its_first_whole_count_on() {
    let table = |interpolation| ReferenceParams::Table(Table { knots: &KNOTS, interpolation });
    let paths = [
        ReferenceParams::Hold,
        ReferenceParams::Ramp(0.3),
        ReferenceParams::Trapezoid(Trapezoid { distance: 0.2, speed: 0.5, acceleration: 5.0 }),
        ReferenceParams::JerkLimited(JerkLimited {
            distance: 0.2,
            speed: 0.5,
            acceleration: 5.0,
            jerk: 90.0,
        }),
        ReferenceParams::MinimumJerk(MinimumJerk { distance: 0.2, duration: 0.75 }),
        ReferenceParams::Sine(Sine { rate: 0.3, amplitude: 0.01, frequency: 3.0, phase: -0.25 }),
        ReferenceParams::Chirp(Chirp {
            rate: 0.3,
            amplitude: 0.01,
            from: 1.0,
            to: 9.0,
            duration: 0.5,
            phase: 0.125,
        }),
        table(Interpolation::Linear),
        table(Interpolation::Cubic),
    ];
    for reference in paths {
        // Within a count; and far off, where the whole counts do not fit an encoder's 32 bits.
        for start in [0, 40_000, -40_000, (-3_000_000_000 << 16) + 5] {
            let plan = Plan { reference, start: FixedCounts(start), ..Plan::new() };
            let (settings, built) = the_same(&plan);
            let path = plan.path();
            let mut moves = false;
            for tick in 0..1000 {
                let (target, planned) = (built.path.target(settings.points(), tick), path(tick));
                assert_eq!(target.position, planned.position, "{reference:?} at {tick}");
                let bits = |t: clutch_core::Target<f32>| (t.velocity.to_bits(), t.acceleration.to_bits());
                assert_eq!(bits(target), bits(planned), "{reference:?} at {tick}");
                moves |= target.velocity != 0.0;
            }
            assert_eq!(moves, reference != ReferenceParams::Hold, "{reference:?}");
            let first = built.path.target(settings.points(), 0).position;
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
            limits: SupervisorParams { jumps, following_error, ..new.limits },
            start: FixedCounts(start),
            watchdog: Micros(times[0]),
            silence: Micros(times[2]),
            host_silence: Micros(times[3]),
            ticks,
            ..new
        };
        let settings = sent(&plan.pairs());
        prop_assert_eq!(settings.numbers, plan.settings().numbers);
        let built = settings.build().unwrap();
        prop_assert_eq!(built.servo, Servo::new(&plan.servo).unwrap());
        prop_assert_eq!(built.supervisor, plan.supervisor());
    }
}

#[test]
fn a_setting_that_was_left_out_is_named_whichever_it_is() {
    let reference = ReferenceParams::Table(Table { knots: &KNOTS, interpolation: Interpolation::Linear });
    let all = Plan { reference, ..Plan::new() }.pairs();
    assert_eq!(all.len(), SETTINGS.len() + 2 * KNOTS.len());
    for missing in 0..all.len() {
        let (mut rest, (key, _)) = (all.clone(), all[missing]);
        rest.remove(missing);
        assert_eq!(sent(&rest).build().unwrap_err(), Misfit::Missing(key), "without {key:#06x}");
    }
}

#[test]
fn a_kind_that_is_not_known_is_named() {
    for (name, kinds) in [("law", 4), ("safe", 4), ("path", 9)] {
        assert_eq!(with(name, kinds).build().unwrap_err(), Misfit::Unknown(key(name)));
        assert_eq!(with(name, u32::MAX.into()).build().unwrap_err(), Misfit::Unknown(key(name)));
    }
}

#[test]
fn a_number_that_a_constructor_refuses_is_told_with_its_value() {
    for (name, value, field) in [
        ("counts_per_rev", 3.0, "counts_per_rev"),
        ("period_us", 0.0, "period"),
        ("dac_bits", 17.0, "bits"),
        ("jumps", 129.0, "jumps"),
    ] {
        let Misfit::Param(e) = with(name, value as u64).build().unwrap_err() else { panic!("{name}") };
        assert_eq!((e.field, e.value), (field, value));
    }
    for (name, value) in [("inertia", -1.0), ("smoothing", 2.0), ("jump", 0.0), ("output_on_invalid", 10.5)] {
        let Misfit::Param(e) = with(name, f32::to_bits(value).into()).build().unwrap_err() else {
            panic!("{name}")
        };
        assert_eq!(e.value, value, "{name}");
    }
    let Misfit::Param(e) = with("path_0", f32::NAN.to_bits().into()).build().unwrap_err() else { panic!() };
    assert!(e.field == "rate" && e.value.is_nan());
    let many_bits = with("dac_bits", 256 + 12).build().unwrap_err();
    assert!(matches!(many_bits, Misfit::Param(e) if e.field == "bits"), "not taken for 12: {many_bits:?}");
}

#[test]
fn points_of_a_table_have_to_rise_in_time() {
    let reference = ReferenceParams::Table(Table { knots: &KNOTS, interpolation: Interpolation::Cubic });
    let mut settings = sent(&Plan { reference, ..Plan::new() }.pairs());
    assert!(settings.set(FIRST_KNOT + 2 * 3, KNOTS[2].time_us));
    let Misfit::Param(e) = settings.build().unwrap_err() else { panic!() };
    assert_eq!((e.field, e.value), ("knots", 3.0));
}

#[test]
fn a_value_fits_its_type_or_is_not_taken() {
    for setting in SETTINGS {
        let wide = matches!(setting.ty, "u64" | "i64");
        for value in [1 << 32, u64::MAX] {
            let mut settings = Settings::default();
            assert_eq!(settings.set(setting.key, value), wide, "{}", setting.name);
            let unchanged = settings.numbers == Settings::default().numbers;
            assert_eq!(unchanged, !wide, "{}", setting.name);
        }
        assert!(Settings::default().set(setting.key, u32::MAX.into()), "{}", setting.name);
    }
}

#[test]
fn settings_have_a_key_each_and_there_are_no_others() {
    let last = FIRST_KNOT + 2 * MAX_KNOTS as u16 - 1;
    for key in 0..=u16::MAX {
        let known = usize::from(key) < SETTINGS.len() || (FIRST_KNOT..=last).contains(&key);
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
    assert_eq!(built.path.target(settings.points(), 255), plan.path()(255));
    let many = Plan { reference: reference(MAX_KNOTS + 1), ..Plan::new() };
    assert_eq!(Settings::new(&many.run_params()).unwrap_err(), Unsupported::Knots(MAX_KNOTS + 1));
    // And a host that does not count.
    let mut settings = sent(&plan.pairs());
    assert!(settings.set(key("knots"), MAX_KNOTS as u64 + 1));
    let beyond = FIRST_KNOT + 2 * MAX_KNOTS as u16;
    assert_eq!(settings.build().unwrap_err(), Misfit::Missing(beyond));
    assert!(settings.points().is_empty());
}

#[test]
fn a_table_without_points_is_refused() {
    let reference = ReferenceParams::Table(Table { knots: &[], interpolation: Interpolation::Linear });
    let settings = sent(&Plan { reference, ..Plan::new() }.pairs());
    assert!(matches!(settings.build().unwrap_err(), Misfit::Param(e) if e.field == "knots"));
}

#[test]
fn an_observer_is_not_for_boards() {
    let velocity = VelocityParams::Observer(ObserverParams::default());
    let plan = Plan { servo: ServoParams { velocity, ..Plan::new().servo }, ..Plan::new() };
    assert_eq!(Settings::new(&plan.run_params()).unwrap_err(), Unsupported::Observer);
}
