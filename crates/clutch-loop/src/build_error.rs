//! Reasons why a run cannot be set up.

use clutch_core::ParamError;
use clutch_settings::Unsupported;
use clutch_sim::ScenarioError;

/// A run could not be set up.
#[derive(Clone, Debug, thiserror::Error)]
pub enum BuildError {
    /// The scenario.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A parameter.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// A board cannot close such a loop.
    #[error("{0}")]
    Unsupported(#[from] Unsupported),
    /// A board that closes the loop calculates in single precision.
    #[error("sampling.scalar = \"f64\": expected \"f32\", the scalar of a board that closes the loop itself")]
    Scalar,
    /// A board that closes the loop has no room for a map of the disc.
    #[error(
        "friction_map: a board that closes the loop itself takes none: leave out [friction_map], or close the loop on this machine"
    )]
    Map,
}
