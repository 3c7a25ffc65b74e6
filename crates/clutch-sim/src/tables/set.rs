//! One parameter set to a value, in the struct that holds it: found by its key once, and put there by its place.

use super::{Points, Text, pair};
use clutch_core::params::{Choice, Editor, Kind, Params, Row, Table as Parameters};
use std::any::Any;
use toml::Value;

/// The place of a parameter among all that are there. It holds for parameters with the same choices, which setting a value
/// leaves as they are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// The parameter's declaration.
    pub(crate) row: &'static Row,
    /// Parameters before it.
    nth: usize,
}

impl Place {
    /// The place of the parameter at a dotted key, absent parameters included; none of a key that is no parameter.
    pub(crate) fn of<P: Params<f64>>(params: &P, key: &str) -> Option<Place> {
        let mut find = Find { left: vec![Some(key)], nth: 0, found: None };
        params.clone().edit(&mut find);
        find.found
    }

    /// Puts a value here that is known to be of the row's kind and in its range.
    pub(crate) fn put<P: Params<f64>>(&self, params: &mut P, value: &Value) {
        params.edit(&mut Put { left: self.nth, value });
    }
}

struct Find<'a> {
    /// The part of the key below each table on the way; none in a table that it does not name.
    left: Vec<Option<&'a str>>,
    nth: usize,
    found: Option<Place>,
}

impl Find<'_> {
    fn here<P: Parameters<f64>>(&mut self, row: usize) {
        let row = &P::ROWS[row];
        if self.left.last().copied().flatten() == Some(row.key) {
            self.found = Some(Place { row, nth: self.nth });
        }
    }

    fn pass<P: Parameters<f64>>(&mut self, row: usize) {
        self.here::<P>(row);
        self.nth += 1;
    }

    fn down(&mut self, table: &str) {
        let key = self.left.last().copied().flatten();
        self.left.push(key.and_then(|key| key.strip_prefix(table)?.strip_prefix('.')));
    }
}

impl Editor<f64> for Find<'_> {
    fn real<P: Parameters<f64>>(&mut self, row: usize, _: &mut f64) {
        self.pass::<P>(row);
    }
    fn whole<P: Parameters<f64>>(&mut self, row: usize, _: &mut u64) {
        self.pass::<P>(row);
    }
    fn switch<P: Parameters<f64>>(&mut self, row: usize, _: &mut bool) {
        self.pass::<P>(row);
    }
    fn word<P: Parameters<f64>>(&mut self, row: usize, _: &mut usize) {
        self.pass::<P>(row);
    }
    fn other<P: Parameters<f64>>(&mut self, row: usize, _: Option<&mut dyn Any>) {
        self.pass::<P>(row);
    }
    fn present<P: Parameters<f64>>(&mut self, row: usize, present: bool) -> bool {
        self.here::<P>(row);
        present
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

struct Put<'a> {
    /// Parameters that are still to come before the one that is set; beyond all of them, once it is set.
    left: usize,
    value: &'a Value,
}

impl<'a> Put<'a> {
    fn here(&mut self) -> Option<&'a Value> {
        let here = self.left == 0;
        self.left = self.left.wrapping_sub(1);
        here.then_some(self.value)
    }
}

impl Editor<f64> for Put<'_> {
    fn real<P: Parameters<f64>>(&mut self, row: usize, value: &mut f64) {
        if let Some(x) = self.here().and_then(Value::as_float) {
            *value = P::ROWS[row].unit.to_si(x);
        }
    }
    fn whole<P: Parameters<f64>>(&mut self, _: usize, value: &mut u64) {
        if let Some(n) = self.here().and_then(Value::as_integer) {
            *value = u64::try_from(n).unwrap_or(0);
        }
    }
    fn switch<P: Parameters<f64>>(&mut self, _: usize, value: &mut bool) {
        if let Some(on) = self.here().and_then(Value::as_bool) {
            *value = on;
        }
    }
    fn word<P: Parameters<f64>>(&mut self, row: usize, value: &mut usize) {
        if let (Some(Value::String(word)), Kind::Word(words)) = (self.here(), P::ROWS[row].kind)
            && let Some(place) = words.iter().position(|w| *w.name == *word)
        {
            *value = place;
        }
    }
    fn other<P: Parameters<f64>>(&mut self, _: usize, value: Option<&mut dyn Any>) {
        let (Some(found), Some(value)) = (self.here(), value) else { return };
        if let Some(points) = value.downcast_mut::<Points>() {
            points.0 = found.as_array().into_iter().flatten().filter_map(pair).collect();
        } else if let Some(text) = value.downcast_mut::<Text>() {
            text.0 = found.as_str().unwrap_or_default().to_owned();
        }
    }
}
