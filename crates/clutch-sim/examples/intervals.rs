//! Moves a shaft over single intervals, read from the input line by line, by the engine that is named: what a referee
//! outside of this project compares with its own solution. `python/tests/intervals.py` is one.
//!
//! A line is `J C mu_s mu_d v_s torque volts K_COF velocity seconds`, in SI; the answer is `position velocity` and the
//! instants of the events, `+` for a break-away and `-` for a stick, or the error in words.

use clutch_core::{ActuatorParams, Plant, PlantParams, StribeckParams};
use clutch_sim::drive::Drive;
use clutch_sim::engine::{DormandPrince, Engine, EventKind, ExactFlow, Input, Model, Shaft, Volts};
use std::io::{BufRead, Write};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let exact = match std::env::args().nth(1).as_deref() {
        Some("exact_flow") => true,
        Some("dormand_prince") => false,
        other => return Err(format!("engine {other:?}: expected exact_flow or dormand_prince").into()),
    };
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
            time,
        ] = numbers[..]
        else {
            return Err(format!("{} numbers: expected 10", numbers.len()).into());
        };
        let friction =
            StribeckParams { mu_static, mu_dynamic, stribeck_velocity, ..StribeckParams::default() };
        let plant = PlantParams {
            inertia,
            drive_torque: torque,
            viscous_damping: damping,
            actuator: ActuatorParams::brake(brake_gain),
            friction: friction.into(),
        };
        let model = Model { plant: Plant::new(&plant)?, ripple: None };
        let drive = Drive::Constant(torque);
        let input = Input {
            time: 0.0,
            duration: time,
            origin: 0.0,
            volts: Volts::Held(volts),
            drive: &drive,
            noise: 0.0,
        };
        let (mut shaft, mut events) = (Shaft::new(0.0, velocity), Vec::new());
        let moved = if exact {
            ExactFlow.advance(&model, &input, &mut shaft, &mut events)
        } else {
            DormandPrince::default().advance(&model, &input, &mut shaft, &mut events)
        };
        match moved {
            Err(error) => writeln!(out, "error {error}")?,
            Ok(()) => {
                write!(out, "{:e} {:e}", shaft.position, shaft.velocity)?;
                for event in events {
                    let sign = if event.kind == EventKind::BreakAway { '+' } else { '-' };
                    write!(out, " {sign}{:e}", event.time)?;
                }
                writeln!(out)?;
            }
        }
    }
    Ok(())
}
