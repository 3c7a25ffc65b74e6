//! The runs of a file, one after the other: the same on every machine that has files.

use crate::{HEADER, Job, RECORD, SETTING, Workload, hash, setting_from_bytes};
use clutch_core::Counts;
use clutch_settings::Settings;

/// Bytes requested at once.
const ROOM: usize = 4096;

/// The files of a machine.
pub trait Files {
    /// Reads some bytes of the runs; gives their number, 0 at the end.
    fn read(&mut self, buffer: &mut [u8]) -> usize;
    /// Prints a line; true if that was possible.
    fn print(&mut self, line: &[u8]) -> bool;
    /// Writes a record of a run that requests it; true if that was possible.
    fn keep(&mut self, record: &[u8]) -> bool;
}

/// The fault that ended the runs; as a number, the code on exit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Failed {
    /// A file cannot be read or written.
    Files = 2,
    /// The runs end within one.
    Input = 3,
    /// Settings that make no run.
    Settings = 4,
}

/// Repeats all runs, and prints the hash of each on a line of its own.
///
/// # Errors
/// Input that is not as it should be, or a file that cannot be written.
pub fn repeat(files: &mut impl Files) -> Result<(), Failed> {
    let mut input = Input { files, buffer: [0; ROOM], from: 0, to: 0 };
    while let Some(header) = input.next::<HEADER>() {
        let hash = run(&Job::from_bytes(&header), &mut input)?;
        if !input.files.print(&line(hash)) {
            return Err(Failed::Files);
        }
    }
    Ok(())
}

/// One run; its hash.
fn run(job: &Job, input: &mut Input<'_, impl Files>) -> Result<u32, Failed> {
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
        if job.dump && !input.files.keep(&record) {
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

/// The runs, read in pieces.
struct Input<'a, F> {
    files: &'a mut F,
    buffer: [u8; ROOM],
    from: usize,
    to: usize,
}

impl<F: Files> Input<'_, F> {
    /// The next bytes; none at the end.
    fn next<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut bytes = [0; N];
        for byte in &mut bytes {
            if self.from == self.to {
                (self.from, self.to) = (0, self.files.read(&mut self.buffer));
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
