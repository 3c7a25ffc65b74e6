//! A TCP address or a UNIX socket as the end of a simulated board.

use super::pty::wait_or_sleep;
use super::results::{received, sent};
use super::{Address, ClientEvent, Endpoint, PortError};
use crate::realtime::{Readiness, WaitMode, monotonic_ns};
use rustix::fd::{AsFd, OwnedFd};
use rustix::net::{
    AddressFamily, RecvFlags, SendFlags, Shutdown, SocketAddrUnix, SocketFlags, SocketType, bind, recv,
    shutdown, socket_with,
};
use std::fs::Permissions;
use std::io;
use std::net::{SocketAddr, TcpListener};
use std::os::unix::fs::{FileTypeExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

/// The line that a second client reads before its connection is closed. It ends like a frame, so that a
/// decoder that does not know it drops it as one bad frame.
pub const BUSY_LINE: &[u8] = b"clutch: busy: this board serves another client\n\0";

/// Second clients that are being told so at a time. More are closed without a word.
const REFUSED: usize = 4;

/// Time that a second client has for reading that it is one, ns.
const LINGER: u64 = 1_000_000_000;

/// A client that has said nothing for so long – bytes that make no frame are nothing – makes room for one that wants its place, ns.
const IDLE: u64 = 10_000_000_000;

/// The socket that a board listens on.
#[derive(Debug)]
enum Socket {
    Tcp(TcpListener, SocketAddr),
    /// A file, which goes with it.
    Unix(UnixListener, PathBuf),
}

/// The board's end of a TCP or UNIX line: one client at a time.
#[derive(Debug)]
pub struct Listener {
    socket: Socket,
    client: Option<OwnedFd>,
    /// The time of its last whole frame, or at which it came, ns.
    heard_ns: u64,
    /// The one that takes an idle client's place.
    next: Option<OwnedFd>,
    /// The client's end was seen; not yet reported by [`Endpoint::service`].
    ended: bool,
    /// Connections that are told "busy", and until when they are kept, ns.
    refused: [Option<(OwnedFd, u64)>; REFUSED],
}

impl Listener {
    fn on(socket: Socket) -> Self {
        Listener { socket, client: None, heard_ns: 0, next: None, ended: false, refused: Default::default() }
    }

    /// Listens on a loopback address: only programs on this machine can connect. Port 0 takes any
    /// free one; [`Endpoint::address`] says which.
    ///
    /// # Errors
    /// [`PortError::NotLoopback`], [`PortError::CannotListen`].
    pub fn bind(address: SocketAddr) -> Result<Self, PortError> {
        if !address.ip().is_loopback() {
            return Err(PortError::NotLoopback { to: address });
        }
        Listener::bind_remote(address)
    }

    /// Listens on any address. Anyone who reaches it controls the board: nobody has to prove who
    /// they are. Use it only on a network of your own.
    ///
    /// # Errors
    /// [`PortError::CannotListen`].
    pub fn bind_remote(address: SocketAddr) -> Result<Self, PortError> {
        let listen = || -> io::Result<Listener> {
            let listener = TcpListener::bind(address)?;
            listener.set_nonblocking(true)?;
            let address = listener.local_addr()?;
            Ok(Listener::on(Socket::Tcp(listener, address)))
        };
        listen().map_err(|source| PortError::CannotListen { to: address, source })
    }

    /// Listens on a UNIX socket, a new file that only this user may open (mode 0600); it goes with the listener. A
    /// socket on which nobody listens any more gives way.
    ///
    /// # Errors
    /// [`PortError::CannotMakeSocket`].
    pub fn bind_unix(path: &Path) -> Result<Self, PortError> {
        let listen = || -> io::Result<Listener> {
            let stale = std::fs::symlink_metadata(path).is_ok_and(|found| found.file_type().is_socket());
            if stale && UnixStream::connect(path).is_err_and(|e| e.kind() == io::ErrorKind::ConnectionRefused)
            {
                std::fs::remove_file(path)?;
            }
            let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
            let socket = socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None)?;
            bind(&socket, &SocketAddrUnix::new(path)?)?;
            // From here on the file goes with the listener, whatever fails.
            let socket = UnixListener::from(socket);
            let listener = Listener::on(Socket::Unix(socket.try_clone()?, path.to_owned()));
            // Before it listens: until then nobody is let in.
            std::fs::set_permissions(path, Permissions::from_mode(0o600))?;
            rustix::net::listen(&socket, 16)?;
            Ok(listener)
        };
        listen().map_err(|source| PortError::CannotMakeSocket { path: path.to_owned(), source })
    }

    /// The next connection that waits.
    fn accept(&self) -> io::Result<OwnedFd> {
        match &self.socket {
            Socket::Tcp(listener, _) => {
                let (stream, _) = listener.accept()?;
                stream.set_nonblocking(true)?;
                stream.set_nodelay(true)?;
                Ok(stream.into())
            }
            Socket::Unix(listener, _) => {
                let (stream, _) = listener.accept()?;
                stream.set_nonblocking(true)?;
                Ok(stream.into())
            }
        }
    }

    /// A client is connected, as the last [`Endpoint::service`] found.
    #[must_use]
    pub fn client_present(&self) -> bool {
        self.client.is_some()
    }

    fn refuse(&mut self, stream: OwnedFd) {
        let Some(free) = self.refused.iter_mut().find(|slot| slot.is_none()) else { return };
        // It fits into an empty buffer; if not, the closing says enough.
        let _ = rustix::net::send(&stream, BUSY_LINE, SendFlags::NOSIGNAL);
        let _ = shutdown(&stream, Shutdown::Write);
        // Closed now, with bytes of the client unread, the connection would be reset and the
        // message lost.
        *free = Some((stream, monotonic_ns().saturating_add(LINGER)));
    }

    fn let_go(&mut self) {
        let now = monotonic_ns();
        for slot in &mut self.refused {
            let over = slot.as_ref().is_some_and(|(stream, until)| {
                let mut drop_here = [0; 256];
                now >= *until || received(rustix::io::read(stream, &mut drop_here)).is_err()
            });
            if over {
                *slot = None;
            }
        }
    }
}

impl Endpoint for Listener {
    fn service(&mut self) -> io::Result<Option<ClientEvent>> {
        if self.ended {
            self.ended = false;
            self.client = None;
            return Ok(Some(ClientEvent::Left));
        }
        if self.next.is_some() {
            (self.client, self.heard_ns) = (self.next.take(), monotonic_ns());
            return Ok(Some(ClientEvent::Connected));
        }
        self.let_go();
        // A few at a time: somebody who connects without end must not hold the board up.
        for _ in 0..REFUSED {
            match self.accept() {
                Ok(stream) if self.client.is_some() => {
                    if monotonic_ns().saturating_sub(self.heard_ns) < IDLE {
                        self.refuse(stream);
                        continue;
                    }
                    (self.client, self.next) = (None, Some(stream));
                    return Ok(Some(ClientEvent::Left));
                }
                Ok(stream) => {
                    (self.client, self.heard_ns) = (Some(stream), monotonic_ns());
                    return Ok(Some(ClientEvent::Connected));
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                // The connection was gone before it was accepted, or a signal came.
                Err(error)
                    if matches!(
                        error.kind(),
                        io::ErrorKind::ConnectionAborted
                            | io::ErrorKind::ConnectionReset
                            | io::ErrorKind::Interrupted
                    ) => {}
                Err(error) => return Err(error),
            }
        }
        // A client that left is seen by reading, without taking bytes away.
        if let Some(client) = &self.client
            && matches!(recv(client, &mut [0_u8], RecvFlags::PEEK), Ok((_, 0)))
        {
            self.ended = false;
            self.client = None;
            return Ok(Some(ClientEvent::Left));
        }
        Ok(None)
    }

    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize> {
        let Some(client) = self.client.as_ref().filter(|_| !self.ended && !buf.is_empty()) else {
            return Ok(0);
        };
        match received(rustix::io::read(client, buf)) {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
                self.ended = true;
                Ok(0)
            }
            other => other,
        }
    }

    fn client_spoke(&mut self) {
        self.heard_ns = monotonic_ns();
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let Some(client) = self.client.as_ref().filter(|_| !self.ended) else { return Ok(bytes.len()) };
        match sent(rustix::net::send(client, bytes, SendFlags::NOSIGNAL)) {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
                self.ended = true;
                Ok(bytes.len())
            }
            other => other,
        }
    }

    fn wait(&self, until_ns: u64, mode: WaitMode) -> Readiness {
        match &self.client {
            Some(client) if !self.ended => wait_or_sleep(client.as_fd(), until_ns, mode),
            Some(_) => {
                // Its end makes the connection readable for ever; `service` has yet to be called.
                crate::realtime::sleep_until(until_ns, mode);
                Readiness::Timeout
            }
            // A connection request ends the wait: `service` takes it.
            None => match &self.socket {
                Socket::Tcp(listener, _) => wait_or_sleep(listener.as_fd(), until_ns, mode),
                Socket::Unix(listener, _) => wait_or_sleep(listener.as_fd(), until_ns, mode),
            },
        }
    }

    fn address(&self) -> Address {
        match &self.socket {
            Socket::Tcp(_, address) => Address::Tcp(*address),
            Socket::Unix(_, path) => Address::Unix(path.clone()),
        }
    }

    fn dismiss(&mut self) -> bool {
        self.ended |= self.client.is_some();
        true
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        if let Socket::Unix(_, path) = &self.socket {
            let _ = std::fs::remove_file(path); // it may be gone already
        }
    }
}
