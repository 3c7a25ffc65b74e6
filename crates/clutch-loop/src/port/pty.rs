//! A pseudo-terminal as the end of a simulated board.

use super::results::{received, sent};
use super::{Address, ClientEvent, DEFAULT_BAUD, Endpoint};
use crate::realtime::{Readiness, WaitMode, monotonic_ns, sleep_until, wait_readable};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::{AsFd, OwnedFd};
use rustix::fs::{Mode, OFlags, fcntl_getfl, fcntl_setfl, open};
use rustix::pty::{OpenptFlags, grantpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr};
use std::ffi::OsString;
use std::io;
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};

/// The board's end of a pseudo-terminal. Programs open its other end as they would a serial
/// device.
///
/// The slave is not kept open on this side: then the kernel reports exactly whether a client has it
/// open, however it was opened and however it ended. The pseudo-terminal itself lives as long as
/// this value. Bytes that a client wrote before it left can still be read, as on a cable: the last of
/// them may be the command to stop. Then the line is set to raw again, and what the client has not
/// read is dropped.
#[derive(Debug)]
pub struct PseudoTerminal {
    master: OwnedFd,
    path: PathBuf,
    /// As last reported by [`Endpoint::service`].
    present: bool,
}

impl PseudoTerminal {
    /// Makes a pseudo-terminal in raw mode, and says at which path clients open it.
    ///
    /// # Errors
    /// As the system gives it.
    pub fn open() -> io::Result<(PseudoTerminal, PathBuf)> {
        let master = rustix::pty::openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        let path = PathBuf::from(OsString::from_vec(ptsname(&master, Vec::new())?.into_bytes()));
        fcntl_setfl(&master, fcntl_getfl(&master)? | OFlags::NONBLOCK)?;
        let terminal = PseudoTerminal { master, path: path.clone(), present: false };
        // Before the first opening the kernel does not report that nobody is there.
        terminal.reset()?;
        Ok((terminal, path))
    }

    /// The path at which clients open it.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A client has the line open, as the last [`Endpoint::service`] found.
    #[must_use]
    pub fn client_present(&self) -> bool {
        self.present
    }

    /// Raw bytes, and nothing left for the next client to read.
    fn reset(&self) -> io::Result<()> {
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let slave = open(&self.path, flags, Mode::empty())?;
        let mut modes = tcgetattr(&slave)?;
        modes.make_raw();
        tcsetattr(&slave, OptionalActions::Now, &modes)?;
        tcflush(&slave, QueueSelector::IFlush)?;
        Ok(())
    }

    /// A client has the line open, or its last bytes are still to be read.
    fn in_use(&self) -> io::Result<bool> {
        let mut fds = [PollFd::from_borrowed_fd(self.master.as_fd(), PollFlags::IN)];
        poll(&mut fds, Some(&Timespec { tv_sec: 0, tv_nsec: 0 }))?;
        let seen = fds[0].revents();
        Ok(seen.contains(PollFlags::IN) || !seen.contains(PollFlags::HUP))
    }
}

impl Endpoint for PseudoTerminal {
    fn service(&mut self) -> io::Result<Option<ClientEvent>> {
        let present = self.in_use()?;
        if present == self.present {
            return Ok(None);
        }
        self.present = present;
        if present {
            return Ok(Some(ClientEvent::Connected));
        }
        // A client that marked the line as exclusive and was killed leaves it closed to all but
        // root, us included. Then the line stays as it is.
        let _ = self.reset();
        Ok(Some(ClientEvent::Left))
    }

    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize> {
        if buf.is_empty() {
            return Ok(0);
        }
        match received(rustix::io::read(&self.master, buf)) {
            // Nobody has the other end open.
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(0),
            other => other,
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // The kernel would keep the bytes for the next client.
        if !self.present {
            return Ok(bytes.len());
        }
        match sent(rustix::io::write(&self.master, bytes)) {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(bytes.len()),
            other => other,
        }
    }

    fn wait(&self, until_ns: u64, mode: WaitMode) -> Readiness {
        wait_or_sleep(self.master.as_fd(), until_ns, mode)
    }

    fn address(&self) -> Address {
        Address::Serial { path: self.path.clone(), baud: DEFAULT_BAUD }
    }
}

/// With no peer connected, poll returns immediately; sleep instead of busy-looping.
pub(super) fn wait_or_sleep(fd: rustix::fd::BorrowedFd<'_>, until_ns: u64, mode: WaitMode) -> Readiness {
    /// The longest time until a new client is noticed, ns.
    const NAP: u64 = 10_000_000;
    loop {
        match wait_readable(fd, until_ns, mode) {
            Readiness::HungUp => {
                let now = monotonic_ns();
                if now >= until_ns {
                    return Readiness::Timeout;
                }
                sleep_until(until_ns.min(now.saturating_add(NAP)), mode);
            }
            seen => return seen,
        }
    }
}
