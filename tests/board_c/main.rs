//! The board in C of examples/board-c: it behaves like the Rust board, byte for byte, and runs a
//! session on a pseudo-terminal.

mod compare;
mod rules;
mod session;

use std::path::{Path, PathBuf};
use std::process::Command;

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Compiles C sources to a program; none, with a message, where there is no compiler. CI has one.
fn compiled(name: &str, sources: &[&str]) -> Option<PathBuf> {
    let works = |c: &&str| Command::new(c).arg("--version").output().is_ok_and(|o| o.status.success());
    let Some(gcc) = ["gcc", "cc"].into_iter().find(works) else {
        assert!(std::env::var_os("CI").is_none(), "no C compiler: CI must not skip this test");
        println!("skipped: neither gcc nor cc is installed");
        return None;
    };
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let done = Command::new(gcc)
        .args(["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", "-O1"])
        .arg("-I")
        .arg(project().join("crates/clutch-wire/include"))
        .arg("-I")
        .arg(project().join("examples/board-c"))
        .args(sources.iter().map(|source| project().join(source)))
        .arg("-o")
        .arg(&program)
        .output()
        .expect("the compiler starts");
    assert!(done.status.success(), "{gcc}:\n{}", String::from_utf8_lossy(&done.stderr));
    Some(program)
}

/// xorshift64*.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    /// 0 to `end` − 1.
    fn below(&mut self, end: u64) -> u64 {
        ((u128::from(self.next()) * u128::from(end)) >> 64) as u64
    }

    /// From `low` to `high`, both included.
    fn range(&mut self, low: u32, high: u32) -> u32 {
        low + self.below(u64::from(high - low) + 1) as u32
    }

    /// `times` in `of`.
    fn chance(&mut self, times: u64, of: u64) -> bool {
        self.below(of) < times
    }
}
