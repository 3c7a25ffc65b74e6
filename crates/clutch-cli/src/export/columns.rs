//! A table as Parquet: its columns are those that Python gives, with their units and meanings.

use super::Table;
use arrow_schema::{DataType, Field, Schema};
use clutch_core::params::Unit;
use clutch_log::{Cells, Channel, Header, Kind, TIME, Value};
use parquet::arrow::{ARROW_SCHEMA_META_KEY, ArrowSchemaConverter, encode_arrow_schema};
use parquet::basic::{Compression, ZstdLevel};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use std::collections::HashMap;
use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;

/// Rows that are kept in memory until they are written: a minute at 1 kHz, some ten megabytes.
const TOGETHER: usize = 1 << 16;

pub(super) struct Columns {
    file: SerializedFileWriter<File>,
    cells: Vec<Cells>,
    /// Rows in the cells.
    rows: usize,
}

impl Columns {
    pub(super) fn begin(out: &Path, header: &Header, channel: &Channel) -> io::Result<Columns> {
        let columns: Vec<_> = std::iter::once((TIME.to_owned(), Kind::Double))
            .chain(channel.columns(&header.term_names))
            .collect();
        let fields: Vec<Field> = columns.iter().map(|(name, kind)| field(name, *kind, channel)).collect();
        let mut kept = header.described();
        kept.push(("channel".to_owned(), channel.topic.trim_start_matches('/').to_owned()));
        kept.push(("scenario.toml".to_owned(), header.scenario_toml.clone()));
        // Readers of Arrow look for all that is kept, units and meanings too, in a schema of their own; others see the pairs.
        let schema = Schema::new_with_metadata(fields, kept.iter().cloned().collect::<HashMap<_, _>>());
        kept.push((ARROW_SCHEMA_META_KEY.to_owned(), encode_arrow_schema(&schema)));
        let pairs = kept.into_iter().map(|(key, value)| KeyValue::new(key, Some(value)));
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_created_by(format!("clutch {}", env!("CARGO_PKG_VERSION")))
            .set_key_value_metadata(Some(pairs.collect()))
            .build();
        let shape = ArrowSchemaConverter::new().convert(&schema).map_err(io::Error::other)?.root_schema_ptr();
        Ok(Columns {
            file: SerializedFileWriter::new(File::create_new(out)?, shape, Arc::new(properties))
                .map_err(io::Error::other)?,
            cells: columns.iter().map(|(_, kind)| Cells::of(*kind)).collect(),
            rows: 0,
        })
    }

    /// Writes the rows that are in memory.
    fn write(&mut self) -> Result<(), ParquetError> {
        let mut group = self.file.next_row_group()?;
        for cells in &mut self.cells {
            let Some(mut column) = group.next_column()? else { break };
            match cells {
                Cells::Whole(all) => column.typed::<Int64Type>().write_batch(all, None, None),
                Cells::Real(all) => column.typed::<DoubleType>().write_batch(all, None, None),
                Cells::Flag(all) => column.typed::<BoolType>().write_batch(all, None, None),
                Cells::Word(_, all) => {
                    let all: Vec<ByteArray> = all.iter().map(|word| ByteArray::from(&**word)).collect();
                    column.typed::<ByteArrayType>().write_batch(&all, None, None)
                }
            }?;
            column.close()?;
            cells.clear();
        }
        group.close()?;
        self.rows = 0;
        Ok(())
    }
}

impl Table for Columns {
    fn row(&mut self, time: f64, values: &mut dyn Iterator<Item = Value>) -> io::Result<()> {
        let mut values = std::iter::once(Value::Real(time)).chain(values);
        self.cells.iter_mut().for_each(|cells| cells.push(values.next()));
        self.rows += 1;
        if self.rows == TOGETHER { self.write().map_err(io::Error::other) } else { Ok(()) }
    }

    fn end(mut self: Box<Self>) -> io::Result<()> {
        if self.rows > 0 {
            self.write().map_err(io::Error::other)?;
        }
        self.file.close().map(drop).map_err(io::Error::other)
    }
}

fn field(name: &str, kind: Kind, channel: &Channel) -> Field {
    let of = match Cells::of(kind) {
        Cells::Whole(_) => DataType::Int64,
        Cells::Real(_) => DataType::Float64,
        Cells::Flag(_) => DataType::Boolean,
        Cells::Word(..) => DataType::Utf8,
    };
    // A column that is called as its unit, `counts`, says so by its name.
    let unit = Unit::of_key(name).filter(|unit| unit.suffix != name).map_or("", |unit| unit.text);
    let known = [("units", unit), ("long_name", channel.label(name))];
    let known = known.into_iter().filter(|(_, text)| !text.is_empty());
    let known: HashMap<String, String> = known.map(|(key, text)| (key.to_owned(), text.to_owned())).collect();
    Field::new(name, of, false).with_metadata(known)
}
