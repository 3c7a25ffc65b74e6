//! Glide around a shaft that is written here: micro-steps, motion, a map of the disc, both ways of a motor.
#![allow(
    clippy::std_instead_of_core,
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "it runs on the host"
)]

use clutch_core::law::{GlideParams, LawParams, Terms};
use clutch_core::{
    Counts, FixedCounts, FrictionMap, MotorActuator, OnDisc, Place, Planned, PlantParams, Servo, ServoParams,
    Target,
};
use std::collections::VecDeque;
use std::f64::consts::TAU;

const PERIOD: f64 = 1e-3;
const COUNTS_PER_TURN: f64 = 20_000.0;
const COUNTS_PER_RADIAN: f64 = COUNTS_PER_TURN / TAU;
const PULL: f64 = 0.047_088;
const INERTIA: f64 = 0.0017;
const DAMPING: f64 = 0.001;
const MU: (f64, f64) = (0.2, 0.15);
const STRIBECK: f64 = 0.001;

/// Torque of a drive and normal force (as torque per unit of μ) of an actuator at a voltage.
#[derive(Clone, Copy)]
enum Actuator {
    Brake,
    Motor,
}

impl Actuator {
    fn acts(self, volts: f64) -> (f64, f64) {
        match self {
            Actuator::Brake => (PULL, 0.14 * volts),
            Actuator::Motor => (0.05 * volts, 0.25),
        }
    }

    fn params(self) -> PlantParams {
        match self {
            Actuator::Brake => PlantParams::default(),
            Actuator::Motor => PlantParams {
                drive_torque: 0.0,
                actuator: MotorActuator { gain: 0.05, preload: 0.25, load_share: 0.0 }.into(),
                ..PlantParams::default()
            },
        }
    }
}

/// A shaft, by explicit steps of a microsecond.
struct Shaft {
    actuator: Actuator,
    /// Friction, as a multiple of what the law believes, and its ripple along the disc, as a share.
    friction: f64,
    ripple: f64,
    position: f64,
    velocity: f64,
}

/// Friction along the disc, as a multiple of the mean, where a map has it.
fn wave(position: f64, ripple: f64) -> f64 {
    1.0 + ripple * libm::sin(340.0 * position)
}

impl Shaft {
    fn period(&mut self, volts: f64) {
        const STEPS: u32 = 1000;
        let dt = PERIOD / f64::from(STEPS);
        for _ in 0..STEPS {
            let (drive, normal) = self.actuator.acts(volts);
            let normal = normal * self.friction * wave(self.position, self.ripple);
            if self.velocity == 0.0 && drive.abs() <= MU.0 * normal {
                return;
            }
            let way = if self.velocity == 0.0 { drive.signum() } else { self.velocity.signum() };
            let mu = MU.1 + (MU.0 - MU.1) * libm::exp(-self.velocity.abs() / STRIBECK);
            let torque = drive - way * mu * normal - DAMPING * self.velocity;
            let next = self.velocity + dt * torque / INERTIA;
            // Friction stops a shaft, and does not turn it round.
            self.velocity = if next * way < 0.0 { 0.0 } else { next };
            self.position += dt * self.velocity;
        }
    }
}

/// A run: the way of the voltage to the shaft, the shaft, the law.
struct Run {
    law: GlideParams<f64>,
    delay: usize,
    shaft: Shaft,
    /// The map that the law has.
    map: Option<Vec<u16>>,
}

/// Counts between the points of the map.
const STEP: u32 = 10;

impl Run {
    fn new(actuator: Actuator) -> Run {
        Run {
            law: GlideParams { micro: 1.0_f64.to_radians(), ..GlideParams::default() },
            delay: 0,
            shaft: Shaft {
                actuator,
                friction: 1.0,
                ripple: 0.0,
                position: 0.5 / COUNTS_PER_RADIAN,
                velocity: 0.0,
            },
            map: None,
        }
    }

    /// With a map of a disc of this ripple, along so many counts.
    fn mapped(mut self, ripple: f64, counts: u32) -> Run {
        let factor = |i: u32| {
            let position = (f64::from(i * STEP) + 0.5) / COUNTS_PER_RADIAN;
            (wave(position, ripple) * f64::from(FrictionMap::ONE)).round() as u16
        };
        self.map = Some((0..=counts / STEP).map(factor).collect());
        self
    }

    /// Follows rates (°/s, each with its seconds). Of each after its first half second: the largest error (°) and the
    /// time at rest (s). Parts that the map had, as they came.
    fn follow(mut self, rates: &[(f64, f64)]) -> (Vec<(f64, f64)>, Vec<f64>) {
        let two_sided = matches!(self.shaft.actuator, Actuator::Motor);
        self.law.filter.delay = self.delay as u32;
        let law = LawParams::Glide(self.law);
        let mut params = ServoParams { model: self.shaft.actuator.params(), ..ServoParams::paper(law) };
        if two_sided {
            params.output.lowest = -10.0;
            params.output.on_invalid = 0.0;
        }
        let servo = Servo::<f64>::new(&params).unwrap();
        let (pieces, targets) = path(self.shaft.position * COUNTS_PER_RADIAN, rates);
        let map = self.map.as_ref().map(|factors| FrictionMap::new(0, STEP, factors).unwrap());
        let planned = &OnDisc { path: |tick: u64| targets[tick as usize], map };
        let still = if two_sided { 0.0 } else { 5.0 };
        let mut line = VecDeque::from(vec![still; self.delay]);
        let mut state = servo.start(self.counts(), &targets[0], still);
        let (mut out, mut parts, mut tick) = (vec![(0.0_f64, 0.0); rates.len()], Vec::new(), 0);
        for (piece, seen) in pieces.iter().zip(&mut out) {
            for k in 0..*piece {
                let target = target(planned, tick);
                let answer =
                    servo.tick_on(&mut state, self.counts(), &target, |position| place(planned, position));
                let part = answer.command.terms.values()[6];
                if parts.last() != Some(&part) {
                    parts.push(part);
                }
                line.push_back(servo.dac().volts(answer.code));
                let before = self.shaft.position;
                self.shaft.period(line.pop_front().unwrap());
                tick += 1;
                if k >= 500 {
                    let counts: f64 = target.position.minus(FixedCounts(0));
                    let error = counts - before * COUNTS_PER_RADIAN;
                    seen.0 = seen.0.max(error.abs() * 360.0 / COUNTS_PER_TURN);
                    seen.1 += if self.shaft.position == before { PERIOD } else { 0.0 };
                }
            }
        }
        (out, parts)
    }

    fn counts(&self) -> Counts {
        Counts((self.shaft.position * COUNTS_PER_RADIAN).floor() as i32)
    }
}

fn target(planned: impl Planned<f64>, tick: u64) -> Target<f64> {
    planned.target(tick)
}

fn place(planned: impl Planned<f64>, position: FixedCounts) -> Place<f64> {
    planned.place(position)
}

/// Periods of each of some rates (°/s, each with its seconds), and targets from `start` counts on.
fn path(start: f64, rates: &[(f64, f64)]) -> (Vec<u32>, Vec<Target<f64>>) {
    let pieces: Vec<u32> = rates.iter().map(|(_, seconds)| (seconds / PERIOD).round() as u32).collect();
    let (mut counts, mut targets) = (start, Vec::new());
    for ((rate, _), periods) in rates.iter().zip(&pieces) {
        let velocity = rate.to_radians();
        for _ in 0..*periods {
            let position = FixedCounts((counts * f64::from(1_u32 << FixedCounts::FRACTION_BITS)) as i64);
            targets.push(Target { position, velocity, acceleration: 0.0 });
            counts += velocity * PERIOD * COUNTS_PER_RADIAN;
        }
    }
    (pieces, targets)
}

/// A count is 0.018°.
const COUNT: f64 = 360.0 / COUNTS_PER_TURN;

/// Steps rest for a third of the time at least, motion never; neither is farther from its path than a share of a count.
fn holds(seen: &[(f64, f64)], rates: &[(f64, f64)], share: f64) {
    for ((error, rests), (rate, seconds)) in seen.iter().zip(rates) {
        assert!(*error < share * COUNT, "{rate} °/s: {error}°");
        let steps = rate.abs() < 1.0;
        assert!(
            if steps { *rests > 0.33 * (seconds - 0.5) } else { *rests == 0.0 },
            "{rate} °/s: {rests} s at rest"
        );
    }
}

#[test]
fn a_brake_goes_from_steps_to_motion_and_back_within_a_third_of_a_count() {
    let rates = [(0.3, 2.0), (2.0, 2.0), (0.3, 2.0)];
    for delay in [0, 1, 3] {
        let (seen, parts) = Run { delay, ..Run::new(Actuator::Brake) }.follow(&rates);
        holds(&seen, &rates, 0.33);
        assert_eq!(parts, [0.0], "there is no map");
    }
}

#[test]
fn friction_a_fifth_off_what_is_believed_is_learnt_by_steps_and_motion_begins_with_it() {
    let rates = [(0.3, 3.0), (2.0, 2.0)];
    for friction in [0.8, 1.25] {
        let mut run = Run::new(Actuator::Brake);
        run.shaft.friction = friction;
        let (seen, _) = run.follow(&rates);
        holds(&seen, &rates, 0.33);
    }
}

#[test]
fn a_map_drives_in_motion_through_steps_to_its_end_and_a_wrong_one_is_dropped() {
    let rates = [(2.0, 2.0), (0.3, 1.0), (2.0, 3.0)];
    // It ends at 10°, half a second before the path does; the wrong one has ridges where the disc has furrows.
    for (ripple, parts) in [(0.15, vec![0.0, 1.0, 2.0, 0.0]), (-0.15, vec![0.0, 1.0, 3.0])] {
        let mut run = Run::new(Actuator::Brake).mapped(ripple, 560);
        run.shaft.ripple = 0.15;
        let (seen, came) = run.follow(&rates);
        holds(&seen, &rates, 0.33);
        assert_eq!(came, parts, "none, tried, drives or dropped");
    }
}

#[test]
fn a_map_that_begins_in_steps_drives_in_the_motion_behind_them() {
    // Of 60 lengths of the steps, from 0.75 s to 3.7 s, one (2 s) has the map taken for a wrong one.
    let rates = [(0.3, 1.5), (2.0, 2.0)];
    let mut run = Run::new(Actuator::Brake).mapped(0.15, 560);
    run.shaft.ripple = 0.15;
    let (seen, came) = run.follow(&rates);
    holds(&seen, &rates, 0.33);
    assert_eq!(came, [0.0, 1.0, 2.0]);
}

#[test]
fn a_path_that_stops_and_goes_on_is_waited_for_at_rest_with_and_without_steps() {
    let rates = [(2.0, 1.5), (0.0, 1.5), (2.0, 1.5)];
    for micro in [0.0, 1.0_f64.to_radians()] {
        let mut run = Run::new(Actuator::Brake);
        run.law.micro = micro;
        let (seen, _) = run.follow(&rates);
        // It stops where it is: a brake does not go back, and a path that rests leaves no edge to look for.
        holds(&seen, &rates, 1.0);
    }
}

#[test]
fn a_motor_steps_and_moves_both_ways_within_a_third_of_a_count() {
    let rates = [(0.3, 2.0), (-0.3, 2.0), (2.0, 2.0), (-2.0, 2.0), (-0.3, 1.0)];
    let (seen, _) = Run::new(Actuator::Motor).follow(&rates);
    holds(&seen, &rates, 0.33);
}
