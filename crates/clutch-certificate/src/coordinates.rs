//! Places of a state's coordinates: the error `e`, its rate `s`, the filter's memory `z`, then the voltages on their way.

pub(crate) const E: usize = 0;
pub(crate) const S: usize = 1;
pub(crate) const Z: usize = 2;
/// Voltages on the way begin here.
pub(crate) const P: usize = 3;
