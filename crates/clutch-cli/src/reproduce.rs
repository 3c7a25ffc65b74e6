//! `clutch reproduce`.

use crate::output::{Exit, json, tell, with_progress, write};
use crate::plot::{Figure, Panel, Series};
use crate::report::{ReportFigure, ReportTable, claims_table, html};
use crate::table::number;
use anyhow::Context;
use clap::Args;
use clutch_sim::Scenario;
use clutch_sim::paper::{self, FigureData, SEEDS, Table3Row};
use std::path::PathBuf;

/// Reproduces the paper: figures 8 to 10, Table 3, and every statement of its section 4.
///
/// Exit code 0 when every statement holds or fails just as documented, else 1.
#[derive(Args)]
#[command(after_help = "Example:\n  clutch reproduce --out reproduce\n\n\
    Then open reproduce/report.html in a browser.")]
pub(crate) struct Reproduce {
    /// Folder for figures, table and report; created if missing.
    #[arg(long, value_name = "DIR", default_value = "reproduce")]
    out: PathBuf,
}

impl Reproduce {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        let dir = &self.out;
        std::fs::create_dir_all(dir).with_context(|| format!("{}: cannot be made", dir.display()))?;
        let outcome = with_progress("runs", paper::reproduce)?;

        let mut figures = Vec::new();
        for data in &outcome.figures {
            let id = format!("fig{}", data.number);
            let figure = draw(data);
            let svg = figure.svg()?;
            write(&dir.join(format!("{id}.svg")), &svg)?;
            write(&dir.join(format!("{id}.png")), figure.png()?)?;
            figures.push(ReportFigure { id, caption: caption(data), svg });
        }
        let table3 = ReportTable {
            id: "table-3".to_owned(),
            title: "Table 3".to_owned(),
            caption: "Table 3 of the paper, and the results here.".to_owned(),
            rows: table3_cells(&outcome.table3),
            words: 0,
        };
        write_table3(&outcome.table3, &dir.join("table3.csv"))?;
        let settings = settings();
        write(
            &dir.join("report.html"),
            html("The paper, reproduced", &intro(), &outcome.claims, &[table3], &figures, &settings),
        )?;
        write(
            &dir.join("report.json"),
            json(&serde_json::json!({
                "version": env!("CARGO_PKG_VERSION"),
                "seeds": SEEDS,
                "claims": outcome.claims,
                "table3": outcome.table3,
            }))?,
        )?;

        let unexpected: Vec<&str> =
            outcome.claims.iter().filter(|c| !c.as_expected()).map(|c| c.id).collect();
        let held = outcome.claims.iter().filter(|c| c.holds).count();
        let fitted = outcome.claims.iter().filter(|c| c.fitted).count();
        let verdict = if unexpected.is_empty() {
            let rest = outcome.claims.len() - held;
            format!(
                "{held} of {} statements hold, {rest} do not, as documented; the bench was fitted to {fitted} of them",
                outcome.claims.len()
            )
        } else {
            format!("not as documented: {}", unexpected.join(", "))
        };
        tell(&format!(
            "{}\n{verdict}\nfigures, table3.csv, report.json and report.html are in {}\n",
            claims_table(&outcome.claims),
            dir.display()
        ))?;
        Ok(if unexpected.is_empty() { Exit::Done } else { Exit::Failed })
    }
}

fn caption(f: &FigureData) -> String {
    format!(
        "Fig. {} of the paper: positional errors with the {}; left the simulation, right the stand-in for the \
         experiment. The error is target minus true position.",
        f.number,
        f.law.name()
    )
}

/// The paper's arrangement: a row for each rate, simulation left, experiment right.
fn draw(f: &FigureData) -> Figure {
    let panels = f
        .panels
        .iter()
        .map(|p| Panel {
            title: format!(
                "({}) {}, {} °/s",
                if p.experiment { "b" } else { "a" },
                if p.experiment { "bench" } else { "simulation" },
                number(p.rate_deg_s)
            ),
            x_label: "time (s)".to_owned(),
            y_label: "error (°)".to_owned(),
            series: vec![Series::new(
                "error",
                p.time_s.iter().copied().zip(p.error_deg.iter().copied()).collect(),
            )],
            lines: vec![0.0],
            ..Panel::default()
        })
        .collect();
    Figure {
        title: format!("Fig. {}: positional errors with the {}", f.number, f.law.name()),
        columns: 2,
        panels,
        share_y: true,
    }
}

fn intro() -> Vec<String> {
    vec![
        "The paper compares three laws that hold a shaft to a path with a friction brake: PD, computed torque (CTC) \
         and sliding mode (SMC). Here the control code that is meant for hardware repeats its figures, its table and \
         every statement of its section 4."
            .to_owned(),
        "Simulation stands for the rig “paper”: Table 1, a 20 000-count encoder, a 12-bit converter. Experiment stands \
         for the rig “bench”: not the authors' machine, whose friction nobody recorded, but a stand-in that was \
         fitted to some of the statements (marked “fitted”) and is tested on the others."
            .to_owned(),
    ]
}

fn settings() -> Vec<(String, String)> {
    let row = |a: &str, b: String| (a.to_owned(), b);
    let bench = clutch_sim::RigParams::bench();
    vec![
        row("Version", env!("CARGO_PKG_VERSION").to_owned()),
        row(
            "Engine",
            "exact flow where the rig allows it, else Dormand–Prince (the paper's); the tests compare the two".to_owned(),
        ),
        row("Sampling", "1 ms, smoothed derivative (5) with K_Kal = 0.2".to_owned()),
        row("Run", "5 s, the first second not counted; start on the path".to_owned()),
        row("Seeds", format!("{SEEDS:?}")),
        row(
            "Bench: friction",
            bench_friction(),
        ),
        row(
            "Bench: along the disc",
            bench.ripple.map_or("even".to_owned(), |r| {
                format!(
                    "±{} % (rms), waves of {} to {} per turn, {} apart, random phases",
                    number(100.0 * r.rms),
                    r.lowest,
                    r.highest,
                    r.spacing
                )
            }),
        ),
        row("Bench: delay", format!("{} sampling period", bench.delay_ticks)),
    ]
}

/// The parameters of the bench's friction, by their keys.
fn bench_friction() -> String {
    // Its rig is the bench and nothing else.
    let Some(Ok(scenario)) = Scenario::built_in("bench_pd_2") else {
        unreachable!("a scenario that is built in")
    };
    let of_friction = |(key, value): (String, String)| {
        let key = key.strip_prefix("rig.friction.")?.to_owned();
        Some(format!("{key} = {value}"))
    };
    scenario.parameters().into_iter().filter_map(of_friction).collect::<Vec<_>>().join(", ")
}

fn table3_cells(rows: &[Table3Row]) -> Vec<Vec<String>> {
    let header =
        ["Rate (°/s)", "PD (cycles/s)", "SMC (cycles/s)", "Reduction (%)", "Spread (points)", "Paper (%)"];
    let mut cells = vec![header.map(str::to_owned).to_vec()];
    cells.extend(rows.iter().map(|r| {
        vec![
            number(r.rate_deg_s),
            format!("{:.1}", r.pd_cycles_per_s),
            format!("{:.1}", r.smc_cycles_per_s),
            format!("{:.1}", r.reduction_percent),
            format!("{:.1}", r.spread_points),
            format!("{:.1}", r.paper_percent),
        ]
    }));
    cells
}

fn write_table3(rows: &[Table3Row], file: &std::path::Path) -> anyhow::Result<()> {
    let wrong = || format!("{}: cannot be written", file.display());
    let mut out = csv::Writer::from_path(file).with_context(wrong)?;
    rows.iter().try_for_each(|r| out.serialize(r)).with_context(wrong)?;
    out.flush().with_context(wrong)
}
