//! The log's reader on any bytes: no panic, no memory or time beyond the limits.
//!
//! The first byte chooses: the bytes as a file; behind a valid header; as the inside of a chunk
//! behind a valid header, so that the checksum does not stop them.
#![no_main]

use clutch_log::{Header, Limits, LogWriter, Record, SampleRecord, read_bytes};
use libfuzzer_sys::fuzz_target;
use std::sync::OnceLock;

/// A log without its end: the header, the schemas and one chunk with records.
fn start() -> &'static [u8] {
    static START: OnceLock<Vec<u8>> = OnceLock::new();
    START.get_or_init(|| {
        let path = std::env::temp_dir().join(format!("clutch-fuzz-{}.mcap", std::process::id()));
        let mut log = LogWriter::create(&path, &Header::default()).expect("a file");
        log.write(&Record::Sample(SampleRecord::default())).expect("space");
        drop(log);
        let bytes = std::fs::read(&path).expect("the file");
        let _ = std::fs::remove_file(path);
        bytes
    })
}

/// A chunk without compression and checksum.
fn chunk(inside: &[u8]) -> Vec<u8> {
    let mut body = vec![0; 16];
    body.extend((inside.len() as u64).to_le_bytes());
    body.extend([0; 4 + 4]);
    body.extend((inside.len() as u64).to_le_bytes());
    body.extend(inside);
    let mut record = vec![0x06];
    record.extend((body.len() as u64).to_le_bytes());
    record.extend(body);
    record
}

fuzz_target!(|data: &[u8]| {
    let limits = Limits {
        max_record_bytes: 1 << 20,
        max_chunk_bytes: 1 << 20,
        max_records: 10_000,
        max_seconds: 5.0,
        ..Limits::default()
    };
    let Some((choice, rest)) = data.split_first() else { return };
    let file = match choice % 3 {
        0 => rest.to_vec(),
        1 => [start(), rest].concat(),
        _ => [start(), &chunk(rest)].concat(),
    };
    let log = read_bytes(&file, &limits);
    if choice % 3 > 0 {
        // Any bytes may follow: a limit may end the reading, but the log before it is valid.
        match log {
            Ok(log) => assert!(!log.samples.is_empty()),
            Err(e) => assert!(matches!(e, clutch_log::LogError::Limit { .. }), "{e}"),
        }
    }
});
