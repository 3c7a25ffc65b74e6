//! The rig of a scenario against the bounds that its certificates were asked for.

use super::{NOISE_ROOTS, Scenario, ScenarioError};
use crate::number;
use crate::rig::Rig;
use crate::ripple::Ripple;
use clutch_core::friction::FrictionModel;
use clutch_core::params::{KG_M2, NM, NM_S_RAD, NM_V, NONE, Unit};
use clutch_core::{Bounds, Interval};

/// Lines on what lies outside.
#[derive(Default)]
struct Outside(Vec<String>);

impl Outside {
    /// A quantity that the rig has from one value to another, against its bound.
    fn check(&mut self, name: &str, unit: Unit, low: f64, high: f64, bound: &Interval) {
        // A hair's breadth for what °, % and products round.
        let slack = 1e-9 * bound.high.abs();
        if low < bound.low - slack || high > bound.high + slack {
            let range = |a: f64, b: f64| {
                if b - a <= slack { format!("{a:.5}") } else { format!("{a:.5} … {b:.5}") }
            };
            let found = if (high - low).is_finite() { range(low, high) } else { "of any size".to_owned() };
            let (unit, bounds) = (unit.text, range(bound.low, bound.high));
            let gap = if unit.is_empty() { "" } else { " " };
            self.0.push(format!("{name} is {found}, bounds {bounds}{gap}{unit}"));
        }
    }

    fn exactly(&mut self, name: &str, unit: Unit, value: f64, bound: f64) {
        self.check(name, unit, value, value, &Interval { low: bound, high: bound });
    }
}

/// The certificate whose bounds are asked for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Of {
    /// That in continuous time.
    ContinuousTime,
    /// The bound as sampled. Its box has noise, delay and ripple of `[rig]`, and there is none with a lag.
    Sampled,
}

impl Scenario {
    /// Properties of the rig that lie outside the bounds that the certificate in continuous time was asked for, or that no
    /// bounds have, as delay and lag: a line each. That certificate says nothing of such a rig.
    ///
    /// # Errors
    /// None for a checked scenario.
    pub fn outside_bounds(&self, bounds: &Bounds) -> Result<Vec<String>, ScenarioError> {
        self.outside(bounds, Of::ContinuousTime)
    }

    /// Properties of the rig that lie outside the box of plants of a bound as sampled: a line each. That bound says nothing of
    /// such a rig.
    ///
    /// # Errors
    /// None for a checked scenario.
    pub fn outside_sampled(&self, bounds: &Bounds) -> Result<Vec<String>, ScenarioError> {
        self.outside(bounds, Of::Sampled)
    }

    fn outside(&self, bounds: &Bounds, of: Of) -> Result<Vec<String>, ScenarioError> {
        let rig = Rig::new(&self.params.rig, self.params.run.seed).map_err(|e| self.at("rig", &e))?;
        let (p, actuator) = (rig.model.plant.params(), rig.model.plant.actuator());
        let mut lines = Outside::default();
        lines.check("inertia", KG_M2, p.inertia, p.inertia, &bounds.inertia);
        self.drive(&rig, bounds, of, &mut lines);
        lines.check(
            "viscous damping",
            NM_S_RAD,
            p.viscous_damping,
            p.viscous_damping,
            &bounds.viscous_damping,
        );
        let (brake, motor) = (actuator.brake_gain(), actuator.motor_gain());
        lines.check("brake gain", NM_V, brake, brake, &bounds.brake_gain);
        lines.check("motor gain", NM_V, motor, motor, &bounds.motor_gain);
        lines.exactly("preload", NM, actuator.preload(), bounds.preload);
        lines.exactly("load share", NONE, actuator.load_share(), bounds.load_share);
        self.friction(&rig, bounds, of, &mut lines);
        match of {
            Of::ContinuousTime => self.time(&mut lines),
            Of::Sampled => lines.0.extend(self.sampled(bounds).slower_fall),
        }
        Ok(lines.0)
    }

    /// The fall of the rig's friction from rest, if it is slower than the one that a bound as sampled takes: `[model]`'s.
    pub(super) fn slower_fall(&self, [velocity, exponent]: [f64; 2]) -> Option<String> {
        let rig = Rig::new(&self.params.rig, self.params.run.seed).ok()?;
        let friction = rig.model.plant.friction();
        let fall = friction.falls().filter(|_| friction.at_rest() > friction.sliding())?;
        let slower = fall.velocity > velocity * (1.0 + 1e-9) || fall.exponent < exponent - 1e-9;
        slower.then(|| {
            format!(
                "its friction falls with v_s {} rad/s, δ {}, slower than v_s {} rad/s, δ {} of model.friction",
                number(fall.velocity),
                number(fall.exponent),
                number(velocity),
                number(exponent)
            )
        })
    }

    /// The drive's torque, with that at random on it.
    fn drive(&self, rig: &Rig, bounds: &Bounds, of: Of, lines: &mut Outside) {
        let (low, high) = rig.drive.range();
        let noise = self.params.rig.torque_noise;
        if noise > 0.0 && of == Of::ContinuousTime {
            let name = format!("driving torque ± {NOISE_ROOTS} · {} N m of noise", number(noise));
            lines.check(
                &name,
                NM,
                low - NOISE_ROOTS * noise,
                high + NOISE_ROOTS * noise,
                &bounds.drive_torque,
            );
        } else {
            lines.check("driving torque", NM, low, high, &bounds.drive_torque);
        }
    }

    fn friction(&self, rig: &Rig, bounds: &Bounds, of: Of, lines: &mut Outside) {
        let model = rig.model.plant.friction();
        let swing = rig.model.ripple.as_ref().map_or(0.0, Ripple::largest);
        let kinds = [
            ("static friction", model.at_rest(), &bounds.friction_at_rest),
            ("dynamic friction", model.sliding(), &bounds.friction_sliding),
        ];
        // Where the bounds name no ripple, the box as sampled has the rig's around each mean.
        let around = if of == Of::Sampled { 0.0 } else { swing };
        for (name, mu, bound) in kinds {
            lines.check(name, NONE, mu * (1.0 - around), mu * (1.0 + around), bound);
        }
        let known = &self.params.bounds;
        if let Some(share) = known.ripple {
            // The change along the disc, and the mean that is left, have bounds of their own.
            for (name, mean, bound) in kinds {
                lines.check(&format!("mean {name}"), NONE, mean, mean, &known.mean_of(bound));
            }
            lines.check("ripple of friction", NONE, swing, swing, &Interval { low: 0.0, high: share });
        }
        match of {
            Of::ContinuousTime if model.bristles().is_some_and(|b| b.damps()) => {
                lines.0.push("friction has bristles with damping, bounds that of steady sliding".to_owned());
            }
            Of::Sampled if model.bristles().is_some() => {
                lines.0.push("friction has bristles, a bound as sampled none".to_owned());
            }
            _ => {}
        }
    }

    /// The time from a sample to the torque, of which continuous time has none.
    fn time(&self, lines: &mut Outside) {
        let p = &self.params;
        let (ticks, period) = (p.rig.delay_ticks, p.sampling.sampling.period.0);
        if ticks > 0 {
            let unit = if ticks == 1 { "tick" } else { "ticks" };
            lines.0.push(format!("delay is {ticks} {unit} of {period} µs, bounds none"));
        }
        if let Some(lag) = p.rig.actuator_time_constant {
            lines.0.push(format!("lag of the actuator is {} s, bounds none", number(lag)));
        }
    }
}
