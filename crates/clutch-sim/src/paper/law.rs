//! The laws of the paper.

use clutch_core::law::{CtcParams, LawParams, PdParams, SmcParams};

/// The three laws of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PaperLaw {
    /// (4)
    Pd,
    /// (11)
    Ctc,
    /// (31)
    Smc,
}

impl PaperLaw {
    /// With the gains of Table 2.
    #[must_use]
    pub fn params(self) -> LawParams {
        match self {
            PaperLaw::Pd => LawParams::Pd(PdParams::default()),
            PaperLaw::Ctc => LawParams::Ctc(CtcParams::default()),
            PaperLaw::Smc => LawParams::Smc(SmcParams::default()),
        }
    }

    /// As the paper calls it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            PaperLaw::Pd => "PD controller",
            PaperLaw::Ctc => "computed-torque controller",
            PaperLaw::Smc => "sliding-mode controller",
        }
    }
}
