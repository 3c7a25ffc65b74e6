//! A scenario's run for a program that has it compiled in, in C or Rust.

use crate::args::ScenarioArgs;
use crate::output::{paragraph, remark, warn};
use clap::Args;
use clutch_core::Micros;
use clutch_loop::clearance::{ClearanceError, check};
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_settings::Settings;
use clutch_sim::Scenario;
use std::path::PathBuf;

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
    pub(crate) settings: Settings,
    /// Verdicts on the gains, a line each.
    pub(crate) verdicts: Vec<String>,
}

impl CompiledArgs {
    /// The run, such that a board takes it; none, and the reason is printed, if its gains are not certified. Limits that a
    /// sound shaft will meet are remarked, as before a run on a board.
    pub(crate) fn load(&self) -> anyhow::Result<Option<Compiled>> {
        let file = self.scenario.scenario.display();
        let scenario = self.scenario.load()?;
        self.scenario.hold_times(&scenario, !self.uncertified)?;
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
