//! The views that the command has only where it is built with them: a terminal's scope, and Foxglove.
#![cfg(target_os = "linux")]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Longest time of anything here.
const LONG: Duration = Duration::from_secs(60);

/// A program that is ended with its test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill(); // most have ended
        let _ = self.0.wait();
    }
}

impl Running {
    fn start(command: &mut Command) -> std::io::Result<Running> {
        Ok(Running(command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?))
    }

    /// Its exit code.
    fn end(&mut self) -> Option<i32> {
        let begun = Instant::now();
        while begun.elapsed() < LONG {
            if let Some(status) = self.0.try_wait().expect("a child of this process") {
                return status.code();
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        panic!("it goes on after {LONG:?}");
    }
}

/// Text that is read, as it comes.
fn reading(mut from: impl Read + Send + 'static) -> Receiver<Vec<u8>> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let mut bytes = [0; 4096];
        while let Ok(n @ 1..) = from.read(&mut bytes) {
            let _ = sender.send(bytes[..n].to_vec()); // the test has failed
        }
    });
    receiver
}

/// All that was read until it has these words.
fn until(words: &str, so_far: &mut String, read: &Receiver<Vec<u8>>) {
    let begun = Instant::now();
    while !so_far.contains(words) {
        let more = read.recv_timeout(LONG.saturating_sub(begun.elapsed()));
        let more = more.unwrap_or_else(|_| panic!("no {words:?} in {so_far:?}"));
        *so_far += &String::from_utf8_lossy(&more);
    }
}

#[test]
fn the_scope_draws_a_loop_and_its_key_stops_it_as_an_operator_does() {
    // The terminal that `script` makes has no size of its own here.
    let line = format!(
        "stty cols 100 rows 30; exec '{}' loop board_smc_2 --duration 120 --scope",
        env!("CARGO_BIN_EXE_clutch")
    );
    let mut script = Command::new("script");
    script.args(["-qec", &line, "/dev/null"]).env("TERM", "xterm-256color");
    let Ok(mut script) = Running::start(&mut script) else {
        eprintln!("skipped: no program `script`");
        return;
    };
    let screen = reading(script.0.stdout.take().expect("a pipe"));
    let mut keys = script.0.stdin.take().expect("a pipe");
    let mut drawn = String::new();
    // The other screen, then the run on it.
    until("\u{1b}[?1049h", &mut drawn, &screen);
    until("Running", &mut drawn, &screen);
    keys.write_all(b"q").expect("a terminal");
    assert_eq!(script.end(), Some(4), "{drawn:?}");
    until("\u{1b}[?1049l", &mut drawn, &screen);
    let (_, after) = drawn.split_once("\u{1b}[?1049l").expect("the first screen again");
    let mut after = after.to_owned();
    until("stopped by", &mut after, &screen);
    assert!(after.contains("samples received"), "{after:?}");
}

/// The head of an answer to a request for a socket, and the bytes behind it.
fn asked(address: &str, token: &str) -> (String, BufReader<TcpStream>) {
    let mut stream = TcpStream::connect(address).expect("a port of this machine");
    stream.set_read_timeout(Some(LONG)).expect("a time");
    // Key and answer of RFC 6455.
    let request = format!(
        "GET /?token={token} HTTP/1.1\r\nHost: {address}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\
         Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
    );
    stream.write_all(request.as_bytes()).expect("a request");
    let mut reader = BufReader::new(stream);
    let mut head = String::new();
    while !head.ends_with("\r\n\r\n") && reader.read_line(&mut head).expect("an answer") > 0 {}
    (head, reader)
}

#[test]
fn foxglove_is_answered_by_its_protocol_and_a_signal_stops_the_loop() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_clutch"));
    command.args(["loop", "board_smc_2", "--duration", "120", "--foxglove=0"]);
    let mut running = Running::start(&mut command).expect("the command starts");
    let said = reading(running.0.stderr.take().expect("a pipe"));
    let mut told = String::new();
    until("ws://", &mut told, &said);
    until("\n", &mut told, &said);
    let (_, address) = told.split_once("ws://").expect("it was there");
    let (address, token) = address.trim().split_once("/?token=").expect("an address with its token");
    let token = token.lines().next().expect("a token");

    let (head, mut frames) = asked(address, token);
    assert!(head.starts_with("HTTP/1.1 101"), "{head}");
    let header = |name: &str| {
        let fields = head.lines().filter_map(|line| line.split_once(": "));
        fields.filter(|(field, _)| field.eq_ignore_ascii_case(name)).map(|(_, value)| value).next()
    };
    assert_eq!(header("Sec-WebSocket-Accept"), Some("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="), "{head}");
    assert_eq!(header("Sec-WebSocket-Protocol"), Some("foxglove.sdk.v1"), "{head}");
    // A text of 126 to 65535 bytes, or of fewer, in one frame.
    let mut start = [0; 2];
    frames.read_exact(&mut start).expect("a frame");
    assert_eq!(start[0], 0x81);
    let mut length = usize::from(start[1]);
    if length == 126 {
        let mut long = [0; 2];
        frames.read_exact(&mut long).expect("a length");
        length = usize::from(u16::from_be_bytes(long));
    }
    let mut info = vec![0; length];
    frames.read_exact(&mut info).expect("a text");
    let info: serde_json::Value = serde_json::from_slice(&info).expect("JSON");
    assert_eq!(info["op"], "serverInfo", "{info}");

    let (head, _) = asked(address, "0");
    assert!(head.starts_with("HTTP/1.1 401"), "{head}");

    let pid = running.0.id().to_string();
    assert!(Command::new("kill").args(["-INT", &pid]).status().expect("the program kill").success());
    assert_eq!(running.end(), Some(4), "{told}");
}
