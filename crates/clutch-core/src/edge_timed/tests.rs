use super::*;
use crate::{CoulombParams, MotorActuator, PlantParams};
use std::vec::Vec;

const PERIOD: Micros = Micros(1000);

fn plant<T: Real>() -> Plant<T> {
    Plant::new(&PlantParams::default()).unwrap()
}

fn filter<T: Real>() -> EdgeTimed<T> {
    EdgeTimed::new(&EdgeTimedParams::default(), &plant(), Encoder::PAPER, PERIOD).unwrap()
}

/// Reading of the paper's encoder at an angle in counts.
fn read(counts: f64) -> FixedCounts {
    FixedCounts::from_counts(counts.floor() as i64)
}

/// The filter behind a shaft that goes at `rate` (rad/s) under the voltage that keeps it, for so many periods, and its velocity in
/// each of the last 1000.
fn steady<T: Real>(rate: f64, periods: i32) -> (EdgeTimedState<T>, Vec<f64>) {
    let f = filter::<T>();
    let counts = rate * 1e-3 * Encoder::PAPER.counts_per_radian::<f64>();
    let volts = T::from_f64((0.047088 - 0.001 * rate) / (0.15 * 0.14));
    let mut state = f.start(read(0.0), volts, T::from_f64(rate));
    let mut seen = Vec::new();
    for k in 1..=periods {
        f.update(&mut state, read(counts * f64::from(k)), volts, T::from_f64(rate));
        if k > periods - 1000 {
            seen.push(f.rad_per_s(state.velocity()).to_f64());
        }
    }
    (state, seen)
}

fn rms(values: &[f64], truth: f64) -> f64 {
    (values.iter().map(|v| (v - truth) * (v - truth)).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn a_steady_velocity_is_known_within_a_fraction_of_what_a_difference_of_counts_makes_of_it() {
    // (5) with 0.2 errs by 1.1 °/s RMS at any rate, the observer by 0.92 °/s: see `observer`.
    for (rate, most) in [(0.5_f64, 0.40), (2.0, 0.05), (20.0, 0.60), (100.0, 0.60)] {
        let rate = rate.to_radians();
        let error = rms(&steady::<f64>(rate, 5000).1, rate).to_degrees();
        assert!(error < most, "{rate} rad/s: {error} °/s");
        let single = rms(&steady::<f32>(rate, 5000).1, rate).to_degrees();
        assert!((single - error).abs() < 0.05, "{rate} rad/s: {single} °/s in f32, {error} °/s in f64");
    }
}

#[test]
fn friction_is_learnt_from_the_voltage_that_keeps_a_velocity() {
    // The model's friction is 1.5 times what there is: half as much voltage again keeps the velocity.
    let f = filter::<f64>();
    let rate = 2.0_f64.to_radians();
    let counts = f.per_period(rate);
    let volts = 1.5 * (0.047088 - 0.001 * rate) / (0.15 * 0.14);
    let mut state = f.start(read(0.0), volts, rate);
    for k in 1..=3000 {
        f.update(&mut state, read(counts * f64::from(k)), volts, rate);
    }
    let ahead = f.ahead(&state);
    assert!((ahead.friction - 1.0 / 1.5).abs() < 0.01, "{} times the model's", ahead.friction);
    assert!(ahead.variance < 4e-4, "{}", ahead.variance);
}

#[test]
fn silence_keeps_the_position_within_its_count() {
    let (mut state, _) = steady::<f64>(2.0_f64.to_radians(), 2000);
    let f = filter::<f64>();
    let at = FixedCounts::from_counts(state.counts);
    // The shaft has stopped: under the voltage that kept it the belief would go on.
    let volts = 2.2;
    for _ in 0..20 {
        f.update(&mut state, at, volts, 2.0_f64.to_radians());
        assert!(state.belief.motion.position < 1.2, "{} counts", state.belief.motion.position);
    }
    assert!(f.rad_per_s(state.velocity()).to_degrees() < 1.2);
}

#[test]
fn a_shaft_that_is_silent_for_three_counts_rests_and_its_friction_is_that_before() {
    let rate = 2.0_f64.to_radians();
    let (mut state, _) = steady::<f64>(rate, 2000);
    let f = filter::<f64>();
    let at = FixedCounts::from_counts(state.counts);
    let silent_before = state.silent;
    let friction = state.at_edge.mean;
    let mut periods = 0;
    while !state.rests() {
        f.update(&mut state, at, 2.2, rate);
        periods += 1;
        assert!(periods < 100, "never");
    }
    // Three counts at 2 °/s are 27 periods.
    assert_eq!(f64::from(periods) + silent_before, 28.0);
    assert_eq!(
        (state.belief.friction.mean, state.belief.motion.velocity, state.belief.motion.position),
        (friction, 0.0, 0.5)
    );
}

#[test]
fn counts_that_it_was_to_gain_on_the_path_shorten_the_silence() {
    let rate = 2.0_f64.to_radians();
    let (state, _) = steady::<f64>(rate, 2000);
    let f = filter::<f64>();
    let at = FixedCounts::from_counts(state.counts);
    let silence = |gains: f64| {
        let mut state = state;
        let mut periods = state.silent as i32;
        while !state.rests() {
            f.update_on(&mut state, at, 2.2, (rate, gains), None);
            periods += 1;
            assert!(periods < 100, "never");
        }
        periods
    };
    // The path goes 0.111 counts in a period, and it was to gain 0.1 on that in each since, of which one had none.
    assert_eq!((silence(0.0), silence(0.1)), (28, 16));
    // Its gain up to an edge is forgotten there.
    let mut moved = state;
    f.update_on(&mut moved, at, 2.2, (rate, 2.9), None);
    f.update_on(&mut moved, FixedCounts::from_counts(state.counts + 1), 2.2, (rate, 0.0), None);
    assert_eq!((moved.gains, moved.silent, moved.rests()), (0.0, 0.0, false));
}

#[test]
fn a_shaft_that_stays_at_rest_with_the_path_teaches_nothing() {
    let rate = 2.0_f64.to_radians();
    for scalar_is_single in [false, true] {
        let (friction, moved, periods) =
            if scalar_is_single { stays::<f32>(rate) } else { stays::<f64>(rate) };
        assert!((friction - 1.0).abs() < 0.1, "{friction} times the model's friction");
        assert!(moved.abs() < 1e-9 && periods <= 30, "{moved} counts/period, rests after {periods}");
    }
}

/// Friction, velocity and the time to be taken to rest of a shaft that has stopped with its path for a million periods.
fn stays<T: Real>(rate: f64) -> (f64, f64, i32) {
    let (mut state, _) = steady::<T>(rate, 2000);
    let f = filter::<T>();
    let at = FixedCounts::from_counts(state.counts);
    let mut periods = 0;
    for k in 0..1_000_000 {
        f.update(&mut state, at, T::from_f64(6.0), T::ZERO);
        periods = if state.rests() { periods } else { k + 1 };
        assert!(state.belief.is_finite());
    }
    (f.ahead(&state).friction.to_f64(), state.velocity().to_f64(), periods)
}

#[test]
fn a_shaft_is_let_go_for_the_time_that_the_drive_takes_and_until_an_edge_comes() {
    let f = filter::<f64>();
    let mut state = f.start(FixedCounts(0), 5.0, 0.0);
    // 27.7 rad/s²: 1.59 °/s in a period.
    for (rate, periods) in [(0.01_f64, 1), (2.0, 1), (4.0, 3), (20.0, 13), (1e6, 250)] {
        f.let_go(&mut state, rate.to_radians());
        let mut n = 0;
        while state.lets_go() {
            f.update(&mut state, FixedCounts(0), 0.0, rate.to_radians());
            n += 1;
        }
        assert_eq!(n, periods, "{rate} °/s");
    }
    f.let_go(&mut state, 20.0_f64.to_radians());
    f.update(&mut state, FixedCounts::from_counts(1), 0.0, 20.0_f64.to_radians());
    assert!(!state.lets_go() && !state.starts());
}

#[test]
fn a_brake_that_two_starts_did_not_move_is_let_go_for_a_count_and_a_half_and_a_motor_is_not() {
    let motor = MotorActuator { gain: 0.05, preload: 0.25, load_share: 0.0 };
    let motor = PlantParams { actuator: motor.into(), drive_torque: 0.0, ..PlantParams::default() };
    // A fall of a count and a half takes 5.8 periods, and one more is for what is not known. Nothing but the motor drives the
    // other: it has the longest time from the first.
    for (model, periods) in [(PlantParams::default(), [1, 1, 7]), (motor, [250; 3])] {
        let f =
            EdgeTimed::new(&EdgeTimedParams::default(), &Plant::new(&model).unwrap(), Encoder::PAPER, PERIOD)
                .unwrap();
        let rate = 0.5_f64.to_radians();
        let mut state = f.start(FixedCounts(0), 5.0, rate);
        for expected in periods {
            f.let_go(&mut state, rate);
            let (mut released, mut n) = (0, 0);
            while !state.rests() {
                released += i32::from(state.lets_go());
                f.update(&mut state, FixedCounts(0), 0.9, rate);
                n += 1;
                assert!(n < 1000, "never");
            }
            assert_eq!(released, expected);
        }
    }
}

#[test]
fn friction_without_a_curve_has_one_shape_at_all_velocities() {
    let model = PlantParams { friction: CoulombParams::default().into(), ..PlantParams::default() };
    let f = EdgeTimed::<f64>::new(
        &EdgeTimedParams::default(),
        &Plant::new(&model).unwrap(),
        Encoder::PAPER,
        PERIOD,
    )
    .unwrap();
    assert_eq!((f.shape(0.0), f.shape(0.01), f.shape(10.0)), (1.0, 1.0, 1.0));
    let stribeck = filter::<f64>();
    assert!(stribeck.shape(1e-3) > 1.05 && (stribeck.shape(10.0) - 1.0).abs() < 1e-6);
}

#[test]
fn friction_that_stops_a_shaft_before_its_first_edge_is_above_what_the_voltage_carried() {
    let f = filter::<f64>();
    let rate = 2.0_f64.to_radians();
    let mut state = f.start(FixedCounts(0), 5.0, rate);
    f.let_go(&mut state, rate);
    let volts = 0.9;
    let mut n = 0;
    while !state.rests() {
        f.update(&mut state, FixedCounts(0), volts, rate);
        n += 1;
        assert!(n < 100, "never");
    }
    // It carries 2.2423/0.9 times the model's friction.
    let carried = 2.242286 / volts;
    assert!(state.belief.friction.level() > 1.13 * carried, "{}", state.belief.friction.level());
}

#[test]
fn a_voltage_acts_after_the_delay_and_through_the_lag() {
    let p = EdgeTimedParams { delay: 2, lag: 0.003, ..EdgeTimedParams::<f64>::default() };
    let f = EdgeTimed::new(&p, &plant(), Encoder::PAPER, PERIOD).unwrap();
    let mut state = f.start(FixedCounts(0), 1.0, 0.0);
    let pads: Vec<f64> = (0..5)
        .map(|_| {
            f.update(&mut state, FixedCounts(0), 4.0, 0.0);
            state.pad
        })
        .collect();
    let step = |n: i32| 4.0 - 3.0 * libm::exp(-f64::from(n) / 3.0);
    for (pad, expected) in pads.iter().zip([1.0, 1.0, step(1), step(2), step(3)]) {
        assert!((pad - expected).abs() < 1e-12, "{pads:?}");
    }
    // Two more periods ahead.
    assert!((f.ahead(&state).pad - step(5)).abs() < 1e-12);
    let through = f.through_lag(2.0, 1.0);
    assert!((1.0 + (through - 1.0) * (1.0 - libm::exp(-1.0 / 3.0)) - 2.0).abs() < 1e-12);
}

#[test]
fn each_bad_parameter_is_named() {
    let d = EdgeTimedParams::<f64>::default();
    for (bad, field) in [
        (EdgeTimedParams { delay: 4, ..d }, "delay"),
        (EdgeTimedParams { lag: 1.0, ..d }, "lag"),
        (EdgeTimedParams { waves: 1000.0, ..d }, "waves"),
        (EdgeTimedParams { walk: 0.0, ..d }, "walk"),
        (EdgeTimedParams { silence: 1.0, ..d }, "silence"),
    ] {
        let e = EdgeTimed::new(&bad, &plant(), Encoder::PAPER, PERIOD).unwrap_err();
        assert_eq!(e.field(), field);
    }
}

proptest::proptest! {
    #[test]
    fn no_counts_and_no_voltage_make_the_belief_a_non_number(
        steps in proptest::collection::vec((proptest::prelude::any::<i64>(), -1e3_f32..1e3, proptest::prelude::any::<f32>()), 1..40),
    ) {
        let f = filter::<f32>();
        let mut state = f.start(FixedCounts(0), 0.0, 0.03);
        for (position, volts, rate) in steps {
            f.update(&mut state, FixedCounts(position), volts, rate);
            let ahead = f.ahead(&state);
            proptest::prop_assert!(state.belief.is_finite());
            proptest::prop_assert!(ahead.friction >= 0.05 && ahead.velocity.is_finite());
        }
    }
}

#[test]
fn an_encoder_has_the_waves_that_it_sees_or_those_of_the_default() {
    let default = EdgeTimedParams::<f64>::default().waves;
    assert_eq!(waves_seen(default, 20_000), default);
    for counts in [50, 500, 800] {
        let params = EdgeTimedParams { waves: waves_seen(default, counts), ..EdgeTimedParams::default() };
        let encoder = Encoder::new::<f64>(counts).unwrap();
        assert!(
            params.waves < default && EdgeTimed::new(&params, &plant(), encoder, PERIOD).is_ok(),
            "{counts}"
        );
        let more = EdgeTimedParams { waves: 1.02 * params.waves, ..params };
        assert!(EdgeTimed::new(&more, &plant(), encoder, PERIOD).is_err(), "{counts}");
    }
}
