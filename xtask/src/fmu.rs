//! Rig and law as FMI 3.0 co-simulation units, in target/fmu.

use crate::python;
use crate::run::{cargo, program, root};
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};

/// The standard's name of the systems that these units are built for.
const SYSTEM: &str = if cfg!(target_arch = "aarch64") { "aarch64-linux" } else { "x86_64-linux" };

/// Packs both units around a scenario; gives their folder.
pub(crate) fn pack(scenario: Option<&Path>, optimised: bool) -> Result<PathBuf> {
    let (profile, folder) = if optimised { ("release", "release") } else { ("dev", "debug") };
    let library =
        cargo(["build", "--package", "clutch-fmi", "--lib", "--example", "describe", "--profile", profile]);
    library.run()?;
    let built = root().join("target").join(folder);
    let text = match scenario {
        Some(file) => std::fs::read_to_string(file).with_context(|| file.display().to_string())?,
        None => std::fs::read_to_string(root().join("crates/clutch-sim/scenarios/smc_2.toml"))?,
    };
    let out = root().join("target/fmu");
    for part in ["rig", "law"] {
        let (told, description) = program(built.join("examples/describe")).arg(part).silently()?;
        ensure!(told, "no description of {part}: {description}");
        let unit = out.join(part);
        // Nothing of an earlier one.
        let _ = std::fs::remove_dir_all(&unit);
        let (binaries, resources) = (unit.join("binaries").join(SYSTEM), unit.join("resources"));
        std::fs::create_dir_all(&binaries)?;
        std::fs::create_dir_all(&resources)?;
        std::fs::write(unit.join("modelDescription.xml"), description)?;
        std::fs::write(resources.join("scenario.toml"), &text)?;
        std::fs::copy(built.join("libclutch_fmi.so"), binaries.join("clutch_fmi.so"))?;
        let archive = out.join(format!("clutch_{part}.fmu"));
        let zip = program(python::interpreter()?).within(&unit).args(["-m", "zipfile", "-c"]).arg(&archive);
        let (zipped, why) = zip.args(["modelDescription.xml", "binaries", "resources"]).silently()?;
        ensure!(zipped, "{}: {why}", archive.display());
        println!("{}", archive.display());
    }
    Ok(out)
}
