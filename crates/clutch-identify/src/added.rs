//! Torque and inertia one by one, from a second experiment with a known mass added to what drives the shaft.
//!
//! `v_hold = T/(μ_d K)` grows with the torque and nothing else, so that `T = ΔT/(v₂/v₁ − 1)`; J follows by T/J, `μ_d K` by `v_hold`, C by C/J.
//! μ and K act as their product alone.

use crate::Estimate;
use crate::report::{Finding, Report, refused};
use clutch_core::params::{KG, KG_M2, M, M_S2, NM, NM_S_RAD, NM_V, Unit};
use clutch_sim::Scenario;
use clutch_sim::drive::{DriveParams, WeightDrive};

/// A mass that hangs from the pulley beside what is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Added {
    /// Mass, kg.
    pub mass: f64,
    /// Radius of the pulley, m.
    pub radius: f64,
    /// Acceleration of gravity, m/s².
    pub gravity: f64,
}

/// A mass is none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} = {value}: expected a number above 0, in {}", .unit.text)]
pub struct NoMass {
    /// Name of the number.
    pub key: &'static str,
    /// Its value.
    pub value: f64,
    /// Its unit.
    pub unit: Unit,
}

/// Findings of both experiments together.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Separate {
    /// T, N m.
    pub torque: Finding,
    /// J, kg m².
    pub inertia: Finding,
    /// μ_d K, N m/V.
    pub grip: Finding,
    /// μ_s K, N m/V.
    pub grip_at_rest: Finding,
    /// C, N m s/rad.
    pub viscous: Finding,
}

impl Added {
    /// A mass (kg) on a pulley of a radius (m), under the gravity of a scenario's weight.
    ///
    /// # Errors
    /// A number that is not above 0.
    pub fn on(scenario: &Scenario, mass: f64, radius: f64) -> Result<Added, NoMass> {
        let gravity = match scenario.spec().rig.drive {
            DriveParams::Weight(weight) => weight.gravity,
            _ => WeightDrive::default().gravity,
        };
        let added = Added { mass, radius, gravity };
        added.check()?;
        Ok(added)
    }

    /// # Errors
    /// A number that is not above 0.
    pub fn check(&self) -> Result<(), NoMass> {
        let numbers = [("mass", self.mass, KG), ("radius", self.radius, M), ("gravity", self.gravity, M_S2)];
        match numbers.into_iter().find(|(_, x, _)| !(x.is_finite() && *x > 0.0)) {
            Some((key, value, unit)) => Err(NoMass { key, value, unit }),
            None => Ok(()),
        }
    }

    fn torque(&self) -> f64 {
        self.mass * self.gravity * self.radius
    }

    fn inertia(&self) -> f64 {
        self.mass * self.radius * self.radius
    }
}

/// By an increasing function of one and a decreasing one of the other.
fn quotient(a: Estimate, b: Estimate) -> Estimate {
    Estimate { value: a.value / b.value, low: a.low / b.high, high: a.high / b.low }
}

fn product(a: Estimate, b: Estimate) -> Estimate {
    Estimate { value: a.value * b.value, low: a.low * b.low, high: a.high * b.high }
}

/// Torque, inertia and friction from what was found without and with the mass.
#[must_use]
pub fn separate(alone: &Report, with: &Report, added: &Added) -> Separate {
    let all = |finding: Finding| Separate {
        torque: finding.clone(),
        inertia: finding.clone(),
        grip: finding.clone(),
        grip_at_rest: finding.clone(),
        viscous: finding,
    };
    let (Some(v1), Some(v2), Some(p1), Some(p2)) =
        (alone.hold.known(), with.hold.known(), alone.pull.known(), with.pull.known())
    else {
        return all(refused(
            "T/J and v_hold have to be known without and with the mass: both need releases and a ride",
        ));
    };
    let ratio = quotient(v2, v1);
    if ratio.low <= 1.0 {
        return all(refused(
            "v_hold with the mass is not surely above that without: a heavier mass, a fifth of the load or more, determines it",
        ));
    }
    let by = |ratio: f64| added.torque() / (ratio - 1.0);
    let torque = Estimate { value: by(ratio.value), low: by(ratio.high), high: by(ratio.low) };
    let inertia = quotient(torque, p1);
    // With the mass T/J has to be what both then give. A mass that is given wrong scales all alike, and is not seen.
    let then = |torque: f64, inertia: f64| (torque + added.torque()) / (inertia + added.inertia());
    if then(torque.high, inertia.low) < p2.low || then(torque.low, inertia.high) > p2.high {
        return all(Finding::Refused(format!(
            "T/J with the mass, {:.3} … {:.3} rad/s², is not what {} kg at {} m give: is that the radius, or did anything else change?",
            p2.low, p2.high, added.mass, added.radius
        )));
    }
    let grip = quotient(torque, v1);
    let or =
        |known: Option<Estimate>, finding: &Finding| known.map_or_else(|| finding.clone(), Finding::Known);
    Separate {
        torque: Finding::Known(torque),
        inertia: Finding::Known(inertia),
        grip: Finding::Known(grip),
        grip_at_rest: or(alone.ratio.known().map(|r| product(r, grip)), &alone.ratio),
        viscous: or(alone.damping.known().map(|c| product(c, inertia)), &alone.damping),
    }
}

impl Separate {
    /// Key (SI), name, unit and finding, in the order in which they are shown.
    #[must_use]
    pub fn rows(&self) -> [(&'static str, &'static str, Unit, &Finding); 5] {
        [
            ("drive_torque_nm", "T", NM, &self.torque),
            ("inertia_kg_m2", "J", KG_M2, &self.inertia),
            ("grip_nm_v", "μ_d K", NM_V, &self.grip),
            ("grip_at_rest_nm_v", "μ_s K", NM_V, &self.grip_at_rest),
            ("viscous_damping_nm_s_rad", "C", NM_S_RAD, &self.viscous),
        ]
    }
}
