//! What is wrong with a scenario: file, key, value, what is expected, what to do.

use super::file::File;
use clutch_core::ParamError;
use serde::Serialize;
use std::fmt;
use std::sync::OnceLock;
use toml::{Table, Value};

/// What is wrong with a scenario.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScenarioError {
    /// The file, or the name of a built-in scenario.
    pub origin: String,
    /// The key with its tables, as `law.smc.kp_v`; empty if it is about the whole file.
    pub key: String,
    /// The value, as the file has it; empty if there is none.
    pub value: String,
    /// What is wrong or expected.
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

    pub(super) fn value(origin: &str, key: &str, value: &str, expected: &str) -> Self {
        ScenarioError::new(origin, key, value, format!("expected {expected}"))
    }

    fn new(origin: &str, key: &str, value: &str, message: String) -> Self {
        ScenarioError { origin: origin.into(), key: key.into(), value: value.into(), message }
    }
}

/// Finds the key of a parameter that a constructor refused.
#[derive(Clone, Debug)]
pub(super) struct Locator {
    origin: String,
    file: File,
    /// Made when it is asked for: a sweep has thousands of scenarios, of which few have an error.
    table: OnceLock<Table>,
}

impl Locator {
    pub(super) fn new(origin: &str, file: &File) -> Self {
        Locator { origin: origin.into(), file: file.clone(), table: OnceLock::new() }
    }

    /// The error of a parameter somewhere in the table `section` ("" = the whole file).
    pub(super) fn at(&self, section: &str, e: &ParamError) -> ScenarioError {
        let stem = match e.field {
            "knots" => "points",
            "volts_per_s" => "rate",
            field => field,
        };
        let root = if section.is_empty() {
            Some(self.table())
        } else {
            self.table().get(section).and_then(Value::as_table)
        };
        let found = root.and_then(|t| find(t, section, stem));
        let (key, value) = match found {
            // A table's own text would be long; the core says which point.
            Some((key, Value::Array(_))) => (key, format!("(point {})", e.value)),
            Some((key, value)) => (key, shown(value)),
            None => (format!("{section}.{}", e.field), e.value.to_string()),
        };
        ScenarioError::value(&self.origin, &key, &value, e.expected)
    }

    /// The whole file with every default filled in: keys with their tables, and values.
    pub(super) fn flattened(&self) -> Vec<(String, String)> {
        fn walk(table: &Table, path: &str, out: &mut Vec<(String, String)>) {
            for (key, value) in table {
                let key = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                match value {
                    Value::Table(t) => {
                        if t.is_empty() {
                            out.push((key, "{}".to_owned()));
                        } else {
                            walk(t, &key, out);
                        }
                    }
                    value => out.push((key, shown(value))),
                }
            }
        }
        let mut out = Vec::new();
        walk(self.table(), "", &mut out);
        out
    }

    /// The whole file with every default filled in.
    pub(super) fn table(&self) -> &Table {
        self.table.get_or_init(|| to_table(&self.file))
    }

    pub(super) fn path(&self, message: String) -> ScenarioError {
        let kind = self.table().get("reference").and_then(Value::as_table).and_then(|t| t.keys().next());
        let key = kind.map_or("reference".to_owned(), |k| format!("reference.{k}"));
        ScenarioError::new(&self.origin, &key, "", message)
    }

    pub(super) fn message(&self, key: &str, message: String) -> ScenarioError {
        ScenarioError::new(&self.origin, key, "", message)
    }
}

/// The key `stem` or `stem_<unit>` in a table or the tables below it.
fn find<'a>(table: &'a Table, path: &str, stem: &str) -> Option<(String, &'a Value)> {
    let join = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    let is_stem = |key: &str| {
        let unit = key.strip_prefix(stem).and_then(|rest| rest.strip_prefix('_'));
        key == stem || unit.is_some_and(|u| KEY_UNITS.contains(&u))
    };
    if let Some((key, value)) = table.iter().find(|(key, value)| !value.is_table() && is_stem(key)) {
        return Some((join(key), value));
    }
    table.iter().find_map(|(key, value)| find(value.as_table()?, &join(key), stem))
}

/// A value as a file would have it.
pub(super) fn shown(value: &Value) -> String {
    match value {
        Value::Float(x) => x.to_string(),
        other => other.to_string(),
    }
}

/// A struct of this crate as a table. None of them holds what TOML cannot.
pub(super) fn to_table<T: Serialize>(value: &T) -> Table {
    Table::try_from(value).unwrap_or_default()
}

/// A value, written as in the file.
pub(super) fn read_value(origin: &str, key: &str, text: &str) -> Result<Value, ScenarioError> {
    match format!("x = {text}").parse::<Table>() {
        Ok(mut t) => Ok(t.remove("x").unwrap_or(Value::String(text.into()))),
        // A bare word is a string, as shells make quoting hard.
        Err(_) if text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') => {
            Ok(Value::String(text.into()))
        }
        Err(_) => {
            let origin = format!("{origin} with --set {key}={text}");
            let expected = "a TOML value: a number, true, \"text\" or [a, list]";
            Err(ScenarioError::value(&origin, key, text, expected))
        }
    }
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

/// A file's table as the struct, with the key, the value and a likely correction in errors.
pub(super) fn deserialize(origin: &str, table: &Table) -> Result<File, ScenarioError> {
    one_of_each_choice(origin, table)?;
    serde_path_to_error::deserialize(Value::Table(table.clone())).map_err(|e| {
        let path = e.path().to_string();
        let path = if path == "." { String::new() } else { path };
        let message = e.inner().message();
        let names = quoted(message);
        let (unknown, known) = names.split_first().map_or(("", &[][..]), |(u, k)| (*u, k));
        let under =
            |path: &str, key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
        let shown_at =
            |key: &str| lookup(table, key).filter(|v| !v.is_table()).map(shown).unwrap_or_default();
        let list = known.join(", ");
        if message.starts_with("unknown field") || message.starts_with("unknown variant") {
            // A word that is none of its choices is a value.
            if lookup(table, &path).is_some_and(Value::is_str) {
                let hint = nearest(unknown, known);
                return ScenarioError::value(
                    origin,
                    &path,
                    &shown_at(&path),
                    &format!("one of: {list}{hint}"),
                );
            }
            // The path ends with the unknown key for a struct, and not for a choice of tables.
            let key = if path.rsplit('.').next() == Some(unknown) { path } else { under(&path, unknown) };
            let hint = correction(unknown, lookup(table, &key), known);
            let message = format!("unknown key{hint}; expected one of: {list}");
            return ScenarioError::new(origin, &key, &shown_at(&key), message);
        }
        if message.starts_with("missing field") {
            let message = "missing; add it (docs/scenario.md lists every key)".to_owned();
            return ScenarioError::new(origin, &under(&path, unknown), "", message);
        }
        let expected = message.rsplit_once("expected ").map_or(message, |(_, e)| e);
        ScenarioError::value(origin, &path, &shown_at(&path), &plain(expected))
    })
}

/// What serde calls a type, in words.
fn plain(expected: &str) -> String {
    match expected {
        "f64" => "a number".into(),
        "u8" | "u32" | "u64" | "usize" => "a whole number of at least 0".into(),
        "a string" => "a text in quotes".into(),
        "a boolean" => "true or false".into(),
        "string only" | "newtype variant" | "unit variant" => {
            "a table that names a choice, as [law.smc]".into()
        }
        e if e.starts_with("struct") => "a table".into(),
        e => e.into(),
    }
}

/// Exactly one table may stand where a file chooses between several.
fn one_of_each_choice(origin: &str, table: &Table) -> Result<(), ScenarioError> {
    for key in ["law", "velocity", "reference", "rig.drive", "safety.on_fault"] {
        match lookup(table, key) {
            Some(Value::Table(t)) if t.len() == 1 => {}
            Some(Value::Table(t)) => {
                let found = if t.is_empty() {
                    "none".to_owned()
                } else {
                    t.keys().map(|k| format!("[{key}.{k}]")).collect::<Vec<_>>().join(", ")
                };
                return Err(ScenarioError::new(
                    origin,
                    key,
                    "",
                    format!("expected exactly one table below it; found {found}"),
                ));
            }
            _ => {}
        }
    }
    Ok(())
}

fn quoted(message: &str) -> Vec<&str> {
    message.split('`').skip(1).step_by(2).collect()
}

pub(super) fn lookup<'a>(table: &'a Table, path: &str) -> Option<&'a Value> {
    let mut parts = path.split('.');
    let mut value = table.get(parts.next()?)?;
    for part in parts {
        value = value.as_table()?.get(part)?;
    }
    Some(value)
}

/// Units with which keys of a scenario end.
const KEY_UNITS: [&str; 32] = [
    "kg_m2", "nm_s_rad", "nm_v", "nm", "s", "deg_s", "rad_s", "kg", "m_s2", "m", "m2", "nm_rad", "deg", "hz",
    "v", "nm_a", "ohm", "v_rad", "v_s_rad", "1_s2", "1_s", "deg_s2", "deg_s3", "us", "percent", "nm_rt_s",
    "s_nm", "s_deg", "rad_s2", "turns", "v_s", "counts",
];

const DEGREE: f64 = core::f64::consts::PI / 180.0;
/// Units that are often mistaken for one another, the longer first: what they measure, and their
/// size in SI.
const UNITS: [(&str, &str, f64); 18] = [
    ("deg_s3", "jerk", DEGREE),
    ("rad_s3", "jerk", 1.0),
    ("deg_s2", "acceleration", DEGREE),
    ("rad_s2", "acceleration", 1.0),
    ("deg_s", "velocity", DEGREE),
    ("rad_s", "velocity", 1.0),
    ("deg", "angle", DEGREE),
    ("rad", "angle", 1.0),
    ("us", "time", 1e-6),
    ("ms", "time", 1e-3),
    ("s", "time", 1.0),
    ("mv", "voltage", 1e-3),
    ("v", "voltage", 1.0),
    ("mnm", "torque", 1e-3),
    ("nm", "torque", 1.0),
    ("hz", "frequency", 1.0),
    ("mm", "length", 1e-3),
    ("m", "length", 1.0),
];

/// Splits a key into stem, what its unit measures, and the unit's size.
fn unit_of(key: &str) -> Option<(&str, &'static str, f64)> {
    UNITS
        .iter()
        .find_map(|(name, kind, size)| Some((key.strip_suffix(name)?.strip_suffix('_')?, *kind, *size)))
}

/// What was probably meant: the same key in another unit, with the value in it, or the nearest
/// name.
fn correction(unknown: &str, value: Option<&Value>, known: &[&str]) -> String {
    let number = value.and_then(|v| v.as_float().or(v.as_integer().map(|i| i as f64)));
    if let Some((stem, kind, size)) = unit_of(unknown) {
        let same = known.iter().find_map(|k| {
            let (other, what, own) = unit_of(k)?;
            (other == stem && what == kind).then_some((k, own))
        });
        if let Some((key, own)) = same {
            return match number.filter(|x| x.is_finite()) {
                Some(x) => format!(
                    ": the unit is wrong here; {unknown} = {x} would be {key} = {:.6}",
                    x * size / own
                ),
                None => format!(": did you mean {key}?"),
            };
        }
    }
    if let Some(key) =
        known.iter().find(|k| k.strip_prefix(unknown).is_some_and(|rest| rest.starts_with('_')))
    {
        return format!(": did you mean {key}? (keys end with their unit)");
    }
    nearest(unknown, known)
}

/// The most alike of the known names, if one is much alike.
fn nearest(unknown: &str, known: &[&str]) -> String {
    let near = known
        .iter()
        .map(|k| (strsim::jaro_winkler(unknown, k), k))
        .filter(|(likeness, _)| *likeness > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    near.map_or(String::new(), |(_, k)| format!(": did you mean {k}?"))
}
