//! A campaign of identification: random rigs from a seed on, and the table of what was found.

use crate::random_rig::Outcome;
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
    /// Experiment and report of the rig of a seed.
    pub(crate) run: fn(u64) -> Outcome<(T, R)>,
    /// Name of a rig, and parts of the experiment that its report found.
    pub(crate) found: fn(&T, &R) -> String,
    /// Ticks that a report does not explain.
    pub(crate) unexplained: fn(&R) -> &[String],
}

impl<T: Send, R: Send> Campaign<T, R> {
    /// Runs as many rigs, from the seed on, as the command line asks for, and prints their table.
    pub(crate) fn print(&self) -> Outcome<()> {
        let mut args = std::env::args().skip(1);
        let mut number = |default: u64| args.next().map_or(Ok(default), |text| text.parse::<u64>());
        let (rigs, first) = (number(200)?, number(10_001)?);
        let detail = number(0)? > 0;
        let run = |seed| (self.run)(seed).map_err(|e| format!("rig {seed}: {e}"));
        let runs: Vec<Result<(T, R), String>> = (first..first + rigs).into_par_iter().map(run).collect();
        let (done, failed): (Vec<_>, Vec<_>) = runs.into_iter().partition(Result::is_ok);
        let done: Vec<(T, R)> = done.into_iter().flatten().collect();
        if detail {
            done.iter().for_each(|(truth, report)| self.detail(truth, report));
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
