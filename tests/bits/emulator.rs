//! The image `bits` and the emulator that runs it.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::LazyLock;
use std::time::{Duration, Instant};

const TARGET: &str = "thumbv7em-none-eabihf";
/// A run that takes longer than this hangs: it takes seconds.
const PATIENCE: Duration = Duration::from_secs(300);

/// The emulated board.
pub(crate) struct Board {
    image: PathBuf,
}

/// The board with its image built; none, with a message, where emulator or target are missing. CI has
/// both.
pub(crate) fn board() -> Option<Board> {
    static IMAGE: LazyLock<Result<PathBuf, &str>> = LazyLock::new(|| {
        if !Command::new("qemu-system-arm").arg("--version").output().is_ok_and(|o| o.status.success()) {
            return Err("qemu-system-arm is not installed (Debian and Ubuntu: qemu-system-arm)");
        }
        let libraries =
            Command::new("rustc").args(["--print", "target-libdir", "--target", TARGET]).output().ok();
        let libraries = libraries.and_then(|o| String::from_utf8(o.stdout).ok()).unwrap_or_default();
        if !Path::new(libraries.trim()).is_dir() {
            return Err("the target is not installed (rustup target add thumbv7em-none-eabihf)");
        }
        Ok(built())
    });
    match &*IMAGE {
        Ok(image) => Some(Board { image: image.clone() }),
        Err(why) => {
            assert!(std::env::var_os("CI").is_none(), "{why}: CI must not skip this test");
            println!("skipped: {why}");
            None
        }
    }
}

fn built() -> PathBuf {
    let firmware = Path::new(env!("CARGO_MANIFEST_DIR")).join("../firmware");
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).join("../firmware");
    // From within its folder: its flags stand in a file that cargo looks for from there.
    let done = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(["build", "--release", "--locked", "--bin", "bits", "--target-dir"])
        .arg(&target)
        .current_dir(firmware)
        .output()
        .expect("cargo starts");
    assert!(done.status.success(), "the image does not build:\n{}", String::from_utf8_lossy(&done.stderr));
    target.join(TARGET).join("release/bits")
}

impl Board {
    /// Runs everything in `input`; the hashes, and the records that were asked for.
    pub(crate) fn run(&self, name: &str, input: &[u8]) -> (Vec<u32>, Vec<u8>) {
        // The board opens its files in the emulator's folder.
        let folder =
            Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("bits-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("bits.in"), input).unwrap();
        let mut emulator = Command::new("qemu-system-arm")
            .args(["-machine", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "null"])
            .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
            .arg(&self.image)
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
                panic!("the image hangs");
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        let done = emulator.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&done.stdout);
        let errors = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.success(), "the image ends with {}: {said}{errors}", done.status);
        println!("{name}: {:.1} s in the emulator", begun.elapsed().as_secs_f64());
        let records = std::fs::read(folder.join("bits.out")).unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
        (said.lines().map(|line| u32::from_str_radix(line, 16).expect("a hash")).collect(), records)
    }
}
