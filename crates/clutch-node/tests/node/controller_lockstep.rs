//! Lockstep: what is written is read, and half of it is not.

use crate::desk::{BOARD, BOARD_CONTROLLER};
use clutch_node::controller_lockstep::{Exchange, HEAD, LONGEST, answer};
use clutch_node::{BoardController, BoardNode, Lines, Outbox};
use clutch_wire::{Decoder, Discover, Message, SCHEMA, VERSION, encode};
use proptest::prelude::*;

proptest! {
    #[test]
    fn what_is_written_is_read_and_nothing_before_its_last_byte(
        time_ns: u64,
        lateness_us: u32,
        host in prop::collection::vec(any::<u8>(), 0..1025),
        daq in prop::collection::vec(any::<u8>(), 0..1025),
        behind in prop::collection::vec(any::<u8>(), 0..40),
    ) {
        let written = Exchange { time_ns, lateness_us, host: &host, daq: &daq };
        let mut buffer = [0; LONGEST];
        let length = written.write(&mut buffer).unwrap();
        prop_assert_eq!(length, HEAD + host.len() + daq.len());
        let mut stream = buffer[..length].to_vec();
        stream.extend_from_slice(&behind);
        prop_assert_eq!(Exchange::read(&stream), Some(written), "what follows is the next one's");
        for cut in 0..length {
            prop_assert_eq!(Exchange::read(&stream[..cut]), None);
            prop_assert_eq!(Exchange::length(&stream[..cut]), (cut >= HEAD).then_some(length));
        }
    }
}

#[test]
fn what_is_longer_than_the_buffer_or_than_a_length_can_say_is_not_written() {
    let (long, longer) = (vec![1; usize::from(u16::MAX)], vec![1; usize::from(u16::MAX) + 1]);
    let mut buffer = vec![0; HEAD + 2 * longer.len()];
    let mut length = |host: &[u8], daq: &[u8], room: usize| {
        let exchange = Exchange { time_ns: 1, lateness_us: 2, host, daq };
        buffer[..room].fill(0xaa);
        let length = exchange.write(&mut buffer[..room]);
        if length.is_none() {
            assert!(buffer[..room].iter().all(|b| *b == 0xaa), "nothing of it is written");
        }
        length
    };
    assert_eq!(length(&[], &[], HEAD), Some(HEAD));
    assert_eq!(length(&[], &[], HEAD - 1), None);
    assert_eq!(length(&[1; 1024], &[1; 1024], LONGEST), Some(LONGEST));
    assert_eq!(length(&[1; 1024], &[1; 1025], LONGEST), None);
    let room = HEAD + 2 * longer.len();
    assert_eq!(length(&long, &long, room), Some(HEAD + 2 * long.len()));
    assert_eq!(length(&longer, &[], room), None);
    assert_eq!(length(&[], &longer, room), None);
}

#[test]
fn an_exchange_lies_on_the_wire_as_its_document_says() {
    let mut buffer = [0; 32];
    let exchange = Exchange { time_ns: 0x0102_0304_0506_0708, lateness_us: 9, host: &[7], daq: &[5, 6] };
    let length = exchange.write(&mut buffer).unwrap();
    assert_eq!(buffer[..length], [8, 7, 6, 5, 4, 3, 2, 1, 9, 0, 0, 0, 1, 0, 2, 0, 7, 5, 6]);
}

#[test]
fn what_encoder_and_converter_say_is_with_the_host_after_the_next_exchange() {
    let mut controller = BoardController::new(BOARD_CONTROLLER);
    let mut board = BoardNode::new(&BOARD).unwrap();
    let (mut lines, mut line, mut up) = (Lines::default(), Decoder::new(), Outbox::default());
    let ask = encode(&Message::Discover(Discover { nonce: 11, version: VERSION, schema: SCHEMA }));
    let first = Exchange { time_ns: 1_000_000, lateness_us: 0, host: ask.as_bytes(), daq: &[] };
    let asked = answer(&mut controller, &first, &mut lines).daq.to_vec();
    board.receive(1000, &mut line, &asked, &mut up);
    let second = Exchange { time_ns: 2_000_000, lateness_us: 0, host: &[], daq: up.as_bytes() };
    let said = answer(&mut controller, &second, &mut lines).host.to_vec();
    let mut decoder = Decoder::new();
    let heard: Vec<_> = said.iter().filter_map(|byte| decoder.push(*byte)).map(Result::unwrap).collect();
    assert!(matches!(heard[..], [Message::Hello(hello)] if hello.board == BOARD.board), "{heard:?}");
}
