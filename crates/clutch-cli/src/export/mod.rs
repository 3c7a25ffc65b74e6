//! `clutch log export`: a channel of a log as a table.

#[cfg(feature = "parquet")]
mod columns;
mod lines;
mod table;

use crate::output::{Exit, new_file, tell, to_write, warn, wrote};
use crate::signals::stop_flag;
use anyhow::{Context, anyhow, bail};
use clap::Args;
use clap::builder::PossibleValuesParser;
use clutch_log::{CHANNELS, Channel, Header, InChannel, Limits, LogError, Record};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use table::Table;

#[derive(Args)]
pub(crate) struct Export {
    /// The log.
    #[arg(value_name = "LOG.mcap")]
    log: PathBuf,
    /// The new file, by its ending: .csv, or .parquet where the command is built with it.
    #[arg(long, value_parser = to_write(), value_name = "TABLE.csv|parquet")]
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

/// Begins a table in a new file.
type Begin = fn(&Path, &Header, &Channel) -> io::Result<Box<dyn Table>>;

impl Export {
    /// The kind of table that the file's name asks for.
    fn begin(&self) -> anyhow::Result<Begin> {
        let ending = self.out.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        match ending.as_str() {
            "csv" => Ok(|out, header, channel| Ok(Box::new(lines::Lines::begin(out, header, channel)?))),
            #[cfg(feature = "parquet")]
            "parquet" => {
                Ok(|out, header, channel| Ok(Box::new(columns::Columns::begin(out, header, channel)?)))
            }
            other => Err(self.not_written(other)),
        }
    }

    /// The refusal of a name, and what writes the table that it asks for.
    fn not_written(&self, ending: &str) -> anyhow::Error {
        let (here, there) = if cfg!(feature = "parquet") {
            (".csv or .parquet", "Arrow is")
        } else {
            (".csv", "Parquet and Arrow are")
        };
        let out = self.out.display().to_string();
        if !matches!(ending, "parquet" | "arrow") {
            return anyhow!("{out}: expected a name that ends with {here}");
        }
        anyhow!(
            "{out}: expected a name that ends with {here}; {there} written by Python\n\
             (pip install 'clutch-control[pandas]'):\n  clutch.read_log({:?}).export({out:?}, {:?})",
            self.log.display().to_string(),
            self.channel
        )
    }

    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        let begin = self.begin()?;
        let Export { log, out, channel } = self;
        new_file(&out)?;
        let stop = stop_flag()?;
        let mut rows =
            Rows { topic: format!("/{channel}"), out: &out, begin, stop: &stop, table: None, number: 0 };
        let scanned = clutch_log::scan(&log, &Limits::default(), |header, record| match record {
            Record::Sample(r) => rows.add(header, &r),
            Record::Command(r) => rows.add(header, &r),
            Record::Event(r) => rows.add(header, &r),
            Record::Link(r) => rows.add(header, &r),
            Record::Change(r) => rows.add(header, &r),
            Record::Truth(r) => rows.add(header, &r),
        });
        let Rows { table, number, .. } = rows;
        let Some(table) = table else {
            scanned?;
            bail!("{}: has no record in /{channel}; `clutch log info` lists its channels", log.display());
        };
        let written = table.end().with_context(|| format!("{}: cannot be written", out.display()));
        let scanned = match (scanned, written) {
            (Ok(scanned), Ok(())) => scanned,
            (scanned, written) => {
                let _ = std::fs::remove_file(&out); // the error is what counts, and half a table is none
                if stop.load(Ordering::Relaxed) {
                    warn(&format!("stopped; {} was not written\n", out.display()))?;
                    return Ok(Exit::Stopped);
                }
                scanned?;
                return written.map(|()| Exit::Failed);
            }
        };
        tell(&format!("{number} rows\n{}", wrote(&[&out])))?;
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

/// The rows of a channel as they come; the file is made with the first of them.
struct Rows<'a> {
    topic: String,
    out: &'a Path,
    begin: Begin,
    /// Set by Ctrl-C.
    stop: &'a AtomicBool,
    table: Option<Box<dyn Table>>,
    number: u64,
}

impl Rows<'_> {
    fn add<R: InChannel>(&mut self, header: &Header, record: &R) -> Result<(), LogError> {
        if R::CHANNEL.topic != self.topic {
            return Ok(());
        }
        let io = |source| LogError::Io { path: self.out.to_path_buf(), action: "cannot be written", source };
        let table = match &mut self.table {
            Some(table) => table,
            none => none.insert((self.begin)(self.out, header, &R::CHANNEL).map_err(io)?),
        };
        if self.stop.load(Ordering::Relaxed) {
            return Err(io(io::ErrorKind::Interrupted.into()));
        }
        table.row(record.time_ns() as f64 / 1e9, &mut record.values()).map_err(io)?;
        self.number += 1;
        Ok(())
    }
}
