//! Parameters, each declared once: [`params!`](crate::params!) declares a table, [`choice!`](crate::choice)
//! one of several, [`words!`](crate::words) one of several words.
//!
//! A row gives the field, its key with its unit, its symbol, its range, its default and its meaning. From it
//! come the struct with `Default` and `cast`, the check and its error, what scenario files read and write,
//! the place on the wire, and, through [`Info`], documentation and the Python class. An [`Editor`] walks
//! over values; no text is linked where none is asked for.

mod choice;
mod info;
mod kind;
mod leaf;
mod range;
mod table;
mod table_ref;
mod unit;

pub use info::{ChoiceInfo, Info, Nested, OptionInfo, RelationInfo, Row, TableInfo};
pub use kind::{Kind, Word};
pub use leaf::Leaf;
pub use range::{Range, Words};
pub use table::Relation;
pub use table_ref::TableRef;
pub use unit::*;

use crate::{ParamError, Real};

/// A table of parameters or a choice between several, with values.
pub trait Params<T: Real>: Clone {
    /// The declaration, without values.
    const INFO: Info;

    /// Parameters with their defaults, and with NaN, 0 or nothing where there is none.
    fn blank() -> Self;

    /// Shows each parameter to an editor, which may change it.
    fn edit<E: Editor<T>>(&mut self, editor: &mut E);

    /// Checks each parameter by itself, and what relates those of one table.
    ///
    /// # Errors
    /// The first parameter that is out of range.
    fn check(&self) -> Result<(), ParamError<T>>;
}

/// A table of parameters, with values.
pub trait Table<T: Real>: Params<T> {
    /// Its rows.
    const ROWS: &'static [Row];
    /// Names of its relations.
    const RELATIONS: &'static [&'static str];
    /// The declaration, without values.
    const TABLE: TableInfo;

    /// As [`Params::check`], without the tables below.
    ///
    /// # Errors
    /// The first parameter that is out of range.
    fn check_rows(&self) -> Result<(), ParamError<T>>;
}

/// A choice between tables, with the values of the chosen one.
pub trait Choice<T: Real>: Params<T> {
    /// The declaration, without values.
    const CHOICE: ChoiceInfo;

    /// The place of what is chosen among [`ChoiceInfo::options`].
    fn chosen(&self) -> usize;

    /// Key of what is chosen.
    fn name(&self) -> &'static str {
        Self::CHOICE.options.get(self.chosen()).map_or("", |option| option.key)
    }
}

/// Something that walks over parameters: reads them, sets them, checks them, counts them.
///
/// `P` is the table that a parameter belongs to, `row` its place in [`TableInfo::rows`].
pub trait Editor<T: Real> {
    /// A real number, in SI.
    fn real<P: Table<T>>(&mut self, row: usize, value: &mut T);
    /// A whole number.
    fn whole<P: Table<T>>(&mut self, row: usize, value: &mut u64);
    /// A switch.
    fn switch<P: Table<T>>(&mut self, row: usize, value: &mut bool);
    /// A word: its place in the list of its kind.
    fn word<P: Table<T>>(&mut self, row: usize, value: &mut usize);
    /// A text or a list; none where the struct only borrows it. Hosts, which know the type, override this.
    fn other<P: Table<T>>(&mut self, row: usize, value: Option<&mut dyn core::any::Any>) {
        let _ = (row, value);
    }
    /// True if a parameter that may be absent is there.
    fn present<P: Table<T>>(&mut self, row: usize, present: bool) -> bool {
        let _ = row;
        present
    }
    /// Begins what is at [`TableInfo::nested`] of `P`; whether it is there.
    fn enter<P: Table<T>>(&mut self, nested: usize, present: bool) -> bool {
        let _ = nested;
        present
    }
    /// Ends it.
    fn leave<P: Table<T>>(&mut self, nested: usize) {
        let _ = nested;
    }
    /// The option that is chosen from now on.
    fn choose<C: Choice<T>>(&mut self, chosen: usize) -> usize {
        chosen
    }
    /// Ends the chosen table.
    fn chose<C: Choice<T>>(&mut self, chosen: usize) {
        let _ = chosen;
    }
    /// Begins a table, before its rows.
    fn table<P: Table<T>>(&mut self, table: &P) {
        let _ = table;
    }
}

#[cfg(test)]
mod tests;
