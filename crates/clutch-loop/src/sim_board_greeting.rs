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
        let held = match &mut self.known {
            Known::Heard => return Ok((Cow::Borrowed(bytes), None)),
            Known::Dismissed => return Ok((NOTHING, None)),
            Known::Unheard(held) => held,
        };
        held.extend_from_slice(bytes);
        let whole = match bytes.iter().find_map(|byte| self.decoder.push(*byte)) {
            None if held.len() <= MOST_HELD => return Ok((NOTHING, None)),
            first => matches!(first, Some(Ok(_))),
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
