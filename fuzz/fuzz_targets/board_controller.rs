//! A board in the controller role, its host, and encoder and converter, with any frames between
//! them. Nothing panics or overflows; all output is whole frames; a code fits the converter; and a
//! clock that has just been read is not requested again at once.
//!
//! The input plans a run (law, safe state, path, a few numbers changed; controller and board apart,
//! or on one chip) and then acts: orderly steps, so that a run is reached, between bytes and
//! well-formed frames of any content.
#![no_main]

use clutch_core::law::LawParams;
use clutch_core::reference::{
    Chirp, Interpolation, JerkLimited, Knot, MinimumJerk, ReferenceParams, Sine, Table, Trapezoid,
};
use clutch_core::{
    Bounds, Counts, FixedCounts, Micros, PlantParams, SafeState, ServoParams, SupervisorParams, Tolerances,
};
use clutch_node::{
    BoardController, BoardControllerParams, BoardNode, BoardParams, ControllerNode, ControllerParams,
    HostNode, Lines, OneChip, Outbox, ResetCause, Role,
};
use clutch_settings::{Built, RunParams, RunTimes, SETTINGS, Settings};
use clutch_wire::{Decoder, Message, StopReason, TABLE};
use libfuzzer_sys::fuzz_target;

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
const BOARD: BoardParams = BoardParams {
    board: 42,
    boot: 9,
    counts_per_rev: 20_000,
    dac_bits: 12,
    dac_lowest_mv: -10_000,
    dac_highest_mv: 10_000,
    period_min_us: 500,
    period_max_us: 10_000,
    watchdog_max_us: 30_000,
    boot_code: 2867,
    started_by: ResetCause::Power,
    brown_out_low: false,
};
const KNOTS: [Knot; 3] = [
    Knot { time_us: 0, position: FixedCounts(7) },
    Knot { time_us: 10_500, position: FixedCounts(30 << 16) },
    Knot { time_us: 40_000, position: FixedCounts(90 << 16) },
];

/// The input, from its start; behind its end come zeros.
struct Input<'a>(&'a [u8]);

impl Input<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let mut bytes = [0; N];
        let (head, rest) = self.0.split_at(N.min(self.0.len()));
        bytes[..head.len()].copy_from_slice(head);
        self.0 = rest;
        bytes
    }
    fn byte(&mut self) -> u8 {
        self.take::<1>()[0]
    }
    fn some(&mut self, length: usize) -> Vec<u8> {
        (0..length).map(|_| self.byte()).collect()
    }
    /// A frame of any kind with any content.
    fn frame(&mut self) -> Vec<u8> {
        let info = &TABLE[usize::from(self.byte()) % TABLE.len()];
        let mut content = vec![info.kind];
        content.extend(self.some(usize::from(info.length) - 5));
        if info.list > 0 {
            let count = self.byte() % (info.list + 1);
            *content.last_mut().expect("a list's count") = count;
            content.extend(self.some(4 * usize::from(count)));
        }
        content.extend(CRC.checksum(&content).to_le_bytes());
        let mut frame = Vec::new();
        for block in content.split(|byte| *byte == 0) {
            frame.push(u8::try_from(block.len() + 1).expect("frames are short"));
            frame.extend_from_slice(block);
        }
        frame.push(0);
        frame
    }
}

/// What an input begins with.
struct Plan {
    settings: Settings,
    /// What the settings build.
    built: Built,
    /// Controller and board are one chip.
    one_chip: bool,
}

fn plan(input: &mut Input<'_>) -> Option<Plan> {
    let [kinds, path, host_silence] = input.take();
    let laws = LawParams::all();
    // By the two bits that have always chosen, and a third.
    let law = laws[usize::from(kinds & 3 | kinds >> 2 & 4) % laws.len()];
    let on_fault = match kinds >> 2 & 3 {
        0 => SafeState::hold(5.0),
        1 => SafeState::ramp(100.0, 5.0),
        2 => SafeState::Release,
        _ => SafeState::hold_then_release(5.0, 0.01),
    };
    let reference = match path % 9 {
        0 => ReferenceParams::Hold,
        1 => ReferenceParams::ramp(0.9),
        2 => ReferenceParams::Trapezoid(Trapezoid { distance: 0.02, speed: 0.9, acceleration: 50.0 }),
        3 => ReferenceParams::JerkLimited(JerkLimited {
            distance: 0.02,
            speed: 0.9,
            acceleration: 50.0,
            jerk: 9000.0,
        }),
        4 => ReferenceParams::MinimumJerk(MinimumJerk { distance: 0.02, duration: 0.04 }),
        5 => ReferenceParams::Sine(Sine { rate: 0.9, amplitude: 0.01, frequency: 9.0, phase: -0.25 }),
        6 => ReferenceParams::Chirp(Chirp {
            rate: 0.9,
            amplitude: 0.01,
            from: 1.0,
            to: 9.0,
            duration: 0.1,
            phase: 0.0,
        }),
        7 => ReferenceParams::Table(Table { knots: &KNOTS, interpolation: Interpolation::Linear }),
        _ => ReferenceParams::Table(Table { knots: &KNOTS, interpolation: Interpolation::Cubic }),
    };
    let mut settings = Settings::new(&RunParams {
        servo: &ServoParams::paper(law),
        supervisor: &SupervisorParams::new(on_fault),
        bounds: &Bounds::around(&PlantParams::default(), &Tolerances::default()).expect("the paper's"),
        reference: &reference,
        start: FixedCounts(0),
        times: RunTimes {
            watchdog: Micros(3000),
            valid: Micros(2000),
            silence: Micros(3000),
            host_silence: Micros(u32::from(host_silence) * 1000),
        },
        ticks: 200,
    })
    .expect("boards have all of it");
    for _ in 0..path >> 6 {
        // One number of the run, or one of a point; any value.
        let key = usize::from(input.byte()) % (SETTINGS + 6);
        let key = if key < SETTINGS { key } else { 0x1000 + key - SETTINGS };
        let value = u64::from_le_bytes(input.take());
        let fits = settings.set(key as u16, value);
        assert_eq!(settings.set(key as u16, value), fits);
    }
    let built = settings.build().ok()?;
    // Far on, far back, at the start.
    for tick in [0, 1, 1000, u64::from(u32::MAX), u64::MAX] {
        let _ = built.path.target(settings.knots(), tick);
    }
    Some(Plan { settings, built, one_chip: kinds & 1 << 5 != 0 })
}

/// Empties the output, which must be whole frames.
fn frames(out: &mut Outbox) -> (Vec<u8>, Vec<Message>) {
    if out.is_empty() {
        return (Vec::new(), Vec::new());
    }
    let bytes = out.as_bytes().to_vec();
    out.clear();
    assert!(bytes.last().is_none_or(|end| *end == 0), "cut off");
    let mut decoder = Decoder::new();
    let messages = bytes.iter().filter_map(|byte| decoder.push(*byte)).map(|m| m.expect("a frame")).collect();
    (bytes, messages)
}

struct Bench {
    plan: Plan,
    host: HostNode,
    board_controller: BoardController,
    lines: Lines,
    board: BoardNode,
    to_board: Decoder,
    up: Outbox,
    chip: OneChip,
    now_us: u64,
    counts: i32,
    /// The highest code of the run's converter.
    top: u16,
}

impl Bench {
    fn new(plan: Plan) -> Bench {
        let built = &plan.built;
        let times = &built.times;
        let params = ControllerParams {
            run: 5,
            config: 7,
            boot: BOARD.boot,
            watchdog: times.watchdog,
            valid: times.valid,
            silence: times.silence,
        };
        let configure = ControllerNode::new(params, built.servo, built.supervisor).configuration();
        let this = BoardControllerParams { board: 1, boot: 1, clock_hz: 1 };
        Bench {
            top: built.servo.dac().code(f32::INFINITY).0,
            host: HostNode::new(built.servo, configure, 20_000_000, 200_000_000),
            plan,
            board_controller: BoardController::new(this),
            lines: Lines::default(),
            board: BoardNode::new(&BOARD).expect("a board"),
            to_board: Decoder::new(),
            up: Outbox::default(),
            chip: OneChip::new(this, &BOARD).expect("a board"),
            now_us: 1 << 31,
            counts: 700,
        }
    }

    fn now_ns(&self) -> u64 {
        self.now_us.saturating_mul(1000)
    }

    /// Bytes from the host.
    fn host(&mut self, bytes: &[u8]) {
        if self.plan.one_chip {
            self.chip.receive(self.now_us, bytes, &mut |_| ());
        } else {
            let now_ns = self.now_ns();
            let Lines { host, daq, .. } = &mut self.lines;
            self.board_controller.host(now_ns, bytes, host, daq);
        }
        self.settle();
    }

    /// Bytes from the board, where it is none of the controller's own chip.
    fn daq(&mut self, bytes: &[u8]) {
        if self.plan.one_chip {
            return;
        }
        let now_ns = self.now_ns();
        let Lines { host, daq, from_daq } = &mut self.lines;
        self.board_controller.daq(now_ns, from_daq, bytes, host, daq);
        self.settle();
    }

    fn asks(&mut self, f: impl Fn(&mut HostNode, &mut Outbox)) {
        let mut out = Outbox::default();
        f(&mut self.host, &mut out);
        if !out.is_empty() {
            self.host(out.as_bytes());
        }
    }

    /// All output goes to its addressee.
    fn settle(&mut self) {
        let now_ns = self.now_ns();
        let (path, knots) = (&self.plan.built.path, self.plan.settings.knots());
        let at = |tick| path.target(knots, tick);
        if self.plan.one_chip {
            let (bytes, _) = frames(self.chip.outbox());
            self.host.receive(now_ns, &bytes, &at, &mut |_| ());
            let code = self.chip.code();
            assert!(code.0 < 1 << BOARD.dac_bits, "{code:?}");
            return;
        }
        for _ in 0..4 {
            let (bytes, messages) = frames(&mut self.lines.daq);
            for message in messages {
                if let Message::Actuate(m) = message {
                    // A run of other settings may have another converter.
                    assert!(m.run != 5 || m.code <= self.top, "{m:?}");
                }
            }
            self.board.receive(self.now_us as u32, &mut self.to_board, &bytes, &mut self.up);
            let (bytes, _) = frames(&mut self.up);
            if !bytes.is_empty() {
                let Lines { host, daq, from_daq } = &mut self.lines;
                self.board_controller.daq(now_ns, from_daq, &bytes, host, daq);
            }
            let (bytes, _) = frames(&mut self.lines.host);
            self.host.receive(now_ns, &bytes, &at, &mut |_| ());
            if self.lines.daq.is_empty() {
                break;
            }
        }
        let code = self.board.code();
        assert!(code.0 < 1 << BOARD.dac_bits, "{code:?}");
        let word = self.board_controller.last_word().map(|mut word| frames(&mut word).1.len());
        assert_eq!(word, self.board_controller.driving().then_some(1));
    }

    fn passes(&mut self, us: u64) {
        self.boards_pass(us);
        let now_ns = self.now_ns();
        self.asks(|host, out| {
            host.poll(now_ns, out, &mut |_| ());
            assert!(host.poll_at().is_none_or(|at| at > now_ns || now_ns > u64::MAX - 20_000_000));
        });
    }

    /// As for boards whose host sleeps.
    fn boards_pass(&mut self, us: u64) {
        self.now_us = self.now_us.saturating_add(us);
        if self.plan.one_chip {
            self.chip.poll(self.now_us, &mut |_| ());
        } else {
            let now_ns = self.now_ns();
            let Lines { host, daq, .. } = &mut self.lines;
            self.board_controller.poll(now_ns, host, daq);
            // At the end of all times there is no later.
            assert!(self.board_controller.poll_at().is_none_or(|at| at > now_ns || now_ns == u64::MAX));
            self.board.poll(self.now_us as u32, &mut self.up);
        }
        self.settle();
    }

    fn samples(&mut self, moved: i32, faults: u8) {
        self.counts = self.counts.wrapping_add(moved);
        let (counts, encoder, converter) = (Counts(self.counts), faults & 1 != 0, faults & 2 != 0);
        let took = Micros(u32::from(faults) * 10);
        if self.plan.one_chip {
            let mut out = None;
            self.chip.sample(self.now_us, counts, encoder, converter, &mut |code| out = Some(code));
            assert_eq!(out, Some(self.chip.code()));
        } else {
            self.board.sample(self.now_us as u32, counts, encoder, converter, &mut self.up);
            if faults & 4 != 0 {
                self.up.clear(); // lost
            }
        }
        if faults & 8 == 0 {
            self.settle(); // else it waits for the next
        }
        if self.plan.one_chip {
            self.chip.answered(0, took);
        } else {
            self.board_controller.spent(u32::from(faults));
            self.board_controller.answered(took);
        }
    }

    fn acts(&mut self, input: &mut Input<'_>) {
        match input.byte() % 16 {
            0 => self.asks(|host, out| host.discover(1, out)),
            1 => {
                let mut all = Vec::new();
                self.plan.settings.each(|key, value| all.push((key, value)));
                // The answers to so many have room.
                for some in all.chunks(20) {
                    self.asks(|host, out| some.iter().for_each(|(key, value)| host.set(*key, *value, out)));
                }
            }
            2 => self.asks(|host, out| host.configure(out)),
            3 => self.asks(|host, out| host.arm(out)),
            4 => {
                for _ in 0..input.byte() % 64 {
                    self.passes(1000);
                    self.samples(3, 0);
                }
            }
            5 => {
                for _ in 0..input.byte() % 64 {
                    self.boards_pass(1000);
                    self.samples(3, 0);
                }
            }
            6 => {
                let [moved, faults] = input.take();
                self.passes(1000);
                self.samples(i32::from(moved.cast_signed()), faults);
            }
            7 => {
                let moved = i32::from_le_bytes(input.take());
                self.samples(moved, 0);
            }
            8 => self.passes(u64::from(u16::from_le_bytes(input.take()))),
            9 => self.passes(u64::from_le_bytes(input.take()) >> (input.byte() % 64)),
            10 => {
                let done = input.byte() & 1 == 0;
                let reason = if done { StopReason::Done } else { StopReason::Operator };
                self.asks(|host, out| host.stop(reason, out));
            }
            11 => {
                let frame = input.frame();
                self.host(&frame);
            }
            12 => {
                let frame = input.frame();
                self.daq(&frame);
            }
            13 => {
                let frame = input.frame();
                let (path, knots) = (&self.plan.built.path, self.plan.settings.knots());
                let at = |tick| path.target(knots, tick);
                self.host.receive(self.now_us.saturating_mul(1000), &frame, &at, &mut |_| ());
            }
            14 => {
                let length = usize::from(input.byte());
                let bytes = input.some(length);
                self.host(&bytes);
                self.daq(&bytes);
            }
            _ => {
                let setting = (u16::from_le_bytes(input.take()), u64::from_le_bytes(input.take()));
                self.asks(|host, out| host.set(setting.0, setting.1, out));
            }
        }
    }
}

fuzz_target!(|data: &[u8]| {
    let mut input = Input(data);
    let Some(plan) = plan(&mut input) else { return };
    let mut bench = Bench::new(plan);
    while !input.0.is_empty() {
        bench.acts(&mut input);
    }
});
