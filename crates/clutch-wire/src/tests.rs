//! Round trips, resynchronisation and corruption. The golden bytes are checked in tests/wire.

use super::*;
use proptest::prelude::*;
use std::format;
use std::vec::Vec;

/// A textbook CRC-32/ISO-HDLC, bit by bit, not sharing anything with the codec.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ if crc & 1 == 1 { 0xEDB8_8320 } else { 0 })
    })
}

/// COBS as the textbook has it, block by block.
fn cobs(body: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    for block in body.split(|&byte| byte == 0) {
        out.push(block.len() as u8 + 1);
        out.extend_from_slice(block);
    }
    out.push(0);
    out
}

fn framed(content: &[u8]) -> Vec<u8> {
    cobs(&[content, &crc32(content).to_le_bytes()].concat())
}

fn heard(bytes: &[u8]) -> Vec<Result<Message, FrameError>> {
    let mut decoder = Decoder::new();
    bytes.iter().filter_map(|&byte| decoder.push(byte)).collect()
}

fn accepted(bytes: &[u8]) -> Vec<Message> {
    heard(bytes).into_iter().flatten().collect()
}

/// Any message, with zeros and ones as often as all else together.
fn any_message() -> impl Strategy<Value = Message> {
    let byte = prop_oneof![2 => any::<u8>(), 1 => Just(0), 1 => Just(0xFF)];
    (0..TABLE.len(), proptest::collection::vec(byte, MAX_BODY), 0..=List::MOST as u8)
        .prop_map(|(i, bytes, count)| taken(&TABLE[i], bytes, count))
}

/// A message of these fields, and of so many numbers if it has a list.
fn taken(info: &MessageInfo, mut fields: Vec<u8>, count: u8) -> Message {
    if info.list > 0 {
        fields[usize::from(info.length) - 6] = count;
    }
    Message::take(info.kind, &fields).expect("the table has this kind")
}

/// One of each, with fields that are not zero.
fn one_of_each() -> Vec<Message> {
    TABLE.iter().map(|m| taken(m, (1..=MAX_BODY as u8).collect(), 3)).collect()
}

fn sample(sequence: u16) -> Message {
    Message::Sample(Sample { run: 9, sequence, time_us: 1000 * u32::from(sequence), counts: -70, status: 3 })
}

#[test]
fn the_checksum_is_the_one_that_the_world_knows() {
    assert_eq!(crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(b"123456789"), 0xCBF4_3926);
    assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
}

#[test]
fn a_frame_is_its_content_checksum_and_stuffing_by_the_textbook() {
    for (message, info) in one_of_each().iter().zip(TABLE) {
        let mut content: Vec<u8> = [info.kind].into_iter().chain(1..=info.length - 5).collect();
        if info.list > 0 {
            content[usize::from(info.length) - 5] = 3;
            content.extend(info.length - 4..info.length - 4 + 3 * 4);
        }
        assert_eq!(encode(message).as_bytes(), framed(&content), "{message:?}");
        assert_eq!(encode(message).as_bytes().len(), content.len() + 4 + 2);
    }
}

#[test]
fn frames_of_the_cycle_take_at_most_twenty_bytes() {
    assert_eq!(Sample::LENGTH + 2, 20);
    assert_eq!(Actuate::LENGTH + 2, 15);
    assert_eq!(encode(&sample(0)).as_bytes().len(), 20);
    assert_eq!(MAX_FRAME, 89);
}

#[test]
fn the_table_has_no_gaps_and_its_kinds_tell_the_direction() {
    for message in TABLE {
        let mut end = 1;
        for field in message.fields {
            assert_eq!(field.offset, end, "{}.{}", message.name, field.name);
            end += match field.ty {
                "u8" => 1,
                "u16" => 2,
                "u32" | "i32" => 4,
                "u64" => 8,
                "[u32;8]" => 1,
                other => panic!("{other} is not an integer of the wire"),
            };
            assert!(!field.doc.is_empty());
        }
        assert_eq!(message.length, end + 4, "{}", message.name);
        assert_eq!(message.direction == Direction::ToHost, message.kind >= 0x80);
        assert_eq!(Message::length(message.kind, &[]), Some(usize::from(message.length)));
        let list = message.fields.iter().position(|field| field.ty == "[u32;8]");
        assert_eq!(list, (message.list > 0).then(|| message.fields.len() - 1), "{}", message.name);
    }
    let mut kinds: Vec<u8> = TABLE.iter().map(|m| m.kind).collect();
    kinds.dedup();
    assert_eq!(kinds.len(), TABLE.len());
    assert!(kinds.is_sorted());
    assert!(!kinds.contains(&0));
}

#[test]
fn a_list_has_the_numbers_that_it_was_given_and_no_more_than_it_may() {
    assert_eq!(List::new([7, 0, 9]).numbers(), [7, 0, 9]);
    assert_eq!(List::default().numbers(), [0; 0]);
    assert_eq!(format!("{:?}", List::new([7, 0, 9])), "[7, 0, 9]");
    assert_eq!(List::new(1..100).numbers(), [1, 2, 3, 4, 5, 6, 7, 8]);
}

#[test]
fn a_list_that_claims_other_than_it_has_is_of_the_wrong_length() {
    let fields = [&[0x8B][..], &[7; Telemetry::LENGTH - 6]].concat();
    let listed =
        |count: u8, numbers: usize| framed(&[&fields[..], &[count], &std::vec![9; 4 * numbers]].concat());
    let [Ok(Message::Telemetry(m))] = heard(&listed(2, 2))[..] else { panic!("two numbers") };
    assert_eq!(m.terms.numbers(), [0x0909_0909; 2]);
    for (count, numbers, expected) in [(0, 1, 55), (3, 2, 67), (1, 2, 59), (9, 8, 91), (255, 8, 255)] {
        let got = (Telemetry::LENGTH + 4 * numbers) as u8;
        assert_eq!(heard(&listed(count, numbers)), [Err(FrameError::Length { kind: 0x8B, expected, got })]);
    }
    // Nine numbers are longer than any frame.
    assert_eq!(heard(&listed(9, 9)), [Err(FrameError::TooLong)]);
}

#[test]
fn the_schema_hash_is_that_of_the_canonical_text() {
    let mut text = std::string::String::new();
    for message in TABLE {
        text += &format!("{:02x} {}", message.kind, message.name);
        for field in message.fields {
            text += &format!(" {}:{}", field.name, field.ty);
        }
        text += "\n";
    }
    assert!(text.contains("\n84 Sample run:u16 sequence:u16 time_us:u32 counts:i32 status:u8\n"));
    let hash = text
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3));
    assert_eq!(SCHEMA, hash);
}

#[test]
fn frozen_layouts_stay_as_they_are() {
    let discover =
        Message::Discover(Discover { nonce: 0x0403_0201, version: 5, schema: 0x0d0c_0b0a_0908_0706 });
    let content: Vec<u8> = [1].into_iter().chain(1..=13).collect();
    assert_eq!(encode(&discover).as_bytes(), framed(&content));
    let refused = Message::Refused(Refused { request: 1, reason: 2, value: 0x0605_0403 });
    assert_eq!(encode(&refused).as_bytes(), framed(&[0x88, 1, 2, 3, 4, 5, 6]));
}

#[test]
fn codes_come_back_from_their_numbers_and_others_do_not() {
    fn name(code: Option<impl core::fmt::Debug>) -> Option<std::string::String> {
        code.map(|code| format!("{code:?}"))
    }
    for value in 0..=255_u8 {
        let known = |set: &str| {
            let set = CODES.iter().find(|c| c.name == set).unwrap();
            set.values.iter().find(|v| v.value == value).map(|v| v.name.into())
        };
        assert_eq!(name(BoardState::from_u8(value)), known("BoardState"));
        assert_eq!(name(SafeKind::from_u8(value)), known("SafeKind"));
        assert_eq!(name(BoardFault::from_u8(value)), known("BoardFault"));
        assert_eq!(name(StopReason::from_u8(value)), known("StopReason"));
        assert_eq!(name(Refusal::from_u8(value)), known("Refusal"));
    }
    assert_eq!(Refusal::from_u8(Refusal::Code as u8), Some(Refusal::Code));
    assert_eq!(BoardState::Faulted as u8 & !STATUS_STATE, 0);
    assert_eq!(STATUS.iter().fold(0, |all, flag| all + u32::from(flag.value)), 0x3f);
}

#[test]
fn delimiters_in_a_row_are_silent() {
    let frame = encode(&sample(4));
    let stream = [&[0, 0, 0], frame.as_bytes(), &[0, 0], frame.as_bytes()].concat();
    assert_eq!(heard(&stream), [Ok(sample(4)), Ok(sample(4))]);
}

#[test]
fn each_flaw_has_its_error() {
    use FrameError::{Cobs, Crc, Length, TooLong, TooShort, UnknownKind};
    assert_eq!(heard(&[5, 1, 0]), [Err(Cobs)]);
    assert_eq!(heard(&[0xFF, 1, 0]), [Err(Cobs)]);
    assert_eq!(heard(&[1, 0]), [Err(TooShort)]);
    assert_eq!(heard(&cobs(&[1, 2, 3, 4])), [Err(TooShort)]);
    assert_eq!(heard(&cobs(&[1, 2, 3, 4, 5])), [Err(Crc { expected: 0x0504_0302, computed: crc32(&[1]) })]);
    assert_eq!(heard(&framed(&[0x7F])), [Err(UnknownKind(0x7F))]);
    let mut content = std::vec![0x84; 13];
    assert_eq!(heard(&framed(&content)), [Err(Length { kind: 0x84, expected: 18, got: 17 })]);
    content.extend([0; 2]);
    assert_eq!(heard(&framed(&content)), [Err(Length { kind: 0x84, expected: 18, got: 19 })]);
    assert_eq!(heard(&[7; MAX_FRAME]), [Err(TooLong)]);
    for error in [Cobs, TooLong, TooShort, UnknownKind(3), Length { kind: 4, expected: 13, got: 12 }] {
        assert!(format!("{error}").contains(':'), "{error}");
    }
    let text = format!("{}", Crc { expected: 0x0504_0302, computed: 7 });
    assert_eq!(text, "CRC = 0x05040302: expected 0x00000007, which the bytes give");
    let text = format!("{}", Length { kind: 4, expected: 13, got: 12 });
    assert_eq!(text, "length = 12 bytes: expected 13 for kind 0x04");
}

#[test]
fn what_is_too_long_is_said_once_and_the_next_frame_is_heard() {
    let mut stream = std::vec![0x41; 10_000];
    stream.push(0);
    stream.extend_from_slice(encode(&sample(1)).as_bytes());
    assert_eq!(heard(&stream), [Err(FrameError::TooLong), Ok(sample(1))]);
    // The longest that fits is judged by its content.
    let mut stream = std::vec![MAX_FRAME as u8 - 1; MAX_FRAME - 1];
    stream.push(0);
    assert!(matches!(heard(&stream)[..], [Err(FrameError::Crc { .. })]));
}

#[test]
fn no_flip_of_one_or_two_bits_makes_another_frame() {
    for message in [sample(3), Message::Actuate(Actuate { run: 9, sequence: 3, code: 2048, valid_us: 900 })] {
        let frame = encode(&message);
        let bytes = frame.as_bytes();
        // A frame before and behind: a flip may merge frames or cut one.
        let flow = [bytes, bytes, bytes].concat();
        let (start, bits) = (bytes.len() * 8, bytes.len() * 8);
        let flip = |flow: &mut [u8], bit: usize| flow[(start + bit) / 8] ^= 1 << (bit % 8);
        for first in 0..bits {
            for second in first..bits {
                let mut hit = flow.clone();
                flip(&mut hit, first);
                if second > first {
                    flip(&mut hit, second);
                }
                let got = accepted(&hit);
                assert!(got.iter().all(|m| *m == message), "bits {first} and {second}: {got:?}");
                assert!(got.len() < 3, "bits {first} and {second} went unseen");
            }
        }
    }
}

proptest! {
    #[test]
    fn a_message_comes_back_as_it_was_sent(message in any_message()) {
        let frame = encode(&message);
        let (last, rest) = frame.as_bytes().split_last().unwrap();
        prop_assert_eq!(*last, 0);
        prop_assert!(!rest.contains(&0));
        prop_assert_eq!(heard(frame.as_bytes()), [Ok(message)]);
    }

    #[test]
    fn any_stream_cut_anywhere_is_survived_and_what_it_holds_is_found_again(
        bytes in proptest::collection::vec(prop_oneof![3 => any::<u8>(), 1 => 0..4_u8], 0..400),
        message in any_message(),
    ) {
        let mut decoder = Decoder::default();
        for &byte in &bytes {
            // A decoder accepts only what an encoder would have sent.
            if let Some(Ok(found)) = decoder.push(byte) {
                prop_assert_eq!(heard(encode(&found).as_bytes()), [Ok(found)]);
            }
        }
        // At most the one frame that the garbage runs into is lost.
        let frame = encode(&message);
        for _ in 0..2 {
            let last = frame.as_bytes().iter().filter_map(|&byte| decoder.push(byte)).last();
            if last == Some(Ok(message)) {
                return Ok(());
            }
        }
        prop_assert!(false, "two good frames were lost");
    }

    #[test]
    fn a_frame_cut_in_two_costs_itself_and_at_most_the_next(
        message in any_message(), next in any_message(), cut in 1..MAX_FRAME,
    ) {
        let frame = encode(&message);
        let cut = cut.min(frame.as_bytes().len() - 1);
        let (head, tail) = frame.as_bytes().split_at(cut);
        let good = encode(&next);
        // Only the tail is heard: its delimiter ends it, and nothing else is lost.
        prop_assert_eq!(accepted(&[tail, good.as_bytes()].concat()), [next]);
        // Only the head is heard: it runs into the next frame, and the one behind is heard.
        prop_assert_eq!(accepted(&[head, good.as_bytes(), good.as_bytes()].concat()), [next]);
    }

    #[test]
    fn corrupted_frames_are_never_taken_for_others(
        messages in proptest::collection::vec(any_message(), 3),
        hits in proptest::collection::vec((any::<proptest::sample::Index>(), 0..4_u8, any::<u8>()), 1..8),
    ) {
        let mut flow: Vec<u8> = messages.iter().flat_map(|m| encode(m).as_bytes().to_vec()).collect();
        for (place, how, value) in hits {
            let i = place.index(flow.len());
            match how {
                0 => flow[i] ^= 1 << (value % 8),
                1 => flow[i] = value,
                2 => { flow.remove(i); }
                _ => flow.insert(i, value),
            }
        }
        // In order, each at most once: nothing made up.
        let mut sent = messages.iter();
        for got in accepted(&flow) {
            prop_assert!(sent.any(|m| *m == got), "made up: {got:?}");
        }
    }
}
