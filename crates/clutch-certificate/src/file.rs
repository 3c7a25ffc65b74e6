//! A saved certificate: JSON, one object.

use crate::setup::{Certificate, VERSION};
use serde::Deserialize;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Largest file that is read, bytes: one of the widest box with the finest rows is a tenth of it.
const LARGEST: u64 = 1 << 30;

/// A certificate could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The system's answer.
    #[error("{name}: {error}")]
    Io {
        /// The file.
        name: String,
        /// The error.
        error: std::io::Error,
    },
    /// No certificate, or a damaged one.
    #[error("{name}: no certificate: {error}")]
    Format {
        /// The file.
        name: String,
        /// Key or place, and what was expected.
        error: serde_json::Error,
    },
    /// A folder, a pipe, a device.
    #[error("{name}: expected a file")]
    NoFile {
        /// Its name.
        name: String,
    },
    /// The file is too large.
    #[error("{name}: {size} bytes: expected a certificate, of at most {LARGEST}")]
    Size {
        /// The file.
        name: String,
        /// Its size.
        size: u64,
    },
    /// The format has another version.
    #[error("{name}: version is {version}: expected {VERSION}; look for the proof anew")]
    Version {
        /// The file.
        name: String,
        /// Its version.
        version: u32,
    },
}

/// The field that every version has.
#[derive(Deserialize)]
struct Versioned {
    version: u32,
}

/// Writes a certificate; a file of that name is replaced once the new one is whole.
///
/// # Errors
/// The system's.
pub fn write(path: &Path, certificate: &Certificate) -> Result<(), FileError> {
    let name = || path.display().to_string();
    let io = |error| FileError::Io { name: name(), error };
    let mut part = path.as_os_str().to_owned();
    part.push(".part");
    let mut out = BufWriter::new(std::fs::File::create(&part).map_err(io)?);
    serde_json::to_writer(&mut out, certificate)
        .map_err(|error| FileError::Format { name: name(), error })?;
    out.write_all(b"\n").and_then(|()| out.flush()).map_err(io)?;
    std::fs::rename(&part, path).map_err(io)
}

/// Reads a certificate. It says nothing until [`crate::checker::check`] has passed it.
///
/// # Errors
/// The file cannot be read, or holds no certificate of this version.
pub fn read(path: &Path) -> Result<Certificate, FileError> {
    let name = || path.display().to_string();
    let io = |error| FileError::Io { name: name(), error };
    // Before it is opened: a pipe would wait for somebody who writes.
    let about = std::fs::metadata(path).map_err(io)?;
    if !about.is_file() {
        return Err(FileError::NoFile { name: name() });
    }
    if about.len() > LARGEST {
        return Err(FileError::Size { name: name(), size: about.len() });
    }
    let bytes = std::fs::read(path).map_err(io)?;
    let format = |error| FileError::Format { name: name(), error };
    // First: another version has other fields.
    let Versioned { version } = serde_json::from_slice(&bytes).map_err(format)?;
    if version != VERSION {
        return Err(FileError::Version { name: name(), version });
    }
    serde_json::from_slice(&bytes).map_err(format)
}
