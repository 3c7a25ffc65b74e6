//! Programs that Debian has in packages.

use crate::run::program;
use anyhow::{Result, bail};

/// Installs the packages of those programs that are not here.
pub(crate) fn need(programs: &[(&str, &'static str)]) -> Result<()> {
    let is_missing = |name: &str| program(name).args(["--version"]).silently().is_err();
    let missing: Vec<&str> =
        programs.iter().filter(|(name, _)| is_missing(name)).map(|(_, package)| *package).collect();
    if missing.is_empty() { Ok(()) } else { install(&missing) }
}

/// Installs packages, as root.
pub(crate) fn install(packages: &[&str]) -> Result<()> {
    let (root, id) = program("id").arg("-u").quietly()?;
    if !root || id.trim() != "0" {
        let names = packages.join(" ");
        bail!("please install {names} (Debian and Ubuntu: sudo apt-get install {names})");
    }
    program("apt-get").args(["update", "-q"]).run()?;
    program("apt-get")
        .env("DEBIAN_FRONTEND", "noninteractive")
        .args(["install", "-y", "-q"])
        .args(packages)
        .run()
}
