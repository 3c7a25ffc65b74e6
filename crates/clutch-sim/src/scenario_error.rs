//! Mistakes in a scenario: file, key, value, what is expected, what to do.

use std::fmt;

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
            // A value may have line breaks, with which it would look like lines of the program's own.
            (false, false) => {
                let value = self.value.replace('\n', "\\n").replace('\r', "\\r");
                write!(f, "{} = {value}: {}", self.key, self.message)
            }
        }
    }
}

impl std::error::Error for ScenarioError {}

impl ScenarioError {
    pub(crate) fn syntax(origin: &str, e: &toml::de::Error) -> Self {
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
