//! The documentation as a site: its pages, the reference of Python, gallery and playground.

use crate::python::{self, Wheel};
use crate::run::root;
use crate::test;
use anyhow::{Context, Result};
use std::path::PathBuf;

/// Builds it in target/site, with the wheel, whose reference it has, and the playground; gives its folder.
pub(crate) fn build() -> Result<PathBuf> {
    // The configuration of the documentation takes the playground from where this leaves it.
    test::playground()?.context("the documentation has a playground, which could not be built")?;
    let tools = python::interpreter()?;
    let wheel = Wheel::install(&tools)?;
    let (site, trees) = (root().join("target/site"), root().join("target/site-trees"));
    let _ = std::fs::remove_dir_all(&site); // no page that is gone
    let sphinx = ["-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "-d"];
    wheel.program(&tools)?.args(sphinx).arg(trees).arg(root().join("docs")).arg(&site).run()?;
    Ok(site)
}
