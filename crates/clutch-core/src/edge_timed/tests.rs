use super::*;
use crate::{CoulombParams, FrictionMap, MotorActuator, PlantParams};
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

/// Counts per period² of a torque on the paper's shaft, N m.
fn pull(torque: f64) -> f64 {
    torque / 0.0017 * 1e-6 * 20_000.0 / core::f64::consts::TAU
}

/// Friction around a count of a disc that has its mean at count 100, and a thirty-second of it more with each further count.
fn rising(count: i64) -> Place<f64> {
    FrictionMap::new(84, 4, &[2048, 2560, 3072, 3584, 4096, 4608, 5120, 5632, 6144])
        .unwrap()
        .at(FixedCounts::from_counts(count))
}

/// The same at a position, over its mean.
fn rise(counts: f64) -> f64 {
    1.0 + (counts - 100.0) / 32.0
}

/// Velocity after a period, and the way in it, of the paper's shaft that goes at a velocity, counts per period, and that a voltage
/// brakes with a multiple of the friction of a fast one.
fn braked(velocity: f64, volts: f64, friction: f64) -> (f64, f64) {
    let rate = velocity * 1e3 * core::f64::consts::TAU / 20_000.0;
    let stribeck = 0.15 + 0.05 * libm::exp(-rate / 0.001);
    let change = pull(0.047088 - stribeck * friction * 0.14 * volts - 0.001 * rate);
    (velocity + change, velocity + 0.5 * change)
}

fn near(value: f64, expected: f64) -> bool {
    (value - expected).abs() < 1e-9 * expected.abs().max(1.0)
}

#[test]
fn at_the_start_a_shaft_may_as_well_rest_as_go_with_its_path() {
    let f = filter::<f64>();
    let start = |rate: f64| f.start(FixedCounts::from_counts(7), 3.0, rate);
    let belief = start(2.0_f64.to_radians()).belief;
    // 2 °/s are a ninth of a count in a period.
    assert!(near(belief.ww, 1.0 / 81.0) && belief.motion.velocity == 0.0, "{}", belief.ww);
    assert!(near(start(-20.0_f64.to_radians()).belief.ww, 100.0 / 81.0), "as well backwards");
    // Friction is the model's to a quarter; beside it a wave of 0.15 of it, 340 times in the 20 000 counts of a turn.
    let (friction, wave) = (belief.friction, 340.0 / 20_000.0 * core::f64::consts::TAU);
    assert_eq!((friction.mean, friction.ripple, friction.hh), (1.0, 0.0, 0.0625));
    assert!(near(friction.rr, 0.0225) && near(friction.ss, 0.0225 * wave * wave));
    // A target that is none says nothing.
    for rate in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e9, -1e9] {
        assert_eq!(start(rate).belief.ww, 0.0, "{rate} rad/s");
    }
}

#[test]
fn a_voltage_on_its_way_brakes_with_the_friction_of_the_place_at_which_it_arrives() {
    let p = EdgeTimedParams { delay: 1, ..EdgeTimedParams::<f64>::default() };
    let f = EdgeTimed::new(&p, &plant(), Encoder::PAPER, PERIOD).unwrap();
    // Fast, and where friction falls with the velocity; and with a single count back, which is none of a brake's shaft.
    for (velocity, volts) in [(1.0, 3.0), (0.003, 0.5)] {
        for back in [0, 1] {
            let mut state = f.start(FixedCounts::from_counts(100), volts, 0.0);
            f.place(&mut state, FixedCounts::from_counts(100 - back));
            state.belief.motion = belief::Motion { position: 0.25, velocity };
            (state.belief.friction.ripple, state.belief.friction.slope) = (0.1, 0.01);
            state.belief.friction.hr = -0.01;
            let ahead = f.ahead_on(&state, Some(&rising(100 - back)));
            let (after, way) = braked(velocity, volts, 1.1 * rise(100.25));
            let (position, middle) = (0.25 + way, way + 0.5 * after);
            assert!(near(ahead.velocity, after) && near(ahead.position, position), "{ahead:?}, {after}");
            // In the middle of the period in which the next voltage acts.
            let here = rise(100.25 + middle);
            assert!(near(ahead.friction, (1.1 + 0.01 * middle) * here), "{ahead:?}");
            assert!(near(ahead.variance, (0.0625 - 0.02 + 0.0225) * here * here), "{ahead:?}");
        }
    }
}

#[test]
fn a_period_is_braked_with_the_friction_of_the_place_in_its_middle() {
    let f = filter::<f64>();
    // The count stays; the next one; one back, which is none; two back, which a brake's shaft cannot have gone either, but
    // which the filter has to take as they are.
    for (position, read, from) in [(0.1, 100, 100.0), (0.9, 101, 100.0), (0.1, 99, 100.0), (0.1, 98, 100.0)] {
        let mut state = f.start(FixedCounts::from_counts(100), 3.0, 0.0);
        // It knows all, so that no edge and no silence teaches it anything.
        state.belief.motion = belief::Motion { position, velocity: 0.2 };
        state.belief.tt = 0.0;
        let friction = &mut state.belief.friction;
        (friction.hh, friction.rr, friction.ss) = (0.0, 0.0, 0.0);
        state.phase = Phase::Sliding;
        f.update_on(&mut state, FixedCounts::from_counts(read), 3.0, (0.06, 0.0), Some(&rising(read)));
        let (after, way) = braked(0.2, 3.0, rise(from + position + 0.1));
        assert!(near(state.velocity(), after), "at {read}: {}, {after}", state.velocity());
        let ends = state.counts as f64 + state.belief.motion.position;
        assert!(near(ends, from + position + way), "at {read}: {ends}");
    }
}

#[test]
fn friction_of_a_start_without_an_edge_is_a_mean_over_that_of_its_place() {
    let f = filter::<f64>();
    let pace = f.per_period(2.0_f64.to_radians());
    let stopped = |volts: f64, mean: f64, back: i64| {
        let mut state = f.start(FixedCounts::from_counts(108), volts, 0.0);
        f.place(&mut state, FixedCounts::from_counts(108 - back));
        state.belief.motion.position = 0.25;
        state.belief.friction.mean = mean;
        (state.phase, state.silent) = (Phase::Starting, 26.0);
        f.look_for_rest(&mut state, pace, Some(&rising(108 - back)));
        assert!(state.rests() && state.unmoved == 1.0);
        let friction = state.belief.friction;
        assert!(friction.mean == mean && near(friction.rr, (0.15 * mean) * (0.15 * mean)), "{friction:?}");
        friction.level()
    };
    for back in [0, 1] {
        // 0.9 V carry the weight with 2.49 times the model's friction, which is 1.26 of the mean here; and an eighth more holds it.
        let carried = 1.134 * 0.047088 / (0.15 * 0.14 * 0.9) / rise(108.25);
        assert!(near(stopped(0.9, 1.2, back), carried), "{}, {carried}", stopped(0.9, 1.2, back));
    }
    assert_eq!(stopped(4.0, 1.2, 0), 1.2, "a high voltage says nothing new");
    assert_eq!(stopped(0.0, 1.2, 0), 10.0, "nor does one that carries nothing tell more than ten times");
}

#[test]
fn steps_hand_over_their_place_and_a_friction_that_is_weighed_with_the_one_believed() {
    let f = filter::<f64>();
    let mut state = f.start(FixedCounts::from_counts(100), 3.0, 0.0);
    let friction = &mut state.belief.friction;
    (friction.hr, friction.hs, friction.slope) = (0.001, 0.002, 0.003);
    (state.silent, state.gains, state.release, state.phase) = (5.0, 1.0, 3.0, Phase::Sliding);
    f.take_over(&mut state, 0.75, 2.0);
    let (belief, friction) = (state.belief, state.belief.friction);
    // Two standard deviations, a quarter of what was believed and a fifth of the steps': weights of 16 and 25 of 41.
    assert!(near(friction.mean, (16.0 + 25.0 * 2.0) / 41.0), "{}", friction.mean);
    assert!(near(friction.hh, 0.0625 * 16.0 / 41.0), "{}", friction.hh);
    assert!(near(friction.rr, 0.0225 * friction.mean * friction.mean), "{}", friction.rr);
    assert_eq!((friction.ripple, friction.slope, friction.hr, friction.hs), (0.0, 0.0, 0.0, 0.0));
    assert_eq!((belief.motion.position, belief.motion.velocity, belief.tt), (0.75, 0.0, 0.02));
    assert_eq!((state.silent, state.gains, state.release, state.rests), (0.0, 0.0, 0.0, 1.0));
    assert!(state.rests() && state.at_edge == friction);
}

#[test]
fn a_filter_that_gets_a_map_keeps_the_friction_here_and_makes_it_the_mean_of_the_disc() {
    let f = filter::<f64>();
    let mut state = f.start(FixedCounts::from_counts(92), 3.0, 0.0);
    let friction = &mut state.belief.friction;
    (friction.mean, friction.ripple, friction.slope) = (1.1, 0.1, 0.05);
    (friction.hr, friction.hs) = (0.01, 0.02);
    (state.belief.th, state.belief.tr, state.belief.wh, state.belief.wr) = (0.03, 0.01, -0.02, 0.05);
    let known = f.known_from(&state, &rising(92)).belief;
    // 1.2 of the model's friction where the disc has 0.77 of its mean.
    assert!(near(known.friction.mean, 1.2 / rise(92.5)), "{}", known.friction.mean);
    let variance = (0.0625 + 0.02 + 0.0225) / rise(92.5).powi(2);
    assert!(
        near(known.friction.hh, variance),
        "what mean and ripple together were in doubt by is the mean's now"
    );
    assert!(near(known.th, 0.04 / rise(92.5)) && near(known.wh, 0.03 / rise(92.5)), "and what goes with it");
    let left = 0.15 * 1.2 / rise(92.5);
    let wave = 340.0 / 20_000.0 * core::f64::consts::TAU;
    assert!(near(known.friction.rr, left * left) && near(known.friction.ss, left * left * wave * wave));
    assert_eq!((known.friction.ripple, known.friction.slope), (0.0, 0.0));
    assert_eq!((known.friction.hr, known.friction.hs), (0.0, 0.0));
    assert_eq!((known.tr, known.ts, known.wr, known.ws), (0.0, 0.0, 0.0, 0.0));
    assert_eq!((known.motion, known.tt), (state.belief.motion, state.belief.tt));
}

#[test]
fn a_brake_that_lags_is_let_go_for_seven_tenths_of_its_lag_longer() {
    let p = EdgeTimedParams { lag: 0.01, ..EdgeTimedParams::default() };
    let f = EdgeTimed::<f64>::new(&p, &plant(), Encoder::PAPER, PERIOD).unwrap();
    let mut state = f.start(FixedCounts(0), 5.0, 0.0);
    f.let_go(&mut state, 20.0_f64.to_radians());
    // 12.6 periods of the drive, and 7.
    assert_eq!(state.release, 20.0);
}

#[test]
fn a_sensor_finer_than_a_count_is_read_in_parts_of_one() {
    let f = filter::<f64>();
    let fraction = |bits: i64| f.start(FixedCounts(bits), 5.0, 0.0).fraction();
    let count = 1 << FixedCounts::FRACTION_BITS;
    assert_eq!(
        (fraction(7 * count), fraction(7 * count + count / 4), fraction(count / 8 - count)),
        (0.0, 0.25, 0.125)
    );
}

#[test]
fn a_shaft_that_gains_speed_loses_the_friction_by_which_the_curve_falls() {
    let f = filter::<f64>();
    // Over the next hundredth of a count in a period, which is 3.14 thousandths of the paper's 0.001 rad/s.
    let rate = 1e3 * core::f64::consts::TAU / 20_000.0;
    let level = |velocity: f64| (0.15 + 0.05 * libm::exp(-velocity.abs() * rate / 0.001)) / 0.15;
    for velocity in [0.001, 0.01, -0.01, 0.03] {
        let (shape, fall) = f.shape_and_fall(velocity);
        assert!((shape / level(velocity) - 1.0).abs() < 1e-6, "{shape}");
        let expected = 100.0 * (level(velocity) - level(velocity.abs() + 0.01));
        assert!((fall - expected).abs() < 1e-5 * expected, "{fall} for {expected} at {velocity}");
    }
    assert_eq!(f.shape_and_fall(0.0), (0.2 / 0.15, 0.0), "one that has stopped");
    assert_eq!(f.shape_and_fall(1.0).1, 0.0, "one whose curve has ended");
}

#[test]
fn a_period_of_a_lagging_brake_has_the_mean_of_the_voltages_at_its_ends() {
    for (lag, ends) in [(0.003, [1.0, 4.0 - 3.0 * libm::exp(-1.0 / 3.0)]), (0.0, [4.0, 4.0])] {
        let p = EdgeTimedParams { lag, ..EdgeTimedParams::default() };
        let f = EdgeTimed::<f64>::new(&p, &plant(), Encoder::PAPER, PERIOD).unwrap();
        let mut state = f.start(FixedCounts(0), 1.0, 0.0);
        let (_, volts) = f.hear(&mut state, FixedCounts(0), 4.0);
        assert!(near(volts, 0.5 * (ends[0] + ends[1])) && near(state.pad, ends[1]), "{volts}, {}", state.pad);
    }
}

/// The filter of a shaft that a motor drives either way.
fn of_motor() -> EdgeTimed<f64> {
    let motor = MotorActuator { gain: 0.05, preload: 0.25, load_share: 0.0 };
    let motor = PlantParams { actuator: motor.into(), drive_torque: 0.0, ..PlantParams::default() };
    EdgeTimed::new(&EdgeTimedParams::default(), &Plant::new(&motor).unwrap(), Encoder::PAPER, PERIOD).unwrap()
}

#[test]
fn silence_says_that_the_edge_ahead_is_not_reached_whichever_way_a_shaft_goes() {
    let f = of_motor();
    // Volts that balance friction, so that the velocity stays.
    for (velocity, volts, side) in [(0.1, 0.75, 1.0), (-0.1, -0.75, -1.0)] {
        let mut state = f.start(FixedCounts(0), volts, 0.0);
        state.phase = Phase::Sliding;
        state.belief.motion = belief::Motion { position: 0.5 + 0.4 * side, velocity };
        f.update(&mut state, FixedCounts(0), volts, velocity);
        // Without it it would be at the edge.
        let away = 0.5 - (state.belief.motion.position - 0.5) * side;
        assert!(away > 0.1 && away < 0.5, "{velocity}: {away} counts from the edge ahead");
    }
    // A brake's shaft that is let go and has not begun to move: the edge ahead is the upper one.
    let f = filter::<f64>();
    let mut state = f.start(FixedCounts(0), 9.0, 0.0);
    state.phase = Phase::Starting;
    state.belief.motion.position = 0.9;
    f.update(&mut state, FixedCounts(0), 9.0, 0.03);
    assert!(
        state.belief.motion.velocity == 0.0 && state.belief.motion.position < 0.85,
        "{:?}",
        state.belief.motion
    );
}

#[test]
fn an_edge_is_behind_a_shaft_by_half_the_way_of_a_period_whichever_way_it_goes() {
    let f = of_motor();
    for (velocity, expected) in [(0.5, 0.25), (-0.5, 0.75), (7.0, 0.5), (1e-4, 0.01)] {
        let mut state = f.start(FixedCounts(0), 0.0, 0.0);
        state.phase = Phase::Sliding;
        // Nothing is known of the place but the edge.
        state.belief.tt = 1e9;
        f.crossed(&mut state, f64::signum(velocity), velocity);
        let position = state.belief.motion.position;
        assert!((position - expected).abs() < 1e-6, "{velocity}: {position}");
    }
}

#[test]
fn four_edges_make_up_for_a_rest() {
    let f = filter::<f64>();
    let mut state = f.start(FixedCounts(0), 2.2, 0.03);
    state.rests = 1.0;
    let rested: Vec<bool> = (1..=5)
        .map(|n| {
            f.update(&mut state, FixedCounts::from_counts(n), 2.2, 0.03);
            state.has_rested()
        })
        .collect();
    assert_eq!(rested, [true, true, true, false, false]);
}

#[test]
fn each_rest_makes_the_friction_at_the_last_edge_more_doubtful_than_the_one_before() {
    let f = filter::<f64>();
    let mut state = f.start(FixedCounts(0), 2.2, 0.03);
    state.at_edge.mean = 1.2;
    for rests in 1..=3 {
        (state.phase, state.silent) = (Phase::Sliding, 31.0);
        // A tenth of a count in a period: three of them in thirty.
        f.look_for_rest(&mut state, 0.1, None);
        let more = 0.12 * f64::from(rests);
        assert!(state.rests() && near(state.belief.friction.hh, 0.0625 + more * more), "{rests}");
        assert_eq!((state.belief.friction.mean, state.rests), (1.2, f64::from(rests)));
    }
}
