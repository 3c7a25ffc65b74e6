//! The wire codec: the cycle's two frames, each way.
#![allow(missing_docs, reason = "criterion's macros make public items")]

use clutch_wire::{Actuate, Decoder, Message, Sample, encode};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

/// Sixty-four of each, so that zeros stand in different places.
fn messages(i: u16) -> [(&'static str, Message); 2] {
    let counts = i32::from(i).wrapping_mul(-7919);
    let time_us = 1000 * u32::from(i);
    [
        ("sample", Message::Sample(Sample { run: 1, sequence: i, time_us, counts, status: 3 })),
        ("actuate", Message::Actuate(Actuate { run: 1, sequence: i, code: 61 * i, valid_us: 2000 })),
    ]
}

fn codec(c: &mut Criterion) {
    for which in 0..2 {
        let (name, _) = messages(0)[which];
        let sent: Vec<Message> = (0..64).map(|i| messages(i)[which].1).collect();
        let frames: Vec<_> = sent.iter().map(encode).collect();
        let mut group = c.benchmark_group(format!("wire/{name}"));
        group.throughput(Throughput::Bytes(frames[0].as_bytes().len() as u64));
        let mut i = 0;
        group.bench_function("encode", |b| {
            b.iter(|| {
                i = (i + 1) % 64;
                encode(black_box(&sent[i]))
            });
        });
        let mut decoder = Decoder::new();
        group.bench_function("decode", |b| {
            b.iter(|| {
                i = (i + 1) % 64;
                let mut last = None;
                for &byte in black_box(&frames[i]).as_bytes() {
                    last = decoder.push(byte);
                }
                assert!(matches!(last, Some(Ok(_))));
                last
            });
        });
        group.finish();
    }
}

criterion_group!(benches, codec);
criterion_main!(benches);
