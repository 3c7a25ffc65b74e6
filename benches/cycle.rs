//! A control cycle, part by part: the servo alone, under its supervisor, with the frames around it,
//! and with the share of a log.

use clutch_core::supervisor::{BoardMode, Sample, State};
use clutch_core::{Counts, DacCode, FixedCounts, Planned, Real, SupervisorState, Target};
use clutch_log::{CommandRecord, Record, SampleRecord};
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_node::{ControllerNode, Notice, Outbox};
use clutch_sim::Scenario;
use clutch_wire::{Armed, BoardState, Configured, Decoder, Frame, Message, Sample as SampleFrame, encode};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, criterion_group, criterion_main};
use std::hint::black_box;

const SCENARIO: &str = "name = \"bench\"\n[rig]\nbase = \"paper\"\n[law.smc]\n[reference.ramp]\nrate_deg_s = 20.0\n\
    [run]\nstart = \"rest\"\n[safety]\nreason = \"a weight\"\n[safety.on_fault.hold]\nvolts_v = 4.5\n";

type Group<'a> = BenchmarkGroup<'a, WallTime>;

/// Counts of a shaft at 20 °/s, on its path.
fn counts(tick: u64) -> i32 {
    (tick * 10 / 9) as i32
}

/// The servo alone: what the rest is added to.
fn servo<T: Real>(group: &mut Group<'_>, built: &BuiltRun<T>, path: &(impl Planned<T> + Copy)) {
    let servo = built.servo;
    let mut state = servo.start(Counts(0), &path.target(0), T::ZERO);
    let mut tick = 0;
    group.bench_function("path", |b| {
        b.iter(|| {
            tick += 1;
            black_box(path.target(black_box(tick)))
        });
    });
    let mut tick = 0;
    group.bench_function("path and servo", |b| {
        b.iter(|| {
            tick += 1;
            servo.tick(&mut state, black_box(Counts(counts(tick))), &path.target(tick))
        });
    });
}

fn supervisor<T: Real>(group: &mut Group<'_>, built: &BuiltRun<T>, path: &(impl Planned<T> + Copy)) {
    let (servo, supervisor) = (built.servo, built.supervisor);
    let mut supervised = SupervisorState::default();
    supervisor.connect(&mut supervised);
    supervisor.arm(&mut supervised, DacCode(2970));
    let mut tick = 0;
    group.bench_function("path, supervisor and servo", |b| {
        b.iter(|| {
            let sample = Sample {
                sequence: tick as u16,
                counts: Counts(counts(tick)),
                board: BoardMode::Driving,
                ..Sample::default()
            };
            tick += 1;
            supervisor.sample(&servo, &mut supervised, black_box(&sample), *path)
        });
    });
    // A run that had ended would be measured without its law; one that nobody asked for has not begun.
    assert!(tick == 0 || supervised.state() == State::Running);
}

/// A sample on the wire.
fn frame(tick: u64) -> Frame {
    encode(&Message::Sample(SampleFrame {
        run: 7,
        sequence: tick as u16,
        time_us: (tick * 1000) as u32,
        counts: counts(tick),
        status: BoardState::Running as u8,
    }))
}

/// A controller whose board is armed.
fn armed<T: Real>(built: &BuiltRun<T>) -> (ControllerNode<T>, Decoder) {
    let mut line = Decoder::new();
    let mut node = ControllerNode::new(built.controller, built.servo, built.supervisor);
    let mut out = Outbox::default();
    let path = |_| Target { position: FixedCounts(0), velocity: T::ZERO, acceleration: T::ZERO };
    for message in [
        Message::Configured(Configured { run: 7, config: built.controller.config, boot: 1 }),
        Message::Armed(Armed { run: 7, config: built.controller.config }),
    ] {
        node.receive(0, &mut line, encode(&message).as_bytes(), &path, &mut out, &mut |_| ());
    }
    (node, line)
}

fn frames<T: Real>(group: &mut Group<'_>, built: &BuiltRun<T>, path: &(impl Planned<T> + Copy)) {
    let mut tick = 0;
    group.bench_function("a sample's frame made", |b| {
        b.iter(|| {
            tick += 1;
            black_box(frame(black_box(tick)))
        });
    });
    let ((mut controller, mut line), mut out, mut tick) = (armed(built), Outbox::default(), 0);
    group.bench_function("sample's frame made, bytes in, bytes out", |b| {
        b.iter(|| {
            let bytes = frame(tick);
            controller.receive(tick * 1_000_000, &mut line, bytes.as_bytes(), path, &mut out, &mut |_| ());
            tick += 1;
            black_box(out.as_bytes().len());
            out.clear();
        });
    });
    assert!(tick == 0 || controller.state().state() == State::Running);
}

/// The time that a log adds.
fn log<T: Real>(group: &mut Group<'_>, built: &BuiltRun<T>, path: &(impl Planned<T> + Copy)) {
    let ((mut controller, mut line), mut out, mut tick) = (armed(built), Outbox::default(), 0);
    let (mut ring, mut drain) = rtrb::RingBuffer::<Record>::new(1 << 15);
    let servo = built.servo;
    let radians = servo.encoder().radians_per_count::<f64>();
    group.bench_function("the same, and both records into the ring", |b| {
        b.iter(|| {
            let bytes = frame(tick);
            controller.receive(tick * 1_000_000, &mut line, bytes.as_bytes(), path, &mut out, &mut |n| {
                if let Notice::Cycle(n) = n {
                    let _ = ring.push(Record::Sample(SampleRecord::of(&n, tick, 0, 0, radians)));
                    let _ =
                        ring.push(Record::Command(CommandRecord::of(&n.cycle, tick, servo.dac(), radians)));
                }
            });
            tick += 1;
            // As the log's thread would, without its file.
            if tick.is_multiple_of(1024) {
                while drain.pop().is_ok() {}
            }
            black_box(out.as_bytes().len());
            out.clear();
        });
    });
    assert!(tick == 0 || controller.state().state() == State::Running);
}

fn cycle<T: Real>(c: &mut Criterion, scalar: &str) {
    let set = [("sampling.scalar".to_owned(), scalar.to_owned())];
    let scenario = Scenario::parse("bench", SCENARIO, &set).expect("a scenario");
    let built = BuiltRun::<T>::new(&scenario, 7).expect("a safe state");
    let path = from_scenario::path::<T>(&scenario).expect("a path");
    let mut group = c.benchmark_group(format!("cycle, SMC, {scalar}"));
    servo(&mut group, &built, &path);
    supervisor(&mut group, &built, &path);
    frames(&mut group, &built, &path);
    log(&mut group, &built, &path);
    group.finish();
}

fn all(c: &mut Criterion) {
    cycle::<f32>(c, "f32");
    cycle::<f64>(c, "f64");
}

criterion_group!(benches, all);
criterion_main!(benches);
