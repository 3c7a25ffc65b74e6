//! Verbs that are made for Linux, on another system: they say what is missing there.

use crate::output::Exit;
use anyhow::bail;
use clap::{Args, Subcommand};
use std::ffi::OsString;

/// Verbs of a loop on a board.
#[derive(Subcommand)]
pub(crate) enum NotHere {
    /// Closes the loop on a board; for Linux.
    #[command(hide = true)]
    Loop(Anything),
    /// Simulates a board behind a port; for Linux.
    #[command(hide = true)]
    Daq(Anything),
    /// Runs the loop on an emulated board; for Linux.
    #[command(hide = true)]
    Hil(Anything),
}

#[derive(Args)]
#[command(disable_help_flag = true)]
pub(crate) struct Anything {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    rest: Vec<OsString>,
}

impl NotHere {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        let (verb, needs) = match self {
            NotHere::Loop(_) => ("loop", "its ports, clock and real-time priority"),
            NotHere::Daq(_) => ("daq", "its ports and pseudo-terminals"),
            NotHere::Hil(_) => ("hil", "its links to the emulators"),
        };
        bail!(
            "clutch {verb}: not on {}: {needs} are made for Linux. What needs no board runs here: sim, certify, tune, map, \
             replay, log, identify with --from or on its simulated board; docs/platforms.md",
            std::env::consts::OS
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(subcommand)]
        verb: NotHere,
    }

    #[test]
    fn whatever_follows_the_verb_says_what_is_missing() {
        for line in
            [&["loop"][..], &["loop", "mine.toml", "--port", "COM3"], &["daq", "--help"], &["hil", "-q"]]
        {
            let cli = Cli::try_parse_from(["clutch"].iter().chain(line))
                .unwrap_or_else(|e| panic!("{line:?}: {e}"));
            let said = cli.verb.run().err().expect("an error").to_string();
            let here = std::env::consts::OS;
            let verb = line[0];
            assert!(said.starts_with(&format!("clutch {verb}: not on {here}: ")), "{said}");
            assert!(said.contains("made for Linux") && said.contains("docs/platforms.md"), "{said}");
        }
    }
}
