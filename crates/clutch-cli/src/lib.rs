//! The parts of the `clutch` command: the verbs, drawing, reports.
//!
//! The verbs hold no control or friction of their own: they call `clutch-sim` and show its results.

mod args;
mod c_header;
pub mod certify;
mod compare;
#[cfg(target_os = "linux")]
mod daq;
mod export;
mod friction;
#[cfg(target_os = "linux")]
mod hil;
pub mod identify;
#[cfg(target_os = "linux")]
mod images;
mod live;
mod log;
#[cfg(target_os = "linux")]
mod loop_verb;
mod map;
mod output;
pub mod plot;
mod referee;
mod replay;
pub mod report;
mod reproduce;
mod run_figure;
mod sampled;
mod scenario;
mod shell;
mod signals;
mod sim;
mod sweep;
mod table;
pub mod tune;

use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, Parser, Subcommand};
use output::Exit;
use std::ffi::OsString;
use std::io::Write;

#[cfg(target_os = "linux")]
pub use loop_verb::{plan, summary};
pub use output::BUILD;

/// Slow, smooth motion of shafts restrained by friction.
///
/// Simulates a shaft that a weight drives and a computer brakes, certifies the gains of its
/// control law, and reproduces the paper behind it.
///
/// Drives a shaft over a serial line to a data-acquisition board, or to a simulated one; logs,
/// and replays its logs.
///
/// Exit codes: 0 done; 1 an error, which is printed; 2 not certified; 3 from `loop`: ended by a
/// fault, from `replay`: the outputs differ; 4 from `loop` and `sweep`: stopped by a signal;
/// 5 the log ended early, or has a gap; 64 the command
/// line could not be understood.
#[derive(Parser)]
#[command(name = "clutch", version, max_term_width = 80)]
#[command(
    after_help = "Example:\n  clutch loop                        # the loop on a simulated board\n  clutch reproduce --out reproduce   # the paper, end to end\n  clutch sim smc_2                   # one built-in scenario"
)]
struct Cli {
    /// Tells nothing but errors and what was asked for: JSON, lists, files.
    #[arg(long, short, global = true)]
    quiet: bool,
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    #[cfg(target_os = "linux")]
    Loop(loop_verb::Loop),
    #[cfg(target_os = "linux")]
    Daq(daq::Daq),
    #[cfg(target_os = "linux")]
    Hil(hil::Hil),
    Identify(identify::Identify),
    Tune(tune::Tune),
    Replay(replay::Replay),
    Log(log::Log),
    Sim(sim::Sim),
    Compare(compare::Compare),
    Sweep(sweep::SweepVerb),
    Scenario(scenario::ScenarioVerb),
    Certify(certify::Certify),
    Map(map::Map),
    Friction(friction::FrictionVerb),
    Referee(referee::Referee),
    Reproduce(reproduce::Reproduce),
    Completion(shell::Completion),
    Man(shell::Man),
}

/// A verb written in other letters is the verb: clap compares them as they are.
fn suggest_verb(e: &mut clap::Error) {
    let Some(ContextValue::String(unknown)) = e.get(ContextKind::InvalidSubcommand) else { return };
    let meant = unknown.to_lowercase();
    if e.get(ContextKind::SuggestedSubcommand).is_none()
        && Cli::command().get_subcommands().any(|verb| verb.get_name() == meant)
    {
        e.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(vec![meant]));
    }
}

/// Runs the command with its arguments, the program's name first; its exit code.
#[must_use]
pub fn main(args: impl IntoIterator<Item = OsString>) -> u8 {
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(mut e) => {
            suggest_verb(&mut e);
            let asked_for = !e.use_stderr(); // --help, --version
            let _ = e.print(); // nobody is left to receive it
            return if asked_for { 0 } else { 64 };
        }
    };
    output::set_quiet(cli.quiet);
    let outcome = match cli.verb {
        #[cfg(target_os = "linux")]
        Verb::Loop(v) => v.run(),
        #[cfg(target_os = "linux")]
        Verb::Daq(v) => v.run(),
        #[cfg(target_os = "linux")]
        Verb::Hil(v) => v.run(),
        Verb::Identify(v) => v.run(),
        Verb::Tune(v) => v.run(),
        Verb::Replay(v) => v.run(),
        Verb::Log(v) => v.run(),
        Verb::Sim(v) => v.run(),
        Verb::Compare(v) => v.run(),
        Verb::Sweep(v) => v.run(),
        Verb::Scenario(v) => v.run(),
        Verb::Certify(v) => v.run(),
        Verb::Map(v) => v.run(),
        Verb::Friction(v) => v.run(),
        Verb::Referee(v) => v.run(),
        Verb::Reproduce(v) => v.run(),
        Verb::Completion(v) => v.run(Cli::command()),
        Verb::Man(v) => v.run(Cli::command()),
    };
    match outcome {
        Ok(Exit::Done) => 0,
        Ok(Exit::Failed) => 1,
        Ok(Exit::NotCertified) => 2,
        Ok(Exit::Fault) => 3,
        Ok(Exit::Stopped) => 4,
        Ok(Exit::Incomplete) => 5,
        Err(e) => {
            // Some errors contain their source themselves.
            let mut text = e.to_string();
            for source in e.chain().skip(1).map(ToString::to_string) {
                if !text.contains(&source) {
                    text += &format!(": {source}");
                }
            }
            let _ = writeln!(std::io::stderr(), "clutch: {}", output::shown(&text));
            1
        }
    }
}
