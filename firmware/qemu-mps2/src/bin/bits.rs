//! The runs of the test of equal bits, on the emulated board: from the file `bits.in` in the emulator's
//! directory, hashes to the console, requested records to `bits.out`.
#![no_std]
#![no_main]

#[path = "../files.rs"]
mod files;
#[path = "../../../shared/panic.rs"]
mod panic;

use clutch_bits::{Failed, Files, repeat};
use cortex_m_rt::entry;
use files::HostFile;
use semihosting::process;

/// The files of the machine that runs the emulator.
struct HostFiles {
    input: HostFile,
    console: HostFile,
    records: HostFile,
}

impl Files for HostFiles {
    fn read(&mut self, buffer: &mut [u8]) -> usize {
        self.input.read(buffer)
    }

    fn print(&mut self, line: &[u8]) -> bool {
        self.console.write(line)
    }

    fn keep(&mut self, record: &[u8]) -> bool {
        self.records.write(record)
    }
}

#[entry]
fn main() -> ! {
    process::exit(match all() {
        Ok(()) => 0,
        Err(failed) => failed as i32,
    })
}

fn all() -> Result<(), Failed> {
    let [Some(input), Some(records), Some(console)] =
        [HostFile::open(c"bits.in"), HostFile::create(c"bits.out"), HostFile::create(c":tt")]
    else {
        return Err(Failed::Files);
    };
    repeat(&mut HostFiles { input, console, records })
}
