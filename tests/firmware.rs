//! Images of the boards for tests.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

/// The targets of the boards' cores.
const CORTEX_M4F: &str = "thumbv7em-none-eabihf";
const CORTEX_M0_PLUS: &str = "thumbv6m-none-eabi";

/// The reason why there can be no emulated board here; else the folder of its images, built once.
static IMAGES: LazyLock<Result<PathBuf, &str>> = LazyLock::new(|| {
    if !Command::new("qemu-system-arm").arg("--version").output().is_ok_and(|o| o.status.success()) {
        return Err("qemu-system-arm is not installed (Debian and Ubuntu: qemu-system-arm)");
    }
    built("clutch-qemu-mps2", CORTEX_M4F)
});

/// The same for the images that run on the model of their chip.
static NUCLEO: LazyLock<Result<PathBuf, &str>> =
    LazyLock::new(|| modelled("clutch-nucleo-g474re", CORTEX_M4F));
static PICO: LazyLock<Result<PathBuf, &str>> =
    LazyLock::new(|| modelled("clutch-pico-rp2040", CORTEX_M0_PLUS));

fn modelled(package: &str, target: &str) -> Result<PathBuf, &'static str> {
    if clutch_loop::chip_board::no_engine().is_some() {
        return Err(
            "no Python with the module unicorn (pip install unicorn; CLUTCH_PYTHON names the interpreter)",
        );
    }
    built(package, target)
}

/// True if a target of the compiler is installed.
#[must_use]
pub fn has(target: &str) -> bool {
    let libraries =
        Command::new("rustc").args(["--print", "target-libdir", "--target", target]).output().ok();
    let libraries = libraries.and_then(|o| String::from_utf8(o.stdout).ok()).unwrap_or_default();
    Path::new(libraries.trim()).is_dir()
}

/// Builds the images of a board.
fn built(package: &str, goal: &str) -> Result<PathBuf, &'static str> {
    if !has(goal) {
        return Err("a target is not installed (rustup target add thumbv7em-none-eabihf thumbv6m-none-eabi)");
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let target = root.join("target/firmware");
    // From within its folder: cargo looks there for the file with its flags.
    let done = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(["build", "--release", "--locked", "--package", package, "--target", goal, "--target-dir"])
        .arg(&target)
        .current_dir(root.join("firmware"))
        .output()
        .expect("cargo starts");
    assert!(done.status.success(), "the images do not build:\n{}", String::from_utf8_lossy(&done.stderr));
    Ok(target.join(goal).join("release"))
}

/// An image of a board; none, with a message, where emulator or target are missing. CI has
/// all.
///
/// # Panics
/// The image does not build; or as [`skipped`].
#[must_use]
pub fn image(name: &str) -> Option<PathBuf> {
    let images = match name.split('-').next() {
        Some("nucleo") => &*NUCLEO,
        Some("pico") => &*PICO,
        _ => &*IMAGES,
    };
    match images {
        Ok(folder) => Some(folder.join(name)),
        Err(why) => skipped(why),
    }
}

/// Nothing, and a message that says why.
///
/// # Panics
/// In CI, which has all that tests need.
#[must_use]
pub fn skipped<T>(why: &str) -> Option<T> {
    assert!(std::env::var_os("CI").is_none(), "{why}: CI must not skip this test");
    println!("skipped: {why}");
    None
}
