//! `clutch scenario header`: a scenario's settings for libclutch.

use crate::args::ScenarioArgs;
use crate::output::{BUILD, Exit, paragraph, print, remark, warn};
use anyhow::ensure;
use clap::Args;
use clutch_core::Micros;
use clutch_core::params::Kind;
use clutch_loop::clearance::{ClearanceError, check};
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_settings::{Declared, SETTINGS_HASH, Setting, Settings};
use clutch_sim::Scenario;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Prints the settings of a scenario as a C header for libclutch.
#[derive(Args)]
#[command(after_help = "Example:\n  clutch scenario header mine.toml > run.h")]
pub(crate) struct HeaderVerb {
    #[command(flatten)]
    run: CompiledArgs,
    /// Begin of the names in the header.
    #[arg(long, default_value = "run")]
    name: String,
}

/// A scenario whose run a program has compiled in.
#[derive(Args)]
pub(crate) struct CompiledArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Prints a run although its gains are not certified.
    #[arg(long)]
    uncertified: bool,
    /// Certificate of the sampled loop, as `clutch certify --sampled --save` writes it: it is checked, and that it is this
    /// scenario's.
    #[arg(long, value_name = "FILE.json")]
    certificate: Option<PathBuf>,
}

/// A run for a program that has it compiled in.
pub(crate) struct Compiled {
    /// In single precision.
    pub(crate) scenario: Scenario,
    pub(crate) run: BuiltRun<f32>,
    settings: Settings,
    /// What is known of the gains, a line each.
    pub(crate) verdicts: Vec<String>,
}

impl HeaderVerb {
    pub(crate) fn run(&self) -> anyhow::Result<Exit> {
        let named = |c: char| c.is_ascii_alphanumeric() || c == '_';
        ensure!(
            self.name.chars().all(named) && self.name.starts_with(|c: char| c.is_ascii_alphabetic()),
            "--name {}: expected a name of C, of letters, digits and underscores",
            self.name
        );
        let Some(compiled) = self.run.load()? else { return Ok(Exit::NotCertified) };
        print(&header(&self.name, &compiled))?;
        Ok(Exit::Done)
    }
}

impl CompiledArgs {
    /// The run, such that a board takes it; none, and the reason is printed, if its gains are not certified. Limits that a
    /// sound shaft will meet are remarked, as before a run on a board.
    pub(crate) fn load(&self) -> anyhow::Result<Option<Compiled>> {
        let file = self.scenario.scenario.display();
        let scenario = self.scenario.load()?;
        let cleared = match check(&scenario, self.certificate.as_deref(), self.uncertified, None) {
            Ok(cleared) => cleared,
            Err(ClearanceError::NotCertified { lack, .. }) => {
                let refusal = format!("{}: {lack}, so nothing was printed.", scenario.name());
                let advice =
                    format!("`clutch certify {file}` says why; --uncertified prints them all the same.");
                warn(&(paragraph(&refusal) + &paragraph(&advice)))?;
                return Ok(None);
            }
            Err(refusal) => return Err(refusal.into()),
        };
        cleared.limits_met(&scenario).iter().for_each(|note| remark(&paragraph(note)));
        let verdicts =
            cleared.verdicts().iter().map(|(name, verdict)| format!("{name}: {verdict}")).collect();
        let scenario = from_scenario::in_single_precision(&scenario)?.unwrap_or(scenario);
        let run = BuiltRun::new(&scenario, 0)?;
        // Nobody but the program itself looks on.
        let settings = from_scenario::settings(&scenario, &run, Micros(0), run.ticks)?;
        Ok(Some(Compiled { scenario, run, settings, verdicts }))
    }
}

fn header(name: &str, compiled: &Compiled) -> String {
    let Compiled { scenario, run, settings, verdicts } = compiled;
    let verdicts: String = verdicts.iter().map(|line| format!("\n   {}", comment(line))).collect();
    let guard = name.to_ascii_uppercase();
    let mut out = format!(
        "/* {}: written by `clutch scenario header`, {BUILD}.{verdicts} */\n\
         #ifndef {guard}_SETTINGS_H\n#define {guard}_SETTINGS_H\n\n#include \"clutch.h\"\n\n\
         #if CLUTCH_SETTINGS_HASH != {SETTINGS_HASH:#018x}\n\
         #error \"these settings are of another version of libclutch: write them anew\"\n#endif\n\n\
         static const clutch_setting {name}_settings[] = {{\n",
        comment(scenario.name())
    );
    let (mut count, mut points) = (0, Vec::new());
    settings.each(|key, value| match Setting::of(key) {
        Some(setting) => {
            count += 1;
            let _ = writeln!(out, "    {{CLUTCH_KEY_{}, {}", setting.constant(), told(&setting, value));
        }
        None => points.push(value),
    });
    out += "};\n\n";
    let of_points = points.len() / 2;
    let knots = points.chunks_exact(2).fold(String::new(), |mut text, point| {
        let _ = writeln!(text, "    {{{}, {}}},", point[0], point[1].cast_signed());
        text
    });
    if knots.is_empty() {
        // C has no empty lists.
        let _ = writeln!(out, "#define {name}_knots NULL");
    } else {
        let _ = writeln!(out, "static const clutch_knot {name}_knots[] = {{\n{knots}}};");
    }
    let safe = run.supervisor.safe_codes().hold;
    let of_run = [
        ("settings_count", count),
        ("knots_count", of_points),
        ("period_us", scenario.spec().period.0 as usize),
        ("counts_per_rev", scenario.spec().rig.encoder.sensor.counts_per_rev as usize),
        // For a program that has no axis yet, or none with these settings.
        ("safe_code", safe.0.into()),
    ];
    out += "\nenum {\n";
    for (what, number) in of_run {
        let _ = writeln!(out, "    {name}_{what} = {number},");
    }
    out + &format!(
        "}};\n\nstatic const clutch_run {name} = \
         {{{name}_settings, {name}_settings_count, {name}_knots, {name}_knots_count}};\n\n\
         /* The voltage of {name}_safe_code, V. */\n#define {name}_safe_v {:?}\n\n#endif\n",
        run.servo.dac().volts(safe)
    )
}

/// A value as C has it, the end of its line, and what it means.
fn told(setting: &Setting, value: u64) -> String {
    let unit = if setting.unit().is_empty() { String::new() } else { format!(" {}", setting.unit()) };
    let word = |words: Vec<&str>| match words.get(value as usize) {
        Some(word) => format!("CLUTCH_{}_{}}},", setting.constant(), word.to_ascii_uppercase()),
        None => format!("{value}}},"),
    };
    match setting.declared {
        Declared::Choice(choice) => word(choice.options.iter().map(|option| option.key).collect()),
        Declared::Row(row, _) => match row.kind {
            Kind::Real => {
                format!("{:#010x}}}, /* {}{} */", value, f32::from_bits(value as u32), comment(&unit))
            }
            Kind::Word(words) => word(words.iter().map(|word| word.name).collect()),
            _ => format!("{value}}},"),
        },
    }
}

/// A text that ends no comment.
fn comment(text: &str) -> String {
    text.replace("*/", "* /")
}
