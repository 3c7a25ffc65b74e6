//! `clutch compare`.

use crate::args::{ScenarioArgs, key_value};
use crate::output::{Exit, bars, json, report, to_write, with_progress, wrote};
use crate::plot;
use crate::run_figure::{Drawn, figure, window};
use crate::sim::{Summary, largest_errors};
use crate::table::{columns, number, row};
use anyhow::bail;
use clap::Args;
use clutch_sim::metrics::Detected;
use clutch_sim::{Keep, Metrics, Run, Scenario};
use std::path::PathBuf;

/// Simulates several scenarios and shows their figures side by side, and the runs on common axes.
#[derive(Args)]
#[command(after_help = "Example:\n  clutch compare bench_pd_2 bench_smc_2 --plot laws.svg\n  \
    clutch compare smc_2 mine.toml --set reference.ramp.rate_deg_s=6")]
pub(crate) struct Compare {
    /// Scenario files, or names of built-in scenarios; two to seven.
    #[arg(value_name = "SCENARIO.toml", required = true, num_args = 2..)]
    scenarios: Vec<PathBuf>,
    /// Overrides a key of all of them; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    set: Vec<(String, String)>,
    /// Prints the summaries as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
    /// Draws them on common axes: closely around a stick, and whole.
    #[arg(long, value_parser = to_write(), value_name = "FILE.svg|png")]
    plot: Option<PathBuf>,
}

/// Runs that a figure has colours for.
const MOST: usize = 7;

/// Letter of a run.
fn letter(number: usize) -> char {
    char::from(b'A' + number as u8)
}

impl Compare {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        if let Some(file) = &self.plot {
            plot::figure_format(file)?; // before a long run, not after
        }
        let n = self.scenarios.len();
        if n > MOST {
            bail!("{n} scenarios: expected 2 to {MOST}");
        }
        let load = |file: &PathBuf| {
            let args =
                ScenarioArgs { scenario: file.clone(), set: self.set.clone(), identified: None, map: None };
            args.load()
        };
        let scenarios = self.scenarios.iter().map(load).collect::<anyhow::Result<Vec<Scenario>>>()?;
        let run = |s: &Scenario| with_progress("samples", |progress| s.run(Keep::Trace, progress));
        let runs = scenarios.iter().map(run).collect::<Result<Vec<Run>, _>>()?;
        let drawn: Vec<Drawn<'_>> = (0..n)
            .map(|i| Drawn {
                label: format!("{}: {}", letter(i), scenarios[i].name()),
                scenario: &scenarios[i],
                run: &runs[i],
            })
            .collect();
        if let Some(file) = &self.plot {
            figure("", &drawn).save(file)?;
        }
        let summaries =
            drawn.iter().map(|d| Summary::of(d.scenario, d.run)).collect::<anyhow::Result<Vec<_>>>()?;
        report(
            self.json,
            || {
                let window = window(&drawn)
                    .map(|w| serde_json::json!({ "from_s": w.from, "to_s": w.to, "around": w.words() }));
                json(&serde_json::json!({ "runs": summaries, "window": window }))
            },
            || {
                let files: Vec<_> = self.plot.iter().map(PathBuf::as_path).collect();
                text(&drawn) + &wrote(&files)
            },
        )?;
        Ok(Exit::Done)
    }
}

fn text(runs: &[Drawn<'_>]) -> String {
    let mut text = String::new();
    for d in runs {
        let run = d.scenario.spec().run;
        text += &format!(
            "{}\n   {} ticks, seed {}; figures over {} s after settling\n",
            d.label,
            d.run.trace.time.len(),
            run.seed,
            number(d.run.metrics.measured_s)
        );
    }
    let mut rows: Vec<(&str, Vec<String>, &str)> = Vec::new();
    let mut add = |cells: Vec<(&'static str, String, &'static str)>| {
        let (name, unit) = cells.first().map_or(("", ""), |c| (c.0, c.2));
        rows.push((name, cells.into_iter().map(|c| c.1).collect(), unit));
    };
    for figure in Metrics::FIGURES.iter().filter(|f| f.name != Metrics::MEASURED.name) {
        add(runs.iter().map(|d| row(figure, &d.run.metrics)).collect());
        if figure.name == Metrics::STICK_SLIP.name {
            // Beside what it was in truth.
            add(runs.iter().map(|d| row(&Detected::STICK_SLIP, &d.run.detected)).collect());
        }
    }
    let letters: Vec<String> = (0..runs.len()).map(|i| letter(i).to_string()).collect();
    text += &columns(&letters, &rows);
    let errors: Vec<Vec<f64>> = runs.iter().map(|d| largest_errors(d.run)).collect();
    let most = errors.iter().flatten().copied().fold(0.0, f64::max);
    text += &format!("   |error| of the whole run, to one scale, up to {} °:\n", number(most));
    for (name, errors) in letters.iter().zip(&errors) {
        text += &format!("   {name} {}\n", bars(errors, most));
    }
    text
}
