//! A board's hardware for tests of what a program does in its periods.
#![allow(unreachable_pub, reason = "a module of one program")]

use clutch_core::{Counts, DacCode};
use clutch_node::Hardware;
use clutch_wire::{Decoder, Message};

/// Actions on the hardware, in their order.
#[derive(Debug, PartialEq)]
pub enum Done {
    Sampled,
    PutOut(u16),
    FedWatchdog,
    Sent(Vec<Message>),
}

/// A board's hardware that notes what is done to it; its shaft does what a test says.
pub struct Desk {
    pub now_us: u64,
    pub cycles: u32,
    pub counts: i32,
    pub encoder_fault: bool,
    pub busy: bool,
    /// Time up to a code, µs of 170 cycles.
    pub takes_us: u32,
    pub done: Vec<Done>,
}

impl Default for Desk {
    fn default() -> Self {
        Desk {
            now_us: 0,
            cycles: 0,
            counts: 0,
            encoder_fault: false,
            busy: false,
            takes_us: 7,
            done: Vec::new(),
        }
    }
}

impl Hardware for Desk {
    fn now_us(&self) -> u64 {
        self.now_us
    }
    fn counts(&mut self) -> Counts {
        self.done.push(Done::Sampled);
        Counts(self.counts)
    }
    fn encoder_fault(&self) -> bool {
        self.encoder_fault
    }
    fn converter_fault(&self) -> bool {
        false
    }
    fn put_out(&mut self, code: DacCode) {
        self.now_us += u64::from(self.takes_us);
        self.cycles = self.cycles.wrapping_add(170 * self.takes_us);
        self.done.push(Done::PutOut(code.0));
    }
    fn feed_watchdog(&mut self) {
        self.done.push(Done::FedWatchdog);
    }
    fn send(&mut self, frames: &[u8]) -> bool {
        if self.busy {
            return false;
        }
        let mut decoder = Decoder::new();
        self.done
            .push(Done::Sent(frames.iter().filter_map(|b| decoder.push(*b)).map(Result::unwrap).collect()));
        true
    }
    fn cycles(&self) -> u32 {
        self.cycles
    }
}
