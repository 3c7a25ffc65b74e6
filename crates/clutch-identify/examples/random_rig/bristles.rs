//! A shaft on bristles whose stiffness does not scale with the force: a plant of its own, since all friction of the simulator is
//! a coefficient times the force.
//!
//! The bristles carry `F = s z + d ż` with `ż = θ̇ − |θ̇| s z/(N g)`, `N` the force of the brake; they carry no more than the force lets
//! them, `s |z| ≤ N μ_s`. A voltage that rises acts over the way `N g/s` alone.

use clutch_core::friction::FrictionModel as _;
use clutch_core::{Counts, DacCode};
use clutch_identify::Recording;
use clutch_identify::experiment::ExperimentError;
use clutch_identify::recording::{Recorded, glides_at};
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_sim::Scenario;
use clutch_sim::rig::Rig;
use std::collections::VecDeque;

/// Steps of the plant in a period.
const STEPS: usize = 100;
/// Damping of the bristles over that of aperiodic motion.
const DAMPED: f64 = 0.3;
/// Error at which nothing that is seen says more, rad.
const ASTRAY: f64 = 0.5;

/// A part of the experiment on a shaft driven by `torque` (N m), whose bristles let go after the way `presliding` (rad) under the
/// force that holds it. It rests at `rests_at` (rad) before and behind.
pub(crate) fn bristled(
    name: &str,
    scenario: &Scenario,
    torque: f64,
    presliding: f64,
    rests_at: &mut f64,
) -> Result<Vec<Recording>, ExperimentError> {
    let runs = |e: &dyn std::fmt::Display| ExperimentError::Runs(e.to_string());
    let built = BuiltRun::<f64>::new(scenario, 1)?;
    let path = from_scenario::path::<f64>(scenario)?.path;
    let spec = scenario.spec();
    let rig = Rig::new(&spec.rig, spec.run.seed).map_err(|e| runs(&e))?;
    let plant = &rig.model.plant;
    let (inertia, viscous) = (spec.rig.inertia, spec.rig.viscous_damping);
    let (stiffness, period) = (torque / presliding, spec.period.seconds::<f64>());
    let damping = 2.0 * DAMPED * (stiffness * inertia).sqrt();
    let per_radian = rig.encoder.counts_per_radian::<f64>();
    let counts = |angle: f64| (angle * per_radian).floor() as i64;
    let holds = scenario.safety()?.on_fault.holding_voltage().unwrap_or(spec.output.highest);
    let (mut angle, mut velocity, mut force) = (*rests_at, 0.0_f64, torque);
    let first = counts(angle);
    let seen = |angle: f64| Counts((counts(angle) - first) as i32);
    let servo = built.servo;
    let mut state = servo.start(seen(angle), &path(0), holds);
    let mut line: VecDeque<f64> = std::iter::repeat_n(holds, spec.rig.delay_ticks as usize).collect();
    let mut ticks = Vec::new();
    for tick in 0..built.ticks {
        let target = path(tick);
        let out = servo.tick(&mut state, seen(angle), &target);
        if out.tick.error.abs() > ASTRAY {
            return Err(ExperimentError::Ended {
                part: name.to_owned(),
                cause: "astray".into(),
                remedy: String::new(),
            });
        }
        let sent = servo.dac().volts(out.code);
        ticks.push(Recorded { counts: counts(angle), volts: sent });
        line.push_back(sent);
        let volts = line.pop_front().unwrap_or(sent);
        let dt = period / STEPS as f64;
        for _ in 0..STEPS {
            let normal =
                plant.actuator().normal(volts) * rig.model.ripple.as_ref().map_or(1.0, |r| r.factor(angle));
            let end = normal * plant.friction().level(velocity) * velocity.signum();
            let most = normal * plant.friction().at_rest();
            let before = force;
            let relaxed = (-stiffness * velocity.abs() * dt / end.abs().max(1e-12)).exp();
            force = (end + (force - end) * relaxed).clamp(-most, most);
            let damps = (damping * (force - before) / (stiffness * dt)).clamp(-most, most);
            velocity += dt * (torque - viscous * velocity - force - damps) / inertia;
            angle += dt * velocity;
        }
    }
    *rests_at = angle;
    let dac = servo.dac();
    let step_volts = dac.volts(DacCode(1)) - dac.volts(DacCode(0));
    Ok(vec![Recording {
        name: name.to_owned(),
        motor: false,
        period,
        counts_per_rev: spec.rig.encoder.sensor.counts_per_rev,
        step_volts,
        volts_before: holds,
        glides_at: glides_at(scenario),
        first_tick: 0,
        ticks,
    }])
}
