//! Other machines that repeat the runs: a board with the image `bits`, and a 64-bit processor of another kind with the
//! example `repeat`; their emulators run both.

use clutch_tests::firmware;
use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A run that takes longer than this hangs: it takes seconds.
const PATIENCE: Duration = Duration::from_secs(300);

/// A machine: an emulator with its arguments.
pub(crate) struct Machine {
    pub(crate) name: &'static str,
    words: Vec<OsString>,
}

/// The board; none where it cannot be emulated.
pub(crate) fn board() -> Option<Machine> {
    let emulator = ["qemu-system-arm", "-machine", "mps2-an386", "-display", "none", "-monitor", "none"];
    let files = ["-serial", "null", "-semihosting-config", "enable=on,target=native", "-kernel"];
    let mut words: Vec<OsString> = emulator.into_iter().chain(files).map(Into::into).collect();
    words.push(firmware::image("mps2-bits")?.into());
    Some(Machine { name: "board", words })
}

/// A 64-bit Arm processor; none where it cannot be emulated.
pub(crate) fn arm64() -> Option<Machine> {
    // Linked statically, by what comes with the compiler: it needs nothing of that machine but its system's calls.
    const TARGET: &str = "aarch64-unknown-linux-musl";
    if !Command::new("qemu-aarch64").arg("--version").output().is_ok_and(|o| o.status.success()) {
        return firmware::skipped("qemu-aarch64 is not installed (Debian and Ubuntu: qemu-user)");
    }
    if !firmware::has(TARGET) {
        return firmware::skipped(&format!("a target is not installed (rustup target add {TARGET})"));
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folder = root.join("target/arm64");
    let build = ["build", "--release", "--locked", "--package", "clutch-bits", "--example", "repeat"];
    let done = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(build)
        .args(["--target", TARGET, "--target-dir"])
        .arg(&folder)
        .env("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_LINKER", "rust-lld")
        .current_dir(root)
        .output()
        .expect("cargo starts");
    assert!(done.status.success(), "the program does not build:\n{}", String::from_utf8_lossy(&done.stderr));
    let program = folder.join(TARGET).join("release/examples/repeat");
    Some(Machine { name: "arm64", words: vec!["qemu-aarch64".into(), program.into()] })
}

impl Machine {
    /// Runs everything in `input`; gives the hashes, and the requested records.
    pub(crate) fn run(&self, name: &str, input: &[u8]) -> (Vec<u32>, Vec<u8>) {
        let name = format!("{}-{name}", self.name);
        let (emulator, arguments) = self.words.split_first().expect("an emulator");
        // The machine opens its files in the emulator's folder.
        let folder =
            Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("bits-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("bits.in"), input).unwrap();
        let mut emulator = Command::new(emulator)
            .args(arguments)
            .current_dir(&folder)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the emulator starts");
        let begun = Instant::now();
        while emulator.try_wait().unwrap().is_none() {
            if begun.elapsed() > PATIENCE {
                let _ = emulator.kill();
                panic!("the machine hangs");
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        let done = emulator.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&done.stdout);
        let errors = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.success(), "the machine ends with {}: {said}{errors}", done.status);
        println!("{name}: {:.1} s in the emulator", begun.elapsed().as_secs_f64());
        let records = std::fs::read(folder.join("bits.out")).unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
        (said.lines().map(|line| u32::from_str_radix(line, 16).expect("a hash")).collect(), records)
    }
}
