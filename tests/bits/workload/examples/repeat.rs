//! The runs of the test of equal bits, as a program: from the file `bits.in`, hashes to standard output, requested
//! records to `bits.out`. The test runs it as one for another processor.

use clutch_bits::{Files, repeat};
use std::fs::File;
use std::io::{BufWriter, Read, Stdout, Write, stdout};
use std::process::ExitCode;

/// The files in the folder in which it runs.
struct Here {
    input: File,
    console: Stdout,
    records: BufWriter<File>,
}

impl Files for Here {
    fn read(&mut self, buffer: &mut [u8]) -> usize {
        self.input.read(buffer).unwrap_or(0)
    }

    fn print(&mut self, line: &[u8]) -> bool {
        self.console.write_all(line).is_ok()
    }

    fn keep(&mut self, record: &[u8]) -> bool {
        self.records.write_all(record).is_ok()
    }
}

fn main() -> std::io::Result<ExitCode> {
    let (input, records) = (File::open("bits.in")?, BufWriter::new(File::create("bits.out")?));
    let mut here = Here { input, console: stdout(), records };
    let done = repeat(&mut here);
    here.records.flush()?;
    Ok(done.map_or_else(|failed| ExitCode::from(failed as u8), |()| ExitCode::SUCCESS))
}
