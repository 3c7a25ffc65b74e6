//! Parameters and figures as their tables declare them: what a page shows beside the answers.

use clutch_sim::Metrics;
use clutch_sim::metrics::Figure;
use clutch_sim::scenario::{BUILT_IN, Scenario, schema};
use serde_json::{Map, Value, json};

/// Each figure of a run by its field: its name for people, its meaning, the unit that they are shown, and the factor to it.
#[must_use]
pub fn figures() -> Value {
    let one = |f: &Figure<Metrics>| json!({ "label": f.label, "meaning": f.meaning, "unit": f.shown_unit, "factor": f.factor });
    Metrics::FIGURES.iter().map(|f| (f.field.to_owned(), one(f))).collect::<Map<_, _>>().into()
}

/// A parameter of a built-in scenario: what the schema of scenario files says of it, and its value there.
///
/// # Errors
/// No scenario of that name, no number at that key.
pub fn parameter(scenario: &str, key: &str) -> Result<Value, String> {
    let unknown = || format!("{scenario}: no number is called {key}");
    let built_in = BUILT_IN.iter().find(|b| b.name == scenario).ok_or_else(unknown)?;
    let scenario = Scenario::parse(scenario, built_in.toml, &[]).map_err(|e| e.to_string())?;
    let place = key.split('.').map(|part| format!("/properties/{part}")).collect::<String>();
    let mut row = schema().pointer(&place).and_then(Value::as_object).cloned().ok_or_else(unknown)?;
    let mut parts = key.split('.');
    let first = parts.next().and_then(|part| scenario.table().get(part));
    let value = parts.try_fold(first.ok_or_else(unknown)?, |value, part| value.get(part));
    let value = value.filter(|v| v.is_float() || v.is_integer()).ok_or_else(unknown)?;
    row.insert("value".into(), json!(value));
    Ok(row.into())
}
