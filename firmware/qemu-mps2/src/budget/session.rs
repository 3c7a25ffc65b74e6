//! Whole periods of a controller: runs in which the line and the board do what they can.

use crate::inputs::Random;
use crate::kernels::{Bytes, Session, whole_tick};
use crate::meter::{Tally, instructions};
use clutch_core::law::{LawParams, SmcParams};
use clutch_core::reference::{Interpolation, Knot, MinimumJerk, ReferenceParams, Sine, Table};
use clutch_core::{
    Bounds, FixedCounts, Micros, PlantParams, SafeState, Servo, ServoParams, Supervisor, SupervisorParams,
    Tolerances,
};
use clutch_node::{ControlNode, ControlParams, Onboard, OnboardParams, Ports, RunParams, Settings};
use clutch_wire::{
    Arm, Armed, BoardFault, BoardState, Configured, Discover, Fault, Hello, Message, Pong, Refused, SCHEMA,
    STATUS_DAC_FAULT, STATUS_ENCODER_FAULT, STATUS_LATE, Sample, Set, Stop, StopReason, Stopped, VERSION,
    encode,
};

const RUN: u16 = 7;
const CONFIG: u64 = 0xfeed_f00d;
const RUNS: u32 = 120;
const PERIODS: u32 = 60;

/// A controller that has been configured by its host, up to the question to encoder and converter.
fn session(kind: u32) -> Option<Session> {
    let law = LawParams::Smc(SmcParams::default());
    let servo = ServoParams::<f32>::paper(law);
    let bounds = Bounds::around(&PlantParams::default(), &Tolerances::default()).ok()?;
    let on_fault = match kind % 4 {
        0 => SafeState::Hold { volts: 5.0 },
        1 => SafeState::Ramp { volts_per_s: 1000.0, volts: 5.0 },
        2 => SafeState::Release,
        _ => SafeState::HoldThenRelease { volts: 5.0, after: 0.01 },
    };
    let knots =
        [0, 20_000, 40_000, 60_000].map(|us| Knot { time_us: us, position: FixedCounts(us as i64 * 60) });
    let table = |interpolation| ReferenceParams::Table(Table { knots: &knots, interpolation });
    let path = match kind % 5 {
        0 => ReferenceParams::Ramp(0.35),
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
        watchdog,
        valid,
        silence,
        host_silence: Micros(1_000_000),
        ticks: u64::from(PERIODS) - 5,
    })
    .ok()?;
    let mut session = Session {
        node: Onboard::new(OnboardParams { board: 1, boot: 1, clock_hz: 0 }),
        ports: Ports::default(),
        now_ns: 0,
    };
    session.asks(&Message::Discover(Discover { nonce: 1, version: VERSION, schema: SCHEMA }));
    session.node.daq(0, encode(&hello(RUN)).as_bytes(), &mut session.ports);
    settings.each(|key, value| session.asks(&Message::Set(Set { run: RUN, key, value })));
    let params = ControlParams { run: RUN, config: CONFIG, watchdog, valid, silence };
    let supervisor = Supervisor::new(&supervisor, &servo, &bounds).ok()?;
    let node = ControlNode::new(params, Servo::new(&servo).ok()?, supervisor);
    session.asks(&Message::Configure(node.configuration()));
    Some(session)
}

impl Session {
    /// A frame of the host's, which is not measured.
    fn asks(&mut self, message: &Message) {
        self.ports.host.clear();
        self.ports.daq.clear();
        self.node.host(self.now_ns, encode(message).as_bytes(), &mut self.ports);
    }
}

fn period(tally: &mut Tally, session: &mut Session, bytes: &Bytes) -> u32 {
    session.now_ns = session.now_ns.wrapping_add(1_000_000);
    let arguments = [&raw mut *session as usize, &raw const *bytes as usize, 0];
    let function = whole_tick as extern "C" fn(&mut Session, &Bytes);
    // SAFETY: the arguments are those of the function.
    let count = unsafe { instructions(function as usize, arguments) };
    tally.add(count);
    count
}

fn hello(run: u16) -> Message {
    Message::Hello(Hello {
        nonce: 1,
        version: VERSION,
        schema: SCHEMA,
        board: 1,
        boot: 1,
        counts_per_rev: 20_000,
        dac_bits: 12,
        dac_lowest_mv: -10_000,
        dac_highest_mv: 10_000,
        period_min_us: 100,
        period_max_us: 10_000,
        watchdog_max_us: 100_000,
        boot_code: 2048,
        state: BoardState::Running as u8,
        run,
        config: CONFIG,
    })
}

/// Anything but a sample of this run.
fn other(random: &mut Random) -> Message {
    let run = if random.below(3) == 0 { RUN } else { RUN + 1 };
    match random.below(6) {
        0 => hello(run),
        1 => Message::Pong(Pong { run, nonce: 1, time_us: random.next() }),
        2 => Message::Refused(Refused { request: 4, reason: 1, value: random.next() }),
        3 => Message::Stopped(Stopped { run, reason: StopReason::Done as u8, code: 2048 }),
        4 => {
            let cause = BoardFault::Watchdog as u8;
            Message::Fault(Fault { run, sequence: 3, time_us: random.next(), cause, value: 0 })
        }
        _ => Message::Sample(Sample { run: RUN + 1, sequence: 0, time_us: 0, counts: 0, status: 3 }),
    }
}

/// Measures and prints.
pub fn measure() -> Option<()> {
    let mut tally = Tally::new("whole_tick");
    // Of these, samples that came in order, right after the one before.
    let mut in_order = Tally::new("whole_tick_in_order");
    let mut random = Random::new(5);
    for kind in 0..RUNS {
        let mut session = session(kind)?;
        period(
            &mut tally,
            &mut session,
            &Bytes::of(&Message::Configured(Configured { run: RUN, config: CONFIG, boot: 1 })),
        );
        if kind % 16 != 15 {
            session.asks(&Message::Arm(Arm { run: RUN, config: CONFIG }));
            period(&mut tally, &mut session, &Bytes::of(&Message::Armed(Armed { run: RUN, config: CONFIG })));
        }
        // How often something is amiss differs from run to run: a run that ends early tries little.
        let rarity = [4, 12, 40][kind as usize % 3];
        let (mut sequence, mut counts) = (random.next() as u16, random.next() as i32);
        // The first two samples of a run are not in a row with anything.
        let mut before = 0;
        for _ in 0..PERIODS {
            sequence = sequence.wrapping_add(1);
            counts = counts.wrapping_add(random.below(3) as i32);
            let mut sample = Sample {
                run: RUN,
                sequence,
                time_us: random.next(),
                counts,
                status: BoardState::Running as u8,
            };
            let amiss = if random.below(rarity) == 0 { random.below(9) } else { 9 };
            let bytes = match amiss {
                // Lost ones: few, or so many that it is silence.
                0 => {
                    sequence = sequence.wrapping_add(1 + random.below(14) as u16);
                    sample.sequence = sequence;
                    Bytes::of(&Message::Sample(sample))
                }
                1 => {
                    sample.sequence = sequence.wrapping_sub(1);
                    Bytes::of(&Message::Sample(sample))
                }
                2 => {
                    sample.sequence = sequence.wrapping_sub(3);
                    Bytes::of(&Message::Sample(sample))
                }
                3 => {
                    sample.counts = random.next() as i32;
                    Bytes::of(&Message::Sample(sample))
                }
                4 => {
                    sample.status |= STATUS_LATE;
                    Bytes::of(&Message::Sample(sample))
                }
                5 => {
                    sample.status =
                        [BoardState::Running as u8 | STATUS_ENCODER_FAULT, STATUS_DAC_FAULT | 3, 1]
                            [random.below(3) as usize % 3];
                    Bytes::of(&Message::Sample(sample))
                }
                6 => {
                    let whole = Bytes::of(&Message::Sample(sample));
                    whole.corrupted(random.below(20) as usize, random.next() as u8)
                }
                7 => Bytes::of(&other(&mut random)),
                8 => {
                    session.node.answered(Micros(random.below(4000)));
                    Bytes::of(&Message::Sample(sample))
                }
                _ => Bytes::of(&Message::Sample(sample)),
            };
            let count = period(&mut tally, &mut session, &bytes);
            if amiss == 9 && before == 9 {
                in_order.add(count);
            }
            before = amiss;
            if random.below(200) == 0 {
                session.asks(&Message::Stop(Stop { run: RUN, reason: StopReason::Operator as u8 }));
            }
        }
    }
    tally.print();
    in_order.print();
    Some(())
}
