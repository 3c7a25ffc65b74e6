//! The simulator as a page for browsers: one file, target/playground/stick-slip.html.

use crate::run::{cargo, program, root};
use anyhow::{Result, bail};
use std::path::{Path, PathBuf};

/// The target of the page's module.
const TARGET: &str = "wasm32-unknown-unknown";

/// The page's file.
pub(crate) const PAGE: &str = "stick-slip.html";

/// The page, and the module that is within it.
pub(crate) struct Playground {
    pub(crate) page: PathBuf,
    pub(crate) module: PathBuf,
}

/// Builds the module, and the page with an example that is built already. None without rustup on a user's machine.
pub(crate) fn build() -> Result<Option<Playground>> {
    let Some(module) = module()? else { return Ok(None) };
    let out = root().join("target/playground");
    std::fs::create_dir_all(&out)?;
    let page = out.join(PAGE);
    program(root().join("target/debug/examples/page")).arg(&module).arg(&page).run()?;
    Ok(Some(Playground { page, module }))
}

/// Adds the module's target, and builds the module. None without rustup on a user's machine.
pub(crate) fn module() -> Result<Option<PathBuf>> {
    match program("rustup").args(["target", "add", TARGET]).quietly() {
        Ok((true, _)) => {}
        other if std::env::var_os("CI").is_none() => {
            let why = other.map_or_else(|e| e.to_string(), |(_, text)| text);
            println!("skipped: the playground, because rustup cannot add {TARGET}: {}", why.trim());
            return Ok(None);
        }
        other => bail!("rustup cannot add the target {TARGET}: {other:?}"),
    }
    // In a folder of its own, or it would wait for other builds. The page has only texts that it shows.
    let folder = root().join("target/web");
    let packages = ["--package", "clutch-web", "--package", "clutch-core", "--features", "clutch-core/terse"];
    let build = cargo(["build", "--lib", "--locked", "--profile", "web", "--target", TARGET]).args(packages);
    build.args(["--target-dir"]).arg(&folder).run()?;
    Ok(Some(folder.join(TARGET).join("web/clutch_web.wasm")))
}

/// Sizes of page and module, also as a server sends them, if there is a Node to measure them.
pub(crate) fn sizes(built: &Playground) -> Result<()> {
    for file in [&built.module, &built.page] {
        let raw = std::fs::metadata(file)?.len();
        let brotli = match compressed(file) {
            Ok(bytes) => format!("{bytes} bytes"),
            Err(why) => format!("unknown: {why:#}"),
        };
        println!("{}: {raw} bytes; compressed (brotli): {brotli}", file.display());
    }
    Ok(())
}

/// Size of a file as a server sends it, compressed by Node.
pub(crate) fn compressed(file: &Path) -> Result<u64> {
    const COMPRESSED: &str =
        "console.log(require('zlib').brotliCompressSync(require('fs').readFileSync(process.argv[1])).length)";
    let told = program("node").args(["-e", COMPRESSED]).arg(file).output()?;
    Ok(String::from_utf8_lossy(&told).trim().parse()?)
}
