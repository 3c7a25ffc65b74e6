//! The verdict on a statement.

use super::Statement;
use super::runs::Runs;
use serde::Serialize;

/// One statement of the paper and what comes out here.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// Short name, stable from version to version.
    pub id: &'static str,
    /// The paper's statement, with its value.
    pub paper: &'static str,
    /// The value that came out.
    pub measured: f64,
    /// Unit of `measured` and `band`.
    pub unit: &'static str,
    /// Interval in which `measured` counts as agreeing with the statement; none = unbounded.
    pub band: [Option<f64>; 2],
    /// True if the statement holds.
    pub holds: bool,
    /// Interval in which `measured` lies where the statement is known not to hold; the docs say
    /// why. None = the statement is expected to hold.
    pub deviation: Option<[f64; 2]>,
    /// True if the rig `bench` was fitted to this statement.
    pub fitted: bool,
    /// The way it was measured; the reason, if it does not hold.
    pub note: &'static str,
}

impl Claim {
    pub(super) fn of(statement: &Statement, runs: &Runs) -> Claim {
        let measured = statement.measured.of(runs);
        let band = statement.agrees.band();
        Claim {
            id: statement.id,
            paper: statement.says,
            measured,
            unit: statement.measured.unit(),
            band,
            holds: band[0].is_none_or(|low| measured >= low) && band[1].is_none_or(|high| measured <= high),
            deviation: statement.deviation,
            fitted: statement.fitted,
            note: statement.note,
        }
    }

    /// The statement holds, or it fails just as documented.
    #[must_use]
    pub fn as_expected(&self) -> bool {
        match self.deviation {
            None => self.holds,
            Some([low, high]) => !self.holds && self.measured >= low && self.measured <= high,
        }
    }
}
