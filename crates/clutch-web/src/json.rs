//! JSON, written. A library that reads it, too, would be a tenth of the module.

use std::fmt::Write as _;

/// A number; null where it is none.
pub(crate) fn number(x: f64) -> String {
    if x.is_finite() { x.to_string() } else { "null".to_owned() }
}

/// A list of such.
pub(crate) fn list(values: impl IntoIterator<Item = String>) -> String {
    format!("[{}]", values.into_iter().collect::<Vec<_>>().join(","))
}

/// An object of values that are written already.
pub(crate) fn object<'a>(fields: impl IntoIterator<Item = (&'a str, String)>) -> String {
    let fields = fields.into_iter().map(|(key, value)| text(key) + ":" + &value);
    format!("{{{}}}", fields.collect::<Vec<_>>().join(","))
}

/// A text.
pub(crate) fn text(text: &str) -> String {
    let mut out = String::from("\"");
    for letter in text.chars() {
        match letter {
            '"' | '\\' => out.extend(['\\', letter]),
            // No more than JSON asks for; writing to a text does not fail.
            '\0'..' ' => drop(write!(out, "\\u{:04x}", letter as u32)),
            _ => out.push(letter),
        }
    }
    out + "\""
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    #[test]
    fn what_is_written_is_read_as_it_was() {
        let hard = "a \"key\"\\ of\n\u{1}µ °/s";
        let written = object([
            (hard, text(hard)),
            ("numbers", list([0.1, -2e-300, 1e300, f64::NAN, f64::INFINITY].map(number))),
            ("none", list([])),
        ]);
        let read: Value = serde_json::from_str(&written).expect("JSON");
        assert_eq!(read, json!({ hard: hard, "numbers": [0.1, -2e-300, 1e300, null, null], "none": [] }));
    }
}
