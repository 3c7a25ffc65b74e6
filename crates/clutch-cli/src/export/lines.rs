//! A table as CSV.

use super::table::Table;
use clutch_log::{Channel, Header, Kind, TIME, Value, word};
use std::fs::File;
use std::io;
use std::path::Path;

pub(super) struct Lines {
    csv: csv::Writer<File>,
    kinds: Vec<Kind>,
}

impl Lines {
    pub(super) fn begin(out: &Path, header: &Header, channel: &Channel) -> io::Result<Lines> {
        let (names, kinds): (Vec<_>, Vec<_>) = channel.columns(&header.term_names).into_iter().unzip();
        let mut csv = csv::Writer::from_writer(File::create_new(out)?);
        csv.write_record(std::iter::once(TIME).chain(names.iter().map(String::as_str)))?;
        Ok(Lines { csv, kinds })
    }
}

impl Table for Lines {
    fn row(&mut self, time: f64, values: &mut dyn Iterator<Item = Value>) -> io::Result<()> {
        let row = std::iter::once(text(Kind::Double, Some(Value::Real(time))))
            .chain(self.kinds.iter().map(|kind| text(*kind, values.next())));
        Ok(self.csv.write_record(row)?)
    }

    fn end(mut self: Box<Self>) -> io::Result<()> {
        self.csv.flush()
    }
}

/// A value as text that reads back as the same value; nothing for a term that the record does not have.
fn text(kind: Kind, value: Option<Value>) -> String {
    match (value, kind) {
        (None, _) => String::new(),
        (Some(Value::Real(x)), _) => format!("{x:?}"), // the shortest that is x, with an exponent where that is shorter
        (Some(Value::Flag(x)), _) => u8::from(x).to_string(),
        (Some(Value::Whole(x)), Kind::Enum(_, names)) => word(names, x).into_owned(),
        (Some(Value::Whole(x)), Kind::Uint64) => x.cast_unsigned().to_string(),
        (Some(Value::Whole(x)), _) => x.to_string(),
    }
}
