#![doc = include_str!("../README.md")]
//!
//! # The crate
//!
//! | module | what |
//! |---|---|
//! | [`law`] | the list of laws, the paper's and others: parameters → law → state |
//! | [`Servo`] | encoder counts and target in, DAC code and terms out |
//! | [`Stribeck`], [`Actuator`], [`Plant`] | friction (2), brake or motor, and the shaft (1) |
//! | [`SmoothedDerivative`], `CountsOverTime`, [`edge_timed`], `Observer` | where the velocity comes from |
//! | [`reference`](mod@reference) | planned paths in fixed-point counts |
//! | [`check_path`] | whether a brake can follow a path |
//! | [`certificate`] | what gains guarantee over all plants within [`Bounds`] |
//! | [`StickSlip`] | stick-slip seen from encoder counts |
//! | [`supervisor`] | what may reach the law, and when control ends in the [`SafeState`] |
//!
//! No allocation, no `unsafe`, no reachable panic (a link test shows it), and the same bits on
//! every target for one scalar type. Features: `linalg` (velocity sources that
//! no board has: the observer, on nalgebra, the edge-timed filter for any law, and counts over time), `vsqrt` (on Arm with a unit for floats, the
//! square root by its one instruction, the only `unsafe` of the crate), `defmt`, `terse` (errors without their words).
//! Formatting of errors is outside of the no-panic promise: `core` formats floats.
#![no_std]
#![cfg_attr(not(feature = "vsqrt"), forbid(unsafe_code))]
#![deny(unsafe_code)]
#![cfg_attr(
    test,
    allow(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing,
        clippy::float_cmp_const,
        clippy::disallowed_methods
    )
)]

#[cfg(test)]
extern crate std;

mod actuator;
mod arithmetic;
mod bounds;
pub mod certificate;
mod codes;
#[cfg(feature = "linalg")]
mod counts_over_time;
mod derivative;
pub mod edge_timed;
mod error;
mod feasibility;
mod fnv;
pub mod friction;
mod friction_map;
mod interval;
pub mod law;
mod limit;
#[cfg(feature = "linalg")]
mod observer;
pub mod params;
mod planned;
mod plant;
mod real;
pub mod reference;
mod safe_state;
mod servo;
mod stick_slip;
pub mod supervisor;
mod velocity;

pub use actuator::{
    Actuator, ActuatorKind, ActuatorParams, BothActuator, BrakeActuator, BrakeGeometry, MotorActuator,
};
pub use arithmetic::{Arithmetic, Each};
pub use bounds::{Bounds, Tolerances};
pub use codes::{
    Counts, Dac, DacCode, DacParams, Encoder, EncoderParams, FixedCounts, Micros, SamplingParams,
};
#[cfg(feature = "linalg")]
pub use counts_over_time::{CountsOverTime, CountsOverTimeParams, CountsOverTimeState};
pub use derivative::{DerivativeState, SmoothedDerivative, SmoothedDerivativeParams};
pub use error::ParamError;
pub use feasibility::{Envelope, Infeasible, Obstacle, check_path};
pub use fnv::{FNV_64, fnv1a_64};
pub use friction::{
    Bend, Bristles, Coulomb, CoulombParams, Dahl, DahlParams, ElastoPlastic, ElastoPlasticParams, Friction,
    FrictionModel, FrictionParams, Lugre, LugreParams, Maxwell, MaxwellParams, Stribeck, StribeckParams,
};
pub use friction_map::{FrictionMap, NoMap, Place, off_map};
pub use interval::Interval;
#[cfg(feature = "linalg")]
pub use observer::{Estimate, Observer, ObserverGains, ObserverParams, ObserverState};
pub use planned::{BeginningAt, OnDisc, Planned};
pub use plant::{GRAVITY, Plant, PlantParams};
pub use real::{Real, sin_cos_turns};
pub use reference::Target;
pub use safe_state::{SafeCodes, SafeHold, SafeHoldThenRelease, SafeKind, SafeRamp, SafeRun, SafeState};
pub use servo::{Servo, ServoOutput, ServoParams, ServoState};
pub use stick_slip::{StickSlip, StickSlipParams, StickSlipState};
pub use supervisor::{LimitParams, SpeedLimit, Supervisor, SupervisorParams, SupervisorState};
pub use velocity::{VelocityParams, VelocitySource, VelocityState};
