//! Slow, smooth motion of shafts restrained by friction: the control core.
#![no_std]
#![cfg_attr(
    test,
    allow(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing,
        clippy::float_cmp_const
    )
)]

#[cfg(test)]
extern crate std;

mod bounds;
pub mod certificate;
mod codes;
mod derivative;
mod error;
mod feasibility;
mod friction;
pub mod law;
#[cfg(feature = "linalg")]
mod observer;
mod plant;
mod real;
pub mod reference;
mod servo;
mod stick_slip;
mod velocity;

pub use bounds::{Bounds, Interval, Tolerances};
pub use codes::{Counts, Dac, DacCode, DacParams, Encoder, FixedCounts, Micros};
pub use derivative::{DerivativeState, SmoothedDerivative, SmoothedDerivativeParams};
pub use error::ParamError;
pub use feasibility::{Envelope, Infeasible, Obstacle, check_path};
pub use friction::{BrakeGeometry, Stribeck, StribeckParams};
#[cfg(feature = "linalg")]
pub use observer::{Estimate, Observer, ObserverGains, ObserverParams, ObserverState};
pub use plant::{GRAVITY, Plant, PlantParams};
pub use real::{Real, sin_cos_turns};
pub use reference::Target;
pub use servo::{Daq, Servo, ServoOutput, ServoParams, ServoState};
pub use stick_slip::{StickSlip, StickSlipParams, StickSlipState};
pub use velocity::{VelocityParams, VelocitySource, VelocityState};
