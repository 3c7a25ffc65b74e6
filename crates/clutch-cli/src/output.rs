//! The results of verbs: text, files, an exit code.

use crate::plot::{self, Figure};
use anyhow::Context;
use clap::Args;
use clutch_log::printable;
use clutch_loop::clearance::ClearanceError;
use clutch_sim::progress::Report;
use indicatif::{ProgressBar, ProgressStyle};
use std::borrow::Cow;
use std::io::{ErrorKind, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// The end of a verb, if it was not an error.
pub(crate) enum Exit {
    /// Exit code 0.
    Done,
    /// Exit code 2.
    NotCertified,
    /// Exit code 1, though everything ran.
    Failed,
    /// Exit code 3.
    Fault,
    /// Exit code 4.
    Stopped,
    /// Exit code 5: done, but the log is not whole.
    Incomplete,
}

/// Version and commit, as logs tell it.
pub const BUILD: &str = env!("CLUTCH_BUILD");

/// That nothing was started, and what to do.
pub(crate) fn not_certified(refusal: &ClearanceError, file: &Path) -> String {
    format!("{refusal}\n`clutch certify {}` says why; --uncertified runs it all the same.\n", file.display())
}

/// A log is never written over: it may be the only record of a run.
pub(crate) fn new_log(path: &Path) -> anyhow::Result<()> {
    if path.exists() {
        anyhow::bail!("{}: exists already; name a new file for the log", path.display());
    }
    Ok(())
}

/// A verdict as a paragraph of at most 80 columns, its further lines indented.
pub(crate) fn paragraph(text: &str) -> String {
    let mut out = String::new();
    let mut column = 0;
    for word in text.split_whitespace() {
        let length = word.chars().count();
        if column > 0 && column + 1 + length > 80 {
            out += "\n   ";
            column = 3;
        }
        if column > 0 {
            out.push(' ');
            column += 1;
        }
        out += word;
        column += length;
    }
    out.push('\n');
    out
}

/// Runs long work under a progress bar; the bar shows on a terminal only.
pub(crate) fn with_progress<T>(unit: &str, work: impl FnOnce(Report<'_>) -> T) -> T {
    let style = ProgressStyle::with_template(&format!(
        "{{wide_bar}} {{human_pos}}/{{human_len}} {unit}, {{eta}} left"
    ));
    let bar = ProgressBar::no_length().with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let result = work(&|p| {
        bar.set_length(p.total);
        bar.inc(p.finished);
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    result
}

/// Text for a terminal: names from files of others may hold what it would obey.
pub(crate) fn shown(text: &str) -> Cow<'_, str> {
    printable(text, &['\n', '\t'])
}

/// Prints to standard output. A reader that has gone away (`| head`) is not an error.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(shown(text).as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other.context("standard output"),
    }
}

/// Writes a file; errors name it.
pub(crate) fn write(path: &Path, bytes: impl AsRef<[u8]>) -> anyhow::Result<()> {
    std::fs::write(path, bytes).with_context(|| format!("{}: cannot be written", path.display()))
}

/// Forms in which a result is given: a text on standard output, unless another is asked for.
#[derive(Args)]
pub(crate) struct Forms {
    /// Prints the result as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
    /// Draws the result.
    #[arg(long, value_name = "FILE.svg|png")]
    plot: Option<PathBuf>,
    /// Writes the result as a page, with the picture and every setting.
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
}

impl Forms {
    /// Refuses a picture's file that cannot be drawn: before a long run, not after.
    pub(crate) fn check(&self) -> anyhow::Result<()> {
        self.plot.as_deref().map_or(Ok(()), |file| plot::figure_format(file).map(drop))
    }

    /// Writes and prints what is asked for; nothing else is made.
    pub(crate) fn give(
        &self,
        figure: impl FnOnce() -> anyhow::Result<Figure>,
        page: impl FnOnce(&Figure) -> anyhow::Result<String>,
        json: impl FnOnce() -> anyhow::Result<String>,
        text: impl FnOnce() -> String,
    ) -> anyhow::Result<()> {
        if self.plot.is_some() || self.html.is_some() {
            let figure = figure()?;
            if let Some(file) = &self.plot {
                figure.save(file)?;
            }
            if let Some(file) = &self.html {
                write(file, page(&figure)?)?;
            }
        }
        print(&if self.json { json()? } else { text() })
    }
}

/// Pretty JSON with a line end.
pub(crate) fn json(value: &impl serde::Serialize) -> anyhow::Result<String> {
    Ok(serde_json::to_string_pretty(value)? + "\n")
}
