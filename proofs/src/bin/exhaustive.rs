//! Properties tried for every value of their domain: docs/proof.md. `cargo xtask prove` runs it.
//!
//! Each is run twice: as it is, and with a claim that is a little too bold, or a part that is broken. The second run has to
//! find a value for which it does not hold, or the first has not looked.
// The values are many: errors are found by the claim, and not by a message of each.
use clutch_core::friction::{FrictionModel, Stribeck, StribeckParams};
use clutch_core::law::{ControlLaw, LawParams, OutputParams, Pd, PdParams, Smc, SmcParams, Tick};
use clutch_core::reference::{Interpolation, Knot, Table};
use clutch_core::supervisor::{BoardMode, Cause, Sample, State};
use clutch_core::{
    Arithmetic, Bounds, Counts, Dac, DacCode, DacParams, Encoder, FixedCounts, Micros, PlantParams, Real,
    SafeState, Servo, ServoParams, Supervisor, SupervisorParams, SupervisorState, Target, Tolerances,
};
use clutch_wire::{Decoder, Message, Ping, encode};
use std::process::ExitCode;
use std::time::Instant;

/// Values tried, or the first for which it does not hold.
type Tried = Result<u64, String>;

/// With `true` its control.
type Property = fn(bool) -> Tried;

const PROPERTIES: [(&str, Property); 9] = [
    ("exponential", exponential),
    ("stribeck", stribeck),
    ("sine", sine),
    ("codes", codes),
    ("further_ahead", further_ahead),
    ("table", table),
    ("frames", frames),
    ("faulted", faulted),
    ("consent", consent),
];

fn main() -> ExitCode {
    let only: Vec<String> = std::env::args().skip(1).collect();
    let mut held = true;
    for (name, property) in PROPERTIES {
        if !only.is_empty() && !only.iter().any(|o| o == name) {
            continue;
        }
        let begun = Instant::now();
        let tried = property(false);
        let seconds = begun.elapsed().as_secs_f64();
        let control = property(true);
        held &= tried.is_ok() && control.is_err();
        let tried = tried.map_or_else(|e| format!("FAILED: {e}"), |n| n.to_string());
        let control = control.map_or_else(|e| format!("red: {e}"), |_| "NOT RED".into());
        println!("{name}\t{tried}\t{seconds:.1}\t{control}");
    }
    if held { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Tries the numbers below `count` on all cores.
fn each(count: u64, holds: impl Fn(u64) -> bool + Sync) -> Tried {
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get() as u64);
    let part = count.div_ceil(threads);
    let failed = std::thread::scope(|scope| {
        let parts: Vec<_> = (0..threads)
            .map(|t| {
                let (holds, mut numbers) = (&holds, t * part..count.min((t + 1) * part));
                scope.spawn(move || numbers.find(|n| !holds(*n)))
            })
            .collect();
        parts.into_iter().find_map(|part| part.join().unwrap_or(Some(u64::MAX)))
    });
    failed.map_or(Ok(count), |n| Err(format!("number {n} = {n:#x}")))
}

/// Every float from 0 to `last`.
fn each_float_up_to(last: f32, holds: impl Fn(f32) -> bool + Sync) -> Tried {
    each(u64::from(last.to_bits()) + 1, |bits| holds(f32::from_bits(bits as u32)))
}

/// The short exponential is as good as single precision, and in ]0, 1], for every float from 0 to 87.
fn exponential(bold: bool) -> Tried {
    let most = if bold { 1e-8 } else { 1.5e-7 };
    each_float_up_to(f32::EXP_NEG_MAX, |x| {
        let short = x.exp_neg();
        short > 0.0 && short <= 1.0 && (f64::from(short) - libm::exp(-f64::from(x))).abs() <= most
    })
}

/// Stribeck's curve of Table 1 lies between its two levels, has the sign of the motion, and falls with the speed: from a
/// float to the next it rises by no more than two units in the last place, for every float from 0 to infinity.
fn stribeck(bold: bool) -> Tried {
    let curve = Stribeck::<f32>::new(&StribeckParams::<f64>::default().cast()).map_err(|e| e.to_string())?;
    let slack = if bold { 0.0 } else { 2.0 * 0.2 * f32::EPSILON };
    each_float_up_to(f32::INFINITY, |v| {
        let level = curve.level(v);
        let before = curve.level(f32::from_bits(v.to_bits().saturating_sub(1)));
        let coefficient = curve.coefficient(v);
        (0.15..=0.2).contains(&level)
            && level <= before + slack
            && curve.coefficient(-v) == -coefficient
            && coefficient == if v > 0.0 { level } else { 0.0 }
    })
}

/// The short sine and cosine are as good as single precision, for every float up to an eighth of a turn, either sign.
fn sine(bold: bool) -> Tried {
    let most = if bold { 1e-8 } else { 1.2e-7 };
    each_float_up_to(core::f32::consts::FRAC_PI_4, |x| {
        let ((s, c), (sine, cosine)) = (x.sin_cos_octant(), libm::sincos(f64::from(x)));
        let near = |a: f32, b: f64| (f64::from(a) - b).abs() <= most;
        near(s, sine) && near(c, cosine) && s <= 1.0 && c <= 1.0 && (-x).sin_cos_octant() == (-s, c)
    })
}

/// The voltage of a code gives that code again: every code of every converter from 1 to 16 bits over ±10 V and over 0 to
/// 10 V, in both precisions; a code above the top is the top's.
fn codes(bold: bool) -> Tried {
    fn back<T: Real>(bits: u8, lowest: f64, code: u16, off: f64) -> bool {
        let p = DacParams { bits, lowest: T::from_f64(lowest), highest: T::from_f64(10.0) };
        let Ok(dac) = Dac::<T>::new(&p) else { return false };
        let top = ((1_u32 << bits) - 1) as u16;
        dac.code(dac.volts(DacCode(code)) + T::from_f64(off) * dac.step()) == DacCode(code.min(top))
    }
    let off = if bold { 0.5 } else { 0.0 };
    each(16 << 16, |n| {
        let (bits, code) = ((n >> 16) as u8 + 1, n as u16);
        [-10.0, 0.0]
            .into_iter()
            .all(|lowest| back::<f32>(bits, lowest, code, off) && back::<f64>(bits, lowest, code, off))
    })
}

/// A shaft further ahead is never braked less: PD and sliding mode with the paper's gains, every float as the error against
/// the next one, at two rates of the error.
fn further_ahead(bold: bool) -> Tried {
    fn law<C: ControlLaw<f32> + Sync>(law: &C, bold: bool) -> Tried {
        let voltage = |error: f32, error_rate: f32| {
            let error = if bold { -error } else { error };
            let tick = Tick { error, error_rate, target_velocity: 0.0, target_acceleration: 0.0 };
            law.update(&mut law.start(&tick, 0.0), &tick).voltage
        };
        let infinite = u64::from(f32::INFINITY.to_bits());
        let both = each(infinite, |bits| {
            let (near, far) = (f32::from_bits(bits as u32), f32::from_bits(bits as u32 + 1));
            [-0.35, 0.35].into_iter().all(|rate| {
                voltage(near, rate) >= voltage(far, rate) && voltage(-near, rate) <= voltage(-far, rate)
            })
        })?;
        Ok(4 * both)
    }
    let (out, period) = (OutputParams::default(), Micros(1000));
    let pd = Pd::new(&PdParams::<f64>::default().cast::<f32>(), &out, period).map_err(|e| e.to_string())?;
    let smc =
        Smc::new(&SmcParams::<f64>::default().cast::<f32>(), &out, period).map_err(|e| e.to_string())?;
    Ok(law(&pd, bold)? + law(&smc, bold)?)
}

/// A path through points that do not fall does not fall and stays between its ends, and goes through each point: every table
/// of four points 1 to 4 periods apart with rises of 0 to 6 counts, at every period, as lines and as cubics.
fn table(bold: bool) -> Tried {
    let counts = FixedCounts::from_counts;
    let mut tried = 0;
    for n in 0..(4 * 7_u64).pow(3) {
        let mut knots = [Knot { time_us: 0, position: counts(5) }; 4];
        let mut rest = n;
        for i in 1..4 {
            let (length, rise) = (rest % 4 + 1, rest / 4 % 7);
            rest /= 28;
            let before = knots[i - 1];
            let position = before.position.plus(counts(rise as i64));
            knots[i] = Knot { time_us: before.time_us + 1000 * length, position };
        }
        for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
            let path = Table { knots: &knots, interpolation };
            let at = |tick| path.at::<f32>(tick, Encoder::PAPER, Micros(1000)).position;
            let last = knots[3].time_us / 1000;
            // Too bold: it never rests.
            let rise = i64::from(bold);
            for tick in 0..=last + 1 {
                let (here, next) = (at(tick), at(tick + 1));
                let knot = knots.iter().find(|k| k.time_us == 1000 * tick);
                let within = here.0 >= knots[0].position.0 && here.0 <= knots[3].position.0;
                if next.0 < here.0 + rise || !within || knot.is_some_and(|k| k.position != here) {
                    return Err(format!("tick {tick} of {knots:?}: {here:?}, then {next:?}"));
                }
                tried += 1;
            }
        }
    }
    Ok(tried)
}

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// Decoding a frame with a right checksum yields nothing, or the one message that is encoded so. Every kind with every
/// content of up to two bytes; and every stream of three bytes, after which the next frame is heard.
fn frames(bold: bool) -> Tried {
    let good = encode(&Message::Ping(Ping { run: 0x00FF, nonce: 0x0100_0000 }));
    let heard = |decoder: &mut Decoder, bytes: &[u8]| bytes.iter().filter_map(|b| decoder.push(*b)).last();
    each(1 << 24, |n| {
        let bytes = [n as u8, (n >> 8) as u8, (n >> 16) as u8];
        let mut holds = true;
        for length in 1..=3 {
            let content = &bytes[..length];
            let body = [content, &CRC.checksum(content).to_le_bytes()].concat();
            let mut stream = Vec::with_capacity(16);
            for block in body.split(|byte| *byte == 0) {
                stream.push(block.len() as u8 + 1);
                stream.extend_from_slice(block);
            }
            stream.push(0);
            if let Some(Ok(message)) = heard(&mut Decoder::new(), &stream) {
                holds &= encode(&message).as_bytes() == stream;
            }
        }
        let mut decoder = Decoder::new();
        holds &= !matches!(heard(&mut decoder, &bytes), Some(Ok(_)));
        // The delimiter ends what was there.
        if !bold {
            let _ = decoder.push(0);
        }
        holds && heard(&mut decoder, good.as_bytes()).is_some_and(|m| m.is_ok())
    })
}

struct Rig {
    supervisor: Supervisor<f32>,
    servo: Servo<f32, Pd<f32>>,
}

type Control = SupervisorState<f32, <Pd<f32> as ControlLaw<f32>>::State>;

/// 5 V in the paper's converter.
const SAFE: DacCode = DacCode(3072);

fn rig() -> Result<Rig, String> {
    let told = |e: clutch_core::ParamError<f32>| e.to_string();
    let p = ServoParams::paper(LawParams::Pd(PdParams::default()));
    let bounds = Bounds::around(&PlantParams::default(), &Tolerances::default()).map_err(told)?;
    let supervisor = SupervisorParams::new(SafeState::hold(5.0));
    let law = Pd::new(&PdParams { kp: 5000.0, kd: 50.0 }, &p.output, p.period).map_err(told)?;
    Ok(Rig {
        supervisor: Supervisor::new(&supervisor, &p, &bounds).map_err(told)?,
        servo: Servo::with_law(&p, law).map_err(told)?,
    })
}

/// An event for a supervisor.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Event {
    /// A sample: periods since the newest, counts, the board's mode, and flags.
    Sample(i16, i32, BoardMode, u8),
    Silence(u32),
    Stop(Cause),
    BoardFault,
    OffPace,
    Connect,
    Disconnect,
    Arm,
    Acknowledge,
}

/// A board's side of the line, so far.
#[derive(Clone)]
struct Line {
    state: Control,
    sequence: u16,
    counts: i32,
}

impl Rig {
    /// Lets an event happen; true if a sample was answered.
    fn happens(&self, line: &mut Line, event: Event) -> bool {
        let s = &mut line.state;
        match event {
            Event::Sample(ahead, moved, board, flags) => {
                let sequence = line.sequence.wrapping_add_signed(ahead);
                if ahead > 0 {
                    line.sequence = sequence;
                    line.counts = line.counts.wrapping_add(moved);
                }
                let sample = Sample {
                    sequence,
                    time: Micros(1000 * u32::from(sequence)),
                    counts: Counts(line.counts),
                    board,
                    encoder_fault: flags & 1 != 0,
                    converter_fault: flags & 2 != 0,
                    command_late: flags & 4 != 0,
                    superseded: flags & 8 != 0,
                    lateness: Micros(0),
                };
                return self
                    .supervisor
                    .sample(&self.servo, s, &sample, |_| Target::default())
                    .answer
                    .is_some();
            }
            Event::Silence(cycles) => self.supervisor.silence(s, cycles),
            Event::Stop(cause) => self.supervisor.stop(s, cause),
            Event::BoardFault => self.supervisor.board_fault(s, 0.0),
            Event::OffPace => self.supervisor.off_pace(s, 1000),
            Event::Connect => self.supervisor.connect(s),
            Event::Disconnect => self.supervisor.disconnect(s),
            Event::Arm => {
                self.supervisor.arm(s, DacCode(2048));
            }
            Event::Acknowledge => self.supervisor.acknowledge(s),
        }
        false
    }
}

/// Tries every sequence of `length` events from a line; `holds` sees line, event and answer after each.
fn sequences<M: Copy>(
    rig: &Rig,
    events: &[Event],
    length: u32,
    (line, memory): (&Line, M),
    holds: &impl Fn(&Line, M, Event, bool) -> Option<M>,
) -> Tried {
    let mut tried = 0;
    for event in events {
        let mut next = line.clone();
        let answered = rig.happens(&mut next, *event);
        let Some(memory) = holds(&next, memory, *event, answered) else {
            return Err(format!("{event:?} from {:?} to {:?}", line.state.state(), next.state.state()));
        };
        tried += 1;
        if length > 1 {
            tried += sequences(rig, events, length - 1, (&next, memory), holds)?;
        }
    }
    Ok(tried)
}

/// Samples of all kinds, and all that is no consent.
fn events() -> Vec<Event> {
    use BoardMode::{Driving, Ready, Safe};
    use Event::{Arm, BoardFault, Connect, Disconnect, OffPace, Silence, Stop};
    let mut all = Vec::new();
    for ahead in [-1, 0, 1, 3, 200] {
        all.push(Event::Sample(ahead, 0, Driving, 0));
        all.push(Event::Sample(ahead, 2, Safe, 0));
    }
    all.extend([Event::Sample(1, 100_000, Driving, 0), Event::Sample(1, i32::MIN, Ready, 0)]);
    all.extend([1, 2, 4, 8, 15].map(|flags| Event::Sample(1, 1, Driving, flags)));
    all.extend([Silence(0), Silence(u32::MAX), Stop(Cause::Operator), Stop(Cause::Done)]);
    all.extend([BoardFault, OffPace, Connect, Disconnect, Arm]);
    all
}

/// Out of a fault of a run no sequence of six events leads that has no acknowledgement in it: whatever samples say. None is
/// answered, the cause is the first one's, and the brake holds.
fn faulted(bold: bool) -> Tried {
    let rig = rig()?;
    let mut begun = Line { state: Control::default(), sequence: 0, counts: 0 };
    for event in [Event::Connect, Event::Arm, Event::Sample(1, 0, BoardMode::Driving, 0), Event::Silence(9)] {
        rig.happens(&mut begun, event);
    }
    if begun.state.state() != State::Faulted {
        return Err(format!("no fault to begin with: {:?}", begun.state.state()));
    }
    let mut events = events();
    if bold {
        events.push(Event::Acknowledge);
    }
    sequences(&rig, &events, 6, (&begun, ()), &|line, (), _, answered| {
        let s = &line.state;
        (!answered && s.state() == State::Faulted && s.cause() == Cause::Silence && s.code() == SAFE)
            .then_some(())
    })
}

/// From power-up on, no sequence of six events answers a sample without a consent that no end has followed.
fn consent(bold: bool) -> Tried {
    let rig = rig()?;
    let begun = Line { state: Control::default(), sequence: 0, counts: 0 };
    let mut events = events();
    // With fewer of a kind: sequences are longer here.
    events.retain(|e| !matches!(e, Event::Sample(-1 | 3 | 200, ..) | Event::Sample(_, i32::MIN, ..)));
    events.push(Event::Acknowledge);
    sequences(&rig, &events, 6, (&begun, false), &|line, consent, event, answered| {
        let state = line.state.state();
        let given = event == Event::Arm && state == State::Armed;
        // Too bold: no sample is answered at all.
        let consent = !bold && (given || (consent && matches!(state, State::Armed | State::Running)));
        (!answered || consent).then_some(consent)
    })
}
