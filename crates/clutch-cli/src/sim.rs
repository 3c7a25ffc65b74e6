//! `clutch sim`.

use crate::args::ScenarioArgs;
use crate::live::LiveArg;
use crate::output::{
    BUILD, Exit, bars, check_files, json, new_file, paragraph, remark, report, to_write, with_progress, wrote,
};
use crate::plot;
use crate::run_figure::{Drawn, figure};
use crate::sampled;
use crate::signals::stop_flag;
use crate::table::{number, quantities, row};
use anyhow::Context;
use clap::Args;
use clutch_loop::onlooker::Looking;
use clutch_loop::to_log;
use clutch_sim::engine::EngineKind;
use clutch_sim::friction_map::MapInRun;
use clutch_sim::metrics::Detected;
use clutch_sim::picture::{Envelope, Window};
use clutch_sim::progress::UNWATCHED;
use clutch_sim::reaching::Reaching;
use clutch_sim::rig::{NotPassive, Rig};
use clutch_sim::{Keep, Metrics, Run, SAMPLE_COLUMNS, Scenario, Values};
use serde::Serialize;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

/// Simulates a scenario and prints figures of the shaft's motion along its path.
#[derive(Args)]
#[command(after_help = "Example:\n  clutch sim smc_2 --set law.smc.kp_v=4 --csv run.csv --plot run.svg\n\n\
    Columns of the CSV are in SI units and radians; docs/scenario.md explains them.")]
pub(crate) struct Sim {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Prints the summary as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
    /// Writes every sample to a CSV file.
    #[arg(long, value_parser = to_write(), value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Writes every sample, command and the shaft's true motion to an MCAP log.
    #[arg(long, value_parser = to_write(), value_name = "FILE.mcap")]
    log: Option<PathBuf>,
    /// Draws position and velocity closely around a stick, error and voltage of the whole run.
    #[arg(long, value_parser = to_write(), value_name = "FILE.svg|png")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    live: LiveArg,
}

#[derive(Serialize)]
pub(crate) struct Summary<'a> {
    scenario: &'a str,
    version: &'static str,
    engine: &'static str,
    scalar: &'static str,
    seed: u64,
    metrics: Metrics,
    detected: &'a Detected,
    reaching: Reaching,
    path: Path,
    certified_continuous_time: bool,
    /// The verdicts on the sampled loop, a paragraph each.
    #[serde(skip)]
    as_sampled: String,
    sampled: serde_json::Value,
    rig_outside_bounds: Vec<String>,
    /// The reason why no voltage keeps the rig's shaft on the path.
    #[serde(skip_serializing_if = "Option::is_none")]
    rig_cannot_follow: Option<String>,
    /// The part that a map of the disc had.
    #[serde(skip_serializing_if = "Option::is_none")]
    friction_map: Option<MapInRun>,
    /// Viscous damping that the rig's bristles lack to be passive, N m s/rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    bristles_lack_nm_s_rad: Option<f64>,
    /// The same with its voltage.
    #[serde(skip)]
    not_passive: Option<NotPassive>,
}

#[derive(Serialize)]
struct Path {
    highest_velocity_rad_s: f64,
    highest_acceleration_rad_s2: f64,
    highest_deceleration_rad_s2: f64,
    highest_voltage_v: f64,
    lowest_voltage_v: f64,
    velocity_jump_rad_s: f64,
}

impl Sim {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        self.live.check()?;
        if let Some(file) = &self.plot {
            plot::figure_format(file)?; // before a long run, not after
        }
        let files = [Some(&self.scenario.scenario), self.csv.as_ref(), self.plot.as_ref(), self.log.as_ref()];
        let files: Vec<&PathBuf> = files.into_iter().flatten().collect();
        for (i, file) in files.iter().enumerate() {
            if files[..i].iter().any(|other| same_file(other, file)) {
                anyhow::bail!(
                    "{}: named twice; scenario, --csv, --log and --plot must be different files",
                    file.display()
                );
            }
        }
        check_files([&self.csv, &self.plot, &self.log].into_iter().flatten())?;
        if let Some(log) = &self.log {
            new_file(log)?;
        }
        let scenario = self.scenario.load()?;
        self.scenario.remark_unused_map(&scenario);
        self.scenario.hold_times(&scenario, false)?;
        let run = with_progress("samples", |progress| scenario.run(Keep::Trace, progress))?;
        if let Some(file) = &self.csv {
            csv(&run, file)?;
        }
        if let Some(file) = &self.log {
            to_log::save_simulation(file, &scenario, &run, BUILD, None, UNWATCHED)?;
        }
        if let Some(file) = &self.plot {
            let label = scenario.name().to_owned();
            figure(scenario.name(), &[Drawn { label, scenario: &scenario, run: &run }]).save(file)?;
        }
        let summary = Summary::of(&scenario, &run)?;
        let files: Vec<&std::path::Path> =
            [&self.csv, &self.log, &self.plot].into_iter().flatten().map(PathBuf::as_path).collect();
        report(self.json, || json(&summary), || text(&summary, &scenario, &run) + &wrote(&files))?;
        if self.live.asked_for() {
            return self.play(&scenario, &run);
        }
        Ok(Exit::Done)
    }

    /// Plays the run at its own pace, once somebody looks on; to its end, or until an operator stops it.
    fn play(&self, scenario: &Scenario, run: &Run) -> anyhow::Result<Exit> {
        let stop = stop_flag()?;
        let Some(live) = self.live.start(&stop)? else { return Ok(Exit::Done) };
        remark("it plays once somebody looks on; Ctrl-C ends it\n");
        if live.wait_for_reader(&stop) {
            let looking = Looking { onlooker: live, stop: stop.clone() };
            to_log::play_simulation(&looking, scenario, run, BUILD)?;
        }
        Ok(if stop.load(Ordering::Relaxed) { Exit::Stopped } else { Exit::Done })
    }
}

impl<'a> Summary<'a> {
    /// The summary of a run.
    pub(crate) fn of(scenario: &'a Scenario, run: &'a Run) -> anyhow::Result<Summary<'a>> {
        let plan = scenario.plan()?;
        let as_sampled = scenario.sampled(&plan.bounds);
        let spec = scenario.spec();
        let not_passive = Rig::new(&spec.rig, spec.run.seed)?.not_passive(&spec.output);
        Ok(Summary {
            scenario: scenario.name(),
            version: env!("CARGO_PKG_VERSION"),
            engine: run.engine.name(),
            scalar: scenario.scalar().name(),
            seed: scenario.spec().run.seed,
            metrics: run.metrics,
            detected: &run.detected,
            reaching: Reaching::new(&run.trace, &plan.certificate),
            path: Path {
                highest_velocity_rad_s: plan.envelope.velocity,
                highest_acceleration_rad_s2: plan.envelope.acceleration,
                highest_deceleration_rad_s2: plan.envelope.deceleration,
                highest_voltage_v: plan.envelope.highest_voltage,
                lowest_voltage_v: plan.envelope.lowest_voltage,
                velocity_jump_rad_s: plan.envelope.start_jump.max(plan.envelope.velocity_jump),
            },
            certified_continuous_time: plan.certificate.certified(),
            as_sampled: sampled::short_lines(&as_sampled),
            sampled: sampled::json(&as_sampled, &sampled::Bound::NotLookedFor),
            rig_outside_bounds: scenario.outside_bounds(&plan.bounds)?,
            rig_cannot_follow: scenario.cannot_follow()?,
            friction_map: scenario.map_grid().and_then(|_| MapInRun::of(&run.trace)),
            bristles_lack_nm_s_rad: not_passive.map(|found| found.lacks),
            not_passive,
        })
    }
}

/// True for the same place, even if it is written differently.
fn same_file(a: &PathBuf, b: &PathBuf) -> bool {
    a == b || matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// The figures of the shaft's true motion, but for the time over which they were taken.
pub(crate) fn figures(m: &Metrics) -> Vec<(&'static str, String, &'static str)> {
    Metrics::FIGURES.iter().filter(|f| f.name != Metrics::MEASURED.name).map(|f| row(f, m)).collect()
}

fn text(s: &Summary<'_>, scenario: &Scenario, run: &Run) -> String {
    let m = &s.metrics;
    let engine = match run.engine {
        EngineKind::ExactFlow => "exact flow",
        EngineKind::Bristle => "bristles",
        EngineKind::DormandPrince | EngineKind::Auto => "Dormand–Prince",
    };
    let title = format!(
        "{}\n{} ticks, seed {}, servo in {}, engine {engine}\nfigures over {} s after settling",
        s.scenario,
        run.trace.time.len(),
        s.seed,
        s.scalar,
        number(m.measured_s)
    );
    let mut rows = figures(m);
    // Beside what it was in truth.
    let truth = rows.iter().position(|(label, ..)| *label == Metrics::STICK_SLIP.label).map_or(0, |i| i + 1);
    let told = (Detected::TOLD.label, s.detected.words(), Detected::TOLD.shown_unit);
    rows.splice(truth..truth, [row(&Detected::STICK_SLIP, s.detected), told]);
    if let Some(time) = s.reaching.time_s {
        rows.push(("sliding surface reached after", number(time), "s"));
        if let Some(bound) = s.reaching.bound_s {
            rows.push(("    bound (15)", number(bound), "s"));
        }
    }
    let certified = match (s.certified_continuous_time, s.rig_outside_bounds.is_empty()) {
        (true, true) => "certified for its bounds (exact sensor)",
        (true, false) => "certified for the model, not for this rig: see `clutch certify`",
        (false, _) => "not certified: see `clutch certify`",
    };
    let jump = s.path.velocity_jump_rad_s;
    let mut text = quantities(&title, &rows);
    let largest = largest_errors(run);
    let most = largest.iter().copied().fold(0.0, f64::max);
    text += &format!("   |error| of the whole run, up to {} °:\n   {}\n", number(most), bars(&largest, most));
    text += &closely(scenario, run);
    if let Some(reason) = &s.rig_cannot_follow {
        text += &paragraph(&format!("note: {reason}"));
    }
    text += &paragraph(&format!("gains, continuous time: {certified}"));
    text += &s.as_sampled;
    if let Some(reason) = s.detected.reason() {
        text += &paragraph(&format!("stick-slip: {reason}"));
    }
    if let Some(MapInRun { within, drove, dropped_s }) = s.friction_map {
        let told = match dropped_s {
            None if within == 0.0 => "the shaft never was within it".to_owned(),
            None => {
                let percent = |share: f64| number(100.0 * share);
                format!(
                    "drove for {} % of the run, {} % of which was within it",
                    percent(drove),
                    percent(within)
                )
            }
            Some(at) => format!(
                "dropped after {} s: edges came where they would without it; is it another disc's, or is the encoder's zero another?",
                number(at)
            ),
        };
        text += &paragraph(&format!("map of the disc: {told}"));
    }
    if jump > 1e-9 {
        text += &paragraph(&format!(
            "note: the path's velocity jumps by {} °/s, which no shaft follows at once; the shaft catches up",
            number(jump.to_degrees())
        ));
    }
    if let Some(bristles) = s.not_passive {
        text += &paragraph(&format!("note: {bristles}"));
    }
    text
}

/// Parts of a line of bars.
const BARS: usize = 72;

/// The largest magnitude of the error in each part of the run, °.
pub(crate) fn largest_errors(run: &Run) -> Vec<f64> {
    let errors = Envelope::new(&run.trace.time, &run.trace.error, BARS);
    errors.low.iter().zip(&errors.high).map(|(low, high)| low.abs().max(high.abs()).to_degrees()).collect()
}

/// The error in the window that a picture of the run shows, as bars from its lowest to its highest.
fn closely(scenario: &Scenario, run: &Run) -> String {
    let Some(window) = Window::of(scenario, run) else { return String::new() };
    let samples = window.samples(&run.trace);
    if samples.len() < 2 {
        return String::new();
    }
    let errors = Envelope::new(&run.trace.time[samples.clone()], &run.trace.error[samples], BARS);
    let lowest = errors.mean.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = errors.mean.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let above: Vec<f64> = errors.mean.iter().map(|mean| mean - lowest).collect();
    format!(
        "   error {},\n   {} s in all, from {} to {} °:\n   {}\n",
        window.words(),
        number(window.to - window.from),
        number(lowest.to_degrees()),
        number(highest.to_degrees()),
        bars(&above, highest - lowest)
    )
}

fn csv(run: &Run, file: &std::path::Path) -> anyhow::Result<()> {
    let t = &run.trace;
    let wrong = || format!("{}: cannot be written", file.display());
    let mut out = csv::Writer::from_path(file).with_context(wrong)?;
    let names = SAMPLE_COLUMNS.iter().map(|column| column.name.to_owned());
    let header: Vec<String> = names.chain(t.term_columns().map(|(name, _)| name)).collect();
    out.write_record(&header).with_context(wrong)?;
    let columns: Vec<Values<'_>> = SAMPLE_COLUMNS.iter().map(|column| (column.values)(t)).collect();
    for i in 0..t.time.len() {
        let samples = columns.iter().map(|column| match column {
            Values::Real(x) => x[i].to_string(),
            Values::Counts(x) => x[i].to_string(),
            Values::Codes(x) => x[i].to_string(),
            Values::Limits(x) => (x[i] as u8).to_string(),
            Values::Flags(x) => u8::from(x[i]).to_string(),
        });
        out.write_record(samples.chain(t.terms.iter().map(|(_, values)| values[i].to_string())))
            .with_context(wrong)?;
    }
    out.flush().with_context(wrong)
}
