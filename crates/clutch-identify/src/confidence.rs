//! Confidence that an interval holds its value.

/// Standard deviations on either side of a value whose distribution is nearly normal. Two cover 90 %, not 95: the
/// ripple that the filter believes in is not quite the disc's.
pub(crate) const DEVIATIONS: f64 = 2.5;
/// Fall of a logarithm of a likelihood at the ends of an interval.
pub(crate) const FALL: f64 = 0.5 * DEVIATIONS * DEVIATIONS;
