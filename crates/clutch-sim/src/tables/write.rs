//! Parameters as a table, for readers of JSON and of files.

use clutch_core::params::{Choice, Editor, Kind, Params, Table as Parameters};
use toml::{Table, Value};

/// Each parameter by its key, in the key's unit. Lists of points and texts, which are a scenario's own, are left out.
#[must_use]
pub fn written<P: Params<f64>>(params: &P) -> Table {
    let mut writer = Writer { tables: vec![Table::new()], keys: Vec::new() };
    params.clone().edit(&mut writer);
    writer.tables.pop().unwrap_or_default()
}

struct Writer {
    /// Tables entered and not left, and the keys of all but the outermost.
    tables: Vec<Table>,
    keys: Vec<&'static str>,
}

impl Writer {
    fn put<P: Parameters<f64>>(&mut self, row: usize, value: Value) {
        if let Some(table) = self.tables.last_mut() {
            table.insert(P::ROWS[row].key.to_owned(), value);
        }
    }

    fn down(&mut self, key: &'static str) {
        self.tables.push(Table::new());
        self.keys.push(key);
    }

    fn up(&mut self) {
        let (Some(inner), Some(key)) = (self.tables.pop(), self.keys.pop()) else { return };
        let Some(outer) = self.tables.last_mut() else { return };
        if key.is_empty() {
            outer.extend(inner); // rows of a flat table stand among the outer table's
        } else if !inner.is_empty() {
            outer.insert(key.to_owned(), Value::Table(inner));
        }
    }
}

impl Editor<f64> for Writer {
    fn real<P: Parameters<f64>>(&mut self, row: usize, value: &mut f64) {
        self.put::<P>(row, Value::Float(P::ROWS[row].unit.from_si(*value)));
    }
    fn whole<P: Parameters<f64>>(&mut self, row: usize, value: &mut u64) {
        let whole = i64::try_from(*value).map_or(Value::Float(*value as f64), Value::Integer);
        self.put::<P>(row, whole);
    }
    fn switch<P: Parameters<f64>>(&mut self, row: usize, value: &mut bool) {
        self.put::<P>(row, Value::Boolean(*value));
    }
    fn word<P: Parameters<f64>>(&mut self, row: usize, value: &mut usize) {
        if let Kind::Word(words) = P::ROWS[row].kind {
            self.put::<P>(row, Value::String(words[*value].name.to_owned()));
        }
    }
    fn enter<P: Parameters<f64>>(&mut self, nested: usize, present: bool) -> bool {
        self.down(P::TABLE.nested[nested].key);
        present
    }
    fn leave<P: Parameters<f64>>(&mut self, _: usize) {
        self.up();
    }
    fn choose<C: Choice<f64>>(&mut self, chosen: usize) -> usize {
        self.down(C::CHOICE.options[chosen].key);
        chosen
    }
    fn chose<C: Choice<f64>>(&mut self, _: usize) {
        self.up();
    }
}
