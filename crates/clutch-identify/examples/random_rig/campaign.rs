//! A campaign of identification: random rigs from a seed on, and the table of what was found.

use crate::random_rig::asked::Asked;
use crate::random_rig::{Outcome, Set};
use crate::rows::{As, print_head, print_row};
use clutch_identify::{Estimate, Finding};
use rayon::prelude::*;

/// A parameter: name, form of its error, finding and truth.
pub(crate) type Row<T, R> = (&'static str, As, fn(&R) -> &Finding, fn(&T) -> f64);

/// Rigs with a truth `T`, of which reports `R` are made.
pub(crate) struct Campaign<T: 'static, R: 'static> {
    pub(crate) rows: &'static [Row<T, R>],
    /// Time of one rig's experiment, s.
    pub(crate) seconds: f64,
    /// Experiment and report of the rig of a seed, with other values of some keys.
    pub(crate) run: fn(u64, &Set) -> Outcome<(T, R)>,
    /// Name of a rig, and parts of the experiment that its report found.
    pub(crate) found: fn(&T, &R) -> String,
    /// Ticks that a report does not explain.
    pub(crate) unexplained: fn(&R) -> &[String],
}

impl<T: Send, R: Send> Campaign<T, R> {
    /// Runs the rigs that the command line asks for, and prints their table. `detail` is for the findings of each, and `short` for
    /// one row of the intervals that hold.
    pub(crate) fn print(&self) -> Outcome<()> {
        let asked = Asked::of_the_line([200, 10_001], &["detail", "short"])?;
        let (rigs, first) = (asked.rigs, asked.first);
        let run = |seed| (self.run)(seed, &asked.set_of(seed)).map_err(|e| format!("rig {seed}: {e}"));
        let runs: Vec<Result<(T, R), String>> = (first..first + rigs).into_par_iter().map(run).collect();
        let (done, failed): (Vec<_>, Vec<_>) = runs.into_iter().partition(Result::is_ok);
        let done: Vec<(T, R)> = done.into_iter().flatten().collect();
        if asked.has("detail") {
            done.iter().for_each(|(truth, report)| self.detail(truth, report));
        }
        if asked.has("short") {
            self.print_held(&asked.other(), &done, rigs);
            return Ok(());
        }
        print_head();
        for (name, how, get, of) in self.rows {
            let known: Vec<(Estimate, f64)> =
                done.iter().filter_map(|(truth, report)| Some((get(report).known()?, of(truth)))).collect();
            print_row(name, *how, &known, done.len());
        }
        let flagged = done.iter().filter(|(_, report)| !(self.unexplained)(report).is_empty()).count();
        println!(
            "{rigs} rigs from seed {first}, {:.1} s of experiment each; {} experiments ended early; unexplained ticks on {flagged}",
            self.seconds,
            failed.len()
        );
        failed.iter().filter_map(|run| run.as_ref().err()).for_each(|line| println!("{line}"));
        Ok(())
    }

    /// One row: of the rigs whose experiment was done, intervals that hold, of those told.
    fn print_held(&self, other: &str, done: &[(T, R)], rigs: u64) {
        let names: Vec<&str> = self.rows.iter().map(|row| row.0).collect();
        println!("| | done | {} |\n|{}", names.join(" | "), "---|".repeat(names.len() + 2));
        let held = self.rows.iter().map(|(_, _, get, of)| {
            let known: Vec<_> =
                done.iter().filter_map(|(truth, report)| Some((get(report).known()?, of(truth)))).collect();
            format!("{} of {}", known.iter().filter(|(e, truth)| e.holds(*truth)).count(), known.len())
        });
        let held: Vec<String> = held.collect();
        println!("| {other} | {} of {rigs} | {} |", done.len(), held.join(" | "));
    }

    fn detail(&self, truth: &T, report: &R) {
        println!("{}", (self.found)(truth, report));
        for (name, how, get, of) in self.rows {
            match get(report) {
                Finding::Known(e) => println!("  {name}: {}", how.detail(e, of(truth))),
                Finding::Refused(why) => println!("  {name}: {why}"),
            }
        }
        (self.unexplained)(report).iter().for_each(|line| println!("  unexplained: {line}"));
    }
}
