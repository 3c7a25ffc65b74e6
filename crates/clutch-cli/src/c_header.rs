//! `clutch scenario header`: a scenario's settings for libclutch.

use crate::compiled_in::{Compiled, CompiledArgs};
use crate::output::{BUILD, Exit, print};
use anyhow::ensure;
use clap::Args;
use clutch_core::params::Kind;
use clutch_settings::{Declared, SETTINGS_HASH, Setting};
use std::fmt::Write as _;

/// Words of C and C++ themselves, which no run can have as its name.
const TAKEN: &str = "alignas alignof and asm auto bool break case catch char class compl concept const constexpr continue decltype \
    default delete do double else enum explicit export extern false float for friend goto if inline int long main \
    mutable namespace new noexcept not nullptr operator or private protected public register requires restrict \
    return short signed sizeof static struct switch template this thread_local throw true try typedef typeid \
    typename typeof union unsigned using virtual void volatile while xor";

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

impl HeaderVerb {
    pub(crate) fn run(&self) -> anyhow::Result<Exit> {
        let named = |c: char| c.is_ascii_alphanumeric() || c == '_';
        ensure!(
            TAKEN.split(' ').all(|word| word != self.name),
            "--name {}: is a word of C or C++ itself; expected another name",
            self.name
        );
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
