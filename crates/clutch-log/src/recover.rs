//! Makes a finished log from one that was cut.

use crate::error::LogError;
use crate::header::Header;
use crate::names::EventKind;
use crate::record::{EventRecord, Record};
use crate::scan::{Limits, Scanned, scan_file};
use crate::write::{LogWriter, Summary};
use std::fmt;
use std::path::Path;

/// Key in [`Header::extra`] of a recovered log: the losses of the original.
const RECOVERED: &str = "recovered";

/// The saved records, and the losses.
#[derive(Clone, Debug, PartialEq)]
pub struct Recovered {
    /// The new file.
    pub summary: Summary,
    /// Records in it.
    pub records: u64,
    /// Time of the last of them since the start of the run, ns.
    pub until_ns: u64,
    /// Bytes of the old file that gave nothing.
    pub left_out_bytes: u64,
    /// The old file.
    pub scanned: Scanned,
}

impl fmt::Display for Recovered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let until = self.until_ns as f64 * 1e-9;
        let (s, to) = (&self.scanned, self.summary.path.display());
        write!(f, "{to}: {} records, up to {until:.3} s; the original is {}", self.records, s.tail)?;
        write!(f, ", {} of its {} bytes left out", self.left_out_bytes, s.file_bytes)?;
        if let Some(damage) = &s.damage {
            write!(f, "; {} damaged places, the first: {damage}", s.damaged)?;
        }
        Ok(())
    }
}

/// Writes every record of `from` that can be read to a new, finished log `to`, which is
/// overwritten. Damaged chunks in the middle are skipped and reported. The records are the same bit
/// for bit; the header gets the extra key `recovered`, and the first record behind a damaged place an event `LogDropped`
/// before it, with the value 0: their number is not known.
///
/// # Errors
/// As for [`read`](crate::read) and [`LogWriter`]; `from` and `to` are one file. The number of
/// records is not limited.
pub fn recover(from: impl AsRef<Path>, to: impl AsRef<Path>, limits: &Limits) -> Result<Recovered, LogError> {
    let (from, to) = (from.as_ref(), to.as_ref());
    if let (Ok(a), Ok(b)) = (std::fs::metadata(from), std::fs::metadata(to))
        && same(&a, &b, from, to)
    {
        return Err(LogError::SameFile { path: to.into() });
    }
    // The file is read twice: the new header reports the end of the old file.
    let scanned = scan_file(from, limits, true, &mut |_, _| Ok(()))?;
    let mut header: Header = scanned.header.clone();
    header.extra.retain(|(key, _)| key != RECOVERED);
    header.extra.push((
        RECOVERED.into(),
        format!(
            "original {}; {} of {} bytes left out{}",
            scanned.tail,
            scanned.left_out_bytes,
            scanned.file_bytes,
            scanned.damage.as_ref().map_or(String::new(), |damage| format!("; damaged at {damage}")),
        ),
    ));
    let mut log = LogWriter::create(to, &header)?;
    let mut gap = scanned.gap_from_ns;
    scan_file(from, limits, true, &mut |_, record| {
        if gap.is_some_and(|from| record.time_ns() >= from) {
            gap = None;
            let kind = EventKind::LogDropped as u8;
            let (tick, time_ns) = (record.tick(), record.time_ns());
            log.write(&Record::Event(EventRecord { tick, time_ns, kind, ..EventRecord::default() }))?;
        }
        log.write(&record)
    })?;
    let summary = log.finish()?;
    Ok(Recovered {
        records: summary.records,
        until_ns: summary.last_ns,
        left_out_bytes: scanned.left_out_bytes,
        summary,
        scanned,
    })
}

#[cfg(unix)]
fn same(a: &std::fs::Metadata, b: &std::fs::Metadata, _: &Path, _: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _; // links, hard ones too, lead to one inode
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

#[cfg(not(unix))]
fn same(_: &std::fs::Metadata, _: &std::fs::Metadata, from: &Path, to: &Path) -> bool {
    matches!((from.canonicalize(), to.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
