//! Results of the calls that read and write a line.

use rustix::io::Errno;
use std::io;

/// A read's result: nothing there is `Ok(0)`, the end of the line is `BrokenPipe`.
pub(super) fn received(result: rustix::io::Result<usize>) -> io::Result<usize> {
    match result {
        Ok(0) => Err(io::ErrorKind::BrokenPipe.into()),
        Ok(count) => Ok(count),
        Err(Errno::AGAIN | Errno::INTR) => Ok(0),
        Err(error) => Err(gone(error)),
    }
}

/// A write's result: a full buffer is `Ok(0)`.
pub(super) fn sent(result: rustix::io::Result<usize>) -> io::Result<usize> {
    match result {
        Ok(count) => Ok(count),
        Err(Errno::AGAIN | Errno::INTR) => Ok(0),
        Err(error) => Err(gone(error)),
    }
}

/// The many ways in which the kernel says that nobody is there any more, as one.
fn gone(error: Errno) -> io::Error {
    match error {
        Errno::IO
        | Errno::NXIO
        | Errno::NODEV
        | Errno::PIPE
        | Errno::CONNRESET
        | Errno::CONNABORTED
        | Errno::SHUTDOWN
        | Errno::NOTCONN
        | Errno::TIMEDOUT
        | Errno::HOSTUNREACH
        | Errno::NETUNREACH => io::ErrorKind::BrokenPipe.into(),
        other => other.into(),
    }
}
