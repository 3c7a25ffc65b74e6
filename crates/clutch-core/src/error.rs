//! What a constructor says of a parameter it cannot take.

use crate::Real;
use core::fmt;

/// A parameter outside its range: which, what it was, what is expected.
///
/// ```
/// use clutch_core::{Micros, law::{PdParams, Pd}};
/// let params = PdParams::<f64> { kp: f64::NAN, ..PdParams::default() };
/// let error = Pd::new(&params, &Default::default(), Micros(1000)).unwrap_err();
/// assert_eq!(error.field, "kp");
/// assert_eq!(error.to_string(), "kp = NaN: expected a finite number of at least 0 V/rad");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParamError<T = f64> {
    /// Name of the field, as in the parameter struct.
    pub field: &'static str,
    /// Its value.
    pub value: T,
    /// What is expected, in words, with the unit.
    pub expected: &'static str,
}

impl<T: fmt::Display> fmt::Display for ParamError<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {}: expected {}", self.field, self.value, self.expected)
    }
}

impl<T: fmt::Debug + fmt::Display> core::error::Error for ParamError<T> {}

/// Gives parameter structs a `cast` to the other scalar.
macro_rules! cast {
    ($name:ident { $($field:ident),* } $(keep { $($kept:ident),* })? $(nested { $($inner:ident),* })?) => {
        impl<T: $crate::Real> $name<T> {
            /// The same in another scalar, each number rounded to the nearest.
            #[must_use]
            pub fn cast<U: $crate::Real>(&self) -> $name<U> {
                $name {
                    $($field: U::from_f64(self.$field.to_f64()),)*
                    $($($kept: self.$kept,)*)?
                    $($($inner: self.$inner.cast(),)*)?
                }
            }
        }
    };
}
pub(crate) use cast;

/// `Ok` if `holds` and `value` is finite.
pub(crate) fn require<T: Real>(
    field: &'static str,
    value: T,
    holds: bool,
    expected: &'static str,
) -> Result<T, ParamError<T>> {
    if holds && value.is_finite() { Ok(value) } else { Err(ParamError { field, value, expected }) }
}
