//! Whole periods of a controller: runs in which the line and the board do what they can.

use crate::inputs::Random;
use crate::kernels::{Bytes, Session, whole_tick};
use crate::meter::{Tally, instructions};
use clutch_core::law::{LawParams, SmcParams};
use clutch_core::reference::{MinimumJerk, Reference, ReferenceParams};
use clutch_core::{
    Bounds, DacCode, Encoder, FixedCounts, Micros, PlantParams, SafeState, Servo, ServoParams, Supervisor,
    SupervisorParams, Tolerances,
};
use clutch_node::{ControlNode, ControlParams, Outbox};
use clutch_wire::{
    Armed, BoardFault, BoardState, Configured, Fault, Hello, Message, Pong, Refused, SCHEMA, STATUS_DAC_FAULT,
    STATUS_ENCODER_FAULT, STATUS_LATE, Sample, StopReason, Stopped, VERSION,
};

const RUN: u16 = 7;
const CONFIG: u64 = 0xfeed_f00d;
const RUNS: u32 = 120;
const PERIODS: u32 = 60;

fn session(kind: u32) -> Option<Session> {
    let law = LawParams::Smc(SmcParams::default());
    let params = ServoParams::<f32>::paper(law);
    let bounds = Bounds::around(&PlantParams::default(), &Tolerances::default()).ok()?;
    let on_fault = match kind % 4 {
        0 => SafeState::Hold { volts: 5.0 },
        1 => SafeState::Ramp { volts_per_s: 1000.0, volts: 5.0 },
        2 => SafeState::Release,
        _ => SafeState::HoldThenRelease { volts: 5.0, after: 0.01 },
    };
    let supervisor = Supervisor::new(&SupervisorParams::new(on_fault), &params, &bounds).ok()?;
    let control = ControlParams {
        run: RUN,
        config: CONFIG,
        watchdog: Micros(3000),
        valid: Micros(2000),
        silence: Micros(3000),
    };
    let path = match kind % 2 {
        0 => ReferenceParams::Ramp(0.35),
        _ => ReferenceParams::MinimumJerk(MinimumJerk { distance: 0.02, duration: 0.06 }),
    };
    Some(Session {
        node: ControlNode::new(control, Servo::new(&params).ok()?, supervisor),
        path: Reference::new(&path, FixedCounts(0), Encoder::PAPER, params.period).ok()?,
        out: Outbox::default(),
        now_ns: 0,
        told: None,
    })
}

fn period(tally: &mut Tally, session: &mut Session, bytes: &Bytes) {
    session.now_ns = session.now_ns.wrapping_add(1_000_000);
    let arguments = [&raw mut *session as usize, &raw const *bytes as usize, 0];
    let function = whole_tick as extern "C" fn(&mut Session, &Bytes);
    // SAFETY: the arguments are those of the function.
    tally.add(unsafe { instructions(function as usize, arguments) });
}

/// Anything but a sample of this run.
fn other(random: &mut Random) -> Message {
    let run = if random.below(3) == 0 { RUN } else { RUN + 1 };
    match random.below(6) {
        0 => Message::Hello(Hello {
            nonce: random.next(),
            version: VERSION,
            schema: SCHEMA,
            board: 1,
            boot: random.next(),
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
        }),
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
    let mut random = Random::new(5);
    for kind in 0..RUNS {
        let mut session = session(kind)?;
        session.node.configure(DacCode(2048), &mut session.out);
        period(&mut tally, &mut session, &Bytes::of(&Message::Configured(Configured { run: RUN, config: CONFIG, boot: 1 })));
        if kind % 16 != 15 {
            period(&mut tally, &mut session, &Bytes::of(&Message::Armed(Armed { run: RUN, config: CONFIG })));
        }
        // How often something is amiss differs from run to run: a run that ends early tries little.
        let rarity = [4, 12, 40][kind as usize % 3];
        let (mut sequence, mut counts) = (random.next() as u16, random.next() as i32);
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
                    sample.status = [BoardState::Running as u8 | STATUS_ENCODER_FAULT, STATUS_DAC_FAULT | 3, 1]
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
            period(&mut tally, &mut session, &bytes);
            if random.below(200) == 0 {
                session.node.stop(StopReason::Operator, &mut session.out);
            }
        }
    }
    tally.print();
    Some(())
}
