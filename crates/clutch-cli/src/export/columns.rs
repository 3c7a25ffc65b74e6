//! A table as Parquet: its columns are those that Python gives, with their units and meanings.

use super::table::Table;
use crate::columnar::{Column, Columnar, TOGETHER, field};
use arrow_schema::{DataType, Field};
use clutch_core::params::Unit;
use clutch_log::{Cells, Channel, Header, Kind, TIME, Value};
use std::io;
use std::path::Path;

pub(super) struct Columns {
    file: Columnar,
    cells: Vec<Cells>,
    /// Rows in the cells.
    rows: usize,
}

impl Columns {
    pub(super) fn begin(out: &Path, header: &Header, channel: &Channel) -> io::Result<Columns> {
        let columns: Vec<_> = std::iter::once((TIME.to_owned(), Kind::Double))
            .chain(channel.columns(&header.term_names))
            .collect();
        let mut kept = header.described();
        kept.push(("channel".to_owned(), channel.topic.trim_start_matches('/').to_owned()));
        kept.push(("scenario.toml".to_owned(), header.scenario_toml.clone()));
        let fields = columns.iter().map(|(name, kind)| shown(name, *kind, channel)).collect();
        Ok(Columns {
            file: Columnar::begin(out, fields, kept)?,
            cells: columns.iter().map(|(_, kind)| Cells::of(*kind)).collect(),
            rows: 0,
        })
    }

    /// Writes the rows that are in memory.
    fn write(&mut self) -> io::Result<()> {
        self.file.rows(self.cells.iter().map(|cells| match cells {
            Cells::Whole(all) => Column::Whole(all),
            Cells::Real(all) => Column::Real(all),
            Cells::Flag(all) => Column::Flag(all),
            Cells::Word(_, all) => Column::Text(all.iter().map(|word| &**word).collect()),
        }))?;
        self.cells.iter_mut().for_each(Cells::clear);
        self.rows = 0;
        Ok(())
    }
}

impl Table for Columns {
    fn row(&mut self, time: f64, values: &mut dyn Iterator<Item = Value>) -> io::Result<()> {
        let mut values = std::iter::once(Value::Real(time)).chain(values);
        self.cells.iter_mut().for_each(|cells| cells.push(values.next()));
        self.rows += 1;
        if self.rows == TOGETHER { self.write() } else { Ok(()) }
    }

    fn end(mut self: Box<Self>) -> io::Result<()> {
        if self.rows > 0 {
            self.write()?;
        }
        self.file.end()
    }
}

fn shown(name: &str, kind: Kind, channel: &Channel) -> Field {
    let of = match Cells::of(kind) {
        Cells::Whole(_) => DataType::Int64,
        Cells::Real(_) => DataType::Float64,
        Cells::Flag(_) => DataType::Boolean,
        Cells::Word(..) => DataType::Utf8,
    };
    // A column that is called as its unit, `counts`, says so by its name.
    let unit = Unit::of_key(name).filter(|unit| unit.suffix != name).map_or("", |unit| unit.text);
    field(name, of, (unit, channel.label(name)))
}
