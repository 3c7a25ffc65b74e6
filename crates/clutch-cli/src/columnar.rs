//! A Parquet file: columns with their units and meanings, and what is said of them all.

use arrow_schema::{DataType, Field, Schema};
use parquet::arrow::{ARROW_SCHEMA_META_KEY, ArrowSchemaConverter, encode_arrow_schema};
use parquet::basic::{Compression, ZstdLevel};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType as Kind, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedColumnWriter;
use parquet::file::writer::SerializedFileWriter;
use std::collections::HashMap;
use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;

/// Rows that are written at once: of a log a minute at 1 kHz, in memory some ten megabytes.
pub(crate) const TOGETHER: usize = 1 << 16;

/// Values of a column. `Known…` has null where there is none; its field is nullable.
pub(crate) enum Column<'a> {
    Whole(&'a [i64]),
    Real(&'a [f64]),
    Flag(&'a [bool]),
    Text(Vec<&'a str>),
    KnownReal(&'a [Option<f64>]),
    KnownFlag(&'a [Option<bool>]),
}

/// A column as a reader sees it, without nulls; a unit or a meaning that is empty is none.
pub(crate) fn field(name: &str, of: DataType, (unit, meaning): (&str, &str)) -> Field {
    let known = [("units", unit), ("long_name", meaning)];
    let known = known.into_iter().filter(|(_, text)| !text.is_empty());
    let known: HashMap<String, String> = known.map(|(key, text)| (key.to_owned(), text.to_owned())).collect();
    Field::new(name, of, false).with_metadata(known)
}

pub(crate) struct Columnar(SerializedFileWriter<File>);

impl Columnar {
    /// A new file with these columns; `kept` is said of all of them.
    pub(crate) fn begin(
        out: &Path,
        fields: Vec<Field>,
        mut kept: Vec<(String, String)>,
    ) -> io::Result<Columnar> {
        // Readers of Arrow look for all that is kept, units and meanings too, in a schema of their own; others see the pairs.
        let schema = Schema::new_with_metadata(fields, kept.iter().cloned().collect::<HashMap<_, _>>());
        kept.push((ARROW_SCHEMA_META_KEY.to_owned(), encode_arrow_schema(&schema)));
        let pairs = kept.into_iter().map(|(key, value)| KeyValue::new(key, Some(value)));
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_created_by(format!("clutch {}", env!("CARGO_PKG_VERSION")))
            .set_key_value_metadata(Some(pairs.collect()))
            .build();
        let shape = ArrowSchemaConverter::new().convert(&schema).map_err(io::Error::other)?;
        let (shape, out) = (shape.root_schema_ptr(), File::create_new(out)?);
        SerializedFileWriter::new(out, shape, Arc::new(properties)).map(Columnar).map_err(io::Error::other)
    }

    /// Writes some rows: of every column, in the order of the fields, as many.
    pub(crate) fn rows<'a>(&mut self, columns: impl Iterator<Item = Column<'a>>) -> io::Result<()> {
        self.group(columns).map_err(io::Error::other)
    }

    fn group<'a>(&mut self, columns: impl Iterator<Item = Column<'a>>) -> Result<(), ParquetError> {
        let mut group = self.0.next_row_group()?;
        for column in columns {
            let Some(mut to) = group.next_column()? else { break };
            match column {
                Column::Whole(all) => to.typed::<Int64Type>().write_batch(all, None, None),
                Column::Real(all) => to.typed::<DoubleType>().write_batch(all, None, None),
                Column::Flag(all) => to.typed::<BoolType>().write_batch(all, None, None),
                Column::Text(all) => {
                    let all: Vec<ByteArray> = all.into_iter().map(ByteArray::from).collect();
                    to.typed::<ByteArrayType>().write_batch(&all, None, None)
                }
                Column::KnownReal(all) => known::<DoubleType>(&mut to, all),
                Column::KnownFlag(all) => known::<BoolType>(&mut to, all),
            }?;
            to.close()?;
        }
        group.close().map(drop)
    }

    /// All rows are written.
    pub(crate) fn end(self) -> io::Result<()> {
        self.0.close().map(drop).map_err(io::Error::other)
    }
}

/// Writes a column with nulls.
fn known<T: Kind>(to: &mut SerializedColumnWriter<'_>, all: &[Option<T::T>]) -> Result<usize, ParquetError> {
    let levels: Vec<i16> = all.iter().map(|value| i16::from(value.is_some())).collect();
    let values: Vec<T::T> = all.iter().flatten().cloned().collect();
    to.typed::<T>().write_batch(&values, Some(&levels), None)
}
