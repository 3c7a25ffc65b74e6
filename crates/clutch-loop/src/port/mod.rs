//! The line to the board: a serial device, a pseudo-terminal, a TCP connection or a UNIX
//! socket.
//!
//! [`Port`] is a station's end. It owns one non-blocking file descriptor; [`Port::read`] and
//! [`Port::write`] make one system call each and never allocate. Waiting is the caller's, with
//! [`wait_readable`](crate::realtime::wait_readable).
//!
//! [`PseudoTerminal`] and [`Listener`] are the other end, for a simulated board; [`Endpoint`] is
//! what they have in common.
//!
//! **One program per port.** A port is locked (`flock`) as long as it is open, and a serial device
//! is also opened exclusively (`TIOCEXCL`). Either alone is not enough: exclusive opening does not
//! stop root, and the lock stops only those who ask for it. A pseudo-terminal is locked but not
//! exclusive: there the kernel keeps the exclusive mark after a program was killed, and everybody
//! but root would find the port busy for as long as the board runs
//! (`a_pseudo_terminal_can_be_opened_again_after_its_client_was_killed`).

mod address;
mod device;
mod endpoint;
mod error;
mod listener;
mod pty;
mod results;

pub use address::{Address, AddressError, DEFAULT_BAUD};
pub use device::{DeviceKind, STANDARD_BAUDS, check_baud};
pub use endpoint::{ClientEvent, Endpoint};
pub use error::{Holder, PortError};
pub use listener::{BUSY_LINE, Listener};
pub use pty::PseudoTerminal;

use results::{received, sent};
use rustix::fd::{AsFd, BorrowedFd, OwnedFd};
use rustix::fs::{FlockOperation, Mode, OFlags, flock, open};
use rustix::io::Errno;
use rustix::net::SendFlags;
use rustix::termios::{
    ControlModes, OptionalActions, QueueSelector, ioctl_tiocexcl, ioctl_tiocnxcl, tcflush, tcgetattr,
    tcsetattr,
};
use std::io;
use std::net::{SocketAddr, TcpStream};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

/// The longest time that opening a TCP connection may take, s.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(2);

/// The setup of a serial device. Ignored for TCP.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SerialOptions {
    /// Line rate, baud, in place of the address's.
    pub baud: Option<u32>,
    /// Ask the adapter's driver to hand bytes over at once.
    pub low_latency: bool,
}

impl Default for SerialOptions {
    fn default() -> Self {
        SerialOptions { baud: None, low_latency: true }
    }
}

/// The result of [`Port::open`].
#[derive(Debug)]
pub struct Opened {
    /// The open port.
    pub port: Port,
    /// The facts that the user should know, a sentence each: settings the driver refused and what that
    /// costs.
    pub notes: Vec<String>,
}

/// A station's end of the line: one non-blocking file descriptor, locked while it is open.
#[derive(Debug)]
pub struct Port {
    fd: OwnedFd,
    kind: DeviceKind,
    address: Address,
    baud: u32,
    /// Nothing has been read yet: a "busy" may still come (TCP only).
    fresh: bool,
}

impl Port {
    /// Opens and locks the line, sets it to raw bytes (8 data bits, no parity, 1 stop bit, no flow
    /// control) and drops what was waiting in it.
    ///
    /// # Errors
    /// Each [`PortError`] says what is wrong and what to do.
    pub fn open(address: &Address, options: &SerialOptions) -> Result<Opened, PortError> {
        match address {
            Address::Serial { path, baud } => {
                open_serial(address, path, options.baud.unwrap_or(*baud), options)
            }
            Address::Tcp(to) => open_tcp(address, *to),
            Address::Unix(path) => open_unix(address, path),
        }
    }

    /// Reads what is there, with one system call. `Ok(0)`: nothing now.
    ///
    /// # Errors
    /// `BrokenPipe`: the other side is gone (unplugged, or its program ended), and stays so.
    /// `ResourceBusy`: the board at this TCP address serves another client. Any other error is as
    /// the system gave it. [`Port::explain`] makes a message of each.
    pub fn read(&mut self, buf: &mut [u8]) -> io::Result<usize> {
        if buf.is_empty() {
            return Ok(0); // a read of 0 bytes would look like the end
        }
        let count = received(rustix::io::read(&self.fd, &mut *buf))?;
        if self.fresh && count > 0 {
            self.fresh = false;
            if buf.get(..count).is_some_and(|got| got.starts_with(BUSY_LINE)) {
                return Err(io::ErrorKind::ResourceBusy.into());
            }
        }
        Ok(count)
    }

    /// Writes as much as the line takes now, with one system call, and says how much that was:
    /// less than all, or `Ok(0)`, if its buffer is full. The rest is not kept: a command that is
    /// late is worth less than the next one. The caller counts what was cut; the frames' own
    /// checks reject the piece.
    ///
    /// # Errors
    /// As for [`Port::read`].
    pub fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.kind.is_socket() {
            return sent(rustix::net::send(&self.fd, bytes, SendFlags::NOSIGNAL));
        }
        sent(rustix::io::write(&self.fd, bytes))
    }

    /// The kind of device at the other end.
    #[must_use]
    pub fn kind(&self) -> DeviceKind {
        self.kind
    }

    /// The address at which it was opened.
    #[must_use]
    pub fn address(&self) -> &Address {
        &self.address
    }

    /// The line rate set, baud. Without meaning unless [`DeviceKind::has_line_rate`].
    #[must_use]
    pub fn baud(&self) -> u32 {
        self.baud
    }

    /// Holds the line rate against the bytes of a cycle, (to the board, to the host), and the
    /// period. The note says that the line is nearly full, or that the rate does not count here.
    ///
    /// # Errors
    /// [`PortError::BaudTooSlow`], with the arithmetic.
    pub fn check_baud(&self, bytes: (usize, usize), period: Duration) -> Result<Option<String>, PortError> {
        if !self.kind.has_line_rate() {
            return Ok(Some(format!(
                "{}: {}; a baud rate has no effect on it and was not checked",
                self.address,
                self.kind.describe()
            )));
        }
        check_baud(self.baud, bytes, period)?;
        Ok(device::tight_line(self.baud, bytes, period))
    }

    /// Drops all bytes that wait in either direction. No effect on sockets.
    ///
    /// # Errors
    /// As the system gives it.
    pub fn discard(&mut self) -> io::Result<()> {
        if self.kind.is_socket() {
            return Ok(());
        }
        Ok(tcflush(&self.fd, QueueSelector::IOFlush)?)
    }

    /// The error of a read or write as a message that says what to do.
    #[must_use]
    pub fn explain(&self, error: &io::Error) -> PortError {
        match error.kind() {
            io::ErrorKind::BrokenPipe => PortError::Unplugged { address: self.address.clone() },
            io::ErrorKind::ResourceBusy => PortError::Busy { address: self.address.clone(), holder: None },
            kind => PortError::Io {
                address: self.address.clone(),
                source: error.raw_os_error().map_or_else(|| kind.into(), io::Error::from_raw_os_error),
            },
        }
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        // Closing gives both up, unless a program being started at this instant still has a copy of
        // the descriptor: it keeps one until its own code is loaded.
        if !self.kind.is_socket() {
            let _ = flock(&self.fd, FlockOperation::NonBlockingUnlock);
        }
        if matches!(self.kind, DeviceKind::UsbCdc | DeviceKind::UsbSerial | DeviceKind::Uart) {
            let _ = ioctl_tiocnxcl(&self.fd);
        }
    }
}

impl AsFd for Port {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.fd.as_fd()
    }
}

fn open_serial(
    address: &Address,
    path: &Path,
    baud: u32,
    options: &SerialOptions,
) -> Result<Opened, PortError> {
    let fail = |errno: Errno| PortError::from_open(address, path, errno);
    // Before opening: opening a device of another kind can have effects.
    let found =
        device::classify_path(Path::new("/sys"), path).map_err(|why| why.into_error(address, path))?;

    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let fd = open(path, flags, Mode::empty()).map_err(fail)?;
    let mut notes = Vec::new();

    // The lock comes first: a port in use must not notice that somebody tried.
    match flock(&fd, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => {}
        Err(Errno::WOULDBLOCK) => {
            return Err(PortError::Busy { address: address.clone(), holder: error::lock_holder(path) });
        }
        Err(error) => notes.push(format!(
            "{address}: the lock was refused ({error}); another program could open it too. Make sure none does"
        )),
    }
    if found.kind != DeviceKind::PseudoTerminal {
        if let Err(error) = ioctl_tiocexcl(&fd) {
            notes.push(format!(
                "{address}: exclusive opening was refused ({error}); another program could open it too"
            ));
        }
    } else if device::is_own_terminal(&fd) {
        return Err(PortError::NotASerialDevice {
            path: path.to_owned(),
            why: "it is the terminal this program runs in".to_owned(),
        });
    }

    let fd = set_raw(fd, address, path, baud)?;
    if options.low_latency && found.kind.has_line_rate() {
        let refused = device::set_low_latency(&fd).err();
        notes.extend(found.latency_note(&address.to_string(), refused.as_ref(), found.latency_timer_ms()));
    }
    // Bytes of before, from a board nobody listened to, are too old to be acted on.
    tcflush(&fd, QueueSelector::IOFlush).map_err(fail)?;
    let port = Port { fd, kind: found.kind, address: address.clone(), baud, fresh: false };
    Ok(Opened { port, notes })
}

/// Raw 8N1 without flow control or modem lines; reading without bytes is "not now", not the end.
fn set_raw(fd: OwnedFd, address: &Address, path: &Path, baud: u32) -> Result<OwnedFd, PortError> {
    let fail = |errno: Errno| PortError::from_open(address, path, errno);
    // Bytes stuck in the output would hold the new settings up.
    tcflush(&fd, QueueSelector::IOFlush).map_err(fail)?;

    let mut serial = serial2::SerialPort::from(fd);
    let io = |source: io::Error| PortError::Io { address: address.clone(), source };
    let mut settings = serial.get_configuration().map_err(io)?;
    settings.set_raw();
    settings.set_baud_rate(baud).map_err(io)?;
    if let Err(source) = serial.set_configuration(&settings) {
        // The settings are the same for everybody but the rate: that is what a driver refuses.
        return Err(PortError::BaudRefused { address: address.clone(), baud, source });
    }
    let fd = std::fs::File::from(rustix::io::fcntl_dupfd_cloexec(&serial, 0).map_err(fail)?);
    drop(serial);

    let mut modes = tcgetattr(&fd).map_err(fail)?;
    // Without CLOCAL a board that does not drive "carrier detect" counts as unplugged.
    modes.control_modes |= ControlModes::CLOCAL | ControlModes::CREAD;
    tcsetattr(&fd, OptionalActions::Now, &modes).map_err(fail)?;
    Ok(fd.into())
}

fn open_tcp(address: &Address, to: SocketAddr) -> Result<Opened, PortError> {
    let stream = TcpStream::connect_timeout(&to, CONNECT_TIMEOUT).map_err(|source| match source.kind() {
        io::ErrorKind::ConnectionRefused => PortError::ConnectionRefused { to },
        _ => PortError::Unreachable { to, source },
    })?;
    let io = |source: io::Error| PortError::Io { address: address.clone(), source };
    stream.set_nonblocking(true).map_err(io)?;
    // A command must leave at once, not wait for a fuller packet.
    stream.set_nodelay(true).map_err(io)?;
    let mut notes = Vec::new();
    if !to.ip().is_loopback() {
        notes.push(format!(
            "{address}: a network adds delays of its own, and neither end proves who it is; use it only on a line of \
             your own"
        ));
    }
    let port =
        Port { fd: stream.into(), kind: DeviceKind::Tcp, address: address.clone(), baud: 0, fresh: true };
    Ok(Opened { port, notes })
}

fn open_unix(address: &Address, path: &Path) -> Result<Opened, PortError> {
    let open = || -> io::Result<UnixStream> {
        let stream = UnixStream::connect(path)?;
        stream.set_nonblocking(true)?;
        Ok(stream)
    };
    let stream = open().map_err(|source| PortError::Socket { path: path.to_owned(), source })?;
    let port =
        Port { fd: stream.into(), kind: DeviceKind::Unix, address: address.clone(), baud: 0, fresh: true };
    Ok(Opened { port, notes: Vec::new() })
}

#[cfg(test)]
mod tests;
