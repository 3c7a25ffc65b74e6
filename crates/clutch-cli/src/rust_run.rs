//! `clutch scenario rust`: a scenario's run for a program in Rust.

use crate::args::ScenarioArgs;
use crate::c_header::compiled_in;
use crate::output::{BUILD, Exit, print};
use clap::Args;
use clutch_core::FixedCounts;
use clutch_loop::from_scenario::BuiltRun;
use clutch_sim::Scenario;
use std::fmt::Debug;

/// Prints a scenario's run as a module of Rust, for a controller without a host.
///
/// The image nucleo-alone has its run from such a file.
#[derive(Args)]
#[command(
    after_help = "Example:\n  clutch scenario rust mine.toml > firmware/nucleo-g474re/src/alone_run.rs\n  \
    cargo xtask firmware flash --role alone"
)]
pub(crate) struct RustVerb {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Prints it although the gains are not certified.
    #[arg(long)]
    uncertified: bool,
}

impl RustVerb {
    pub(crate) fn run(&self) -> anyhow::Result<Exit> {
        let Some((scenario, run, _)) = compiled_in(&self.scenario, self.uncertified)? else {
            return Ok(Exit::NotCertified);
        };
        print(&module(&scenario, &run)?)?;
        Ok(Exit::Done)
    }
}

/// The run as a module.
fn module(scenario: &Scenario, run: &BuiltRun<f32>) -> anyhow::Result<String> {
    let spec = scenario.spec();
    let (name, law) = (scenario.name(), literal(&run.params.law));
    // Each law's parameters are in a variant of its name.
    let (law_name, of_law) = law.split_once('(').unwrap_or((&law, ""));
    let of_law = of_law.strip_suffix(')').unwrap_or(of_law);
    let counts_per_rev = run.params.encoder.counts_per_rev();
    let servo = literal(&run.params).replace(&indented(&law, 1), &format!("{law_name}(law)")).replace(
        &indented(&literal(&run.params.encoder), 1),
        &format!("Encoder::new({counts_per_rev}).map_err(AloneMisfit::Run)?"),
    );
    let supervisor = literal(&scenario.supervisor(scenario.safety()?).cast::<f32>());
    let bounds = literal(&scenario.supervised_bounds(&scenario.plan()?.bounds)?.cast::<f32>());
    let path = literal(&spec.reference.cast::<f32>()).replace("knots: [", "knots: &[");
    // A path that stays is a ramp without a rate.
    let (path_name, of_path) = path.split_once('(').unwrap_or(("Ramp", "Ramp { rate: 0.0 })"));
    let path_type = if path_name == "Table" { "Table<'static>" } else { &format!("{path_name}<f32>") };
    let of_path = of_path.strip_suffix(')').unwrap_or(of_path);
    let start = spec.run.start_position().0 & ((1 << FixedCounts::FRACTION_BITS) - 1);
    // The last period is the one in which the run ends.
    let (ticks, watchdog) = (run.ticks + 1, run.controller.watchdog.0);
    let [of_law, servo, supervisor, bounds, of_path] =
        [of_law, &servo, &supervisor, &bounds, of_path].map(|text| indented(text, 1));
    Ok(format!(
        "//! {name}: in SI units and radians.\n//! Written by `clutch scenario rust`, {BUILD}.\n\
         #![allow(unused_imports, reason = \"each run has other choices\")]\n\n\
         use clutch_core::law::*;\nuse clutch_core::reference::*;\nuse clutch_core::*;\nuse clutch_node::{{Alone, AloneMisfit, AloneRun, BoardParams}};\n\
         use {{ActuatorParams::*, FrictionParams::*, LawParams::*, VelocityParams::*}};\n\n\
         /// Law and kind of path.\npub type OfRun = Alone<clutch_core::law::{law_name}<f32>, {path_type}>;\n\n\
         /// The controller at power-up of a board.\n///\n/// # Errors\n/// The board is another than the \
         scenario's; after a change by hand a number out of range, too.\n\
         pub fn controller(board: &BoardParams) -> Result<OfRun, AloneMisfit> {{\n    \
         let law = {of_law};\n    let servo = {servo};\n    \
         let supervisor = {{\n        use SafeState::*;\n        {}\n    }};\n    \
         let bounds = {{\n        use ActuatorKind::*;\n        {}\n    }};\n    \
         let path = {{\n        use Interpolation::*;\n        {}\n    }};\n    \
         let run = AloneRun {{\n        servo,\n        law,\n        supervisor,\n        bounds,\n        path,\n        \
         start: FixedCounts({start}),\n        ticks: {ticks},\n        watchdog: Micros({watchdog}),\n    }};\n    \
         Alone::new(&run, board)\n}}\n",
        indented(&supervisor, 1),
        indented(&bounds, 1),
        indented(&of_path, 1),
    ))
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
