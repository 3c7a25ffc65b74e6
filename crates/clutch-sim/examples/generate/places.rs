//! Places at which the tables of a scenario stand.

use clutch_core::params::{ChoiceInfo, Info, OptionInfo, Params, Row, TableInfo};
use clutch_sim::scenario::describe::{Entry, entries};
use clutch_sim::scenario::{ScenarioParams, check_section};
use toml::{Table, Value};

/// A table and the key at which a file has it; the whole file is at "".
pub(crate) struct Place {
    /// The key, with those of the tables around it.
    pub(crate) key: String,
    /// The table that stands there.
    pub(crate) table: &'static TableInfo,
    /// Its choice and its option, if it is one of several.
    pub(crate) option: Option<(&'static ChoiceInfo, &'static OptionInfo)>,
}

/// Every table, each before those below it.
pub(crate) fn places() -> Vec<Place> {
    let mut all = Vec::new();
    walk(&<ScenarioParams as Params<f64>>::INFO, String::new(), &mut all);
    all
}

fn walk(info: &'static Info, key: String, all: &mut Vec<Place>) {
    match info {
        Info::Table(table) => table_at(Place { key, table, option: None }, all),
        Info::Choice(choice) => {
            for option in choice.options {
                let key = join(&key, option.key);
                table_at(Place { key, table: option.table, option: Some((choice, option)) }, all);
            }
        }
    }
}

fn table_at(place: Place, all: &mut Vec<Place>) {
    let (key, table) = (place.key.clone(), place.table);
    all.push(place);
    for entry in entries(table) {
        if let Entry::Below(nested) = entry {
            walk(nested.info, join(&key, nested.key), all);
        }
    }
}

/// Value of a parameter of which a file says nothing: the row's default or, in a rig, what the paper's has; empty if it
/// has none.
pub(crate) fn default_at(key: &str, row: &Row) -> String {
    let rig = || {
        let base = Table::from_iter([("base".to_owned(), Value::from("paper"))]);
        let rig = check_section("rig", "rig", base).ok()?;
        Some(rig.get(key.strip_prefix("rig.")?)?.to_string())
    };
    match row.default {
        "" if row.optional => rig().unwrap_or_default(),
        default => default.to_owned(),
    }
}

/// A key below another.
pub(crate) fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}

impl Place {
    /// Its meaning, in the words of its declaration.
    pub(crate) fn doc(&self) -> &'static str {
        match self.option {
            Some((_, option)) if self.table.doc.is_empty() => option.doc,
            _ => self.table.doc,
        }
    }
}
