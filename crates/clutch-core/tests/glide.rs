//! Glide around a shaft that is written here: micro-steps, motion, a map of the disc, both ways of a motor.
#![allow(
    clippy::std_instead_of_core,
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "it runs on the host"
)]

use clutch_core::law::{GlideParams, LawParams, Terms};
use clutch_core::{FixedCounts, FrictionMap, OnDisc, Place, Planned, Servo, ServoParams, Target};
use shaft::{Actuator, COUNTS_PER_RADIAN, COUNTS_PER_TURN, PERIOD, Shaft, path, wave};
use std::collections::VecDeque;

mod shaft;

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
                steps: 1000,
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
        let mut state = servo.start(self.shaft.counts(), &targets[0], still);
        let (mut out, mut parts, mut tick) = (vec![(0.0_f64, 0.0); rates.len()], Vec::new(), 0);
        for (piece, seen) in pieces.iter().zip(&mut out) {
            for k in 0..*piece {
                let target = target(planned, tick);
                let answer = servo
                    .tick_on(&mut state, self.shaft.counts(), &target, |position| place(planned, position));
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
}

fn target(planned: impl Planned<f64>, tick: u64) -> Target<f64> {
    planned.target(tick)
}

fn place(planned: impl Planned<f64>, position: FixedCounts) -> Place<f64> {
    planned.place(position)
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
