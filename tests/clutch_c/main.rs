//! libclutch: the same bits from C, here and on a Cortex-M4F; an axis that runs as the loop does; and a caller's mistakes.

mod axis;
mod linuxcnc;
mod misuse;
mod users;

use clutch_tests::bits::Run;
use clutch_tests::{command, compiled, libclutch};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The compiler's word for this machine.
const HERE: &str =
    if cfg!(target_arch = "aarch64") { "aarch64-unknown-linux-gnu" } else { "x86_64-unknown-linux-gnu" };
const BOARD: &str = "thumbv7em-none-eabihf";
const INCLUDE: &str = "-Icrates/clutch-c/include";

/// A folder for a program of these tests.
fn folder(name: &str) -> PathBuf {
    let folder =
        Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("clutch_c-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a path in UTF-8")
}

/// The hashes that a program prints for the runs of docs/bits.md, which it finds in its folder.
fn hashes(name: &str, run: impl FnOnce(&Path) -> Output) -> (Vec<u32>, Vec<u32>) {
    let runs = Run::all().expect("the scenarios are right");
    let folder = folder(name);
    let inputs: Vec<u8> = runs.iter().flat_map(|run| run.input(run.job)).collect();
    std::fs::write(folder.join("bits.in"), inputs).unwrap();
    let done = run(&folder);
    std::fs::remove_dir_all(&folder).unwrap();
    let said = String::from_utf8_lossy(&done.stdout);
    assert!(done.status.success(), "{}: {said}{}", done.status, String::from_utf8_lossy(&done.stderr));
    let theirs = said.lines().map(|line| u32::from_str_radix(line, 16).expect("a hash")).collect();
    (theirs, runs.iter().map(|run| run.hash).collect())
}

#[test]
fn more_than_a_million_ticks_from_c_have_the_bits_of_rust() {
    let Some(library) = libclutch(HERE) else { return };
    let sources = ["-std=c99", INCLUDE, "tests/clutch_c/bits.c", text(&library)];
    let Some(program) = compiled("gcc", "clutch_c_bits", &sources) else { return };
    let (theirs, ours) =
        hashes("here", |folder| Command::new(&program).current_dir(folder).output().expect("it starts"));
    assert_eq!(theirs, ours);
}

#[test]
fn the_same_from_c_on_an_emulated_cortex_m4f() {
    let Some(library) = libclutch(BOARD) else { return };
    let sources = [
        "-std=c99",
        "--specs=rdimon.specs",
        "-Wl,-z,noexecstack,--no-warn-rwx-segments",
        "-mcpu=cortex-m4",
        "-mthumb",
        "-mfpu=fpv4-sp-d16",
        "-mfloat-abi=hard",
        "-T",
        "tests/clutch_c/mps2.ld",
        INCLUDE,
        "tests/clutch_c/mps2.c",
        "tests/clutch_c/bits.c",
        text(&library),
    ];
    let Some(program) = compiled("arm-none-eabi-gcc", "clutch_c_bits.elf", &sources) else { return };
    if !Command::new("qemu-system-arm").arg("--version").output().is_ok_and(|o| o.status.success()) {
        assert!(std::env::var_os("CI").is_none(), "no qemu-system-arm: CI must not skip this test");
        println!("skipped: qemu-system-arm is not installed");
        return;
    }
    let (theirs, ours) = hashes("board", |folder| {
        Command::new("qemu-system-arm")
            .args(["-machine", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "null"])
            .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
            .arg(&program)
            .current_dir(folder)
            .output()
            .expect("the emulator starts")
    });
    assert_eq!(theirs, ours);
}

#[test]
fn the_example_follows_its_path_with_the_settings_that_the_command_prints() {
    let Some(library) = libclutch(HERE) else { return };
    let folder = folder("example");
    let printed = Command::new(command()).args(["scenario", "header", "board_smc_2"]).output().unwrap();
    assert!(printed.status.success(), "{}", String::from_utf8_lossy(&printed.stderr));
    std::fs::write(folder.join("run.h"), printed.stdout).unwrap();
    let settings = format!("-I{}", folder.display());
    for standard in ["-std=c99", "-std=c11"] {
        let sources = [standard, INCLUDE, &settings, "examples/c/axis.c", text(&library)];
        let Some(program) = compiled("gcc", "clutch_c_axis", &sources) else { return };
        let done = Command::new(program).output().unwrap();
        let said = String::from_utf8_lossy(&done.stdout);
        assert!(done.status.success(), "{said}");
        let error = said.split_whitespace().rev().nth(1).and_then(|word| word.parse::<f64>().ok());
        assert!(error.is_some_and(|e| (0.001..0.15).contains(&e)), "{said}");
    }
    // C++ takes the header, too.
    let unit = folder.join("unit.cpp");
    std::fs::write(&unit, "#include \"run.h\"\nclutch_axis axis;\n").unwrap();
    let sources = ["-std=c++11", "-c", "-Wno-unused-variable", INCLUDE, &settings, text(&unit)];
    let _ = compiled("g++", "clutch_c_unit.o", &sources);
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn settings_of_gains_that_are_not_certified_are_printed_on_request_only() {
    let header = |more: &[&str]| {
        let arguments = [&["scenario", "header", "board_smc_2", "--set", "law.smc.kp_v=0.1"], more].concat();
        Command::new(command()).args(arguments).output().unwrap()
    };
    let (refused, printed) = (header(&[]), header(&["--uncertified"]));
    assert!(!refused.status.success());
    let said = String::from_utf8_lossy(&refused.stdout).into_owned();
    assert!(said.contains("not certified") && !said.contains("CLUTCH_KEY"), "{said}");
    assert!(printed.status.success());
    assert!(
        String::from_utf8_lossy(&printed.stdout)
            .contains("{CLUTCH_KEY_LAW_SMC_KP_V, 0x3dcccccd}, /* 0.1 V */")
    );
    let odd = header(&["--name", "2run"]);
    assert!(String::from_utf8_lossy(&odd.stderr).contains("--name 2run: expected a name of C"));
    let taken = header(&["--name", "int"]);
    assert!(String::from_utf8_lossy(&taken.stderr).contains("--name int: is a word of C or C++ itself"));
}
