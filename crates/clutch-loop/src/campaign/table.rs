//! The campaign's figures: what the runs of each kind of trouble came to. Two of them can be added, and one written down, so
//! that a campaign goes on where it was ended.

use super::grammar::Draw;
use super::oracle::{Fate, Promise};
use crate::virtual_time::VirtualReport;
use std::collections::BTreeMap;
use std::fmt;

/// Steps of a time in [`Row`], s.
const STEP: f64 = 5e-5;

/// The runs of one kind of trouble.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    runs: u64,
    /// In which control had to end.
    must: u64,
    /// In which it ended.
    ended: u64,
    /// Times from the trouble's first effect to the safe output, in steps, of those that ended.
    times: BTreeMap<u64, u64>,
    /// The farthest that a shaft came to rest beyond its path where a brake can help, µ°.
    beyond: u64,
}

/// The outcome of the runs of each kind.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    rows: BTreeMap<String, Row>,
}

impl Table {
    /// Takes a run in.
    pub fn add(&mut self, draw: &Draw, report: &VirtualReport) {
        let kind = match &draw.troubles[..] {
            [] => "nothing broken".to_owned(),
            [one] => one.kind(),
            _ => "two at once".to_owned(),
        };
        let row = self.rows.entry(kind).or_default();
        row.runs += 1;
        let promises: Vec<Promise> = draw.troubles.iter().map(|t| Promise::of(&draw.healthy, t)).collect();
        row.must += u64::from(promises.iter().any(|p| matches!(p.fate, Fate::Ends(_))));
        let Some(safe) = report.safe else { return };
        row.ended += 1;
        let first = draw.troubles.iter().map(|t| t.at).fold(f64::INFINITY, f64::min);
        let took = safe - report.hit.unwrap_or(first);
        if took.is_finite() {
            *row.times.entry((took.max(0.0) / STEP).round() as u64).or_default() += 1;
        }
        if promises.iter().all(|p| p.blind.is_some())
            && super::oracle::beyond_deg(&draw.healthy, 0.0).is_some()
        {
            row.beyond = row.beyond.max((report.overrun.to_degrees().max(0.0) * 1e6) as u64);
        }
    }

    /// Takes in what another has.
    pub fn merge(&mut self, other: &Table) {
        for (kind, theirs) in &other.rows {
            let row = self.rows.entry(kind.clone()).or_default();
            row.runs += theirs.runs;
            row.must += theirs.must;
            row.ended += theirs.ended;
            row.beyond = row.beyond.max(theirs.beyond);
            for (time, n) in &theirs.times {
                *row.times.entry(*time).or_default() += n;
            }
        }
    }

    /// Runs taken in.
    #[must_use]
    pub fn runs(&self) -> u64 {
        self.rows.values().map(|row| row.runs).sum()
    }

    /// Written down, a line for each kind.
    #[must_use]
    pub fn written(&self) -> String {
        let line = |(kind, r): (&String, &Row)| {
            let times: Vec<String> = r.times.iter().map(|(t, n)| format!("{t}:{n}")).collect();
            format!("{kind}\t{}\t{}\t{}\t{}\t{}\n", r.runs, r.must, r.ended, r.beyond, times.join(" "))
        };
        self.rows.iter().map(line).collect()
    }

    /// As it was written down; none if a line is none.
    #[must_use]
    pub fn read(text: &str) -> Option<Table> {
        let mut table = Table::default();
        for line in text.lines() {
            let mut fields = line.split('\t');
            let kind = fields.next()?.to_owned();
            let mut number = || fields.next()?.parse().ok();
            let (runs, must, ended, beyond) = (number()?, number()?, number()?, number()?);
            let pair = |pair: &str| {
                let (time, n) = pair.split_once(':')?;
                Some((time.parse().ok()?, n.parse().ok()?))
            };
            let times =
                fields.next()?.split(' ').filter(|p| !p.is_empty()).map(pair).collect::<Option<_>>()?;
            table.rows.insert(kind, Row { runs, must, ended, times, beyond });
        }
        Some(table)
    }
}

impl Row {
    /// The time that so large a share of the runs that ended took at most, ms.
    fn quantile(&self, share: f64) -> Option<f64> {
        let total: u64 = self.times.values().sum();
        let wanted = (share * total as f64).ceil().max(1.0) as u64;
        let mut so_far = 0;
        let reaches = |(time, n): (&u64, &u64)| {
            so_far += n;
            (so_far >= wanted).then_some(*time as f64 * STEP * 1e3)
        };
        self.times.iter().find_map(reaches)
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "| trouble | runs | must end | ended | after, ms: median | 99 % | most | beyond the path, most |"
        )?;
        writeln!(f, "|---|---|---|---|---|---|---|---|")?;
        for (kind, row) in &self.rows {
            let time = |share| row.quantile(share).map_or("–".to_owned(), |ms| format!("{ms:.2}"));
            let beyond =
                if row.beyond > 0 { format!("{:.3}°", row.beyond as f64 / 1e6) } else { "–".to_owned() };
            writeln!(
                f,
                "| {kind} | {} | {} | {} | {} | {} | {} | {beyond} |",
                row.runs,
                row.must,
                row.ended,
                time(0.5),
                time(0.99),
                time(1.0),
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_down_is_read_again_and_two_add_up() {
        let row = |runs, time: u64| Row { runs, must: 1, ended: 1, times: [(time, 1)].into(), beyond: time };
        let mut a =
            Table { rows: [("drop".to_owned(), row(3, 40)), ("freeze".to_owned(), row(1, 7))].into() };
        assert_eq!(Table::read(&a.written()), Some(a.clone()));
        assert_eq!(Table::read("drop\t3"), None);
        a.merge(&Table { rows: [("drop".to_owned(), row(2, 60))].into() });
        assert_eq!(a.runs(), 6);
        let shown = a.to_string();
        assert!(shown.contains("| drop | 5 | 2 | 2 | 2.00 | 3.00 | 3.00 | 0.000° |"), "{shown}");
    }
}
