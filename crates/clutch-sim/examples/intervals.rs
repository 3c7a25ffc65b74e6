//! Moves a shaft over single intervals, read from the input line by line, by the engine that is named: what a referee
//! outside of this project compares with its own solution. `python/tests/intervals.py` is one.
//!
//! A line is `J C mu_s mu_d v_s torque volts K_COF velocity seconds`, in SI, and besides Stribeck's exponent where that is not 1, or for
//! the engine of bristles, whose friction is LuGre's, `sigma_0 sigma_1`; the answer is `position velocity` and the instants of the events, `+` for a
//! break-away and `-` for a stick, or the error in words. `system` is the motion of a system of one inertia and one row.

use clutch_core::friction::LugreParams;
use clutch_core::{
    ActuatorParams, Friction, FrictionModel, FrictionParams, Plant, PlantParams, StribeckParams,
};
use clutch_sim::drive::Drive;
use clutch_sim::engine::{Bristle, DormandPrince, Engine, EventKind, ExactFlow, Input, Model, Shaft, Volts};
use clutch_sim::system::{Mode, Motion, System, SystemState};
use nalgebra::{SMatrix, SVector};
use std::io::{BufRead, Write};

/// Steps of a system in an interval at most: as many as Dormand–Prince's engine of shafts takes.
const STEPS: u32 = 100_000;

/// The numbers of a line, but for friction, velocity and time.
struct Pushed {
    inertia: f64,
    damping: f64,
    torque: f64,
    volts: f64,
    brake_gain: f64,
}

/// The end, and instants of events: true for a break-away.
type Moved = (f64, f64, Vec<(bool, f64)>);

/// A shaft as a system of one inertia and one row.
struct One<'a> {
    pushed: &'a Pushed,
    friction: Friction<f64>,
}

impl System<1, 1> for One<'_> {
    fn inertia(&self, _: &SVector<f64, 1>) -> SMatrix<f64, 1, 1> {
        SVector::from([self.pushed.inertia])
    }
    fn applied(&self, _: f64, _: &SVector<f64, 1>, v: &SVector<f64, 1>) -> SVector<f64, 1> {
        SVector::from([self.pushed.torque - self.pushed.damping * v[0]])
    }
    fn rows(&self, _: &SVector<f64, 1>) -> SMatrix<f64, 1, 1> {
        SVector::from([1.0])
    }
    fn normal(&self, _: f64) -> SVector<f64, 1> {
        SVector::from([self.pushed.brake_gain * self.pushed.volts])
    }
    fn friction(&self, _: usize) -> &Friction<f64> {
        &self.friction
    }
}

fn by_system(
    pushed: &Pushed,
    friction: &FrictionParams,
    velocity: f64,
    seconds: f64,
) -> Result<Moved, Box<dyn std::error::Error>> {
    let system = One { pushed, friction: Friction::build(friction)? };
    let begin = SystemState { time: 0.0, position: SVector::zeros(), velocity: SVector::from([velocity]) };
    let (mut motion, mut events) = (Motion::new(&system, begin)?.with_limit(STEPS), Vec::new());
    let breaks_away = velocity == 0.0 && motion.modes()[0] != Mode::Stuck;
    motion.advance(seconds, &mut events)?;
    let first = breaks_away.then_some((true, 0.0));
    let events = first.into_iter().chain(events.iter().map(|e| (e.mode != Mode::Stuck, e.time))).collect();
    Ok((motion.state().position[0], motion.state().velocity[0], events))
}

fn by_shaft(
    engine: &mut dyn Engine,
    pushed: &Pushed,
    friction: FrictionParams,
    velocity: f64,
    duration: f64,
) -> Result<Moved, Box<dyn std::error::Error>> {
    let plant = PlantParams {
        inertia: pushed.inertia,
        drive_torque: pushed.torque,
        viscous_damping: pushed.damping,
        actuator: ActuatorParams::brake(pushed.brake_gain),
        friction,
    };
    let model = Model { plant: Plant::new(&plant)?, ripple: None };
    let drive = Drive::Constant(pushed.torque);
    let volts = Volts::Held(pushed.volts);
    let input = Input { time: 0.0, duration, origin: 0.0, volts, drive: &drive, noise: 0.0 };
    let (mut shaft, mut events) = (Shaft::new(0.0, velocity), Vec::new());
    engine.advance(&model, &input, &mut shaft, &mut events)?;
    let events = events.iter().map(|e| (e.kind == EventKind::BreakAway, e.time)).collect();
    Ok((shaft.position, shaft.velocity, events))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let name = std::env::args().nth(1).unwrap_or_default();
    if !["exact_flow", "dormand_prince", "system", "bristle"].contains(&name.as_str()) {
        return Err(format!("engine {name:?}: expected exact_flow, dormand_prince, system or bristle").into());
    }
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let numbers = line.split_ascii_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>()?;
        let [
            inertia,
            damping,
            mu_static,
            mu_dynamic,
            stribeck_velocity,
            torque,
            volts,
            brake_gain,
            velocity,
            seconds,
            ref more @ ..,
        ] = numbers[..]
        else {
            return Err(format!("{} numbers: expected at least 10", numbers.len()).into());
        };
        let pushed = Pushed { inertia, damping, torque, volts, brake_gain };
        let stribeck_exponent = if let [exponent] = more[..] { exponent } else { 1.0 };
        let curve = StribeckParams { mu_static, mu_dynamic, stribeck_velocity, stribeck_exponent };
        let curve = FrictionParams::from(curve);
        let moved = match (name.as_str(), more) {
            ("exact_flow", []) => by_shaft(&mut ExactFlow, &pushed, curve, velocity, seconds),
            ("dormand_prince", [] | [_]) => {
                by_shaft(&mut DormandPrince::default(), &pushed, curve, velocity, seconds)
            }
            ("system", [] | [_]) => by_system(&pushed, &curve, velocity, seconds),
            ("bristle", &[stiffness, damping]) => {
                let lugre = LugreParams {
                    mu_static,
                    mu_dynamic,
                    stribeck_velocity,
                    stribeck_exponent,
                    stiffness,
                    damping,
                };
                by_shaft(&mut Bristle::default(), &pushed, lugre.into(), velocity, seconds)
            }
            _ => {
                return Err(format!(
                    "{} numbers: expected 10, with an exponent 11, with bristles 12",
                    numbers.len()
                )
                .into());
            }
        };
        match moved {
            Err(error) => writeln!(out, "error {error}")?,
            Ok((position, velocity, events)) => {
                write!(out, "{position:e} {velocity:e}")?;
                for (breaks_away, time) in events {
                    write!(out, " {}{time:e}", if breaks_away { '+' } else { '-' })?;
                }
                writeln!(out)?;
            }
        }
    }
    Ok(())
}
