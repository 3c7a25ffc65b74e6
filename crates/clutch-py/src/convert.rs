//! Python's values and TOML's, errors and exceptions.

use clutch_core::ParamError;
use clutch_log::LogError;
use clutch_sim::ScenarioError;
use clutch_sim::scenario::LoadError;
use pyo3::exceptions::{PyFileNotFoundError, PyOSError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use std::io;
use std::path::Path;
use toml::{Table, Value};

/// A `clutch.ParamError`.
pub(crate) fn param_error(py: Python<'_>, message: &str, field: &str, value: Bound<'_, PyAny>) -> PyErr {
    let made = py
        .import("clutch._errors")
        .and_then(|m| m.getattr("ParamError"))
        .and_then(|class| class.call1((message, field, value)));
    match made {
        Ok(error) => PyErr::from_value(error),
        Err(e) => e,
    }
}

/// An exception of `clutch._errors` that has a message only.
fn error_of_ours(py: Python<'_>, class: &str, message: &str) -> PyErr {
    let made =
        py.import("clutch._errors").and_then(|m| m.getattr(class)).and_then(|class| class.call1((message,)));
    match made {
        Ok(error) => PyErr::from_value(error),
        Err(e) => e,
    }
}

/// A `clutch.LoopError`.
pub(crate) fn loop_error(py: Python<'_>, message: &str) -> PyErr {
    error_of_ours(py, "LoopError", message)
}

/// A `clutch.referee.DoesNotApply`.
pub(crate) fn does_not_apply(py: Python<'_>, message: &str) -> PyErr {
    error_of_ours(py, "DoesNotApply", message)
}

/// A scenario's error; its value is looked up in the tables it came from.
pub(crate) fn scenario_error(py: Python<'_>, e: &ScenarioError, tables: Option<&Table>) -> PyErr {
    // An error about a whole table is about no one value.
    let found = tables.and_then(|t| lookup(t, &e.key)).filter(|v| !v.is_table()).map(|v| from_toml(py, v));
    // A default is in no table, and errors show it as a file would have it.
    let told = || format!("x = {}", e.value).parse::<Table>().ok()?.remove("x");
    let value = match found.or_else(|| told().map(|v| from_toml(py, &v))) {
        Some(Ok(value)) => value,
        Some(Err(e)) => return e,
        None if e.value.is_empty() => py.None().into_bound(py),
        None => PyString::new(py, &e.value).into_any(),
    };
    param_error(py, &e.to_string(), &e.key, value)
}

/// A refused parameter of the core.
pub(crate) fn core_error(py: Python<'_>, e: &ParamError) -> PyErr {
    param_error(py, &e.to_string(), e.field(), PyFloat::new(py, e.value).into_any())
}

/// An error of a scenario's file: of the system, or of its contents.
pub(crate) fn load_error(py: Python<'_>, e: &LoadError) -> PyErr {
    match e {
        LoadError::Io { name, error } => os_error(py, Path::new(name), &e.to_string(), error),
        LoadError::Scenario(e) => scenario_error(py, e, None),
    }
}

/// An error of a log: `OSError` for the system's, `ValueError` for the file's contents.
pub(crate) fn log_error(py: Python<'_>, e: &LogError) -> PyErr {
    let text = e.to_string();
    match e {
        LogError::Io { path, source, .. } | LogError::Full { path, source, .. } => {
            os_error(py, path, &text, source)
        }
        LogError::NotAFile { .. } | LogError::Closed { .. } | LogError::SameFile { .. } => {
            PyOSError::new_err(text)
        }
        _ => PyValueError::new_err(text),
    }
}

/// The exception of the system's error number, with its file: `FileNotFoundError` …
pub(crate) fn os_error(_py: Python<'_>, path: &Path, text: &str, source: &io::Error) -> PyErr {
    let file = path.to_string_lossy().into_owned();
    match source.raw_os_error() {
        // Python chooses the subclass of OSError from the number.
        Some(number) => PyOSError::new_err((number, text.to_owned(), file)),
        None if source.kind() == io::ErrorKind::NotFound => PyFileNotFoundError::new_err(text.to_owned()),
        None if source.kind() == io::ErrorKind::InvalidData => PyValueError::new_err(text.to_owned()),
        None => PyOSError::new_err(text.to_owned()),
    }
}

fn lookup<'a>(table: &'a Table, key: &str) -> Option<&'a Value> {
    let mut parts = key.split('.');
    let mut value = table.get(parts.next()?)?;
    for part in parts {
        value = value.as_table()?.get(part)?;
    }
    Some(value)
}

/// A Python value as TOML's: numbers (also NumPy's), texts, lists, tuples, dicts. `None` has no
/// counterpart.
pub(crate) fn to_toml(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    nested_to_toml(value, 0)
}

/// Lists in lists, and dicts in dicts, that a value may have; a list that holds itself has no end.
const DEEPEST: usize = 32;

fn nested_to_toml(value: &Bound<'_, PyAny>, depth: usize) -> PyResult<Value> {
    if depth > DEEPEST {
        return Err(PyValueError::new_err(format!("a value nested more than {DEEPEST} deep")));
    }
    if let Ok(b) = value.cast::<PyBool>() {
        return Ok(Value::Boolean(b.is_true()));
    }
    if let Ok(s) = value.cast::<PyString>() {
        return Ok(Value::String(s.to_str()?.to_owned()));
    }
    if let Ok(f) = value.cast::<PyFloat>() {
        return Ok(Value::Float(f.value()));
    }
    if let Ok(d) = value.cast::<PyDict>() {
        return Ok(Value::Table(nested_to_table(d, depth + 1)?));
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        return Ok(Value::Array(
            value.try_iter()?.map(|v| nested_to_toml(&v?, depth + 1)).collect::<PyResult<_>>()?,
        ));
    }
    if value.is_instance_of::<PyInt>() {
        return value.extract::<i64>().map(Value::Integer).map_err(|_| {
            PyValueError::new_err(format!("{value}: expected a whole number from −2^63 to 2^63 − 1"))
        });
    }
    // NumPy's scalars and arrays convert themselves to Python's own types.
    if let Ok(own) = value.call_method0("tolist")
        && !own.is(value)
        && own.get_type().getattr("__module__")?.eq("builtins")?
    {
        return nested_to_toml(&own, depth + 1);
    }
    let kind = value.get_type().name()?;
    Err(PyTypeError::new_err(format!(
        "{value} is of type {kind}: expected a number, a text, true or false, a list or a dict"
    )))
}

/// A dict as a table; entries that are `None` are left out.
pub(crate) fn to_table(dict: &Bound<'_, PyDict>) -> PyResult<Table> {
    nested_to_table(dict, 0)
}

fn nested_to_table(dict: &Bound<'_, PyDict>, depth: usize) -> PyResult<Table> {
    let mut table = Table::new();
    for (key, value) in dict {
        if !value.is_none() {
            table.insert(key.extract::<String>()?, nested_to_toml(&value, depth + 1)?);
        }
    }
    Ok(table)
}

/// Keys and values of a dict in its order, as overrides.
pub(crate) fn overrides(dict: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<(String, Value)>> {
    let Some(dict) = dict else { return Ok(Vec::new()) };
    dict.iter().map(|(k, v)| Ok((k.extract()?, to_toml(&v)?))).collect()
}

/// TOML's value as Python's own.
pub(crate) fn from_toml<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::String(s) => PyString::new(py, s).into_any(),
        Value::Integer(i) => i.into_pyobject(py)?.into_any(),
        Value::Float(f) => PyFloat::new(py, *f).into_any(),
        Value::Boolean(b) => PyBool::new(py, *b).to_owned().into_any(),
        Value::Datetime(d) => PyString::new(py, &d.to_string()).into_any(),
        Value::Array(a) => {
            let list = a.iter().map(|v| from_toml(py, v)).collect::<PyResult<Vec<_>>>()?;
            PyList::new(py, list)?.into_any()
        }
        Value::Table(t) => from_table(py, t)?.into_any(),
    })
}

/// A table as a dict.
pub(crate) fn from_table<'py>(py: Python<'py>, table: &Table) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (key, value) in table {
        dict.set_item(key, from_toml(py, value)?)?;
    }
    Ok(dict)
}

/// A JSON value as Python's own.
pub(crate) fn from_json<'py>(py: Python<'py>, value: &serde_json::Value) -> PyResult<Bound<'py, PyAny>> {
    use serde_json::Value as Json;
    Ok(match value {
        Json::Null => py.None().into_bound(py),
        Json::Bool(b) => PyBool::new(py, *b).to_owned().into_any(),
        Json::Number(n) => match n.as_i64() {
            Some(i) => i.into_pyobject(py)?.into_any(),
            None => PyFloat::new(py, n.as_f64().unwrap_or(f64::NAN)).into_any(),
        },
        Json::String(s) => PyString::new(py, s).into_any(),
        Json::Array(a) => {
            PyList::new(py, a.iter().map(|v| from_json(py, v)).collect::<PyResult<Vec<_>>>()?)?.into_any()
        }
        Json::Object(o) => {
            let dict = PyDict::new(py);
            for (key, value) in o {
                dict.set_item(key, from_json(py, value)?)?;
            }
            dict.into_any()
        }
    })
}
