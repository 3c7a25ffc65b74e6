//! Values as they are written, and the keys at which they are put.

use crate::scenario_error::ScenarioError;
use crate::tables::shown;
use toml::{Table, Value};

/// A value, written as in the file; a bare word is a string, as shells make quoting hard.
#[must_use]
pub fn written_value(text: &str) -> Option<Value> {
    let word = || text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    match format!("x = {text}").parse::<Table>() {
        Ok(mut table) => table.remove("x"),
        Err(_) => word().then(|| Value::String(text.into())),
    }
}

/// As [`written_value`], for a key.
pub(super) fn read_value(origin: &str, key: &str, text: &str) -> Result<Value, ScenarioError> {
    written_value(text).ok_or_else(|| {
        let origin = format!("{origin} with --set {key}={text}");
        ScenarioError::value(&origin, key, text, "a TOML value: a number, true, \"text\" or [a, list]")
    })
}

/// Tables within tables that a key may name; no scenario has more than five.
const DEEPEST: usize = 32;

/// Puts a value at a dotted key.
pub(super) fn set(origin: &str, table: &mut Table, key: &str, value: Value) -> Result<(), ScenarioError> {
    let wrong = |message: String| {
        let origin = format!("{origin} with {key} = {}", shown(&value));
        ScenarioError::new(&origin, "", "", message)
    };
    if key.split('.').count() > DEEPEST {
        return Err(wrong(format!("a key of more than {DEEPEST} parts")));
    }
    let mut at = table;
    let mut parts = key.split('.').peekable();
    while let Some(part) = parts.next() {
        if part.is_empty() {
            return Err(wrong(format!("\"{key}\" is not a key: expected one like law.smc.kp_v")));
        }
        if parts.peek().is_none() {
            at.insert(part.to_owned(), value);
            return Ok(());
        }
        let next = at.entry(part).or_insert_with(|| Value::Table(Table::new()));
        match next {
            Value::Table(t) => at = t,
            _ => return Err(wrong(format!("{part} is not a table"))),
        }
    }
    Ok(())
}
