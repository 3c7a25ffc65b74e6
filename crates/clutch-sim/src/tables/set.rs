//! One parameter set to a value, in the struct that holds it.

use super::{Points, Text, pair};
use clutch_core::params::{Choice, Editor, Kind, Params, Row, Table as Parameters};
use std::any::Any;
use toml::Value;

/// The row at a dotted key of what is there, absent parameters included.
pub(crate) fn row_at<P: Params<f64>>(params: &P, key: &str) -> Option<&'static Row> {
    let mut row = None;
    set(&mut params.clone(), key, |found| {
        row = Some(found);
        None
    });
    row
}

/// Sets the parameter at a dotted key to the value that `give` has for its row, known to be of its kind and in its range; none
/// leaves it.
pub(crate) fn set<P: Params<f64>>(
    params: &mut P,
    key: &str,
    give: impl FnMut(&'static Row) -> Option<Value>,
) {
    params.edit(&mut At { left: vec![Some(key)], give });
}

struct At<'a, F> {
    /// The part of the key below each table on the way; none in a table that it does not name.
    left: Vec<Option<&'a str>>,
    give: F,
}

impl<F: FnMut(&'static Row) -> Option<Value>> At<'_, F> {
    /// The value, if this is the row.
    fn here<P: Parameters<f64>>(&mut self, row: usize) -> Option<Value> {
        let key = (*self.left.last()?)?;
        let row = &P::ROWS[row];
        (key == row.key).then(|| (self.give)(row))?
    }

    fn down(&mut self, table: &str) {
        let key = self.left.last().copied().flatten();
        self.left.push(key.and_then(|key| key.strip_prefix(table)?.strip_prefix('.')));
    }
}

impl<F: FnMut(&'static Row) -> Option<Value>> Editor<f64> for At<'_, F> {
    fn real<P: Parameters<f64>>(&mut self, row: usize, value: &mut f64) {
        if let Some(x) = self.here::<P>(row).as_ref().and_then(Value::as_float) {
            *value = P::ROWS[row].unit.to_si(x);
        }
    }
    fn whole<P: Parameters<f64>>(&mut self, row: usize, value: &mut u64) {
        if let Some(n) = self.here::<P>(row).as_ref().and_then(Value::as_integer) {
            *value = u64::try_from(n).unwrap_or(0);
        }
    }
    fn switch<P: Parameters<f64>>(&mut self, row: usize, value: &mut bool) {
        if let Some(on) = self.here::<P>(row).as_ref().and_then(Value::as_bool) {
            *value = on;
        }
    }
    fn word<P: Parameters<f64>>(&mut self, row: usize, value: &mut usize) {
        if let (Some(Value::String(word)), Kind::Word(words)) = (self.here::<P>(row), P::ROWS[row].kind)
            && let Some(place) = words.iter().position(|w| *w.name == word)
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
        self.down(P::TABLE.nested[nested].key);
        present
    }
    fn leave<P: Parameters<f64>>(&mut self, _: usize) {
        self.left.pop();
    }
    fn choose<C: Choice<f64>>(&mut self, chosen: usize) -> usize {
        self.down(C::CHOICE.options[chosen].key);
        chosen
    }
    fn chose<C: Choice<f64>>(&mut self, _: usize) {
        self.left.pop();
    }
}
