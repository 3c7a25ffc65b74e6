//! Several inertias and rows of friction: published and hand-made cases, and modes against enumeration.

use clutch_core::friction::{CoulombParams, FrictionParams, StribeckParams};
use clutch_core::{Friction, FrictionModel};
use clutch_sim::system::{Mode, Motion, State, System, SystemEvent, hold};
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

fn friction(p: impl Into<FrictionParams>) -> Friction<f64> {
    Friction::build(&p.into()).unwrap()
}

fn coulomb(mu_static: f64, mu_dynamic: f64) -> Friction<f64> {
    friction(CoulombParams { mu_static, mu_dynamic })
}

/// Four inertias in a row with a clutch between each two: the example CoupledClutches of the Modelica Standard Library.
struct CoupledClutches(Friction<f64>);

impl System<4, 3> for CoupledClutches {
    fn inertia(&self, _: &SVector<f64, 4>) -> SMatrix<f64, 4, 4> {
        SMatrix::identity()
    }
    fn applied(&self, t: f64, _: &SVector<f64, 4>, _: &SVector<f64, 4>) -> SVector<f64, 4> {
        SVector::from([10.0 * (10.0 * std::f64::consts::PI * t).sin(), 0.0, 0.0, 0.0])
    }
    fn rows(&self, _: &SVector<f64, 4>) -> SMatrix<f64, 3, 4> {
        SMatrix::<f64, 3, 4>::from_row_slice(&[1.0, -1.0, 0.0, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, 1.0, -1.0])
    }
    fn normal(&self, t: f64) -> SVector<f64, 3> {
        let on = |from: f64| if t >= from { 20.0 } else { 0.0 };
        SVector::from([20.0 * (0.4 * std::f64::consts::PI * t).cos(), on(0.4), on(0.9)])
    }
    fn friction(&self, _: usize) -> &Friction<f64> {
        &self.0
    }
    fn corner(&self, t: f64) -> Option<f64> {
        [0.4, 0.9].into_iter().find(|corner| *corner > t)
    }
}

/// The values are by two independent methods; those published with the library differ by up to 4.6e-5 s, its
/// tolerance being 1e-6.
#[test]
fn coupled_clutches_lock_and_slip_when_they_do_in_the_modelica_library() {
    let system = CoupledClutches(coulomb(0.55, 0.5));
    let begin =
        State { time: 0.0, position: SVector::zeros(), velocity: SVector::from([10.0, 0.0, 0.0, 0.0]) };
    let mut motion = Motion::new(&system, begin).unwrap();
    let mut events = Vec::new();
    motion.advance(1.5, &mut events).unwrap();
    let expected = [
        (0.7096214747, 1, true),
        (0.7916623592, 0, true),
        (0.8311085061, 0, false),
        (0.9068501928, 0, true),
        (1.0002958599, 0, false),
        (1.1439674925, 2, true),
    ];
    let seen: Vec<&SystemEvent> = events.iter().filter(|e| e.time > 0.5).collect();
    let seen: Vec<&&SystemEvent> = seen.iter().filter(|e| !(e.row == 2 && e.mode != Mode::Stuck)).collect();
    for (time, row, locks) in expected {
        let found = seen
            .iter()
            .find(|e| e.row == row && (e.mode == Mode::Stuck) == locks && (e.time - time).abs() < 1e-5);
        let found = found.unwrap_or_else(|| panic!("clutch {} at {time} s: {seen:?}", row + 1));
        assert!(
            (found.time - time).abs() < 1e-9,
            "clutch {} at {} s instead of {time} s",
            row + 1,
            found.time
        );
    }
    let State { position, velocity, .. } = motion.state();
    for (is, expected) in [
        (position[0], 7.4861190991),
        (velocity[0], 3.2470582724),
        (position[1] - position[0], -3.3789816828),
        (velocity[1] - velocity[0], -0.7838711058),
    ] {
        assert!((is - expected).abs() < 1e-8, "{is} instead of {expected}");
    }
}

/// Two joints held by four redundant rows.
struct Joints {
    torque: f64,
    friction: Friction<f64>,
}

/// What the rows hold, N m.
const HOLDS: [f64; 4] = [1.65, 1.17, 3.2, 0.64];

impl System<2, 4> for Joints {
    fn inertia(&self, _: &SVector<f64, 2>) -> SMatrix<f64, 2, 2> {
        Matrix2::new(0.3, 0.1, 0.1, 0.2)
    }
    fn applied(&self, _: f64, _: &SVector<f64, 2>, _: &SVector<f64, 2>) -> SVector<f64, 2> {
        self.torque * Vector2::new(1.0, 0.3)
    }
    fn rows(&self, _: &SVector<f64, 2>) -> SMatrix<f64, 4, 2> {
        SMatrix::<f64, 4, 2>::from_row_slice(&[1.0, 0.0, 0.0, 1.0, 1.0, -1.0, 1.0, 1.0])
    }
    fn normal(&self, _: f64) -> SVector<f64, 4> {
        SVector::from(HOLDS) / 0.2
    }
    fn longest_step(&self) -> f64 {
        f64::INFINITY
    }
    fn friction(&self, _: usize) -> &Friction<f64> {
        &self.friction
    }
}

#[test]
fn redundant_rows_hold_a_joint_up_to_their_support_function_and_move_it_by_exactly_nothing() {
    // 4.10/1.30: the rows' torques along (1, 1), over that of the load.
    let limit = 4.10 / 1.30;
    let moved = |share: f64, until: f64| {
        let friction = coulomb(0.2, 0.15);
        let system = Joints { torque: share * limit, friction };
        let begin = State { time: 0.0, position: SVector::zeros(), velocity: SVector::zeros() };
        let mut motion = Motion::new(&system, begin).unwrap();
        motion.advance(until, &mut Vec::new()).unwrap();
        motion.state().position
    };
    assert_eq!(moved(0.999, 3600.0), SVector::<f64, 2>::zeros());
    assert!(moved(1.001, 0.1).amax() > 1e-6);
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
    let begin = State { time: 0.0, position: SVector::zeros(), velocity: SVector::zeros() };
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

/// A mass on a belt, pulled back by a spring: the velocity of the base of a row.
struct Belt(Friction<f64>);

impl System<1, 1> for Belt {
    fn inertia(&self, _: &SVector<f64, 1>) -> SMatrix<f64, 1, 1> {
        SVector::from([1.0])
    }
    fn applied(&self, _: f64, q: &SVector<f64, 1>, _: &SVector<f64, 1>) -> SVector<f64, 1> {
        -q
    }
    fn rows(&self, _: &SVector<f64, 1>) -> SMatrix<f64, 1, 1> {
        SVector::from([1.0])
    }
    fn base(&self, _: f64) -> SVector<f64, 1> {
        SVector::from([0.2])
    }
    fn normal(&self, _: f64) -> SVector<f64, 1> {
        SVector::from([1.0])
    }
    fn friction(&self, _: usize) -> &Friction<f64> {
        &self.0
    }
}

#[test]
fn a_mass_on_a_belt_sticks_until_the_spring_bears_the_friction_at_rest_and_slips_for_the_time_of_the_formula()
{
    let (rest, moving, speed) = (1.0, 0.5, 0.2_f64);
    let system = Belt(coulomb(rest, moving));
    let begin = State { time: 0.0, position: SVector::zeros(), velocity: SVector::from([speed]) };
    let (mut motion, mut events) = (Motion::new(&system, begin).unwrap(), Vec::new());
    motion.advance(40.0, &mut events).unwrap();
    // Sticks from q = 0 to q = μ_s, which takes μ_s/v; slips with q = μ_d + a cos t + v sin t, a = μ_s − μ_d, until q̇ = v again,
    // after 2π − 2 atan(a/v).
    let slips = 2.0 * std::f64::consts::PI - 2.0 * ((rest - moving) / speed).atan();
    // It comes to rest as far behind μ_d as it left before it.
    let sticks = 2.0 * (rest - moving) / speed;
    let times: Vec<f64> = events.iter().map(|e| e.time).collect();
    assert!((times[0] - rest / speed).abs() < 1e-9, "{times:?}");
    for pair in times.windows(2).enumerate() {
        let expected = if pair.0 % 2 == 0 { slips } else { sticks };
        assert!(
            (pair.1[1] - pair.1[0] - expected).abs() < 1e-8,
            "{} s instead of {expected} s",
            pair.1[1] - pair.1[0]
        );
    }
    assert!(times.len() > 7);
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
