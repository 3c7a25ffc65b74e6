//! A column of a channel: the values of one field, a record each.

use crate::channel::{Kind, Value};
use crate::names::{Names, name_of};
use std::borrow::Cow;

/// The word for a value of an enum; the number itself for one of a later version.
#[must_use]
pub fn word(names: Names, value: i64) -> Cow<'static, str> {
    match u8::try_from(value).map_or("?", |value| name_of(names, value)) {
        "?" => value.to_string().into(),
        name => name.into(),
    }
}

/// The values of a field as they come, in the form that tables keep.
#[derive(Clone, Debug)]
pub enum Cells {
    /// Whole numbers; an unsigned one above 2⁶³ − 1 shows as negative.
    Whole(Vec<i64>),
    /// Real numbers.
    Real(Vec<f64>),
    /// True or false.
    Flag(Vec<bool>),
    /// The words of an enum.
    Word(Names, Vec<Cow<'static, str>>),
}

impl Cells {
    /// None yet.
    #[must_use]
    pub fn of(kind: Kind) -> Cells {
        match kind {
            Kind::Double => Cells::Real(Vec::new()),
            Kind::Bool => Cells::Flag(Vec::new()),
            Kind::Enum(_, names) => Cells::Word(names, Vec::new()),
            Kind::Uint32 | Kind::Uint64 | Kind::Sint32 | Kind::Sint64 | Kind::String => {
                Cells::Whole(Vec::new())
            }
        }
    }

    /// Appends a value of the field's kind; NaN for a term that the record does not have.
    ///
    /// # Panics
    /// A value of another kind.
    pub fn push(&mut self, value: Option<Value>) {
        match (self, value) {
            (Cells::Word(names, all), Some(Value::Whole(x))) => all.push(word(names, x)),
            (Cells::Whole(all), Some(Value::Whole(x))) => all.push(x),
            (Cells::Flag(all), Some(Value::Flag(x))) => all.push(x),
            (Cells::Real(all), Some(Value::Real(x))) => all.push(x),
            (Cells::Real(all), _) => all.push(f64::NAN),
            (Cells::Word(..) | Cells::Whole(_) | Cells::Flag(_), _) => {
                unreachable!("a field's value is of its kind: both are made from one row")
            }
        }
    }

    /// Takes all values away, and keeps their memory.
    pub fn clear(&mut self) {
        match self {
            Cells::Whole(all) => all.clear(),
            Cells::Real(all) => all.clear(),
            Cells::Flag(all) => all.clear(),
            Cells::Word(_, all) => all.clear(),
        }
    }
}
