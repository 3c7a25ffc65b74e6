//! The JSON Schema of scenario files, with which editors complete and check them.

use super::describe::{Entry, description, entries, paragraphs, row_is_required, table_is_required};
use super::params::ScenarioParams;
use clutch_core::params::{ChoiceInfo, Info, Kind, Nested, OptionInfo, Params, Range, Row, TableInfo};
use serde_json::{Map, Value, json};

/// The table that is laid over a base, from which comes whatever a file leaves out.
const OVER_A_BASE: (&str, &str) = ("rig", "base");

/// The JSON Schema (draft 7) of a scenario file: keys, kinds, ranges, defaults, meanings, units.
///
/// A file that it refuses is refused; of what relates several parameters it knows nothing. `x-unit` and `x-symbol`
/// are for programs that read it.
#[must_use]
pub fn schema() -> Value {
    let mut whole = info_schema(&<ScenarioParams as Params<f64>>::INFO, true);
    whole.insert("$schema".into(), "http://json-schema.org/draft-07/schema#".into());
    whole.insert("title".into(), "A scenario of clutch".into());
    Value::Object(whole)
}

fn info_schema(info: &'static Info, alone: bool) -> Map<String, Value> {
    match info {
        Info::Table(table) => table_schema(table, alone),
        Info::Choice(choice) => choice_schema(choice, alone),
    }
}

/// `alone`: nothing else says what the table leaves out.
fn table_schema(table: &'static TableInfo, alone: bool) -> Map<String, Value> {
    let mut properties = Map::new();
    let mut required = Vec::new();
    for entry in entries(table) {
        let (key, schema, needed) = match entry {
            Entry::Row(row, of) => (row.key, row_schema(row, of), row_is_required(row)),
            Entry::Below(nested) => {
                let alone = alone && nested.key != OVER_A_BASE.0;
                (nested.key, nested_schema(nested, alone), table_is_required(nested))
            }
        };
        if needed && (alone || key == OVER_A_BASE.1) {
            required.push(Value::from(key));
        }
        properties.insert(key.into(), schema);
    }
    let mut schema = object(properties, required);
    schema.insert("description".into(), paragraphs(table.doc).join("\n\n").into());
    schema
}

fn object(properties: Map<String, Value>, required: Vec<Value>) -> Map<String, Value> {
    let mut schema = Map::new();
    schema.insert("type".into(), "object".into());
    schema.insert("properties".into(), properties.into());
    schema.insert("additionalProperties".into(), false.into());
    if !required.is_empty() {
        schema.insert("required".into(), required.into());
    }
    schema
}

fn nested_schema(nested: &'static Nested, alone: bool) -> Value {
    let mut schema = info_schema(nested.info, alone);
    let own = schema.get("description").and_then(Value::as_str).unwrap_or_default();
    let here = paragraphs(nested.doc).join("\n\n");
    let text =
        if own.starts_with(here.trim_end_matches('.')) { own.to_owned() } else { format!("{here}\n\n{own}") };
    schema.insert("description".into(), text.into());
    schema.into()
}

/// Every option is a property, so that what is wrong in one is said of that alone; `oneOf` asks for one of them.
fn choice_schema(choice: &'static ChoiceInfo, alone: bool) -> Map<String, Value> {
    let option = |option: &OptionInfo| {
        let mut below = table_schema(option.table, alone);
        if option.table.doc.is_empty() {
            below.insert("description".into(), paragraphs(option.doc).join("\n\n").into());
        }
        (option.key.to_owned(), Value::Object(below))
    };
    let mut schema = object(choice.options.iter().map(option).collect(), Vec::new());
    schema.insert("oneOf".into(), choice.options.iter().map(|o| json!({ "required": [o.key] })).collect());
    schema.insert("description".into(), paragraphs(choice.doc).join("\n\n").into());
    schema
}

fn row_schema(row: &Row, table: &TableInfo) -> Value {
    let mut schema = match row.kind {
        Kind::Real => limits("number", &row.range, |x| x.into()),
        // Beyond the largest whole number of a file the cast saturates.
        Kind::Whole => limits("integer", &row.range, |x| (x as i64).into()),
        Kind::Switch => kind("boolean"),
        Kind::Text => kind("string"),
        Kind::Word(words) => {
            let mut schema = kind("string");
            schema.insert("enum".into(), words.iter().map(|word| Value::from(word.name)).collect());
            // Taplo, and what is built on it, shows these beside each word.
            let docs: Vec<String> = words.iter().map(|word| paragraphs(word.doc).join(" ")).collect();
            schema.insert("x-taplo".into(), json!({ "docs": { "enumValues": docs } }));
            schema
        }
        Kind::Points => {
            let time = limits("number", &row.range, |x| x.into());
            let mut schema = kind("array");
            let pair =
                json!({ "type": "array", "items": [time, kind("number")], "minItems": 2, "maxItems": 2 });
            schema.insert("items".into(), pair);
            schema
        }
    };
    schema.insert("description".into(), description(row, table).into());
    if let Some(default) = default(row) {
        schema.insert("default".into(), default);
    }
    for (key, text) in [("x-unit", row.unit.text), ("x-symbol", row.symbol)] {
        if !text.is_empty() {
            schema.insert(key.into(), text.into());
        }
    }
    schema.into()
}

fn kind(name: &str) -> Map<String, Value> {
    Map::from_iter([("type".to_owned(), name.into())])
}

fn limits(name: &str, range: &Range, number: impl Fn(f64) -> Value) -> Map<String, Value> {
    let mut schema = kind(name);
    for (end, taken, inclusive, exclusive) in [
        (range.low, range.low_in, "minimum", "exclusiveMinimum"),
        (range.high, range.high_in, "maximum", "exclusiveMaximum"),
    ] {
        if end.is_finite() {
            schema.insert(if taken { inclusive } else { exclusive }.into(), number(end));
        }
    }
    schema
}

/// A row's default as JSON.
fn default(row: &Row) -> Option<Value> {
    let text = format!("x = {}", row.default);
    let value = text.parse::<toml::Table>().ok()?.remove("x")?;
    Some(match (row.kind, value) {
        (Kind::Real, toml::Value::Integer(i)) => (i as f64).into(),
        (_, toml::Value::Float(x)) => x.into(),
        (_, toml::Value::Integer(i)) => i.into(),
        (_, toml::Value::Boolean(b)) => b.into(),
        (_, toml::Value::String(s)) => s.into(),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rows_kind_range_default_and_unit_are_in_its_schema() {
        let schema = schema();
        let at = |path: &str| schema.pointer(path).unwrap_or_else(|| panic!("{path} in {schema:#}"));
        let pd = "/properties/law/properties/pd/properties/kp_v_rad";
        assert_eq!(at(pd)["type"], "number");
        assert_eq!(at(pd)["minimum"], 0.0);
        assert_eq!(at(pd)["default"], 5000.0);
        assert_eq!((&at(pd)["x-unit"], &at(pd)["x-symbol"]), (&json!("V/rad"), &json!("K_p")));
        let text = at(pd)["description"].as_str().unwrap();
        assert!(text.ends_with(" `K_p`: a finite number of at least 0 V/rad."), "{text}");
        let run = "/properties/run/properties";
        assert_eq!(at(run)["seed"]["maximum"], i64::MAX);
        assert_eq!(at(run)["duration_s"]["exclusiveMinimum"], 0.0);
        assert_eq!(at(run)["start"]["enum"], json!(["on_path", "rest"]));
    }

    #[test]
    fn what_a_file_must_say_is_required_and_below_a_base_nothing_is() {
        let schema = schema();
        assert_eq!(schema["required"], json!(["name", "rig", "law", "reference"]));
        assert_eq!(schema["properties"]["rig"]["required"], json!(["base"]));
        assert_eq!(schema["properties"]["rig"]["properties"]["ripple"]["required"], Value::Null);
        assert_eq!(schema["properties"]["safety"]["required"], json!(["reason", "on_fault"]));
        assert_eq!(schema["properties"]["velocity"]["oneOf"][3], json!({ "required": ["observer"] }));
    }
}
