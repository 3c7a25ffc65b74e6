//! The library in the hands of Arduino and ros2_control: compiled against declarations of what they take of them, no more.

use crate::{BOARD, HERE, INCLUDE, folder, text};
use clutch_tests::{command, compiled, libclutch};
use std::process::Command;

/// A folder with the settings of a scenario.
fn settings(name: &str) -> std::path::PathBuf {
    let folder = folder(name);
    let printed = Command::new(command()).args(["scenario", "header", "board_smc_2"]).output().unwrap();
    std::fs::write(folder.join("run.h"), printed.stdout).unwrap();
    folder
}

#[test]
fn the_sketch_compiles_for_a_cortex_m4f() {
    let Some(_) = libclutch(BOARD) else { return };
    let folder = settings("arduino");
    let include = format!("-I{}", folder.display());
    let sources = [
        "-std=gnu++14",
        "-x",
        "c++",
        "-include",
        "tests/clutch_c/stubs/arduino/Arduino.h",
        "-mcpu=cortex-m4",
        "-mthumb",
        "-mfpu=fpv4-sp-d16",
        "-mfloat-abi=hard",
        INCLUDE,
        "-Iexamples/arduino/Clutch/src",
        &include,
        "-c",
        "examples/arduino/Clutch/examples/Axis/Axis.ino",
    ];
    let _ = compiled("arm-none-eabi-g++", "clutch_c_sketch.o", &sources);
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn the_controller_of_ros2_control_follows_its_path_under_a_manager_of_ours() {
    let Some(library) = libclutch(HERE) else { return };
    let folder = settings("ros2");
    let include = format!("-I{}", folder.display());
    let sources = [
        "-std=c++17",
        INCLUDE,
        "-Itests/clutch_c/stubs/ros2",
        "-Iexamples/ros2_control/clutch_controller/include",
        "-Iexamples/c",
        &include,
        "examples/ros2_control/clutch_controller/src/clutch_controller.cpp",
        "tests/clutch_c/stubs/ros2/drive.cpp",
        text(&library),
    ];
    let Some(program) = compiled("g++", "clutch_c_ros2", &sources) else { return };
    let done = Command::new(program).output().unwrap();
    let said = String::from_utf8_lossy(&done.stdout);
    assert!(done.status.success(), "{}: {said}", done.status);
    let numbers: Vec<f64> = said.split([' ', '\n']).filter_map(|word| word.parse().ok()).collect();
    // 5 s at 2 °/s; then the safe state's 4.5 V.
    assert!(
        matches!(numbers[..], [angle, _, safe] if (angle - 10.0).abs() < 0.2 && (safe - 4.5).abs() < 0.005),
        "{said}"
    );
    std::fs::remove_dir_all(&folder).unwrap();
}
