//! Points of a path that is a table: how many there may be, and where their keys begin.

/// Points that a path given as a table may have on a board: 4 kB.
pub const MAX_KNOTS: usize = 256;

/// Key of the first number of the points; each has two: time (µs), position (2⁻¹⁶ counts).
pub(super) const FIRST_KNOT: u16 = 0x1000;
