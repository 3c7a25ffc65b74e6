//! Single intervals: reference numbers, hard break-aways, and an interval in parts.

use clutch_core::{ActuatorParams, PlantParams, StribeckParams};
use clutch_sim::drive::{ChirpDrive, Drive};
use clutch_sim::engine::{DormandPrince, Engine, Event, EventKind, ExactFlow, Input, Model, Shaft, Volts};
use clutch_sim::ripple::{Ripple, RippleParams};
use clutch_tests::{engines, model};
use proptest::prelude::*;

fn stribeck(mu_static: f64, mu_dynamic: f64, stribeck_velocity: f64) -> StribeckParams {
    StribeckParams { mu_static, mu_dynamic, stribeck_velocity, ..StribeckParams::default() }
}

fn input(drive: &Drive, volts: f64, duration: f64) -> Input<'_> {
    Input { time: 0.0, duration, origin: 0.0, volts: Volts::Held(volts), drive, noise: 0.0 }
}

fn moved(engine: &mut dyn Engine, model: &Model, input: &Input<'_>, velocity: f64) -> (Shaft, Vec<Event>) {
    let (mut shaft, mut events) = (Shaft::new(0.0, velocity), Vec::new());
    engine.advance(model, input, &mut shaft, &mut events).expect("the motion can be followed");
    (shaft, events)
}

/// Gain of the paper's brake, N m/V per unit of μ.
const GAIN: f64 = 0.14;

/// The shaft of Table 1 at rest under a voltage whose static limit is a little below the torque: the time to 2.5 Stribeck
/// velocities, by two independent quadratures.
#[test]
fn a_soft_break_away_takes_the_time_that_quadrature_gives() {
    for (excess, damping, seconds) in [
        (1e-6, 0.0, 1.70218766907e-3),
        (1e-9, 0.0, 2.69983781296e-3),
        (1e-6, 0.001, 1.70235371e-3),
        (1e-9, 0.001, 2.70008863e-3),
    ] {
        let plant = PlantParams { viscous_damping: damping, ..PlantParams::default() };
        let torque = plant.drive_torque;
        let volts = (torque - excess) / (0.2 * GAIN);
        let drive = Drive::Constant(torque);
        // The excess itself is a difference: its digits decide. 1e-9 s is 1e-5 of the speed here.
        for (name, mut engine) in engines() {
            let (shaft, events) = moved(engine.as_mut(), &model(&plant), &input(&drive, volts, seconds), 0.0);
            assert!((shaft.velocity / 0.0025 - 1.0).abs() < 1e-5, "{name}: {} rad/s", shaft.velocity);
            assert_eq!(events.len(), 1, "{name}");
        }
    }
}

#[test]
fn much_drag_in_the_layer_is_followed() {
    let plant = PlantParams {
        inertia: 1e-3,
        viscous_damping: 0.05,
        actuator: ActuatorParams::brake(GAIN),
        friction: stribeck(0.2, 0.1, 0.1).into(),
        ..PlantParams::default()
    };
    let drive = Drive::Constant(0.05);
    for ((name, mut engine), tolerance) in engines().into_iter().zip([1e-8, 5e-10]) {
        let (shaft, _) = moved(engine.as_mut(), &model(&plant), &input(&drive, 2.0, 20e-3), 0.2);
        assert!((shaft.position / 5.4196106505e-3 - 1.0).abs() < tolerance, "{name}: {}", shaft.position);
        assert!((shaft.velocity / 0.3290117386 - 1.0).abs() < tolerance, "{name}: {}", shaft.velocity);
    }
}

/// 0.5 + 0.6 sin(2π 40 t) of the static limit passes it at asin(5/6)/(2π 40), and comes back within the interval.
#[test]
fn a_torque_that_rises_and_falls_within_an_interval_breaks_the_shaft_away() {
    let plant = PlantParams::default();
    let limit = 0.2 * GAIN * 2.0;
    let w = std::f64::consts::TAU * 40.0;
    let drive = Drive::Sines { mean: 0.5 * limit, sines: vec![(0.6 * limit, w, 0.0)] };
    let (_, events) = moved(&mut DormandPrince::default(), &model(&plant), &input(&drive, 2.0, 0.1), 0.0);
    assert_eq!(events[0].kind, EventKind::BreakAway);
    assert!((events[0].time - (0.5_f64 / 0.6).asin() / w).abs() < 1e-9, "{events:?}");
}

/// The peak of the torque is above the limit by a millionth, for 14 µs of 8 ms.
#[test]
fn a_short_peak_above_the_limit_is_not_stepped_over() {
    let plant = PlantParams::default();
    let limit = 0.2 * GAIN * 2.0;
    let w = std::f64::consts::TAU * 33.0;
    for (share, events) in [(1.0 + 1e-6, 1), (1.0 - 1e-6, 0)] {
        let drive = Drive::Sines { mean: 0.0, sines: vec![(share * limit, w, 0.3)] };
        let (shaft, seen) =
            moved(&mut DormandPrince::default(), &model(&plant), &input(&drive, 2.0, 8e-3), 0.0);
        assert_eq!(seen.iter().filter(|e| e.kind == EventKind::BreakAway).count(), events, "{shaft:?}");
    }
}

/// A brake that opens through a lag lets go where its voltage has fallen to the torque.
#[test]
fn a_brake_that_opens_with_a_lag_lets_go_at_the_instant_of_its_curve() {
    let plant = PlantParams::default();
    let drive = Drive::Constant(plant.drive_torque);
    for lag in [1e-3, 1e-5, 1e-7] {
        let volts = Volts::Lag { from: 5.0, to: 1.0, time_constant: lag };
        let opening = Input { volts, ..input(&drive, 0.0, 5e-3) };
        let (_, events) = moved(&mut DormandPrince::default(), &model(&plant), &opening, 0.0);
        let holding = plant.drive_torque / (0.2 * GAIN);
        let expected = lag * ((5.0 - 1.0) / (holding - 1.0)).ln();
        assert!(
            (events[0].time - expected).abs() < 1e-9 * lag.max(1e-6),
            "{lag} s: {events:?}, {expected} s"
        );
    }
}

#[test]
fn noise_below_the_limit_moves_a_shaft_at_the_limit_by_nothing_in_an_hour() {
    let plant = PlantParams::default();
    let m = model(&plant);
    // The voltage holds 1e-6 N m more than the drive; the noise stays below that.
    let volts = (plant.drive_torque + 1e-6) / (0.2 * GAIN);
    let drive = Drive::Constant(plant.drive_torque);
    for (name, mut engine) in engines() {
        let (mut shaft, mut events) = (Shaft::new(0.3, 0.0), Vec::new());
        for tick in 0..3_600_000_u32 {
            let noise = 9.99e-7 * f64::from(tick.wrapping_mul(2_654_435_761)) / f64::from(u32::MAX);
            let held = Input { noise, ..input(&drive, volts, 1e-3) };
            engine.advance(&m, &held, &mut shaft, &mut events).unwrap();
        }
        assert_eq!((shaft.position, shaft.velocity, events.len()), (0.3, 0.0, 0), "{name}");
    }
}

/// A lagging brake closes on a shaft that noise has just let go: it stops within the first step from rest.
#[test]
fn a_shaft_that_breaks_away_under_a_closing_brake_stops_again() {
    let plant = PlantParams::default();
    let drive = Drive::Constant(plant.drive_torque);
    for lag in [1e-3, 1e-4] {
        for share in [1e-3, 1e-4, 1e-5, 1e-8] {
            // At the sample the torque is above what 1.7 V hold, by so much.
            let noise = 0.2 * GAIN * 1.7 * (1.0 + share) - plant.drive_torque;
            let volts = Volts::Lag { from: 1.7, to: 2.5, time_constant: lag };
            let closing = Input { volts, noise, ..input(&drive, 0.0, 1e-3) };
            let (shaft, events) = moved(&mut DormandPrince::default(), &model(&plant), &closing, 0.0);
            let kinds: Vec<EventKind> = events.iter().map(|e| e.kind).collect();
            assert_eq!(kinds, [EventKind::BreakAway, EventKind::Stick], "{lag} s, {share}: {shaft:?}");
        }
    }
}

/// Torques between two roundings of the friction at rest: whatever is decided, the interval ends.
#[test]
fn a_torque_within_the_last_bit_of_friction_ends_the_interval() {
    let mut tried = 0;
    for mu_d in [0.02, 0.04, 0.15, 0.17, 0.47] {
        for mu_s in [mu_d, 0.44, 0.46, 0.11] {
            for (gain, volts) in [(0.14, 3.61), (0.48, 5.1), (0.14, 5.0)] {
                let friction = stribeck(mu_s, mu_d, 0.001).into();
                let plant =
                    PlantParams { actuator: ActuatorParams::brake(gain), friction, ..PlantParams::default() };
                let m = model(&plant);
                let holds = m.plant.break_away_torque(volts);
                let mut torque = holds * (1.0 - 4.0 * f64::EPSILON);
                while torque <= holds * (1.0 + 4.0 * f64::EPSILON) {
                    for (name, mut engine) in engines() {
                        let (shaft, _) =
                            moved(engine.as_mut(), &m, &input(&Drive::Constant(torque), volts, 1e-3), 0.0);
                        assert!(shaft.position.abs() < 1e-3, "{name}: {shaft:?}");
                    }
                    torque = torque.next_up();
                    tried += 1;
                }
            }
        }
    }
    assert!(tried > 500, "{tried}");
}

/// A motion from just above the unstable balance towards the stable one, with drag as strong as the layer: 1/φ is steep at
/// both ends. Against Dormand–Prince, whose steps know nothing of balances.
#[test]
fn a_motion_between_two_balances_takes_its_time() {
    // G = 1/s, q = 3.2015158335934384/s and φ = 2.4181180482019712e-4/s at s = 0.5, in units of v_s.
    let (start, slip, rate, v_s) = (0.5_f64, 3.2015158335934384, 2.4181180482019712e-4, 0.1);
    let (inertia, gain, volts, mu_d) = (0.01, 1.0, 1.0, 0.1);
    let layer = slip * start.exp(); // K = b Δμ/(J v_s)
    let mu_s = mu_d + layer * inertia * v_s / (gain * volts);
    let drive = rate + start + slip; // A = φ + G s + q
    let plant = PlantParams {
        inertia,
        drive_torque: drive * inertia * v_s + gain * volts * mu_d,
        viscous_damping: inertia,
        actuator: ActuatorParams::brake(gain),
        friction: stribeck(mu_s, mu_d, v_s).into(),
    };
    let torque = Drive::Constant(plant.drive_torque);
    for seconds in [1.0, 3.0, 4.494767772213033, 7.0, 9.0, 12.0] {
        let [a, b] = engines().map(|(_, mut engine)| {
            moved(engine.as_mut(), &model(&plant), &input(&torque, volts, seconds), start * v_s).0
        });
        // From here the layer multiplies a rounding of the start by some thousands.
        assert!((a.velocity - b.velocity).abs() < 1e-6 * v_s, "{seconds} s: {a:?} {b:?}");
        assert!((a.position - b.position).abs() < 1e-6 * v_s * seconds, "{seconds} s: {a:?} {b:?}");
    }
}

/// The drive that moves the shaft, by number.
fn drive(kind: u8, torque: f64) -> Drive {
    match kind {
        0 => Drive::Constant(torque),
        1 => Drive::Spring {
            stiffness: 0.5 * torque.abs(),
            rest: 1.5 * torque.signum(),
            damping: 0.0,
            speed: 0.0,
        },
        2 => Drive::Table(vec![(0.0, torque), (2e-3, 0.2 * torque), (7e-3, 1.4 * torque)]),
        3 => Drive::Chirp(ChirpDrive {
            mean: torque,
            amplitude: 0.7 * torque.abs(),
            from: 30.0,
            to: 400.0,
            duration: 6e-3,
        }),
        _ => Drive::Sines {
            mean: torque,
            sines: vec![(0.5 * torque.abs(), 400.0, 0.1), (0.3 * torque.abs(), 3000.0, 2.0)],
        },
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, rng_seed: proptest::test_runner::RngSeed::Fixed(2), ..ProptestConfig::default() })]

    /// To 1e-9 (exact flow) or 1e-7 (Dormand–Prince) of what moves in that time, wherever the motion is not a coin on its edge: a break-away so soft that a bit
    /// of the torque decides its instant.
    #[test]
    fn an_interval_in_parts_is_the_interval_whole(
        velocity in prop_oneof![Just(0.0), -1.0_f64..1.0], volts in 0.0_f64..10.0, share in -2.0_f64..2.0,
        v_s in -4.0_f64..0.0, ratio in 1.0_f64..2.5, drag in 0.0_f64..0.3, parts in 2_u32..20,
        kind in 0_u8..5, ripple in any::<bool>(), lag in any::<bool>(), exact in any::<bool>(),
    ) {
        let duration = 1e-2;
        let plant = PlantParams {
            viscous_damping: drag * 0.0017 / duration,
            friction: stribeck(0.15 * ratio, 0.15, 10.0_f64.powf(v_s)).into(),
            ..PlantParams::default()
        };
        let mut m = model(&plant);
        let limit = m.plant.break_away_torque(volts).max(1e-3);
        let drive = drive(if exact { 0 } else { kind }, share * limit);
        let volts = if lag && !exact {
            Volts::Lag { from: volts, to: 5.0, time_constant: 1e-3 }
        } else {
            Volts::Held(volts)
        };
        if ripple && !exact {
            let waves = RippleParams { rms: 0.05, lowest: 20, highest: 60, spacing: 20 };
            m.ripple = Ripple::new(Some(&waves), None, 3).unwrap();
        }
        let whole = Input { volts, ..input(&drive, 0.0, duration) };
        let engine = || -> Box<dyn Engine> {
            if exact { Box::new(ExactFlow) } else { Box::new(DormandPrince::default()) }
        };
        let (once, once_events) = moved(engine().as_mut(), &m, &whole, velocity);
        prop_assume!((share.abs() - 1.0).abs() > 1e-3);
        let (mut shaft, mut events) = (Shaft::new(0.0, velocity), Vec::new());
        let mut piecewise = engine();
        for part in 0..parts {
            let from = duration * f64::from(part) / f64::from(parts);
            let to = duration * f64::from(part + 1) / f64::from(parts);
            let volts = match volts {
                Volts::Held(v) => Volts::Held(v),
                Volts::Lag { from: at, to, time_constant } => {
                    Volts::Lag { from: to + (at - to) * (-from / time_constant).exp(), to, time_constant }
                }
            };
            let input = Input { time: from, duration: to - from, volts, ..whole };
            piecewise.advance(&m, &input, &mut shaft, &mut events).unwrap();
        }
        let fastest = velocity.abs().max(once.velocity.abs()).max(shaft.velocity.abs()).max(10.0_f64.powf(v_s));
        prop_assert_eq!(once.motion, shaft.motion);
        prop_assert_eq!(once_events.len(), events.len());
        let tolerance = if exact { 1e-9 } else { 1e-7 };
        let (way, speed) = ((once.position - shaft.position).abs(), (once.velocity - shaft.velocity).abs());
        prop_assert!(way < tolerance * fastest * duration, "{} rad apart", way);
        prop_assert!(speed < tolerance * fastest, "{} rad/s apart", speed);
    }

    /// A brake resists either way alike: with the torque turned round the shaft does the same the other way.
    #[test]
    fn a_mirrored_shaft_moves_as_in_a_mirror(
        velocity in -3.0_f64..3.0, volts in 0.0_f64..10.0, torque in -0.2_f64..0.2, v_s in -6.0_f64..0.0,
        milliseconds in 1_u32..50,
    ) {
        let plant = PlantParams { friction: stribeck(0.2, 0.15, 10.0_f64.powf(v_s)).into(), ..PlantParams::default() };
        let (one, other) = (Drive::Constant(torque), Drive::Constant(-torque));
        let seconds = 1e-3 * f64::from(milliseconds);
        for (name, mut engine) in engines() {
            let (shaft, _) = moved(engine.as_mut(), &model(&plant), &input(&one, volts, seconds), velocity);
            let (mirrored, _) = moved(engine.as_mut(), &model(&plant), &input(&other, volts, seconds), -velocity);
            let (way, speed) = (shaft.position + mirrored.position, shaft.velocity + mirrored.velocity);
            let fastest = velocity.abs().max(shaft.velocity.abs());
            prop_assert!(way.abs() <= 1e-9 * fastest * seconds && speed.abs() <= 1e-9 * fastest, "{}", name);
        }
    }

    /// Torque times way, less what the shaft has gained, went into friction and drag: never below nothing.
    #[test]
    fn no_interval_gains_energy(
        velocity in -3.0_f64..3.0, volts in 0.0_f64..10.0, torque in -0.2_f64..0.2, v_s in -6.0_f64..0.0,
        milliseconds in 1_u32..50,
    ) {
        let plant = PlantParams { friction: stribeck(0.2, 0.15, 10.0_f64.powf(v_s)).into(), ..PlantParams::default() };
        let drive = Drive::Constant(torque);
        for (name, mut engine) in engines() {
            let (shaft, _) =
                moved(engine.as_mut(), &model(&plant), &input(&drive, volts, 1e-3 * f64::from(milliseconds)), velocity);
            let gained = 0.5 * plant.inertia * (shaft.velocity.powi(2) - velocity.powi(2));
            let given = torque * shaft.position;
            let rounding = 1e-7 * (given.abs() + gained.abs());
            prop_assert!(given - gained >= -rounding, "{}: {} J given, {} J gained", name, given, gained);
        }
    }
}
