//! Programs that build and check a release.

use crate::run::{Program, cargo, program, root};
use crate::{debian, python};
use anyhow::{Context, Result, ensure};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Linux on x86-64, for the oldest C library that wheels are for.
pub(super) const LINUX: &str = "x86_64-unknown-linux-gnu";
pub(super) const LINUX_ARM64: &str = "aarch64-unknown-linux-gnu";
/// The same without a C library of the system's.
pub(super) const STATIC: &str = "x86_64-unknown-linux-musl";
pub(super) const STATIC_ARM64: &str = "aarch64-unknown-linux-musl";
pub(super) const WINDOWS: &str = "x86_64-pc-windows-gnu";

/// The C library that wheels and units for Linux need: this version or a later one.
pub(super) const GLIBC: &str = "2.28";

/// The programs.
pub(super) struct Tools {
    /// Interpreter of an environment with the Python packages.
    pub(super) python: PathBuf,
    /// Search path with that environment: cargo finds `zigbuild` there, and that zig.
    path: OsString,
    /// Options of the compiler: messages name files without the folders of this machine.
    flags: String,
}

impl Tools {
    /// Installs what is not here.
    pub(super) fn new() -> Result<Tools> {
        debian::need(&[
            ("curl", "curl"),
            ("x86_64-w64-mingw32-gcc", "gcc-mingw-w64-x86-64"),
            ("arm-none-eabi-strip", "binutils-arm-none-eabi"),
            ("qemu-system-arm", "qemu-system-arm"),
            ("qemu-aarch64", "qemu-user"),
            ("wine", "wine"),
        ])?;
        let targets = [LINUX, LINUX_ARM64, STATIC, STATIC_ARM64, WINDOWS];
        program("rustup").args(["target", "add"]).args(targets).run()?;
        let python = python::packers()?;
        let flags =
            folders()?.iter().map(|f| format!("--remap-path-prefix={f}=.")).collect::<Vec<_>>().join(" ");
        Ok(Tools { path: python::path_with(&python)?, python, flags })
    }

    /// A program of the environment.
    pub(super) fn program(&self, name: &str) -> Program {
        program(python::beside(&self.python, name)).env("PATH", &self.path).env("RUSTFLAGS", &self.flags)
    }

    /// The environment's interpreter, with a script.
    pub(super) fn script(&self, script: &str) -> Program {
        program(&self.python).args(["-c", script])
    }

    /// Builds with zig as linker and compiler for C, or for Windows with mingw; gives the folder of what was built.
    pub(super) fn build(&self, target: &str, what: &[&str]) -> Result<PathBuf> {
        let verb = if target == WINDOWS { "build" } else { "zigbuild" };
        // The target's name with the version of the C library is zigbuild's.
        let named = if target.ends_with("gnu") && target != WINDOWS {
            format!("{target}.{GLIBC}")
        } else {
            target.to_owned()
        };
        let build = cargo([verb, "--release", "--locked", "--target", &named]).args(what);
        build.env("PATH", &self.path).env("RUSTFLAGS", &self.flags).run()?;
        Ok(root().join("target").join(target).join("release"))
    }
}

/// The folders that a release does not name: of this tree, and of the sources of other packages.
fn folders() -> Result<[String; 2]> {
    let home = || std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".cargo"));
    let cargo = std::env::var_os("CARGO_HOME").map(PathBuf::from).or_else(home).context("no HOME")?;
    Ok([root().display().to_string(), cargo.join("registry/src").display().to_string()])
}

/// An error if a file names such a folder.
pub(super) fn names_no_folder(file: &Path) -> Result<()> {
    let bytes = std::fs::read(file).with_context(|| file.display().to_string())?;
    let named = |folder: &String| bytes.windows(folder.len()).any(|w| w == folder.as_bytes());
    let found = folders()?.into_iter().find(named);
    ensure!(found.is_none(), "{} names the folder {}", file.display(), found.unwrap_or_default());
    Ok(())
}
