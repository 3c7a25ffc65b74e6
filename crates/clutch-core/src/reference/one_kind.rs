//! Paths of one kind each, for programs that have no other.

use super::profile::{JerkLimited, MinimumJerk, Profile, Ramp, Trapezoid};
use super::scale::Scale;
use super::table::{Table, Tabulated};
use super::wave::{Chirp, Sine, Wave};
use crate::{Encoder, Micros, ParamError, Planned, Real};

/// A path of one kind, for a program that has no other: each kind's code then stays out of it but this one's.
pub trait OneKind<T: Real> {
    /// The checked path.
    type Path: Planned<T>;

    /// The checked path, from position 0 on.
    ///
    /// # Errors
    /// The first parameter out of range, by name.
    fn path(&self, encoder: Encoder, period: Micros) -> Result<Self::Path, ParamError<T>>;
}

/// A kind whose path is of another type, from factors between its units and counts.
macro_rules! one_kind {
    ($($kind:ident $path:ident $made:ident;)+) => {$(
        impl<T: Real> OneKind<T> for $kind<T> {
            type Path = $path<T>;

            fn path(&self, encoder: Encoder, period: Micros) -> Result<$path<T>, ParamError<T>> {
                $path::$made(self, Scale::new(encoder, period)?)
            }
        }
    )+};
}

one_kind! {
    Ramp Profile ramp;
    Trapezoid Profile trapezoid;
    JerkLimited Profile jerk_limited;
    MinimumJerk Profile minimum_jerk;
    Sine Wave sine;
    Chirp Wave chirp;
}

impl<'a, T: Real> OneKind<T> for Table<'a> {
    type Path = Tabulated<'a, T>;

    fn path(&self, encoder: Encoder, period: Micros) -> Result<Tabulated<'a, T>, ParamError<T>> {
        period.period::<T>()?;
        Tabulated::new(self, encoder, period)
    }
}
