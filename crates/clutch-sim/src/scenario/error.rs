//! Mistakes in a scenario: file, key, value, what is expected, what to do.

use crate::tables::shown;
use std::fmt;
use toml::{Table, Value};

/// A mistake in a scenario.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScenarioError {
    /// The file, or the name of a built-in scenario.
    pub origin: String,
    /// The key with its tables, as `law.smc.kp_v`; empty if it is about the whole file.
    pub key: String,
    /// The value, as the file has it; empty if there is none.
    pub value: String,
    /// Text of what is wrong or expected.
    pub message: String,
}

impl fmt::Display for ScenarioError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.origin)?;
        match (self.key.is_empty(), self.value.is_empty()) {
            (true, _) => write!(f, "{}", self.message),
            (false, true) => write!(f, "{}: {}", self.key, self.message),
            (false, false) => write!(f, "{} = {}: {}", self.key, self.value, self.message),
        }
    }
}

impl std::error::Error for ScenarioError {}

impl ScenarioError {
    pub(super) fn syntax(origin: &str, e: &toml::de::Error) -> Self {
        // The library's message shows the line with a marker below it.
        ScenarioError::new(origin, "", "", format!("this is not TOML:\n{e}"))
    }

    /// An error of a key's value, and what is expected instead; `origin` is what it begins with.
    #[must_use]
    pub fn value(origin: &str, key: &str, value: &str, expected: &str) -> Self {
        ScenarioError::new(origin, key, value, format!("expected {expected}"))
    }

    pub(crate) fn new(origin: &str, key: &str, value: &str, message: String) -> Self {
        ScenarioError { origin: origin.into(), key: key.into(), value: value.into(), message }
    }
}

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
