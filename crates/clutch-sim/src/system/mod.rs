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
mod letting_go;
mod modes;
mod motion;
mod span;
mod state;

pub use bristled::BristledMotion;
pub use modes::{Held, hold};
pub use motion::{Motion, SystemEvent};
pub use state::{INSTANT, Mode, SystemError, SystemState};

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

    /// The most that loads, at positions and velocities that are held, and normal forces bend between two times without a corner
    /// between them: bounds of their second derivatives, N m/s² for each joint and each row. `None`: nobody knows.
    ///
    /// A row that lets go within a step is found by these bounds, however short its excess. Where nobody knows them, they are
    /// estimated from values within each step, which is sound if [`longest_step`](Self::longest_step) is a tenth of the fastest
    /// period or less.
    fn curvature(&self, from: f64, to: f64) -> Option<(SVector<f64, N>, SVector<f64, B>)> {
        let _ = (from, to);
        None
    }

    /// Time within which no load or normal force goes to and fro, s: what moves takes no longer steps, so that their error can
    /// be estimated.
    fn longest_step(&self) -> f64 {
        1e-3
    }

    /// The first time after `t` at which something jumps, or has a corner.
    fn corner(&self, t: f64) -> Option<f64> {
        let _ = t;
        None
    }
}
