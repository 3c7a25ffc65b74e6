//! Feeds the same random sequences to both boards.

use super::{Random, compiled};
use clutch_core::Counts;
use clutch_node::{BoardNode, BoardParams, Outbox};
use clutch_wire::{
    Actuate, Arm, BoardState, Configure, Decoder, Discover, Message, Ping, ResetCause, SCHEMA,
    STATUS_DAC_FAULT, STATUS_ENCODER_FAULT, STATUS_LATE, Sample, Stop, VERSION, encode,
};
use std::collections::BTreeMap;
use std::io::{Read as _, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};

/// An event for a board.
#[derive(Clone, Debug)]
pub(super) enum Event {
    Power(BoardParams),
    Bytes { now: u32, bytes: Vec<u8> },
    Tick { now: u32, counts: i32, faults: u8 },
    Poll { now: u32 },
}

impl Event {
    fn write(&self, to: &mut Vec<u8>) {
        match self {
            Event::Power(p) => {
                to.push(b'I');
                for number in [p.board, p.boot, p.counts_per_rev] {
                    to.extend(number.to_le_bytes());
                }
                to.push(p.dac_bits);
                to.extend(p.dac_lowest_mv.to_le_bytes());
                to.extend(p.dac_highest_mv.to_le_bytes());
                for number in [p.period_min_us, p.period_max_us, p.watchdog_max_us] {
                    to.extend(number.to_le_bytes());
                }
                to.extend(p.boot_code.to_le_bytes());
                to.extend([p.started_by as u8, u8::from(p.brown_out_low)]);
            }
            Event::Bytes { now, bytes } => {
                to.push(b'B');
                to.extend(now.to_le_bytes());
                to.extend((bytes.len() as u16).to_le_bytes());
                to.extend(bytes);
            }
            Event::Tick { now, counts, faults } => {
                to.push(b'T');
                to.extend(now.to_le_bytes());
                to.extend(counts.to_le_bytes());
                to.push(*faults);
            }
            Event::Poll { now } => {
                to.push(b'P');
                to.extend(now.to_le_bytes());
            }
        }
    }
}

/// The observable state of a board after an event.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Shown {
    pub(super) bytes: Vec<u8>,
    pub(super) code: u16,
    pub(super) state: u8,
    pub(super) period_us: u32,
    pub(super) configurations: u32,
}

impl Shown {
    pub(super) fn messages(&self) -> Vec<Message> {
        let mut decoder = Decoder::new();
        let results = self.bytes.iter().filter_map(|byte| decoder.push(*byte));
        results.collect::<Result<_, _>>().expect("a board sends whole frames")
    }
}

/// The board in Rust, seen as that in C.
struct RustBoard {
    node: BoardNode,
    line: Decoder,
    out: Outbox,
}

impl RustBoard {
    fn take(&mut self, event: &Event) -> Shown {
        let out = &mut self.out;
        match event {
            Event::Power(p) => {
                self.node = BoardNode::new(p).expect("the parameters are right");
                self.line = Decoder::new();
            }
            Event::Bytes { now, bytes } => self.node.receive(*now, &mut self.line, bytes, out),
            Event::Tick { now, counts, faults } => {
                let encoder = faults & STATUS_ENCODER_FAULT != 0;
                let converter = faults & STATUS_DAC_FAULT != 0;
                self.node.sample(*now, Counts(*counts), encoder, converter, out);
            }
            Event::Poll { now } => self.node.poll(*now, out),
        }
        assert_eq!(out.dropped(), 0, "the comparison must not overflow the outbox");
        let shown = Shown {
            bytes: out.as_bytes().to_vec(),
            code: self.node.code().0,
            state: self.node.state() as u8,
            period_us: self.node.period_us().unwrap_or(0),
            configurations: 0, // checked only on the board in C, see rules.rs
        };
        out.clear();
        shown
    }
}

/// Runs events through the program in C.
pub(super) fn in_c(program: &Path, events: &[Event]) -> Vec<Shown> {
    let mut input = Vec::new();
    events.iter().for_each(|event| event.write(&mut input));
    let mut child = Command::new(program)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the C program starts");
    let mut pipe = child.stdin.take().expect("it has an input");
    let writer = std::thread::spawn(move || pipe.write_all(&input));
    let mut output = Vec::new();
    child.stdout.take().expect("it has an output").read_to_end(&mut output).expect("it can be read");
    let status = child.wait().expect("it ends");
    assert!(status.success(), "the board in C ended with {status}");
    writer.join().expect("no panic").expect("the C program reads all");

    let mut rest = output.as_slice();
    let mut take = |count: usize| -> Vec<u8> {
        let (head, tail) = rest.split_at(count);
        rest = tail;
        head.to_vec()
    };
    let u16_of = |b: &[u8]| u16::from_le_bytes([b[0], b[1]]);
    let u32_of = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let shown: Vec<Shown> = events
        .iter()
        .map(|_| {
            let count = u16_of(&take(2));
            let bytes = take(usize::from(count));
            let tail = take(11);
            Shown {
                bytes,
                code: u16_of(&tail),
                state: tail[2],
                period_us: u32_of(&tail[3..]),
                configurations: u32_of(&tail[7..]),
            }
        })
        .collect();
    assert!(rest.is_empty(), "an answer for each event");
    shown
}

/// A host that is mostly right, and now and then wrong.
struct Host {
    now: u32,
    counts: i32,
    newest: u16,
    set: Configure,
    top: u16,
    params: BoardParams,
    /// Bytes of frames that are under way.
    line: Vec<u8>,
}

impl Host {
    fn params(random: &mut Random) -> BoardParams {
        let dac_bits = random.range(1, 16) as u8;
        let top = (1_u32 << dac_bits) - 1;
        let period_min_us = random.range(1, 2000);
        let period_max_us = period_min_us + random.range(0, 1_000_000);
        let lowest = random.range(0, 20_000) as i32 - 15_000;
        BoardParams {
            board: random.next() as u32,
            boot: random.next() as u32,
            counts_per_rev: random.range(4, 1 << 24),
            dac_bits,
            dac_lowest_mv: lowest,
            dac_highest_mv: lowest + random.range(1, 30_000) as i32,
            period_min_us,
            period_max_us,
            watchdog_max_us: 2 * period_min_us + random.range(0, 10_000_000),
            boot_code: random.range(0, top) as u16,
            started_by: ResetCause::from_u8(random.range(0, 6) as u8).unwrap_or(ResetCause::Unknown),
            brown_out_low: random.chance(1, 2),
        }
    }

    fn configure(&mut self, random: &mut Random) -> Configure {
        let p = &self.params;
        if random.chance(1, 8) {
            return self.set; // again, after a lost answer
        }
        let limit = (p.watchdog_max_us / 2).min(p.period_max_us);
        let period_us = random.range(p.period_min_us, limit.min(p.period_min_us + 2000));
        let watchdog_us = random.range(2 * period_us, p.watchdog_max_us.min(6 * period_us));
        let mut m = Configure {
            run: self.set.run.wrapping_add(1),
            config: random.next(),
            period_us,
            watchdog_us,
            safe_kind: random.range(0, 3) as u8,
            hold_code: random.range(0, u32::from(self.top)) as u16,
            release_code: random.range(0, u32::from(self.top)) as u16,
            ramp_step: if random.chance(1, 8) {
                random.next() as u32
            } else {
                random.range(0, u32::from(self.top).max(1) << 13)
            },
            hold_periods: if random.chance(1, 16) { u32::MAX } else { random.range(0, 6) },
        };
        match random.below(24) {
            0 => m.run = self.set.run,
            1 => (m.run, m.config) = (self.set.run, self.set.config), // as before, other fields
            2 => m.period_us = p.period_min_us - 1,
            3 => m.period_us = p.period_max_us + 1,
            4 => m.watchdog_us = 2 * period_us - 1,
            5 => m.watchdog_us = p.watchdog_max_us + 1,
            6 => m.safe_kind = random.range(4, 255) as u8,
            7 => m.hold_code = self.top.saturating_add(1),
            8 => m.release_code = self.top.saturating_add(1),
            9 => m.watchdog_us = 2 * period_us,
            10 => m.period_us = u32::MAX,
            11 => m.run = random.next() as u16,
            12 => m.ramp_step = 0,
            14 => m.watchdog_us = 100 * period_us + 1,
            13 => (m.period_us, m.watchdog_us) = (limit, p.watchdog_max_us),
            _ => {}
        }
        m
    }

    fn message(&mut self, random: &mut Random, state: BoardState) -> Message {
        let run = if random.chance(1, 20) { random.next() as u16 } else { self.set.run };
        let config = if random.chance(1, 20) { random.next() } else { self.set.config };
        let driving = matches!(state, BoardState::Armed | BoardState::Running);
        let usual = match state {
            _ if random.chance(1, 4) => random.below(8),
            BoardState::Boot | BoardState::Stopped | BoardState::Faulted => 1,
            BoardState::Ready => 2,
            BoardState::Armed | BoardState::Running => 3,
        };
        match usual {
            0 => Message::Discover(Discover {
                nonce: random.next() as u32,
                version: if random.chance(1, 8) { random.next() as u8 } else { VERSION },
                schema: if random.chance(1, 8) { SCHEMA ^ (1 << random.below(64)) } else { SCHEMA },
            }),
            1 => Message::Configure(self.configure(random)),
            2 => {
                let boot = if random.chance(1, 20) { random.next() as u32 } else { self.params.boot };
                Message::Arm(Arm { run, config, boot })
            }
            4 if !driving || random.chance(1, 3) => {
                Message::Stop(Stop { run, reason: random.range(0, 4) as u8 })
            }
            5 => Message::Ping(Ping { run, nonce: random.next() as u32 }),
            6 => Message::Sample(Sample { run, sequence: 1, time_us: self.now, counts: 0, status: 0 }),
            _ => {
                let old = if random.chance(1, 3) { random.range(0, 10) as u16 } else { 0 };
                let wild = random.chance(1, 30);
                Message::Actuate(Actuate {
                    run,
                    sequence: match random.below(2) {
                        0 if wild => random.next() as u16,
                        1 if wild => self.newest ^ 0x8000, // neither newer nor older
                        _ => self.newest.wrapping_sub(old),
                    },
                    code: if random.chance(1, 30) {
                        self.top.saturating_add(random.range(0, 2) as u16)
                    } else {
                        random.range(0, u32::from(self.top)) as u16
                    },
                    valid_us: if random.chance(1, 6) {
                        random.next() as u16
                    } else {
                        self.set.period_us.saturating_mul(2).min(65_535) as u16
                    },
                })
            }
        }
    }

    /// Puts a frame on the line, whole or not.
    fn send(&mut self, random: &mut Random, state: BoardState) {
        let message = self.message(random, state);
        if let Message::Configure(m) = &message
            && !matches!(state, BoardState::Armed | BoardState::Running)
        {
            // The board's answer shows if it took the frame: most of the time it does.
            self.set = *m;
        }
        let mut bytes = encode(&message).as_bytes().to_vec();
        match random.below(40) {
            0 => {
                let at = random.below(bytes.len() as u64) as usize;
                bytes[at] ^= 1 << random.below(8);
            }
            1 => bytes.truncate(1 + random.below(bytes.len() as u64 - 1) as usize),
            2 => bytes.extend_from_within(..),
            3 => bytes = (0..random.range(1, 150)).map(|_| random.next() as u8).collect(),
            4 => bytes = (0..random.range(60, 100)).map(|_| random.range(1, 255) as u8).collect(),
            5 => bytes.insert(0, 0),
            _ => {}
        }
        self.line.extend(bytes);
    }

    fn event(&mut self, random: &mut Random, state: BoardState) -> Event {
        let period = self.set.period_us.max(1);
        self.now = self.now.wrapping_add(match random.below(40) {
            0 => random.range(0, 5 * period.min(1_000_000)),
            1 if random.chance(1, 4) => random.next() as u32,
            2 => self.set.watchdog_us,
            3 => self.set.watchdog_us.saturating_sub(1),
            4..12 => 0,
            _ => random.range(0, period.min(1_000_000)),
        });
        let now = self.now;
        match random.below(16) {
            0 => Event::Poll { now },
            1..8 => {
                self.counts = match random.below(20) {
                    0 => random.next() as i32,
                    _ => self.counts.wrapping_add(random.range(0, 8) as i32 - 2),
                };
                let faults = match random.below(150) {
                    0 => STATUS_ENCODER_FAULT,
                    1 => STATUS_DAC_FAULT,
                    2 => STATUS_ENCODER_FAULT | STATUS_DAC_FAULT,
                    _ => 0,
                };
                Event::Tick { now, counts: self.counts, faults }
            }
            _ => {
                if self.line.is_empty() || random.chance(1, 4) {
                    self.send(random, state);
                }
                // Mostly all that is there, else cut anywhere. At most 100: answers fit the outbox.
                let there = self.line.len().min(100);
                let count = if random.chance(3, 4) { there } else { 1 + random.below(there as u64) as usize };
                Event::Bytes { now, bytes: self.line.drain(..count).collect() }
            }
        }
    }
}

/// A random sequence, and the states of the board in Rust.
fn sequence(seed: u64) -> Vec<(Event, Shown)> {
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    // The first numbers of seeds that differ little differ little.
    for _ in 0..10 {
        random.next();
    }
    let params = Host::params(&mut random);
    let node = BoardNode::new(&params).expect("the parameters are right");
    let mut board = RustBoard { node, line: Decoder::new(), out: Outbox::default() };
    let power = Event::Power(params);
    let first = board.take(&power);
    let mut steps = vec![(power, first)];
    let zero = Configure {
        // 0 is what a board has at power-up: as the first run, and as one that was never configured.
        run: match random.below(4) {
            0 => 0,
            1 => u16::MAX,
            _ => random.next() as u16,
        },
        config: 0,
        period_us: 1000,
        watchdog_us: 3000,
        safe_kind: 0,
        hold_code: 0,
        release_code: 0,
        ramp_step: 0,
        hold_periods: 0,
    };
    let mut host = Host {
        // Half of the runs begin just before the clock wraps.
        now: if seed.is_multiple_of(2) { u32::MAX - random.range(0, 50_000) } else { random.next() as u32 },
        counts: if seed.is_multiple_of(3) { i32::MAX - 20 } else { 0 },
        newest: 0,
        set: zero,
        top: ((1_u32 << params.dac_bits) - 1) as u16,
        params,
        line: Vec::new(),
    };
    for _ in 0..random.range(50, 400) {
        let event = host.event(&mut random, board.node.state());
        let shown = board.take(&event);
        for message in shown.messages() {
            if let Message::Sample(s) = message {
                host.newest = s.sequence;
            }
        }
        steps.push((event, shown));
    }
    steps
}

/// A run longer than the sequence numbers: they and the ring of recent samples wrap.
fn long_run() -> Vec<(Event, Shown)> {
    let params = BoardParams {
        board: 7,
        boot: 1,
        counts_per_rev: 20_000,
        dac_bits: 12,
        dac_lowest_mv: -10_000,
        dac_highest_mv: 10_000,
        period_min_us: 100,
        period_max_us: 10_000,
        watchdog_max_us: 100_000,
        boot_code: 2970,
        started_by: ResetCause::Pin,
        brown_out_low: true,
    };
    let node = BoardNode::new(&params).expect("the parameters are right");
    let mut board = RustBoard { node, line: Decoder::new(), out: Outbox::default() };
    let configure = Configure {
        run: 1,
        config: 2,
        period_us: 1000,
        watchdog_us: 3000,
        safe_kind: 1,
        hold_code: 2970,
        release_code: 2048,
        ramp_step: 100_000,
        hold_periods: 0,
    };
    let start = u32::MAX - 30_000_000;
    let mut bytes = encode(&Message::Configure(configure)).as_bytes().to_vec();
    bytes.extend(encode(&Message::Arm(Arm { run: 1, config: 2, boot: 1 })).as_bytes());
    let mut events = vec![Event::Power(params), Event::Bytes { now: start, bytes }];
    for tick in 0..140_000_u32 {
        let now = start.wrapping_add(tick * 1000);
        events.push(Event::Tick { now, counts: tick as i32, faults: 0 });
        let sequence = tick as u16;
        let code = (tick % 4096) as u16;
        let answer = Message::Actuate(Actuate { run: 1, sequence, code, valid_us: 1500 });
        events.push(Event::Bytes { now: now.wrapping_add(300), bytes: encode(&answer).as_bytes().to_vec() });
    }
    events.into_iter().map(|event| (event.clone(), board.take(&event))).collect()
}

/// The coverage of the sequences, so that a comparison of nothing cannot pass.
fn count(seen: &mut BTreeMap<String, u64>, shown: &Shown) {
    let mut add = |key: String| *seen.entry(key).or_insert(0) += 1;
    for message in shown.messages() {
        match message {
            Message::Refused(m) => add(format!("refused {:#04x} for {}", m.request, m.reason)),
            Message::Fault(m) => add(format!("fault {}", m.cause)),
            Message::Stopped(m) => add(format!("stopped, reason {}", m.reason)),
            Message::Sample(m) => {
                add(format!("sample in state {}", m.status & 7));
                if m.status & STATUS_LATE != 0 {
                    add("sample with late".to_owned());
                }
            }
            Message::Hello(_) => add("hello".to_owned()),
            Message::Configured(_) => add("configured".to_owned()),
            Message::Armed(_) => add("armed".to_owned()),
            Message::Pong(_) => add("pong".to_owned()),
            other => panic!("a board does not send {other:?}"),
        }
    }
}

const EXPECTED: [&str; 25] = [
    "armed",
    "configured",
    "fault 1",
    "fault 2",
    "fault 3",
    "hello",
    "pong",
    "refused 0x01 for 1",
    "refused 0x01 for 2",
    "refused 0x02 for 3",
    "refused 0x02 for 5",
    "refused 0x02 for 6",
    "refused 0x02 for 7",
    "refused 0x02 for 8",
    "refused 0x03 for 3",
    "refused 0x03 for 4",
    "refused 0x03 for 5",
    "refused 0x04 for 11",
    "sample in state 1",
    "sample in state 2",
    "sample in state 3",
    "sample in state 4",
    "sample in state 5",
    "sample with late",
    "stopped, reason 2",
];

/// `CLUTCH_BOARD_SEQUENCES=100000 cargo test --release -p clutch-tests --test board_c -- same` runs more.
#[test]
fn the_board_in_c_does_the_same_as_the_board_in_rust() {
    let Some(program) = compiled("board_c_driver", &["examples/board-c/board.c", "tests/board_c/driver.c"])
    else {
        return;
    };
    let runs = std::env::var("CLUTCH_BOARD_SEQUENCES").map_or(3000, |n| n.parse::<u64>().expect("a number"));
    let mut seen = BTreeMap::new();
    let mut events_in_all = 0_u64;
    // In lots: one process each, and not all in memory.
    for lot in (0..=runs).collect::<Vec<_>>().chunks(500) {
        // The last is the long run.
        let sequences: Vec<_> =
            lot.iter().map(|seed| if *seed == runs { long_run() } else { sequence(*seed) }).collect();
        let events: Vec<Event> = sequences.iter().flatten().map(|(event, _)| event.clone()).collect();
        let mut in_c = in_c(&program, &events).into_iter();
        for (seed, steps) in lot.iter().zip(&sequences) {
            for (step, (event, rust)) in steps.iter().enumerate() {
                let mut c = in_c.next().expect("an answer for each event");
                c.configurations = rust.configurations;
                let from = step.saturating_sub(4);
                assert!(
                    c == *rust,
                    "sequence {seed}, step {step}: {event:02x?}\n   C: {c:02x?}\n      {:?}\nRust: {rust:02x?}\n      \
                     {:?}\nbefore: {:02x?}",
                    c.messages(),
                    rust.messages(),
                    &steps[from..step]
                );
                count(&mut seen, rust);
                events_in_all += 1;
            }
        }
    }
    println!("{} sequences, {events_in_all} events: all the same\n{seen:#?}", runs + 1);
    for key in EXPECTED {
        assert!(seen.get(key).is_some_and(|n| *n >= 20), "{key}: hardly ever seen, {seen:#?}");
    }
    assert!(!seen.contains_key("sample in state 0"), "a board at power-up is silent");
}
