//! Parameters out of a table that is complete.

use super::complete::{complete, pair};
use super::{Points, Text};
use clutch_core::params::{Choice, Editor, Kind, Params, Table as Parameters};
use std::any::Any;
use toml::{Table, Value};

/// The parameters that a complete table stands for.
pub(crate) fn read<P: Params<f64>>(table: &Table) -> P {
    let mut params = P::blank();
    params.edit(&mut Reader { tables: vec![Some(table)] });
    params
}

/// As [`read`], of a table of this crate's, from the keys in which it differs from the defaults.
pub(crate) fn read_known<P: Params<f64>>(name: &str, table: &Table) -> P {
    let mut whole = table.clone();
    // A table of this crate's is right, which a test shows; a wrong one gives the defaults.
    if complete(name, name, &P::INFO, &mut whole).is_err() { P::blank() } else { read(&whole) }
}

/// Walks over parameters and over the table at once.
struct Reader<'a> {
    /// Tables entered and not left; none where there is nothing.
    tables: Vec<Option<&'a Table>>,
}

impl<'a> Reader<'a> {
    fn here(&self) -> Option<&'a Table> {
        self.tables.last().copied().flatten()
    }

    fn value<P: Parameters<f64>>(&self, row: usize) -> Option<&'a Value> {
        self.here()?.get(P::ROWS[row].key)
    }

    fn enter_key(&mut self, key: &str) -> bool {
        let below = self.here().and_then(|table| table.get(key)).and_then(Value::as_table);
        self.tables.push(below);
        below.is_some()
    }
}

impl Editor<f64> for Reader<'_> {
    fn real<P: Parameters<f64>>(&mut self, row: usize, value: &mut f64) {
        if let Some(x) = self.value::<P>(row).and_then(Value::as_float) {
            *value = P::ROWS[row].unit.to_si(x);
        }
    }
    fn whole<P: Parameters<f64>>(&mut self, row: usize, value: &mut u64) {
        if let Some(n) = self.value::<P>(row).and_then(Value::as_integer) {
            *value = u64::try_from(n).unwrap_or(0);
        }
    }
    fn switch<P: Parameters<f64>>(&mut self, row: usize, value: &mut bool) {
        if let Some(on) = self.value::<P>(row).and_then(Value::as_bool) {
            *value = on;
        }
    }
    fn word<P: Parameters<f64>>(&mut self, row: usize, value: &mut usize) {
        if let (Some(Value::String(word)), Kind::Word(words)) = (self.value::<P>(row), P::ROWS[row].kind)
            && let Some(place) = words.iter().position(|w| w.name == word)
        {
            *value = place;
        }
    }
    fn other<P: Parameters<f64>>(&mut self, row: usize, value: Option<&mut dyn Any>) {
        let (Some(found), Some(value)) = (self.value::<P>(row), value) else { return };
        if let Some(points) = value.downcast_mut::<Points>() {
            points.0 = found.as_array().into_iter().flatten().filter_map(pair).collect();
        } else if let Some(text) = value.downcast_mut::<Text>() {
            text.0 = found.as_str().unwrap_or_default().to_owned();
        }
    }
    fn present<P: Parameters<f64>>(&mut self, row: usize, _: bool) -> bool {
        self.value::<P>(row).is_some()
    }
    fn enter<P: Parameters<f64>>(&mut self, nested: usize, _: bool) -> bool {
        self.enter_key(P::TABLE.nested[nested].key)
    }
    fn leave<P: Parameters<f64>>(&mut self, _: usize) {
        self.tables.pop();
    }
    fn choose<C: Choice<f64>>(&mut self, chosen: usize) -> usize {
        let here = self.here();
        let place = C::CHOICE.options.iter().position(|o| here.is_some_and(|t| t.contains_key(o.key)));
        let place = place.unwrap_or(chosen);
        self.enter_key(C::CHOICE.options[place].key);
        place
    }
    fn chose<C: Choice<f64>>(&mut self, _: usize) {
        self.tables.pop();
    }
}
