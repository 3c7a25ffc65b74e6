//! The error of a piece.

/// Part that a piece may leave out, as a share of what it is: above the layer the speed, of a quadrature the time, of a series the rate
/// of speed.
pub(super) const TOLERANCE: f64 = 1e-10;
