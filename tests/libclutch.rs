//! libclutch, and programs in C with it, for tests.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Builds the library for a target; none, with a message, where the target is missing. CI has it.
///
/// # Panics
/// It does not build; or in CI, where there is none.
#[must_use]
pub fn libclutch(target: &str) -> Option<PathBuf> {
    let libraries =
        Command::new("rustc").args(["--print", "target-libdir", "--target", target]).output().ok();
    let libraries = libraries.and_then(|o| String::from_utf8(o.stdout).ok()).unwrap_or_default();
    if !Path::new(libraries.trim()).is_dir() {
        return skipped(&format!("the target is not installed (rustup target add {target})"));
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    // The folder in which `cargo xtask libclutch` builds it, too.
    let folder = root.join("target/libclutch/build");
    let done = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(["rustc", "--locked", "--package", "clutch-c", "--profile", "c", "--crate-type", "staticlib"])
        .args(["--features", "staticlib", "--target", target, "--target-dir"])
        .arg(&folder)
        .current_dir(&root)
        .output()
        .expect("cargo starts");
    assert!(done.status.success(), "libclutch does not build:\n{}", String::from_utf8_lossy(&done.stderr));
    Some(folder.join(target).join("c/libclutch.a"))
}

/// Compiles a program in C; none, with a message, where the compiler is missing. CI has it.
///
/// # Panics
/// It does not compile without a warning; or in CI, where there is no compiler.
#[must_use]
pub fn compiled(compiler: &str, name: &str, arguments: &[&str]) -> Option<PathBuf> {
    if !Command::new(compiler).arg("--version").output().is_ok_and(|o| o.status.success()) {
        return skipped(&format!("{compiler} is not installed"));
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/tmp");
    std::fs::create_dir_all(&folder).expect("target/tmp");
    let program = folder.join(name);
    let done = Command::new(compiler)
        .args(["-O1", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror"])
        .args(arguments)
        .arg("-o")
        .arg(&program)
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
        .output()
        .expect("the compiler starts");
    assert!(done.status.success(), "{compiler}:\n{}", String::from_utf8_lossy(&done.stderr));
    Some(program)
}

fn skipped<T>(why: &str) -> Option<T> {
    assert!(std::env::var_os("CI").is_none(), "{why}: CI must not skip this test");
    println!("skipped: {why}");
    None
}
