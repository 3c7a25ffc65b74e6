//! Arguments of several verbs: a scenario, and what to change in it.

use clap::Args;
use clutch_sim::Scenario;
use std::path::PathBuf;

/// A scenario and what to change in it.
#[derive(Args)]
pub(crate) struct ScenarioArgs {
    /// Scenario file, or the name of a built-in scenario (`clutch scenario list`).
    #[arg(value_name = "SCENARIO.toml")]
    pub(crate) scenario: PathBuf,
    /// Overrides a key of the scenario; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub(crate) set: Vec<(String, String)>,
}

pub(crate) fn key_value(text: &str) -> Result<(String, String), String> {
    let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE, as law.smc.kp_v=4")?;
    Ok((key.trim().to_owned(), value.trim().to_owned()))
}

impl ScenarioArgs {
    pub(crate) fn load(&self) -> anyhow::Result<Scenario> {
        Ok(Scenario::load(&self.scenario, &self.set)?)
    }
}
