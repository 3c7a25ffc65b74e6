//! `clutch scenario`.

use crate::c_header::HeaderVerb;
use crate::output::{Exit, beside, json, print, tell};
use crate::rust_run::RustVerb;
use anyhow::Context;
use clap::{Args, Subcommand};
use clutch_sim::expected;
use clutch_sim::scenario::{BUILT_IN, BuiltIn, schema};
use std::io::Write;
use std::path::PathBuf;

/// Lists, prints and copies the built-in scenarios; prints the schema with which editors complete a file, and a scenario's
/// settings for a program in C or Rust.
#[derive(Args)]
#[command(
    after_help = "Example:\n  clutch scenario list\n  clutch scenario show smc_2\n  clutch scenario new mine.toml\n  clutch scenario schema > scenario.schema.json"
)]
pub(crate) struct ScenarioVerb {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    /// Lists the names and titles of the built-in scenarios.
    #[command(after_help = "Example:\n  clutch scenario list")]
    List,
    /// Prints a built-in scenario.
    #[command(after_help = "Example:\n  clutch scenario show smc_2 > mine.toml")]
    Show {
        /// Its name.
        name: String,
    },
    /// Writes a built-in scenario to a new file, as the start of your own.
    #[command(after_help = "Example:\n  clutch scenario new mine.toml --from bench_pd_2")]
    New {
        /// The file, which must not exist yet.
        file: PathBuf,
        /// The built-in scenario to begin with.
        #[arg(long, value_name = "NAME", default_value = "smc_2")]
        from: String,
    },
    /// Prints the JSON Schema of scenario files, with which editors complete and check them.
    #[command(after_help = "Example:\n  clutch scenario schema > scenario.schema.json")]
    Schema,
    Header(HeaderVerb),
    Rust(RustVerb),
}

fn find(name: &str) -> anyhow::Result<&'static BuiltIn> {
    BUILT_IN.iter().find(|b| b.name == name).with_context(|| {
        let names: Vec<&str> = BUILT_IN.iter().map(|b| b.name).collect();
        format!("no built-in scenario is called {name}{}", expected(&BuiltIn::like(name), &names))
    })
}

impl ScenarioVerb {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        match self.verb {
            Verb::List => {
                let line = |b: &BuiltIn| {
                    let title = b.toml.lines().find_map(|l| l.strip_prefix("name = "));
                    beside(&format!("{:20}", b.name), title.unwrap_or_default().trim_matches('"'))
                };
                print(&BUILT_IN.iter().map(line).collect::<String>())?;
            }
            Verb::Schema => print(&json(&schema())?)?,
            Verb::Header(verb) => return verb.run(),
            Verb::Rust(verb) => return verb.run(),
            Verb::Show { name } => print(find(&name)?.toml)?,
            Verb::New { file, from } => {
                let text = find(&from)?.toml;
                let shown = file.display();
                // An existing file is never overwritten.
                let mut out = std::fs::File::create_new(&file)
                    .with_context(|| format!("{shown}: cannot be created"))?;
                out.write_all(text.as_bytes()).with_context(|| format!("{shown}: cannot be written"))?;
                tell(&format!("wrote {shown}; run it with: clutch sim {shown}\n"))?;
            }
        }
        Ok(Exit::Done)
    }
}
