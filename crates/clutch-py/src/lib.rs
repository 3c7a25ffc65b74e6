//! The native module `clutch._clutch`: wrappers around the Rust crates, without logic of its own.
//!
//! `python/clutch` is the public package; it exports parts of this module as `clutch.…`.

mod background;
mod convert;
mod log;
mod paper;
mod path;
mod referee;
mod run;
mod scenario;
#[cfg_attr(not(target_os = "linux"), path = "session_elsewhere.rs")]
mod session;
mod shafts;
mod stepping;
mod sweep;
mod table;
mod tune;

use pyo3::prelude::*;

/// Runs the `clutch` command with these arguments, the program's name first; gives its exit code. The package's images of
/// boards are in the folder `images`.
#[pyfunction]
#[pyo3(signature = (args, images))]
fn main(py: Python<'_>, args: Vec<std::ffi::OsString>, images: std::path::PathBuf) -> u8 {
    py.detach(|| clutch_cli::main_of_package(args, images))
}

/// The native half of the package `clutch`.
#[pymodule]
mod _clutch {
    #[pymodule_export]
    use super::log::{Log, read_log};
    #[pymodule_export]
    use super::main;
    #[pymodule_export]
    use super::paper::{Paper, reproduce};
    #[pymodule_export]
    use super::path::{Path, Target};
    #[pymodule_export]
    use super::referee::{RefereeCase, referee_cases};
    #[pymodule_export]
    use super::run::{Run, envelope, lowest_smooth_speed, simulate};
    #[pymodule_export]
    use super::scenario::{Scenario, brake_gain, check, friction_lab, rig, scenarios, steady_friction};
    #[pymodule_export]
    use super::session::run_loop;
    #[pymodule_export]
    use super::shafts::Shafts;
    #[pymodule_export]
    use super::stepping::{_plant, Plant, Servo, StickSlip, Tick};
    #[pymodule_export]
    use super::sweep::Sweep;
    #[pymodule_export]
    use super::table::Table;
    #[pymodule_export]
    use super::tune::{as_identified, identified_rows, identify, tune};
    /// Priority of the loop's control thread unless another is given.
    #[pymodule_export]
    const DEFAULT_PRIORITY: u8 = super::session::DEFAULT_PRIORITY;
    /// Longest way of a shaft in the release test unless another is given, °.
    #[pymodule_export]
    const RELEASE_DEG: f64 = super::session::RELEASE_DEG;
    /// Time before a sample at which spinning begins unless another is given, µs.
    #[pymodule_export]
    const SPIN_US: u32 = super::session::SPIN_US;
    /// Version of the package.
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
    /// Version and commit of the build, as logs record it.
    #[pymodule_export]
    const BUILD: &str = clutch_cli::BUILD;
}
