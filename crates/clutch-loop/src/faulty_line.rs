//! One direction of a serial line, with what can go wrong on it.

use crate::faults::{Direction, Fault, FaultKind, Forgery, Lie};
use clutch_wire::{
    Actuate, BoardState, Decoder, Message, STATUS_DAC_FAULT, STATUS_ENCODER_FAULT, STATUS_STATE, Sample,
    encode,
};
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
        let (mut before, mut after) = (Vec::new(), Vec::new());
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
                    let was = frame.clone();
                    for _ in 0..self.rng.random_range(1..=8) {
                        let at = self.rng.random_range(0..frame.len());
                        frame[at] ^= 1 << self.rng.random_range(0..8);
                    }
                    // A bit that was hit twice is right again.
                    if frame == was {
                        frame[0] ^= 1;
                    }
                }
                FaultKind::Delay(s) => late += s,
                FaultKind::Jitter(s) => late += s * self.rng.random::<f64>(),
                FaultKind::Reorder => swap = true,
                FaultKind::Lie(lie) => match said(lie, &frame) {
                    Some(other) => frame = other,
                    None => continue,
                },
                FaultKind::Forged(forgery) => {
                    let forged = forged(forgery, &frame);
                    if forged.is_empty() {
                        continue;
                    }
                    let to = if forgery == Forgery::AboveTop { &mut before } else { &mut after };
                    to.extend(forged);
                }
                _ => continue, // the board's, not the line's
            }
            hit = true;
        }
        if hit {
            self.hits += 1;
            self.first_hit_ns.get_or_insert(now_ns);
        }
        if copies == 0 {
            before.clear();
            after.clear();
        }
        let due = now_ns + self.latency_ns + (late * 1e9) as u64;
        if swap && self.held_back.is_none() && copies > 0 {
            self.held_back = Some(frame);
            return;
        }
        // A line does not overtake itself.
        self.last_ns = self.last_ns.max(due);
        let held_back = self.held_back.take();
        let sent = std::iter::repeat_n(frame, copies).chain(held_back);
        for frame in before.into_iter().chain(sent) {
            self.enqueue(self.last_ns, frame);
        }
        for (frame, period) in after.into_iter().zip(1_u64..) {
            self.enqueue(self.last_ns + period * FORGED_EACH_NS, frame);
        }
    }

    /// Puts a frame behind those that are due no later; what is forged for later does not hold up what is sent meanwhile.
    fn enqueue(&mut self, due: u64, frame: Vec<u8>) {
        let place = self.under_way.partition_point(|(t, _)| *t <= due);
        self.under_way.insert(place, (due, frame));
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

/// Time between forged frames, ns.
const FORGED_EACH_NS: u64 = 1_000_000;

/// The message in a frame, if it is a whole one.
fn message(frame: &[u8]) -> Option<Message> {
    let mut decoder = Decoder::new();
    frame.iter().find_map(|byte| decoder.push(*byte))?.ok()
}

/// A sample that says what is not so; none for another frame.
fn said(lie: Lie, frame: &[u8]) -> Option<Vec<u8>> {
    let Message::Sample(sample) = message(frame)? else { return None };
    let sample = match lie {
        Lie::Idle => Sample { status: (sample.status & !STATUS_STATE) | BoardState::Ready as u8, ..sample },
        Lie::Encoder => Sample { status: sample.status | STATUS_ENCODER_FAULT, ..sample },
        Lie::Converter => Sample { status: sample.status | STATUS_DAC_FAULT, ..sample },
        Lie::OtherRun => Sample { run: sample.run.wrapping_add(1), ..sample },
    };
    Some(encode(&Message::Sample(sample)).as_bytes().to_vec())
}

/// The frames that are forged beside a sample or a code; none beside another frame.
fn forged(forgery: Forgery, frame: &[u8]) -> Vec<Vec<u8>> {
    let made = |message: Message| encode(&message).as_bytes().to_vec();
    match (forgery, message(frame)) {
        (Forgery::Echo(n), Some(Message::Actuate(_) | Message::Sample(_))) => {
            vec![frame.to_vec(); usize::try_from(n).unwrap_or(0)]
        }
        (Forgery::OtherRun(n), Some(Message::Actuate(m))) => (1..=n)
            .map(|k| {
                let sequence = m.sequence.wrapping_add(k as u16);
                made(Message::Actuate(Actuate { run: m.run.wrapping_add(1), sequence, code: 0, ..m }))
            })
            .collect(),
        (Forgery::OtherRun(n), Some(Message::Sample(m))) => (1..=n)
            .map(|k| {
                let (run, sequence) = (m.run.wrapping_add(1), m.sequence.wrapping_add(k as u16));
                let counts = m.counts.wrapping_add(10_000);
                made(Message::Sample(Sample { run, sequence, counts, ..m }))
            })
            .collect(),
        (Forgery::OffTable, Some(Message::Actuate(m))) => {
            off_table(|k| Message::Actuate(Actuate { sequence: m.sequence.wrapping_add(k), code: 0, ..m }))
        }
        (Forgery::OffTable, Some(Message::Sample(m))) => off_table(|k| {
            let (sequence, counts) = (m.sequence.wrapping_add(k), m.counts.wrapping_add(10_000));
            Message::Sample(Sample { sequence, counts, ..m })
        }),
        (Forgery::AboveTop, Some(Message::Actuate(m))) => {
            vec![made(Message::Actuate(Actuate { code: u16::MAX, ..m }))]
        }
        _ => Vec::new(),
    }
}

/// The message of the next period in a frame of a kind that is no kind, that of the one after in a frame that is too long;
/// both have a checksum that holds.
fn off_table(next: impl Fn(u16) -> Message) -> Vec<Vec<u8>> {
    let (mut other, mut longer) = (content(&next(1)), content(&next(2)));
    other[0] |= 0x40;
    longer.push(0);
    vec![framed(other), framed(longer)]
}

/// Kind and fields of a message.
fn content(message: &Message) -> Vec<u8> {
    let frame = encode(message);
    let mut content = Vec::new();
    let mut block = frame.as_bytes();
    // Each code is the distance to the next zero; the delimiter is one.
    while let [code, rest @ ..] = block
        && *code > 0
    {
        let (bytes, behind) = rest.split_at(usize::from(*code) - 1);
        content.extend(bytes);
        content.push(0);
        block = behind;
    }
    // The last zero is the delimiter's, and before it there are four bytes of checksum.
    content.truncate(content.len() - 5);
    content
}

/// The frame of any content that is short, by docs/wire.md and not by the codec that is under test.
fn framed(mut content: Vec<u8>) -> Vec<u8> {
    let mut crc = u32::MAX;
    for byte in &content {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 0 { crc >> 1 } else { (crc >> 1) ^ 0xedb8_8320 };
        }
    }
    content.extend((!crc).to_le_bytes());
    let mut frame = Vec::new();
    for block in content.split(|byte| *byte == 0) {
        frame.push(block.len() as u8 + 1);
        frame.extend(block);
    }
    frame.push(0);
    frame
}

#[cfg(test)]
mod tests {
    use super::*;
    use clutch_wire::FrameError;

    #[test]
    fn frames_off_the_table_are_sound_but_for_their_kind_or_length() {
        let zeros = Actuate { run: 0, sequence: 256, code: 0, valid_us: 2000 };
        for message in [
            Message::Actuate(zeros),
            Message::Sample(Sample { run: 7, sequence: 1, time_us: 0, counts: -1, status: 3 }),
        ] {
            let frame = encode(&message);
            assert_eq!(framed(content(&message)), frame.as_bytes());
            let said: Vec<FrameError> = off_table(|_| message)
                .iter()
                .map(|frame| {
                    let mut decoder = Decoder::new();
                    let said = frame.iter().find_map(|byte| decoder.push(*byte));
                    said.expect("a whole frame").expect_err("no message")
                })
                .collect();
            assert!(
                matches!(said[..], [FrameError::UnknownKind(_), FrameError::Length { expected, got, .. }] if got == expected + 1),
                "{said:?}"
            );
        }
    }
}
