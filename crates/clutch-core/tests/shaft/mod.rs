//! A shaft that is written here and not in the crate: what a voltage makes of it in a period, by explicit steps.

use clutch_core::{Counts, FixedCounts, MotorActuator, PlantParams, Target};
use std::f64::consts::TAU;

pub(crate) const PERIOD: f64 = 1e-3;
pub(crate) const COUNTS_PER_TURN: f64 = 20_000.0;
pub(crate) const COUNTS_PER_RADIAN: f64 = COUNTS_PER_TURN / TAU;
pub(crate) const PULL: f64 = 0.047_088;
pub(crate) const INERTIA: f64 = 0.0017;
pub(crate) const DAMPING: f64 = 0.001;
pub(crate) const MU: (f64, f64) = (0.2, 0.15);
pub(crate) const STRIBECK: f64 = 0.001;

/// Torque of a drive and normal force (as torque per unit of μ) of an actuator at a voltage.
#[derive(Clone, Copy)]
pub(crate) enum Actuator {
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

    pub(crate) fn params(self) -> PlantParams {
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

/// A shaft, by so many explicit steps in a period.
pub(crate) struct Shaft {
    pub(crate) steps: u32,
    pub(crate) actuator: Actuator,
    /// Friction, as a multiple of what the law believes, and its ripple along the disc, as a share.
    pub(crate) friction: f64,
    pub(crate) ripple: f64,
    pub(crate) position: f64,
    pub(crate) velocity: f64,
}

/// Friction along the disc, as a multiple of the mean, where a map has it.
pub(crate) fn wave(position: f64, ripple: f64) -> f64 {
    1.0 + ripple * libm::sin(340.0 * position)
}

impl Shaft {
    pub(crate) fn period(&mut self, volts: f64) {
        let dt = PERIOD / f64::from(self.steps);
        for _ in 0..self.steps {
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

    pub(crate) fn counts(&self) -> Counts {
        Counts((self.position * COUNTS_PER_RADIAN).floor() as i32)
    }
}

/// Periods of each of some rates (°/s, each with its seconds), and targets from `start` counts on.
pub(crate) fn path(start: f64, rates: &[(f64, f64)]) -> (Vec<u32>, Vec<Target<f64>>) {
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
