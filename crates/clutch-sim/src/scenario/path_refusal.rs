//! The reason why no actuator follows a path, and what to change.

use super::Scenario;
use crate::scenario_error::ScenarioError;
use clutch_core::law::{Output, OutputParams};
use clutch_core::reference::Reference;
use clutch_core::{ActuatorKind, Bounds, Infeasible, Obstacle, check_path};

/// The part that a path asks too much of.
fn actor(kind: ActuatorKind) -> &'static str {
    match kind {
        ActuatorKind::Brake => "a brake",
        ActuatorKind::Motor => "the motor",
        ActuatorKind::Both => "a brake with this motor",
    }
}

impl Scenario {
    /// The error of a path that cannot be followed, with what to change.
    pub(super) fn path_refusal(
        &self,
        path: &Reference<'_, f64>,
        bounds: &Bounds,
        e: &Infeasible<f64>,
    ) -> ScenarioError {
        let p = &self.params;
        let at_time =
            format!("{} cannot follow the path from t = {:.4} s on", actor(bounds.actuator), e.time);
        let (asked, available) = (e.asked, e.available);
        self.path_message(match e.obstacle {
                    Obstacle::Reverse if bounds.actuator == ActuatorKind::Both => format!(
                        "{at_time}: it runs backwards at {:.4} °/s, and this motor drives forwards alone; keep the velocity at or above 0",
                        -asked.to_degrees()
                    ),
                    Obstacle::Reverse => format!(
                        "{at_time}: it runs backwards at {:.4} °/s, and a brake drives nothing; keep the velocity at or above 0, or give rig and model a motor",
                        -asked.to_degrees()
                    ),
                    Obstacle::Acceleration if available <= 0.0 && p.output.lowest > 0.0 => format!(
                        "{at_time}: with output.lowest_v = {} the brake never lets go enough for the drive to keep the path; lower it",
                        p.output.lowest
                    ),
                    Obstacle::Acceleration if available <= 0.0 && bounds.preload > 0.0 => format!(
                        "{at_time}: the disc drags more than the drive gives, which grants {:.5} °/s²; lower model.actuator.{}.preload_nm and the rig's, or give rig.drive and model.drive_torque_nm more torque",
                        available.to_degrees(),
                        if bounds.actuator == ActuatorKind::Brake { "brake" } else { "both" }
                    ),
                    Obstacle::Acceleration if available <= 0.0 => format!(
                        "{at_time}: damping takes more than the drive gives, which grants {:.5} °/s²; go more slowly, lower viscous_damping_nm_s_rad of model and rig, or give rig.drive and model.drive_torque_nm more torque",
                        available.to_degrees()
                    ),
                    Obstacle::Acceleration => format!(
                        "{at_time}: it accelerates at {:.5} °/s², and the drive grants {:.5} °/s²; accelerate more slowly, give rig.drive and model.drive_torque_nm more torque, or give rig and model a motor",
                        asked.to_degrees(),
                        available.to_degrees()
                    ),
                    Obstacle::Voltage if bounds.actuator == ActuatorKind::Motor => {
                        format!("{at_time}: {}", self.motor_lacks(path, bounds, asked, available))
                    }
                    Obstacle::Voltage if asked < 0.0 => format!(
                        "{at_time}: it needs {asked:.4} V of the motor, and output.lowest_v = {available}; accelerate more slowly, lower the limit, or take a motor with a higher motor_gain_nm_v"
                    ),
                    Obstacle::Voltage => format!(
                        "{at_time}: it needs {asked:.4} V of braking, and output.highest_v = {available}; decelerate more slowly, drive it with less torque, raise the limit, or take a brake with a higher gain"
                    ),
                    Obstacle::Hold => format!(
                        "{at_time}: at rest it needs {asked:.4} N m, and motor and friction hold {available:.4} N m at the worst corner of [bounds]; raise the limits of the output, hang less on it, or take a motor with a higher gain_nm_v"
                    ),
                    Obstacle::NotFinite => format!("{at_time}: its velocity or acceleration is not a number"),
                })
    }
    /// The lack of a motor that needs so many volts, of which its output gives fewer, and what takes most of them.
    fn motor_lacks(&self, path: &Reference<'_, f64>, bounds: &Bounds, asked: f64, available: f64) -> String {
        let p = &self.params;
        let period = p.sampling.sampling.period;
        let most = || {
            let free = OutputParams { lowest: -1e9, highest: 1e9, on_invalid: 0.0, ..p.output };
            check_path(
                path,
                self.ticks(),
                period,
                path.at(0).velocity,
                bounds,
                &Output::new(&free, period).ok()?,
            )
            .ok()
        };
        let (mut need, mut accelerates, mut damps) = (asked, 0.0, 0.0);
        if let Some(most) = most() {
            need = if asked < 0.0 { most.lowest_voltage } else { most.highest_voltage };
            accelerates = bounds.inertia.high * most.largest_acceleration();
            damps = bounds.viscous_damping.high * most.velocity;
        }
        let [low, high] = [bounds.drive_torque.low, bounds.drive_torque.high];
        let parts = [
            (low.abs().max(high.abs()), "hang less on it (rig.drive, model.drive_torque_nm)"),
            (
                bounds.friction.high * bounds.preload,
                "lower rig.actuator.motor.preload_nm and model.actuator.motor.preload_nm",
            ),
            (accelerates, "accelerate more slowly"),
            (damps, "go more slowly, or lower viscous_damping_nm_s_rad of rig and model"),
        ];
        let largest = parts.iter().fold(0.0_f64, |largest, (torque, _)| largest.max(*torque));
        let heavy = parts.iter().filter(|(torque, _)| *torque > 0.3 * largest);
        let advice: String = heavy.map(|(_, advice)| format!("{advice}, ")).collect();
        let (key, way, end) = if asked < 0.0 {
            ("lowest_v", "lower", p.rig.dac.converter.lowest)
        } else {
            ("highest_v", "raise", p.rig.dac.converter.highest)
        };
        let also = if need.abs() > end.abs() { format!(" and rig.dac.{key}") } else { String::new() };
        let on_its_way = if (need / asked - 1.0).abs() > 1e-3 {
            format!(", up to {need:.4} V later")
        } else {
            String::new()
        };
        format!(
            "it needs {asked:.4} V{on_its_way}, and output.{key} = {available}; {advice}{way} output.{key}{also}, or take a motor \
             with a higher gain_nm_v"
        )
    }
}
