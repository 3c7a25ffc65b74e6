//! Values as they are written, and the keys at which they are put.

use crate::scenario_error::ScenarioError;
use crate::tables::shown;
use toml::{Table, Value};

/// A value, written as in the file; a bare word is a string, as shells make quoting hard. A whole number with more digits than TOML
/// has for one is a number, too: its key says whether it is in range.
#[must_use]
pub fn written_value(text: &str) -> Option<Value> {
    let word = || text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    let digits = text.strip_prefix(['+', '-']).unwrap_or(text);
    match format!("x = {text}").parse::<Table>() {
        Ok(mut table) => table.remove("x"),
        // Leading zeros are a mistake, as in the file.
        Err(_) if digits.bytes().all(|c| c.is_ascii_digit()) && digits.starts_with(|c| c != '0') => {
            text.parse().ok().map(Value::Float)
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scenario;

    #[test]
    fn a_whole_number_with_too_many_digits_is_out_of_range() {
        for (key, expected) in [
            ("run.seed", "a whole number from 0 to 9"),
            ("rig.delay_ticks", "a whole number from 0 to 1000 p"),
        ] {
            for many in ["99999999999999999999", "-99999999999999999999"] {
                let set = [(key.to_owned(), many.to_owned())];
                let told = Scenario::load("smc_2".as_ref(), &set).unwrap_err().to_string();
                assert!(
                    told.contains(&format!(
                        "{key} = {}1000000",
                        if many.starts_with('-') { "-" } else { "" }
                    )),
                    "{told}"
                );
                assert!(told.contains(&format!("expected {expected}")), "{told}");
            }
        }
        assert_eq!(written_value("007"), Some(Value::String("007".into())));
        assert_eq!(written_value("-12"), Some(Value::Integer(-12)));
        assert_eq!(written_value("-0x"), None);
    }
}
