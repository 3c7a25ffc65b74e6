//! One direction of a serial line, with what can go wrong on it.

use crate::faults::{Direction, Fault, FaultKind};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::collections::VecDeque;

/// Frames under way. Times are ns.
#[derive(Debug)]
pub struct FaultyLine {
    latency_ns: u64,
    faults: Vec<Fault>,
    rng: Pcg64,
    /// The beginning of a frame whose end has not come yet.
    partial: Vec<u8>,
    under_way: VecDeque<(u64, Vec<u8>)>,
    /// A frame that waits to be overtaken.
    held_back: Option<Vec<u8>>,
    last_ns: u64,
    hits: u64,
    first_hit_ns: Option<u64>,
}

impl FaultyLine {
    /// A line with a fixed latency; the seed decides what faults hit.
    #[must_use]
    pub fn new(way: Direction, latency_ns: u64, faults: &[Fault], seed: u64) -> Self {
        FaultyLine {
            latency_ns,
            faults: faults.iter().filter(|f| f.covers(way)).copied().collect(),
            rng: Pcg64::seed_from_u64(seed ^ (0x6c69_6e65 + way as u64)),
            partial: Vec::new(),
            under_way: VecDeque::new(),
            held_back: None,
            last_ns: 0,
            hits: 0,
            first_hit_ns: None,
        }
    }

    /// Frames that a fault has hit, and when the first was.
    #[must_use]
    pub fn hits(&self) -> (u64, Option<u64>) {
        (self.hits, self.first_hit_ns)
    }

    /// Bytes enter. `armed` is the time since arming, s; before it nothing goes wrong.
    pub fn send(&mut self, now_ns: u64, armed: Option<f64>, bytes: &[u8]) {
        for byte in bytes {
            self.partial.push(*byte);
            // A foreign stream without delimiters must not fill the memory.
            if *byte == 0 || self.partial.len() >= 1024 {
                let frame = std::mem::take(&mut self.partial);
                self.frame(now_ns, armed, frame);
            }
        }
    }

    fn frame(&mut self, now_ns: u64, armed: Option<f64>, mut frame: Vec<u8>) {
        let (mut copies, mut late, mut swap, mut hit) = (1, 0.0, false, false);
        for i in 0..self.faults.len() {
            let fault = self.faults[i];
            let active = armed.is_some_and(|t| fault.active(t));
            if !active || !self.rng.random_bool(fault.probability) {
                continue;
            }
            match fault.kind {
                FaultKind::Drop | FaultKind::Silence => copies = 0,
                FaultKind::Duplicate => copies *= 2,
                FaultKind::Corrupt => {
                    for _ in 0..self.rng.random_range(1..=8) {
                        let at = self.rng.random_range(0..frame.len());
                        frame[at] ^= 1 << self.rng.random_range(0..8);
                    }
                }
                FaultKind::Delay(s) => late += s,
                FaultKind::Jitter(s) => late += s * self.rng.random::<f64>(),
                FaultKind::Reorder => swap = true,
                _ => continue, // the board's, not the line's
            }
            hit = true;
        }
        if hit {
            self.hits += 1;
            self.first_hit_ns.get_or_insert(now_ns);
        }
        let due = now_ns + self.latency_ns + (late * 1e9) as u64;
        if swap && self.held_back.is_none() && copies > 0 {
            self.held_back = Some(frame);
            return;
        }
        // A line does not overtake itself.
        self.last_ns = self.last_ns.max(due);
        for _ in 0..copies {
            self.under_way.push_back((self.last_ns, frame.clone()));
        }
        if let Some(frame) = self.held_back.take() {
            self.under_way.push_back((self.last_ns, frame));
        }
    }

    /// The time at which the next bytes arrive.
    #[must_use]
    pub fn next_ns(&self) -> Option<u64> {
        self.under_way.front().map(|(t, _)| *t)
    }

    /// Bytes that have arrived by now, one piece.
    pub fn arrived(&mut self, now_ns: u64) -> Option<Vec<u8>> {
        let (due, _) = self.under_way.front()?;
        if *due > now_ns {
            return None;
        }
        let mut all = Vec::new();
        while self.next_ns().is_some_and(|t| t <= now_ns) {
            all.extend(self.under_way.pop_front().into_iter().flat_map(|(_, bytes)| bytes));
        }
        Some(all)
    }
}
