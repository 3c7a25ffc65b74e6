//! The wire protocol: golden bytes, the C header, and the files made from the table of messages.

use clutch_wire::{Decoder, FrameError, Message, Sample, encode};
use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

#[allow(dead_code, reason = "an example's `main`; here only what it prints is called")]
#[path = "../../crates/clutch-wire/examples/table/main.rs"]
mod table;

#[allow(dead_code, reason = "likewise")]
#[path = "../../crates/clutch-settings/examples/settings.rs"]
mod settings;

const VECTORS: &str = include_str!("vectors.csv");
const HEADER: &str = include_str!("../../crates/clutch-wire/include/clutch_wire.h");
const DOCUMENT: &str = include_str!("../../docs/wire.md");

struct Row {
    kind: &'static str,
    name: &'static str,
    bytes: Vec<u8>,
    results: Vec<&'static str>,
}

fn unhex(text: &str) -> Vec<u8> {
    text.as_bytes()
        .chunks(2)
        .map(|pair| std::str::from_utf8(pair).ok().and_then(|pair| u8::from_str_radix(pair, 16).ok()))
        .collect::<Option<_>>()
        .unwrap_or_else(|| panic!("{text} is not hexadecimal"))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn rows() -> Vec<Row> {
    VECTORS
        .lines()
        .skip(1)
        .map(|line| {
            let columns: Vec<&str> = line.split(',').collect();
            let [kind, name, bytes, results] = columns[..] else { panic!("not four columns: {line}") };
            let results = results.split("; ").filter(|text| !text.is_empty()).collect();
            Row { kind, name, bytes: unhex(bytes), results }
        })
        .collect()
}

fn heard(bytes: &[u8]) -> Vec<Result<Message, FrameError>> {
    let mut decoder = Decoder::new();
    bytes.iter().filter_map(|byte| decoder.push(*byte)).collect()
}

/// `Sample { run: 1, … }` as the file writes it; its own code, so that the generator's is checked.
fn shown(result: &Result<Message, FrameError>) -> String {
    if let Ok(Message::Sample(s)) = result {
        return format!(
            "Sample run={} sequence={} time_us={} counts={} status={}",
            s.run, s.sequence, s.time_us, s.counts, s.status
        );
    }
    if let Ok(Message::Actuate(a)) = result {
        return format!(
            "Actuate run={} sequence={} code={} valid_us={}",
            a.run, a.sequence, a.code, a.valid_us
        );
    }
    table::vectors::shown(result)
}

#[test]
fn committed_files_are_what_the_table_gives_now() {
    let stale = |what: &str| format!("{what} is stale: run `cargo xtask generate`");
    assert!(HEADER == table::header::text(), "{}", stale("clutch_wire.h"));
    assert!(VECTORS == table::vectors::text(), "{}", stale("vectors.csv"));
    let kept = |name: &str| {
        let (_, rest) =
            DOCUMENT.split_once(&format!("<!-- {name}:begin -->")).expect("the page has its markers");
        rest.split_once(&format!("<!-- {name}:end -->")).expect("both").0.trim()
    };
    assert_eq!(kept("table"), table::markdown::tables().trim(), "{}", stale("docs/wire.md"));
    assert_eq!(kept("settings"), settings::text().trim(), "{}", stale("docs/wire.md"));
}

#[test]
fn golden_bytes_decode_to_their_fields_and_back() {
    let mut number = BTreeMap::new();
    for row in rows() {
        let got = heard(&row.bytes);
        let texts: Vec<String> = got.iter().map(shown).collect();
        assert_eq!(texts, row.results, "{}", row.name);
        match row.kind {
            "frame" => {
                let [Ok(message)] = got[..] else { panic!("{}: not one message", row.name) };
                assert_eq!(hex(encode(&message).as_bytes()), hex(&row.bytes), "{}", row.name);
            }
            "bad" => assert!(matches!(got[..], [Err(_)]), "{}: not one error", row.name),
            "stream" => {}
            other => panic!("{}: no such kind of row: {other}", row.name),
        }
        *number.entry(row.kind).or_insert(0) += 1;
    }
    assert!(number["frame"] >= 14 * 5 && number["bad"] >= 12 && number["stream"] >= 6, "{number:?}");
}

/// A compiler that works, if there is one.
fn compiler(names: [&'static str; 2]) -> Option<&'static str> {
    let works = |name: &&str| Command::new(name).arg("--version").output().is_ok_and(|o| o.status.success());
    let found = names.into_iter().find(works);
    if found.is_none() {
        println!("skipped: none of {names:?} is installed");
    }
    found
}

fn compile(compiler: &str, standard: &str, source: &Path, output: &Path, more: &[&str]) {
    let include = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/clutch-wire/include");
    let done = Command::new(compiler)
        .args([standard, "-Wall", "-Wextra", "-Wconversion", "-Wno-unused-function", "-Werror", "-O1"])
        .args(more)
        .arg("-I")
        .arg(include)
        .arg(source)
        .arg("-o")
        .arg(output)
        .output()
        .expect("the compiler starts");
    assert!(done.status.success(), "{compiler} {standard}:\n{}", String::from_utf8_lossy(&done.stderr));
}

#[test]
fn the_c_header_compiles_without_a_warning_and_says_the_same_of_the_golden_bytes() {
    let Some(gcc) = compiler(["gcc", "cc"]) else { return };
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("wire/vectors.c");
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join("wire_vectors");
    compile(gcc, "-std=c99", &source, &program, &["-pedantic"]);

    let mut child = Command::new(&program)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the C program starts");
    let mut input = child.stdin.take().expect("it has an input");
    let mut expected = Vec::new();
    for row in rows() {
        writeln!(input, "{}", hex(&row.bytes)).expect("it reads");
        let events: Vec<String> = heard(&row.bytes)
            .iter()
            .map(|result| match result {
                Ok(Message::Sample(_) | Message::Actuate(_)) => shown(result),
                Ok(message) => hex(encode(message).as_bytes()),
                Err(_) => shown(result).split(' ').next().unwrap_or_default().to_owned(),
            })
            .collect();
        expected.push(events.join("; "));
    }
    drop(input);
    let done = child.wait_with_output().expect("it ends");
    assert!(done.status.success());
    let text = String::from_utf8(done.stdout).expect("it prints ASCII");
    for ((row, got), expected) in rows().iter().zip(text.lines()).zip(&expected) {
        assert_eq!(got, expected, "{}", row.name);
    }
    assert_eq!(text.lines().count(), expected.len());
}

#[test]
fn the_c_header_compiles_as_cpp() {
    let Some(gpp) = compiler(["g++", "c++"]) else { return };
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("wire/vectors.c");
    let object = Path::new(env!("CARGO_TARGET_TMPDIR")).join("wire_vectors.o");
    compile(gpp, "-std=c++11", &source, &object, &["-x", "c++", "-c"]);
}

/// xorshift64*: enough to hit frames at random.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        ((u128::from(self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)) * end as u128) >> 64) as usize
    }

    fn byte(&mut self) -> u8 {
        self.below(256) as u8
    }
}

/// Bits, bytes and stretches of a flow of frames, changed in ten ways.
fn corrupt(random: &mut Random, flow: &mut Vec<u8>) {
    let at = random.below(flow.len());
    let end = (at + 1 + random.below(8)).min(flow.len());
    match random.below(10) {
        0 => flow[at] ^= 1 << random.below(8),
        1 => {
            for _ in 0..2 + random.below(4) {
                let bit = random.below(flow.len() * 8);
                flow[bit / 8] ^= 1 << (bit % 8);
            }
        }
        2 => flow[at] = random.byte(),
        3 => flow[at..end].iter_mut().for_each(|byte| *byte = random.byte()),
        4 => flow[at..end].fill(0),
        5 => flow[at..end].fill(0xFF),
        6 => drop(flow.drain(at..end)),
        7 => flow.insert(at, random.byte()),
        8 => flow.insert(at, flow[at]),
        _ => flow[at..end].reverse(),
    }
}

/// `CLUTCH_CORRUPTIONS=30000000 cargo test --release -p clutch-tests --test wire -- corrupted --nocapture`
/// runs more of them.
#[test]
fn corrupted_flows_never_hold_a_frame_that_was_not_sent() {
    let runs = std::env::var("CLUTCH_CORRUPTIONS").map_or(200_000, |n| n.parse::<u64>().expect("a number"));
    let golden: Vec<Vec<u8>> =
        rows().into_iter().filter(|row| row.kind == "frame").map(|row| row.bytes).collect();
    let seed = 0x9E37_79B9_7F4A_7C15;
    let mut random = Random(seed);
    let (mut accepted, mut dropped) = (0_u64, 0_u64);
    for run in 0..runs {
        // The cycle's frames half of the time, any others otherwise.
        let mut flow = Vec::new();
        let mut sent = Vec::new();
        for _ in 0..3 {
            let bytes = if random.below(2) == 0 {
                let counts = random.below(1 << 32) as u32 as i32;
                let sequence = random.below(1 << 16) as u16;
                let time_us = random.below(1 << 32) as u32;
                let sample = Sample { run: 1, sequence, time_us, counts, status: 3 };
                encode(&Message::Sample(sample)).as_bytes().to_vec()
            } else {
                golden[random.below(golden.len())].clone()
            };
            sent.extend(heard(&bytes).into_iter().flatten());
            flow.extend(bytes);
        }
        for _ in 0..1 + random.below(3) {
            corrupt(&mut random, &mut flow);
        }
        let mut rest = sent.iter();
        for result in heard(&flow) {
            if let Ok(message) = result {
                assert!(rest.any(|m| *m == message), "seed {seed:#x}, run {run}: made up {message:?}");
                accepted += 1;
            } else {
                dropped += 1;
            }
        }
    }
    println!("{runs} corrupted flows: {accepted} frames accepted, {dropped} dropped, none made up");
    assert!(dropped > runs / 2, "corruption that is not seen is none");
}
