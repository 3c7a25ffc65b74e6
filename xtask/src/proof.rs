//! Proof beyond tests, each a verb that no test command runs: properties (`prove`), mutants, Miri. Their results are kept in
//! docs/proof.md.

use crate::run::{Program, program, root};
use anyhow::{Context, Result, bail, ensure};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The page of results.
const PAGE: &str = "docs/proof.md";

/// Puts a table between the markers of that name.
pub(crate) fn write_between(name: &str, text: &str) -> Result<()> {
    crate::write_between(PAGE, name, text)
}

/// Adds a row to the table between the markers of that name.
pub(crate) fn add_row(name: &str, row: &str) -> Result<()> {
    let page = std::fs::read_to_string(root().join(PAGE))?;
    let begin = format!("<!-- {name}:begin -->");
    let rest = page.split_once(&begin).map(|(_, rest)| rest);
    let table = rest.and_then(|rest| rest.split_once(&format!("<!-- {name}:end -->")));
    let (table, _) = table.with_context(|| format!("{PAGE} has lost the markers of {name}"))?;
    write_between(name, format!("{}\n{row}", table.trim()).trim_start())
}

/// Installs a command of cargo where it is missing.
pub(crate) fn install(tool: &str, version: &str) -> Result<()> {
    if !program("cargo").args([tool, "--version"]).silently().is_ok_and(|(ok, _)| ok) {
        let package = format!("cargo-{tool}");
        program("cargo").args(["install", &package, "--locked", "--version", version]).run()?;
    }
    Ok(())
}

/// The crate of the properties, a workspace of its own: it has a target and flags of its own.
fn proofs() -> PathBuf {
    root().join("proofs")
}

/// Proves each property, and sees its control fail; rewrites the table. With names, only those, and no table.
pub(crate) fn prove(only: &[String]) -> Result<()> {
    let chosen = |name: &str| only.is_empty() || only.iter().any(|o| o == name);
    let source = std::fs::read_to_string(proofs().join("src/lib.rs"))?;
    let checker = Checker::new()?;
    let mut rows = Vec::new();
    for line in source.lines() {
        let Some((name, _)) = line.strip_prefix("extern \"C\" fn prove_").and_then(|l| l.split_once('('))
        else {
            continue;
        };
        if !chosen(name) {
            continue;
        }
        let begun = Instant::now();
        ensure!(checker.holds(&format!("prove_{name}"))?, "{name} does not hold");
        let seconds = begun.elapsed().as_secs();
        ensure!(!checker.holds(&format!("refute_{name}"))?, "the control of {name} holds: it has not looked");
        println!("{name}: holds, {seconds} s; its control fails");
        rows.push(format!("| {} | model checker | all bits | {seconds} s |", doc(&source, line)?));
    }
    let source = std::fs::read_to_string(proofs().join("src/bin/exhaustive.rs"))?;
    let build = ["build", "--release", "--locked", "--bin", "exhaustive"];
    program("cargo").args(build).within(&proofs()).run()?;
    let mut tried = |line: &str| {
        if let [name, values, seconds, control] = line.split('\t').collect::<Vec<_>>()[..]
            && control.starts_with("red")
            && values.parse::<u64>().is_ok()
        {
            let text = doc(&source, &format!("fn {name}(bold: bool)")).unwrap_or_default();
            rows.push(format!("| {text} | every value | {} | {seconds} s |", grouped(values)));
        }
    };
    if only.is_empty() || only.iter().any(|o| source.contains(&format!("(\"{o}\", "))) {
        let held =
            program(proofs().join("target/release/exhaustive")).args(only).lines(|line| tried(line))?;
        ensure!(held, "a property does not hold, or its control is not red: see above");
    }
    if only.is_empty() {
        let head = "| property | by | values | time |\n|---|---|---|---|";
        write_between("prove", &format!("{head}\n{}", rows.join("\n")))?;
    }
    Ok(())
}

/// The text above an item.
fn doc(source: &str, item: &str) -> Result<String> {
    let above = source.split(item).next().with_context(|| format!("no {item}"))?;
    let lines =
        above.lines().rev().skip_while(|l| l.is_empty() || l.starts_with("#[") || l.starts_with("extern"));
    let mut text: Vec<&str> = lines.map_while(|l| l.strip_prefix("/// ")).collect();
    text.reverse();
    ensure!(!text.is_empty(), "{item} has no text");
    Ok(text.join(" "))
}

/// Digits in threes.
pub(crate) fn grouped(digits: &str) -> String {
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// CBMC, and the harnesses as C.
struct Checker {
    cbmc: Vec<PathBuf>,
    folder: PathBuf,
}

impl Checker {
    /// Translates the harnesses: Rust → WebAssembly → C.
    fn new() -> Result<Checker> {
        let has = |name: &str| program(name).arg("--version").silently().is_ok_and(|(ok, _)| ok);
        if !has("wasm2c") {
            bail!("wasm2c is missing: apt-get install wabt");
        }
        let folder = proofs().join("target/c");
        std::fs::create_dir_all(&folder)?;
        let cbmc = if has("cbmc") { vec!["cbmc".into()] } else { debian_cbmc()? };
        let target = "wasm32-unknown-unknown";
        program("rustup").args(["target", "add", target]).run()?;
        program("cargo")
            .args(["build", "--release", "--locked", "--lib", "--target", target])
            .within(&proofs())
            .env("RUSTFLAGS", "-C target-cpu=mvp -C link-arg=-zstack-size=4096")
            .run()?;
        let wasm = proofs().join("target").join(target).join("release/clutch_proofs.wasm");
        let c = folder.join("proofs.c");
        program("wasm2c").args(["-n", "proofs"]).arg(wasm).arg("-o").arg(c).run()?;
        Ok(Checker { cbmc, folder })
    }

    /// True if no claim of a harness can fail.
    fn holds(&self, harness: &str) -> Result<bool> {
        let [first, rest @ ..] = &self.cbmc[..] else { bail!("no cbmc") };
        let flags = [
            "-DWASM_RT_MEMCHECK_SIGNAL_HANDLER=0", // each access is checked against the memory's size
            "-DWASM_RT_USE_STACK_DEPTH_COUNT=0",   // loops and calls have bounds of their own
            "-D__builtin_memcpy=memcpy",           // CBMC takes what a builtin loads for any value
            "--no-standard-checks",                // C's: the traps of WebAssembly are what counts
            "--unwinding-assertions",              // a loop that is longer fails
            "--unwind",
            "160",
            "--object-bits",
            "16",
            "--slice-formula",
        ];
        let (_, text) = program(first)
            .args(rest)
            .arg("-I")
            .arg(&self.folder)
            .arg(format!("-DHARNESS=Z_proofsZ_{harness}"))
            .args(flags)
            .arg(proofs().join("model.c"))
            .silently()?;
        let found = text.lines().filter(|l| l.ends_with(": FAILURE")).collect::<Vec<_>>();
        if text.contains("VERIFICATION SUCCESSFUL") {
            return Ok(true);
        }
        // Nothing but a claim may fail.
        ensure!(found.iter().all(|l| l.contains(" no trap:")) && !found.is_empty(), "{harness}:\n{text}");
        Ok(false)
    }
}

/// CBMC of Debian 13 in a folder of its own, with the libraries that it was built for; nothing is installed.
fn debian_cbmc() -> Result<Vec<PathBuf>> {
    let folder = root().join("target/cbmc");
    let files = folder.join("files");
    if !files.join("usr/bin/cbmc").exists() {
        for part in ["lists/partial", "cache/archives/partial", "files"] {
            std::fs::create_dir_all(folder.join(part))?;
        }
        // From where this machine has its own packages of Debian.
        let key = "/usr/share/keyrings/debian-archive-keyring.gpg";
        let filters = ["Origin: Debian", "Label: Debian", "Created-By: Packages"];
        let (_, sites) =
            program("apt-get").args(["indextargets", "--format", "$(REPO_URI)"]).args(filters).silently()?;
        let site = sites
            .lines()
            .find(|l| l.contains("://"))
            .context("apt knows no mirror of Debian: run apt-get update")?;
        let source = format!("deb [signed-by={key}] {} trixie main\n", site.trim());
        std::fs::write(folder.join("sources.list"), source)?;
        let apt = || -> Program {
            let set = |name: &str, value: &Path| format!("{name}={}", value.display());
            let options = [
                set("Dir::State::Lists", &folder.join("lists")),
                set("Dir::State::Status", Path::new("/dev/null")),
                set("Dir::Cache", &folder.join("cache")),
                set("Dir::Etc::SourceList", &folder.join("sources.list")),
                set("Dir::Etc::SourceParts", Path::new("-")),
            ];
            program("apt-get").args(options.iter().flat_map(|o| ["-o", o])).within(&folder)
        };
        apt().arg("update").run()?;
        apt().args(["download", "cbmc", "minisat", "libc6", "libstdc++6", "libgcc-s1", "zlib1g"]).run()?;
        for entry in std::fs::read_dir(&folder)? {
            let path = entry?.path();
            if path.extension().is_some_and(|e| e == "deb") {
                program("dpkg").arg("-x").arg(path).arg(&files).run()?;
            }
        }
    }
    let usr = files.join("usr");
    let libraries = [usr.join("lib/x86_64-linux-gnu"), usr.join("lib")].map(|p| p.display().to_string());
    Ok(vec![
        usr.join("lib64/ld-linux-x86-64.so.2"),
        "--library-path".into(),
        libraries.join(":").into(),
        usr.join("bin/cbmc"),
    ])
}
