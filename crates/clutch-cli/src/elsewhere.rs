//! Things made for Linux, on another system: verbs and options say what is missing there.

use crate::output::Exit;
use anyhow::anyhow;
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
        Err(not_here(verb, needs))
    }
}

/// The refusal of what is asked for, and what it needs that is not here.
pub(crate) fn not_here(asked: &str, needs: &str) -> anyhow::Error {
    anyhow!(
        "clutch {asked}: not on {}: {needs} are made for Linux. Verbs that need no board run here: sim, certify, tune, map, \
         replay, log, identify with --from or on its simulated board; docs/platforms.md",
        std::env::consts::OS
    )
}

/// The options of a board at a port, which are taken so that the port is refused.
#[derive(Args)]
pub(crate) struct AtPort {
    #[arg(long, hide = true)]
    port: Option<OsString>,
    #[arg(long, hide = true)]
    uncertified: bool,
    #[arg(long, hide = true, requires = "port")]
    patient: bool,
}

impl AtPort {
    pub(crate) fn refuse(&self, verb: &str) -> anyhow::Result<()> {
        match self.port {
            Some(_) => Err(not_here(&format!("{verb} --port"), "its ports and clock")),
            None => Ok(()),
        }
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

    #[test]
    fn a_board_at_a_port_is_refused_whatever_else_is_asked_of_it() {
        #[derive(Parser)]
        struct Verb {
            #[command(flatten)]
            at_port: AtPort,
        }
        let refused = |line: &[&str]| {
            let verb = Verb::try_parse_from(["clutch"].iter().chain(line));
            verb.unwrap_or_else(|e| panic!("{line:?}: {e}")).at_port.refuse("identify")
        };
        assert!(refused(&[]).is_ok() && refused(&["--uncertified"]).is_ok());
        let said =
            refused(&["--port", "COM3", "--uncertified", "--patient"]).expect_err("a refusal").to_string();
        let here = std::env::consts::OS;
        assert!(said.starts_with(&format!("clutch identify --port: not on {here}: ")), "{said}");
        assert!(said.contains("made for Linux"), "{said}");
    }
}
