//! Arguments of several verbs: a scenario, and what to change in it.

use crate::output::{paragraph, remark};
use anyhow::{Context, bail};
use clap::Args;
use clutch_core::law::LawParams;
use clutch_core::params::Choice as _;
use clutch_identify::RigFile;
use clutch_sim::{Scenario, ScenarioError};
use std::path::{Path, PathBuf};
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
    /// Takes friction along the disc from a file that `clutch identify --map` has written.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) map: Option<PathBuf>,
}

pub(crate) fn key_value(text: &str) -> Result<(String, String), String> {
    let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE, as law.smc.kp_v=4")?;
    Ok((key.trim().to_owned(), value.trim().to_owned()))
}

impl ScenarioArgs {
    pub(crate) fn load(&self) -> anyhow::Result<Scenario> {
        if self.identified.is_none() && self.map.is_none() {
            return Ok(Scenario::load(&self.scenario, &self.set)?);
        }
        let (mut origin, text) = Scenario::text(&self.scenario)?;
        // A scenario that is no TOML says so itself.
        let Ok(mut table) = text.parse::<Table>() else { return Ok(Scenario::parse(&origin, &text, &[])?) };
        let rig = self.identified.as_deref().map(read_rig_file).transpose()?;
        if let (Some(file), Some(rig)) = (&self.identified, &rig) {
            rig.put_into(&mut table);
            origin += &format!(" with {}", file.display());
        }
        if let Some(file) = &self.map {
            table.insert(MAP.to_owned(), read_map(file)?);
            origin += &format!(" with {}", file.display());
        }
        let scenario = Scenario::parse(&origin, &table.to_string(), &self.set)?;
        let kind = scenario.spec().rig.actuator.kind();
        if let Some(expected) = rig.and_then(|rig| rig.expects_other_than(kind)) {
            return Err(ScenarioError::value(scenario.name(), "rig.actuator", kind.name(), &expected).into());
        }
        Ok(scenario)
    }

    /// Remarks a delay or lag that the scenario's rig or its filter has otherwise than the rig file; `proves`: refuses that of the
    /// rig, by which a certificate reckons.
    pub(crate) fn hold_times(&self, scenario: &Scenario, proves: bool) -> anyhow::Result<()> {
        let Some(rig) = self.identified.as_deref().map(read_rig_file).transpose()? else { return Ok(()) };
        let (of_rig, believed) = (rig.other_times(scenario), rig.otherwise_believed(scenario));
        if let (true, Some(other)) = (proves, of_rig.first()) {
            return Err(other.refusal(scenario.name()).into());
        }
        for (others, effect) in [(of_rig, "rig and certificate are"), (believed, "the filter believes it")] {
            for other in others {
                let why = format!("note: {} = {}: expected {}", other.key, other.value, other.expected);
                remark(&paragraph(&format!("{why}; {effect} as the scenario says")));
            }
        }
        Ok(())
    }

    /// Remarks a map that was given to a law which takes none.
    pub(crate) fn remark_unused_map(&self, scenario: &Scenario) {
        let law = scenario.spec().law;
        if let (Some(file), None) = (&self.map, law.filter()) {
            let takes = LawParams::<f64>::all().into_iter().filter(|law| law.filter().is_some());
            let names: Vec<_> = takes.map(|law| law.name()).collect();
            remark(&paragraph(&format!(
                "note: law.{} takes no map of the disc, so that {} changes nothing; one that does: {}",
                law.name(),
                file.display(),
                names.join(", ")
            )));
        }
    }
}

/// The table of a scenario that is the map of its disc.
const MAP: &str = "friction_map";

/// Reads that table from a file that `clutch identify --map` has written.
fn read_map(file: &Path) -> anyhow::Result<Value> {
    let name = file.display().to_string();
    let text = clutch_sim::scenario::read_text(file).with_context(|| format!("{name}: cannot be read"))?;
    let mut table: Table = text.parse().with_context(|| format!("{name}: is no TOML"))?;
    match table.remove(MAP) {
        Some(map @ Value::Table(_)) => Ok(map),
        _ => bail!("{name}: has no table [{MAP}]; expected a file of `clutch identify --map`"),
    }
}

/// A file that `clutch identify --out` has written.
pub(crate) fn read_rig_file(file: &Path) -> anyhow::Result<RigFile> {
    let name = file.display().to_string();
    let text = clutch_sim::scenario::read_text(file).with_context(|| format!("{name}: cannot be read"))?;
    Ok(RigFile::parse(&name, &text)?)
}
