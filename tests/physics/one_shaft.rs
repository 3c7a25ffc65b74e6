//! A shaft is the system of one inertia and one row: its engines and that of systems on the same intervals.

use crate::draw::Draw;
use crate::parts::Interval;
use clutch_core::Friction;
use clutch_core::friction::{FrictionParams, StribeckParams};
use clutch_sim::engine::{DormandPrince, Engine, EventKind, ExactFlow};
use clutch_sim::system::{Mode, Motion, System, SystemState};
use nalgebra::{SMatrix, SVector};

/// An interval of a shaft, written as a system.
struct OneRow<'a>(&'a Interval);

impl System<1, 1> for OneRow<'_> {
    fn inertia(&self, _: &SVector<f64, 1>) -> SMatrix<f64, 1, 1> {
        SMatrix::from([[self.0.model.plant.params().inertia]])
    }
    fn applied(&self, t: f64, q: &SVector<f64, 1>, v: &SVector<f64, 1>) -> SVector<f64, 1> {
        let (plant, drive) = (&self.0.model.plant, self.0.drive.torque(t, q[0]));
        let drag = plant.params().viscous_damping * v[0];
        SVector::from([drive + plant.actuator().torque(self.0.held()) - drag])
    }
    fn rows(&self, _: &SVector<f64, 1>) -> SMatrix<f64, 1, 1> {
        SMatrix::from([[1.0]])
    }
    fn normal(&self, _: f64) -> SVector<f64, 1> {
        SVector::from([self.0.model.plant.actuator().normal(self.0.held())])
    }
    fn friction(&self, _: usize) -> &Friction<f64> {
        self.0.model.plant.friction()
    }
    fn longest_step(&self) -> f64 {
        1e-2 * self.0.seconds
    }
}

impl OneRow<'_> {
    /// Its end, and the instants at which it began to rest, or no longer to rest.
    fn end(&self) -> (SystemState<1>, Vec<(f64, bool)>) {
        let begin =
            SystemState { time: 0.0, position: SVector::zeros(), velocity: SVector::from([self.0.velocity]) };
        let (mut motion, mut events) = (Motion::new(self, begin).unwrap(), Vec::new());
        let mut rests = motion.modes()[0] == Mode::Stuck;
        motion.advance(self.0.seconds, &mut events).unwrap();
        // A shaft that turns round at once begins neither.
        let instants = events.iter().filter_map(|event| {
            let (before, now) = (rests, event.mode == Mode::Stuck);
            rests = now;
            (before != now).then_some((event.time, now))
        });
        (*motion.state(), instants.collect())
    }
}

/// Largest differences of so many intervals: of positions, rad, and of the instants at which rests begin and end, s. They do
/// so equally often.
fn furthest_apart(
    (count, seed): (u32, u64),
    constant: bool,
    friction: fn(&mut Draw) -> FrictionParams,
    engine: fn() -> Box<dyn Engine>,
) -> (f64, f64) {
    let mut draw = Draw::new(seed);
    let (mut position, mut instant, mut happened) = (0.0_f64, 0.0_f64, 0);
    for n in 0..count {
        let friction = friction(&mut draw);
        let interval = Interval::draw_smooth(&mut draw, friction, constant);
        let (shaft, events) = interval.end(engine().as_mut(), 1);
        // A system that does not hold at the start does not break away there.
        let theirs: Vec<_> =
            events.iter().filter(|e| e.time > 0.0).map(|e| (e.time, e.kind == EventKind::Stick)).collect();
        let (state, ours) = OneRow(&interval).end();
        let kinds = |all: &[(f64, bool)]| all.iter().map(|(_, rests)| *rests).collect::<Vec<_>>();
        assert_eq!(kinds(&ours), kinds(&theirs), "{n}: {ours:?}, {theirs:?}, {:?}", interval.model);
        assert_eq!(state.velocity[0] == 0.0, shaft.velocity == 0.0, "{n}: both rest, or none");
        position = position.max((state.position[0] - shaft.position).abs());
        for (a, b) in ours.iter().zip(&theirs) {
            instant = instant.max((a.0 - b.0).abs());
        }
        happened += ours.len();
    }
    assert!(happened > count as usize / 20, "{happened} events");
    (position, instant)
}

#[test]
fn the_exact_flow_is_a_special_case_of_the_system() {
    let friction = |draw: &mut Draw| match draw.friction() {
        FrictionParams::Stribeck(p) => StribeckParams { stribeck_exponent: 1.0, ..p }.into(),
        other => other,
    };
    let (position, instant) = furthest_apart((300, 11), true, friction, || Box::new(ExactFlow));
    println!("exact flow: {position:e} rad, {instant:e} s");
    assert!(position < 1e-9 && instant < 1e-9, "{position:e} rad, {instant:e} s");
}

#[test]
fn the_pair_on_a_shaft_is_that_of_the_system() {
    let (position, instant) =
        furthest_apart((300, 12), false, Draw::friction, || Box::new(DormandPrince::default()));
    println!("Dormand–Prince: {position:e} rad, {instant:e} s");
    assert!(position < 1e-9 && instant < 1e-9, "{position:e} rad, {instant:e} s");
}
