//! A shaft with a brake or a motor, whichever it is: its experiment, its findings, its file.

use crate::added::{Added, Separate, separate};
use crate::experiment::{self, ExperimentError, Runs};
use crate::motor;
use crate::recording::{ReadError, Recording};
use crate::report::{self, Finding, Report};
use crate::ride::Place;
use crate::rig_file::{self, Lacks};
use crate::seen::Seen;
use crate::shown::{MOTOR_ROWS, ROWS, Row};
use clutch_core::ActuatorKind;
use clutch_sim::Scenario;

/// Limits of the experiment that a user consents to; what is none is as the experiment has it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Consent {
    /// Way of a motor axis to and fro, °.
    pub travel_deg: Option<f64>,
    /// Highest rate, °/s.
    pub fastest_deg_s: Option<f64>,
}

/// An experiment that is to be run.
#[derive(Clone, Debug, PartialEq)]
pub enum Experiment {
    /// On a shaft that is driven, and braked.
    Brake(experiment::Programme),
    /// On an axis that a motor drives both ways.
    Motor(motor::experiment::Programme),
}

impl Experiment {
    /// The experiment for a scenario's rig.
    ///
    /// # Errors
    /// Limits out of their range, or of another rig than a motor axis.
    pub fn of(scenario: &Scenario, consent: &Consent) -> Result<Experiment, ExperimentError> {
        if scenario.spec().rig.actuator.kind() != ActuatorKind::Motor {
            return match consent.travel_deg {
                Some(_) => Err(ExperimentError::OfMotors("travel")),
                None => experiment::Programme::within(consent.fastest_deg_s).map(Experiment::Brake),
            };
        }
        let own = motor::experiment::Programme::default();
        let programme = motor::experiment::Programme {
            travel_deg: consent.travel_deg.unwrap_or(own.travel_deg),
            fastest_deg_s: consent.fastest_deg_s.unwrap_or(own.fastest_deg_s),
            ..own
        };
        programme.check()?;
        Ok(Experiment::Motor(programme))
    }

    /// Its length, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        match self {
            Experiment::Brake(programme) => programme.seconds(),
            Experiment::Motor(programme) => programme.seconds(),
        }
    }

    /// A line for each part.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        match self {
            Experiment::Brake(programme) => programme.plan(),
            Experiment::Motor(programme) => programme.plan(),
        }
    }

    /// Runs it, part by part.
    ///
    /// # Errors
    /// As [`experiment::experiment`] and [`motor::experiment::experiment`].
    pub fn run(&self, base: &Scenario, run: &mut Runs<'_>) -> Result<Vec<Recording>, ExperimentError> {
        match self {
            Experiment::Brake(programme) => experiment::experiment(base, programme, run),
            Experiment::Motor(programme) => motor::experiment::experiment(base, programme, run),
        }
    }
}

/// A mass was added to a motor axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("loaded: expected logs of a shaft with a brake and a weight, as those without the mass")]
pub struct OfMotor;

/// Findings of either.
#[derive(Clone, Debug)]
pub enum Identified {
    /// Report of a shaft that a brake restrains.
    Brake(Report),
    /// Report of a motor axis.
    Motor(motor::Report),
}

/// A parameter as it is shown.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    /// Key in files and JSON, SI.
    pub key: &'static str,
    /// Name for readers.
    pub label: &'static str,
    /// Unit for readers; empty for a plain number.
    pub unit: &'static str,
    /// Factor from SI to that unit.
    pub factor: f64,
    /// The finding.
    pub finding: &'a Finding,
}

fn shown<'a, R>(rows: &[Row<R>], report: &'a R) -> Vec<Shown<'a>> {
    rows.iter()
        .map(|row| Shown {
            key: row.key,
            label: row.label,
            unit: row.unit,
            factor: row.factor,
            finding: row.finding(report),
        })
        .collect()
}

impl Identified {
    /// Identifies what recordings are of.
    ///
    /// # Errors
    /// Some are of a motor, and some are not.
    pub fn of(recordings: &[Recording]) -> Result<Identified, ReadError> {
        let motors = recordings.iter().filter(|r| r.motor).count();
        match recordings.iter().find(|r| r.motor != recordings[0].motor) {
            Some(other) => Err(ReadError::Mixed(recordings[0].name.clone(), other.name.clone())),
            None if motors > 0 => Ok(Identified::Motor(motor::identify(recordings))),
            None => Ok(Identified::Brake(report::identify(recordings))),
        }
    }

    /// The parameters, in their order.
    #[must_use]
    pub fn shown(&self) -> Vec<Shown<'_>> {
        match self {
            Identified::Brake(report) => shown(&ROWS, report),
            Identified::Motor(report) => shown(&MOTOR_ROWS, report),
        }
    }

    /// Recordings and ticks that the model does not explain.
    #[must_use]
    pub fn unexplained(&self) -> &[String] {
        match self {
            Identified::Brake(report) => &report.unexplained,
            Identified::Motor(report) => &report.unexplained,
        }
    }

    /// Friction along the disc or the way.
    #[must_use]
    pub fn map(&self) -> &[Place] {
        match self {
            Identified::Brake(report) => &report.map,
            Identified::Motor(report) => &report.map,
        }
    }

    /// Releases of a brake or hops of a motor, break-aways, and rates of rides, rad/s.
    #[must_use]
    pub fn found(&self) -> &(usize, usize, Vec<f64>) {
        match self {
            Identified::Brake(report) => &report.found,
            Identified::Motor(report) => &report.found,
        }
    }

    /// Releases and rides beside what is believed of them.
    #[must_use]
    pub fn seen(&self) -> &Seen {
        match self {
            Identified::Brake(report) => &report.seen,
            Identified::Motor(report) => &report.seen,
        }
    }

    /// Waves of the ripple per turn, where rides show them.
    #[must_use]
    pub fn waves(&self) -> Option<f64> {
        match self {
            Identified::Brake(report) => report.waves,
            Identified::Motor(report) => report.waves,
        }
    }

    /// Torque, inertia and friction one by one, with the findings of a second experiment with a mass added.
    ///
    /// # Errors
    /// One of them is of a motor.
    pub fn separate(&self, loaded: &Identified, added: &Added) -> Result<Separate, OfMotor> {
        match (self, loaded) {
            (Identified::Brake(alone), Identified::Brake(with)) => Ok(separate(alone, with, added)),
            _ => Err(OfMotor),
        }
    }

    /// The rig file.
    ///
    /// # Errors
    /// A parameter that is not known.
    pub fn rig_file(&self, scenario: &Scenario) -> Result<String, Lacks> {
        match self {
            Identified::Brake(report) => rig_file::rig_file(report, scenario),
            Identified::Motor(report) => motor::rig_file::rig_file(report, scenario),
        }
    }
}
