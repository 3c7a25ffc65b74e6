//! Command and wheel for other systems: checked, neither linked nor run.

use crate::run::{cargo, program, root};
use anyhow::{Context, Result};

const TARGETS: [&str; 2] = ["aarch64-apple-darwin", "x86_64-pc-windows-gnu"];

/// A compiler for C that compiles nothing: what it would compile is linked nowhere.
const NO_COMPILER: &str =
    "#!/bin/sh\nwhile [ $# -gt 0 ]; do [ \"$1\" = -o ] && : > \"$2\"; shift; done\nexit 0\n";

pub(crate) fn check() -> Result<()> {
    program("rustup").args(["target", "add"]).args(TARGETS).run().context("rustup cannot add the targets")?;
    let folder = root().join("target/elsewhere");
    std::fs::create_dir_all(&folder)?;
    let compiler = folder.join("cc");
    std::fs::write(&compiler, NO_COMPILER)?;
    program("chmod").arg("+x").arg(&compiler).run()?;
    for target in TARGETS {
        // The command as a release has it.
        let options = ["--features", "clutch-cli/foxglove,clutch-cli/parquet,clutch-cli/scope"];
        let check = cargo([
            "check",
            "--locked",
            "--package",
            "clutch-cli",
            "--package",
            "clutch-py",
            "--target",
            target,
        ]);
        let check = check.args(options);
        let key = |tool: &str| format!("{tool}_{}", target.replace('-', "_"));
        let check = check.arg("--target-dir").arg(&folder).env("RUSTFLAGS", "-D warnings");
        check.env(&key("CC"), &compiler).env(&key("AR"), "true").run()?;
    }
    Ok(())
}
