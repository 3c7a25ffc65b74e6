//! Each law around a small shaft, behind the supervisor: the bits of every decision are those that are committed. A
//! change of them is wanted, or it is a mistake.
#![cfg(feature = "linalg")]
#![allow(
    clippy::std_instead_of_core,
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "it runs on the host"
)]

use clutch_core::edge_timed::EdgeTimedParams;
use clutch_core::law::{GlideParams, LawParams, ShellParams, Terms};
use clutch_core::params::Choice;
use clutch_core::supervisor::{BoardMode, Cause, Cycle, Sample, State};
use clutch_core::{
    Bounds, Counts, CountsOverTimeParams, DacCode, FNV_64, FixedCounts, FrictionMap, Micros, ObserverParams,
    OnDisc, Real, SafeHold, SafeHoldThenRelease, SafeRamp, SafeState, Servo, ServoParams, Supervisor,
    SupervisorParams, SupervisorState, Target, Tolerances, VelocityParams, fnv1a_64,
};
use shaft::{Actuator, COUNTS_PER_RADIAN, PERIOD, Shaft, path, wave};
use std::collections::VecDeque;
use std::f64::consts::TAU;

mod shaft;
mod table;

/// A run: who drives which shaft along which path, and what is wrong with its samples.
struct Run {
    name: String,
    servo: ServoParams,
    safety: SupervisorParams,
    actuator: Actuator,
    targets: Vec<Target<f64>>,
    /// Ripple of the map that the law has.
    map: Option<f64>,
    /// Periods from a code to its effect.
    delay: usize,
    /// Friction, as a multiple of what the law believes.
    friction: f64,
    lie: Lie,
}

/// The sample of a tick as it comes, or none.
type Lie = fn(u32, Sample) -> Option<Sample>;

fn truth(_: u32, sample: Sample) -> Option<Sample> {
    Some(sample)
}

/// Counts between the points of a map.
const STEP: u32 = 10;
const START: f64 = 0.5;

/// Motion, micro-steps' rates, a rest, a fast ride, and of a motor all of it both ways.
fn rates(actuator: Actuator) -> Vec<Target<f64>> {
    let there = [(2.0, 0.4), (0.3, 0.35), (0.0, 0.1), (10.0, 0.15), (2.0, 0.2)];
    let back = [(-2.0, 0.4), (-0.3, 0.35), (0.0, 0.1), (-10.0, 0.15)];
    let rates = match actuator {
        Actuator::Brake => there.to_vec(),
        Actuator::Motor => [&there[..], &back].concat(),
    };
    path(START, &rates).1
}

/// A sine of 0.2° a second and a half long, whose middle goes on at 2 °/s: accelerations of both signs.
fn sine() -> Vec<Target<f64>> {
    let (amplitude, rate, mean) = (0.2_f64.to_radians(), TAU / 1.5, 2.0_f64.to_radians());
    let target = |tick: u32| {
        let t = f64::from(tick) * PERIOD;
        let (sine, cosine) = (libm::sin(rate * t), libm::cos(rate * t));
        let counts = START + (mean * t + amplitude * sine) * COUNTS_PER_RADIAN;
        Target {
            position: FixedCounts((counts * f64::from(1_u32 << FixedCounts::FRACTION_BITS)) as i64),
            velocity: mean + amplitude * rate * cosine,
            acceleration: -amplitude * rate * rate * sine,
        }
    };
    (0..1500).map(target).collect()
}

impl Run {
    fn new(name: impl Into<String>, law: LawParams<f64>, actuator: Actuator) -> Run {
        let mut servo = ServoParams { model: actuator.params(), ..ServoParams::paper(law) };
        let (mut still, motor) = (5.0, matches!(actuator, Actuator::Motor));
        if motor {
            (servo.output.lowest, servo.output.on_invalid, still) = (-10.0, 0.0, 0.0);
        }
        let mut safety = SupervisorParams::new(SafeState::Hold(SafeHold { volts: still }));
        // Poor laws are to go on, too.
        safety.limits.following_error = 60.0_f64.to_radians();
        Run {
            name: name.into(),
            servo,
            safety,
            actuator,
            targets: rates(actuator),
            map: None,
            delay: 0,
            friction: 1.1,
            lie: truth,
        }
    }

    /// The hash of every decision, and the state and cause at the end.
    fn hash<T: Real>(&self) -> (u64, State, Cause) {
        // A motor's shaft has no drive that could be another.
        let drive = if matches!(self.actuator, Actuator::Brake) { 0.1 } else { 0.0 };
        let tolerances = Tolerances {
            friction: T::from_f64(0.4),
            drive_torque: T::from_f64(drive),
            ..Tolerances::default()
        };
        let params = self.servo.cast::<T>();
        let servo = Servo::<T>::new(&params).unwrap();
        let bounds = Bounds::around(&params.model, &tolerances).unwrap();
        let supervisor = Supervisor::new(&self.safety.cast(), &params, &bounds).unwrap();
        let factors: Vec<u16> = (0..=120)
            .map(|i| {
                let at = (f64::from(i * STEP) + 0.5) / COUNTS_PER_RADIAN;
                (wave(at, self.map.unwrap_or(0.0)) * f64::from(FrictionMap::ONE)).round() as u16
            })
            .collect();
        let map = self.map.map(|_| FrictionMap::new(0, STEP, &factors).unwrap());
        let target = |tick: u64| {
            let of = &self.targets[(tick as usize).min(self.targets.len() - 1)];
            let [velocity, acceleration] = [of.velocity, of.acceleration].map(T::from_f64);
            Target { position: of.position, velocity, acceleration }
        };
        let planned = OnDisc { path: target, map };
        let mut shaft = Shaft {
            steps: 20,
            actuator: self.actuator,
            friction: self.friction,
            ripple: 0.15,
            position: START / COUNTS_PER_RADIAN,
            velocity: 0.0,
        };
        let still = supervisor.safe_codes().hold;
        let (mut state, mut line) = (SupervisorState::default(), VecDeque::from(vec![still; self.delay]));
        supervisor.connect(&mut state);
        assert!(supervisor.arm(&mut state, still));
        let (mut hash, mut code) = (FNV_64, still);
        for tick in 0..self.targets.len() as u32 {
            let sample = Sample {
                sequence: tick as u16,
                time: Micros(tick * 1000),
                counts: shaft.counts(),
                board: BoardMode::Driving,
                lateness: Micros(tick % 7),
                ..Sample::default()
            };
            match (self.lie)(tick, sample) {
                Some(sample) => {
                    let cycle = supervisor.sample(&servo, &mut state, &sample, planned);
                    supervisor.expect(&mut state, &planned);
                    hash = decided(hash, &cycle);
                    code = cycle.answer.unwrap_or(code);
                }
                None => supervisor.pass(&mut state),
            }
            line.push_back(code);
            shaft.period(servo.dac().volts(line.pop_front().unwrap_or(code)).to_f64());
        }
        hash = fnv1a_64(hash, &shaft.position.to_bits().to_le_bytes());
        (hash, state.state(), state.cause())
    }
}

/// Everything that a cycle has, in a hash.
fn decided<T: Real, X: Terms<T>>(hash: u64, cycle: &Cycle<T, X>) -> u64 {
    let DacCode(code) = cycle.code;
    let small = [cycle.arrival as u8, cycle.from as u8, cycle.state as u8, cycle.cause as u8];
    let hash = fnv1a_64(fnv1a_64(hash, &small), &code.to_le_bytes());
    let hash = fnv1a_64(hash, &cycle.value.to_f64().to_bits().to_le_bytes());
    let Some(out) = &cycle.output else { return hash };
    let tick = [out.tick.error, out.tick.error_rate, out.tick.target_velocity, out.tick.target_acceleration];
    let reals = tick.iter().chain([&out.command.voltage]).chain(out.command.terms.values());
    let hash = fnv1a_64(hash, &[out.command.limit as u8]);
    reals.fold(hash, |hash, real| fnv1a_64(hash, &real.to_f64().to_bits().to_le_bytes()))
}

/// Each law of the list around either actuator, with each source of velocity, and in a shell.
fn laws() -> Vec<Run> {
    let others = [
        VelocityParams::CountsOverTime(CountsOverTimeParams::default()),
        VelocityParams::EdgeTimed(EdgeTimedParams::default()),
        VelocityParams::Observer(ObserverParams::default()),
    ];
    let mut runs = Vec::new();
    for law in LawParams::all() {
        let name = Choice::<f64>::name(&law);
        for (actuator, word) in [(Actuator::Brake, "brake"), (Actuator::Motor, "motor")] {
            runs.push(Run::new(format!("{name} {word}"), law, actuator));
            for source in others {
                let mut other = Run::new(format!("{name} {word} {}", source.name()), law, actuator);
                other.servo.velocity = source;
                other.targets = sine();
                (other.delay, other.friction) = (1, 0.95);
                runs.push(other);
            }
        }
        let mut shell = Run::new(format!("{name} shell"), law, Actuator::Brake);
        shell.servo.shell = ShellParams { boundary: 0.1, ..ShellParams::default() };
        runs.push(shell);
    }
    runs
}

/// The smooth law and its filter with every parameter that changes their code.
fn smooth() -> Vec<Run> {
    let glide = |name: &str, actuator, change: fn(&mut Run, &mut GlideParams<f64>)| {
        let mut law = GlideParams::default();
        let mut run = Run::new(format!("glide: {name}"), law.into(), actuator);
        change(&mut run, &mut law);
        run.servo.law = law.into();
        run
    };
    let [brake, motor] = [Actuator::Brake, Actuator::Motor];
    vec![
        glide("micro-steps", brake, |_, law| law.micro = 1.0_f64.to_radians()),
        glide("micro-steps, delay 2", brake, |run, law| {
            (law.micro, law.filter.delay, run.delay) = (1.0_f64.to_radians(), 2, 2);
        }),
        glide("micro-steps of a motor", motor, |_, law| law.micro = 1.0_f64.to_radians()),
        glide("delay 1", brake, |run, law| (law.filter.delay, run.delay) = (1, 1)),
        glide("delay 3, lag 2 ms", brake, |run, law| {
            (law.filter.delay, law.filter.lag, run.delay) = (3, 0.002, 3);
        }),
        glide("lag 1 ms of a motor", motor, |_, law| law.filter.lag = 0.001),
        glide("a right map", brake, |run, _| run.map = Some(0.15)),
        glide("a wrong map", brake, |run, law| {
            (run.map, law.micro) = (Some(-0.15), 1.0_f64.to_radians());
        }),
        glide("a map for a motor", motor, |run, law| {
            (run.map, law.micro) = (Some(0.15), 1.0_f64.to_radians());
        }),
        glide("friction 0.7 times", brake, |run, _| run.friction = 0.7),
        glide("friction 1.35 times", brake, |run, law| {
            (run.friction, law.micro) = (1.35, 1.0_f64.to_radians());
        }),
        glide("other doubts", brake, |_, law| {
            let filter = &mut law.filter;
            (filter.gain_doubt, filter.friction_doubt, filter.silence) = (0.0, 0.5, 4.0);
            (filter.ripple, filter.waves, filter.ripple_damping, filter.walk) = (0.3, 100.0, 0.7, 0.05);
            (law.floor, law.cap, law.optimism) = (0.6, 2.0, 2.0);
        }),
        glide("a Gaussian curve", brake, |run, _| {
            let clutch_core::FrictionParams::Stribeck(p) = &mut run.servo.model.friction else { return };
            p.stribeck_exponent = 2.0;
        }),
        glide("a sine", brake, |run, _| run.targets = sine()),
        glide("a sine of a motor", motor, |run, _| run.targets = sine()),
        glide("a sine of a motor, friction 0.7 times", motor, |run, law| {
            (run.targets, run.friction, law.micro) = (sine(), 0.7, 3.0_f64.to_radians());
        }),
    ]
}

/// Samples that are wrong, lost, late or out of order, and what the supervisor makes of them in each safe state.
fn lies() -> Vec<Run> {
    fn counts(sample: Sample, change: impl Fn(i32) -> i32) -> Option<Sample> {
        Some(Sample { counts: Counts(change(sample.counts.0)), ..sample })
    }
    let lies: [(&str, Lie); 20] = [
        ("two glitches", |t, s| counts(s, |c| if t == 300 || t == 350 { c + 90 } else { c })),
        ("glitches", |t, s| counts(s, |c| if t >= 300 && t % 8 == 0 { c + 90 } else { c })),
        ("a jump", |t, s| counts(s, |c| if t >= 300 { c + 200 } else { c })),
        ("a frozen encoder", |t, s| counts(s, |c| if t >= 300 { 35 } else { c })),
        ("a channel", |t, s| counts(s, |c| if t >= 300 { 37 + (t / 3 % 2) as i32 } else { c })),
        ("reversed", |t, s| counts(s, |c| if t >= 300 { 66 - c } else { c })),
        ("doubled", |t, s| counts(s, |c| if t >= 10 { 2 * c } else { c })),
        ("halved", |t, s| counts(s, |c| if t >= 10 { c / 2 } else { c })),
        ("lost now and then", |t, s| (t % 9 != 5).then_some(s)),
        ("lost often", |t, s| (t < 300 || t % 3 == 0).then_some(s)),
        ("a gap of five", |t, s| (!(300..305).contains(&t)).then_some(s)),
        ("twice", |t, s| {
            Some(Sample { sequence: if t % 50 == 49 { s.sequence - 1 } else { s.sequence }, ..s })
        }),
        ("out of order", |t, s| {
            Some(Sample { sequence: if t % 60 == 59 { s.sequence - 3 } else { s.sequence }, ..s })
        }),
        ("superseded", |t, s| Some(Sample { superseded: t % 5 == 4, ..s })),
        ("refused as late", |t, s| Some(Sample { command_late: t % 4 == 3, ..s })),
        ("late answers", |t, s| Some(Sample { lateness: Micros(if t % 4 == 3 { 900 } else { 100 }), ..s })),
        ("a slow clock", |t, s| Some(Sample { time: Micros(t * 1100), ..s })),
        ("a board that is safe", |t, s| {
            Some(Sample { board: if t >= 300 { BoardMode::Safe } else { s.board }, ..s })
        }),
        ("no encoder", |t, s| Some(Sample { encoder_fault: t >= 300, ..s })),
        ("no converter", |t, s| Some(Sample { converter_fault: t >= 300, ..s })),
    ];
    let safe = [
        SafeState::Hold(SafeHold { volts: 4.5 }),
        SafeState::Ramp(SafeRamp { rate: 20.0, volts: 6.0 }),
        SafeState::Release,
        SafeState::HoldThenRelease(SafeHoldThenRelease { volts: 4.5, after: 0.1 }),
    ];
    let laws = [LawParams::named("pd"), LawParams::named("smc"), LawParams::named("glide")];
    let run = |(place, (name, lie)): (usize, &(&str, Lie))| {
        let law = laws[place % laws.len()].unwrap();
        let mut run = Run::new(format!("{}: {name}", Choice::<f64>::name(&law)), law, Actuator::Brake);
        run.safety.on_fault = safe[place % safe.len()];
        run.safety.limits.good_samples = 1 + place as u32 % 2;
        run.safety.limits.delay_cycles = place as u32 % 3;
        (run.lie, run.friction) = (*lie, 1.0);
        run
    };
    let mut runs: Vec<Run> = lies.iter().enumerate().map(run).collect();
    // Rigs outside of what the supervisor was told.
    for (name, friction) in [("a brake that lets go", 0.3), ("a brake that sticks", 6.0)] {
        let mut run = Run::new(format!("pd: {name}"), LawParams::named("pd").unwrap(), Actuator::Brake);
        run.friction = friction;
        runs.push(run);
    }
    let mut tight =
        Run::new("smc: a tight limit of the error", LawParams::named("smc").unwrap(), Actuator::Brake);
    (tight.safety.limits.following_error, tight.safety.limits.following_time) = (0.05_f64.to_radians(), 0.0);
    runs.push(tight);
    let mut weak = Run::new("pd: an output at its limit", LawParams::named("pd").unwrap(), Actuator::Brake);
    (weak.servo.output.highest, weak.servo.output.on_invalid) = (1.0, 1.0);
    weak.safety.limits.saturation_time = 0.05;
    runs.push(weak);
    runs
}

#[test]
#[cfg_attr(miri, ignore = "an hour there")]
fn every_decision_has_the_bits_that_are_committed() {
    let mut table = String::new();
    for run in laws().iter().chain(&smooth()).chain(&lies()) {
        for (scalar, (hash, state, cause)) in [("f64", run.hash::<f64>()), ("f32", run.hash::<f32>())] {
            table += &format!("{hash:016x}  {scalar}  {}: {state:?}, {cause:?}\n", run.name);
        }
    }
    table::compare("bits", &table);
}
