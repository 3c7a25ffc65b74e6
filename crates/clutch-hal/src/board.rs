//! A board from parts.

use crate::converter::Converter;
use crate::line::Line;
use clutch_core::{Counts, DacCode};
use clutch_node::Hardware;
use embedded_io::{Read, ReadReady, Write, WriteReady};

/// The encoder. embedded-hal 1.0 has no trait for quadrature.
pub trait Quadrature {
    /// Counts now; 16 bits become 32 by `clutch_node::WideCounter`.
    fn counts(&mut self) -> Counts;

    /// The encoder reports that it cannot be trusted.
    fn fault(&self) -> bool {
        false
    }
}

/// A clock. embedded-hal 1.0 has none that tells the time.
pub trait Clock {
    /// Time since the start, µs; never goes back.
    fn now_us(&self) -> u64;

    /// The core's cycles; wraps. 0 without a counter.
    fn cycles(&self) -> u32 {
        0
    }
}

/// The hardware's watchdog.
pub trait Watchdog {
    /// Feeds it.
    fn feed(&mut self);
}

/// Encoder, converter, line, clock and watchdog: what either role runs on.
#[derive(Debug)]
pub struct Board<Q, C, S, K, W, const ROOM: usize = 768> {
    encoder: Q,
    converter: C,
    /// The serial line.
    pub line: Line<S, ROOM>,
    clock: K,
    watchdog: W,
    /// The converter has not taken its last code.
    refused: bool,
}

impl<Q, C: Converter, S, K, W, const ROOM: usize> Board<Q, C, S, K, W, ROOM> {
    /// A board. `boot` goes out at once: the code that the brake is to have while nobody controls.
    pub fn new(
        encoder: Q,
        mut converter: C,
        line: Line<S, ROOM>,
        clock: K,
        watchdog: W,
        boot: DacCode,
    ) -> Self {
        let refused = !converter.put(boot);
        Board { encoder, converter, line, clock, watchdog, refused }
    }
}

impl<Q, C, S, K, W, const ROOM: usize> Hardware for Board<Q, C, S, K, W, ROOM>
where
    Q: Quadrature,
    C: Converter,
    S: Read + ReadReady + Write + WriteReady,
    K: Clock,
    W: Watchdog,
{
    fn now_us(&self) -> u64 {
        self.clock.now_us()
    }

    fn counts(&mut self) -> Counts {
        self.encoder.counts()
    }

    fn encoder_fault(&self) -> bool {
        self.encoder.fault()
    }

    fn converter_fault(&self) -> bool {
        self.refused
    }

    fn put_out(&mut self, code: DacCode) {
        self.refused = !self.converter.put(code);
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.feed();
    }

    fn send(&mut self, frames: &[u8]) -> bool {
        self.line.offer(frames)
    }

    fn cycles(&self) -> u32 {
        self.clock.cycles()
    }
}
