//! A TCP address as the end of a simulated board.

use super::pty::wait_or_sleep;
use super::{Address, ClientEvent, Endpoint, PortError, received, sent};
use crate::realtime::{Readiness, WaitMode, monotonic_ns};
use rustix::fd::AsFd;
use rustix::net::SendFlags;
use std::io;
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};

/// The line that a second client reads before its connection is closed. It ends like a frame, so that a
/// decoder that does not know it drops it as one bad frame.
pub const BUSY_LINE: &[u8] = b"clutch: busy: this board serves another client\n\0";

/// Second clients that are being told so at a time. More are closed without a word.
const REFUSED: usize = 4;

/// Time that a second client has for reading that it is one, ns.
const LINGER: u64 = 1_000_000_000;

/// The board's end of a TCP line: one client at a time.
#[derive(Debug)]
pub struct Listener {
    listener: TcpListener,
    address: SocketAddr,
    client: Option<TcpStream>,
    /// The client's end was seen; not yet told by [`Endpoint::service`].
    ended: bool,
    /// Connections that are told "busy", and until when they are kept, ns.
    refused: [Option<(TcpStream, u64)>; REFUSED],
}

impl Listener {
    /// Listens on a loopback address: only programs on this machine can connect. Port 0 takes any
    /// free one; [`Endpoint::address`] tells which.
    ///
    /// # Errors
    /// [`PortError::NotLoopback`], [`PortError::CannotListen`].
    pub fn bind(address: SocketAddr) -> Result<Self, PortError> {
        if !address.ip().is_loopback() {
            return Err(PortError::NotLoopback { to: address });
        }
        Listener::bind_remote(address)
    }

    /// Listens on any address. Whoever reaches it controls the board: nobody has to prove who
    /// they are. Only for a network of your own.
    ///
    /// # Errors
    /// [`PortError::CannotListen`].
    pub fn bind_remote(address: SocketAddr) -> Result<Self, PortError> {
        let listen = || -> io::Result<Listener> {
            let listener = TcpListener::bind(address)?;
            listener.set_nonblocking(true)?;
            let address = listener.local_addr()?;
            Ok(Listener { listener, address, client: None, ended: false, refused: Default::default() })
        };
        listen().map_err(|source| PortError::CannotListen { to: address, source })
    }

    /// A client is connected, as the last [`Endpoint::service`] found.
    #[must_use]
    pub fn client_present(&self) -> bool {
        self.client.is_some()
    }

    fn refuse(&mut self, stream: TcpStream) {
        let Some(free) = self.refused.iter_mut().find(|slot| slot.is_none()) else { return };
        if stream.set_nonblocking(true).is_err() {
            return;
        }
        // It fits into an empty buffer; if not, the closing says enough.
        let _ = rustix::net::send(&stream, BUSY_LINE, SendFlags::NOSIGNAL);
        let _ = stream.shutdown(Shutdown::Write);
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
        self.let_go();
        // A few at a time: somebody who connects without end must not hold the board up.
        for _ in 0..REFUSED {
            match self.listener.accept() {
                Ok((stream, _)) if self.client.is_some() => self.refuse(stream),
                Ok((stream, _)) => {
                    if stream.set_nonblocking(true).and_then(|()| stream.set_nodelay(true)).is_ok() {
                        self.client = Some(stream);
                        return Ok(Some(ClientEvent::Connected));
                    }
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
            && matches!(client.peek(&mut [0]), Ok(0))
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
            None => wait_or_sleep(self.listener.as_fd(), until_ns, mode),
        }
    }

    fn address(&self) -> Address {
        Address::Tcp(self.address)
    }
}
