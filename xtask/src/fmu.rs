//! Rig and law as FMI 3.0 co-simulation units.

use crate::run::{cargo, program, root};
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};

/// The standard's name of the system that this one is.
const SYSTEM: &str = if cfg!(target_arch = "aarch64") { "aarch64-linux" } else { "x86_64-linux" };

/// The units.
pub(crate) const UNITS: [&str; 2] = ["clutch_rig.fmu", "clutch_law.fmu"];

/// Builds both units and packs them around a scenario for this machine, in target/fmu; gives their folder.
pub(crate) fn pack(scenario: Option<&Path>) -> Result<PathBuf> {
    cargo(["build", "--release", "--package", "clutch-fmi", "--lib", "--example", "describe"]).run()?;
    of_built(scenario, "release")
}

/// Packs them of what is built already, in that folder of target.
pub(crate) fn of_built(scenario: Option<&Path>, folder: &str) -> Result<PathBuf> {
    let built = root().join("target").join(folder);
    let out = root().join("target/fmu");
    // There it is also where only what depends on it was asked for.
    let libraries = [(SYSTEM, built.join("deps/libclutch_fmi.so"))];
    packed(scenario, &built.join("examples/describe"), &libraries, &out)?;
    Ok(out)
}

/// Packs both units around a scenario, with the libraries for systems of these names.
pub(crate) fn packed(
    scenario: Option<&Path>,
    describe: &Path,
    libraries: &[(&str, PathBuf)],
    out: &Path,
) -> Result<()> {
    let text = match scenario {
        Some(file) => std::fs::read_to_string(file).with_context(|| file.display().to_string())?,
        None => std::fs::read_to_string(root().join("crates/clutch-sim/scenarios/smc_2.toml"))?,
    };
    for name in UNITS {
        let part = name.trim_start_matches("clutch_").trim_end_matches(".fmu");
        let (told, description) = program(describe).arg(part).silently()?;
        ensure!(told, "no description of {part}: {description}");
        let unit = out.join(part);
        // Nothing of an earlier one.
        let _ = std::fs::remove_dir_all(&unit);
        let resources = unit.join("resources");
        std::fs::create_dir_all(&resources)?;
        std::fs::write(unit.join("modelDescription.xml"), description)?;
        std::fs::write(resources.join("scenario.toml"), &text)?;
        for (system, library) in libraries {
            let binaries = unit.join("binaries").join(system);
            std::fs::create_dir_all(&binaries)?;
            let name = library.file_name().context("a library's file")?.to_string_lossy();
            // Named after the model.
            std::fs::copy(library, binaries.join(name.trim_start_matches("lib")))
                .with_context(|| library.display().to_string())?;
        }
        let archive = out.join(name);
        let zip = program("python3").within(&unit).args(["-m", "zipfile", "-c"]).arg(&archive);
        let (zipped, why) = zip.args(["modelDescription.xml", "binaries", "resources"]).silently()?;
        ensure!(zipped, "{}: {why}", archive.display());
        println!("{}", archive.display());
    }
    Ok(())
}
