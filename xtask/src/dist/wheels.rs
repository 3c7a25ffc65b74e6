//! The Python package: source distribution and wheels.

use super::machine::{Machine, PYTHON_WINDOWS_VERSION, Results, python_arm64, python_windows};
use super::tools::{GLIBC, LINUX, LINUX_ARM64, Tools, WINDOWS, names_no_folder};
use super::{Made, folder, images, name, work};
use crate::python;
use crate::run::{program, root};
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};
use std::time::Instant;

pub(super) fn make(tools: &Tools) -> Result<Vec<Made>> {
    let manylinux = format!("manylinux_{}", GLIBC.replace('.', "_"));
    let zig = ["--zig", "--compatibility", &manylinux, "--auditwheel", "check"];
    // Boards are followed on Linux alone.
    let packaged = root().join("python/clutch/images");
    images::stripped(&packaged)?;
    let (linux, arm64) = (wheel(tools, LINUX, &zig), wheel(tools, LINUX_ARM64, &zig));
    std::fs::remove_dir_all(&packaged)?;
    let (linux, arm64, windows) = (linux?, arm64?, wheel(tools, WINDOWS, &[])?);
    let source = work("sdist")?;
    tools.program("maturin").args(["sdist", "--out"]).arg(&source).run()?;
    let archive = kept(&python::the_one(&source, ".tar.gz")?)?;

    let (clean, picture) = first_picture(tools, &linux)?;
    let here = Machine::here().results(&[&clean.join("bin/clutch")], "wheel")?;
    let on_arm64 = arm64_results(tools, &arm64)?;
    let (imported, on_windows) = windows_results(tools, &windows)?;
    let checked = vec![audited(tools, &linux)?, picture, here.told()];
    Ok(vec![
        Made { checked: vec!["not tried here: the tests build from it".to_owned()], file: archive },
        Made { checked, file: linux },
        Made { checked: vec![audited(tools, &arm64)?, on_arm64.same_as(&here)?], file: arm64 },
        Made { checked: vec![imported, on_windows.same_as(&here)?], file: windows },
    ])
}

/// Builds the wheel for a target.
fn wheel(tools: &Tools, target: &str, options: &[&str]) -> Result<PathBuf> {
    let out = work(&format!("wheel-{target}"))?;
    let build = tools.program("maturin").args(["build", "--release", "--locked", "--target", target]);
    build.args(options).arg("--out").arg(&out).run()?;
    let wheel = python::the_one(&out, ".whl")?;
    let unpacked = out.join("unpacked");
    program(&tools.python).args(["-m", "zipfile", "-e"]).args([&wheel, &unpacked]).run()?;
    let ending = if target == WINDOWS { ".pyd" } else { ".so" };
    names_no_folder(&python::the_one(&unpacked.join("clutch"), ending)?)?;
    kept(&wheel)
}

/// Copies a file into the folder of the release; gives its path there.
fn kept(file: &Path) -> Result<PathBuf> {
    super::copy(file, &folder())?;
    Ok(folder().join(name(file)))
}

/// Check that a wheel needs no later C library than it says, as auditwheel reads its symbols.
fn audited(tools: &Tools, wheel: &Path) -> Result<String> {
    let text = tools.program("auditwheel").arg("show").arg(wheel).output()?;
    let text = String::from_utf8_lossy(&text).split_whitespace().collect::<Vec<_>>().join(" ");
    let tag = text.split_once("platform tag: \"").and_then(|(_, rest)| Some(rest.split_once('"')?.0));
    let tag = tag.with_context(|| format!("auditwheel names no tag: {text}"))?;
    let version = |tag: &str| tag.strip_prefix("manylinux_2_")?.split('_').next()?.parse::<u32>().ok();
    let allowed = GLIBC.strip_prefix("2.").and_then(|minor| minor.parse().ok());
    ensure!(version(tag).is_some() && version(tag) <= allowed, "{}: auditwheel says {tag}", wheel.display());
    Ok(format!("auditwheel: {tag}"))
}

/// Installs a wheel as a user does, in an environment of its own, and draws a picture; gives the environment, and the time
/// of both. Only pip may know packages from before.
fn first_picture(tools: &Tools, wheel: &Path) -> Result<(PathBuf, String)> {
    let folder = work("clean")?;
    let clean = folder.join("environment");
    python::make_environment(&tools.python, &clean, &[])?;
    let begin = Instant::now();
    let install = program(clean.join("bin/pip")).within(&folder).args(["install", "--quiet"]);
    install.arg("--disable-pip-version-check").arg(format!("{}[plot]", wheel.display())).run()?;
    let installed = begin.elapsed().as_secs_f64();
    let picture = folder.join("first.png");
    program(clean.join("bin/clutch")).within(&folder).args(["sim", "smc_2", "--plot", "first.png"]).run()?;
    let drawn = begin.elapsed().as_secs_f64();
    is_picture(&picture)?;
    // The images come with it.
    program(clean.join("bin/clutch")).within(&folder).args(["hil", "board_smc_2", "--quiet"]).run()?;
    let plot = "import clutch; clutch.simulate('smc_2').plot().savefig('second.png')";
    program(clean.join("bin/python")).within(&folder).args(["-c", plot]).env("MPLBACKEND", "agg").run()?;
    is_picture(&folder.join("second.png"))?;
    let all = begin.elapsed().as_secs_f64();
    let told = format!(
        "from pip install with matplotlib to the picture of clutch sim {drawn:.1} s, of Result.plot {all:.1} s \
         (pip {installed:.1} s)"
    );
    Ok((clean, told))
}

fn is_picture(file: &Path) -> Result<()> {
    let bytes = std::fs::read(file).with_context(|| file.display().to_string())?;
    ensure!(bytes.starts_with(b"\x89PNG") && bytes.len() > 10_000, "{} is no picture", file.display());
    Ok(())
}

/// Installs a wheel for a 64-bit Arm processor beside a Python for it, and computes with it.
fn arm64_results(tools: &Tools, wheel: &Path) -> Result<Results> {
    let root = python_arm64()?;
    let (machine, python) = (Machine::arm64(Some(&root)), root.join("usr/bin/python3"));
    let version = "import sys; print('%d.%d' % sys.version_info[:2])";
    let version = machine.program(&python).args(["-c", version]).output()?;
    let site = root.join("site");
    let platforms = ["manylinux_2_28_aarch64", "manylinux_2_27_aarch64", "manylinux2014_aarch64"];
    installed(tools, wheel, &site, String::from_utf8_lossy(&version).trim(), &platforms)?;
    machine.results(&[&python, "-c".as_ref(), run(&site).as_ref()], "wheel-arm64-results")
}

/// The same for Windows; before, what its module asks for.
fn windows_results(tools: &Tools, wheel: &Path) -> Result<(String, Results)> {
    let site = work("wheel-windows-site")?;
    installed(tools, wheel, &site, PYTHON_WINDOWS_VERSION, &["win_amd64"])?;
    let module = site.join("clutch/_clutch.pyd");
    let python = python_windows(&module)?;
    let home = format!("Z:{}", python.with_file_name("").display());
    let machine = Machine::windows()?.with("PYTHONHOME", home.into());
    let results = machine.results(&[&python, "-c".as_ref(), run(&site).as_ref()], "wheel-windows-results")?;
    Ok((imports(&module)?, results))
}

/// Installs a wheel and what it needs for another system into a folder.
fn installed(tools: &Tools, wheel: &Path, site: &Path, version: &str, platforms: &[&str]) -> Result<()> {
    let install =
        program(&tools.python).args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    install
        .args(["--only-binary", ":all:", "--python-version", version])
        .args(platforms.iter().flat_map(|platform| ["--platform", platform]))
        .arg("--target")
        .args([site, wheel])
        .run()
}

/// The command of the package in a folder, by an interpreter: the script's first line names another.
fn run(site: &Path) -> String {
    format!(
        "import sys; sys.path.insert(0, {:?}); sys.argv[0] = 'clutch'; from clutch._cli import main; sys.exit(main())",
        site.display().to_string()
    )
}

/// Check that the module of a wheel for Windows asks for nothing but libraries that Windows and Python have.
fn imports(module: &Path) -> Result<String> {
    let libraries = libraries(module)?;
    ensure!(libraries.iter().any(|name| name == "python3.dll"), "no python3.dll among {libraries:?}");
    let others = libraries.len() - 1;
    Ok(format!("asks for python3.dll and {others} libraries of Windows"))
}

/// The libraries that a file for Windows asks for; an error if one comes with a compiler.
pub(super) fn libraries(file: &Path) -> Result<Vec<String>> {
    let text = program("x86_64-w64-mingw32-objdump").arg("-p").arg(file).output()?;
    let text = String::from_utf8_lossy(&text).into_owned();
    let named = text.lines().filter_map(|line| line.trim().strip_prefix("DLL Name: "));
    let mut libraries: Vec<String> = named.map(str::to_lowercase).collect();
    libraries.sort();
    libraries.dedup();
    let brought = libraries.iter().find(|name| name.starts_with("lib"));
    ensure!(brought.is_none() && !libraries.is_empty(), "{} asks for {libraries:?}", file.display());
    Ok(libraries)
}
