//! The errors of logs, with file, place and expectation.

use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// The reason why a log was not written or not read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LogError {
    /// The system refused.
    #[error("{}: {action}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The action that was tried.
        action: &'static str,
        /// The system's answer.
        source: io::Error,
    },
    /// No space left, quota reached, or the file is as large as it may get. Reported once; the
    /// writer is dead after it.
    #[error("{}: no space for the log: {source}; {written} records are in the file", path.display())]
    Full {
        /// The file.
        path: PathBuf,
        /// Records in chunks that are whole in the file.
        written: u64,
        /// The system's answer.
        source: io::Error,
    },
    /// A write after an error.
    #[error("{}: the log ended after {written} records, with the error reported then", path.display())]
    Closed {
        /// The file.
        path: PathBuf,
        /// Records in chunks that are whole in the file.
        written: u64,
    },
    /// A directory, a device, a pipe …
    #[error("{}: {found}: expected a regular file", path.display())]
    NotAFile {
        /// The path.
        path: PathBuf,
        /// The kind of thing that it is.
        found: &'static str,
    },
    /// Another program's file.
    #[error("{}: not a log of clutch: {found}: expected {expected}", path.display())]
    NotALog {
        /// The file.
        path: PathBuf,
        /// Its content at that place.
        found: String,
        /// The content that a log has there.
        expected: &'static str,
    },
    /// Cut so early that not even the header is whole.
    #[error("{}: cut at byte {at}, before the end of the log's header: no record to recover", path.display())]
    NoHeader {
        /// The file.
        path: PathBuf,
        /// Offset up to which the file's records are whole, bytes.
        at: u64,
    },
    /// A value in the header that cannot be.
    #[error("{}: {key} = \"{value}\" in the log's header: expected {expected}", path.display())]
    Header {
        /// The file.
        path: PathBuf,
        /// Its key.
        key: String,
        /// Its value.
        value: String,
        /// The expectation.
        expected: &'static str,
    },
    /// More than [`Limits`](crate::Limits) allow.
    #[error("{}: {what} = {value}: expected at most {limit}; raise the reader's limit if you trust this file",
        path.display())]
    Limit {
        /// The file.
        path: PathBuf,
        /// The quantity, with its unit.
        what: &'static str,
        /// Its value.
        value: u64,
        /// The highest value allowed.
        limit: u64,
    },
    /// A record of the header that cannot be read. Damage further on is not an error: see
    /// [`Scanned`](crate::Scanned).
    #[error("{}: byte {offset}: {what}", path.display())]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// Start of the record, bytes.
        offset: u64,
        /// The fault, and the expectation.
        what: String,
    },
    /// The caller ended the reading.
    #[error("{}: reading was ended", path.display())]
    Stopped {
        /// The file.
        path: PathBuf,
    },
    /// A log cannot be recovered into itself.
    #[error("{}: source and destination are the same file: expected two", path.display())]
    SameFile {
        /// The file.
        path: PathBuf,
    },
}

impl LogError {
    pub(crate) fn io(path: &Path, action: &'static str, source: io::Error) -> LogError {
        LogError::Io { path: path.into(), action, source }
    }

    /// An error while writing: a full disk has its own variant.
    pub(crate) fn writing(path: &Path, written: u64, source: io::Error) -> LogError {
        use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        match source.kind() {
            StorageFull | QuotaExceeded | FileTooLarge => {
                LogError::Full { path: path.into(), written, source }
            }
            _ => LogError::io(path, "cannot write", source),
        }
    }
}

/// The kind of `path`, if it exists and is not a regular file: a log is never written into a device
/// or a pipe, and opening a pipe would wait for its other end.
pub(crate) fn require_file(path: &Path, file: &std::fs::Metadata) -> Result<(), LogError> {
    let kind = file.file_type();
    if kind.is_file() {
        return Ok(());
    }
    let found = if kind.is_dir() { "a directory" } else { "a device, pipe or socket" };
    Err(LogError::NotAFile { path: path.into(), found })
}
