//! Whole periods of a controller: runs in which the line and the board do everything they can.

use crate::inputs::Random;
use crate::kernels::{Bytes, Chip, Pins, Session, chip_period, whole_tick};
use crate::meter::{Tally, between, instructions};
use clutch_core::law::LawParams;
use clutch_core::reference::{Interpolation, Knot, MinimumJerk, ReferenceParams, Sine, Table};
use clutch_core::{
    Bounds, FixedCounts, Micros, PlantParams, SafeState, Servo, ServoParams, Supervisor, SupervisorParams,
    Tolerances,
};
use clutch_node::{
    BoardController, BoardControllerParams, BoardParams, ControllerNode, ControllerParams, Lines, OneChip,
    ResetCause,
};
use clutch_settings::{RunParams, RunTimes, Settings};
use clutch_wire::{
    Arm, Armed, BoardFault, BoardState, Configured, Decoder, Discover, Fault, Hello, Message, Pong, Refused,
    SCHEMA, STATUS_DAC_FAULT, STATUS_ENCODER_FAULT, STATUS_LATE, Sample, Set, Stop, StopReason, Stopped,
    TELEMETRY_ANSWERED, VERSION, encode,
};

const RUN: u16 = 7;
const CONFIG: u64 = 0xfeed_f00d;
const BOOT: u32 = 0x5eed_b007;
const RUNS: u32 = 600;
const PERIODS: u32 = 60;

/// A run: its settings, and the question of its host whether it may begin.
fn run(kind: u32) -> Option<(Settings, Message)> {
    let laws = LawParams::<f32>::all();
    let servo = ServoParams::paper(*laws.get(kind as usize % laws.len())?);
    let bounds = Bounds::around(&PlantParams::default(), &Tolerances::default()).ok()?;
    let on_fault = match kind % 4 {
        0 => SafeState::hold(5.0),
        1 => SafeState::ramp(1000.0, 5.0),
        2 => SafeState::Release,
        _ => SafeState::hold_then_release(5.0, 0.01),
    };
    let knots =
        [0, 20_000, 40_000, 60_000].map(|us| Knot { time_us: us, position: FixedCounts(us as i64 * 60) });
    let table = |interpolation| ReferenceParams::Table(Table { knots: &knots, interpolation });
    let path = match kind % 5 {
        0 => ReferenceParams::ramp(0.35),
        1 => ReferenceParams::MinimumJerk(MinimumJerk { distance: 0.02, duration: 0.06 }),
        2 => ReferenceParams::Sine(Sine { rate: 0.3, amplitude: 0.001, frequency: 5.0, phase: 0.0 }),
        3 => table(Interpolation::Linear),
        _ => table(Interpolation::Cubic),
    };
    let (watchdog, valid, silence) = (Micros(3000), Micros(2000), Micros(3000));
    let supervisor = SupervisorParams::new(on_fault);
    let settings = Settings::new(&RunParams {
        servo: &servo,
        supervisor: &supervisor,
        bounds: &bounds,
        reference: &path,
        start: FixedCounts(0),
        times: RunTimes { watchdog, valid, silence, host_silence: Micros(1_000_000) },
        ticks: u64::from(PERIODS) - 5,
    })
    .ok()?;
    let params = ControllerParams { run: RUN, config: CONFIG, boot: BOOT, watchdog, valid, silence };
    let supervisor = Supervisor::new(&supervisor, &servo, &bounds).ok()?;
    let node = ControllerNode::new(params, Servo::new(&servo).ok()?, supervisor);
    Some((settings, Message::Configure(node.configuration())))
}

/// Encoder and converter.
const BOARD: BoardParams = BoardParams {
    board: 1,
    boot: BOOT,
    counts_per_rev: 20_000,
    dac_bits: 12,
    dac_lowest_mv: -10_000,
    dac_highest_mv: 10_000,
    period_min_us: 100,
    period_max_us: 10_000,
    watchdog_max_us: 100_000,
    boot_code: 2048,
    started_by: ResetCause::Power,
    brown_out_low: false,
};

const CONTROLLER: BoardControllerParams = BoardControllerParams { board: 1, boot: BOOT, clock_hz: 0 };

/// A controller that has been configured by its host, up to the question to encoder and converter.
fn session(kind: u32) -> Option<Session> {
    let (settings, configure) = run(kind)?;
    let mut session = Session { node: BoardController::new(CONTROLLER), lines: Lines::default(), now_ns: 0 };
    session.asks(&Message::Discover(Discover { nonce: 1, version: VERSION, schema: SCHEMA }));
    let Lines { host, daq, from_daq } = &mut session.lines;
    session.node.daq(0, from_daq, encode(&hello(RUN)).as_bytes(), host, daq);
    settings.each(|key, value| session.asks(&Message::Set(Set { run: RUN, key, value })));
    session.asks(&configure);
    Some(session)
}

/// A chip that is controller and board, armed.
fn chip(kind: u32) -> Option<Chip> {
    let (settings, configure) = run(kind)?;
    let node = OneChip::new(CONTROLLER, &BOARD).ok()?;
    let (begun, out, told) = (0, 0, None);
    let pins = Pins {
        now_us: 0,
        counts: 0,
        encoder_fault: false,
        converter_fault: false,
        line: [0; 512],
        used: 0,
        begun,
        out,
        told,
    };
    let mut chip = Chip { node, pins };
    chip.asks(&Message::Discover(Discover { nonce: 1, version: VERSION, schema: SCHEMA }));
    settings.each(|key, value| chip.asks(&Message::Set(Set { run: RUN, key, value })));
    chip.asks(&configure);
    chip.asks(&Message::Arm(Arm { run: RUN, config: CONFIG, boot: BOOT }));
    Some(chip)
}

impl Chip {
    /// A frame of the host's, which is not measured.
    fn asks(&mut self, message: &Message) {
        clutch_node::receive(&mut self.node, &mut self.pins, encode(message).as_bytes());
    }

    /// True if the period's telemetry says that its sample was answered.
    fn answered(&self) -> bool {
        let (mut decoder, line) = (Decoder::new(), self.pins.line.get(..self.pins.used).unwrap_or_default());
        line.iter().filter_map(|byte| decoder.push(*byte)).any(
            |frame| matches!(frame, Ok(Message::Telemetry(told)) if told.flags & TELEMETRY_ANSWERED != 0),
        )
    }

    /// A period; its instructions, and those of them up to the code, the reading of the clock among them.
    fn period(&mut self) -> (u32, u32) {
        self.pins.now_us = self.pins.now_us.wrapping_add(1000);
        let arguments = [&raw mut *self as usize, 0, 0];
        let function = chip_period as extern "C" fn(&mut Chip);
        // SAFETY: the arguments are those of the function.
        let whole = unsafe { instructions(function as usize, arguments) };
        (whole, between(self.pins.begun, self.pins.out))
    }
}

/// Runs of a chip: laws, safe states and paths in turn, with faults of its hardware and implausible counts.
fn measure_chip(random: &mut Random) -> Option<()> {
    let mut others = ["chip_code", "chip_any_code", "chip_goes_on", "chip_period"].map(Tally::new);
    let mut table =
        ["chip_code_table", "chip_any_code_table", "chip_goes_on_table", "chip_period_table"].map(Tally::new);
    let mut glide =
        ["chip_code_glide", "chip_any_code_glide", "chip_goes_on_glide", "chip_period_glide"].map(Tally::new);
    let mut safe = Tally::new("chip_safe");
    let laws = LawParams::<f32>::all();
    for kind in 0..RUNS {
        let glides = laws.get(kind as usize % laws.len())?.filter().is_some();
        let [code, any_code, goes_on, any] = match kind % 5 {
            // Bounded apart, and not both at once.
            3 | 4 if glides => continue,
            3 | 4 => &mut table,
            _ if glides => &mut glide,
            _ => &mut others,
        };
        let mut chip = chip(kind)?;
        // The first sample starts the servo, and one behind a refused one bridges: bounded with any sample.
        let (mut served, mut periods, mut shaft) = (false, 0, 0_i32);
        let rarity = [20, 60, 100_000].get(kind as usize % 3).copied()?;
        for _ in 0..PERIODS {
            shaft = shaft.wrapping_add(random.below(3) as i32);
            chip.pins.counts = shaft;
            match (random.below(rarity), random.below(4)) {
                (0, 0) => chip.pins.encoder_fault = true,
                (0, 1) => chip.pins.converter_fault = true,
                // Counts that leap and stay, or are wrong once.
                (0, 2) => (shaft, chip.pins.counts) = (random.next() as i32, shaft),
                (0, _) => chip.pins.counts = random.next() as i32,
                _ => {}
            }
            let drove = chip.node.state() == BoardState::Running;
            let (period, to_code) = chip.period();
            let (goes, answered) = (chip.node.state() == BoardState::Running, chip.answered());
            any.add(period);
            if served && goes && periods + 8 < PERIODS {
                goes_on.add(period);
                if answered {
                    code.add(to_code);
                }
            }
            if answered {
                any_code.add(to_code);
            }
            if drove
                && chip.node.state() == BoardState::Faulted
                && !chip.pins.encoder_fault
                && !chip.pins.converter_fault
            {
                safe.add(to_code);
            }
            served = goes && answered;
            periods += 1;
            if random.below(500) == 0 {
                chip.asks(&Message::Stop(Stop { run: RUN, reason: StopReason::Operator as u8 }));
            }
        }
    }
    [others, table, glide].iter().flatten().chain([&safe]).for_each(Tally::print);
    Some(())
}

impl Session {
    /// A frame of the host's, which is not measured.
    fn asks(&mut self, message: &Message) {
        self.lines.host.clear();
        self.lines.daq.clear();
        let Lines { host, daq, .. } = &mut self.lines;
        self.node.host(self.now_ns, encode(message).as_bytes(), host, daq);
    }

    /// A period; its instructions.
    fn period(&mut self, bytes: &Bytes) -> u32 {
        self.now_ns = self.now_ns.wrapping_add(1_000_000);
        let arguments = [&raw mut *self as usize, &raw const *bytes as usize, 0];
        let function = whole_tick as extern "C" fn(&mut Session, &Bytes);
        // SAFETY: the arguments are those of the function.
        unsafe { instructions(function as usize, arguments) }
    }
}

fn hello(run: u16) -> Message {
    let BoardParams {
        board,
        boot,
        counts_per_rev,
        dac_bits,
        dac_lowest_mv,
        dac_highest_mv,
        period_min_us,
        period_max_us,
        watchdog_max_us,
        boot_code,
        started_by,
        brown_out_low,
    } = BOARD;
    Message::Hello(Hello {
        nonce: 1,
        version: VERSION,
        schema: SCHEMA,
        board,
        boot,
        counts_per_rev,
        dac_bits,
        dac_lowest_mv,
        dac_highest_mv,
        period_min_us,
        period_max_us,
        watchdog_max_us,
        boot_code,
        started_by: started_by as u8,
        warnings: u8::from(brown_out_low),
        state: BoardState::Running as u8,
        run,
        config: CONFIG,
    })
}

/// Anything but a sample.
fn other(random: &mut Random) -> Message {
    let run = if random.below(3) == 0 { RUN } else { RUN + 1 };
    match random.below(5) {
        0 => hello(run),
        1 => Message::Pong(Pong { run, nonce: 1, time_us: random.next() }),
        2 => Message::Refused(Refused { request: 4, reason: 1, value: random.next() }),
        3 => Message::Stopped(Stopped { run, reason: StopReason::Done as u8, code: 2048 }),
        _ => {
            let cause = BoardFault::Watchdog as u8;
            Message::Fault(Fault { run, sequence: 3, time_us: random.next(), cause, value: 0 })
        }
    }
}

/// The fault in the frame of a period.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Amiss {
    Nothing,
    /// The samples before it are lost: few, or so many that it is silence.
    Lost,
    Repeated,
    Reordered,
    /// The counts are those of no shaft.
    Jump,
    /// The board's report about itself.
    Status,
    /// A byte is not as it was sent.
    Corrupted,
    /// It is not a sample.
    Other,
    /// The answer before was late.
    Late,
}

const AMISS: [Amiss; 8] = [
    Amiss::Lost,
    Amiss::Repeated,
    Amiss::Reordered,
    Amiss::Jump,
    Amiss::Status,
    Amiss::Corrupted,
    Amiss::Other,
    Amiss::Late,
];

/// The frame of a period; `sample` is that of the period before, and becomes its own.
fn frame(random: &mut Random, amiss: Amiss, sample: &mut Sample) -> Bytes {
    let lost = if amiss == Amiss::Lost { 1 + random.below(14) as u16 } else { 0 };
    sample.sequence = sample.sequence.wrapping_add(1).wrapping_add(lost);
    sample.counts = sample.counts.wrapping_add(random.below(3) as i32);
    sample.time_us = random.next();
    let sent = match amiss {
        Amiss::Repeated => Sample { sequence: sample.sequence.wrapping_sub(1), ..*sample },
        Amiss::Reordered => {
            let run = if random.below(4) == 0 { RUN + 1 } else { RUN };
            Sample { run, sequence: sample.sequence.wrapping_sub(3), ..*sample }
        }
        Amiss::Jump => Sample { counts: random.next() as i32, ..*sample },
        Amiss::Status => {
            let flags = [STATUS_LATE, STATUS_ENCODER_FAULT, STATUS_DAC_FAULT, 0];
            let flag = flags.get(random.below(4) as usize).copied().unwrap_or(0);
            // Without a flag: a board that does not drive.
            let state = if flag == 0 { BoardState::Ready } else { BoardState::Running };
            Sample { status: state as u8 | flag, ..*sample }
        }
        _ => *sample,
    };
    let whole = Bytes::of(&Message::Sample(sent));
    match amiss {
        Amiss::Corrupted => whole.corrupted(random.below(20) as usize, random.next() as u8),
        Amiss::Other => Bytes::of(&other(random)),
        _ => whole,
    }
}

/// Measures and prints.
pub fn measure() -> Option<()> {
    let mut in_order = Tally::new("whole_tick_in_order");
    let mut formula = Tally::new("whole_tick_formula");
    let mut table = Tally::new("whole_tick_table");
    let mut others = Tally::new("whole_tick_other");
    let mut random = Random::new(5);
    for kind in 0..RUNS {
        let mut session = session(kind)?;
        let configured = Configured { run: RUN, config: CONFIG, boot: BOOT };
        others.add(session.period(&Bytes::of(&Message::Configured(configured))));
        if kind % 16 != 15 {
            session.asks(&Message::Arm(Arm { run: RUN, config: CONFIG, boot: BOOT }));
            others.add(session.period(&Bytes::of(&Message::Armed(Armed { run: RUN, config: CONFIG }))));
        }
        // The frequency of faults differs from run to run: a run that ends early tries little.
        let rarity = [4, 12, 40].get(kind as usize % 3).copied()?;
        let (sequence, counts) = (random.next() as u16, random.next() as i32);
        let mut sample = Sample { run: RUN, sequence, time_us: 0, counts, status: BoardState::Running as u8 };
        // The first sample is not in order with anything.
        let mut before = Amiss::Lost;
        for _ in 0..PERIODS {
            let amiss = match random.below(rarity) {
                0 => AMISS.get(random.below(8) as usize).copied()?,
                _ => Amiss::Nothing,
            };
            if amiss == Amiss::Late {
                session.node.answered(Micros(random.below(4000)));
            }
            let count = session.period(&frame(&mut random, amiss, &mut sample));
            let of = match (amiss, before) {
                (Amiss::Corrupted | Amiss::Other, _) => &mut others,
                (Amiss::Nothing, Amiss::Nothing) => &mut in_order,
                _ if kind % 5 < 3 => &mut formula,
                _ => &mut table,
            };
            of.add(count);
            before = amiss;
            if random.below(200) == 0 {
                session.asks(&Message::Stop(Stop { run: RUN, reason: StopReason::Operator as u8 }));
            }
        }
    }
    [in_order, formula, table, others].iter().for_each(Tally::print);
    measure_chip(&mut random)
}
