//! The runs of the test of equal bits, on the emulated board. Reads them from the file `bits.in` in the
//! emulator's directory, prints the hash of each on a line of its own, and writes the records of
//! those that request it to `bits.out`.
#![no_std]
#![no_main]

#[path = "../files.rs"]
mod files;
#[path = "../../../shared/panic.rs"]
mod panic;

use clutch_bits::{HEADER, Job, RECORD, SETTING, Workload, hash, setting_from_bytes};
use clutch_core::Counts;
use clutch_node::Settings;
use cortex_m_rt::entry;
use files::HostFile;
use semihosting::process;

/// Bytes requested from the host at once.
const ROOM: usize = 4096;

/// Codes on exit: the fault.
enum Failed {
    Files = 2,
    Input = 3,
    Settings = 4,
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
    let mut input = Input { file: input, buffer: [0; ROOM], from: 0, to: 0 };
    while let Some(header) = input.next::<HEADER>() {
        let hash = run(&Job::from_bytes(&header), &mut input, &records)?;
        if !console.write(&line(hash)) {
            return Err(Failed::Files);
        }
    }
    Ok(())
}

/// One run; its hash.
fn run(job: &Job, input: &mut Input, records: &HostFile) -> Result<u32, Failed> {
    let mut settings = Settings::default();
    for _ in 0..job.settings {
        let (key, value) = setting_from_bytes(input.next::<SETTING>().ok_or(Failed::Input)?);
        if !settings.set(key, value) {
            return Err(Failed::Settings);
        }
    }
    let mut hash = hash();
    let mut workload = None;
    for tick in 0..job.ticks {
        let counts = Counts(i32::from_le_bytes(input.next().ok_or(Failed::Input)?));
        // The first count is also the one at which the run begins.
        let workload = match &mut workload {
            Some(workload) => workload,
            none => none.insert(
                Workload::new(&settings, job.origin, counts, job.volts).map_err(|_| Failed::Settings)?,
            ),
        };
        let mut record: [u8; RECORD] = workload.tick(counts);
        if let Some((at, bit)) = job.spoil
            && at == tick
            && let Some(byte) = record.get_mut((bit / 8) as usize)
        {
            *byte ^= 1 << (bit % 8);
        }
        hash.update(record.get(..workload.hashed()).unwrap_or_default());
        if job.dump && !records.write(&record) {
            return Err(Failed::Files);
        }
    }
    Ok(hash.finalize())
}

/// A hash as a line of text.
fn line(hash: u32) -> [u8; 9] {
    let mut text = *b"00000000\n";
    for (place, digit) in text.iter_mut().zip((0..8).rev().map(|i| (hash >> (4 * i)) as u8 & 0xf)) {
        *place = if digit < 10 { b'0' + digit } else { b'a' + digit - 10 };
    }
    text
}

/// A file, read in pieces.
struct Input {
    file: HostFile,
    buffer: [u8; ROOM],
    from: usize,
    to: usize,
}

impl Input {
    /// The next bytes; none at the end.
    fn next<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut bytes = [0; N];
        for byte in &mut bytes {
            if self.from == self.to {
                (self.from, self.to) = (0, self.file.read(&mut self.buffer));
                if self.to == 0 {
                    return None;
                }
            }
            *byte = *self.buffer.get(self.from)?;
            self.from = self.from.wrapping_add(1);
        }
        Some(bytes)
    }
}
