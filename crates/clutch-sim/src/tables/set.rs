//! One parameter set to a value, in the struct that holds it.

use super::{Points, Text, pair};
use clutch_core::params::{Choice, Editor, Kind, Params, Row, Table as Parameters};
use std::any::Any;
use toml::Value;

/// The row at a dotted key of what is there, absent parameters included.
pub(crate) fn row_at<P: Params<f64>>(params: &P, key: &str) -> Option<&'static Row> {
    let mut at = At { path: Vec::new(), key, value: None, row: None };
    params.clone().edit(&mut at);
    at.row
}

/// Sets the parameter at a dotted key to a value that is known to be of its kind and in its range.
pub(crate) fn set<P: Params<f64>>(params: &mut P, key: &str, value: &Value) {
    params.edit(&mut At { path: Vec::new(), key, value: Some(value), row: None });
}

struct At<'a> {
    path: Vec<&'static str>,
    key: &'a str,
    value: Option<&'a Value>,
    row: Option<&'static Row>,
}

impl<'a> At<'a> {
    /// The value, if this is the row.
    fn here<P: Parameters<f64>>(&mut self, row: usize) -> Option<&'a Value> {
        let row = &P::ROWS[row];
        let mut rest = self.key;
        for part in &self.path {
            rest = rest.strip_prefix(part)?.strip_prefix('.')?;
        }
        if rest != row.key {
            return None;
        }
        self.row = Some(row);
        self.value
    }
}

impl Editor<f64> for At<'_> {
    fn real<P: Parameters<f64>>(&mut self, row: usize, value: &mut f64) {
        if let Some(x) = self.here::<P>(row).and_then(Value::as_float) {
            *value = P::ROWS[row].unit.to_si(x);
        }
    }
    fn whole<P: Parameters<f64>>(&mut self, row: usize, value: &mut u64) {
        if let Some(n) = self.here::<P>(row).and_then(Value::as_integer) {
            *value = u64::try_from(n).unwrap_or(0);
        }
    }
    fn switch<P: Parameters<f64>>(&mut self, row: usize, value: &mut bool) {
        if let Some(on) = self.here::<P>(row).and_then(Value::as_bool) {
            *value = on;
        }
    }
    fn word<P: Parameters<f64>>(&mut self, row: usize, value: &mut usize) {
        if let (Some(Value::String(word)), Kind::Word(words)) = (self.here::<P>(row), P::ROWS[row].kind)
            && let Some(place) = words.iter().position(|w| w.name == word)
        {
            *value = place;
        }
    }
    fn other<P: Parameters<f64>>(&mut self, row: usize, value: Option<&mut dyn Any>) {
        let (Some(found), Some(value)) = (self.here::<P>(row), value) else { return };
        if let Some(points) = value.downcast_mut::<Points>() {
            points.0 = found.as_array().into_iter().flatten().filter_map(pair).collect();
        } else if let Some(text) = value.downcast_mut::<Text>() {
            text.0 = found.as_str().unwrap_or_default().to_owned();
        }
    }
    fn present<P: Parameters<f64>>(&mut self, row: usize, present: bool) -> bool {
        self.here::<P>(row).is_some() || present
    }
    fn enter<P: Parameters<f64>>(&mut self, nested: usize, present: bool) -> bool {
        self.path.push(P::TABLE.nested[nested].key);
        present
    }
    fn leave<P: Parameters<f64>>(&mut self, _: usize) {
        self.path.pop();
    }
    fn choose<C: Choice<f64>>(&mut self, chosen: usize) -> usize {
        self.path.push(C::CHOICE.options[chosen].key);
        chosen
    }
    fn chose<C: Choice<f64>>(&mut self, _: usize) {
        self.path.pop();
    }
}
