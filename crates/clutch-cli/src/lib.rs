//! The parts of the `clutch` command: the verbs, drawing, reports.
//!
//! The verbs hold no control or friction of their own: they call `clutch-sim` and show its results.

mod args;
mod c_header;
pub mod certify;
#[cfg(feature = "parquet")]
mod columnar;
mod compare;
mod compiled_in;
#[cfg(target_os = "linux")]
mod daq;
#[cfg(any(not(target_os = "linux"), test))]
mod elsewhere;
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
mod rust_run;
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

#[cfg(target_os = "linux")]
pub use loop_verb::{plan, summary};
pub use output::BUILD;

/// Examples for every system.
macro_rules! everywhere {
    () => {
        "  clutch reproduce --out reproduce   # the paper, end to end\n  clutch sim smc_2                   # one built-in scenario"
    };
}

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
#[cfg_attr(target_os = "linux", command(after_help = concat!(
    "Example:\n  clutch loop                        # the loop on a simulated board\n", everywhere!()
)))]
#[cfg_attr(not(target_os = "linux"), command(after_help = concat!("Example:\n", everywhere!())))]
struct Cli {
    /// Prints nothing but errors and what was asked for: JSON, lists, files.
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
    #[cfg(not(target_os = "linux"))]
    #[command(flatten)]
    NotHere(elsewhere::NotHere),
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

/// A verb, an option or a value written in other letters is that one: clap compares them as they are.
fn suggest(e: &mut clap::Error, args: &[OsString]) {
    let mut command = Cli::command();
    command.build(); // options of all verbs are options of each
    if let Some(ContextValue::String(unknown)) = e.get(ContextKind::InvalidSubcommand) {
        let meant = unknown.to_lowercase();
        if e.get(ContextKind::SuggestedSubcommand).is_none() && command.find_subcommand(&meant).is_some() {
            e.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(vec![meant]));
        }
    } else if let (Some(ContextValue::String(unknown)), Some(ContextValue::Strings(valid))) =
        (e.get(ContextKind::InvalidValue), e.get(ContextKind::ValidValue))
    {
        let meant = valid.iter().find(|value| value.to_lowercase() == unknown.to_lowercase()).cloned();
        if let (None, Some(meant)) = (e.get(ContextKind::SuggestedValue), meant) {
            e.insert(ContextKind::SuggestedValue, ContextValue::String(meant));
        }
    } else if let Some(ContextValue::String(unknown)) = e.get(ContextKind::InvalidArg) {
        let meant = unknown.to_lowercase();
        let verbs = args.iter().skip(1).filter(|arg| !arg.to_string_lossy().starts_with('-'));
        let verb = verbs.map_while(|arg| arg.to_str()).try_fold(&command, |verb, name| {
            // The first word that is no verb is an argument of the last that was one.
            verb.find_subcommand(name).ok_or(verb)
        });
        let verb = verb.unwrap_or_else(|last| last);
        let known = |name: &str| verb.get_arguments().any(|arg| arg.get_long() == Some(name));
        if e.get(ContextKind::SuggestedArg).is_none() && meant.strip_prefix("--").is_some_and(known) {
            e.insert(ContextKind::SuggestedArg, ContextValue::String(meant));
        }
    }
}

/// Runs the command out of a package, which brings images of boards in this folder; as [`main`].
#[must_use]
pub fn main_of_package(args: impl IntoIterator<Item = OsString>, images: std::path::PathBuf) -> u8 {
    #[cfg(target_os = "linux")]
    let _ = images::PACKAGED.set(images);
    #[cfg(not(target_os = "linux"))]
    drop(images);
    main(args)
}

/// Runs the command with its arguments, the program's name first; its exit code.
#[must_use]
pub fn main(args: impl IntoIterator<Item = OsString>) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    let cli = match Cli::try_parse_from(&args) {
        Ok(cli) => cli,
        Err(mut e) => {
            suggest(&mut e, &args);
            if e.use_stderr() {
                output::complain_of(&e);
                return 64;
            }
            let _ = e.print(); // --help, --version; nobody is left to receive it
            return 0;
        }
    };
    output::set_quiet(cli.quiet);
    let outcome = signals::outlive_full_files().and_then(|()| match cli.verb {
        #[cfg(target_os = "linux")]
        Verb::Loop(v) => v.run(),
        #[cfg(target_os = "linux")]
        Verb::Daq(v) => v.run(),
        #[cfg(target_os = "linux")]
        Verb::Hil(v) => v.run(),
        #[cfg(not(target_os = "linux"))]
        Verb::NotHere(v) => v.run(),
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
    });
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
            output::complain(&format!("{} {text}", output::SPEAKER));
            1
        }
    }
}
