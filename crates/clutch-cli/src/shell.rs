//! `clutch completion` and `clutch man`: the command line as shells and `man` know it, made from its own description.

use crate::output::{Exit, print, tell, to_write};
use anyhow::Context;
use clap::{Args, Command};
use clap_complete::Shell;
use std::path::PathBuf;

/// Prints the script with which a shell completes verbs and options.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    clutch completion bash > ~/.local/share/bash-completion/completions/clutch\n  \
    clutch completion fish > ~/.config/fish/completions/clutch.fish")]
pub(crate) struct Completion {
    /// The shell.
    shell: Shell,
}

impl Completion {
    pub(crate) fn run(self, mut command: Command) -> anyhow::Result<Exit> {
        let name = command.get_name().to_owned();
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut command, name, &mut script);
        print(std::str::from_utf8(&script)?)?;
        Ok(Exit::Done)
    }
}

/// Writes the manual: a page for the command and one for each verb.
///
/// Pages of an older version are written over.
#[derive(Args)]
#[command(after_help = "Example:\n  clutch man --out ~/.local/share/man/man1   # then: man clutch-sim")]
pub(crate) struct Man {
    /// The folder of the pages; made where there is none.
    #[arg(long, value_parser = to_write(), value_name = "DIR")]
    out: PathBuf,
}

impl Man {
    pub(crate) fn run(self, command: Command) -> anyhow::Result<Exit> {
        let wrong = || format!("{}: pages cannot be written", self.out.display());
        std::fs::create_dir_all(&self.out).with_context(wrong)?;
        clap_mangen::generate_to(command, &self.out).with_context(wrong)?;
        tell(&format!("wrote the pages to {}\n", self.out.display()))?;
        Ok(Exit::Done)
    }
}
