//! The image `bits` and the emulator that runs it.

use clutch_tests::firmware;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A run that takes longer than this hangs: it takes seconds.
const PATIENCE: Duration = Duration::from_secs(300);

/// The emulated board.
pub(crate) struct Board {
    image: PathBuf,
}

/// The board; none where it cannot be emulated.
pub(crate) fn board() -> Option<Board> {
    firmware::image("mps2-bits").map(|image| Board { image })
}

impl Board {
    /// Runs everything in `input`; gives the hashes, and the requested records.
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
