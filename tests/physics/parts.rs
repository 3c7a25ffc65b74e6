//! An interval in parts is the interval whole: every engine, actuator, friction and drive.

use crate::draw::Draw;
use crate::linear::Linear;
use clutch_core::friction::{FrictionParams, StribeckParams};
use clutch_core::{Plant, PlantParams};
use clutch_sim::drive::{Drive, DriveParams, Side, WeightDrive};
use clutch_sim::engine::{Bristle, DormandPrince, Engine, Event, ExactFlow, Input, Model, Shaft, Volts};
use clutch_sim::ripple::Ripple;
use clutch_sim::system::{BristledMotion, Motion, SystemState};
use nalgebra::SVector;

/// A shaft, what drives it, and its voltage over an interval.
pub(crate) struct Interval {
    pub(crate) model: Model,
    pub(crate) drive: Drive,
    volts: Volts,
    pub(crate) velocity: f64,
    pub(crate) seconds: f64,
}

impl Interval {
    /// With torque and voltage held if they are to be `constant`; else any drive, lag and disc.
    pub(crate) fn draw(draw: &mut Draw, friction: FrictionParams, constant: bool) -> Interval {
        let (seconds, volts) = (draw.log(1e-3, 2e-2), draw.between(0.0, 10.0));
        let (plant, torque) = draw.plant(friction, seconds, volts.max(0.5));
        let drive = if constant {
            let (gravity, pulley_radius) = (9.81, 0.024);
            let side = draw.of(&[Side::Forwards, Side::Backwards]);
            let mass = torque / (gravity * pulley_radius);
            DriveParams::Weight(WeightDrive { mass, gravity, pulley_radius, side })
        } else {
            draw.drive(torque, seconds)
        };
        let (ripple, runout) = draw.disc();
        let drive = Drive::new(&drive, 3).unwrap();
        let plant = PlantParams {
            drive_torque: drive.torque(0.0, 0.0),
            viscous_damping: plant.viscous_damping + drive.damping(),
            ..plant
        };
        let ripple = if constant { None } else { Ripple::new(ripple.as_ref(), runout.as_ref(), 3).unwrap() };
        let volts = if plant.actuator.kind().two_sided() { volts * draw.between(-1.0, 1.0) } else { volts };
        let volts = if draw.one_in(4) && !constant {
            Volts::Lag {
                from: volts,
                to: draw.between(0.0, 10.0),
                time_constant: seconds * draw.log(0.01, 10.0),
            }
        } else {
            Volts::Held(volts)
        };
        let velocity = if draw.one_in(3) { 0.0 } else { draw.log(1e-4, 3.0) * draw.of(&[1.0, -1.0]) };
        Interval {
            model: Model { plant: Plant::new(&plant).unwrap(), ripple },
            drive,
            volts,
            velocity,
            seconds,
        }
    }

    /// One without lag, with an even disc and a torque without corners: as a system of one inertia and one row.
    pub(crate) fn draw_smooth(draw: &mut Draw, friction: FrictionParams, constant: bool) -> Interval {
        loop {
            let drawn = Interval::draw(draw, friction, constant);
            let smooth = !matches!(drawn.drive, Drive::Table(_) | Drive::Chirp(_));
            if smooth && drawn.model.ripple.is_none() && matches!(drawn.volts, Volts::Held(_)) {
                return drawn;
            }
        }
    }

    /// Its voltage, V; of one on its way the last.
    pub(crate) fn held(&self) -> f64 {
        match self.volts {
            Volts::Held(volts) | Volts::Lag { to: volts, .. } => volts,
        }
    }

    /// The part between two shares of it.
    fn part(&self, from: f64, to: f64) -> Input<'_> {
        let (from, to) = (from * self.seconds, to * self.seconds);
        let volts = match self.volts {
            Volts::Held(v) => Volts::Held(v),
            Volts::Lag { from: at, to, time_constant } => {
                Volts::Lag { from: to + (at - to) * (-from / time_constant).exp(), to, time_constant }
            }
        };
        Input { time: from, duration: to - from, origin: 0.0, volts, drive: &self.drive, noise: 0.0 }
    }

    /// Its end in so many parts.
    pub(crate) fn end(&self, engine: &mut dyn Engine, parts: u32) -> (Shaft, Vec<Event>) {
        let (mut shaft, mut events) = (Shaft::new(0.0, self.velocity), Vec::new());
        for k in 0..parts {
            let share = |k| f64::from(k) / f64::from(parts);
            engine.advance(&self.model, &self.part(share(k), share(k + 1)), &mut shaft, &mut events).unwrap();
        }
        (shaft, events)
    }
}

/// Angle within which an interval in parts ends where it ends whole, rad.
const SAME: f64 = 1e-9;

/// Share within which it has the same velocity: of the largest of 1 rad/s, its speed, and what the drive alone gives it in that time.
const SAME_VELOCITY: f64 = 1e-9;

/// Follows so many intervals whole and in 2 to 19 parts.
fn same(
    (count, seed): (u32, u64),
    constant: bool,
    friction: fn(&mut Draw) -> FrictionParams,
    engine: fn() -> Box<dyn Engine>,
) {
    let mut draw = Draw::new(seed);
    let mut happened = 0;
    for n in 0..count {
        let friction = friction(&mut draw);
        let interval = Interval::draw(&mut draw, friction, constant);
        let parts = 2 + draw.whole(18) as u32;
        let (whole, events) = interval.end(engine().as_mut(), 1);
        let (pieces, _) = interval.end(engine().as_mut(), parts);
        let apart = (whole.position - pieces.position).abs();
        assert!(
            apart < SAME,
            "{n}, {parts} parts: {apart:e} rad, {:?}, {:?}",
            interval.model,
            interval.drive
        );
        let plant = interval.model.plant.params();
        let driven = (plant.drive_torque / plant.inertia * interval.seconds).abs();
        let faster = (whole.velocity - pieces.velocity).abs();
        assert!(
            faster < SAME_VELOCITY * interval.velocity.abs().max(whole.velocity.abs()).max(driven).max(1.0),
            "{n}, {parts} parts: {faster:e} rad/s, {:?}, {:?}",
            interval.model,
            interval.drive
        );
        happened += events.len();
    }
    assert!(happened > count as usize / 20, "{happened} events");
}

#[test]
fn intervals_of_the_exact_flow_in_parts_are_the_intervals_whole() {
    let friction = |draw: &mut Draw| match draw.friction() {
        FrictionParams::Stribeck(p) => StribeckParams { stribeck_exponent: 1.0, ..p }.into(),
        other => other,
    };
    same((1000, 5), true, friction, || Box::new(ExactFlow));
}

#[test]
fn intervals_of_dormand_prince_in_parts_are_the_intervals_whole() {
    same((1000, 6), false, Draw::friction, || Box::new(DormandPrince::default()));
}

#[test]
fn intervals_of_bristles_in_parts_are_the_intervals_whole() {
    same((300, 7), false, Draw::bristled, || Box::new(Bristle::default()));
}

fn of_systems<const N: usize, const B: usize>(draw: &mut Draw) -> f64 {
    let system = Linear::<N, B>::draw(draw, Draw::friction);
    let velocity = SVector::from_fn(|_, _| draw.between(-1.0, 1.0));
    let begin = SystemState { time: 0.0, position: SVector::zeros(), velocity };
    let seconds = draw.log(0.01, 1.0);
    let parts = 2 + draw.whole(18) as u32;
    let [a, b] = [1, parts].map(|parts| {
        let mut motion = Motion::new(&system, begin).unwrap();
        for k in 1..=parts {
            motion.advance(seconds * f64::from(k) / f64::from(parts), &mut Vec::new()).unwrap();
        }
        (motion.state().position, motion.state().velocity)
    });
    (a.0 - b.0).amax().max((a.1 - b.1).amax())
}

/// The same of a system with bristles; its states are `2 N + B`, which a generic function cannot say outside of the crate.
macro_rules! of_bristled {
    ($joints:literal, $rows:literal, $states:literal) => {
        |draw: &mut Draw| {
            let system = Linear::<$joints, $rows>::draw(draw, Draw::of_one_bristle);
            let velocity = SVector::from_fn(|_, _| draw.between(-1.0, 1.0));
            let begin = SystemState { time: 0.0, position: SVector::zeros(), velocity };
            let seconds = draw.log(0.01, 0.3);
            let parts = 2 + draw.whole(18) as u32;
            let [a, b] = [1, parts].map(|parts| {
                let mut motion = BristledMotion::<_, $joints, $rows, $states>::new(&system, begin).unwrap();
                for k in 1..=parts {
                    motion.advance(seconds * f64::from(k) / f64::from(parts)).unwrap();
                }
                (motion.state().position, motion.state().velocity)
            });
            (a.0 - b.0).amax().max((a.1 - b.1).amax())
        }
    };
}

/// Draws a system and gives back how far apart it ends, rad and rad/s.
type Apart = fn(&mut Draw) -> f64;

#[test]
fn motions_of_systems_in_parts_are_the_motions_whole() {
    let mut draw = Draw::new(8);
    let all: [(Apart, u32); 6] = [
        (of_systems::<1, 1>, 60),
        (of_systems::<2, 2>, 60),
        (of_systems::<4, 4>, 60),
        (of_bristled!(1, 1, 3), 20),
        (of_bristled!(2, 2, 6), 20),
        (of_bristled!(4, 4, 12), 20),
    ];
    for (place, (apart, count)) in all.into_iter().enumerate() {
        for n in 0..count {
            let apart = apart(&mut draw);
            assert!(apart < SAME, "{place}, {n}: {apart:e} rad or rad/s");
        }
    }
}
