//! The declarations of a scenario's tables, for readers: documentation, Python's classes, the schema of files.

use crate::tables::default_of;
use clutch_core::params::{Info, Kind, Nested, Row, TableInfo};

/// The entry at a key of a table.
#[derive(Clone, Copy, Debug)]
pub enum Entry {
    /// A parameter, and the table that declares it.
    Row(&'static Row, &'static TableInfo),
    /// A table or a choice.
    Below(&'static Nested),
}

/// Keys of a table in the order in which people read them: parameters, those of flat tables among them, then tables.
/// A table that only adds to a flat one comes after it.
#[must_use]
pub fn entries(table: &'static TableInfo) -> Vec<Entry> {
    let flat = |nested: &&Nested| nested.key.is_empty();
    let own = table.rows.iter().map(|row| Entry::Row(row, table));
    let added = table.nested.iter().filter(flat).filter_map(|n| n.info.table()).flat_map(entries);
    let below: Vec<Entry> = table.nested.iter().filter(|n| !flat(n)).map(Entry::Below).collect();
    let rows: Vec<Entry> =
        if below.is_empty() { added.chain(own).collect() } else { own.chain(added).collect() };
    rows.into_iter().chain(below).collect()
}

/// True if a file has to say something of a parameter.
#[must_use]
pub fn row_is_required(row: &Row) -> bool {
    row.default.is_empty() && !row.optional
}

/// True if a file has to say something of a table or a choice.
#[must_use]
pub fn table_is_required(nested: &Nested) -> bool {
    !nested.optional && default_of(nested.info).is_none()
}

/// The option that is taken where a file says nothing of a choice.
#[must_use]
pub fn default_option(info: &'static Info) -> Option<&'static str> {
    match info {
        Info::Choice(choice) if default_of(info).is_some() => choice.options.first().map(|option| option.key),
        _ => None,
    }
}

/// Values that a parameter may have, in words and in the unit of its key: by itself, then together with others.
#[must_use]
pub fn expected(row: &Row, table: &TableInfo) -> String {
    let mut text = row.range.words(row.kind, &row.unit, false).to_string();
    for relation in table.relations {
        if table.rows.get(usize::from(relation.row)).is_some_and(|r| r.key == row.key) {
            text = format!("{text}; {}", relation.expected);
        }
    }
    text
}

/// The meaning of a parameter; of a word, what each choice stands for.
#[must_use]
pub fn meaning(row: &Row) -> String {
    let mut text = paragraphs(row.doc).join(" ");
    if let Kind::Word(words) = row.kind {
        for word in words {
            text = format!("{text} `{}`: {}", word.name, paragraphs(word.doc).join(" "));
        }
    }
    text
}

/// All that a reader needs of a parameter in one paragraph: meaning, symbol, range. The range of a word, a switch or a
/// text is in its kind.
#[must_use]
pub fn description(row: &Row, table: &TableInfo) -> String {
    let meaning = meaning(row);
    let range = expected(row, table);
    match (row.kind, row.symbol) {
        (Kind::Word(_) | Kind::Switch | Kind::Text, _) => meaning,
        (_, "") => format!("{meaning} {}.", capital(&range)),
        (_, symbol) => format!("{meaning} `{symbol}`: {range}."),
    }
}

/// A text with a capital letter.
#[must_use]
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// The paragraphs of a declaration's text, each in one line.
#[must_use]
pub fn paragraphs(doc: &str) -> Vec<String> {
    doc.lines()
        .map(str::trim)
        .collect::<Vec<_>>()
        .split(|line| line.is_empty())
        .map(|p| p.join(" "))
        .collect()
}
