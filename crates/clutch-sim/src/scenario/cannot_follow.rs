//! A rig's drive and actuator against the path: a shaft that no voltage can keep on it.

use super::{NOISE_ROOTS, Scenario, ScenarioError};
use crate::number;
use crate::rig::Rig;
use crate::ripple::Ripple;
use clutch_core::{ActuatorKind, Bounds, FixedCounts, Interval, PlantParams, Tolerances};

/// Times of the run that are looked at, at most.
const LOOKS: u64 = 2000;
/// Share of them at which a shaft that is left behind catches up at others.
const SELDOM: f64 = 0.1;

impl Scenario {
    /// The reason why the rig's shaft cannot follow the path for more than a tenth of the run, and what to change; none if the law
    /// follows no path. The plan asks the same of the believed plant; the rig's drive, actuator and friction may be others.
    ///
    /// # Errors
    /// None for a checked scenario.
    pub fn cannot_follow(&self) -> Result<Option<String>, ScenarioError> {
        let p = &self.params;
        if !p.law.follows() {
            return Ok(None);
        }
        let rig = Rig::new(&p.rig, p.run.seed).map_err(|e| self.at("rig", &e))?;
        let plant = rig.model.plant.params();
        // Of actuator and friction alone: a model may not have each drive that a rig has.
        let undriven = PlantParams { drive_torque: 1.0, ..*plant };
        let mut bounds = Bounds::around(&undriven, &Tolerances::default()).map_err(|e| self.at("rig", &e))?;
        let swing = rig.model.ripple.as_ref().map_or(0.0, Ripple::largest);
        let Interval { low, high } = bounds.friction;
        bounds.friction = Interval { low: low * (1.0 - swing), high: high * (1.0 + swing) };
        let given =
            [true, false].map(|forwards| bounds.possible(forwards, p.output.lowest, p.output.highest));
        let path = self.path().map_err(|e| self.at("reference", &e))?;
        let period = p.sampling.sampling.period.seconds::<f64>();
        let ticks = self.ticks();
        let radians = rig.encoder.radians_per_count::<f64>();
        let noise = NOISE_ROOTS * p.rig.torque_noise;
        let (mut first, mut cannot, mut looks) = (None, 0_u32, 0_u32);
        for tick in (0..ticks).step_by((ticks / LOOKS).max(1) as usize) {
            let target = path.at(tick);
            if target.velocity == 0.0 {
                continue;
            }
            let (time, angle) =
                (tick as f64 * period, target.position.minus::<f64>(FixedCounts(0)) * radians);
            let drive = rig.drive.torque(time, angle);
            let asked = plant.inertia * target.acceleration + plant.viscous_damping * target.velocity;
            let backwards = target.velocity < 0.0;
            let given = given[usize::from(backwards)];
            looks += 1;
            if asked >= drive - noise + given.low && asked <= drive + noise + given.high {
                continue;
            }
            cannot += 1;
            first.get_or_insert((time, drive, asked, given, backwards));
        }
        let share = f64::from(cannot) / f64::from(looks.max(1));
        Ok(first.filter(|_| share > SELDOM).map(|(time, drive, asked, given, backwards)| {
            let when = if cannot == looks {
                String::new()
            } else {
                format!(" for {:.0} % of the run, first at {} s", 100.0 * share, number(time))
            };
            reason(bounds.actuator, &when, drive, asked, &given, backwards)
        }))
    }
}

fn reason(
    actuator: ActuatorKind,
    when: &str,
    drive: f64,
    asked: f64,
    given: &Interval,
    backwards: bool,
) -> String {
    let torques = format!(
        "rig.drive gives {} N m, rig.actuator and friction {} to {} N m, and [reference] takes {} N m",
        number(drive),
        number(given.low),
        number(given.high),
        number(asked)
    );
    // Seen along the path: what is wanted beyond the most, or the least, that drive and actuator give.
    let (drive, asked, most) =
        if backwards { (-drive, -asked, -drive - given.low) } else { (drive, asked, drive + given.high) };
    let change = match (asked > most, actuator) {
        // Without the drag that no voltage lifts the drive would do.
        (true, ActuatorKind::Brake) if asked <= drive => {
            "let rig.drive turn the shaft with more, or lower rig.actuator.brake.preload_nm"
        }
        (true, ActuatorKind::Brake) if drive > 0.0 => {
            "let rig.drive turn the shaft with more, or lower rig.viscous_damping_nm_s_rad or the path's rate"
        }
        (true, ActuatorKind::Brake) => {
            "let rig.drive turn the shaft the path's way, or give rig and model a motor"
        }
        (true, _) => "let rig.drive hold the shaft back less, or raise the motor's gain or output's limits",
        (false, ActuatorKind::Brake) => {
            "let rig.drive turn the shaft with less, or raise the brake's gain or output.highest_v"
        }
        (false, _) => "let rig.drive push the shaft less, or raise the actuator's gain or output's limits",
    };
    format!("no voltage keeps this rig's shaft on the path{when}: {torques}; {change}")
}
