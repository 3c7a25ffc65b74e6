//! Arguments of several verbs: a scenario, and what to change in it.

use anyhow::{Context, bail};
use clap::Args;
use clutch_sim::Scenario;
use std::path::PathBuf;
use toml::{Table, Value};

/// A scenario and what to change in it.
#[derive(Args)]
pub(crate) struct ScenarioArgs {
    /// Scenario file, or the name of a built-in scenario (`clutch scenario list`).
    #[arg(value_name = "SCENARIO.toml")]
    pub(crate) scenario: PathBuf,
    /// Overrides a key of the scenario; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub(crate) set: Vec<(String, String)>,
    /// Takes the model and its bounds from a file that `clutch identify --out` has written.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) identified: Option<PathBuf>,
}

pub(crate) fn key_value(text: &str) -> Result<(String, String), String> {
    let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE, as law.smc.kp_v=4")?;
    Ok((key.trim().to_owned(), value.trim().to_owned()))
}

impl ScenarioArgs {
    pub(crate) fn load(&self) -> anyhow::Result<Scenario> {
        let Some(file) = &self.identified else { return Ok(Scenario::load(&self.scenario, &self.set)?) };
        let (origin, text) = Scenario::text(&self.scenario)?;
        // A scenario that is no TOML says so itself.
        let Ok(mut table) = text.parse::<Table>() else { return Ok(Scenario::parse(&origin, &text, &[])?) };
        let shown = file.display();
        let found = std::fs::read_to_string(file).with_context(|| format!("{shown}: cannot be read"))?;
        let found: Table = found.parse().with_context(|| format!("{shown}: is no TOML"))?;
        for section in ["model", "bounds"] {
            let Some(Value::Table(from)) = found.get(section) else {
                bail!("{shown}: has no table [{section}]; expected a file of `clutch identify --out`");
            };
            let to = table.entry(section).or_insert_with(|| Value::Table(Table::new()));
            if let Value::Table(to) = to {
                to.extend(from.clone());
            }
        }
        let origin = format!("{origin} with {shown}");
        Ok(Scenario::parse(&origin, &table.to_string(), &self.set)?)
    }
}
