//! The duties of every law of the core, with any gains.

use clutch_core::edge_timed::EdgeTimedParams;
use clutch_core::law::{
    Beside, ControlLaw, CtcParams, DobParams, GlideParams, Law, LawParams, Limit, OutputParams, PdParams,
    PidParams, SmcIntegralParams, SmcParams, SmcSignParams, SuperTwistingParams, Terms, Tick,
};
use clutch_core::reference::ReferenceParams;
use clutch_core::{Counts, FixedCounts, PlantParams, Servo, ServoParams, Target};
use clutch_core::{CountsOverTimeParams, ObserverParams, SmoothedDerivativeParams, VelocityParams};
use clutch_sim::{RigParams, RunSpec, simulate};
use proptest::prelude::*;

fn laws() -> impl Strategy<Value = LawParams> {
    let gain = 0.0_f64..1e4;
    prop_oneof![
        (gain.clone(), gain.clone()).prop_map(|(kp, kd)| LawParams::Pd(PdParams { kp, kd })),
        (0.0..200.0_f64, gain.clone(), gain.clone())
            .prop_map(|(outer_gain, kp, kd)| LawParams::Ctc(CtcParams { outer_gain, kp, kd })),
        (gain.clone(), gain.clone(), 1.0..500.0_f64, 1e-3..10.0_f64)
            .prop_map(|(kp, kd, slope, boundary)| LawParams::Smc(SmcParams { kp, kd, slope, boundary })),
        (gain.clone(), gain.clone(), 1.0..500.0_f64)
            .prop_map(|(kp, kd, slope)| LawParams::SmcSign(SmcSignParams { kp, kd, slope })),
        (1e-3_f64..1e4, 1e-3_f64..1e4, 1.0..500.0_f64, 0.0..1.0_f64)
            .prop_map(|(k1, k2, slope, boundary)| { SuperTwistingParams { k1, k2, slope, boundary }.into() }),
        (1e-3_f64..1e4, gain.clone(), 1.0..500.0_f64, gain.clone(), 1e-3..10.0_f64).prop_map(
            |(kp, kd, slope, integral, boundary)| {
                SmcIntegralParams { kp, kd, slope, integral, boundary }.into()
            }
        ),
        (gain.clone(), gain.clone(), 1e-3..1e3_f64).prop_map(|(kp, kd, bandwidth)| DobParams {
            kp,
            kd,
            bandwidth
        }
        .into()),
        (0.0..500.0_f64, 1.0..500.0_f64, 0.4..1.0_f64, 1.0..10.0_f64).prop_map(|(kp, kd, floor, cap)| {
            GlideParams { kp, kd, floor, cap, ..GlideParams::default() }.into()
        }),
        (gain.clone(), gain.clone(), gain, 0.0..1.0_f64, 0.001..1.0_f64).prop_map(
            |(kp, ki, kd, derivative_time, tracking_time)| {
                LawParams::Pid(PidParams {
                    kp,
                    ki,
                    kd,
                    derivative_time,
                    tracking_time,
                    ..PidParams::default()
                })
            }
        ),
    ]
}

fn law(p: &LawParams) -> Law<f64> {
    Law::new(p, &Beside::paper(&PlantParams::default(), &OutputParams::default())).unwrap()
}

fn any_tick() -> impl Strategy<Value = Tick<f64>> {
    (any::<f64>(), any::<f64>(), any::<f64>(), any::<f64>()).prop_map(|(a, b, c, d)| Tick {
        error: a,
        error_rate: b,
        target_velocity: c,
        target_acceleration: d,
    })
}

fn small_tick() -> impl Strategy<Value = Tick<f64>> {
    (-0.1_f64..0.1, -1.0_f64..1.0).prop_map(|(error, error_rate)| Tick {
        error,
        error_rate,
        target_velocity: 0.05,
        target_acceleration: 0.0,
    })
}

#[test]
fn every_law_follows_with_each_velocity_source_in_either_scalar() {
    for law in LawParams::all().into_iter().filter(LawParams::follows) {
        for velocity in [
            VelocityParams::SmoothedDerivative(SmoothedDerivativeParams::default()),
            VelocityParams::CountsOverTime(CountsOverTimeParams::default()),
            VelocityParams::EdgeTimed(EdgeTimedParams::default()),
            VelocityParams::Observer(ObserverParams::default()),
        ] {
            let path = ReferenceParams::ramp(20.0_f64.to_radians());
            let mut spec = RunSpec::new(RigParams::paper(), law, path);
            spec.velocity = velocity;
            spec.run.duration = 2.0;
            for metrics in [simulate::<f64>(&spec).unwrap().metrics, simulate::<f32>(&spec).unwrap().metrics]
            {
                let error = metrics.max_error_rad.to_degrees();
                assert!(error < 0.2, "{law:?} with {velocity:?}: {error}°");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, rng_seed: proptest::test_runner::RngSeed::Fixed(2), ..ProptestConfig::default() })]

    #[test]
    fn no_measurement_makes_a_law_leave_its_limits(p in laws(), tick in any_tick()) {
        let c = law(&p).update(&mut Default::default(), &tick);
        prop_assert!((0.0..=10.0).contains(&c.voltage));
        if c.limit == Limit::Invalid { prop_assert_eq!(c.voltage, 10.0, "a brake that cannot know, brakes"); }
    }

    #[test]
    fn a_law_answers_again_after_the_wildest_measurement(p in laws(), wild in any_tick(), tick in small_tick()) {
        let law = law(&p);
        let mut state = Default::default();
        law.update(&mut state, &wild);
        let after = law.update(&mut state, &tick);
        if matches!(p, LawParams::Pid(_)) {
            // It remembers, but no more than its output can give.
            prop_assert!(after.limit != Limit::Invalid && (0.0..=10.0).contains(&after.voltage));
            let integral = Terms::values(&after.terms)[1];
            prop_assert!(integral.abs() <= 10.0 + 1e3, "{} V", integral);
        } else if let LawParams::SuperTwisting(_) | LawParams::SmcIntegral(_) | LawParams::Dob(_) = p {
            // So do these: no memory is beyond what the output, or the layer, can give.
            prop_assert!(after.limit != Limit::Invalid && (0.0..=10.0).contains(&after.voltage));
            let (place, most) = match p {
                LawParams::SuperTwisting(_) => (2, 10.0),
                LawParams::SmcIntegral(p) => (1, p.boundary),
                _ => (1, 10.0 * 0.15 * 0.14),
            };
            prop_assert!(Terms::values(&after.terms)[place].abs() <= most * (1.0 + 1e-12), "{:?}", after.terms);
        } else if matches!(p, LawParams::Glide(_)) {
            // It remembers a period that has passed; none of its terms is beyond measure.
            prop_assert!(after.limit != Limit::Invalid && (0.0..=10.0).contains(&after.voltage));
            prop_assert!(Terms::values(&after.terms).iter().all(|x| x.abs() < 1e6), "{:?}", after.terms);
        } else {
            prop_assert_eq!(after, law.update(&mut Default::default(), &tick));
        }
    }

    #[test]
    fn a_shaft_further_ahead_is_never_braked_less(p in laws(), tick in small_tick(), further in 0.0_f64..0.1) {
        // At one error rate; the K_d term of (31) turns with the sign of σ, so ė = 0 there.
        let tick = Tick { error_rate: 0.0, ..tick };
        let ahead = Tick { error: tick.error - further, ..tick };
        let volts = |t| law(&p).update(&mut Default::default(), t).voltage;
        prop_assert!(volts(&ahead) >= volts(&tick));
    }

    #[test]
    fn one_input_gives_one_output(p in laws(), tick in any_tick()) {
        let law = law(&p);
        let a = law.update(&mut Default::default(), &tick);
        let b = law.update(&mut Default::default(), &tick);
        prop_assert_eq!(a.voltage.to_bits(), b.voltage.to_bits());
    }

    #[test]
    fn the_boundary_layer_is_the_sign_function_outside_itself(tick in small_tick(), boundary in 1e-3_f64..0.5) {
        let sat = law(&LawParams::Smc(SmcParams { boundary, ..SmcParams::default() }));
        let sign = law(&LawParams::SmcSign(SmcSignParams::default()));
        let sigma = 70.0 * tick.error + tick.error_rate;
        prop_assume!(sigma.abs() > boundary && (sigma * tick.error_rate).abs() > boundary);
        let volts = |l: &Law<f64>| l.update(&mut Default::default(), &tick).voltage;
        prop_assert_eq!(volts(&sat), volts(&sign));
    }

    #[test]
    fn a_bumpless_start_begins_at_the_voltage_it_finds(p in laws(), tick in small_tick(), applied in 0.0_f64..10.0) {
        let out = OutputParams { bumpless_time: 0.05, ..OutputParams::default() };
        let law = Law::new(&p, &Beside::paper(&PlantParams::default(), &out)).unwrap();
        let mut state = law.start(&tick, applied);
        let first = law.update(&mut state, &tick).voltage;
        // A demand of 1e6 V loses ten digits of the volts added to it.
        prop_assert!((first - applied).abs() < 1e-6, "{first} instead of {applied}");
    }

    #[test]
    fn a_servo_started_anywhere_on_the_counter_gives_the_same_codes(offset in any::<i32>(), p in laws()) {
        let servo = Servo::<f64>::new(&ServoParams::paper(p)).unwrap();
        let codes = |zero: i32| {
            let target = |k: i64| Target {
                position: FixedCounts::from_counts(i64::from(zero)).plus(FixedCounts(k * 7281)),
                velocity: 0.0349,
                acceleration: 0.0,
            };
            let mut state = servo.start(Counts(zero), &target(0), 2.0);
            (0..50).map(|k| {
                let counts = Counts(zero.wrapping_add(k / 7));
                servo.tick(&mut state, counts, &target(i64::from(k))).code
            }).collect::<Vec<_>>()
        };
        prop_assert_eq!(codes(0), codes(offset));
    }
}
