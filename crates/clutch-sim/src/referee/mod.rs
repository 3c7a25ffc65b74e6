//! The referee: cases whose answer is known from elsewhere, and what engines make of them.
//!
//! ```text
//! case file ──► Case ──► run(case, engine) ──► Trajectory ──► Case::judge ──► Verdict (measured, expected, within)
//!                 └────► an engine of another make ──► Trajectory ──┘
//! ```
//!
//! A case is a file of `cases/`: a linear mechanism with rows of friction (or a built-in scenario with changes), what is
//! observed, the value expected, how near it has to be, and the source of the value. A new case is a new file. Engines know
//! nothing of what is observed, and all are judged from their trajectories alone, by the same code.

mod case;
mod engines;
mod judge;
mod mechanism;
mod model;
mod observe;
mod signal;
mod trajectory;

pub use case::{Case, CaseError, Expect};
pub use engines::{ENGINES, RefereeEngine, RefereeError, run};
pub use judge::Verdict;
pub use mechanism::{Mechanism, Row};
pub use model::{CaseModel, ScenarioCase};
pub use observe::Observe;
pub use signal::{Signal, Term};
pub use trajectory::{Trajectory, TrajectoryEvent};

macro_rules! built_in {
    ($($name:literal),* $(,)?) => {
        /// The built-in cases: name and file.
        pub const BUILT_IN: &[(&str, &str)] =
            &[$(($name, include_str!(concat!("../../cases/", $name, ".toml")))),*];
    };
}
built_in!(
    "A1",
    "A1_dry",
    "A1_hold",
    "A1_let_go",
    "A1_slide",
    "A2",
    "A2_dry",
    "A3_pd",
    "A3_smc",
    "A3_pd_fast",
    "A3_smc_fast",
    "A4",
    "A4_near",
    "C1",
    "A5",
    "A7",
    "A8",
    "A9",
    "L1",
    "L2",
    "L4",
    "L5_1",
    "L5_2",
    "L5_3",
    "L5_4",
    "L6_1",
    "L6_2",
    "L6_3",
    "X1",
    "X2",
    "X2_over",
    "R1",
    "R1_nearer",
    "R1_damped",
    "R1_nearer_damped",
    "R2",
    "R3",
    "D2_lugre",
    "D2_elasto_plastic",
    "D2_coulomb",
    "P3",
    "G1",
    "G2",
);
