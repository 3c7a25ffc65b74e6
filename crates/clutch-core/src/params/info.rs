//! Declarations of parameters, without values: rows, tables, choices. Hosts read them: scenario files,
//! errors, documentation, Python. No function that a board runs does, so that no text is linked there.

use super::{Kind, Range, Unit};

/// A parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Field of the struct.
    pub field: &'static str,
    /// Key in a scenario, with its unit.
    pub key: &'static str,
    /// Symbol in equations; empty if it has none.
    pub symbol: &'static str,
    /// Unit of the key.
    pub unit: Unit,
    /// The kind of value.
    pub kind: Kind,
    /// Values that it may have.
    pub range: Range,
    /// Default as a scenario would have it; empty if the parameter must be given, or may be absent.
    pub default: &'static str,
    /// `true` if it may be absent.
    pub optional: bool,
    /// Its meaning.
    pub doc: &'static str,
}

/// A condition that a parameter fulfils together with others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelationInfo {
    /// The parameter that errors name.
    pub row: u8,
    /// Values expected of it, with the keys of the others.
    pub expected: &'static str,
}

/// A table or a choice within a table.
#[derive(Clone, Copy, Debug)]
pub struct Nested {
    /// Field of the struct.
    pub field: &'static str,
    /// Key of the table; empty if its rows stand among those of the outer table.
    pub key: &'static str,
    /// `true` if it may be absent.
    pub optional: bool,
    /// Its meaning there.
    pub doc: &'static str,
    /// The table or choice itself.
    pub info: &'static Info,
}

/// A table of parameters.
#[derive(Clone, Copy, Debug)]
pub struct TableInfo {
    /// Name of the struct.
    pub name: &'static str,
    /// Its number, made of its name: an error names the table by it.
    pub id: u32,
    /// Its meaning.
    pub doc: &'static str,
    /// Its parameters.
    pub rows: &'static [Row],
    /// Conditions between parameters.
    pub relations: &'static [RelationInfo],
    /// Tables and choices below it.
    pub nested: &'static [Nested],
}

/// One of several tables.
#[derive(Clone, Copy, Debug)]
pub struct OptionInfo {
    /// Key of the table.
    pub key: &'static str,
    /// Its meaning, in a few words.
    pub doc: &'static str,
    /// The table; without rows for an option that needs none.
    pub table: &'static TableInfo,
}

/// A choice between tables.
#[derive(Clone, Copy, Debug)]
pub struct ChoiceInfo {
    /// Name of the enum.
    pub name: &'static str,
    /// Its meaning.
    pub doc: &'static str,
    /// `true` if the first option is taken where a scenario says nothing.
    pub has_default: bool,
    /// Options to choose from.
    pub options: &'static [OptionInfo],
}

/// A table or a choice.
#[derive(Clone, Copy, Debug)]
pub enum Info {
    /// Parameters.
    Table(TableInfo),
    /// One of several tables.
    Choice(ChoiceInfo),
}

impl Info {
    /// Single parameters in all tables and choices, each choice counted as one more: the numbers that it
    /// takes on the wire.
    #[must_use]
    pub const fn places(&self) -> usize {
        match self {
            Info::Table(t) => t.places(),
            Info::Choice(c) => {
                let (mut n, mut options) = (1, c.options);
                while let [option, rest @ ..] = options {
                    n += option.table.places();
                    options = rest;
                }
                n
            }
        }
    }

    /// The table of that number at or below this one.
    #[must_use]
    pub fn find(&'static self, id: u32) -> Option<&'static TableInfo> {
        match self {
            Info::Table(table) => table.find(id),
            Info::Choice(choice) => choice.options.iter().find_map(|option| option.table.find(id)),
        }
    }

    /// The table; nothing of a choice.
    #[must_use]
    pub const fn table(&self) -> Option<&TableInfo> {
        match self {
            Info::Table(t) => Some(t),
            Info::Choice(_) => None,
        }
    }
}

impl TableInfo {
    /// A table without parameters.
    pub const EMPTY: TableInfo =
        TableInfo { name: "", id: 0, doc: "", rows: &[], relations: &[], nested: &[] };

    /// The place of a nested field.
    #[doc(hidden)]
    #[must_use]
    pub const fn below(&self, field: &str) -> usize {
        let (mut place, mut nested) = (0, self.nested);
        while let [below, rest @ ..] = nested {
            if same(below.field, field) {
                return place;
            }
            (place, nested) = (place + 1, rest);
        }
        no_such_name()
    }

    /// As [`Info::places`].
    #[must_use]
    pub const fn places(&self) -> usize {
        let (mut n, mut nested) = (self.rows.len(), self.nested);
        while let [below, rest @ ..] = nested {
            n += below.info.places();
            nested = rest;
        }
        n
    }

    /// The table of that number at or below this one.
    #[must_use]
    pub fn find(&'static self, id: u32) -> Option<&'static TableInfo> {
        if self.id == id { Some(self) } else { self.nested.iter().find_map(|below| below.info.find(id)) }
    }

    /// The number of a table of this name (FNV-1a, 32 bit).
    #[doc(hidden)]
    #[must_use]
    pub const fn id_of(name: &str) -> u32 {
        crate::fnv::fnv1a_32(name.as_bytes())
    }

    /// The place of a parameter; a name that is none does not compile where this is a constant.
    #[doc(hidden)]
    #[must_use]
    pub const fn row_of(rows: &[Row], field: &str) -> u8 {
        let (mut place, mut rows) = (0, rows);
        while let [row, rest @ ..] = rows {
            if same(row.field, field) {
                return place;
            }
            (place, rows) = (place + 1, rest);
        }
        no_such_name()
    }

    /// The place of a name in a list.
    #[doc(hidden)]
    #[must_use]
    pub const fn place(names: &[&str], name: &str) -> u8 {
        let (mut place, mut names) = (0, names);
        while let [first, rest @ ..] = names {
            if same(first, name) {
                return place;
            }
            (place, names) = (place + 1, rest);
        }
        no_such_name()
    }
}

/// Ends the compilation: these searches run in constants only.
#[allow(clippy::panic, reason = "it is reached while constants are computed, and never when something runs")]
const fn no_such_name() -> ! {
    panic!("no such name")
}

const fn same(a: &str, b: &str) -> bool {
    let (mut a, mut b) = (a.as_bytes(), b.as_bytes());
    loop {
        match (a, b) {
            ([], []) => return true,
            ([x, rest_a @ ..], [y, rest_b @ ..]) if *x == *y => (a, b) = (rest_a, rest_b),
            _ => return false,
        }
    }
}
