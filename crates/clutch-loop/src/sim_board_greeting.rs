//! The first words of a client of a simulated board: a frame, or the connection is closed.
//!
//! A web page may make a browser send any bytes to a port of this machine, but the first of them are the browser's
//! own. A board on a serial line cannot ask for this, as noise may come before a frame there.

use crate::port::Endpoint;
use clutch_wire::{Decoder, MAX_FRAME};
use std::borrow::Cow;
use std::io;

/// Most bytes before the end of a first frame: zeros alone are none.
const MOST_HELD: usize = 4 * MAX_FRAME;

/// Knowledge of the present client.
#[derive(Debug)]
enum Known {
    /// Nothing; the bytes so far are no whole frame yet.
    Unheard(Vec<u8>),
    /// Its first frame was whole.
    Heard,
    /// It has been asked to go.
    Dismissed,
}

/// The judge of clients' first words.
#[derive(Debug)]
pub(crate) struct Greeting {
    known: Known,
    decoder: Decoder,
}

impl Greeting {
    pub(crate) fn new() -> Self {
        Greeting { known: Known::Unheard(Vec::new()), decoder: Decoder::new() }
    }

    /// A client came or left.
    pub(crate) fn client(&mut self) {
        *self = Greeting::new();
    }

    /// Reads into `buffer`; the bytes that the board may hear, and the reason for which a client was sent away just now.
    /// A client of a pseudo-terminal cannot be sent away: there the board drops what is no frame, as on a serial line.
    pub(crate) fn read<'b>(
        &mut self,
        endpoint: &mut dyn Endpoint,
        buffer: &'b mut [u8],
    ) -> io::Result<(Cow<'b, [u8]>, Option<&'static str>)> {
        const NOTHING: Cow<'_, [u8]> = Cow::Borrowed(&[]);
        let count = endpoint.read(buffer)?;
        let bytes = buffer.get(..count).unwrap_or(&[]);
        // The first frame, and whether one of these is whole: bytes that make none are no words.
        let (mut first, mut spoke) = (None, false);
        for byte in bytes {
            if let Some(frame) = self.decoder.push(*byte) {
                spoke |= frame.is_ok();
                first = first.or(Some(frame.is_ok()));
            }
        }
        if spoke {
            endpoint.client_spoke();
        }
        let held = match &mut self.known {
            Known::Heard => return Ok((Cow::Borrowed(bytes), None)),
            Known::Dismissed => return Ok((NOTHING, None)),
            Known::Unheard(held) => held,
        };
        held.extend_from_slice(bytes);
        let whole = match first {
            None if held.len() <= MOST_HELD => return Ok((NOTHING, None)),
            first => first == Some(true),
        };
        let held = std::mem::take(held);
        if !whole && endpoint.dismiss() {
            self.known = Known::Dismissed;
            return Ok((NOTHING, Some("its first bytes were no frame")));
        }
        self.known = Known::Heard;
        Ok((Cow::Owned(held), None))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::port::{Address, ClientEvent};
    use crate::realtime::{Readiness, WaitMode};
    use clutch_node::Outbox;
    use clutch_wire::{Message, Ping};

    /// A client's bytes, and how often it was heard.
    #[derive(Default)]
    struct Line {
        bytes: Vec<u8>,
        heard: usize,
    }

    impl Endpoint for Line {
        fn service(&mut self) -> io::Result<Option<ClientEvent>> {
            Ok(None)
        }
        fn read(&mut self, buf: &mut [u8]) -> io::Result<usize> {
            let count = self.bytes.len().min(buf.len());
            buf[..count].copy_from_slice(&self.bytes[..count]);
            self.bytes.drain(..count);
            Ok(count)
        }
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            Ok(bytes.len())
        }
        fn wait(&self, _: u64, _: WaitMode) -> Readiness {
            Readiness::Timeout
        }
        fn address(&self) -> Address {
            "127.0.0.1:1".parse().unwrap()
        }
        fn client_spoke(&mut self) {
            self.heard += 1;
        }
    }

    #[test]
    fn a_client_that_sends_bytes_and_no_frames_says_nothing() {
        let mut ping = Outbox::default();
        clutch_node::Sink::push(&mut ping, &Message::Ping(Ping { run: 1, nonce: 7 }));
        let (mut line, mut greeting, mut buffer) = (Line::default(), Greeting::new(), [0; 64]);
        let mut say = |bytes: &[u8]| {
            line.bytes.extend_from_slice(bytes);
            let _ = greeting.read(&mut line, &mut buffer).unwrap();
            line.heard
        };
        assert_eq!(say(&[0]), 0);
        assert_eq!(say(ping.as_bytes()), 1);
        // A delimiter now and then, noise, a part of a frame.
        for bytes in [&[0][..], &[0, 0, 3, 9, 9, 0], &ping.as_bytes()[..3], &[0], &[]] {
            assert_eq!(say(bytes), 1, "{bytes:?}");
        }
        assert_eq!(say(ping.as_bytes()), 2);
    }
}
