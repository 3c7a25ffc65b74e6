//! Logs written and read: whole, cut, damaged, foreign and hostile.

mod common;

use clutch_log::{
    CHUNK_NS, Header, Limits, LogError, LogWriter, Record, SampleRecord, Tail, info, read, read_bytes,
    recover, scan,
};
use common::{Folder, Numbers, bits, header, record, small_log};
use mcap::records::{ChunkHeader, op};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

fn in_order(path: &Path) -> Vec<Record> {
    let mut records = Vec::new();
    scan(path, &Limits::default(), |_, r| {
        records.push(r);
        Ok(())
    })
    .unwrap();
    records
}

/// Ends of the file's chunks and the records in all up to there, found by the mcap crate.
fn chunk_ends(bytes: &[u8]) -> Vec<(usize, usize)> {
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    let mut ends = Vec::new();
    let mut records = 0;
    let mut indexes = summary.chunk_indexes.clone();
    indexes.sort_by_key(|i| i.chunk_start_offset);
    for index in &indexes {
        let of_records = |m: &mcap::Message<'_>| m.channel.topic != "/parameters";
        records += summary.stream_chunk(bytes, index).unwrap().map(Result::unwrap).filter(of_records).count();
        ends.push(((index.chunk_start_offset + index.chunk_length) as usize, records));
    }
    ends
}

#[test]
fn every_record_and_the_header_come_back_bit_for_bit() {
    let folder = Folder::new("round-trip");
    let path = folder.file("run.mcap");
    let mut n = Numbers(1);
    let records: Vec<_> = (0..20_000)
        .map(|i| {
            let (tick, time_ns) = match i % 50 {
                0 => (n.next(), n.next()), // times that jump over the whole range, backwards too
                1 => (u64::MAX, u64::MAX),
                2 => (0, 0),
                _ => (i, i * 1_000_000),
            };
            record(&mut n, tick, time_ns)
        })
        .collect();
    let mut log = LogWriter::create(&path, &header()).unwrap();
    for r in &records {
        log.write(r).unwrap();
    }
    let summary = log.finish().unwrap();
    assert_eq!(summary.records, 20_000);
    assert_eq!(summary.bytes, std::fs::metadata(&path).unwrap().len());
    assert_eq!((summary.first_ns, summary.last_ns), (0, u64::MAX));

    let back = in_order(&path);
    assert_eq!(back.len(), records.len());
    for (a, b) in records.iter().zip(&back) {
        assert_eq!(bits(a), bits(b), "{a:?} came back as {b:?}");
    }
    let log = read(&path, &Limits::default()).unwrap();
    assert!(log.complete, "{} {:?}", log.tail, log.damage);
    assert_eq!(log.header, header());
    assert_eq!(log.records(), 20_000);
    for (topic, count) in summary.channels {
        let read = match topic {
            "/sample" => log.samples.len(),
            "/command" => log.commands.len(),
            "/event" => log.events.len(),
            "/link" => log.links.len(),
            "/change" => log.changes.len(),
            "/truth" => log.truths.len(),
            other => panic!("{other}"),
        };
        assert!(read > 0 && read as u64 == count, "{topic}: {count} written, {read} read");
    }
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig { failure_persistence: None, ..Default::default() })]
    #[test]
    fn any_header_comes_back(
        texts in proptest::array::uniform8(".*"),
        parameters in proptest::collection::vec((".*", ".*"), 0..5),
        extra in proptest::collection::btree_map(".*", ".*", 0..5),
        law_hash: u64, period_us: u32, started_unix_ns: u64,
    ) {
        let [scenario_name, scenario_toml, version, port, scalar, a, b, c] = texts;
        let term_names = vec![a, b, c];
        let header = Header {
            scenario_name, scenario_toml, parameters, version, law_hash, port,
            source: clutch_log::Source::Replay, scalar, period_us, term_names, started_unix_ns,
            extra: extra.into_iter().collect(),
        };
        let folder = Folder::new("any-header");
        let path = folder.file("run.mcap");
        LogWriter::create(&path, &header).unwrap().finish().unwrap();
        let log = read(&path, &Limits::default()).unwrap();
        proptest::prop_assert!(log.complete);
        proptest::prop_assert_eq!(log.header, header);
    }
}

#[test]
fn a_log_is_a_valid_mcap_file_with_index_times_and_named_channels() {
    let folder = Folder::new("valid");
    let (records, bytes) = small_log(&folder.file("run.mcap"), 60);
    let messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    let data: Vec<_> = messages.iter().filter(|m| m.channel.topic != "/parameters").collect();
    assert_eq!(data.len(), records.len());
    for (m, r) in data.iter().zip(&records) {
        assert_eq!(u64::from(m.sequence), r.tick());
        assert_eq!((m.log_time, m.publish_time), (header().started_unix_ns + r.time_ns(), m.log_time));
        let schema = m.channel.schema.as_ref().unwrap();
        assert_eq!((schema.encoding.as_str(), m.channel.message_encoding.as_str()), ("protobuf", "protobuf"));
    }
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let stats = summary.stats.unwrap();
    assert_eq!(stats.message_count, 60 + 3);
    assert_eq!((stats.attachment_count, stats.metadata_count, stats.channel_count), (1, 2, 7));
    assert_eq!(summary.attachment_indexes[0].name, "scenario.toml");
}

#[test]
fn no_chunk_spans_100_ms_nor_grows_past_its_size() {
    let folder = Folder::new("chunks");
    let path = folder.file("run.mcap");
    let mut log = LogWriter::create(&path, &header()).unwrap();
    for i in 0..60_000_u64 {
        // 1 kHz at first, then far more than a megabyte in 100 ms.
        let time_ns = if i < 1000 { i * 1_000_000 } else { 2_000_000_000 + i };
        log.write(&Record::Command(clutch_log::CommandRecord { tick: i, time_ns, ..Default::default() }))
            .unwrap();
    }
    let summary = log.finish().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let indexes = mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes;
    assert_eq!(indexes.len() as u64, summary.chunks + 1, "and one with schemas and parameters");
    for i in &indexes {
        assert!(i.message_end_time - i.message_start_time < CHUNK_NS, "{i:?}");
        assert!(i.uncompressed_size <= (clutch_log::CHUNK_BYTES + 256) as u64, "{i:?}");
        assert_eq!(i.compression, "zstd");
    }
    assert!(indexes.iter().any(|i| i.uncompressed_size > clutch_log::CHUNK_BYTES as u64 - 256));
}

#[test]
fn records_are_in_the_file_after_a_flush_and_the_header_from_the_start() {
    let folder = Folder::new("flush");
    let path = folder.file("run.mcap");
    let mut log = LogWriter::create(&path, &header()).unwrap();
    let empty = read(&path, &Limits::default()).unwrap();
    assert_eq!((empty.header, empty.complete, empty.samples.len()), (header(), false, 0));
    for tick in 0..5 {
        log.write(&Record::Sample(SampleRecord { tick, ..Default::default() })).unwrap();
    }
    assert_eq!((log.written(), read(&path, &Limits::default()).unwrap().samples.len()), (0, 0));
    log.flush().unwrap();
    assert_eq!((log.written(), read(&path, &Limits::default()).unwrap().samples.len()), (5, 5));
    log.write(&Record::Sample(SampleRecord { tick: 5, ..Default::default() })).unwrap();
    drop(log);
    let log = read(&path, &Limits::default()).unwrap();
    assert_eq!((log.samples.len(), log.complete), (6, false), "a dropped writer closes its chunk, no more");
}

#[test]
fn a_file_cut_at_any_byte_gives_every_whole_chunk() {
    let folder = Folder::new("cut");
    let (records, bytes) = small_log(&folder.file("run.mcap"), 60);
    let ends = chunk_ends(&bytes);
    assert!(ends.len() >= 5, "{ends:?}");
    let header_end =
        mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes[0].chunk_start_offset as usize;
    let mut headers = 0;
    for cut in 0..bytes.len() {
        match read_bytes(&bytes[..cut], &Limits::default()) {
            Ok(log) => {
                headers += 1;
                let expected = ends.iter().rev().find(|(end, _)| *end <= cut).map_or(0, |(_, n)| *n);
                assert_eq!(log.records(), expected, "cut at {cut}");
                assert!(!log.complete, "cut at {cut}");
                assert!(
                    matches!(log.tail, Tail::Cut { at, .. } if at <= cut as u64),
                    "cut at {cut}: {}",
                    log.tail
                );
                let Tail::Cut { at, .. } = log.tail else { unreachable!() };
                assert_eq!(log.left_out_bytes, cut as u64 - at, "cut at {cut}");
                if cut >= ends[0].0 {
                    assert_eq!(log.header, header(), "cut at {cut}");
                }
            }
            Err(LogError::NotALog { .. }) => assert!(cut < 8, "cut at {cut}"),
            Err(LogError::NoHeader { at, .. }) => {
                assert!(at <= cut as u64 && cut < header_end, "cut at {cut}: whole up to {at}");
            }
            Err(e) => panic!("cut at {cut}: {e}"),
        }
    }
    assert_eq!(headers, bytes.len() - header_end, "each cut behind the header gives a log");
    let whole = read_bytes(&bytes, &Limits::default()).unwrap();
    assert_eq!((whole.records(), whole.complete), (records.len(), true));
}

#[test]
fn a_large_file_cut_at_random_gives_every_whole_chunk() {
    let folder = Folder::new("cut-large");
    let (_, bytes) = small_log(&folder.file("run.mcap"), 13_000);
    assert!(bytes.len() > 1 << 20, "{} bytes", bytes.len());
    let ends = chunk_ends(&bytes);
    let mut n = Numbers(3);
    for _ in 0..300 {
        let cut = ends[0].0 + n.below(bytes.len() - ends[0].0);
        let log = read_bytes(&bytes[..cut], &Limits::default()).unwrap();
        let expected = ends.iter().rev().find(|(end, _)| *end <= cut).map_or(0, |(_, n)| *n);
        assert_eq!((log.records(), log.complete), (expected, false), "cut at {cut}");
    }
}

#[test]
fn a_cut_log_is_recovered_into_a_finished_one_and_says_so() {
    let folder = Folder::new("recover");
    let (records, bytes) = small_log(&folder.file("whole.mcap"), 60);
    let ends = chunk_ends(&bytes);
    let (from, to) = (folder.file("cut.mcap"), folder.file("recovered.mcap"));
    let cut = ends[3].0 + 1000.min((ends[4].0 - ends[3].0) / 2);
    std::fs::write(&from, &bytes[..cut]).unwrap();
    let recovered = recover(&from, &to, &Limits::default()).unwrap();
    assert_eq!(recovered.records as usize, ends[3].1);
    assert_eq!(recovered.until_ns, records[ends[3].1 - 1].time_ns());
    let Tail::Cut { at, .. } = recovered.scanned.tail else { panic!("{}", recovered.scanned.tail) };
    assert_eq!(recovered.left_out_bytes, cut as u64 - at);
    let back = in_order(&to);
    assert!(back.iter().map(bits).eq(records[..ends[3].1].iter().map(bits)));
    let log = read(&to, &Limits::default()).unwrap();
    assert!(log.complete);
    let (key, value) = log.header.extra.last().unwrap();
    assert_eq!(key, "recovered");
    assert!(value.contains(&format!("cut at byte {at}")), "{value}");
    let text = recovered.to_string();
    assert!(
        text.contains(&format!("cut at byte {at}")) && text.contains(&recovered.records.to_string()),
        "{text}"
    );
    // Once more: the key does not stand there twice.
    let again = recover(&to, folder.file("again.mcap"), &Limits::default()).unwrap();
    assert_eq!(
        (again.records, again.left_out_bytes, again.scanned.tail),
        (recovered.records, 0, Tail::Finished)
    );
    // Into itself, by another name too.
    assert!(matches!(recover(&from, &from, &Limits::default()), Err(LogError::SameFile { .. })));
    std::fs::hard_link(&from, folder.file("link.mcap")).unwrap();
    let e = recover(&from, folder.file("link.mcap"), &Limits::default()).unwrap_err();
    assert!(matches!(e, LogError::SameFile { .. }), "{e}");
    assert_eq!(std::fs::metadata(&from).unwrap().len(), cut as u64, "the original is as it was");
}

#[test]
fn a_damaged_chunk_is_skipped_and_told() {
    let folder = Folder::new("damaged");
    let (records, mut bytes) = small_log(&folder.file("whole.mcap"), 60);
    let ends = chunk_ends(&bytes);
    bytes[ends[2].0 - 20] ^= 0x10;
    let path = folder.file("damaged.mcap");
    std::fs::write(&path, &bytes).unwrap();
    let log = read(&path, &Limits::default()).unwrap();
    assert_eq!(log.records(), records.len() - (ends[2].1 - ends[1].1));
    assert!(!log.complete && log.tail == Tail::Finished);
    assert_eq!(log.damaged, 2, "the chunk and the data's checksum: {:?}", log.damage);
    let damage = log.damage.as_ref().unwrap();
    assert!((ends[1].0 as u64..ends[2].0 as u64).contains(&damage.at), "{damage}");
    let shown = info(&path, &Limits::default()).unwrap().to_string();
    assert!(shown.contains(&damage.to_string()), "{shown}");
    let recovered = recover(&path, folder.file("recovered.mcap"), &Limits::default()).unwrap();
    assert_eq!(recovered.records as usize, log.records() + 1, "and the event that tells of the gap");
}

#[test]
fn metadata_behind_the_header_changes_nothing() {
    let folder = Folder::new("metadata");
    let mut bytes = header_only(&folder);
    let whole = read_bytes(&bytes, &Limits::default()).unwrap();
    for name in ["clutch", "clutch.extra"] {
        let mut body = (name.len() as u32).to_le_bytes().to_vec();
        body.extend(name.as_bytes());
        let mut map = body.clone();
        map.extend(0_u32.to_le_bytes());
        bytes.extend(file_record(op::METADATA, &body)); // without its pairs
        bytes.extend(file_record(op::METADATA, &map)); // with none
    }
    let log = read_bytes(&bytes, &Limits::default()).unwrap();
    assert_eq!((log.records(), &log.header), (0, &whole.header));
}

#[test]
fn a_bit_changed_outside_the_chunks_is_told() {
    let folder = Folder::new("bit");
    let (_, mut bytes) = small_log(&folder.file("whole.mcap"), 60);
    let at = bytes.windows(8).position(|w| w == b"law_hash").unwrap() + 8 + 4;
    assert_eq!(bytes[at], b'f');
    bytes[at] = b'e'; // the law's hash is another one now
    let log = read_bytes(&bytes, &Limits::default()).unwrap();
    assert!(!log.complete);
    assert!(log.damage.unwrap().what.contains("metadata"));
    assert_eq!(log.damaged, 2, "the record's checksum and the data's");
}

#[test]
fn mutated_files_never_panic_and_never_give_a_record_that_was_not_written() {
    let folder = Folder::new("mutated");
    let (records, bytes) = small_log(&folder.file("whole.mcap"), 60);
    let written: BTreeMap<u64, &Record> = records.iter().map(|r| (r.tick(), r)).collect();
    let original = read_bytes(&bytes, &Limits::default()).unwrap();
    let (mut logs, mut errors) = (0, 0);
    let seed = 2024;
    let mut n = Numbers(seed);
    for case in 0..20_000 {
        let mut bad = bytes.clone();
        for _ in 0..=n.below(3) {
            let at = n.below(bad.len());
            match n.below(6) {
                0 => bad[at] ^= 1 << n.below(8),
                1 => bad[at] = n.next() as u8,
                2 => bad.truncate(at.max(1)),
                3 => bad.insert(at, n.next() as u8),
                4 => drop(bad.drain(at..(at + n.below(40)).min(bad.len() - 1).max(at))),
                _ => {
                    // Eight bytes that are a length or a time as often as not.
                    let value = [u64::MAX, 0, 1 << 40, n.next()][n.below(4)].to_le_bytes();
                    let end = (at + 8).min(bad.len());
                    bad[at..end].copy_from_slice(&value[..end - at]);
                }
            }
        }
        match read_bytes(&bad, &Limits::default()) {
            Err(_) => errors += 1,
            Ok(log) => {
                logs += 1;
                if log.complete {
                    assert_eq!(format!("{log:?}"), format!("{original:?}"), "seed {seed}, case {case}");
                }
                for s in &log.samples {
                    // The start of the run, outside the chunks, may have changed; the rest not.
                    let Record::Sample(w) = written[&s.tick] else {
                        panic!("seed {seed}, case {case}: {s:?}")
                    };
                    let w = Record::Sample(SampleRecord { time_ns: s.time_ns, ..*w });
                    assert_eq!(bits(&Record::Sample(*s)), bits(&w), "seed {seed}, case {case}");
                }
            }
        }
    }
    assert!(logs > 1000 && errors > 1000, "{logs} logs, {errors} errors");
}

#[test]
fn random_bytes_never_panic() {
    let mut n = Numbers(5);
    for _ in 0..20_000 {
        let mut bytes: Vec<u8> = (0..n.below(400)).map(|_| n.next() as u8).collect();
        if n.below(4) > 0 {
            let mut with_magic = mcap::MAGIC.to_vec();
            // Opcodes and short lengths, so that it gets further.
            while n.below(6) > 0 && !bytes.is_empty() {
                with_magic.push(n.below(17) as u8);
                let length = n.below(bytes.len() + 1);
                with_magic.extend((length as u64).to_le_bytes());
                with_magic.extend(bytes.drain(..length));
            }
            bytes = with_magic;
        }
        assert!(read_bytes(&bytes, &Limits::default()).is_err());
    }
}

/// The bytes of a log with nothing but its header, cut after it.
fn header_only(folder: &Folder) -> Vec<u8> {
    let path = folder.file("header.mcap");
    drop(LogWriter::create(&path, &header()).unwrap());
    std::fs::read(path).unwrap()
}

fn file_record(opcode: u8, body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![opcode];
    bytes.extend((body.len() as u64).to_le_bytes());
    bytes.extend(body);
    bytes
}

fn chunk_record(size: u64, crc: u32, packed: &[u8]) -> Vec<u8> {
    let mut body = Vec::new();
    for time in [0_u64, 0] {
        body.extend(time.to_le_bytes());
    }
    body.extend(size.to_le_bytes());
    body.extend(crc.to_le_bytes());
    body.extend(4_u32.to_le_bytes());
    body.extend(b"zstd");
    body.extend((packed.len() as u64).to_le_bytes());
    body.extend(packed);
    let header = ChunkHeader {
        message_start_time: 0,
        message_end_time: 0,
        uncompressed_size: size,
        uncompressed_crc: crc,
        compression: "zstd".into(),
        compressed_size: packed.len() as u64,
    };
    let mcap::records::Record::Chunk { header: parsed, .. } = mcap::parse_record(op::CHUNK, &body).unwrap()
    else {
        panic!("not a chunk")
    };
    assert_eq!(parsed, header);
    file_record(op::CHUNK, &body)
}

/// `size` zeros, compressed.
fn zeros(size: usize) -> Vec<u8> {
    let mut packed = zstd::Encoder::new(Vec::new(), 3).unwrap();
    let block = vec![0; 1 << 20];
    for _ in 0..size >> 20 {
        std::io::Write::write_all(&mut packed, &block).unwrap();
    }
    packed.finish().unwrap()
}

#[test]
fn a_record_of_two_to_the_64_bytes_is_the_end_of_the_log() {
    let mut bytes = mcap::MAGIC.to_vec();
    bytes.extend(file_record(op::HEADER, &[0; 8]));
    bytes.push(op::CHUNK);
    bytes.extend(u64::MAX.to_le_bytes());
    bytes.resize(98, 0); // the file on which readers were seen to abort
    let e = read_bytes(&bytes, &Limits::default()).unwrap_err();
    assert!(matches!(e, LogError::NoHeader { at: 25, .. }), "{e}");

    let folder = Folder::new("length");
    let (records, whole) = small_log(&folder.file("whole.mcap"), 60);
    let ends = chunk_ends(&whole);
    let end = mcap::Summary::read(&whole).unwrap().unwrap().chunk_indexes[4].chunk_start_offset as usize;
    for length in [u64::MAX, u64::MAX - 8, 1 << 63, 1 << 40] {
        let mut bytes = whole[..end].to_vec();
        bytes.push(op::CHUNK);
        bytes.extend(length.to_le_bytes());
        bytes.resize(bytes.len() + 98, 0);
        let log = read_bytes(&bytes, &Limits::default()).unwrap();
        assert_eq!(log.records(), ends[3].1);
        assert!(log.records() < records.len() && !log.complete);
        assert!(matches!(log.tail, Tail::Broken { at, .. } if at == end as u64), "{}", log.tail);
        assert!(log.tail.to_string().contains(&length.to_string()), "{}", log.tail);
    }
}

#[test]
fn a_bomb_costs_neither_memory_nor_time() {
    let folder = Folder::new("bomb");
    let head = header_only(&folder);
    let started = Instant::now();
    let bomb = zeros(4 << 30);
    let made = started.elapsed();
    assert!(bomb.len() < 1 << 20);

    // It declares its size: refused unread.
    let mut bytes = head.clone();
    bytes.extend(chunk_record(4 << 30, 0, &bomb));
    let path = folder.file("honest.mcap");
    std::fs::write(&path, &bytes).unwrap();
    let started = Instant::now();
    let e = read(&path, &Limits::default()).unwrap_err();
    assert!(matches!(e, LogError::Limit { value: 0x1_0000_0000, .. }), "{e}");
    assert!(e.to_string().contains("4294967296"), "{e}");
    // Recovery goes on behind it.
    bytes.extend(chunk_record(0, 0, &zstd::bulk::compress(&[], 1).unwrap()));
    std::fs::write(&path, &bytes).unwrap();
    let recovered = recover(&path, folder.file("to.mcap"), &Limits::default()).unwrap();
    assert_eq!((recovered.scanned.damaged, recovered.scanned.chunks), (1, 2));

    // It declares a small size: unpacked to that size and no further.
    let mut bytes = head.clone();
    bytes.extend(chunk_record(1 << 20, 0, &bomb));
    let log = read_bytes(&bytes, &Limits::default()).unwrap();
    assert_eq!((log.records(), log.damaged), (0, 1));
    assert!(log.damage.unwrap().what.contains("1048576 bytes"));
    assert!(started.elapsed() < Duration::from_secs(2), "{:?} (made in {made:?})", started.elapsed());

    // Thousands within the limit: time runs out.
    let mut bytes = head;
    let small = chunk_record(16 << 20, 0, &zeros(16 << 20));
    for _ in 0..3000 {
        bytes.extend(&small);
    }
    let started = Instant::now();
    let e = read_bytes(&bytes, &Limits { max_seconds: 0.3, ..Limits::default() }).unwrap_err();
    assert!(matches!(e, LogError::Limit { what: "seconds of reading", .. }), "{e}");
    assert!(started.elapsed() < Duration::from_secs(3), "{:?}", started.elapsed());
}

#[test]
fn each_limit_is_named_with_value_and_bound() {
    let folder = Folder::new("limits");
    let path = folder.file("run.mcap");
    let (_, bytes) = small_log(&path, 60);
    let default = Limits::default();
    for (limits, value) in [
        (Limits { max_file_bytes: 100, ..default }, bytes.len() as u64),
        (Limits { max_records: 59, ..default }, 60),
    ] {
        let e = read(&path, &limits).unwrap_err();
        let LogError::Limit { value: v, .. } = &e else { panic!("{e}") };
        assert_eq!(*v, value, "{e}");
        assert!(e.to_string().contains("run.mcap"), "{e}");
    }
    assert!(read(&path, &Limits { max_records: 60, ..default }).is_ok());
    assert!(info(&path, &Limits { max_records: 59, ..default }).is_ok(), "info holds no records");
    for limits in [Limits { max_record_bytes: 50, ..default }, Limits { max_chunk_bytes: 50, ..default }] {
        assert!(matches!(read(&path, &limits), Err(LogError::Limit { limit: 50, .. })));
    }
    assert!(read(&path, &Limits { max_seconds: f64::NAN, ..default }).is_ok(), "no number is no limit");
    // Parameters without a byte of payload take memory, too.
    let mut chunk = file_record(op::CHANNEL, &{
        let mut body = vec![9, 0, 0, 0];
        for text in ["/parameters", "protobuf"] {
            body.extend((text.len() as u32).to_le_bytes());
            body.extend(text.as_bytes());
        }
        body.extend(0_u32.to_le_bytes());
        body
    });
    let mut message = vec![9, 0];
    message.resize(22, 0);
    let message = file_record(op::MESSAGE, &message);
    for _ in 0..400_000 {
        chunk.extend(&message);
    }
    let mut bytes = header_only(&folder);
    for _ in 0..2 {
        bytes.extend(chunk_record(chunk.len() as u64, 0, &zstd::bulk::compress(&chunk, 1).unwrap()));
    }
    let e = read_bytes(&bytes, &default).unwrap_err();
    assert!(matches!(e, LogError::Limit { what: "bytes of parameters", .. }), "{e}");
}

#[test]
fn what_is_no_log_is_named() {
    let folder = Folder::new("no-log");
    let said = |path: &Path| read(path, &Limits::default()).unwrap_err();
    let e = said(&folder.file("missing.mcap"));
    assert!(
        matches!(&e, LogError::Io { source, .. } if source.kind() == std::io::ErrorKind::NotFound),
        "{e}"
    );
    let e = said(&folder.0);
    assert!(matches!(&e, LogError::NotAFile { found: "a directory", .. }), "{e}");
    let path = folder.file("empty.mcap");
    std::fs::write(&path, b"").unwrap();
    let e = said(&path);
    assert!(matches!(&e, LogError::NotALog { found, .. } if found == "an empty file"), "{e}");
    std::fs::write(&path, b"time_s,counts\n").unwrap();
    let e = said(&path).to_string();
    assert!(e.contains("empty.mcap") && e.contains("74, 69") && e.contains("89 4d 43 41 50"), "{e}");
    // A whole MCAP file of another program, and one with nothing in it.
    for topics in [1, 0] {
        let mut out = std::io::Cursor::new(Vec::new());
        let mut other = mcap::Writer::new(&mut out).unwrap();
        for _ in 0..topics {
            let id = other.add_channel(0, "/sample", "json", &BTreeMap::new()).unwrap();
            let m =
                mcap::records::MessageHeader { channel_id: id, sequence: 0, log_time: 0, publish_time: 0 };
            other.write_to_known_channel(&m, b"{}").unwrap();
        }
        other.finish().unwrap();
        drop(other);
        std::fs::write(&path, out.into_inner()).unwrap();
        let e = said(&path);
        assert!(
            matches!(&e, LogError::NotALog { .. }) && e.to_string().contains("metadata record \"clutch\""),
            "{e}"
        );
    }
    // A log of a future clutch.
    let (_, mut bytes) = small_log(&path, 3);
    let at = bytes.windows(6).position(|w| w == b"format").unwrap() + 6 + 4;
    bytes[at] = b'2';
    let e = read_bytes(&bytes, &Limits::default()).unwrap_err();
    assert!(matches!(&e, LogError::Header { key, value, .. } if key == "format" && value == "2"), "{e}");
}

#[test]
fn a_log_is_not_written_into_what_is_no_file() {
    let folder = Folder::new("no-file");
    for path in [folder.0.as_path(), Path::new("/dev/null"), Path::new("/dev/full")] {
        let e = LogWriter::create(path, &header()).unwrap_err();
        assert!(matches!(e, LogError::NotAFile { .. }), "{e}");
    }
    let e = LogWriter::create(folder.file("no/such/folder.mcap"), &header()).unwrap_err();
    assert!(matches!(e, LogError::Io { .. }) && e.to_string().contains("folder.mcap"), "{e}");
    let twice = Header { extra: vec![("k".into(), "1".into()), ("k".into(), "2".into())], ..header() };
    let path = folder.file("run.mcap");
    let e = LogWriter::create(&path, &twice).unwrap_err();
    assert!(matches!(&e, LogError::Header { key, .. } if key == "k"), "{e}");
    let long = Header { scenario_toml: "#".repeat(5 << 20), ..header() };
    assert!(matches!(LogWriter::create(&path, &long), Err(LogError::Limit { value: 5_242_880.., .. })));
    assert!(!path.exists(), "a header that cannot be leaves no file and empties none");
}

#[test]
fn info_counts_without_reading_into_memory() {
    let folder = Folder::new("info");
    let path = folder.file("run.mcap");
    let (records, bytes) = small_log(&path, 60);
    let i = info(&path, &Limits::default()).unwrap();
    assert!(i.complete);
    assert_eq!(i.records(), 60);
    assert_eq!(i.span_ns(), Some((0, records[59].time_ns())));
    assert!((i.duration_s() - 0.413).abs() < 1e-12, "{}", i.duration_s());
    assert_eq!(i.scanned.file_bytes, bytes.len() as u64);
    assert_eq!(i.scanned.chunks as usize, chunk_ends(&bytes).len());
    assert!(i.scanned.compressed_bytes < i.scanned.uncompressed_bytes);
    assert_eq!(i.scanned.header, header());
    let shown = i.to_string();
    for part in [
        "run.mcap: complete",
        "loop of smc_2",
        "fffffffffffffffe",
        "/command",
        "60 records over 0.413 s",
        "zstd",
    ] {
        assert!(shown.contains(part), "no \"{part}\" in\n{shown}");
    }
}

/// The bytes of a log whose header is `header`, with `from` in its metadata replaced by `to` of the same length.
fn edited(name: &str, from: &[u8], to: &[u8]) -> Vec<u8> {
    let folder = Folder::new(name);
    let path = folder.file("log.mcap");
    let _ = LogWriter::create(&path, &header()).unwrap().finish().unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    let places: Vec<usize> =
        (0..bytes.len() - from.len()).filter(|i| bytes[*i..].starts_with(from)).collect();
    assert!(!places.is_empty());
    for at in places {
        bytes[at..at + to.len()].copy_from_slice(to);
    }
    bytes
}

#[test]
fn a_changed_byte_of_the_metadata_is_found_by_its_checksum() {
    let bytes = edited("checksum", b"0.1.0+abc", b"0.1.0+abx");
    let log = read_bytes(&bytes, &Limits::default()).unwrap();
    assert!(!log.complete);
    let damage = log.damage.unwrap();
    assert!(damage.what.starts_with("metadata \"clutch\": checksum "), "{damage}");
    assert_eq!(log.gap_from_ns, None, "no record is missing");
}

#[test]
fn a_log_of_before_the_checksum_is_read_and_told() {
    // Under another name the checksum is a pair like any other, as an older reader takes it.
    let bytes = edited("unchecked", b"crc32", b"other");
    let folder = Folder::new("unchecked-too");
    let path = folder.file("log.mcap");
    std::fs::write(&path, &bytes).unwrap();
    let info = info(&path, &Limits::default()).unwrap();
    assert!(!info.scanned.checked && info.scanned.header.scenario_name == header().scenario_name);
}
