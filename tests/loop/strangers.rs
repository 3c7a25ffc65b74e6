//! Those who may not talk to a board: the blind, the idle, other users, and boards that ask for patience.

use crate::harness::{Board, Device, Random, alone, beside_others, folder, run};
use crate::refusals::hello;
use clutch_wire::{
    Actuate, Arm, Armed, Configure, Configured, Decoder, Discover, Hello, Message, Pong, SCHEMA, Sample,
    VERSION, encode,
};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;
use std::time::{Duration, Instant};

const CONFIGURE: Configure = Configure {
    run: 1,
    config: 7,
    period_us: 1000,
    watchdog_us: 3000,
    safe_kind: 0,
    hold_code: 2000,
    release_code: 0,
    ramp_step: 0,
    hold_periods: 0,
};

fn frames(messages: &[Message]) -> Vec<u8> {
    messages.iter().flat_map(|m| encode(m).as_bytes().to_vec()).collect()
}

/// Everything that a sender knows who cannot hear the board.
fn blind(boot: u32) -> Vec<u8> {
    let mut messages = vec![
        Message::Discover(Discover { nonce: 1, version: VERSION, schema: SCHEMA }),
        Message::Configure(CONFIGURE),
        Message::Arm(Arm { run: 1, config: 7, boot }),
    ];
    messages.extend(
        (0..8).map(|sequence| Message::Actuate(Actuate { run: 1, sequence, code: 0, valid_us: u16::MAX })),
    );
    frames(&messages)
}

fn connected(board: &Board) -> TcpStream {
    TcpStream::connect(board.port.trim_start_matches("tcp://")).expect("the board listens")
}

fn on_tcp() -> Board {
    Board::start(&["board_smc_2", "--listen", "tcp://127.0.0.1:0"])
}

#[test]
fn a_page_that_posts_frames_is_sent_away() {
    let _alone = alone();
    let board = on_tcp();
    let mut page = connected(&board);
    let body = [&[0][..], &blind(0)].concat();
    let head = format!("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: {}\r\n\r\n", body.len());
    page.write_all(&[head.as_bytes(), &body].concat()).unwrap();
    let _ = board.wait_for(0, "client sent away: its first bytes were no frame");
    let _ = board.wait_for(0, "client left");
    std::thread::sleep(Duration::from_millis(200));
    let said = board.end();
    assert!(!said.contains("Ready") && !said.contains("Armed"), "{said}");
}

#[test]
fn frames_alone_do_not_arm_without_the_number_of_the_hello() {
    let _alone = alone();
    let board = on_tcp();
    let mut random = Random(11);
    for boot in [0, 1, random.next() as u32] {
        let from = board.heard();
        let mut blind_sender = connected(&board);
        blind_sender.write_all(&blind(boot)).unwrap();
        let _ = board.wait_for(0, "Ready");
        std::thread::sleep(Duration::from_millis(100));
        drop(blind_sender);
        let _ = board.wait_for(from, "client left");
    }
    // With it they do: what is refused is the number, and nothing else.
    let mut hearing = connected(&board);
    hearing.write_all(&blind(0)).unwrap();
    let boot = heard(&mut hearing, |m| match m {
        Message::Hello(Hello { boot, .. }) => Some(*boot),
        _ => None,
    });
    hearing.write_all(&frames(&[Message::Arm(Arm { run: 1, config: 7, boot })])).unwrap();
    let _ = board.wait_for(0, "Armed");
    drop(hearing);
    let said = board.end();
    assert_eq!(said.matches("Armed").count(), 1, "{said}");
}

fn heard<R>(line: &mut TcpStream, answer: impl Fn(&Message) -> Option<R>) -> R {
    let (mut decoder, mut byte) = (Decoder::new(), [0]);
    line.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    loop {
        line.read_exact(&mut byte).expect("the board answers");
        if let Some(Ok(message)) = decoder.push(byte[0])
            && let Some(found) = answer(&message)
        {
            return found;
        }
    }
}

#[test]
fn a_client_that_says_nothing_makes_room_after_ten_seconds() {
    let _alone = alone();
    let board = Board::start(&["board_smc_2", "--patient", "--listen", "tcp://127.0.0.1:0"]);
    let _idle = connected(&board);
    let _ = board.wait_for(0, "client connected");
    let came = Instant::now();
    let args =
        ["loop", "board_smc_2", "--duration=0.3", "--set=run.settle_s=0", "--patient", "--port", &board.port];
    let _ = run(&args).expect(1).says(&["in use by another program"]);
    std::thread::sleep(Duration::from_millis(10_300).saturating_sub(came.elapsed()));
    let _ = run(&args).expect(0).prints(&["the path is done"]);
}

#[test]
fn a_unix_socket_is_for_its_user_alone_and_goes_with_the_board() {
    let _alone = alone();
    let path = folder("unix").join("board.sock");
    let listen = format!("unix://{}", path.display());
    let board = Board::start(&["board_smc_2", "--patient", "--listen", &listen]);
    assert_eq!(board.port, listen);
    assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
    let args =
        ["loop", "board_smc_2", "--duration=0.3", "--set=run.settle_s=0", "--patient", "--port", &listen];
    let _ = run(&args).expect(0).prints(&["the path is done"]);
    // A second board does not take the place of one that listens.
    let _ = run(&["daq", "board_smc_2", "--listen", &listen]).expect(1).says(&[&listen, "in use"]);
    let _ = board.end();
    assert!(!path.exists());
    // One that was killed leaves its file behind, which gives way.
    let mut killed = Board::start(&["board_smc_2", "--listen", &listen]);
    killed.kill();
    assert!(path.exists());
    let _ = Board::start(&["board_smc_2", "--listen", &listen]).end();
}

/// A device that answers each message with these.
fn answering(mut answer: impl FnMut(&Message) -> Vec<Message> + Send + 'static) -> Device {
    let mut decoder = Decoder::new();
    Device::start(move |bytes| {
        let heard = bytes.iter().filter_map(|b| decoder.push(*b)).filter_map(Result::ok);
        frames(&heard.flat_map(|message| answer(&message)).collect::<Vec<_>>())
    })
}

#[test]
fn a_board_that_was_reset_before_it_was_configured_is_refused() {
    let _guard = beside_others();
    let device = answering(|message| match message {
        Message::Discover(m) => vec![Message::Hello(Hello { boot: 5, ..hello(m) })],
        Message::Configure(m) => {
            vec![Message::Configured(Configured { run: m.run, config: m.config, boot: 6 })]
        }
        _ => Vec::new(),
    });
    let done = run(&["loop", "board_smc_2", "--port", device.port()]).expect(1);
    let _ = done.says(&[device.port(), "the board was reset since it said who it is", "00000006"]);
}

#[test]
fn a_board_that_its_watchdog_has_reset_is_announced_so() {
    let _guard = beside_others();
    let device = answering(|message| match message {
        Message::Discover(m) => {
            vec![Message::Hello(Hello { board: 42, started_by: 3, warnings: 1, ..hello(m) })]
        }
        _ => Vec::new(),
    });
    // It does not go on from there, since nothing answers; the plan is printed before.
    let done = run(&["loop", "board_smc_2", "--port", device.port()]).expect(1);
    let _ = done.prints(&[
        "number 0000002a, started by its watchdog",
        "note: the board was reset by its watchdog, since its program had hung",
        "note: the board's brown-out level is lower",
    ]);
}

#[test]
fn a_board_gets_no_patience_for_its_serial_number() {
    let _alone = alone();
    // Its clock is right, and it falls silent with the first sample after consent.
    let (mut since, mut taken) = (Instant::now(), 0_u16);
    let device = answering(move |message| {
        let sample = |run, sequence, status| {
            Message::Sample(Sample { run, sequence, time_us: 1000 * u32::from(sequence), counts: 0, status })
        };
        match message {
            Message::Discover(m) => vec![Message::Hello(Hello { board: 0, boot_code: 2970, ..hello(m) })],
            Message::Configure(m) => {
                (since, taken) = (Instant::now(), 1);
                vec![
                    Message::Configured(Configured { run: m.run, config: m.config, boot: 1 }),
                    sample(m.run, 0, 1),
                ]
            }
            Message::Ping(m) => {
                let time_us = since.elapsed().as_micros() as u32;
                let before = std::mem::replace(&mut taken, (time_us / 1000) as u16 + 1);
                let pong = Message::Pong(Pong { run: m.run, nonce: m.nonce, time_us });
                (before..taken).map(|n| sample(m.run, n, 1)).chain([pong]).collect()
            }
            Message::Arm(m) => {
                vec![Message::Armed(Armed { run: m.run, config: m.config }), sample(m.run, taken, 2)]
            }
            _ => Vec::new(),
        }
    });
    let begun = Instant::now();
    let loop_on_it = ["loop", "board_smc_2", "--port", device.port()];
    let _ = run(&loop_on_it).expect(3).prints(&["the board fell silent"]);
    assert!(begun.elapsed() < Duration::from_secs(4), "{:?}", begun.elapsed());
    // On request it does.
    let begun = Instant::now();
    let _ = run(&[&loop_on_it[..], &["--patient"]].concat()).expect(3).prints(&["the board fell silent"]);
    assert!(begun.elapsed() > Duration::from_secs(5), "{:?}", begun.elapsed());
    // And of a board that keeps real time it cannot be asked.
    let strict = Board::start(&["board_smc_2"]);
    let done = run(&["loop", "board_smc_2", "--patient", "--port", &strict.port]).expect(1);
    let _ = done.says(&["its clock waits for nobody"]);
}
