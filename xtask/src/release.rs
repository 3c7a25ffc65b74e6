//! Checks of what those who build on the packages rely on: that they are complete, that an old compiler will do, and
//! that their interfaces keep.

use crate::run::{cargo, program, root};
use anyhow::{Context, Result, ensure};
use std::fs;
use std::path::Path;

/// The crates whose manifest does not take the workspace's `publish = false`.
fn packages() -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(root().join("crates"))? {
        let folder = entry?.path();
        let manifest = read(&folder.join("Cargo.toml"))?;
        if !manifest.lines().any(|line| line == "publish.workspace = true") {
            // A package is named as its folder is.
            names.extend(folder.file_name().map(|name| name.to_string_lossy().into_owned()));
        }
    }
    names.sort();
    Ok(names)
}

/// The same as arguments of cargo.
fn selected() -> Result<Vec<String>> {
    Ok(packages()?.into_iter().flat_map(|name| ["--package".to_owned(), name]).collect())
}

fn read(path: &Path) -> Result<String> {
    fs::read_to_string(path).with_context(|| path.display().to_string())
}

/// Packs each library, and checks all of them as they were packed, with the workspace's oldest Rust: for [`msrv`] most
/// of their dependencies are compiled anyway.
pub(crate) fn package() -> Result<()> {
    let (packages, version) = (packages()?, env!("CARGO_PKG_VERSION"));
    let folder = root().join("target/packages");
    let unpacked = folder.join("unpacked");
    if unpacked.exists() {
        fs::remove_dir_all(&unpacked)?;
    }
    fs::create_dir_all(&unpacked)?;
    // Changes that are not committed are packed as they are: they shall be checked before. Cargo's own check is left
    // out: it takes a package that others need from where it unpacked it the last time, since its version is the same.
    let pack = ["package", "--locked", "--allow-dirty", "--no-verify", "--target-dir"];
    cargo(pack).arg(&folder).args(selected()?).run()?;
    let (mut members, mut patches) = (String::new(), String::new());
    for name in &packages {
        let member = format!("{name}-{version}");
        let packed = folder.join(format!("package/{member}.crate"));
        program("tar").arg("-xzf").arg(packed).arg("-C").arg(&unpacked).run()?;
        members += &format!("{member:?}, ");
        patches += &format!("{name} = {{ path = {member:?} }}\n");
    }
    let manifest =
        format!("[workspace]\nresolver = \"3\"\nmembers = [{members}]\n\n[patch.crates-io]\n{patches}");
    fs::write(unpacked.join("Cargo.toml"), manifest)?;
    fs::copy(root().join("Cargo.lock"), unpacked.join("Cargo.lock"))?;
    check_with(env!("CARGO_PKG_RUST_VERSION"), &unpacked, &["--workspace"])
}

/// Checks what users build with the oldest Rust that its manifest names; installs that.
pub(crate) fn msrv() -> Result<()> {
    // Left out is what developers alone build; its dependencies would double the time.
    let for_users = ["clutch-benches", "clutch-bits", "clutch-tests", "xtask"].map(|p| ["--exclude", p]);
    let mut workspace = vec!["--locked", "--workspace"];
    workspace.extend(for_users.iter().flatten());
    check_with(env!("CARGO_PKG_RUST_VERSION"), &root(), &workspace)?;
    // The core has one of its own, as it goes into other people's firmware.
    let core = read(&root().join("crates/clutch-core/Cargo.toml"))?;
    let core = core.lines().find_map(|line| line.strip_prefix("rust-version = \"")?.split('"').next());
    let core = core.context("clutch-core names no Rust version")?;
    check_with(core, &root(), &["--locked", "--package", "clutch-core"])
}

/// `rustup run` and not `cargo +version`, which a cargo started by cargo does not take.
fn check_with(version: &str, folder: &Path, args: &[&str]) -> Result<()> {
    let version = format!("{version}.0");
    let install = ["toolchain", "install", &version, "--profile", "minimal", "--no-self-update"];
    program("rustup").args(install).run()?;
    // C that dependencies bring is compiled even in a check: by the workspace's profile that takes twice as long.
    program("rustup")
        .args(["run", &version, "cargo", "check", "--target-dir"])
        .arg(root().join("target/msrv"))
        .args(args)
        .env("CARGO_PROFILE_DEV_OPT_LEVEL", "0")
        .env("CARGO_PROFILE_DEV_DEBUG", "0")
        .within(folder)
        .run()
}

/// Holds the interfaces of the packages against those of the last version; installs cargo-semver-checks once there
/// is one.
pub(crate) fn semver() -> Result<()> {
    let list = ["tag", "--list", "v[0-9]*", "--merged", "HEAD", "--sort", "-version:refname"];
    let (listed, tags) = program("git").args(list).quietly()?;
    ensure!(listed, "git does not list the tags: {tags}");
    let Some(last) = tags.lines().next() else {
        println!("no tag v* yet: there is no interface to keep");
        return Ok(());
    };
    if !cargo(["semver-checks", "--version"]).quietly()?.0 {
        cargo(["install", "cargo-semver-checks", "--locked", "--version", "0.51.0"]).run()?;
    }
    cargo(["semver-checks", "--baseline-rev", last]).args(selected()?).run()
}
