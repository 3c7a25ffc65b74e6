//! The paper's figures 8 to 10, its Table 3, and each statement of its section 4 held against
//! what comes out here.
//!
//! "Simulation" runs on the rig `paper`, "experiment" on the rig `bench`, a stand-in that was
//! fitted to some of these statements: [`Claim::fitted`] says to which. Ten seeds each, 5 s of
//! which the first second does not count. [`STATEMENTS`] is the list of the statements: what it
//! and the figures and the table ask for is what runs.

mod claim;
mod figures;
mod law;
mod measure;
mod runs;
mod statements;
mod table3;

pub use claim::Claim;
pub use figures::{FigureData, PanelData};
pub use law::PaperLaw;
pub use measure::{Agrees, Kind, Measure};
pub use runs::{SEEDS, Source};
pub use statements::{Place, STATEMENTS, Statement};
pub use table3::{TABLE3, Table3Row, reduction};

use crate::pool;
use crate::progress::Report;
use crate::run::RunError;
use runs::Runs;

/// Everything that `clutch reproduce` shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Figures 8, 9, 10.
    pub figures: Vec<FigureData>,
    /// Table 3.
    pub table3: Vec<Table3Row>,
    /// Claims.
    pub claims: Vec<Claim>,
}

/// Runs everything, on all cores; `progress` gets each finished run.
///
/// # Errors
/// [`RunError::Stopped`]; no other with the built-in rigs.
pub fn reproduce(progress: Report<'_>) -> Result<Outcome, RunError> {
    let stated = STATEMENTS.iter().flat_map(|s| s.measured.cases());
    let cases = stated.chain(figures::cases()).chain(table3::cases()).collect();
    let runs = pool::install(|| Runs::all(&cases, progress))?;
    Ok(Outcome {
        figures: figures::of(&runs),
        table3: table3::of(&runs),
        claims: STATEMENTS.iter().map(|s| Claim::of(s, &runs)).collect(),
    })
}
