//! Files of the machine that runs the emulator.

use core::ffi::CStr;
use semihosting::fd::{BorrowedFd, OwnedFd, RawFd};
use semihosting::{fs::File, sys};

/// An open file, which is never closed: the image ends with the emulator.
#[derive(Clone, Copy)]
pub struct HostFile(RawFd);

impl HostFile {
    /// Opens a file to read.
    pub fn open(path: &CStr) -> Option<HostFile> {
        Some(HostFile::keep(File::open(path).ok()?))
    }

    /// Creates a file to write; opening one for writing without creating it is refused.
    pub fn create(path: &CStr) -> Option<HostFile> {
        Some(HostFile::keep(File::create(path).ok()?))
    }

    fn keep(file: File) -> HostFile {
        HostFile(OwnedFd::from(file).into_raw_fd())
    }

    /// Borrowing asserts the condition that is checked here first, so that no panic is left.
    fn fd(&self) -> Option<BorrowedFd<'_>> {
        // SAFETY: never closed.
        (self.0 != -1).then(|| unsafe { BorrowedFd::borrow_raw(self.0) })
    }

    /// Reads some bytes; gives their number, 0 at the end or on an error.
    pub fn read(&self, buffer: &mut [u8]) -> usize {
        self.fd().and_then(|fd| sys::read(fd, buffer).ok()).unwrap_or(0)
    }

    /// Writes all bytes; true if that was possible.
    pub fn write(&self, mut bytes: &[u8]) -> bool {
        while !bytes.is_empty() {
            let written = self.fd().and_then(|fd| sys::write(fd, bytes).ok()).filter(|n| *n > 0);
            match written.and_then(|n| bytes.get(n..)) {
                Some(rest) => bytes = rest,
                None => return false,
            }
        }
        true
    }
}
