//! A table of a file against its declaration: unknown and missing keys, kinds, ranges; defaults filled in.

use super::Points;
use super::suggest::{correction, expected, nearest};
use crate::scenario_error::ScenarioError;
use crate::unposed::asks;
use clutch_core::params::{ChoiceInfo, Info, Kind, Row, TableInfo};
use toml::{Table, Value};

/// Fills in what is missing below `path`, after checking what is there.
///
/// # Errors
/// The first thing that is wrong, with its whole key.
pub(crate) fn complete(
    origin: &str,
    path: &str,
    info: &'static Info,
    table: &mut Table,
) -> Result<(), ScenarioError> {
    match info {
        Info::Table(info) => complete_table(origin, path, info, table),
        Info::Choice(info) => complete_choice(origin, path, info, table),
    }
}

fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}

/// Keys of a table, those of its flat tables among them, each with what it is.
fn keys(info: &'static TableInfo) -> Vec<(&'static str, Entry)> {
    let mut all: Vec<_> = info.rows.iter().map(|row| (row.key, Entry::Row(row))).collect();
    for below in info.nested {
        match below.info {
            Info::Table(flat) if below.key.is_empty() => all.extend(keys(flat)),
            info => all.push((below.key, Entry::Below(info, below.optional))),
        }
    }
    all
}

#[derive(Clone, Copy)]
enum Entry {
    Row(&'static Row),
    Below(&'static Info, bool),
}

pub(crate) fn complete_table(
    origin: &str,
    path: &str,
    info: &'static TableInfo,
    table: &mut Table,
) -> Result<(), ScenarioError> {
    let keys = keys(info);
    // First: another version has other keys.
    let version = keys.iter().find(|(key, _)| *key == "version");
    if let (Some((key, Entry::Row(row))), Some(value)) = (version, table.get("version")) {
        checked(origin, &join(path, key), row, value.clone())?;
    }
    if let Some(unknown) = table.keys().find(|key| keys.iter().all(|(known, _)| known != key)) {
        return Err(unknown_key(origin, path, unknown, table.get(unknown), &keys));
    }
    let mut whole = Table::new();
    // A wrong value goes before a missing one: the reader has written it.
    let mut lacks: Option<ScenarioError> = None;
    for (key, entry) in &keys {
        let at = join(path, key);
        let found = table.remove(*key);
        match entry {
            Entry::Row(row) => match found {
                Some(value) => {
                    let value = checked(origin, &at, row, value)?;
                    whole.insert((*key).to_owned(), value);
                }
                None if !row.default.is_empty() => {
                    let value = default_value(row).unwrap_or(Value::Boolean(false));
                    whole.insert((*key).to_owned(), in_kind(row.kind, value));
                }
                None if row.optional => {}
                None => {
                    lacks.get_or_insert_with(|| missing(origin, &at));
                }
            },
            Entry::Below(info, optional) => match (found, optional) {
                (Some(Value::Table(mut below)), _) => {
                    match complete(origin, &at, info, &mut below) {
                        Err(error) if error.message == MISSING => {
                            lacks.get_or_insert(error);
                        }
                        other => other?,
                    }
                    whole.insert((*key).to_owned(), Value::Table(below));
                }
                (Some(other), _) => {
                    let expected = match info {
                        Info::Table(_) => "a table".to_owned(),
                        Info::Choice(c) => {
                            format!("a table that names a choice, as [{at}.{}]", c.options[0].key)
                        }
                    };
                    return Err(ScenarioError::value(origin, &at, &shown(&other), &expected));
                }
                (None, true) => {}
                (None, false) => match default_of(info) {
                    Some(mut below) => {
                        complete(origin, &at, info, &mut below)?;
                        whole.insert((*key).to_owned(), Value::Table(below));
                    }
                    None => {
                        lacks.get_or_insert_with(|| missing(origin, &at));
                    }
                },
            },
        }
    }
    *table = whole;
    lacks.map_or(Ok(()), Err)
}

/// A table without a word of the user's, if every parameter has a default. The first option of a choice is its
/// default, if all of that has one.
pub(crate) fn default_of(info: &'static Info) -> Option<Table> {
    fn whole(info: &'static TableInfo) -> bool {
        info.rows.iter().all(|row| row.optional || !row.default.is_empty())
            && info.nested.iter().all(|below| below.optional || default_of(below.info).is_some())
    }
    match info {
        Info::Table(info) => whole(info).then(Table::new),
        Info::Choice(info) => {
            let first = info.options.first().filter(|_| info.has_default)?;
            whole(first.table).then(|| Table::from_iter([(first.key.to_owned(), Value::Table(Table::new()))]))
        }
    }
}

fn complete_choice(
    origin: &str,
    path: &str,
    info: &'static ChoiceInfo,
    table: &mut Table,
) -> Result<(), ScenarioError> {
    let names: Vec<String> = info.options.iter().map(|option| option.key.to_owned()).collect();
    if let Some(unknown) = table.keys().find(|key| !names.contains(key)) {
        // A parameter of an option, without the option's name.
        let below = info.options.iter().find(|option| keys(option.table).iter().any(|(k, _)| k == unknown));
        let at = join(path, unknown);
        let value = table.get(unknown).filter(|v| !v.is_table()).map(shown).unwrap_or_default();
        let hint = match below {
            Some(option) => format!(": did you mean {path}.{}.{unknown}?", option.key),
            None => correction(unknown, table.get(unknown), &names),
        };
        let message = format!("unknown key{}", expected(&hint, &names));
        return Err(ScenarioError::new(origin, &at, &value, message));
    }
    if table.len() != 1 {
        let found = if table.is_empty() {
            "none".to_owned()
        } else {
            table.keys().map(|k| format!("[{path}.{k}]")).collect::<Vec<_>>().join(", ")
        };
        // A key that is set below one choice does not take another away.
        let other = match table.keys().next_back() {
            Some(last) if table.len() > 1 => {
                format!("; to choose another, set it as a whole: {path}={{{last}={{…}}}}")
            }
            _ => String::new(),
        };
        let message = format!("expected exactly one table below it; found {found}{other}");
        return Err(ScenarioError::new(origin, path, "", message));
    }
    for option in info.options {
        let at = join(path, option.key);
        match table.get_mut(option.key) {
            Some(Value::Table(below)) => complete_table(origin, &at, option.table, below)?,
            Some(other) => return Err(ScenarioError::value(origin, &at, &shown(other), "a table")),
            None => {}
        }
    }
    Ok(())
}

const MISSING: &str = "missing; add it (docs/scenario.md lists every key)";

fn missing(origin: &str, key: &str) -> ScenarioError {
    ScenarioError::new(origin, key, "", MISSING.to_owned())
}

/// Keys of versions before this one, and where their values stand now.
const MOVED: [(&str, &str); 11] = [
    ("rig.brake_gain_nm_v", "rig.actuator.brake.gain_nm_v"),
    ("rig.brake_geometry", "rig.actuator.geometry"),
    ("model.brake_gain_nm_v", "model.actuator.brake.gain_nm_v"),
    ("rig.friction.mu_static", "rig.friction.stribeck.mu_static"),
    ("rig.friction.mu_dynamic", "rig.friction.stribeck.mu_dynamic"),
    ("rig.friction.stribeck_velocity_rad_s", "rig.friction.stribeck.stribeck_velocity_rad_s"),
    ("rig.friction.stribeck_exponent", "rig.friction.stribeck.stribeck_exponent"),
    ("model.mu_static", "model.friction.stribeck.mu_static"),
    ("model.mu_dynamic", "model.friction.stribeck.mu_dynamic"),
    ("model.stribeck_velocity_rad_s", "model.friction.stribeck.stribeck_velocity_rad_s"),
    ("model.stribeck_exponent", "model.friction.stribeck.stribeck_exponent"),
];

/// Keys of versions before this one that nothing has taken over.
const GONE: [&str; 1] = ["safety.limits.stand_still_counts"];

/// The table of a former version's log with the keys of today: those that moved, in their places, and without those that are
/// gone.
pub(crate) fn with_todays_keys(table: &mut Table) {
    let take = |table: &mut Table, path: &str| {
        let (below, key) = path.rsplit_once('.').unwrap_or(("", path));
        let mut parts = below.split('.').filter(|part| !part.is_empty());
        parts.try_fold(table, |at, part| at.get_mut(part)?.as_table_mut())?.remove(key)
    };
    for path in GONE {
        let _ = take(table, path);
    }
    for (old, new) in MOVED {
        let Some(value) = take(table, old) else { continue };
        let (below, key) = new.rsplit_once('.').unwrap_or(("", new));
        let mut at = &mut *table;
        for part in below.split('.') {
            let next = at.entry(part).or_insert_with(|| Value::Table(Table::new()));
            let Value::Table(next) = next else { return };
            at = next;
        }
        at.insert(key.to_owned(), value);
    }
}

fn unknown_key(
    origin: &str,
    path: &str,
    unknown: &str,
    value: Option<&Value>,
    known: &[(&'static str, Entry)],
) -> ScenarioError {
    let names: Vec<String> = known.iter().map(|(key, _)| (*key).to_owned()).collect();
    // The key may have moved into a choice below.
    let moved = known.iter().find_map(|(key, entry)| match entry {
        Entry::Below(Info::Choice(choice), _) => choice.options.iter().find_map(|option| {
            let there = keys(option.table).iter().any(|(k, _)| *k == unknown);
            there.then(|| format!(": did you mean {}.{}.{unknown}?", join(path, key), option.key))
        }),
        _ => None,
    });
    let whole = join(path, unknown);
    let former = MOVED.iter().find(|(old, _)| *old == whole);
    let gone = GONE.contains(&whole.as_str()).then(|| ": it is gone, leave it out".to_owned());
    let moved = former.map(|(_, new)| format!(": did you mean {new}?")).or(gone).or(moved);
    let of_a_rig = ["rig", "model"].contains(&path.split('.').next().unwrap_or(""));
    let unposed = || {
        let asked = if of_a_rig { asks(&whole, unknown) } else { None };
        asked.map(|what| format!(": it asks for {what} (docs/systems.md)"))
    };
    let hint = moved.or_else(unposed).unwrap_or_else(|| correction(unknown, value, &names));
    let shown = value.filter(|v| !v.is_table()).map(shown).unwrap_or_default();
    let message = format!("unknown key{}", expected(&hint, &names));
    ScenarioError::new(origin, &whole, &shown, message)
}

/// A whole number where a real one is expected is one, and a real number that is whole is a whole number, as for JSON Schema.
fn in_kind(kind: Kind, value: Value) -> Value {
    match (kind, &value) {
        (Kind::Real, Value::Integer(i)) => Value::Float(*i as f64),
        // Beyond 2⁵³ a real number stands for several whole ones.
        (Kind::Whole, Value::Float(x)) if libm::trunc(*x) == *x && x.abs() <= 9_007_199_254_740_992.0 => {
            Value::Integer(*x as i64)
        }
        _ => value,
    }
}

/// The value, if it is of the row's kind and in its range.
pub(crate) fn checked(origin: &str, at: &str, row: &Row, value: Value) -> Result<Value, ScenarioError> {
    let expected = || row.range.words(row.kind, &row.unit, false).to_string();
    let as_given = value.clone();
    let given = || shown(&as_given);
    let wrong = |given: &str, expected: &str| Err(ScenarioError::value(origin, at, given, expected));
    let number = |x: f64| row.range.holds(&clutch_core::params::NONE, x);
    let value = in_kind(row.kind, value);
    match (row.kind, &value) {
        (Kind::Real, Value::Float(x)) if number(*x) => Ok(value),
        (Kind::Whole, Value::Integer(i)) if *i >= 0 && number(*i as f64) => Ok(value),
        (Kind::Switch, Value::Boolean(_)) | (Kind::Text, Value::String(_)) => Ok(value),
        (Kind::Word(words), Value::String(word)) if words.iter().any(|w| w.name == word) => Ok(value),
        (Kind::Word(words), Value::String(word)) => {
            let names: Vec<&str> = words.iter().map(|w| w.name).collect();
            wrong(&given(), &format!("{}{}", expected(), nearest(word, &names)))
        }
        (Kind::Points, Value::Array(points)) => {
            let Some(pairs) = points.iter().map(pair).collect::<Option<Vec<_>>>() else {
                return wrong(&given(), &expected());
            };
            let pairs = Points(pairs);
            if pairs.0.is_empty() {
                return wrong(&given(), &expected());
            }
            if let Some(i) = pairs.wrong(&row.range, &row.unit) {
                let point = pairs.0.get(i).map_or(String::new(), |(a, b)| format!("[{a}, {b}] "));
                return wrong(&format!("{point}(point {i})"), &expected());
            }
            let array = |(a, b)| Value::Array(vec![Value::Float(a), Value::Float(b)]);
            Ok(Value::Array(pairs.0.into_iter().map(array).collect()))
        }
        _ => wrong(&given(), &expected()),
    }
}

/// Two numbers.
pub(crate) fn pair(value: &Value) -> Option<(f64, f64)> {
    let number = |v: &Value| v.as_float().or(v.as_integer().map(|i| i as f64));
    match value.as_array()?.as_slice() {
        [a, b] => Some((number(a)?, number(b)?)),
        _ => None,
    }
}

/// A value as a file would have it.
pub(crate) fn shown(value: &Value) -> String {
    match value {
        Value::Float(x) => x.to_string(),
        other => other.to_string(),
    }
}

/// Default of a row; none of one that has to be given, or may be absent.
pub(crate) fn default_value(row: &Row) -> Option<Value> {
    format!("x = {}", row.default).parse::<Table>().ok()?.remove("x")
}

/// The value at a dotted key.
pub(crate) fn lookup<'a>(table: &'a Table, path: &str) -> Option<&'a Value> {
    let mut parts = path.split('.');
    let mut value = table.get(parts.next()?)?;
    for part in parts {
        value = value.as_table()?.get(part)?;
    }
    Some(value)
}

/// Each real number of a table that is complete: its row, its key and its value there.
pub(crate) fn numbers(
    info: &'static Info,
    path: &str,
    table: &Table,
    out: &mut Vec<(&'static Row, String, f64)>,
) {
    fn in_table(
        info: &'static TableInfo,
        path: &str,
        table: &Table,
        out: &mut Vec<(&'static Row, String, f64)>,
    ) {
        let real = |row: &'static Row| Some((row, join(path, row.key), table.get(row.key)?.as_float()?));
        out.extend(info.rows.iter().filter_map(real));
        for below in info.nested {
            match (below.info, table.get(below.key).and_then(Value::as_table)) {
                (Info::Table(flat), _) if below.key.is_empty() => in_table(flat, path, table, out),
                (inner, Some(within)) => numbers(inner, &join(path, below.key), within, out),
                (_, None) => {}
            }
        }
    }
    match info {
        Info::Table(info) => in_table(info, path, table, out),
        Info::Choice(choice) => {
            for option in choice.options {
                if let Some(within) = table.get(option.key).and_then(Value::as_table) {
                    in_table(option.table, &join(path, option.key), within, out);
                }
            }
        }
    }
}

/// Path of the table of this number (none where its option is not chosen), at or below `info`.
pub(crate) fn find(info: &Info, path: &str, table: &Table, id: u32) -> Option<String> {
    fn in_table(info: &TableInfo, path: &str, table: &Table, id: u32) -> Option<String> {
        if info.id == id {
            return Some(path.to_owned());
        }
        info.nested.iter().find_map(|below| match below.info {
            Info::Table(flat) if below.key.is_empty() => in_table(flat, path, table, id),
            inner => find(inner, &join(path, below.key), table.get(below.key)?.as_table()?, id),
        })
    }
    match info {
        Info::Table(info) => in_table(info, path, table, id),
        Info::Choice(choice) => choice.options.iter().find_map(|option| {
            in_table(option.table, &join(path, option.key), table.get(option.key)?.as_table()?, id)
        }),
    }
}
