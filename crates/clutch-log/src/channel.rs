//! A channel: its topic, its protobuf message, the fields of that.

use crate::names::Names;
use clutch_core::params::Unit;

/// A field of a message, as viewers show it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its number on the wire; never used for anything else later.
    pub number: i32,
    /// Its name, with the unit at the end.
    pub name: &'static str,
    /// Its protobuf type.
    pub kind: Kind,
    /// Its meaning.
    pub meaning: &'static str,
}

impl Field {
    /// Its meaning as a label: without the unit, which stands last, and the full stop.
    #[must_use]
    pub fn label(&self) -> &'static str {
        let words = self.meaning.trim_end_matches('.');
        let unit = Unit::of_key(self.name).map_or("", |unit| unit.text);
        words.strip_suffix(unit).and_then(|words| words.strip_suffix(", ")).unwrap_or(words)
    }
}

/// Protobuf type of a [`Field`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `uint32`
    Uint32,
    /// `uint64`
    Uint64,
    /// `sint32`
    Sint32,
    /// `sint64`
    Sint64,
    /// `double`
    Double,
    /// `bool`
    Bool,
    /// `string`
    String,
    /// An enum inside the message: its name and its values.
    Enum(&'static str, Names),
}

impl Kind {
    /// As in a `.proto` file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Kind::Uint32 => "uint32",
            Kind::Uint64 => "uint64",
            Kind::Sint32 => "sint32",
            Kind::Sint64 => "sint64",
            Kind::Double => "double",
            Kind::Bool => "bool",
            Kind::String => "string",
            Kind::Enum(name, _) => name,
        }
    }
}

/// A channel: topic, message, fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Topic: `/sample`.
    pub topic: &'static str,
    /// Protobuf message: `clutch.Sample`.
    pub message: &'static str,
    /// Its content, and its rate.
    pub meaning: &'static str,
    /// Its fields.
    pub fields: &'static [Field],
    /// The number of them, the last ones, that are terms of the law, which has its own names for them.
    pub terms: usize,
}

/// Column of a table before a channel's fields: the time of a record, s.
pub const TIME: &str = "time_s";

impl Channel {
    /// Names and types of the fields as a table shows them behind [`TIME`]: with the law's terms under their own names, and no more
    /// than there are. A term that is called as another column gets its number behind its name.
    #[must_use]
    pub fn columns(&self, terms: &[String]) -> Vec<(String, Kind)> {
        let (fields, of_terms) = self.fields.split_at(self.fields.len() - self.terms);
        let mut columns: Vec<_> = fields.iter().map(|f| (f.name.to_owned(), f.kind)).collect();
        for (i, (term, field)) in terms.iter().zip(of_terms).enumerate() {
            let taken = term == TIME || columns.iter().any(|(name, _)| name == term);
            columns.push((if taken { format!("{term}_{i}") } else { term.clone() }, field.kind));
        }
        columns
    }

    /// A column's meaning as a label; empty for a term of the law, which has a name alone.
    #[must_use]
    pub fn label(&self, column: &str) -> &'static str {
        if column == TIME {
            return "time since the start of the run";
        }
        self.fields.iter().find(|field| field.name == column).map_or("", Field::label)
    }
}

/// A value of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A whole number; an unsigned one above 2⁶³ − 1 shows as negative.
    Whole(i64),
    /// A real number.
    Real(f64),
    /// True or false.
    Flag(bool),
}
