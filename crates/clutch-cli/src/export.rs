//! `clutch log export`: a channel of a log as a table.

use crate::output::{Exit, new_file, tell, warn, wrote};
use anyhow::{Context, bail};
use clap::Args;
use clap::builder::PossibleValuesParser;
use clutch_log::names::name_of;
use clutch_log::{CHANNELS, Header, InChannel, Kind, Limits, LogError, Record, TIME, Value};
use std::fs::File;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub(crate) struct Export {
    /// The log.
    #[arg(value_name = "LOG.mcap")]
    log: PathBuf,
    /// The new file.
    #[arg(long, value_name = "TABLE.csv")]
    out: PathBuf,
    /// The channel whose records are the rows.
    #[arg(long, value_name = "NAME", default_value = "command", value_parser = channels())]
    channel: String,
}

/// The channels that hold records: rows with a tick.
fn channels() -> PossibleValuesParser {
    let tables = CHANNELS.iter().filter(|c| c.fields.iter().any(|f| f.name == "tick"));
    PossibleValuesParser::new(tables.map(|c| c.topic.trim_start_matches('/')))
}

impl Export {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        let Export { log, out, channel } = self;
        if !out.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
            bail!(
                "{}: expected a name that ends with .csv; Parquet and Arrow, with units, are written by\n\
                 Python (pip install 'clutch-control[pandas]'):\n  \
                 clutch.read_log({:?}).export({:?}, {channel:?})",
                out.display(),
                log.display().to_string(),
                out.display().to_string()
            );
        }
        new_file(&out)?;
        let mut table =
            Table { topic: format!("/{channel}"), out: &out, kinds: Vec::new(), csv: None, rows: 0 };
        let scanned = clutch_log::scan(&log, &Limits::default(), |header, record| match record {
            Record::Sample(r) => table.add(header, &r),
            Record::Command(r) => table.add(header, &r),
            Record::Event(r) => table.add(header, &r),
            Record::Link(r) => table.add(header, &r),
            Record::Change(r) => table.add(header, &r),
            Record::Truth(r) => table.add(header, &r),
        });
        let Table { csv, rows, .. } = table;
        let Some(mut csv) = csv else {
            scanned?;
            bail!("{}: has no record in /{channel}; `clutch log info` lists its channels", log.display());
        };
        let written = csv.flush().with_context(|| format!("{}: cannot be written", out.display()));
        let scanned = match (scanned, written) {
            (Ok(scanned), Ok(())) => scanned,
            (scanned, written) => {
                drop(csv);
                let _ = std::fs::remove_file(&out); // the error is what counts, and half a table is none
                scanned?;
                return written.map(|()| Exit::Failed);
            }
        };
        tell(&format!("{rows} rows\n{}", wrote(&[&out])))?;
        if scanned.complete() {
            return Ok(Exit::Done);
        }
        warn(&format!(
            "{}: ended early, or is damaged; the table has what\ncan be read, and `clutch log info` says where\n",
            log.display()
        ))?;
        Ok(Exit::Incomplete)
    }
}

/// A table that is being written; the file is made with its first row.
struct Table<'a> {
    topic: String,
    out: &'a Path,
    kinds: Vec<Kind>,
    csv: Option<csv::Writer<File>>,
    rows: u64,
}

impl Table<'_> {
    fn add<R: InChannel>(&mut self, header: &Header, record: &R) -> Result<(), LogError> {
        if R::CHANNEL.topic != self.topic {
            return Ok(());
        }
        let io = |source| LogError::Io { path: self.out.to_path_buf(), action: "cannot be written", source };
        let csv = match &mut self.csv {
            Some(csv) => csv,
            none => {
                let columns = R::CHANNEL.columns(&header.term_names);
                let csv = none.insert(csv::Writer::from_writer(File::create_new(self.out).map_err(io)?));
                let names = columns.iter().map(|(name, _)| name.as_str());
                csv.write_record(std::iter::once(TIME).chain(names)).map_err(|e| io(e.into()))?;
                self.kinds = columns.iter().map(|(_, kind)| *kind).collect();
                csv
            }
        };
        let mut values = record.values();
        let time = Value::Real(record.time_ns() as f64 / 1e9);
        let row = std::iter::once(text(Kind::Double, Some(time)))
            .chain(self.kinds.iter().map(|kind| text(*kind, values.next())));
        csv.write_record(row).map_err(|e| io(e.into()))?;
        self.rows += 1;
        Ok(())
    }
}

/// A value as text that reads back as the same value; nothing for a term that the record does not have.
fn text(kind: Kind, value: Option<Value>) -> String {
    match (value, kind) {
        (None, _) => String::new(),
        (Some(Value::Real(x)), _) => format!("{x:?}"), // the shortest that is x, with an exponent where that is shorter
        (Some(Value::Flag(x)), _) => u8::from(x).to_string(),
        (Some(Value::Whole(x)), Kind::Enum(_, names)) => {
            match u8::try_from(x).map_or("?", |x| name_of(names, x)) {
                "?" => x.to_string(), // of a later version
                name => name.to_owned(),
            }
        }
        (Some(Value::Whole(x)), Kind::Uint64) => x.cast_unsigned().to_string(),
        (Some(Value::Whole(x)), _) => x.to_string(),
    }
}
