//! Rows of the tables of campaigns: errors and intervals of a parameter.

use clutch_identify::Estimate;

/// The form in which an error is told.
#[derive(Clone, Copy)]
pub(crate) enum As {
    Percent,
    Factor,
    Times(f64, &'static str),
}

impl As {
    pub(crate) fn error(self, found: f64, truth: f64) -> f64 {
        match self {
            As::Percent => 100.0 * (found / truth - 1.0).abs(),
            As::Factor => (found / truth).max(truth / found),
            As::Times(by, _) => by * (found - truth).abs(),
        }
    }

    fn shown(self, error: f64) -> String {
        match self {
            _ if error.is_nan() => "–".to_owned(),
            As::Percent => format!("{error:.2} %"),
            As::Factor => format!("× {error:.2}"),
            As::Times(_, unit) => format!("{error:.3} {unit}").trim_end().to_owned(),
        }
    }

    /// A value, the truth, the error and the interval.
    pub(crate) fn detail(self, e: &Estimate, truth: f64) -> String {
        let missed = if e.holds(truth) { "" } else { " MISSED" };
        let error = self.shown(self.error(e.value, truth));
        format!("{:.6} for {truth:.6}, {error}{missed} [{:.6}, {:.6}]", e.value, e.low, e.high)
    }
}

fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(at.saturating_sub(1).min(sorted.len().saturating_sub(1))).copied().unwrap_or(f64::NAN)
}

/// The head of a table.
pub(crate) fn print_head() {
    println!(
        "| parameter | found | error, median | p90 | largest | interval holds it | half width of the interval, median |"
    );
    println!("|---|---|---|---|---|---|---|");
}

/// A row: the estimates that were told, with the truth, of so many rigs.
pub(crate) fn print_row(name: &str, how: As, known: &[(Estimate, f64)], of: usize) {
    let sorted = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values
    };
    let errors = sorted(known.iter().map(|(e, truth)| how.error(e.value, *truth)).collect());
    // The half of a factor is the larger end over the value.
    let half = |e: &Estimate| match how {
        As::Factor => e.high / e.value,
        As::Percent => 50.0 * (e.high - e.low) / e.value,
        As::Times(by, _) => 0.5 * by * (e.high - e.low),
    };
    let halves = sorted(known.iter().map(|(e, _)| half(e)).collect());
    let held = known.iter().filter(|(e, truth)| e.holds(*truth)).count();
    println!(
        "| {name} | {} of {} | {} | {} | {} | {held} of {} | {} |",
        known.len(),
        of,
        how.shown(quantile(&errors, 0.5)),
        how.shown(quantile(&errors, 0.9)),
        how.shown(quantile(&errors, 1.0)),
        known.len(),
        how.shown(quantile(&halves, 0.5)),
    );
}
