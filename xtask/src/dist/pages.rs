//! The pages for a browser: playground and documentation.

use super::{Made, VERSION, folder, tar, work};
use crate::run::program;
use crate::{debian, playground, site, test};
use anyhow::{Context, Result, ensure};

/// The playground, as its tests find it.
pub(super) fn playground() -> Result<Made> {
    debian::need(&[("node", "nodejs"), ("chromium", "chromium")])?;
    let built = test::playground()?.context("the playground could not be built")?;
    test::of_playground(&built)?;
    let file = folder().join(format!("clutch-playground-{VERSION}.html"));
    std::fs::copy(&built.page, &file).with_context(|| built.page.display().to_string())?;
    let compressed = playground::compressed(&built.page)?;
    let checked = vec![
        "in Node and Chromium: the bits of the simulator on this machine, the figures of the command"
            .to_owned(),
        format!("{compressed} bytes as a server sends it (brotli)"),
    ];
    Ok(Made { file, checked })
}

/// The documentation with the playground in it.
pub(super) fn documentation() -> Result<Made> {
    let site = site::build()?;
    ensure!(site.join(playground::PAGE).is_file(), "the documentation lacks {}", playground::PAGE);
    let packed = work("docs")?.join(format!("clutch-docs-{VERSION}"));
    program("cp").arg("-r").arg(&site).arg(&packed).run()?;
    let file = tar(&packed, &format!("clutch-docs-{VERSION}.tar.gz"))?;
    Ok(Made { file, checked: vec!["built without a warning; the playground is in it".to_owned()] })
}
