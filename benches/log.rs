//! The log: the cost of a record for the log thread, against the plain mcap crate, and the loop's
//! cost to hand a record over.
//!
//! Each iteration writes a whole run of 10 000 ticks, sample and command, to a file and finishes
//! it; `elements` are records. `LogWriter` closes a chunk each 100 ms of log time (100 ticks), so
//! it compresses worse and calls the system more often than the others; its figures include that.
#![allow(missing_docs, reason = "criterion's macros make public items")]

use clutch_log::{CHANNELS, CommandRecord, Header, LogWriter, Record, SampleRecord, encode};
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use mcap::{Channel, WriteOptions};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::hint::black_box;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const TICKS: u64 = 10_000;

/// The records of a run: counts that step, a path, and terms whose last bits look like noise.
fn records() -> Vec<Record> {
    (0..TICKS)
        .flat_map(|tick| {
            let (time_ns, t) = (tick * 1_000_000, tick as f64 * 1e-3);
            let error = 1e-3 * (6.0 * t).sin() + 1e-5 * (977.0 * t).sin();
            let rate = 6e-3 * (6.0 * t).cos() + 1e-2 * (977.0 * t).cos();
            let demand = 4.0 + 300.0 * error + 2.0 * rate;
            let sample = SampleRecord {
                tick,
                time_ns,
                sequence: tick as u16,
                board_time_us: (tick * 1000 + tick % 3) as u32,
                counts: (tick / 9) as i32,
                age_us: 110 + (tick * 7919 % 23) as u32,
                lateness_us: 4 + (tick * 104_729 % 11) as u32,
                position: (tick / 9) as f64 * 0.000_314,
                ..SampleRecord::default()
            };
            let command = CommandRecord {
                tick,
                time_ns,
                state: 3,
                code: (demand * 409.5) as u16,
                voltage: (demand * 409.5).floor() / 409.5,
                demand,
                target_fixed: (tick * 7282) as i64,
                target_position: 0.035 * t,
                target_velocity: 0.035,
                error,
                error_rate: rate,
                terms: [rate + 5.0 * error, 4.0 + error, demand - 4.0].into_iter().collect(),
                ..CommandRecord::default()
            };
            [Record::Sample(sample), Record::Command(command)]
        })
        .collect()
}

/// In memory where there is such a folder, so that the disk is not measured.
fn file() -> PathBuf {
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { memory.into() } else { std::env::temp_dir() };
    folder.join(format!("clutch-bench-{}.mcap", std::process::id()))
}

/// The channels as the mcap crate wants them, with the schemas of our own file.
fn channels(path: &Path) -> Vec<Arc<Channel<'static>>> {
    LogWriter::create(path, &Header::default()).and_then(LogWriter::finish).expect("an empty log");
    let bytes = std::fs::read(path).expect("the empty log");
    let summary = mcap::Summary::read(&bytes).expect("a summary").expect("a summary");
    let find = |topic| summary.channels.values().find(|c| c.topic == topic).expect("a channel").clone();
    vec![find(CHANNELS[0].topic), find(CHANNELS[1].topic)]
}

/// The number of a record's channel.
fn channel_of(record: &Record) -> usize {
    usize::from(matches!(record, Record::Command(_)))
}

/// By `LogWriter`.
fn by_log_writer(path: &Path, records: &[Record]) {
    let mut log = LogWriter::create(path, &Header::default()).expect("a file");
    for r in records {
        log.write(r).expect("space");
    }
    log.finish().expect("space");
}

/// The crate's own way: Writer::new, a Message with its channel for each record.
fn by_default(path: &Path, records: &[Record], channels: &[Arc<Channel<'static>>]) {
    let file = BufWriter::new(File::create(path).expect("a file"));
    let mut writer = mcap::Writer::new(file).expect("space");
    for r in records {
        let mut data = Vec::new();
        encode(r, &mut data);
        writer
            .write(&mcap::Message {
                channel: Arc::clone(&channels[channel_of(r)]),
                sequence: r.tick() as u32,
                log_time: r.time_ns(),
                publish_time: r.time_ns(),
                data: Cow::Owned(data),
            })
            .expect("space");
    }
    writer.finish().expect("space");
}

/// Its fast way: known channels, one buffer, no threads.
fn by_known_channels(
    path: &Path,
    records: &[Record],
    channels: &[Arc<Channel<'static>>],
    options: WriteOptions,
) {
    let file = BufWriter::new(File::create(path).expect("a file"));
    let mut writer = options.compression_threads(0).create(file).expect("space");
    let ids: Vec<u16> = channels
        .iter()
        .map(|c| {
            let schema = c.schema.as_ref().expect("a schema");
            let schema = writer.add_schema(&schema.name, &schema.encoding, &schema.data).expect("space");
            writer.add_channel(schema, &c.topic, &c.message_encoding, &BTreeMap::new()).expect("space")
        })
        .collect();
    let mut data = Vec::new();
    for r in records {
        data.clear();
        encode(r, &mut data);
        let header = mcap::records::MessageHeader {
            channel_id: ids[channel_of(r)],
            sequence: r.tick() as u32,
            log_time: r.time_ns(),
            publish_time: r.time_ns(),
        };
        writer.write_to_known_channel(&header, &data).expect("space");
    }
    writer.finish().expect("space");
}

/// Processor time of all threads of this process, s.
fn processor_s() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

/// Processor time of a record, all threads counted, against the crate's default way: the least of 15 rounds, one way after the
/// other in each.
fn processor_time(_: &mut Criterion) {
    let (records, path) = (records(), file());
    let channels = channels(&path);
    let plain = || WriteOptions::new().compression(None);
    let ways: [(&str, &dyn Fn()); 4] = [
        ("mcap, default", &|| by_default(&path, &records, &channels)),
        ("LogWriter", &|| by_log_writer(&path, &records)),
        ("mcap, known channels", &|| by_known_channels(&path, &records, &channels, WriteOptions::new())),
        ("mcap, known channels, not compressed", &|| by_known_channels(&path, &records, &channels, plain())),
    ];
    let mut least = [f64::MAX; 4];
    let mut bytes = [0; 4];
    for _ in 0..15 {
        for (((_, write), least), bytes) in ways.iter().zip(&mut least).zip(&mut bytes) {
            let before = processor_s();
            write();
            *least = least.min(processor_s() - before);
            *bytes = std::fs::metadata(&path).expect("the file").len();
        }
    }
    println!(
        "| written by | ns of processor a record | of the default | bytes a record |\n|---|---|---|---|"
    );
    for (((way, _), time), bytes) in ways.iter().zip(least).zip(bytes) {
        let each = |x: f64| x / records.len() as f64;
        let (ns, share, size) = (1e9 * each(time), time / least[0], each(bytes as f64));
        println!("| {way} | {ns:.0} | {share:.2} | {size:.1} |");
    }
    let _ = std::fs::remove_file(path);
}

fn write(c: &mut Criterion) {
    let (records, path) = (records(), file());
    let channels = channels(&path);
    let mut group = c.benchmark_group("log/write");
    group.throughput(Throughput::Elements(records.len() as u64)).sample_size(20);

    group.bench_function("log_writer", |b| b.iter(|| by_log_writer(&path, &records)));

    group.bench_function("mcap_default", |b| b.iter(|| by_default(&path, &records, &channels)));
    group.bench_function("mcap_known_channel", |b| {
        b.iter(|| by_known_channels(&path, &records, &channels, WriteOptions::new()));
    });

    // The part of it that is the message itself.
    group.bench_function("encode_only", |b| {
        let mut data = Vec::new();
        b.iter(|| {
            for r in &records {
                data.clear();
                encode(black_box(r), &mut data);
            }
            black_box(data.len())
        });
    });
    group.finish();
    let _ = std::fs::remove_file(path);
}

/// The loop's cost of a record: a push into the ring, the consumer on the same core.
fn ring(c: &mut Criterion) {
    let records = records();
    let mut group = c.benchmark_group("log/ring");
    group.throughput(Throughput::Elements(4096)).bench_function("push_4096_records", |b| {
        let (mut producer, mut consumer) = rtrb::RingBuffer::<Record>::new(4096);
        b.iter_batched(
            || while consumer.pop().is_ok() {},
            |()| {
                for r in &records[..4096] {
                    producer.push(black_box(*r)).expect("room for all");
                }
            },
            BatchSize::PerIteration,
        );
    });
    group.finish();
}

criterion_group!(benches, processor_time, write, ring);
criterion_main!(benches);
