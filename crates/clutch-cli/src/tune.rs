//! `clutch tune`.

use crate::args::{ScenarioArgs, read_rig_file};
use crate::map::{List, values};
use crate::output::{Exit, Forms, check_files, json, paragraph, tell, to_write, with_progress, write, wrote};
use crate::plot::{Figure, Panel, Series};
use crate::report::{Page, ReportFigure, ReportTable};
use crate::table::number;
use clap::Args;
use clutch_certificate::file;
use clutch_sim::picture::{Envelope, PARTS};
use clutch_sim::progress::UNWATCHED;
use clutch_sim::scenario::Value;
use clutch_sim::smooth_speed::RATE;
use clutch_sim::{Keep, Scenario, ScenarioError};
use clutch_tune::{Candidate, Options, Outcome, Tuned, Verdict, tune};
use comfy_table::{CellAlignment, ContentArrangement, Table, TableStyle};
use std::path::{Path, PathBuf};

/// Finds the law and the gains that move a rig most smoothly, certified.
///
/// Candidates of each law run on simulated rigs at the corners of the bounds, on discs that no gain was chosen on; the
/// smoothest one with a certificate, as sampled or in a shell, that also starts from rest, is given out. The scenario's law
/// is tried with its own gains, too. On a ramp smooth means without sticks; along another path, which has no certificate yet
/// and needs --uncertified, the error counts. Exit code 0: gains are given out; 2: none is certified, or none starts from
/// rest.
#[derive(Args)]
#[command(after_help = "Examples:\n  clutch tune board_smc_2 --identified rig.toml --out tuned.toml\n  \
    clutch tune mine.toml --rates 1,2,6 --html tuned.html\n  \
    clutch tune motor_pid --uncertified --out tuned.toml\n  \
    clutch loop tuned.toml --certificate proof.json   # after --save proof.json\n\n\
    docs/tune.md says what is tried, on what, and what is proven.")]
pub(crate) struct Tune {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Rates at which it is to be smooth, °/s, as LOW:HIGH:NUMBER or a list; unless given, the scenario's own.
    #[arg(long, value_name = "VALUES", value_parser = values)]
    rates: Option<List>,
    /// Candidates of each law.
    #[arg(long, value_name = "N", default_value_t = Options::default().candidates)]
    candidates: u32,
    /// Gives out the smoothest law without a certificate if none with one starts from rest; `clutch loop` asks for
    /// --uncertified again.
    #[arg(long)]
    uncertified: bool,
    /// Writes the tuned scenario, whole, with the rig as it is believed to be.
    #[arg(long, value_parser = to_write(), value_name = "FILE.toml")]
    out: Option<PathBuf>,
    /// Writes the proof, which `clutch loop --certificate` and `clutch certify --check` read.
    #[arg(long, value_parser = to_write(), value_name = "FILE.json")]
    save: Option<PathBuf>,
    #[command(flatten)]
    forms: Forms,
}

impl Tune {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        self.forms.check()?;
        check_files(self.out.iter().chain(&self.save))?;
        let scenario = self.scenario.load()?;
        let rig = self.scenario.identified.as_deref().map(read_rig_file).transpose()?;
        let options = Options {
            rates_deg_s: self.rates.as_ref().map_or_else(Vec::new, |list| list.0.clone()),
            candidates: self.candidates,
            uncertified: self.uncertified,
        };
        let tuned = with_progress("runs", |progress| tune(&scenario, rig.as_ref(), &options, progress))?;
        self.forms.give(
            || figure(&tuned),
            |figure| page(&tuned, figure),
            || json(&tuned),
            || text(&tuned),
        )?;
        let Some(winner) = tuned.winner().and_then(|w| w.scenario.as_ref()) else {
            for file in self.out.iter().chain(&self.save) {
                eprintln!("{}: not written: no gains are given out", file.display());
            }
            return Ok(Exit::NotCertified);
        };
        if let Some(path) = &self.out {
            write(path, scenario_file(&tuned, winner))?;
        }
        let mut written: Vec<&Path> = self.out.iter().map(PathBuf::as_path).collect();
        match (&self.save, &tuned.certificate) {
            (Some(path), Some(certificate)) => {
                file::write(path, certificate)?;
                written.push(path);
            }
            (Some(path), None) => eprintln!("{}: not written: nothing is proven", path.display()),
            _ => {}
        }
        if !self.forms.json() {
            tell(&wrote(&written))?;
        }
        Ok(Exit::Done)
    }
}

/// The tuned scenario as a file.
#[must_use]
pub fn scenario_file(tuned: &Tuned, winner: &Scenario) -> String {
    let comment =
        |line: &str| paragraph(line).lines().map(|l| format!("# {}\n", l.trim_start())).collect::<String>();
    let verdict = comment(&format!("Found by `clutch tune`. {}", verdict(tuned)));
    let rig = comment(
        "[rig] is the rig as it is believed to be, from [model] and what was identified; a board has its own.",
    );
    format!("{verdict}{rig}\n{}", winner.canonical())
}

/// The verdict on what is chosen, with its scope; or what limits.
#[must_use]
pub fn verdict(tuned: &Tuned) -> String {
    let Some(winner) = tuned.winner() else { return nothing(tuned) };
    match &winner.verdict {
        Verdict::Certified { lines, shell, .. } => {
            let how = if *shell { "inside a certified shell" } else { "certified as sampled" };
            format!("{}: {how}: {}", winner.name, lines.join("; "))
        }
        Verdict::Uncertified { why } => format!("{}: UNCERTIFIED: {why}", winner.name),
        Verdict::NotLookedFor => format!("{}: UNCERTIFIED", winner.name),
    }
}

/// Reason why nothing is given out.
fn nothing(tuned: &Tuned) -> String {
    let first = |f: &dyn Fn(&Candidate) -> bool| tuned.candidates.iter().find(|c| f(c));
    let refused = |c: &Candidate| matches!(c.outcome, Outcome::Refused { .. });
    let certified = |c: &Candidate| matches!(c.verdict, Verdict::Certified { .. });
    let open = first(&|c| matches!(&c.outcome, Outcome::Uncertified { why } if !why.is_empty()));
    match (first(&|c| refused(c) && certified(c)), open, first(&refused)) {
        (None, Some(c), _) => format!(
            "no gains are given out: nothing is certified; of the smoothest, {}: {}; --uncertified takes it all the same",
            c.name,
            lost(c)
        ),
        (Some(c), ..) | (None, None, Some(c)) => {
            let output = if tuned.output_v.is_some() {
                ", or --uncertified, which leaves output.lowest_v and highest_v as they are"
            } else {
                ""
            };
            format!(
                "no gains are given out: {}: {}; a higher rate may help, or a finer encoder (clutch map){output}",
                c.name,
                lost(c)
            )
        }
        (None, None, None) => {
            "no gains are given out: no law goes with the path on every corner of the bounds".to_owned()
        }
    }
}

/// Reason why a candidate lost.
fn lost(c: &Candidate) -> String {
    match &c.outcome {
        Outcome::Chosen => "chosen".to_owned(),
        Outcome::Rougher { than } => format!("rougher, by {:.2}", c.score.cost.unwrap_or(0.0) - than),
        Outcome::Uncertified { why } if why.is_empty() => {
            "not looked at: nothing smoother is certified".to_owned()
        }
        Outcome::Uncertified { why } => format!("uncertified: {why}"),
        Outcome::Refused { why } => format!("refused: {why}"),
        Outcome::Strays => "leaves its path on a corner of the bounds".to_owned(),
        Outcome::Unstable => "no gains whose sampled loop is stable".to_owned(),
    }
}

/// The certificate of a candidate in a word or two.
fn certified(c: &Candidate) -> String {
    match &c.verdict {
        Verdict::Certified { error_rad, .. } => format!("≤ {:.3}°", error_rad.to_degrees()),
        Verdict::Uncertified { .. } => "no".to_owned(),
        Verdict::NotLookedFor => "–".to_owned(),
    }
}

/// A row for each candidate, under a head.
fn rows(tuned: &Tuned) -> Vec<Vec<String>> {
    let head = ["law", "cost", "cycles/s", "stick in", "longest", "error", "V/s", "proven"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for c in &tuned.candidates {
        let s = &c.score;
        let cell = |text: String| if c.scenario.is_some() { text } else { "–".to_owned() };
        rows.push(vec![
            c.name.clone(),
            s.cost.map_or("–".to_owned(), |x| format!("{x:.2}")),
            cell(format!("{:.2}", s.cycles_per_s)),
            cell(format!("{}/{}", s.runs_with_sticks, s.runs)),
            cell(format!("{:.0} ms", 1e3 * s.longest_stick_s)),
            cell(format!("{:.3}°", s.max_error_rad.to_degrees())),
            cell(format!("{:.0}", s.control_variation_v_s)),
            certified(c),
        ]);
    }
    rows
}

/// The runs behind the table.
fn about(tuned: &Tuned) -> String {
    let n = tuned.corners.len();
    let corners = format!("{n} {} of the bounds", if n == 1 { "corner" } else { "corners" });
    let (at, settling, cost) = if tuned.rates_deg_s.is_empty() {
        (
            "Along the scenario's path".to_owned(),
            "run.settle_s",
            "30 × RMS error, ° + 10 × largest error, ° + V/s over 1000: where a path turns round every shaft rests, and sticks do not count",
        )
    } else {
        let rates: Vec<String> = tuned.rates_deg_s.iter().map(|r| number(*r)).collect();
        let at = format!("At {} °/s", rates.join(", "));
        (at, "the first second", "cycles/s + 30 × RMS error, ° + longest stick/20 ms + V/s over 1000")
    };
    let next = if tuned.candidates.iter().any(|c| c.before > 0) {
        " (of a law's next gains, (2) and (3), as many behind)"
    } else {
        ""
    };
    format!(
        "{at}, from rest, {corners}; figures are the worst of runs on discs 101 to 108{next}, {settling} left out. Cost: {cost}. \
         {:.0} s were simulated.",
        tuned.simulated_s
    )
}

fn text(tuned: &Tuned) -> String {
    let mut table = Table::new();
    table.load_style(TableStyle::new()).set_content_arrangement(ContentArrangement::Disabled);
    table.add_rows(rows(tuned));
    for n in 1..8 {
        if let Some(column) = table.column_mut(n) {
            column.set_cell_alignment(CellAlignment::Right);
            column.set_padding((1, 0));
        }
    }
    if let Some(column) = table.column_mut(0) {
        column.set_padding((0, 0));
    }
    let mut out = paragraph(&format!("{}: gains", tuned.believed.name())) + "\n";
    for line in table.to_string().lines() {
        out += line.trim_end();
        out.push('\n');
    }
    out.push('\n');
    out += &paragraph(&about(tuned));
    for c in &tuned.candidates {
        let (tried, unstable) = c.tried;
        let left_out =
            if unstable > 0 { format!(", {unstable} left out as unstable") } else { String::new() };
        // A remark on all of them is made once.
        let why = match &c.outcome {
            Outcome::Uncertified { why } if Some(why) == tuned.uncovered.as_ref() => "uncertified".to_owned(),
            _ => lost(c),
        };
        out += &paragraph(&format!("{}: {why}; {tried} sets of gains{left_out}", c.name));
    }
    if let Some(why) = &tuned.uncovered {
        out += &paragraph(&format!("no law is certified here: {why}"));
    }
    for (shell, why) in &tuned.open_shells {
        out += &paragraph(&format!(
            "shell f {} 1/s, S {} rad/s, smoothing {}: {why}",
            number(shell.slope_1_s),
            number(shell.boundary_rad_s),
            number(shell.smoothing)
        ));
    }
    if let Some(winner) = tuned.winner() {
        out.push('\n');
        for (key, value) in &winner.gains {
            out += &format!("  {key} = {}\n", number(*value));
        }
        if winner.gains.is_empty() {
            out += "  the scenario's own gains, or the law's defaults\n";
        }
        for (key, volts) in tuned.output_limits() {
            out += &format!("  {key} = {}\n", number(volts));
        }
        if let Some(s) = &tuned.from_rest {
            let (at, sticks) = match tuned.rates_deg_s.first() {
                Some(rate) => (format!("at {} °/s ", number(*rate)), "no stick after the first second, "),
                None => (String::new(), ""),
            };
            out += &paragraph(&format!(
                "accepted: {} starts from rest {at}on discs 201 to 210: {sticks}error up to {:.3}°",
                s.runs,
                s.max_error_rad.to_degrees()
            ));
        }
    }
    out += &paragraph(&verdict(tuned));
    if let Some(winner) = tuned.winner()
        && let (Verdict::Certified { error_rad, .. }, Some(scenario)) = (&winner.verdict, &winner.scenario)
        && let Ok(safety) = scenario.safety()
    {
        let limit = safety.limits.supervisor.following_error;
        if *error_rad > limit {
            out += &paragraph(&format!(
                "note: that bound is above safety.limits.following_error_deg = {}, at which the loop ends a run",
                number(limit.to_degrees())
            ));
        }
    }
    out
}

/// Disc of the picture: the first of those that candidates are judged on.
const DRAWN: i64 = 101;

/// The error over time of each candidate, at the lowest rate, or along the path, on the believed rig.
fn figure(tuned: &Tuned) -> anyhow::Result<Figure> {
    let mut panels = Vec::new();
    let lowest = tuned.rates_deg_s.first().copied();
    for c in &tuned.candidates {
        let Some(scenario) = &c.scenario else { continue };
        let title = match c.outcome {
            Outcome::Chosen => format!("{} (chosen)", c.name),
            _ => c.name.clone(),
        };
        panels.push(Panel {
            title,
            x_label: "t, s".to_owned(),
            y_label: "error, °".to_owned(),
            series: vec![errors(scenario, lowest)?],
            ..Panel::default()
        });
    }
    let most = |p: &Panel| {
        p.series.iter().flat_map(|s| &s.band).map(|(_, low, high)| low.abs().max(*high)).fold(0.0, f64::max)
    };
    // One scale for all that follow their path.
    let scale = panels.iter().map(most).filter(|e| *e < 2.0).fold(0.02, f64::max);
    for panel in &mut panels {
        panel.y_range = Some((-1.05 * scale, 1.05 * scale));
    }
    Ok(Figure {
        title: format!(
            "{}: error {}from rest, disc {DRAWN}",
            tuned.believed.name(),
            lowest.map_or(String::new(), |rate| format!("at {} °/s ", number(rate)))
        ),
        columns: 2,
        panels,
        ..Figure::default()
    })
}

fn errors(scenario: &Scenario, rate: Option<f64>) -> Result<Series, ScenarioError> {
    let mut set = vec![("run.seed".to_owned(), Value::Integer(DRAWN))];
    if let Some(rate) = rate {
        set.extend([
            (RATE.to_owned(), Value::Float(rate)),
            ("run.duration_s".to_owned(), Value::Float(5.0)),
            ("run.settle_s".to_owned(), Value::Float(1.0)),
        ]);
    }
    let here = Scenario::from_table(scenario.name(), scenario.table().clone(), &set)?;
    let trace = here.run(Keep::Trace, UNWATCHED)?.trace;
    let errors = Envelope::new(&trace.time, &trace.error, PARTS);
    Ok(Series::envelope("error", &errors, 1.0_f64.to_degrees()))
}

fn page(tuned: &Tuned, figure: &Figure) -> anyhow::Result<String> {
    let title = format!("{}: gains", tuned.believed.name());
    let mut laws = rows(tuned);
    for (row, why) in
        laws.iter_mut().zip(std::iter::once("outcome".to_owned()).chain(tuned.candidates.iter().map(lost)))
    {
        row.push(why);
    }
    let open = tuned.open_shells.iter().map(|(shell, why)| {
        vec![number(shell.slope_1_s), number(shell.boundary_rad_s), number(shell.smoothing), why.clone()]
    });
    let head = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
    let gains = tuned.winner().map_or(&[][..], |winner| &winner.gains);
    let row = |key: &str, value: f64| vec![key.to_owned(), number(value)];
    let output = tuned.output_limits().map(|(key, volts)| row(key, volts));
    let gains = gains.iter().map(|(key, value)| row(key, *value)).chain(output);
    let table = |id: &str, title: &str, caption: &str, rows, words| ReportTable {
        id: id.to_owned(),
        title: title.to_owned(),
        caption: caption.to_owned(),
        rows,
        words,
    };
    let tables = [
        table(
            "laws",
            "Laws",
            "The best gains of each law, and the next behind a rare stick, the smoothest first.",
            laws,
            1,
        ),
        table(
            "gains",
            "Gains",
            "The gains that are given out, SI.",
            std::iter::once(head(&["key", "value"])).chain(gains).collect(),
            0,
        ),
        table(
            "shells",
            "Shells without a proof",
            "Shells that were tried before, or in vain.",
            std::iter::once(head(&["f, 1/s", "S, rad/s", "smoothing", "what limits"])).chain(open).collect(),
            1,
        ),
    ];
    let caption = "Error of the best gains of each law, from rest, on a disc that no gain was chosen on: lowest to highest and mean of each 1/120 of the run.";
    let figures = [ReportFigure::new("tune", caption, figure)?];
    let settings = tuned.winner().and_then(|w| w.scenario.as_ref()).unwrap_or(&tuned.believed).parameters();
    let page = Page {
        title: &title,
        lead: &[verdict(tuned)],
        figures: &figures,
        tables: &tables,
        about: &[about(tuned)],
        settings: &settings,
        ..Page::default()
    };
    page.html()
}
