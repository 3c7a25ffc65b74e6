//! Gains that are changed while a loop runs, as one who looks on asks for them.

use clutch_sim::Scenario;
use std::fmt;

/// A gain of the law that runs.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Gain {
    /// Its key in a scenario.
    pub key: String,
    /// Its value, in the unit of the key.
    pub value: f64,
    /// Its meaning and range.
    pub meaning: String,
}

/// A change was refused: nothing has changed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Refusal(
    /// The reason, with key, value and what is expected.
    pub String,
);

/// Gains that may be changed.
pub trait LiveGains: fmt::Debug + Send + Sync {
    /// The gains as they are now.
    fn gains(&self) -> Vec<Gain>;

    /// Changes one. Gives what is certified of the loop with it, in words. It takes from a second to more than a minute.
    ///
    /// # Errors
    /// The value is out of range, has no certificate, or the run is over.
    fn change(&self, key: &str, value: f64) -> Result<String, Refusal>;
}

/// A change on its way to the control thread.
#[derive(Clone, Copy, Debug)]
pub struct Change<V> {
    /// The servo that takes over.
    pub servo: V,
    /// Number of the parameter in the scenario's list.
    pub parameter: u16,
    /// Its new value.
    pub value: f64,
    /// Bound on the error of the sampled loop with it, rad; none of gains without a certificate.
    pub error_bound: Option<f64>,
}

/// The control thread's end.
pub type Changes<V> = rtrb::Consumer<Change<V>>;

/// A scenario with another value of a key.
///
/// # Errors
/// As those of a file.
pub(crate) fn with(
    scenario: &Scenario,
    key: &str,
    value: f64,
) -> Result<Scenario, clutch_sim::ScenarioError> {
    let set = [(key.to_owned(), format!("{value:?}"))];
    Scenario::parse(scenario.name(), &scenario.canonical(), &set)
}
