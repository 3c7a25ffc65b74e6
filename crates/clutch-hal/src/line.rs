//! A serial line that nobody waits for.

use embedded_io::{Read, ReadReady, Write, WriteReady};

/// A serial port with room for the frames of a period.
#[derive(Debug)]
pub struct Line<S, const ROOM: usize = 768> {
    port: S,
    frames: [u8; ROOM],
    /// Bytes that have gone, and bytes that there are.
    gone: usize,
    filled: usize,
}

impl<S: Read + ReadReady + Write + WriteReady, const ROOM: usize> Line<S, ROOM> {
    /// A line over a port.
    pub const fn new(port: S) -> Self {
        Line { port, frames: [0; ROOM], gone: 0, filled: 0 }
    }

    /// Takes frames, if all earlier ones are gone and there is room; true if it has taken them.
    pub fn offer(&mut self, frames: &[u8]) -> bool {
        self.pump();
        if self.gone < self.filled {
            return false;
        }
        let Some(room) = self.frames.get_mut(..frames.len()) else { return false };
        room.copy_from_slice(frames);
        (self.gone, self.filled) = (0, frames.len());
        self.pump();
        true
    }

    /// Writes what the port takes at once. Call it as often as you like, and once a period at least.
    pub fn pump(&mut self) {
        while let Some(rest) = self.frames.get(self.gone..self.filled).filter(|rest| !rest.is_empty()) {
            let written = match self.port.write_ready() {
                Ok(true) => self.port.write(rest),
                Ok(false) => return,
                Err(error) => Err(error),
            };
            match written {
                Ok(0) => return,
                Ok(count) => self.gone += count,
                // An error of the port loses frames, as the line may lose them: the protocol lives with that.
                Err(_) => self.gone = self.filled,
            }
        }
    }

    /// Bytes that have come, as many as fit into `room`; none without waiting if there are none.
    pub fn take<'a>(&mut self, room: &'a mut [u8]) -> &'a [u8] {
        if !matches!(self.port.read_ready(), Ok(true)) {
            return &[];
        }
        match self.port.read(room) {
            Ok(count) => room.get(..count).unwrap_or(&[]),
            Err(_) => &[],
        }
    }
}
