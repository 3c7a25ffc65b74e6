//! Systems of several inertias with dry friction between them: brakes, clutches, belts.
//!
//! ```text
//! M(q) v̇ = Q(t, q, v) − Σ J_iᵀ T_i,     w_i = J_i v − base_i,     |T_i| ≤ μ_s N_i at rest,  T_i = μ(w_i) N_i in motion
//! ```
//!
//! A row is a place where something rubs: its slip rate `w_i` is a combination of velocities, its normal force an input. The
//! shaft of the rest of this crate is the system of one inertia and one row; here several rows may hold one joint, and be
//! redundant. One strictly convex problem says which rows hold and which slip ([`hold`]); between events the motion is
//! smooth and taken by Dormand and Prince's pair, events are located to [`INSTANT`]; what holds stands still exactly.
//!
//! Rows with bristles never hold exactly; a system of such has an engine of its own, [`BristledMotion`].
//!
//! Not here: normal forces that depend on reactions (as of a block on an incline that a lever presses), impacts, backlash,
//! rows with bristles beside rows without.

mod bristled;
mod modes;
mod motion;

pub use bristled::BristledMotion;
pub use modes::{Held, hold};
pub use motion::{INSTANT, Mode, Motion, State, SystemError, SystemEvent};

use clutch_core::Friction;
use nalgebra::{SMatrix, SVector};

/// A system of `N` velocities and `B` rows of friction.
pub trait System<const N: usize, const B: usize> {
    /// `M(q)`, symmetric and positive definite.
    fn inertia(&self, q: &SVector<f64, N>) -> SMatrix<f64, N, N>;

    /// `Q`: all torques but those of the rows.
    fn applied(&self, t: f64, q: &SVector<f64, N>, v: &SVector<f64, N>) -> SVector<f64, N>;

    /// `J`: a row for each place where something rubs.
    fn rows(&self, q: &SVector<f64, N>) -> SMatrix<f64, B, N>;

    /// Velocity of what a row rubs on, as of a belt; constant between two corners.
    fn base(&self, t: f64) -> SVector<f64, B> {
        let _ = t;
        SVector::zeros()
    }

    /// `N_i`: normal forces, as torque per unit of μ; below 0 counts as 0.
    fn normal(&self, t: f64) -> SVector<f64, B>;

    /// Friction of a row.
    fn friction(&self, row: usize) -> &Friction<f64>;

    /// Time within which no load or normal force goes to and fro, s: a row that lets go and holds again within a step of that
    /// length is not seen.
    fn longest_step(&self) -> f64 {
        1e-3
    }

    /// The first time after `t` at which something jumps, or has a corner.
    fn corner(&self, t: f64) -> Option<f64> {
        let _ = t;
        None
    }
}
