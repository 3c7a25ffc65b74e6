//! `clutch log`.

use crate::export::Export;
use crate::output::{Exit, folded, new_file, paragraph, print, to_write};
use clap::{Args, Subcommand};
use clutch_log::Limits;
use std::path::PathBuf;

/// Inspects logs, recovers those that were cut, and makes tables of them.
#[derive(Args)]
pub(crate) struct Log {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    /// Reports the contents of a log: channels, time, scenario, and its completeness.
    ///
    /// Exit code 0: complete; 5: it ended early, or is damaged.
    #[command(after_help = "Example:\n  clutch log info run.mcap")]
    Info {
        /// The log.
        #[arg(value_name = "LOG.mcap")]
        log: PathBuf,
    },
    /// Writes a finished log from one that was cut, by a crash or a full disk.
    #[command(after_help = "Example:\n  clutch log recover run.mcap recovered.mcap")]
    Recover {
        /// The log that was cut.
        #[arg(value_name = "LOG.mcap")]
        from: PathBuf,
        /// The new file.
        #[arg(value_parser = to_write(), value_name = "NEW.mcap")]
        to: PathBuf,
    },
    /// Writes a channel as a table, CSV or Parquet: a row a record, units in the columns' names.
    ///
    /// Each number reads back as the same number. Parquet has units and meanings of the columns, the log's description and
    /// its scenario as well; a command that is built without it says so. Exit code 5: the log ended early, or is damaged;
    /// the table has what can be read.
    #[command(
        after_help = "Example:\n  clutch log export run.mcap --out run.csv\n  clutch log export run.mcap --channel sample --out samples.csv"
    )]
    Export(Export),
}

impl Log {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        let text = match self.verb {
            Verb::Info { log } => {
                let info = clutch_log::info(&log, &Limits::default())?;
                print(&folded(&info.to_string()))?;
                return Ok(if info.complete { Exit::Done } else { Exit::Incomplete });
            }
            Verb::Recover { from, to } => {
                new_file(&to)?;
                match clutch_log::recover(&from, &to, &Limits::default()) {
                    Ok(done) => paragraph(&done.to_string()),
                    // Half a copy would be in the way of the next attempt; the original is whole.
                    Err(e) if std::fs::remove_file(&to).is_ok() => {
                        anyhow::bail!("{e}; {} is removed again", to.display())
                    }
                    Err(e) => return Err(e.into()),
                }
            }
            Verb::Export(export) => return export.run(),
        };
        print(&(text.trim_end().to_owned() + "\n"))?;
        Ok(Exit::Done)
    }
}
