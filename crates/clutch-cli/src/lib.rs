//! The parts of the `clutch` command: the verbs, drawing, reports.
//!
//! The verbs hold no control or friction of their own: they call `clutch-sim` and show its results.

pub mod certify;
mod daq;
mod hil;
mod log;
mod loop_verb;
pub mod plot;
mod replay;
pub mod report;
mod reproduce;
mod scenario;
mod sim;
mod table;

use anyhow::Context;
use clap::{Args, Parser, Subcommand};
use clutch_sim::Scenario;
use clutch_sim::progress::Report;
use clutch_sim::scenario::ScalarKind;
use indicatif::{ProgressBar, ProgressStyle};
use std::ffi::OsString;
use std::io::{ErrorKind, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Slow, smooth motion of shafts restrained by friction.
///
/// Simulates a shaft that a weight drives and a computer brakes, certifies the gains of its
/// control law, and reproduces the paper behind it.
///
/// Drives a shaft over a serial line to a data-acquisition board, or to a simulated one; logs,
/// and replays its logs.
///
/// Exit codes: 0 done; 1 an error, which is printed; 2 not certified; 3 from `loop`: ended by a
/// fault, from `replay`: the outputs differ; 4 from `loop`: stopped by a signal; 64 the command
/// line could not be understood.
#[derive(Parser)]
#[command(name = "clutch", version, max_term_width = 100)]
#[command(
    after_help = "Example:\n  clutch loop                        # the loop on a simulated board\n  clutch reproduce --out reproduce   # the paper, end to end\n  clutch sim smc_2                   # one built-in scenario"
)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    Loop(loop_verb::Loop),
    Daq(daq::Daq),
    Hil(hil::Hil),
    Replay(replay::Replay),
    Log(log::Log),
    Sim(sim::Sim),
    Scenario(scenario::ScenarioVerb),
    Certify(certify::Certify),
    Reproduce(reproduce::Reproduce),
}

/// A scenario, and the changes to it.
#[derive(Args)]
struct ScenarioArgs {
    /// Scenario file, or the name of a built-in scenario (`clutch scenario list`).
    #[arg(value_name = "SCENARIO.toml")]
    scenario: PathBuf,
    /// Overrides a key of the scenario; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    set: Vec<(String, String)>,
}

fn key_value(text: &str) -> Result<(String, String), String> {
    let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE, as law.smc.kp_v=4")?;
    Ok((key.trim().to_owned(), value.trim().to_owned()))
}

impl ScenarioArgs {
    fn load(&self) -> anyhow::Result<Scenario> {
        Ok(Scenario::load(&self.scenario, &self.set)?)
    }
}

/// The scenario in the form for a board that closes the loop itself; prints a note if that changes
/// it.
fn single_precision(args: &ScenarioArgs, scenario: Scenario) -> anyhow::Result<Scenario> {
    if scenario.scalar == ScalarKind::F32 {
        return Ok(scenario);
    }
    let _ = writeln!(
        std::io::stderr(),
        "note: such a board calculates in single precision: sampling.scalar = \"f32\""
    );
    let mut set = args.set.clone();
    set.push(("sampling.scalar".to_owned(), "f32".to_owned()));
    Ok(Scenario::load(&args.scenario, &set)?)
}

/// The reason why nothing was started, and the remedy.
fn not_certified(scenario: &Scenario, file: &Path) -> String {
    format!(
        "{}: the gains are not certified for these bounds and this path, so nothing was started.\n\
         `clutch certify {}` gives the reason; --uncertified runs it anyway.\n",
        scenario.name,
        file.display()
    )
}

/// The end of a verb, if not an error.
enum Exit {
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
}

/// Runs the command with its arguments, the program's name first; gives its exit code.
#[must_use]
pub fn main(args: impl IntoIterator<Item = OsString>) -> u8 {
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(e) => {
            let asked_for = !e.use_stderr(); // --help, --version
            let _ = e.print(); // nobody is left to receive it
            return if asked_for { 0 } else { 64 };
        }
    };
    let outcome = match cli.verb {
        Verb::Loop(v) => v.run(),
        Verb::Daq(v) => v.run(),
        Verb::Hil(v) => v.run(),
        Verb::Replay(v) => v.run(),
        Verb::Log(v) => v.run(),
        Verb::Sim(v) => v.run(),
        Verb::Scenario(v) => v.run(),
        Verb::Certify(v) => v.run(),
        Verb::Reproduce(v) => v.run(),
    };
    match outcome {
        Ok(Exit::Done) => 0,
        Ok(Exit::Failed) => 1,
        Ok(Exit::NotCertified) => 2,
        Ok(Exit::Fault) => 3,
        Ok(Exit::Stopped) => 4,
        Err(e) => {
            // Some errors contain their source themselves.
            let mut text = e.to_string();
            for source in e.chain().skip(1).map(ToString::to_string) {
                if !text.contains(&source) {
                    text += &format!(": {source}");
                }
            }
            let _ = writeln!(std::io::stderr(), "clutch: {text}");
            1
        }
    }
}

/// Runs long work under a progress bar; the bar shows on a terminal only.
fn with_progress<T>(unit: &str, work: impl FnOnce(Report<'_>) -> T) -> T {
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

/// Prints to standard output. A reader that has gone away (`| head`) is not an error.
fn print(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other.context("standard output"),
    }
}

/// Version and commit, as logs record it.
pub const BUILD: &str = env!("CLUTCH_BUILD");

/// A log is never overwritten: it may be the only record of a run.
fn new_log(path: &Path) -> anyhow::Result<()> {
    if path.exists() {
        anyhow::bail!("{}: exists already; name a new file for the log", path.display());
    }
    Ok(())
}

/// Writes a file; errors name it.
fn write(path: &Path, bytes: impl AsRef<[u8]>) -> anyhow::Result<()> {
    std::fs::write(path, bytes).with_context(|| format!("{}: cannot be written", path.display()))
}

/// Pretty JSON with a line end.
fn json(value: &impl serde::Serialize) -> anyhow::Result<String> {
    Ok(serde_json::to_string_pretty(value)? + "\n")
}
