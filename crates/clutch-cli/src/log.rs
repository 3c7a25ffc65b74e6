//! `clutch log`.

use crate::output::{Exit, print};
use clap::{Args, Subcommand};
use clutch_log::Limits;
use std::path::PathBuf;

/// Inspects logs, and recovers those that were cut.
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
        #[arg(value_name = "NEW.mcap")]
        to: PathBuf,
    },
}

impl Log {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        let text = match self.verb {
            Verb::Info { log } => {
                let info = clutch_log::info(&log, &Limits::default())?;
                print(&format!("{info}\n"))?;
                return Ok(if info.complete { Exit::Done } else { Exit::Incomplete });
            }
            Verb::Recover { from, to } => {
                if to.exists() {
                    anyhow::bail!("{}: exists already; name a new file", to.display());
                }
                clutch_log::recover(&from, &to, &Limits::default())?.to_string()
            }
        };
        print(&(text.trim_end().to_owned() + "\n"))?;
        Ok(Exit::Done)
    }
}
