//! Helpers that the tests of this crate share.
#![allow(dead_code, unreachable_pub, reason = "each test binary uses its own part")]

use clutch_log::{
    ChangeRecord, CommandRecord, EventRecord, Header, LinkRecord, LogWriter, Record, SampleRecord, Source,
    TruthRecord,
};
use std::path::{Path, PathBuf};

/// A folder that goes away with the test.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("clutch-log-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Numbers that look random and are the same each time.
pub struct Numbers(pub u64);

impl Numbers {
    pub fn next(&mut self) -> u64 {
        // SplitMix64.
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }
}

pub fn header() -> Header {
    Header {
        scenario_name: "smc_2".into(),
        scenario_toml: "name = \"smc_2\"\n[law.smc]\nkappa = 1.5\n".into(),
        parameters: vec![
            ("law.kp".into(), "12.5".into()),
            ("law.kp".into(), "again".into()),
            (String::new(), String::new()),
        ],
        version: "0.1.0+abc".into(),
        law_hash: u64::MAX - 1,
        port: "/dev/ttyUSB0".into(),
        source: Source::Loop,
        scalar: "f32".into(),
        period_us: 500,
        term_names: vec!["surface_rad_s".into(), "Equivalent/V".into(), "switching_v".into()],
        started_unix_ns: 1_700_000_000_123_456_789,
        extra: vec![("a".into(), "1".into()), ("board".into(), "α\n\"β\"".into())],
    }
}

/// Every kind of record, with numbers of every size, NaNs with a payload among them.
pub fn record(n: &mut Numbers, tick: u64, time_ns: u64) -> Record {
    fn real(n: &mut Numbers) -> f64 {
        match n.below(12) {
            0 => 0.0,
            1 => -0.0,
            2 => f64::INFINITY,
            3 => f64::NEG_INFINITY,
            4 => f64::from_bits(0x7ff0_0000_0000_0001 | (n.next() >> 13)), // signalling or quiet
            5 => f64::from_bits(0xfff8_0000_dead_beef),
            6 => f64::MIN_POSITIVE / 3.0,
            7 => f64::MAX,
            _ => f64::from_bits(n.next()),
        }
    }
    fn whole(n: &mut Numbers) -> u64 {
        match n.below(4) {
            0 => 0,
            1 => u64::MAX,
            _ => n.next() >> n.below(64),
        }
    }
    match n.below(6) {
        0 => Record::Sample(SampleRecord {
            tick,
            time_ns,
            arrival: whole(n) as u8,
            sequence: whole(n) as u16,
            board_time_us: whole(n) as u32,
            counts: if n.below(8) == 0 { i32::MIN } else { whole(n) as i32 },
            status: whole(n) as u8,
            age_us: whole(n) as u32,
            lateness_us: whole(n) as u32,
            superseded: n.below(2) == 0,
            wake_us: whole(n) as u32,
            position: real(n),
        }),
        1 => Record::Command(CommandRecord {
            tick,
            time_ns,
            state: whole(n) as u8,
            source: whole(n) as u8,
            limit: whole(n) as u8,
            code: whole(n) as u16,
            voltage: real(n),
            demand: real(n),
            target_fixed: if n.below(8) == 0 { i64::MIN } else { whole(n) as i64 },
            target_position: real(n),
            target_velocity: real(n),
            target_acceleration: real(n),
            error: real(n),
            error_rate: real(n),
            terms: [real(n), real(n), real(n)].into_iter().collect(),
        }),
        2 => Record::Event(EventRecord {
            tick,
            time_ns,
            kind: whole(n) as u8,
            from: whole(n) as u8,
            to: whole(n) as u8,
            cause: whole(n) as u8,
            value: real(n),
        }),
        3 => Record::Link(LinkRecord {
            tick,
            time_ns,
            received: whole(n),
            lost: whole(n),
            late: whole(n),
            duplicated: whole(n),
            reordered: whole(n),
            rejected_frames: whole(n),
            rejected_samples: whole(n),
            deadline_misses: whole(n),
            log_dropped: whole(n),
        }),
        4 => Record::Change(ChangeRecord {
            tick,
            time_ns,
            parameter: whole(n) as u16,
            value: real(n),
            error_bound: real(n),
        }),
        _ => Record::Truth(TruthRecord {
            tick,
            time_ns,
            position: real(n),
            velocity: real(n),
            stuck: n.below(2) == 0,
        }),
    }
}

/// The bits of a record: `==` on reals knows neither −0 nor NaN.
pub fn bits(record: &Record) -> Vec<u64> {
    match *record {
        Record::Sample(r) => vec![
            0,
            r.tick,
            r.time_ns,
            r.arrival.into(),
            r.sequence.into(),
            r.board_time_us.into(),
            r.counts as u64,
            r.status.into(),
            r.age_us.into(),
            r.lateness_us.into(),
            r.superseded.into(),
            r.wake_us.into(),
            r.position.to_bits(),
        ],
        Record::Command(r) => vec![
            1,
            r.tick,
            r.time_ns,
            r.state.into(),
            r.source.into(),
            r.limit.into(),
            r.code.into(),
            r.voltage.to_bits(),
            r.demand.to_bits(),
            r.target_fixed as u64,
            r.target_position.to_bits(),
            r.target_velocity.to_bits(),
            r.target_acceleration.to_bits(),
            r.error.to_bits(),
            r.error_rate.to_bits(),
            r.terms[0].to_bits(),
            r.terms[1].to_bits(),
            r.terms[2].to_bits(),
        ],
        Record::Event(r) => vec![
            2,
            r.tick,
            r.time_ns,
            r.kind.into(),
            r.from.into(),
            r.to.into(),
            r.cause.into(),
            r.value.to_bits(),
        ],
        Record::Link(r) => vec![
            3,
            r.tick,
            r.time_ns,
            r.received,
            r.lost,
            r.late,
            r.duplicated,
            r.reordered,
            r.rejected_frames,
            r.rejected_samples,
            r.deadline_misses,
            r.log_dropped,
        ],
        Record::Change(r) => {
            vec![5, r.tick, r.time_ns, r.parameter.into(), r.value.to_bits(), r.error_bound.to_bits()]
        }
        Record::Truth(r) => {
            vec![4, r.tick, r.time_ns, r.position.to_bits(), r.velocity.to_bits(), r.stuck.into()]
        }
    }
}

/// `count` records, 7 ms apart; gives them and the finished file.
pub fn small_log(path: &Path, count: u64) -> (Vec<Record>, Vec<u8>) {
    let mut numbers = Numbers(7);
    let mut log = LogWriter::create(path, &header()).unwrap();
    let records: Vec<_> = (0..count).map(|tick| record(&mut numbers, tick, tick * 7_000_000)).collect();
    for r in &records {
        log.write(r).unwrap();
    }
    log.finish().unwrap();
    (records, std::fs::read(path).unwrap())
}
