//! `clutch referee`.

use crate::output::{Exit, beside, json, print, tell};
use anyhow::Context;
use clap::Args;
use clutch_sim::nearest;
use clutch_sim::referee::{BUILT_IN, Case, ENGINES, RefereeEngine, RefereeError, Verdict, run};
use serde_json::json;
use std::path::Path;
use std::time::Instant;

/// Holds the engines against cases whose answer is known from elsewhere.
///
/// Each engine runs the cases that it takes. A table for each case says how far it is off what is expected; a mark `!`
/// stands where that is more than the case allows. Exit code 1 if there is such a mark, or no engine took a case.
#[derive(Args)]
#[command(
    after_help = "Example:\n  clutch referee\n  clutch referee A5 L1 --engine system\n  clutch referee mine.toml\n  clutch referee --show A5 > mine.toml\n\n`python -m clutch.referee` adds engines of other makes to the table."
)]
pub(crate) struct Referee {
    /// Names of built-in cases, or case files; none for all built-in ones.
    #[arg(value_name = "CASE")]
    cases: Vec<String>,
    /// Runs this engine only; may be given several times.
    #[arg(long, value_name = "NAME", value_parser = engine)]
    engine: Vec<RefereeEngine>,
    /// Lists the built-in cases and ends.
    #[arg(long, conflicts_with_all = ["cases", "engine", "json"])]
    list: bool,
    /// Prints a built-in case and ends.
    #[arg(long, value_name = "CASE", conflicts_with_all = ["cases", "engine", "json", "list"])]
    show: Option<String>,
    /// Prints the results as JSON.
    #[arg(long)]
    json: bool,
}

fn engine(name: &str) -> Result<RefereeEngine, String> {
    RefereeEngine::named(name).ok_or_else(|| {
        let names: Vec<&str> = ENGINES.iter().map(|e| e.name()).collect();
        format!("expected one of: {}{}", names.join(", "), nearest(name, &names))
    })
}

fn built_in(name: &str) -> Option<&'static str> {
    BUILT_IN.iter().find(|(n, _)| *n == name).map(|(_, text)| *text)
}

/// Asks for the built-in case that was probably meant.
fn like(name: &str) -> String {
    nearest(name, &BUILT_IN.iter().map(|(n, _)| *n).collect::<Vec<_>>())
}

fn load(name: &str) -> anyhow::Result<Case> {
    let text = match (built_in(name), Path::new(name).exists()) {
        (Some(text), false) => text.to_owned(),
        (_, true) => clutch_sim::scenario::read_text(Path::new(name))
            .with_context(|| format!("{name}: cannot be read"))?,
        (None, false) => {
            anyhow::bail!(
                "{name}: no such file, and no built-in case; `clutch referee --list` shows those{}",
                like(name)
            )
        }
    };
    Ok(Case::parse(name, &text)?)
}

/// An engine's result of a case.
struct Outcome {
    engine: RefereeEngine,
    verdicts: Vec<Verdict>,
    seconds: f64,
    /// Reason why the engine gave up.
    error: Option<String>,
}

impl Outcome {
    fn missed(&self) -> usize {
        self.verdicts.iter().filter(|v| !v.holds()).count() + usize::from(self.error.is_some())
    }
}

/// The results of all engines that take the case, and the others with what they need.
fn results(case: &Case, engines: &[RefereeEngine]) -> (Vec<Outcome>, Vec<String>) {
    let mut others = Vec::new();
    let one = |engine: &RefereeEngine| {
        let begin = Instant::now();
        let (verdicts, error) = match run(case, *engine, None) {
            Ok(trajectory) => (case.judge(&trajectory), None),
            Err(RefereeError::NotForIt(needs)) => {
                others.push(format!("{}: {needs}", engine.name()));
                return None;
            }
            Err(e) => (Vec::new(), Some(e.to_string())),
        };
        Some(Outcome { engine: *engine, verdicts, seconds: begin.elapsed().as_secs_f64(), error })
    };
    let taken = engines.iter().filter_map(one).collect();
    (taken, others)
}

impl Referee {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        if self.list {
            for (name, text) in BUILT_IN {
                let case = Case::parse(name, text)?;
                print(&beside(&format!("{:18}", case.id), &case.title))?;
            }
            return Ok(Exit::Done);
        }
        if let Some(name) = &self.show {
            let text = built_in(name).with_context(|| {
                let like = like(name);
                format!("{name}: no built-in case of that name; `clutch referee --list` shows those{like}")
            })?;
            print(text)?;
            return Ok(Exit::Done);
        }
        let names = if self.cases.is_empty() {
            BUILT_IN.iter().map(|(name, _)| (*name).to_owned()).collect()
        } else {
            self.cases
        };
        let engines = if self.engine.is_empty() { ENGINES.to_vec() } else { self.engine };
        // All are read before the first runs.
        let cases = names.iter().map(|name| load(name)).collect::<anyhow::Result<Vec<_>>>()?;
        let mut all = Vec::new();
        for case in &cases {
            let (results, others) = results(case, &engines);
            if !self.json {
                tell(&table(case, &results, &others))?;
            }
            all.push(results);
        }
        if self.json {
            print(&json(&as_json(&cases, &all))?)?;
        } else {
            tell(&summary(&engines, &all))?;
        }
        let missed: usize = all.iter().flatten().map(Outcome::missed).sum();
        // A comparison without a figure shows nothing.
        let figures: usize = all.iter().flatten().map(|r| r.verdicts.len()).sum();
        Ok(if missed > 0 || figures == 0 { Exit::Failed } else { Exit::Done })
    }
}

fn as_json(cases: &[Case], all: &[Vec<Outcome>]) -> serde_json::Value {
    let one = |(case, results): (&Case, &Vec<Outcome>)| {
        let results = results.iter().map(|r| {
            let figures = r.verdicts.iter().map(|v| {
                json!({ "name": v.name, "unit": v.unit, "measured": v.measured, "expected": v.expected,
                        "within": v.within, "holds": v.holds() })
            });
            json!({ "engine": r.engine.name(), "seconds": r.seconds, "error": r.error,
                    "figures": figures.collect::<Vec<_>>() })
        });
        json!({ "id": case.id, "title": case.title, "source": case.source,
                "results": results.collect::<Vec<_>>() })
    };
    cases.iter().zip(all).map(one).collect()
}

/// A case: a line for each figure, a column for each engine.
fn table(case: &Case, results: &[Outcome], others: &[String]) -> String {
    let mut out = format!("{}  {}\n", case.id, case.title);
    if results.is_empty() {
        out += "  no engine that was asked takes it\n";
        for other in others {
            out += &beside("  ", other);
        }
        return out + "\n";
    }
    let mut lines = vec![vec![String::new(), "expected".to_owned(), "within".to_owned()]];
    lines[0].extend(results.iter().map(|r| r.engine.name().to_owned()));
    for (i, expect) in case.expect.iter().enumerate() {
        let unit = if expect.unit.is_empty() { String::new() } else { format!(", {}", expect.unit) };
        let mut line = vec![format!("{}{unit}", expect.name), digits(expect.value), size(expect.within)];
        line.extend(results.iter().map(|r| off(r.verdicts.get(i))));
        lines.push(line);
    }
    // The widths are the case's own: the names of three engines leave no room for more in 80 columns.
    let width = |column: usize| lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..lines[0].len()).map(width).collect();
    for line in &lines {
        out += &format!(" {:1$}", line[0], widths[0]);
        line[1..].iter().zip(&widths[1..]).for_each(|(cell, width)| out += &format!("  {cell:>width$}"));
        out.push('\n');
    }
    for r in results {
        if let Some(e) = &r.error {
            out += &format!("  {}: {e}\n", r.engine.name());
        }
    }
    out + "\n"
}

/// Distance of a figure from what is expected, with a mark at one that is missed.
fn off(verdict: Option<&Verdict>) -> String {
    let Some(verdict) = verdict else { return "gave up !".to_owned() };
    match verdict.measured {
        None => "none !".to_owned(),
        Some(x) if x == verdict.expected => "exact".to_owned(),
        Some(x) => {
            let mark = if verdict.holds() { "" } else { " !" };
            let sign = if x > verdict.expected { "+" } else { "-" };
            format!("{sign}{}{mark}", size((x - verdict.expected).abs()))
        }
    }
}

/// A number with at most eleven digits.
fn digits(x: f64) -> String {
    let rounded = format!("{x:.10e}").parse().unwrap_or(x);
    if x != 0.0 && x.abs() < 1e-3 { format!("{rounded:e}") } else { format!("{rounded}") }
}

/// A size with two digits.
fn size(x: f64) -> String {
    if x == 0.0 { "0".to_owned() } else { format!("{x:.0e}") }
}

fn summary(engines: &[RefereeEngine], all: &[Vec<Outcome>]) -> String {
    let mut out =
        format!("{:18}{:>7}{:>10}{:>10}{:>10}\n", "engine", "cases", "figures", "missed", "time, s");
    for engine in engines {
        let own: Vec<&Outcome> = all.iter().flatten().filter(|r| r.engine == *engine).collect();
        let figures: usize = own.iter().map(|r| r.verdicts.len()).sum();
        let missed: usize = own.iter().map(|r| r.missed()).sum();
        let seconds = own.iter().map(|r| r.seconds).sum::<f64>() + 0.0; // an empty sum is −0
        out += &format!("{:18}{:>7}{figures:>10}{missed:>10}{seconds:>10.2}\n", engine.name(), own.len());
    }
    out
}
