//! `cargo xtask rehearse`: adds one fact of each kind in a copy of the last commit, as its developer would, and holds the
//! copy against the tests: what has to be touched, by doing it.

use crate::copy;
use crate::product::is_product;
use crate::python;
use crate::run::{cargo, program, root};
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};

/// An addition: its kind, what is added, and the patch in xtask/rehearsal.
struct Addition {
    kind: &'static str,
    of: &'static str,
    patch: &'static str,
}

const ADDITIONS: &[Addition] = &[
    Addition { kind: "a law's parameter", of: "a bias of PD", patch: "parameter" },
    Addition { kind: "a law", of: "PD with a dead band", patch: "law" },
    Addition { kind: "a law with memory and five terms", of: "a lead compensator", patch: "law_with_memory" },
    Addition { kind: "a friction model", of: "one that falls linearly", patch: "friction" },
    Addition { kind: "a field of the log", of: "samples of another run", patch: "log_field" },
    Addition { kind: "a metric", of: "mean of the error's magnitude", patch: "metric" },
];

/// Lists that tests have of their own: runs of each law for the comparison of bits, a hash, a record of a test.
const TESTS: &str = "tests";

/// Tests of pages that show the output of commands, or the bits of all runs: a person puts a new figure there.
const OF_PAGES: [&str; 4] = ["--skip", "that_the_docs_show", "--skip", "of_the_page"];

/// Fails if the patches no longer fit the tree as it is.
pub(crate) fn check() -> Result<()> {
    let names = ADDITIONS.iter().map(|addition| addition.patch).chain([TESTS]);
    let patches = names.map(|name| std::fs::read_to_string(patch(name)));
    // As one: a later patch may touch what an earlier one has.
    let all = root().join("target/rehearsal.patch");
    std::fs::write(&all, patches.collect::<std::io::Result<String>>()?)?;
    let git = program("git").within(&root()).args(["apply", "--check", "--whitespace=nowarn"]).arg(&all);
    git.run().context("a patch of xtask/rehearsal does not fit any more: make it anew")
}

fn patch(name: &str) -> PathBuf {
    root().join("xtask/rehearsal").join(format!("{name}.patch"))
}

pub(crate) fn run() -> Result<()> {
    let tree = root().join("target/rehearsal/tree");
    copy::last_commit(&tree)?;
    let mut table = vec!["| what is added | as | files of the product | lines of others |".to_owned()];
    table.push("|---|---|---|---|".to_owned());
    for addition in ADDITIONS {
        let touched = apply(&tree, addition.patch)?;
        let (own, others) = split(&touched);
        table.push(format!("| {} | {} | {own} | {others} |", addition.kind, addition.of));
    }
    apply(&tree, TESTS)?;
    cargo(["xtask", "generate"]).within(&tree).run()?;
    // More laws have more bits.
    let bits =
        ["test", "--package", "clutch-core", "--features", "linalg", "--test", "bits", "--test", "plans"];
    cargo(bits).env("CLUTCH_BITS", "write").within(&tree).run()?;
    cargo(["test", "--workspace", "--tests", "--no-fail-fast", "--"]).args(OF_PAGES).within(&tree).run()?;
    used(&tree)?;
    println!("\n{}", table.join("\n"));
    Ok(())
}

/// A file of the product that a patch touches.
#[derive(Debug)]
struct Touched {
    path: String,
    /// Lines that it adds there; as `touch` counts, neither comments nor empty ones.
    lines: usize,
    /// True if it makes the file.
    new: bool,
}

/// Applies a patch; the files that it touches.
fn apply(tree: &Path, name: &str) -> Result<Vec<Touched>> {
    let patch = patch(name);
    let text = std::fs::read_to_string(&patch).with_context(|| patch.display().to_string())?;
    // Not one of this repository: git would look for the paths in its root.
    let git = program("git").within(tree).env("GIT_CEILING_DIRECTORIES", root().join("target"));
    git.args(["apply", "--whitespace=nowarn"]).arg(&patch).run().with_context(|| {
        format!("{} does not fit the last commit any more: make it anew", patch.display())
    })?;
    Ok(touched(&text))
}

fn touched(patch: &str) -> Vec<Touched> {
    let mut files: Vec<Touched> = Vec::new();
    for line in patch.lines() {
        if let Some((path, _)) = line.strip_prefix("diff --git a/").and_then(|paths| paths.split_once(" b/"))
        {
            files.push(Touched { path: path.to_owned(), lines: 0, new: false });
        }
        let Some(file) = files.last_mut() else { continue };
        file.new |= line.starts_with("new file mode");
        if let Some(added) = line.strip_prefix('+').map(str::trim).filter(|_| !line.starts_with("+++ ")) {
            file.lines += usize::from(!added.is_empty() && !added.starts_with("//"));
        }
    }
    files.retain(|file| is_product(&file.path));
    files
}

/// The file that the fact is in, and the lines that it takes elsewhere.
fn split(files: &[Touched]) -> (String, String) {
    let own = files.iter().find(|file| file.new).or_else(|| files.iter().max_by_key(|file| file.lines));
    let Some(own) = own else { return ("none".to_owned(), "none".to_owned()) };
    let others = files.iter().filter(|file| file.path != own.path);
    let others: Vec<String> = others.map(|file| format!("{} in {}", file.lines, file.path)).collect();
    let new = if own.new { ", new" } else { "" };
    let others = if others.is_empty() { "none".to_owned() } else { others.join(", ") };
    (format!("{}{new}, {} lines", own.path, own.lines), others)
}

/// The additions in use: by the command, in a log and its replay, from Python.
fn used(tree: &Path) -> Result<()> {
    let folder = tree.join("target/rehearsal");
    std::fs::create_dir_all(&folder)?;
    let scenario = root().join("xtask/rehearsal/use.toml");
    cargo(["build", "--bin", "clutch"]).within(tree).run()?;
    let clutch = |args: &[&str]| program(tree.join("target/debug/clutch")).args(args).within(&folder);
    for law in ["lead", "banded"] {
        let log = folder.join(format!("{law}.mcap"));
        drop(std::fs::remove_file(&log));
        let set = format!("law.{law}={{}}");
        let said = clutch(&["sim"]).arg(&scenario).args(["--set", &set]).output()?;
        let said = String::from_utf8(said)?;
        ensure!(said.contains("mean |error|"), "the metric is missing:\n{said}");
        let looped = clutch(&["loop"]).arg(&scenario).args(["--set", &set, "--uncertified", "--log"]);
        looped.arg(&log).run()?;
        clutch(&["replay"]).arg(&log).run()?;
    }
    let python = interpreter(tree)?;
    program(python).arg(root().join("xtask/rehearsal/use.py")).arg(folder.join("lead.mcap")).run()
}

/// A Python with the copy's package.
fn interpreter(tree: &Path) -> Result<PathBuf> {
    let tools = python::interpreter()?;
    let packages = tree.join("target/rehearsal/python");
    drop(std::fs::remove_dir_all(&packages));
    python::make_environment(&tools, &packages, &[])?;
    let python = packages.join("bin/python");
    program(&python)
        .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"])
        .arg(tree)
        .run()?;
    Ok(python)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_patch_names_files_and_the_one_that_it_makes() {
        for addition in ADDITIONS {
            let patch = root().join("xtask/rehearsal").join(format!("{}.patch", addition.patch));
            let files = touched(&std::fs::read_to_string(patch).unwrap());
            assert!((1..=2).contains(&files.len()), "{}: {files:?}", addition.kind);
        }
    }
}
