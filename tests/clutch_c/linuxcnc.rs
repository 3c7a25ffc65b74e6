//! The HAL components of examples/linuxcnc, built with LinuxCNC's own tool.

use crate::{HERE, folder, text};
use clutch_tests::{command, libclutch};
use std::path::{Path, PathBuf};
use std::process::Command;

/// LinuxCNC's files: an unpacked package that `CLUTCH_LINUXCNC` names, or what is installed. None, with a message, where there
/// is none; CI has them.
fn linuxcnc() -> Option<PathBuf> {
    let root = PathBuf::from(std::env::var_os("CLUTCH_LINUXCNC").unwrap_or_else(|| "/".into()));
    if root.join("usr/bin/halcompile").exists() {
        return Some(root);
    }
    assert!(std::env::var_os("CI").is_none(), "no halcompile: CI must not skip this test");
    println!(
        "skipped: no halcompile (Debian: linuxcnc-uspace-dev; CLUTCH_LINUXCNC names the root of an unpacked one)"
    );
    None
}

#[test]
fn the_components_build_with_halcompile() {
    let (Some(root), Some(library)) = (linuxcnc(), libclutch(HERE)) else { return };
    let (usr, project, folder) =
        (root.join("usr"), Path::new(env!("CARGO_MANIFEST_DIR")).join(".."), folder("hal"));
    let printed = Command::new(command()).args(["scenario", "header", "board_smc_2"]).output().unwrap();
    std::fs::write(folder.join("run.h"), printed.stdout).unwrap();
    for file in ["linuxcnc/clutch_axis.comp", "linuxcnc/clutch_shaft.comp", "c/shaft.h"] {
        let from = project.join("examples").join(file);
        std::fs::copy(&from, folder.join(from.file_name().unwrap())).unwrap();
    }
    std::fs::copy(project.join("crates/clutch-c/include/clutch.h"), folder.join("clutch.h")).unwrap();
    for name in ["clutch_axis", "clutch_shaft"] {
        let done = Command::new("python3")
            .arg(usr.join("bin/halcompile"))
            .args(["--compile", &format!("{name}.comp")])
            .env("PYTHONPATH", usr.join("lib/python3/dist-packages"))
            .env("MAKEFLAGS", format!("prefix={}", usr.display()))
            .env("LDFLAGS", format!("-Wl,-u,clutch_axis_build {}", text(&library)))
            .current_dir(&folder)
            .output()
            .expect("python3 starts");
        let said = String::from_utf8_lossy(&done.stdout) + String::from_utf8_lossy(&done.stderr);
        assert!(done.status.success() && !said.contains("warning"), "{name}: {said}");
        assert!(folder.join(format!("{name}.so")).exists(), "{name}: {said}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
