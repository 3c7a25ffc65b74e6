//! Mutants of the crates that run on a board, with cargo-mutants: docs/proof.md. `.cargo/mutants.toml` has its options.

use crate::copy;
use crate::proof::{add_row, install};
use crate::run::{program, root};
use anyhow::{Context, Result, ensure};
use std::path::Path;

/// Modules that a macro declares: cargo-mutants finds a file by its `mod` line.
const DECLARED_BY_MACROS: [&str; 2] = ["crates/clutch-core/src/law", "crates/clutch-core/src/friction"];

/// Tests the mutants of one shard of the last commit, in a tree of their own; adds a row to the table of shards.
pub(crate) fn run(shard: &str) -> Result<()> {
    install("mutants", "27.1.0")?;
    let (_, commit) = program("git").args(["rev-parse", "--short", "HEAD"]).silently()?;
    let tree = root().join("target/mutants/tree");
    copy::last_commit(&tree)?;
    for folder in DECLARED_BY_MACROS {
        declare(&tree.join(folder))?;
    }
    let out = root().join("target/mutants").join(shard.replace('/', "-of-"));
    // A mutant that is missed is no failure of this verb: the table reports it.
    let _ = program("nice")
        .args([
            "-n",
            "19",
            "cargo",
            "mutants",
            "--in-place",
            "--sharding",
            "round-robin",
            "--shard",
            shard,
            "-o",
        ])
        .arg(&out)
        .within(&tree)
        .env("PROPTEST_DISABLE_FAILURE_PERSISTENCE", "1")
        .lines(|_| ())?;
    let results = out.join("mutants.out");
    let count = |kind: &str| -> Result<usize> {
        let file = results.join(format!("{kind}.txt"));
        let text = std::fs::read_to_string(&file).with_context(|| file.display().to_string())?;
        Ok(text.lines().count())
    };
    let (caught, timeout, missed) = (count("caught")?, count("timeout")?, count("missed")?);
    let (killed, tested) = (caught + timeout, caught + timeout + missed);
    ensure!(tested > 0, "no mutant was tested: see {}", results.display());
    let share = 100.0 * killed as f64 / tested as f64;
    let row = format!("| {shard} of `{}` | {tested} | {killed} | {share:.1} % | {missed} |", commit.trim());
    println!("{row}\n\n{}", std::fs::read_to_string(results.join("missed.txt"))?);
    add_row("mutants", &row)
}

/// Lines that name the files of a folder to cargo-mutants, and that no compiler sees.
fn declare(folder: &Path) -> Result<()> {
    let list = folder.join("mod.rs");
    let mut text = std::fs::read_to_string(&list)?;
    let mut names: Vec<String> = std::fs::read_dir(folder)?
        .filter_map(|e| Some(e.ok()?.path().file_stem()?.to_str()?.to_string()))
        .filter(|name| !["mod", "tests"].contains(&name.as_str()))
        .collect();
    names.sort();
    for name in names {
        if !text.lines().any(|l| l == format!("mod {name};")) {
            text += &format!("#[cfg(any())]\nmod {name};\n");
        }
    }
    std::fs::write(&list, text)?;
    Ok(())
}
