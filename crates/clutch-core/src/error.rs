//! The error of a parameter that a constructor cannot take.

use crate::Real;
use crate::params::{Kind, RelationInfo, Row, TableInfo, TableRef};
use core::fmt;

/// A parameter outside its range, or one that does not fit the others.
///
/// ```
/// use clutch_core::{Micros, law::{PdParams, Pd}};
/// let params = PdParams::<f64> { kp: f64::NAN, ..PdParams::default() };
/// let error = Pd::new(&params, &Default::default(), Micros(1000)).unwrap_err();
/// assert_eq!(error.field(), "kp");
/// assert_eq!(error.to_string(), "kp = NaN: expected a finite number of at least 0 V/rad");
/// ```
///
/// A board has numbers only, and its text says so.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParamError<T = f64> {
    /// Its table.
    pub table: TableRef,
    /// Its place in [`TableInfo::rows`].
    pub row: u8,
    /// Place in [`TableInfo::relations`] of the condition that does not hold, from 1; 0 for its own range.
    pub relation: u8,
    /// Its value, SI.
    pub value: T,
}

impl<T: Real> ParamError<T> {
    /// The declaration of its table; nothing on a board.
    #[must_use]
    pub fn table(&self) -> Option<&'static TableInfo> {
        self.table.info()
    }

    /// Its row; nothing on a board.
    #[must_use]
    pub fn row(&self) -> Option<&'static Row> {
        self.table()?.rows.get(usize::from(self.row))
    }

    /// The condition that does not hold, if it is one between parameters; nothing on a board.
    #[must_use]
    pub fn relation(&self) -> Option<&'static RelationInfo> {
        self.table()?.relations.get(usize::from(self.relation).checked_sub(1)?)
    }

    /// Name of the field, as in the parameter struct.
    #[must_use]
    pub fn field(&self) -> &'static str {
        self.row().map_or("", |row| row.field)
    }

    /// The same in another scalar, its value rounded to the nearest.
    #[must_use]
    pub fn cast<U: Real>(&self) -> ParamError<U> {
        let ParamError { table, row, relation, value } = *self;
        ParamError { table, row, relation, value: U::from_f64(value.to_f64()) }
    }
}

impl<T: Real> fmt::Display for ParamError<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(row) = self.row() else {
            let ParamError { table, row, value, .. } = self;
            return write!(f, "row {row} of {table:?} = {value}: out of range");
        };
        let Some(relation) = self.relation() else {
            write!(f, "{} = {}: expected ", row.field, self.value)?;
            return row.range.words(row.kind, &row.unit, row.kind == Kind::Real).fmt(f);
        };
        // It speaks of keys, in their units.
        let value = T::from_f64(row.unit.from_si(self.value.to_f64()));
        write!(f, "{} = {value}: expected {}", row.key, relation.expected)
    }
}

impl<T: Real> core::error::Error for ParamError<T> {}
