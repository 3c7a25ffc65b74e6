//! `clutch reproduce`.

use crate::output::{Exit, json, paragraph, tell, to_write, with_progress, write};
use crate::plot::{Figure, Panel, Series};
use crate::report::{Page, ReportFigure, ReportTable, claims_table};
use crate::run_figure;
use crate::table::number;
use anyhow::Context;
use clap::Args;
use clutch_sim::paper::{self, Claim, FigureData, PanelData, SEEDS, Table3Row};
use clutch_sim::picture::{Envelope, PARTS};
use clutch_sim::progress::UNWATCHED;
use clutch_sim::{Keep, Scenario};
use std::path::PathBuf;

/// Reproduces the paper: figures 8 to 10, Table 3, and every statement of its section 4.
///
/// Exit code 0 when every statement holds or fails just as documented, else 1.
#[derive(Args)]
#[command(after_help = "Example:\n  clutch reproduce --out reproduce\n\n\
    Then open reproduce/report.html in a browser.")]
pub(crate) struct Reproduce {
    /// Folder for figures, table and report; created if missing.
    #[arg(long, value_parser = to_write(), value_name = "DIR", default_value = "reproduce")]
    out: PathBuf,
}

impl Reproduce {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        let dir = &self.out;
        std::fs::create_dir_all(dir).with_context(|| format!("{}: cannot be made", dir.display()))?;
        let outcome = with_progress("runs", paper::reproduce)?;

        let mut drawn = vec![("laws".to_owned(), LAWS.to_owned(), laws()?)];
        drawn.extend(outcome.figures.iter().map(|f| (format!("fig{}", f.number), caption(f), draw(f))));
        let mut figures = Vec::new();
        for (id, caption, figure) in &drawn {
            write(&dir.join(format!("{id}.svg")), figure.svg()?)?;
            write(&dir.join(format!("{id}.png")), figure.png()?)?;
            figures.push(ReportFigure::new(id, caption, figure)?);
        }
        let table3 = ReportTable {
            id: "table-3".to_owned(),
            title: "Table 3".to_owned(),
            caption: "Table 3 of the paper, and the results here. At 10 and 6 °/s PD is an unstable sampled loop on this rig, which friction merely clips (docs/smooth.md, the walls).".to_owned(),
            rows: table3_cells(&outcome.table3),
            words: 0,
        };
        write_table3(&outcome.table3, &dir.join("table3.csv"))?;
        let verdict = verdict(&outcome.claims);
        let mut lead = vec![format!("{}.", capital(&verdict))];
        lead.extend(smoother(&outcome.table3));
        lead.extend(price(&outcome.figures));
        let page = Page {
            title: "The paper, reproduced",
            lead: &lead,
            figures: &figures,
            claims: &outcome.claims,
            tables: &[table3],
            about: &about(),
            settings: &settings(),
        };
        write(&dir.join("report.html"), page.html()?)?;
        write(
            &dir.join("report.json"),
            json(&serde_json::json!({
                "version": env!("CARGO_PKG_VERSION"),
                "seeds": SEEDS,
                "claims": outcome.claims,
                "table3": outcome.table3,
            }))?,
        )?;

        tell(&format!(
            "{}\n{}figures, table3.csv, report.json and report.html are in {}\n",
            claims_table(&outcome.claims),
            paragraph(&verdict),
            dir.display()
        ))?;
        let documented = outcome.claims.iter().all(Claim::as_expected);
        Ok(if documented { Exit::Done } else { Exit::Failed })
    }
}

/// The outcome in a sentence.
fn verdict(claims: &[Claim]) -> String {
    let unexpected: Vec<&str> = claims.iter().filter(|c| !c.as_expected()).map(|c| c.id).collect();
    if !unexpected.is_empty() {
        return format!("not as documented: {}", unexpected.join(", "));
    }
    let held = claims.iter().filter(|c| c.holds).count();
    let fitted = claims.iter().filter(|c| c.fitted).count();
    format!(
        "{held} of the paper's {} statements hold, {} do not, as documented; the bench was fitted to {fitted} of them",
        claims.len(),
        claims.len() - held
    )
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// The gain of sliding mode at the lowest rate of Table 3, in a sentence.
fn smoother(table3: &[Table3Row]) -> Option<String> {
    let slowest = table3.iter().min_by(|a, b| a.rate_deg_s.total_cmp(&b.rate_deg_s))?;
    Some(format!(
        "At {} °/s on the bench the shaft sticks {:.1} times a second under PD and {:.1} times under sliding mode: {:.1} % \
         less, where the paper has {:.1} % (means of {} discs).",
        number(slowest.rate_deg_s),
        slowest.pd_cycles_per_s,
        slowest.smc_cycles_per_s,
        slowest.reduction_percent,
        slowest.paper_percent,
        SEEDS.len()
    ))
}

/// The price of it, at the lowest rate that PD and sliding mode have in common on the bench, in a sentence.
fn price(figures: &[FigureData]) -> Option<String> {
    let of = |number: u32| {
        let panels = figures.iter().find(|f| f.number == number)?.panels.iter();
        panels.filter(|p| p.experiment).min_by(|a, b| a.rate_deg_s.total_cmp(&b.rate_deg_s))
    };
    let (pd, smc) = (of(8)?, of(10)?);
    // The figures of the runs leave the first second out.
    let largest = |p: &PanelData| {
        let settled = p.time_s.iter().zip(&p.error_deg).filter(|(t, _)| **t >= 1.0);
        settled.map(|(_, e)| e.abs()).fold(0.0, f64::max)
    };
    (pd.rate_deg_s == smc.rate_deg_s).then(|| {
        format!(
            "That has its price: in the runs drawn here the largest error at {} °/s on the bench is {:.2}° under sliding \
             mode and {:.2}° under PD.",
            number(pd.rate_deg_s),
            largest(smc),
            largest(pd)
        )
    })
}

/// Words under the first figure.
const LAWS: &str = "PD against sliding mode at 2 °/s on the bench. Position and velocity: single stairs of the encoder, around a \
                    stick. Error and voltage: the whole run; the band goes from the lowest to the highest of each 1/120 of \
                    it, the line is the mean.";

/// The two laws that Table 3 compares, on common axes.
fn laws() -> anyhow::Result<Figure> {
    let load = |name: &str| -> anyhow::Result<_> {
        let Some(Ok(scenario)) = Scenario::built_in(name) else {
            unreachable!("a scenario that is built in")
        };
        let run = scenario.run(Keep::Trace, UNWATCHED)?;
        Ok((scenario, run))
    };
    let runs = [("PD", load("bench_pd_2")?), ("sliding mode", load("bench_smc_2")?)];
    let drawn: Vec<_> = runs
        .iter()
        .map(|(label, (scenario, run))| run_figure::Drawn { label: (*label).to_owned(), scenario, run })
        .collect();
    Ok(run_figure::figure("PD against sliding mode at 2 °/s, bench", &drawn))
}

fn caption(f: &FigureData) -> String {
    format!(
        "Fig. {} of the paper: positional errors with the {}; (a) the simulation, (b) the stand-in for the experiment. \
         The error is target minus true position; the band goes from its lowest to its highest in each 1/120 of the run, \
         the line is the mean.",
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
            series: vec![Series::envelope("error", &Envelope::new(&p.time_s, &p.error_deg, PARTS), 1.0)],
            lines: vec![0.0],
            ..Panel::default()
        })
        .collect();
    Figure {
        title: format!("Fig. {}: positional errors with the {}", f.number, f.law.name()),
        columns: 2,
        panels,
        share_y: true,
        ..Figure::default()
    }
}

fn about() -> Vec<String> {
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
    let header = [
        "Rate (°/s)",
        "PD (cycles/s)",
        "SMC (cycles/s)",
        "Reduction (%)",
        "Spread (points)",
        "By counts (%)",
        "Paper (%)",
    ];
    let mut cells = vec![header.map(str::to_owned).to_vec()];
    cells.extend(rows.iter().map(|r| {
        vec![
            number(r.rate_deg_s),
            format!("{:.1}", r.pd_cycles_per_s),
            format!("{:.1}", r.smc_cycles_per_s),
            format!("{:.1}", r.reduction_percent),
            format!("{:.1}", r.spread_points),
            format!("{:.1}", r.counted_reduction_percent),
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
