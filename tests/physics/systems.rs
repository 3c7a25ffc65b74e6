//! Several inertias and rows of friction: a system written by hand, and modes against enumeration. Published systems are
//! cases of the referee.

use crate::draw::Draw;
use crate::linear::Linear;
use clutch_core::friction::{FrictionParams, StribeckParams};
use clutch_core::{Friction, FrictionModel};
use clutch_sim::system::{BristledMotion, Motion, System, SystemError, SystemState, hold};
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

fn friction(p: impl Into<FrictionParams>) -> Friction<f64> {
    Friction::build(&p.into()).unwrap()
}

/// The shaft of the paper as a system of one inertia and one row.
struct Shaft(Friction<f64>);

impl System<1, 1> for Shaft {
    fn inertia(&self, _: &SVector<f64, 1>) -> SMatrix<f64, 1, 1> {
        SVector::from([0.0017])
    }
    fn applied(&self, t: f64, _: &SVector<f64, 1>, v: &SVector<f64, 1>) -> SVector<f64, 1> {
        SVector::from([0.03 + 0.05 * (6.0 * std::f64::consts::PI * t).sin() - 0.001 * v[0]])
    }
    fn rows(&self, _: &SVector<f64, 1>) -> SMatrix<f64, 1, 1> {
        SVector::from([1.0])
    }
    fn normal(&self, _: f64) -> SVector<f64, 1> {
        SVector::from([0.28])
    }
    fn friction(&self, _: usize) -> &Friction<f64> {
        &self.0
    }
}

#[test]
fn a_system_of_one_inertia_and_one_row_is_the_shaft() {
    use clutch_core::{ActuatorParams, Plant, PlantParams};
    use clutch_sim::drive::{Drive, DriveParams, SineDrive};
    use clutch_sim::engine::{DormandPrince, Engine, Input, Model, Volts};
    let params = StribeckParams { stribeck_velocity: 0.01, ..StribeckParams::default() };
    let system = Shaft(friction(params));
    let begin = SystemState { time: 0.0, position: SVector::zeros(), velocity: SVector::zeros() };
    let (mut motion, mut events) = (Motion::new(&system, begin).unwrap(), Vec::new());
    motion.advance(1.0, &mut events).unwrap();

    let plant = PlantParams {
        actuator: ActuatorParams::brake(0.14),
        friction: params.into(),
        ..PlantParams::default()
    };
    let model = Model { plant: Plant::new(&plant).unwrap(), ripple: None };
    let sine = SineDrive { mean: 0.03, amplitude: 0.05, frequency: 3.0, phase_turns: 0.0 };
    let drive = Drive::new(&DriveParams::Sine(sine), 0).unwrap();
    let (mut engine, mut shaft, mut seen) =
        (DormandPrince::default(), clutch_sim::engine::Shaft::new(0.0, 0.0), Vec::new());
    for k in 0..1000 {
        let (time, volts) = (f64::from(k) * 1e-3, Volts::Held(2.0));
        let input = Input { time, duration: 1e-3, origin: 0.0, volts, drive: &drive, noise: 0.0 };
        engine.advance(&model, &input, &mut shaft, &mut seen).unwrap();
    }
    assert_eq!(events.len(), seen.len(), "{events:?}\n{seen:?}");
    assert!(seen.len() >= 6);
    for (a, b) in events.iter().zip(&seen) {
        assert!((a.time - b.time).abs() < 1e-9, "{a:?} {b:?}");
    }
    assert!((motion.state().position[0] - shaft.position).abs() < 1e-8);
    assert_eq!(motion.state().velocity[0], shaft.velocity, "both rest at the end");
}

#[test]
fn a_motion_is_given_up_after_the_steps_that_it_is_allowed_and_each_call_has_them_anew() {
    let system = Shaft(friction(StribeckParams::default()));
    let begin = SystemState { time: 0.0, position: SVector::zeros(), velocity: SVector::zeros() };
    let moved = |steps: u32, calls: u32| {
        let (mut motion, mut events) = (Motion::new(&system, begin).unwrap().with_limit(steps), Vec::new());
        let done = (1..=calls).try_for_each(|k| motion.advance(f64::from(k) / f64::from(calls), &mut events));
        (done, motion.state().time)
    };
    let (done, time) = moved(100, 1);
    assert_eq!(done, Err(SystemError::TooManySteps(0.0)));
    assert!(time > 0.0 && time < 1.0, "{time}");
    assert_eq!(moved(100, 1000), (Ok(()), 1.0));
}

/// The accelerations of each set of rows at their bounds, one of which is the right one.
fn enumerated(
    a: &SMatrix<f64, 4, 4>,
    b: &SVector<f64, 4>,
    bound: &SVector<f64, 4>,
    j: &SMatrix<f64, 4, 2>,
) -> Vector2<f64> {
    // The acceleration of the joints is unique: over all corners, edges … of the box, the one with the least ½ λᵀAλ − bᵀλ.
    let mut best = (f64::INFINITY, SVector::<f64, 4>::zeros());
    for code in 0..81_u32 {
        let at = |i: u32| [-1.0, 0.0, 1.0][(code / 3_u32.pow(i) % 3) as usize];
        let fixed: Vec<Option<f64>> =
            (0..4).map(|i| if at(i) == 0.0 { None } else { Some(at(i) * bound[i as usize]) }).collect();
        // The free rows by least squares with a hair of regularity.
        let matrix = SMatrix::<f64, 4, 4>::from_fn(|r, c| match (fixed[r], fixed[c]) {
            (None, None) => a[(r, c)] + if r == c { 1e-11 } else { 0.0 },
            _ => f64::from(u8::from(r == c)),
        });
        let known = SVector::<f64, 4>::from_fn(|i, _| fixed[i].unwrap_or(0.0));
        let pull = b - a * known;
        let right = SVector::<f64, 4>::from_fn(|i, _| fixed[i].map_or(pull[i], |_| 0.0));
        let Some(x) = matrix.lu().solve(&right) else { continue };
        let x = (x + known).zip_map(bound, |x, h| x.clamp(-h, h));
        let cost = 0.5 * (x.transpose() * a * x)[0] - (b.transpose() * x)[0];
        if cost < best.0 {
            best = (cost, x);
        }
    }
    j.transpose() * best.1
}

#[test]
fn modes_of_random_redundant_rows_are_those_of_enumeration() {
    let mut seed = 7_u64;
    let mut random = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        2.0 * ((seed >> 11) as f64 / (1_u64 << 53) as f64) - 1.0
    };
    let mut worst = 0.0_f64;
    for _ in 0..20_000 {
        let j = SMatrix::<f64, 4, 2>::from_fn(|_, _| random());
        let inertia = {
            let r = Matrix2::from_fn(|_, _| random());
            r * r.transpose() + Matrix2::identity() * 0.1
        };
        let inverse = inertia.try_inverse().unwrap();
        let load = Vector2::new(random(), random()) * 2.0;
        let bound = SVector::<f64, 4>::from_fn(|_, _| random().abs());
        let (a, b) = (j * inverse * j.transpose(), j * inverse * load);
        let held = hold(&a, &b, &bound, &[true; 4]);
        let (ours, theirs) = (j.transpose() * held.torque, enumerated(&a, &b, &bound, &j));
        worst = worst.max((ours - theirs).amax());
    }
    assert!(worst < 1e-7, "{worst}");
}

#[test]
fn systems_of_springs_and_friction_never_gain_energy() {
    let mut draw = Draw::new(12);
    for n in 0..20 {
        let system = Linear::<3, 2>::draw(&mut draw, Draw::friction).alone();
        let (position, velocity) = (
            SVector::from_fn(|_, _| draw.between(-1.0, 1.0)),
            SVector::from_fn(|_, _| draw.between(-1.0, 1.0)),
        );
        let mut motion = Motion::new(&system, SystemState { time: 0.0, position, velocity }).unwrap();
        let begin = system.energy(&position, &velocity);
        let (mut energy, mut events) = (begin, Vec::new());
        for k in 1..=500 {
            motion.advance(f64::from(k) * 1e-2, &mut events).unwrap();
            let SystemState { position, velocity, .. } = motion.state();
            let now = system.energy(position, velocity);
            assert!(now <= energy + 1e-10 * begin, "{n} at {k}: {now} J after {energy} J");
            energy = now;
        }
        assert!(energy < 0.99 * begin, "{n}: friction took next to nothing");
        assert!(events.len() > 1, "{n}: {events:?}");
    }
}

/// Bristles give back what bends them, and no more: with the damping that makes them passive the energy never exceeds
/// that of the start, at which they were not bent.
#[test]
fn systems_with_bristles_never_gain_energy() {
    let mut draw = Draw::new(13);
    for n in 0..20 {
        let mut system = Linear::<2, 2>::draw(&mut draw, Draw::of_one_bristle).alone();
        for i in 0..2 {
            let row = system.rows.row(i).transpose();
            let bristles = system.friction[i].bristles().unwrap();
            system.damping += row * row.transpose() * (bristles.passive_from() * system.normal[i]);
        }
        let velocity = SVector::from_fn(|_, _| draw.between(-1.0, 1.0));
        let begin = SystemState { time: 0.0, position: SVector::zeros(), velocity };
        let first = system.energy(&begin.position, &velocity);
        let mut motion = BristledMotion::<_, 2, 2, 6>::new(&system, begin).unwrap();
        for k in 1..=100 {
            motion.advance(f64::from(k) * 1e-2).unwrap();
            let SystemState { position, velocity, .. } = motion.state();
            let now = system.energy(&position, &velocity);
            assert!(now <= first * (1.0 + 1e-9), "{n} at {k}: {now} J of {first} J");
        }
        assert!(system.energy(&motion.state().position, &motion.state().velocity) < 0.99 * first, "{n}");
    }
}
