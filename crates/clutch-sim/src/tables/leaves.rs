//! Parameters that allocate: lists of points, and texts.

use clutch_core::Real;
use clutch_core::params::{Editor, Kind, Leaf, Range, Table, Unit};

/// Pairs of numbers, in the units of their key.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points(pub Vec<(f64, f64)>);

/// A text of one line: what is shown of it cannot look like lines of the program's own.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Text(pub String);

impl Points {
    /// The number (from 0) of the first point that is not finite, or whose time is out of the range or not after the
    /// one before.
    pub(super) fn wrong(&self, times: &Range, _: &Unit) -> Option<usize> {
        let plain = clutch_core::params::NONE;
        let good = |i: usize, (time, value): (f64, f64)| {
            times.holds(&plain, time) && value.is_finite() && (i == 0 || self.0[i - 1].0 < time)
        };
        self.0.iter().enumerate().position(|(i, point)| !good(i, *point))
    }
}

impl Text {
    /// The place (from 0) of the first control character.
    fn wrong(&self, _: &Range, _: &Unit) -> Option<usize> {
        self.0.chars().position(char::is_control)
    }
}

macro_rules! leaf {
    ($ty:ident, $kind:ident) => {
        impl Leaf<f64> for $ty {
            const KIND: Kind = Kind::$kind;
            type Literal = ();
            type As<U: Real> = bool; // never cast: these are of a host

            fn of((): (), _: &Unit) -> Self {
                $ty::default()
            }
            fn blank() -> Self {
                $ty::default()
            }
            fn edit<P: Table<f64>, E: Editor<f64>>(&mut self, row: usize, editor: &mut E) {
                editor.other::<P>(row, Some(self));
            }
            fn number(&self) -> f64 {
                self.0.len() as f64
            }
            fn outside(&self, range: &Range, unit: &Unit) -> Option<f64> {
                self.wrong(range, unit).map(|i| i as f64)
            }
            fn cast<U: Real>(&self) -> bool {
                !self.0.is_empty()
            }
        }
    };
}
leaf!(Points, Points);
leaf!(Text, Text);
