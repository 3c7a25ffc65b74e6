//! The paper's figures, its Table 3 and the claims of its section 4.

use serde::Serialize;

/// One statement of the paper and what comes out here.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// Short name, stable from version to version.
    pub id: &'static str,
    /// What the paper states, with its value.
    pub paper: &'static str,
    /// What came out.
    pub measured: f64,
    /// Unit of `measured` and `band`.
    pub unit: &'static str,
    /// Interval in which `measured` counts as agreeing with the statement; none = unbounded.
    pub band: [Option<f64>; 2],
    /// Whether the statement holds.
    pub holds: bool,
    /// Whether this statement is known not to hold and the docs say why.
    pub deviation: bool,
    /// How it was measured; why it does not hold, if it does not.
    pub note: String,
}
