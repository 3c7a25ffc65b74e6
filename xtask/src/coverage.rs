//! Coverage of the crates that run on a board, by their own tests, with cargo-llvm-cov: docs/proof.md.

use crate::proof::{install, write_between};
use crate::run::{program, root};
use anyhow::{Context, Result, ensure};
use std::collections::HashMap;
use std::path::Path;

/// Crates that are counted, and the least shares of lines and of branches, percent.
const FLOORS: [(&str, f64, f64); 2] = [("clutch-core", 99.9, 98.0), ("clutch-wire", 100.0, 98.0)];

#[derive(Default)]
struct Count {
    lines: [u64; 2],
    branches: [u64; 2],
}

/// Measures it, rewrites the table, and fails below a floor.
pub(crate) fn run() -> Result<()> {
    install("llvm-cov", "0.9.1")?;
    let report = root().join("target/coverage.lcov");
    program("rustup")
        .args(["run", "nightly", "cargo", "llvm-cov", "--branch", "--lcov", "--output-path"])
        .arg(&report)
        .args(["--package", "clutch-core", "--package", "clutch-wire", "--package", "clutch-node"])
        .run()?;
    let text = std::fs::read_to_string(&report)?;
    let mut rows = Vec::new();
    let mut held = true;
    for (package, lines, branches) in FLOORS {
        let (count, missed) = counted(&text, package)?;
        for place in missed {
            println!("not covered: {place}");
        }
        let share = |[covered, all]: [u64; 2]| 100.0 * covered as f64 / all.max(1) as f64;
        held &= share(count.lines) >= lines && share(count.branches) >= branches;
        let told = |n: [u64; 2], floor: f64| format!("{} of {} ({:.1} %; ≥ {floor})", n[0], n[1], share(n));
        rows.push(format!(
            "| `{package}` | {} | {} |",
            told(count.lines, lines),
            told(count.branches, branches)
        ));
    }
    let table = format!("| crate | lines | branches |\n|---|---|---|\n{}", rows.join("\n"));
    println!("{table}");
    write_between("coverage", &table)?;
    ensure!(held, "coverage is below its floor: see above");
    Ok(())
}

/// The covered part of a package's code without its tests, and the places that are not.
fn counted(report: &str, package: &str) -> Result<(Count, Vec<String>)> {
    let (mut count, mut missed) = (Count::default(), Vec::new());
    let folder = root().join("crates").join(package).join("src");
    for record in report.split("end_of_record") {
        let Some(file) = record.lines().find_map(|l| l.strip_prefix("SF:")).map(Path::new) else { continue };
        if !file.starts_with(&folder) || file.ends_with("tests.rs") {
            continue;
        }
        let source = std::fs::read_to_string(file).with_context(|| file.display().to_string())?;
        let end = source.lines().position(|l| l == "#[cfg(test)]").unwrap_or(usize::MAX);
        let shown = file.strip_prefix(root()).unwrap_or(file).display().to_string();
        // A generic function is reported once for each type: a branch is taken if it is in one of them.
        let mut branches: HashMap<(usize, String), bool> = HashMap::new();
        for line in record.lines() {
            if let Some((number, taken)) = line.strip_prefix("DA:").and_then(|l| l.split_once(',')) {
                let (number, covered) = (number.parse::<usize>()?, taken != "0");
                if number <= end {
                    count.lines[0] += u64::from(covered);
                    count.lines[1] += 1;
                    if !covered {
                        missed.push(format!("{shown}:{number}"));
                    }
                }
            } else if let Some(branch) = line.strip_prefix("BRDA:") {
                let (place, taken) = branch.rsplit_once(',').context("a branch has a count")?;
                let (number, name) = place.split_once(',').context("a branch has a line")?;
                let number = number.parse::<usize>()?;
                if number <= end {
                    *branches.entry((number, name.to_string())).or_default() |= !matches!(taken, "0" | "-");
                }
            }
        }
        for ((number, name), taken) in branches {
            count.branches[0] += u64::from(taken);
            count.branches[1] += 1;
            if !taken {
                missed.push(format!("{shown}:{number}: branch {name}"));
            }
        }
    }
    missed.sort();
    Ok((count, missed))
}
