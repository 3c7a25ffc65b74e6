//! The golden bytes. Checksum and stuffing are the textbook's here, not the codec's: a flaw that
//! encoder and decoder share would otherwise be golden.

use clutch_wire::{
    Actuate, Configure, Decoder, Discover, Fault, FrameError, Hello, MAX_FRAME, Message, Refused, SCHEMA,
    Sample, TABLE, VERSION,
};
use std::fmt::Write as _;

/// CRC-32/ISO-HDLC, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = !0_u32;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { (crc >> 1) ^ 0xEDB8_8320 } else { crc >> 1 };
        }
    }
    !crc
}

/// COBS of less than 254 bytes, and the delimiter.
fn stuffed(body: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    for block in body.split(|byte| *byte == 0) {
        out.push(block.len() as u8 + 1);
        out.extend_from_slice(block);
    }
    out.push(0);
    out
}

fn framed(content: &[u8]) -> Vec<u8> {
    stuffed(&[content, &crc32(content).to_le_bytes()].concat())
}

/// Kind and fields of a good frame.
fn content(mut wire: &[u8]) -> Vec<u8> {
    let mut body = Vec::new();
    while let [code, rest @ ..] = wire
        && *code > 0
    {
        let (block, next) = rest.split_at(usize::from(*code) - 1);
        body.extend_from_slice(block);
        body.push(0);
        wire = next;
    }
    // The zero that stands for the end, and the CRC.
    body.truncate(body.len() - 5);
    body
}

/// All results of a decoder for these bytes.
pub(crate) fn heard(bytes: &[u8]) -> Vec<Result<Message, FrameError>> {
    let mut decoder = Decoder::new();
    bytes.iter().filter_map(|byte| decoder.push(*byte)).collect()
}

/// `Sample(Sample { run: 1, … })` as `Sample run=1 …`, an error with `!` in front.
pub(crate) fn shown(result: &Result<Message, FrameError>) -> String {
    let flat = |text: &str| {
        let words = text.replace([',', '{', '}'], " ").replace(": ", "=");
        words.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    match result {
        Ok(message) => {
            let text = format!("{message:?}");
            flat(text.split_once('(').map_or("", |(_, inner)| inner).trim_end_matches(')'))
        }
        Err(FrameError::UnknownKind(kind)) => format!("!UnknownKind kind={kind}"),
        Err(error) => format!("!{}", flat(&format!("{error:?}"))),
    }
}

/// Frames that stand for ordinary use.
fn ordinary() -> Vec<(&'static str, Message)> {
    vec![
        ("handshake", Message::Discover(Discover { nonce: 0x1234_5678, version: VERSION, schema: SCHEMA })),
        (
            "1 kHz with the watchdog at three periods",
            Message::Configure(Configure {
                run: 1,
                config: 0x0123_4567_89AB_CDEF,
                period_us: 1000,
                watchdog_us: 3000,
                safe_kind: 3,
                hold_code: 4095,
                release_code: 2048,
                ramp_step: 655_360,
                hold_periods: 500,
            }),
        ),
        (
            "board of the paper",
            Message::Hello(Hello {
                nonce: 0x1234_5678,
                version: VERSION,
                schema: SCHEMA,
                board: 42,
                boot: 0xC0FF_EE00,
                counts_per_rev: 20_000,
                dac_bits: 12,
                dac_lowest_mv: -10_000,
                dac_highest_mv: 10_000,
                period_min_us: 200,
                period_max_us: 100_000,
                watchdog_max_us: 1_000_000,
                boot_code: 4095,
                started_by: 1,
                warnings: 0,
                state: 0,
                run: 0,
                config: 0,
            }),
        ),
        (
            "worked example",
            Message::Sample(Sample { run: 1, sequence: 256, time_us: 256_000, counts: -7, status: 3 }),
        ),
        ("worked example", Message::Actuate(Actuate { run: 1, sequence: 256, code: 2560, valid_us: 2000 })),
        (
            "watchdog",
            Message::Fault(Fault { run: 1, sequence: 259, time_us: 259_040, cause: 1, value: 3001 }),
        ),
        ("another version", Message::Refused(Refused { request: 1, reason: 1, value: 2 })),
    ]
}

/// The whole file.
pub(crate) fn text() -> String {
    let mut rows: Vec<(&'static str, String, Vec<u8>)> = Vec::new();
    for info in TABLE {
        let fields = usize::from(info.length) - 5;
        let counting = |first: usize| (0..fields).map(|i| (first + i) as u8).collect::<Vec<u8>>();
        let alternating = (0..fields).map(|i| if i % 2 == 0 { 0 } else { 0x80 }).collect();
        let patterns = [
            ("all zero", vec![0; fields]),
            ("all ones", vec![0xFF; fields]),
            ("counting bytes", counting(1)),
            ("high bits set", counting(0xA0)),
            ("every other byte zero", alternating),
        ];
        for ((name, mut bytes), count) in patterns.into_iter().zip([0_u8, 8, 2, 5, 3]) {
            // As many numbers as the list says.
            if info.list > 0 {
                bytes.truncate(fields - 1);
                let numbers: Vec<u8> = bytes[..4 * usize::from(count)].into();
                bytes.push(count);
                bytes.extend(numbers);
            }
            rows.push((
                "frame",
                format!("{}: {name}", info.name),
                framed(&[&[info.kind], &bytes[..]].concat()),
            ));
        }
    }
    for (name, message) in ordinary() {
        let bytes = framed(&content(clutch_wire::encode(&message).as_bytes()));
        let name = format!("{}: {name}", shown(&Ok(message)).split(' ').next().unwrap_or_default());
        rows.push(("frame", name, bytes));
    }

    let sample = framed(&[0x84, 1, 0, 7, 0, 0x58, 0x1B, 0, 0, 0xFD, 0xFF, 0xFF, 0xFF, 3]);
    let actuate = framed(&[0x04, 1, 0, 7, 0, 0, 8, 0xD0, 7]);
    let mut bad = |name: &str, bytes: Vec<u8>| rows.push(("bad", name.to_owned(), bytes));
    bad("code points past the end", vec![5, 1, 0]);
    bad("code 0xFF in a short frame", vec![0xFF, 1, 2, 3, 0]);
    bad("nothing but a code", vec![1, 0]);
    bad("four bytes", stuffed(&[1, 2, 3, 4]));
    bad("four zeros: shorter than a CRC and a kind", stuffed(&[0; 4]));
    bad("five bytes with a wrong CRC", stuffed(&[1, 2, 3, 4, 5]));
    bad("kind 0x00", framed(&[0]));
    bad("kind 0x7f", framed(&[0x7F, 1, 2]));
    bad("kind of no message as long as a sample", framed(&[0x89, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13]));
    bad("a sample one byte short", framed(&[0x84; 13]));
    bad("a sample one byte long", framed(&[0x84; 15]));
    let telemetry = TABLE.iter().find(|m| m.list > 0).expect("a message with a list");
    let listed = |count: u8, numbers: usize| {
        let fields = vec![7; usize::from(telemetry.length) - 6];
        framed(&[&[telemetry.kind], &fields[..], &[count], &vec![9; 4 * numbers]].concat())
    };
    bad("a list of two numbers that claims three", listed(3, 2));
    bad("a list of two numbers that claims one", listed(1, 2));
    bad("a list that claims more than any frame has", listed(255, 8));
    bad("a list of more numbers than one may have", listed(9, 8));
    bad("an actuate of kind sample", framed(&[0x84, 1, 0, 7, 0, 0, 8, 0xD0, 7]));
    let mut flipped = sample.clone();
    flipped[10] ^= 0x10;
    bad("a sample with one bit flipped", flipped);
    let mut flipped = sample.clone();
    flipped[1] ^= 0x80;
    bad("a sample whose kind has one bit flipped", flipped);
    bad("a sample without its first byte", sample[1..].to_vec());
    let swapped: Vec<u8> = [0x84, 1, 0, 7, 0, 0x58, 0x1B, 0, 0, 0xFD, 0xFF, 0xFF, 0xFF, 3].into();
    let big_endian = [&swapped[..], &crc32(&swapped).to_be_bytes()].concat();
    bad("a CRC in big-endian", stuffed(&big_endian));
    bad("the longest frame of one value", [&[MAX_FRAME as u8 - 1; MAX_FRAME - 1][..], &[0]].concat());
    bad("one byte longer than the longest frame", [&[MAX_FRAME as u8; MAX_FRAME][..], &[0]].concat());
    bad("300 bytes", [&[0x41; 300][..], &[0]].concat());

    let mut stream = |name: &str, parts: &[&[u8]]| rows.push(("stream", name.to_owned(), parts.concat()));
    stream("delimiters only", &[&[0, 0, 0]]);
    stream("delimiters in a row between frames", &[&[0], &sample, &[0, 0], &actuate, &[0]]);
    stream("garbage with a delimiter then a frame", &[&[0x55, 0xAA, 3, 0], &sample]);
    stream("garbage without a delimiter costs one frame", &[&[0x55, 0xAA, 3], &sample, &actuate]);
    stream("a frame cut by the next", &[&sample[..9], &actuate, &sample]);
    stream("a frame whose end only is heard", &[&sample[9..], &actuate]);
    stream("too long is said once and the next is heard", &[&[0x41; 200], &[0], &actuate]);
    stream("a frame without its delimiter", &[&sample, &actuate[..actuate.len() - 1]]);

    let mut out = String::from("kind,name,bytes,results\n");
    for (kind, name, bytes) in rows {
        let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        let results = heard(&bytes).iter().map(shown).collect::<Vec<_>>().join("; ");
        writeln!(out, "{kind},{name},{hex},{results}").expect("a String takes all");
    }
    out
}
