//! Reasons why a rate is not smooth, all but one in a closed form; docs/theory.md, section 15, derives them.
//!
//! They are of the rig as it is, not of the plant that the law believes in. A rate at which none holds need not be smooth: it
//! may stick for another reason.

use super::Failure;
use crate::progress::Report;
use crate::rig::Rig;
use crate::ripple::Ripple;
use crate::scenario::Scenario;
use crate::scenario_error::ScenarioError;
use clutch_certificate::{Setup, stability};
use clutch_core::friction::FrictionModel;
use clutch_core::law::Damping;
use clutch_core::{ActuatorKind, VelocityParams};
use serde::Serialize;

/// Growth between two edges, as a power of e, from which on a law cannot hold what grows.
pub const ENCODER_LIMIT: f64 = 2.0;

/// A reason why a rate is not smooth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Wall {
    /// The linear sampled loop is unstable.
    SampledLoop,
    /// Friction falls faster with the speed than the law brakes.
    StribeckEdge,
    /// An instability grows too much between two edges of the encoder.
    EncoderEdge,
    /// An edge of the encoder, through the law's derivative gain, takes more speed than there is.
    EdgeJolt,
    /// Friction's ripple along the disc: the run is smooth if the disc is even. Asked where none of the others holds.
    Ripple,
}

impl Wall {
    /// Every cause, in the order in which they are reported.
    pub const ALL: [Wall; 5] =
        [Wall::SampledLoop, Wall::StribeckEdge, Wall::EncoderEdge, Wall::EdgeJolt, Wall::Ripple];
}

/// The ground from which the causes follow, at a rate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evidence {
    /// The rate, °/s.
    pub rate_deg_s: f64,
    /// The causes that hold at this rate.
    pub causes: Vec<Wall>,
    /// Spectral radius of the linear sampled loop with the rig's mean friction; none where it is not known.
    pub spectral_radius: Option<f64>,
    /// Reason why the spectral radius is not known.
    pub not_covered: Option<String>,
    /// Rate below which friction falls faster than the law brakes, °/s, 0 if it nowhere does; none where it is not known.
    pub stribeck_edge_deg_s: Option<f64>,
    /// Rate at which a departure from the speed grows by itself as friction falls with the speed, 1/s; none where it is not
    /// known.
    pub stribeck_growth_1_s: Option<f64>,
    /// Rate at which it grows as friction falls along the disc, 1/s.
    pub ripple_growth_1_s: f64,
    /// Time from one edge of the encoder to the next, s; none with an ideal sensor.
    pub edge_time_s: Option<f64>,
    /// Both growths times that time; none where one of them is not known.
    pub growth_between_edges: Option<f64>,
    /// Speed that the law's answer to an edge takes from the shaft, °/s; none where the velocity is no difference of counts,
    /// or the law's damping is not known.
    pub edge_jolt_deg_s: Option<f64>,
    /// True if the run that failed is smooth on an even disc; none where that was not asked.
    pub even_disc_smooth: Option<bool>,
}

impl Evidence {
    /// The evidence for a scenario whose path is a ramp of that rate.
    pub(super) fn new(rate_deg_s: f64, scenario: &Scenario) -> Result<Evidence, ScenarioError> {
        let p = scenario.params();
        let rate = rate_deg_s.to_radians();
        let rig = Rig::new(&p.rig, p.run.seed).map_err(|e| scenario.refuse("rig", &e.to_string()))?;
        let (setup, not_covered) = match scenario.setup_as_it_is() {
            Ok(setup) => (Some(setup), None),
            Err(why) => (None, Some(why.to_string())),
        };
        let radius = setup.as_ref().and_then(|s: &Setup| stability(s)).map(|[_, mean, _]| mean.radius);

        let (plant, actuator) = (&rig.model.plant, rig.model.plant.actuator());
        let (inertia, friction) = (plant.params().inertia, plant.friction());
        let normal = actuator.normal(plant.holding_voltage_sliding());
        let curve = friction.exponential();
        let falls = curve.map(|c| ((c.at_rest - c.sliding) * normal / c.velocity, c.velocity));
        let damping = damping(scenario, &rig);
        let edge = falls.zip(damping).map(|((steepest, velocity), damping)| {
            let ratio = steepest / (damping + plant.params().viscous_damping);
            if ratio > 1.0 { velocity * libm::log(ratio) } else { 0.0 }
        });
        let slope = rig.model.ripple.as_ref().map_or(0.0, Ripple::slope);
        let along = libm::sqrt(friction.sliding() * normal * slope / inertia);
        let falling =
            falls.map(|(steepest, velocity)| (steepest / inertia).max(0.0) * libm::exp(-rate / velocity));
        let count = p.rig.encoder.quantised.then(|| rig.encoder.radians_per_count::<f64>());
        let edge_time = count.map(|count| count / rate);
        let differs = matches!(p.velocity, VelocityParams::SmoothedDerivative(_)) && p.law.filter().is_none();
        let jolt = count.zip(damping).filter(|_| differs).map(|(count, damping)| damping * count / inertia);
        let between = falling.zip(edge_time).map(|(falling, time)| (falling + along) * time);
        let holds = |cause: &Wall| match cause {
            Wall::SampledLoop => radius.is_some_and(|radius| radius > 1.0),
            Wall::StribeckEdge => edge.is_some_and(|edge| rate < edge),
            Wall::EncoderEdge => between.is_some_and(|growth| growth > ENCODER_LIMIT),
            Wall::EdgeJolt => jolt.is_some_and(|jolt| rate < jolt),
            Wall::Ripple => false,
        };
        Ok(Evidence {
            rate_deg_s,
            causes: Wall::ALL.into_iter().filter(holds).collect(),
            spectral_radius: radius,
            not_covered,
            stribeck_edge_deg_s: edge.map(f64::to_degrees),
            stribeck_growth_1_s: falling,
            ripple_growth_1_s: along,
            edge_time_s: edge_time,
            growth_between_edges: between,
            edge_jolt_deg_s: jolt.map(f64::to_degrees),
            even_disc_smooth: None,
        })
    }

    /// The evidence with the run that failed, which is tried on an even disc if nothing else shows why it did.
    pub(super) fn with(
        mut self,
        failed: Option<&Failure>,
        scenario: &Scenario,
        report: Report<'_>,
    ) -> Result<Evidence, ScenarioError> {
        let rig = &scenario.params().rig;
        let uneven = rig.ripple.is_some() || rig.runout.is_some();
        if let Some(failed) = failed.filter(|_| self.causes.is_empty() && uneven) {
            let smooth = scenario.even_disc(failed.rate_deg_s, failed.seed, report)?.is_none();
            self.even_disc_smooth = Some(smooth);
            self.causes.extend(smooth.then_some(Wall::Ripple));
        }
        Ok(self)
    }
}

/// Torque with which the law answers a departure from the speed, near its path, N m s/rad: what it does while nothing
/// saturates. None for a law that switches.
fn damping(scenario: &Scenario, rig: &Rig) -> Option<f64> {
    let p = scenario.params();
    let (plant, actuator) = (&rig.model.plant, rig.model.plant.actuator());
    let per_volt = match actuator.kind() {
        ActuatorKind::Motor => actuator.motor_gain(),
        ActuatorKind::Brake | ActuatorKind::Both => plant.friction().sliding() * actuator.brake_gain(),
    };
    Some(match p.law.damping()? {
        Damping::Voltage(volts) => volts * per_volt,
        Damping::Acceleration(rate) => rate * p.model.inertia,
    })
}
