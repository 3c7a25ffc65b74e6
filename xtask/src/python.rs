//! A private Python environment for the tests.

use crate::run::{program, root};
use anyhow::{Context, Result, bail};
use std::path::PathBuf;

/// The environment's interpreter, made and filled if need be.
pub(crate) fn interpreter() -> Result<PathBuf> {
    let venv = root().join(".venv");
    let python = venv.join("bin/python");
    if !python.exists() {
        let make = || program("python3").args(["-m", "venv"]).arg(&venv).quietly();
        let (made, text) = make().context("the tests need Python 3.11 or later as `python3`")?;
        if !made {
            // Debian keeps ensurepip in a package of its own.
            install_debian("python3-venv").with_context(|| format!("python3 -m venv failed:\n{text}"))?;
            let (made, text) = make()?;
            if !made {
                bail!("python3 -m venv failed:\n{text}");
            }
        }
    }
    let requirements = "python/tests/requirements.txt";
    program(&python)
        .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r", requirements])
        .run()?;
    Ok(python)
}

/// Installs a package of Debian, as root.
pub(crate) fn install_debian(package: &str) -> Result<()> {
    let (root, id) = program("id").arg("-u").quietly()?;
    if !root || id.trim() != "0" {
        bail!("please install {package} (Debian and Ubuntu: sudo apt-get install {package})");
    }
    program("apt-get").args(["update", "-q"]).run()?;
    program("apt-get").env("DEBIAN_FRONTEND", "noninteractive").args(["install", "-y", "-q", package]).run()
}
