//! `clutch scenario rust`: a scenario's run for a program in Rust.

use crate::compiled_in::{Compiled, CompiledArgs};
use crate::output::{BUILD, Exit, print};
use clap::Args;
use clutch_core::FixedCounts;
use std::fmt::Debug;

/// Prints a scenario's run as a module of Rust, for a controller without a host.
///
/// The image nucleo-alone has its run from such a file.
#[derive(Args)]
#[command(after_help = "Example:\n  clutch scenario rust mine.toml > mine_run.rs\n  \
    cargo xtask firmware flash --role alone --run mine_run.rs")]
pub(crate) struct RustVerb {
    #[command(flatten)]
    run: CompiledArgs,
}

impl RustVerb {
    pub(crate) fn run(&self) -> anyhow::Result<Exit> {
        let Some(compiled) = self.run.load()? else { return Ok(Exit::NotCertified) };
        print(&module(&compiled)?)?;
        Ok(Exit::Done)
    }
}

/// The module; each place between two @ is filled in.
const MODULE: &str = r#"//! @name@: in SI units and radians.
//!
@verdicts@//! Written by `clutch scenario rust`, @build@.
#![allow(unused_imports, reason = "each run has other choices")]

use clutch_core::edge_timed::*;
use clutch_core::law::*;
use clutch_core::reference::*;
use clutch_core::*;
use clutch_node::{Alone, AloneMisfit, AloneRun, BoardParams};

/// Law and kind of path.
pub type OfRun = Alone<@law type@<f32>, @path type@>;

/// The controller at power-up of a board.
///
/// # Errors
/// The board is another than the scenario's; after a change by hand a number out of range, too.
pub fn controller(board: &BoardParams) -> Result<OfRun, AloneMisfit> {
    use {ActuatorParams::*, FrictionParams::*, LawParams::*, VelocityParams::*};
    let law = @law@;
    let servo = @servo@;
    let supervisor = {
        use SafeState::*;
        @supervisor@
    };
    let bounds = {
        use ActuatorKind::*;
        @bounds@
    };
    let path = {
        use Interpolation::*;
        @path@
    };
    let run = AloneRun {
        servo,
        law,
        supervisor,
        bounds,
        path,
        start: FixedCounts(@start@),
        ticks: @ticks@,
        watchdog: Micros(@watchdog@),
    };
    Alone::new(&run, board)
}
"#;

/// The run as a module.
fn module(compiled: &Compiled) -> anyhow::Result<String> {
    let Compiled { scenario, run, verdicts, .. } = compiled;
    let spec = scenario.spec();
    let law = literal(&run.params.law);
    let (law_type, of_law) = inside(&law);
    let encoder = literal(&run.params.encoder);
    let made = format!("Encoder::new({}).map_err(AloneMisfit::Run)?", run.params.encoder.counts_per_rev());
    let servo = literal(&run.params)
        .replace(&indented(&law, 1), &format!("{law_type}(law)"))
        .replace(&indented(&encoder, 1), &made);
    let path = literal(&spec.reference.cast::<f32>()).replace("knots: [", "knots: &[");
    let (path_type, of_path) = match inside(&path) {
        // A path that stays is a ramp without a rate.
        ("Hold", _) => ("Ramp<f32>".to_owned(), "Ramp { rate: 0.0 }"),
        ("Table", of_path) => ("Table<'static>".to_owned(), of_path),
        (kind, of_path) => (format!("{kind}<f32>"), of_path),
    };
    let supervisor = literal(&scenario.supervisor(scenario.safety()?).cast::<f32>());
    let bounds = literal(&scenario.supervised_bounds(&scenario.plan()?.bounds)?.cast::<f32>());
    let start = spec.run.start_position().0 & ((1 << FixedCounts::FRACTION_BITS) - 1);
    let of_run = [
        ("law type", law_type.to_owned()),
        ("path type", path_type),
        ("law", indented(of_law, 1)),
        ("servo", indented(&servo, 1)),
        ("supervisor", indented(&supervisor, 2)),
        ("bounds", indented(&bounds, 2)),
        ("path", indented(of_path, 2)),
        ("start", start.to_string()),
        // The last period is the one in which the run ends.
        ("ticks", (run.ticks + 1).to_string()),
        ("watchdog", run.controller.watchdog.0.to_string()),
        ("build", BUILD.to_owned()),
        ("verdicts", verdicts.iter().map(|line| format!("//! {line}.\n//!\n")).collect()),
        // Last: it may have any text.
        ("name", scenario.name().to_owned()),
    ];
    let fill = |text: String, (place, what): &(&str, String)| text.replace(&format!("@{place}@"), what);
    Ok(of_run.iter().fold(MODULE.to_owned(), fill))
}

/// The name of a variant, and what is in it.
fn inside(variant: &str) -> (&str, &str) {
    let (name, of_it) = variant.split_once('(').unwrap_or((variant, ""));
    (name, of_it.strip_suffix(')').unwrap_or(of_it))
}

/// A value as Rust writes it: `Debug`, with one value in parentheses on the line of its name.
fn literal(value: &impl Debug) -> String {
    let (mut out, mut open) = (String::new(), 0);
    for line in format!("{value:#?}").lines() {
        let text = line.trim_start();
        if text.starts_with(')') {
            open -= 1;
            let end = out.trim_end_matches(',').len();
            out.truncate(end);
        } else if !out.is_empty() && !out.ends_with('(') {
            out += "\n";
            out.extend(std::iter::repeat_n(' ', line.len() - text.len() - 4 * open));
        }
        out += text;
        open += usize::from(text.ends_with('('));
    }
    out
}

/// The lines behind the first, further in by so many steps.
fn indented(text: &str, steps: usize) -> String {
    text.replace('\n', &format!("\n{}", "    ".repeat(steps)))
}
