//! Python: a private environment for tools, and the wheel in one of its own.

use crate::debian;
use crate::run::{Program, program, root};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};

/// Python of this tree that is formatted and linted.
pub(crate) const SOURCES: [&str; 4] = ["python", "benches", "crates", "docs"];

/// The interpreter of the environment with everything but the wheel, made and filled if need be.
pub(crate) fn interpreter() -> Result<PathBuf> {
    environment("python/tests/requirements.txt")
}

/// The programs that check texts and manifests, by name. Installs only these: a check shall not wait for all that
/// tests need.
pub(crate) fn checkers() -> Result<impl Fn(&str) -> Program> {
    let python = environment("xtask/requirements.txt")?;
    Ok(move |name: &str| program(beside(&python, name)))
}

/// The interpreter of the environment with what builds and checks a release, made and filled if need be.
pub(crate) fn packers() -> Result<PathBuf> {
    environment("xtask/dist-requirements.txt")
}

fn environment(requirements: &str) -> Result<PathBuf> {
    let venv = root().join(".venv");
    let python = venv.join("bin/python");
    if !python.exists() {
        make_environment("python3".as_ref(), &venv, &[])?;
    }
    // Uncompiled, which takes a third less time: most of what packages bring is never imported.
    program(&python)
        .args([
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
            "--no-compile",
            "-r",
            requirements,
        ])
        .run()?;
    Ok(python)
}

pub(crate) fn make_environment(python: &Path, venv: &Path, args: &[&str]) -> Result<()> {
    let make = || program(python).args(["-m", "venv"]).args(args).arg(venv).quietly();
    let (made, text) = make().context("the tests need Python 3.11 or later as `python3`")?;
    if !made {
        // Debian keeps ensurepip in a package of its own.
        debian::install(&["python3-venv"]).with_context(|| format!("python3 -m venv failed:\n{text}"))?;
        let (made, text) = make()?;
        if !made {
            bail!("python3 -m venv failed:\n{text}");
        }
    }
    Ok(())
}

/// A program that is installed beside an interpreter.
pub(crate) fn beside(python: &Path, name: &str) -> PathBuf {
    python.with_file_name(name)
}

/// The profile of the wheel that tests install: packages of others are as in the other tests, and compiled once for both.
pub(crate) const PROFILE: &str = "dev";

/// Our crates in that wheel have the optimisations of the released one, which `cargo xtask dist` builds and tries, but for
/// clutch-sim, whose level the workspace sets.
pub(crate) fn optimised(program: Program) -> Program {
    program.env("CARGO_PROFILE_DEV_OPT_LEVEL", "3").env("CARGO_PROFILE_DEV_DEBUG", "none")
}

/// The wheel in an environment of its own, outside of this tree.
pub(crate) struct Wheel {
    /// Holds the unpacked source distribution and the environment; gone when this is dropped.
    folder: PathBuf,
    /// The unpacked source distribution.
    source: PathBuf,
    /// The environment's interpreter.
    python: PathBuf,
}

impl Drop for Wheel {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

impl Wheel {
    /// Builds the source distribution, from it the wheel, and installs that. The test tools are
    /// visible from `tools`, the environment of [`interpreter`].
    pub(crate) fn install(tools: &Path) -> Result<Wheel> {
        let dist = root().join("target/wheel");
        let _ = std::fs::remove_dir_all(&dist);
        let folder = std::env::temp_dir().join(format!("clutch-wheel-{}", std::process::id()));
        let environment = folder.join("environment");
        let _ = std::fs::remove_dir_all(&folder);
        let unpacked = folder.join("unpacked");
        std::fs::create_dir_all(&unpacked).with_context(|| folder.display().to_string())?;
        program(beside(tools, "maturin")).args(["sdist", "--out"]).arg(&dist).run()?;
        // With the time of now (-m): maturin packs each file with one date, and cargo would not see a change.
        program("tar").arg("-xmf").arg(the_one(&dist, ".tar.gz")?).arg("-C").arg(&unpacked).run()?;
        let source = the_one(&unpacked, "")?;
        let wheel = Wheel { folder, source, python: environment.join("bin/python") };
        let pip = |python: &Path| program(python).args(["-m", "pip", "--disable-pip-version-check"]);
        // A separate build environment would download maturin once more.
        optimised(wheel.built(pip(tools), tools)?)
            .args(["wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir"])
            .arg(&dist)
            .arg(&wheel.source)
            .env("MATURIN_PEP517_ARGS", format!("--profile {PROFILE}"))
            .run()?;
        make_environment(tools, &environment, &["--without-pip"])?;
        pip(tools)
            .arg("--python")
            .arg(&wheel.python)
            .args(["install", "--quiet", "--no-deps"])
            .arg(the_one(&dist, ".whl")?)
            .run()?;
        let site = |python: &Path| -> Result<String> {
            let ask = ["-c", "import sysconfig; print(sysconfig.get_path('purelib'))"];
            let (found, site) = program(python).args(ask).quietly()?;
            if !found {
                bail!("{} does not report its packages: {site}", python.display());
            }
            Ok(site)
        };
        std::fs::write(Path::new(site(&wheel.python)?.trim()).join("tools.pth"), site(tools)?)?;
        Ok(wheel)
    }

    /// A program that builds from the unpacked source, into this tree's folder of builds.
    pub(crate) fn built(&self, program: Program, tools: &Path) -> Result<Program> {
        let target = root().join("target");
        Ok(program.within(&self.source).env("CARGO_TARGET_DIR", target).env("PATH", path_with(tools)?))
    }

    /// A program of the environment, to be run outside of the tree.
    pub(crate) fn program(&self, tools: &Path) -> Result<Program> {
        Ok(program(&self.python).within(&self.folder).env("PATH", {
            let mut path = self.python.with_file_name("").into_os_string();
            path.push(":");
            path.push(path_with(tools)?);
            path
        }))
    }
}

/// The search path with an interpreter's folder first.
pub(crate) fn path_with(python: &Path) -> Result<std::ffi::OsString> {
    let mut path = python.parent().context("an interpreter's folder")?.as_os_str().to_owned();
    path.push(":");
    path.push(std::env::var_os("PATH").unwrap_or_default());
    Ok(path)
}

/// The only entry of a folder with that ending.
pub(crate) fn the_one(folder: &Path, ending: &str) -> Result<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.to_string_lossy().ends_with(ending) {
            found.push(path);
        }
    }
    match &found[..] {
        [one] => Ok(one.clone()),
        _ => bail!("{}: expected one *{ending}, found {}", folder.display(), found.len()),
    }
}
