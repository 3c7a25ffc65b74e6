//! The board's end of a line.

use super::address::Address;
use crate::realtime::{Readiness, WaitMode};
use std::io;

/// A client's coming and going, as a board sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClientEvent {
    /// Somebody opened the line. Bytes that a former client had not read are gone.
    Connected,
    /// The client closed the line or died, and its last bytes have been read.
    Left,
}

/// The board's end of a line: clients come and go, one at a time.
pub trait Endpoint {
    /// Notices clients that came or went, one event per call. Call it regularly, each cycle or
    /// each few milliseconds; it does not wait. A client that follows another between two calls
    /// is not distinguished: it is the protocol's greeting that begins a session.
    ///
    /// # Errors
    /// The line itself failed.
    fn service(&mut self) -> io::Result<Option<ClientEvent>>;

    /// Reads what is there, without waiting. `Ok(0)`: nothing now, or nobody there.
    ///
    /// # Errors
    /// The line itself failed. A client that left is not an error.
    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize>;

    /// Writes as much as the line takes now, without waiting, and says how much. With nobody
    /// there, all bytes vanish as on a cable that leads nowhere, and count as written.
    ///
    /// # Errors
    /// The line itself failed. A client that left is not an error.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize>;

    /// Waits for bytes or for the instant `until_ns` of
    /// [`monotonic_ns`](crate::realtime::monotonic_ns). With nobody there it waits for that
    /// instant. Never says `HungUp`.
    fn wait(&self, until_ns: u64, mode: WaitMode) -> Readiness;

    /// The address at which clients reach it, as they write it.
    fn address(&self) -> Address;

    /// Closes the connection to the present client, which [`Endpoint::service`] then reports to have left. False where
    /// there is no connection to close: on a pseudo-terminal, whose clients are programs of this user.
    fn dismiss(&mut self) -> bool {
        false
    }

    /// The present client has sent a whole frame. One that sends none for long makes room for another, where a line has
    /// room for one.
    fn client_spoke(&mut self) {}
}
