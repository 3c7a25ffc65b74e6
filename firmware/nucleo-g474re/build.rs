//! The run that `nucleo-alone` has compiled in: the file that `CLUTCH_RUN` names (`cargo xtask firmware … --run`), or that of the tree.

use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-env-changed=CLUTCH_RUN");
    let named = env::var_os("CLUTCH_RUN").map(PathBuf::from);
    let run = named.unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("src/alone_run.rs"));
    let run = fs::canonicalize(&run).map_err(|why| format!("the run {}: {why}", run.display()))?;
    println!("cargo::rerun-if-changed={}", run.display());
    let module = format!("#[rustfmt::skip]\n#[path = {run:?}]\nmod alone_run;\n");
    fs::write(PathBuf::from(env::var("OUT_DIR")?).join("alone_run.rs"), module)?;
    Ok(())
}
