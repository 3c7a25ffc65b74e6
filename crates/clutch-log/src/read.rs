//! A whole log in memory.

use crate::error::LogError;
use crate::header::Header;
use crate::record::{
    ChangeRecord, CommandRecord, EventRecord, LinkRecord, Record, SampleRecord, TruthRecord,
};
use crate::scan::{Damage, Each, Limits, Scanned, Tail, scan_bytes, scan_file};
use std::ops::ControlFlow;
use std::path::Path;

/// Records between two questions whether reading goes on: a millisecond or two.
const ASK_EVERY: u64 = 4096;

/// A log, each channel in the order of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Log {
    /// The log's description of itself.
    pub header: Header,
    /// Channel `/sample`.
    pub samples: Vec<SampleRecord>,
    /// Channel `/command`.
    pub commands: Vec<CommandRecord>,
    /// Channel `/event`.
    pub events: Vec<EventRecord>,
    /// Channel `/link`.
    pub links: Vec<LinkRecord>,
    /// Channel `/change`.
    pub changes: Vec<ChangeRecord>,
    /// Channel `/truth`.
    pub truths: Vec<TruthRecord>,
    /// Finished by its writer and without damage. If not, see `end` and `damage`.
    pub complete: bool,
    /// The end of the file.
    pub tail: Tail,
    /// The first damaged place that was skipped.
    pub damage: Option<Damage>,
    /// Number of damaged places that were skipped.
    pub damaged: u64,
    /// Time of the run from which on records follow a gap, ns: something between them was damaged.
    pub gap_from_ns: Option<u64>,
    /// Size of the file, bytes.
    pub file_bytes: u64,
    /// Bytes of it that gave nothing.
    pub left_out_bytes: u64,
}

impl Log {
    /// Records of all channels.
    #[must_use]
    pub fn records(&self) -> usize {
        let told = self.events.len() + self.links.len() + self.changes.len();
        self.samples.len() + self.commands.len() + told + self.truths.len()
    }
}

/// Reads a log, even one that was cut: then `complete` is false.
///
/// # Errors
/// No such file, or no log; more than `limits` allow; a header that cannot be read.
pub fn read(path: impl AsRef<Path>, limits: &Limits) -> Result<Log, LogError> {
    read_while(path, limits, || ControlFlow::Continue(()))
}

/// The same for as long as `go_on`, which is asked every few thousand records, does not break.
///
/// # Errors
/// As for [`read`]; [`LogError::Stopped`] after a break.
pub fn read_while(
    path: impl AsRef<Path>,
    limits: &Limits,
    go_on: impl FnMut() -> ControlFlow<()>,
) -> Result<Log, LogError> {
    let path = path.as_ref();
    collect(path, limits, go_on, |each| scan_file(path, limits, false, each))
}

/// Reads a log in memory.
///
/// # Errors
/// As for [`read`], except those of the system.
pub fn read_bytes(bytes: &[u8], limits: &Limits) -> Result<Log, LogError> {
    let path = Path::new("<memory>");
    collect(path, limits, || ControlFlow::Continue(()), |each| scan_bytes(bytes, path, limits, each))
}

fn collect(
    path: &Path,
    limits: &Limits,
    mut go_on: impl FnMut() -> ControlFlow<()>,
    scan: impl FnOnce(Each<'_>) -> Result<Scanned, LogError>,
) -> Result<Log, LogError> {
    let (mut samples, mut commands, mut events) = (Vec::new(), Vec::new(), Vec::new());
    let (mut links, mut changes, mut truths) = (Vec::new(), Vec::new(), Vec::new());
    let mut records = 0;
    let seen = scan(&mut |_, record| {
        records += 1;
        if records > limits.max_records {
            let (path, limit) = (path.into(), limits.max_records);
            return Err(LogError::Limit { path, what: "records", value: records, limit });
        }
        if records % ASK_EVERY == 0 && go_on().is_break() {
            return Err(LogError::Stopped { path: path.into() });
        }
        match record {
            Record::Sample(r) => samples.push(r),
            Record::Command(r) => commands.push(r),
            Record::Event(r) => events.push(r),
            Record::Link(r) => links.push(r),
            Record::Change(r) => changes.push(r),
            Record::Truth(r) => truths.push(r),
        }
        Ok(())
    })?;
    let complete = seen.complete();
    let Scanned { header, tail, damage, damaged, gap_from_ns, file_bytes, left_out_bytes, .. } = seen;
    Ok(Log {
        header,
        samples,
        commands,
        events,
        links,
        changes,
        truths,
        complete,
        tail,
        damage,
        damaged,
        gap_from_ns,
        file_bytes,
        left_out_bytes,
    })
}
