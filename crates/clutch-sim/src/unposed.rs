//! Demands that no engine here follows: of a case they are named by its key before any other mistake of the file, of a scenario
//! where its key is unknown.

use toml::{Table, Value};

/// A part of a key, and what a key with it asks for.
const ASKS: [(&[&str], &str); 3] = [
    (
        &["impact", "impacts", "restitution", "bounce", "collision", "contact"],
        "impacts; velocities here do not jump",
    ),
    (&["backlash", "lash", "gap", "play", "clearance"], "backlash; joints here are always in mesh"),
    (&["reaction", "reactions", "wedge", "lever", "incline"], REACTIONS),
];
const REACTIONS: &str = "a normal force that depends on reactions; the normal force of a row is an input here, a list of terms over time";
/// Keys that make a normal force depend on something else than time.
const NORMAL_OF: [&str; 5] = ["of", "row", "joint", "joints", "share"];

/// The first key that asks for what cannot be posed, and what that is.
pub(crate) fn unposed(file: &Table) -> Option<(String, &'static str)> {
    ["mechanism", "impact", "backlash", "gap", "restitution"]
        .into_iter()
        .find_map(|key| in_value(key, key, file.get(key)?))
}

fn in_value(path: &str, key: &str, value: &Value) -> Option<(String, &'static str)> {
    if let Some(what) = asks(path, key) {
        return Some((path.to_owned(), what));
    }
    match value {
        Value::Table(table) => {
            // The friction models have keys of their own.
            let mut keys = table.iter().filter(|(key, _)| *key != "friction");
            keys.find_map(|(key, value)| in_value(&format!("{path}.{key}"), key, value))
        }
        Value::Array(list) => {
            let tables = list.iter().enumerate().filter(|(_, value)| value.is_table());
            let mut tables =
                tables.filter_map(|(i, value)| Some((format!("{path}[{}]", i + 1), value.as_table()?)));
            tables.find_map(|(path, table)| {
                let mut keys = table.iter().filter(|(key, _)| *key != "friction");
                keys.find_map(|(key, value)| in_value(&format!("{path}.{key}"), key, value))
            })
        }
        _ => None,
    }
}

/// Demand of the last key of a path, if it cannot be posed.
pub(crate) fn asks(path: &str, key: &str) -> Option<&'static str> {
    let key = key.to_ascii_lowercase();
    let within_normal = path.split('.').rev().skip(1).any(|part| part.starts_with("normal"));
    if key.starts_with("normal_")
        || (within_normal && NORMAL_OF.contains(&key.split('_').next().unwrap_or("")))
    {
        return Some(REACTIONS);
    }
    ASKS.iter().find(|(words, _)| key.split('_').any(|part| words.contains(&part))).map(|(_, what)| *what)
}
