//! Shafts of a block as they begin: a rig each, and the facts of their motion that they have in common.

use crate::engine::EngineKind;
use crate::moving_rig::MovingRig;
use crate::rig::Rig;
use crate::ripple::{Ripple, Shape};
use clutch_core::{ActuatorKind, FrictionParams};
use std::mem::{Discriminant, discriminant};

/// Facts of their motion that the shafts of a block have in common.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Alike {
    /// Sampling period, s.
    pub(super) period: f64,
    /// Periods from sample to voltage.
    pub(super) delay: usize,
    pub(super) engine: EngineKind,
    /// Dormand–Prince: whether the actuator lags, and the shape of the friction along the disc.
    pub(super) lags: bool,
    shape: Option<Shape>,
    plant: (ActuatorKind, Discriminant<FrictionParams>),
}

impl Alike {
    /// For a rig that an engine moves, sampled each `period` seconds; none if it has to move alone.
    pub(super) fn of(rig: &Rig, engine: EngineKind, period: f64) -> Option<Self> {
        let p = &rig.params;
        let in_steps = engine == EngineKind::DormandPrince && rig.drive.is_constant();
        if p.torque_noise > 0.0 || (engine != EngineKind::ExactFlow && !in_steps) {
            return None;
        }
        Some(Alike {
            period,
            delay: p.delay_ticks as usize,
            engine,
            lags: p.actuator_time_constant.is_some(),
            shape: rig.model.ripple.as_ref().map(Ripple::shape),
            plant: (p.actuator.kind(), discriminant(&p.friction)),
        })
    }
}

/// A rig as it begins, and the voltage at its pad, V.
pub(super) type Begin<'a> = (&'a MovingRig, f64);
