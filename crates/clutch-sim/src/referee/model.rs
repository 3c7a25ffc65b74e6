//! The moving part of a case.

use super::mechanism::Mechanism;
use serde::Deserialize;

/// The moving part of a case.
#[derive(Clone, Debug)]
pub enum CaseModel {
    /// A linear mechanism with rows of friction.
    Mechanism(Mechanism),
    /// A built-in scenario with changes: shaft, encoder, law, converter.
    Scenario(ScenarioCase),
}

/// A scenario of a case.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScenarioCase {
    /// Name of a built-in scenario.
    pub name: String,
    /// Keys and values over it, as `--set` takes them.
    #[serde(default)]
    pub set: Vec<(String, String)>,
}
