//! The board in C as a process on a pseudo-terminal, by a clock that waits for a busy machine.

#![cfg(target_os = "linux")]

use super::compiled;
use clutch_wire::{
    Actuate, Arm, BoardFault, BoardState, Configure, Decoder, Discover, Fault, Hello, Message, SCHEMA,
    Sample, Stop, VERSION, encode,
};
use std::fs::{File, OpenOptions};
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Ends the board with the test, even if the test fails.
struct Board(Child);

impl Drop for Board {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

struct Line {
    line: File,
    messages: Receiver<Message>,
}

impl Line {
    fn send(&mut self, message: &Message) {
        self.line.write_all(encode(message).as_bytes()).expect("the line takes a frame");
    }

    /// The next message that `wanted` takes; others are passed over.
    fn wait<T>(&self, what: &str, wanted: impl Fn(&Message) -> Option<T>) -> T {
        let end = Instant::now() + Duration::from_secs(10);
        while let Some(rest) = end.checked_duration_since(Instant::now()) {
            let message = self.messages.recv_timeout(rest).unwrap_or_else(|e| panic!("{what}: {e}"));
            if let Some(found) = wanted(&message) {
                return found;
            }
        }
        panic!("{what}: not within 10 s");
    }

    fn sample(&self) -> Sample {
        self.wait("Sample", |m| if let Message::Sample(s) = m { Some(*s) } else { None })
    }

    /// Answers samples with `code` for `periods`; gives the counts of the last one.
    fn drive(&mut self, run: u16, code: u16, periods: u32) -> i32 {
        let mut counts = 0;
        for _ in 0..periods {
            let sample = self.sample();
            assert_eq!(sample.run, run);
            assert!(sample.status & 0x07 != BoardState::Faulted as u8, "the board has given up: {sample:?}");
            counts = sample.counts;
            let sequence = sample.sequence;
            self.send(&Message::Actuate(Actuate { run, sequence, code, valid_us: u16::MAX }));
        }
        counts
    }
}

const OPEN: u16 = 2048; // 0 V
const HOLD: u16 = 2970; // 4.5 V
const WATCHDOG_US: u32 = 200_000;
/// Time for which the board's clock waits for this process, which shares the machine with other tests. A host that is silent
/// for longer is silent.
const PATIENCE_S: &str = "2";

fn configure(run: u16) -> Configure {
    Configure {
        run,
        config: 77,
        period_us: 2000,
        watchdog_us: WATCHDOG_US,
        safe_kind: 0,
        hold_code: HOLD,
        release_code: OPEN,
        ramp_step: 0,
        hold_periods: 0,
    }
}

#[test]
fn the_board_in_c_runs_on_a_pseudo_terminal_and_holds_when_the_host_falls_silent() {
    let sources = ["examples/board-c/board.c", "examples/board-c/host_main.c"];
    let Some(program) = compiled("board_c_host", &sources) else { return };
    let mut child = Command::new(program)
        .args(["60", PATIENCE_S])
        .stdout(Stdio::piped())
        .spawn()
        .expect("the board starts");
    let mut path = String::new();
    BufReader::new(child.stdout.take().expect("it has an output")).read_line(&mut path).expect("a path");
    let board = Board(child);
    let line = OpenOptions::new().read(true).write(true).open(path.trim()).expect("the line opens");
    let mut reader = line.try_clone().expect("a second handle");
    let (sender, messages) = channel();
    std::thread::spawn(move || {
        let mut decoder = Decoder::new();
        let mut bytes = [0; 256];
        // Ends with the line, or with the test.
        while let Ok(count @ 1..) = reader.read(&mut bytes) {
            for message in bytes[..count].iter().filter_map(|byte| decoder.push(*byte)) {
                if sender.send(message.expect("whole frames")).is_err() {
                    return;
                }
            }
        }
    });
    let mut line = Line { line, messages };

    line.line.write_all(&[0]).expect("the line takes a byte");
    line.send(&Message::Discover(Discover { nonce: 5, version: VERSION, schema: SCHEMA }));
    let hello: Hello = line.wait("Hello", |m| if let Message::Hello(h) = m { Some(*h) } else { None });
    assert_eq!((hello.nonce, hello.state, hello.boot_code), (5, BoardState::Boot as u8, HOLD));
    assert_eq!((hello.counts_per_rev, hello.dac_bits), (20_000, 12));

    // At power-up the brake holds.
    line.send(&Message::Configure(configure(1)));
    line.wait("Configured", |m| matches!(m, Message::Configured(c) if c.run == 1).then_some(()));
    assert_eq!((line.sample().counts, line.sample().counts), (0, 0));

    // Open: the weight sinks, and the counts grow. 100 ms of free fall are 0.13 rad: 430 counts.
    line.send(&Message::Arm(Arm { run: 1, config: 77, boot: hello.boot }));
    line.wait("Armed", |m| matches!(m, Message::Armed(a) if a.run == 1).then_some(()));
    let fallen = line.drive(1, OPEN, 50);
    assert!(fallen > 200, "{fallen} counts: the weight does not sink");
    // Held: at 4.5 V it stops within the next 200 ms, and stays there.
    let held = line.drive(1, HOLD, 100);
    let later = line.drive(1, HOLD, 50);
    assert_eq!(held, later, "the brake does not hold");

    // Open, then silent: the watchdog.
    line.drive(1, OPEN, 5);
    let fault: Fault = line.wait("Fault", |m| if let Message::Fault(f) = m { Some(*f) } else { None });
    assert_eq!((fault.run, fault.cause), (1, BoardFault::Watchdog as u8));
    assert!(fault.value >= WATCHDOG_US, "{fault:?}");
    let stopping = line.sample();
    assert_eq!(stopping.status & 0x07, BoardState::Faulted as u8, "samples go on after a fault");
    // After 0.2 s of free fall it has 5.5 rad/s; 4.5 V take 28 rad/s² from that. 1 s by the board's clock.
    for _ in 0..500 {
        line.sample();
    }
    let (one, two) = (line.sample(), line.sample());
    assert_eq!(one.counts, two.counts, "the safe output holds the shaft");

    // A new run after the fault, and its end.
    line.send(&Message::Configure(configure(2)));
    line.wait("Configured", |m| matches!(m, Message::Configured(c) if c.run == 2).then_some(()));
    line.send(&Message::Stop(Stop { run: 2, reason: 0 }));
    line.wait("Stopped", |m| matches!(m, Message::Stopped(s) if s.code == HOLD).then_some(()));
    drop(board);
}
