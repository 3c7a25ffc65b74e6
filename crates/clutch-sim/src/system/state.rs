//! The state of a system: its modes, positions and velocities, and the equations there.

use nalgebra::{SMatrix, SVector};

/// An event is located to this, s.
pub const INSTANT: f64 = 1e-12;
/// Acceleration that a held row may have left, as a share of what load and friction make of it.
pub(super) const STILL: f64 = 1e-12;

/// Motion of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Held: its slip rate is 0.
    #[default]
    Stuck,
    /// Slips with a rate at or above 0.
    Forward,
    /// Slips with a rate at or below 0.
    Backward,
}

impl Mode {
    pub(super) fn sign(self) -> f64 {
        match self {
            Mode::Stuck => 0.0,
            Mode::Forward => 1.0,
            Mode::Backward => -1.0,
        }
    }
}

/// Positions and velocities at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SystemState<const N: usize> {
    /// s
    pub time: f64,
    /// rad
    pub position: SVector<f64, N>,
    /// rad/s
    pub velocity: SVector<f64, N>,
}

/// A motion could not be followed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SystemError {
    /// Too many steps or events.
    #[error("the motion after t = {0} s needs too many steps: a parameter is out of all proportion")]
    TooManySteps(f64),
    /// The state is no longer a number.
    #[error("the motion after t = {0} s left the range of numbers")]
    NotFinite(f64),
    /// The inertia is none.
    #[error("the inertia at t = {0} s is not symmetric and positive definite")]
    Inertia(f64),
    /// The friction of a row has bristles.
    #[error(
        "row {0} has a friction with bristles, which bend before it slides: expected one that sticks exactly"
    )]
    Bristles(usize),
    /// The friction of a row has none.
    #[error(
        "row {0} has a friction without bristles: expected one with bristles, of one element, in every row"
    )]
    NoBristles(usize),
    /// The friction of a row has several elements.
    #[error(
        "row {0} has a friction of several elements: expected one with bristles, of one element, in every row"
    )]
    Elements(usize),
}

/// The equations at a state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Equations<const N: usize, const B: usize> {
    pub(super) inverse: SMatrix<f64, N, N>,
    pub(super) rows: SMatrix<f64, B, N>,
    /// Acceleration without the friction of the rows that hold.
    pub(super) free: SVector<f64, N>,
    /// Normal forces; those below 0 count as 0.
    pub(super) normal: SVector<f64, B>,
    /// `μ_s N` of each row.
    pub(super) bound: SVector<f64, B>,
    /// Slip rates.
    pub(super) slip: SVector<f64, B>,
}
