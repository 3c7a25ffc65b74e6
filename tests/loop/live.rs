//! The live view, by a client that reads the protocol from a socket.

use crate::harness::{alone, beside_others, folder, program, read_log, replays_identically};
use clutch_tests::firmware::image;
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// A command with `--live`, and where its view is.
struct Viewed {
    child: Child,
    /// Its output, on standard output and, after the view's address, on standard error.
    printed: [std::thread::JoinHandle<String>; 2],
    host: String,
    query: String,
}

impl Viewed {
    fn start(args: &[&str]) -> Viewed {
        let mut command = Command::new(program());
        command.args(args).arg("--live").stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the command starts");
        let mut err = BufReader::new(child.stderr.take().expect("piped"));
        let mut line = String::new();
        while !line.contains("http://") {
            line.clear();
            assert!(err.read_line(&mut line).expect("text") > 0, "the command ended before its view began");
        }
        let (host, query) = line.trim().split_once("http://").unwrap().1.split_once("/?").unwrap();
        let (host, query) = (host.to_owned(), query.to_owned());
        let out = child.stdout.take().expect("piped");
        let printed = [read_to_end(out), read_to_end(err)];
        Viewed { child, printed, host, query }
    }

    /// A request; the connection, of which nothing has been read.
    fn ask(&self, method: &str, target: &str, headers: &str) -> BufReader<TcpStream> {
        let mut stream = TcpStream::connect(&self.host).expect("the view is served");
        stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
        write!(stream, "{method} {target} HTTP/1.1\r\nHost: {}\r\n{headers}\r\n", self.host).unwrap();
        BufReader::new(stream)
    }

    /// A request's status, and what came with it.
    fn answer(&self, method: &str, target: &str, headers: &str) -> (u16, String) {
        let mut text = String::new();
        self.ask(method, target, headers).read_to_string(&mut text).expect("an answer");
        let status = text.split(' ').nth(1).and_then(|s| s.parse().ok()).expect("a status");
        (status, text.split_once("\r\n\r\n").expect("a body").1.to_owned())
    }

    fn post(&self, what: &str) -> (u16, String) {
        let (path, more) = what.split_once('?').unwrap_or((what, ""));
        self.answer("POST", &format!("{path}?{}&{more}", self.query), "")
    }

    fn events(&self) -> Events {
        let mut lines = self.ask("GET", &format!("/events?{}", self.query), "").lines();
        while lines.next().expect("a head").unwrap() != "" {}
        Events { lines }
    }

    fn done(mut self) -> (Option<i32>, String) {
        let code = self.child.wait().expect("a child").code();
        (code, self.printed.map(|text| text.join().unwrap()).concat())
    }
}

fn read_to_end(mut pipe: impl Read + Send + 'static) -> std::thread::JoinHandle<String> {
    std::thread::spawn(move || {
        let mut text = String::new();
        let _ = pipe.read_to_string(&mut text);
        text
    })
}

/// Server-Sent Events.
struct Events {
    lines: std::io::Lines<BufReader<TcpStream>>,
}

impl Iterator for Events {
    type Item = (String, Value);

    fn next(&mut self) -> Option<(String, Value)> {
        let mut kind = String::new();
        loop {
            let line = self.lines.next()?.ok()?;
            if let Some(name) = line.strip_prefix("event: ") {
                kind = name.to_owned();
            } else if let Some(data) = line.strip_prefix("data: ") {
                return Some((kind, serde_json::from_str(data).expect("JSON")));
            }
        }
    }
}

/// The values of a field in all frames, in their order.
fn column(frames: &[Value], pointer: &str) -> Vec<f64> {
    let list = |f: &Value| f.pointer(pointer).and_then(Value::as_array).cloned().unwrap_or_default();
    frames.iter().flat_map(list).filter_map(|v| v.as_f64()).collect()
}

#[test]
fn a_page_sees_the_run_from_its_beginning_to_its_end() {
    let _alone = alone();
    let log = folder("live").join("run.mcap");
    let viewed = Viewed::start(&["loop", "--duration", "2", "--log", log.to_str().unwrap()]);
    let all: Vec<(String, Value)> = viewed.events().collect();
    assert_eq!(viewed.done().0, Some(0));
    assert_eq!(all[0].0, "run");
    assert_eq!(all[0].1["duration_s"], 2.0);
    assert_eq!(all[0].1["gains"], Value::Array(Vec::new()), "the scenario allows no change");
    assert_eq!(all.last().unwrap().0, "end");
    let frames: Vec<Value> = all.iter().filter(|(kind, _)| kind == "frame").map(|(_, f)| f.clone()).collect();
    assert!(frames.len() > 40, "{} frames in 2 s", frames.len());
    let said: Vec<&str> = all.iter().filter_map(|(_, v)| v.get("text")?.as_str()).collect();
    assert_eq!(said, ["armed → running", "running → holding: the path is done"]);

    // Each sample of the log is a point of the curves, with its values.
    let read = read_log(&log);
    let law: Vec<_> = read.commands.iter().filter(|c| c.source == 0).collect();
    let volts = column(&frames, "/volts/low");
    assert_eq!(volts.len(), read.commands.len());
    assert_eq!(volts, column(&frames, "/volts/high"), "at 1 kHz each point is one sample");
    assert!(read.commands.iter().zip(&volts).all(|(c, v)| (c.voltage - v).abs() < 1e-4));
    let errors = column(&frames, "/error_deg/low");
    assert_eq!(errors.len(), law.len());
    assert!(law.iter().zip(&errors).all(|(c, e)| (c.error.to_degrees() - e).abs() < 1e-6));
    // The encoder's position is the path's less the error.
    let positions = column(&frames, "/position_deg/low");
    let by_law = read.commands.iter().zip(&positions).filter(|(c, _)| c.source == 0);
    let apart = by_law.map(|(c, p)| (c.target_position - c.error).to_degrees() - p);
    assert!(apart.map(f64::abs).fold(0.0, f64::max) < 1e-5);
    // So is the one in the log.
    let answered = read.samples.iter().zip(&read.commands).filter(|(_, c)| c.source == 0);
    let apart = answered.map(|(s, c)| (c.target_position - c.error - s.position).abs());
    assert!(apart.fold(0.0, f64::max) < 1e-12);
    assert!(read.samples.iter().any(|s| s.position > 0.01));
    let cycles = frames.last().unwrap()["cycles"].as_u64().unwrap();
    assert!((10..200).contains(&cycles), "{cycles} sticks in 2 s");
}

#[test]
fn the_button_is_the_operators_stop() {
    let _alone = alone();
    let viewed = Viewed::start(&["loop", "--duration", "60"]);
    let running = viewed.events().any(|(kind, f)| kind == "frame" && f["state"] == "Running");
    assert!(running);
    assert_eq!(viewed.post("/stop").0, 200);
    let (code, out) = viewed.done();
    assert_eq!(code, Some(4));
    assert!(out.contains("stopped by the operator; the board is in its safe state"), "{out}");

    let viewed = Viewed::start(&["sim", "pd_2", "--set", "run.duration_s=60"]);
    assert!(viewed.events().any(|(kind, _)| kind == "frame"));
    assert_eq!(viewed.post("/stop").0, 200);
    assert_eq!(viewed.done().0, Some(4), "a simulation that is played is stopped as a loop is");
}

#[test]
fn a_foreign_page_a_foreign_name_and_one_without_the_token_get_nothing() {
    let _beside = beside_others();
    let viewed = Viewed::start(&["sim", "pd_2", "--set", "run.duration_s=2"]);
    for target in ["/", "/events", "/stop"] {
        let of_us = format!("{target}?{}", viewed.query);
        let method = if target == "/stop" { "POST" } else { "GET" };
        assert_eq!(viewed.answer(method, target, "").0, 401, "{target}");
        assert_eq!(viewed.answer(method, &format!("{target}?token=0"), "").0, 401, "{target}");
        assert_eq!(viewed.answer(method, &of_us, "Origin: http://foreign.example\r\n").0, 403, "{target}");
        assert_eq!(viewed.answer(method, &of_us, "Host: foreign.example\r\n").0, 421, "{target}");
    }
    let (status, page) = viewed.answer("GET", &format!("/?{}", viewed.query), "");
    assert_eq!(status, 200);
    assert!(page.contains("<canvas"));
    let outside = page.split("http").skip(1).find(|rest| rest.starts_with("://") || rest.starts_with("s://"));
    assert_eq!(outside, None, "the page needs nothing but itself");
    // It has waited for a page; now it plays.
    let last = viewed.events().filter(|(kind, _)| kind == "frame").last().expect("frames");
    assert_eq!(last.1["tick"], 1999);
    assert_eq!(viewed.done().0, Some(0));
}

#[test]
fn a_gain_that_is_certified_comes_into_force_is_logged_and_is_replayed() {
    let _alone = alone();
    let log = folder("live-gains").join("run.mcap");
    let path = log.to_str().unwrap();
    let viewed =
        Viewed::start(&["loop", "--duration", "60", "--log", path, "--set", "safety.live_gains=true"]);
    let mut events = viewed.events();
    let (_, run) = events.next().unwrap();
    assert_eq!(run["gains"][0]["key"], "law.smc.kp_v");
    assert_eq!(run["gains"][0]["value"], 3.0);
    for (asked, says) in [
        ("law.smc.kp_v&value=x", "law.smc.kp_v = x: expected a number"),
        ("law.smc.kp_v&value=-1", "law.smc.kp_v = -1: expected a finite number of at least 0"),
        ("law.smc.kp_v&value=NaN", "law.smc.kp_v"),
        ("law.smc.kp_v&value=400", "not certified as sampled"),
        ("law.pd.kp_v_rad&value=40", "expected a gain of the law that runs: law.smc.kp_v, "),
        ("safety.reason&value=1", "expected a gain of the law that runs"),
    ] {
        let (status, text) = viewed.post(&format!("/set?key={asked}"));
        assert_eq!(status, 409, "{asked}: {text}");
        assert!(text.contains(says), "{asked}: {text}");
    }
    let (status, verdict) = viewed.post("/set?key=law.smc.kp_v&value=4");
    assert_eq!(status, 200, "{verdict}");
    assert!(verdict.starts_with("certified as sampled: |e| stays below 0."), "{verdict}");
    let told = events.find(|(kind, note)| kind == "note" && !note["gain"].is_null()).unwrap().1;
    assert_eq!(told["gain"], serde_json::json!(["law.smc.kp_v", 4.0]));
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(viewed.post("/stop").0, 200);
    let (code, out) = viewed.done();
    assert_eq!(code, Some(4));
    assert!(out.contains("gains were changed once while it ran"), "{out}");

    let read = read_log(&log);
    let [change] = read.changes[..] else { panic!("{:?}", read.changes) };
    assert_eq!(read.header.parameters[usize::from(change.parameter)].0, "law.smc.kp_v");
    let from = read.commands.iter().position(|c| c.tick == change.tick).expect("its tick is in the log");
    // K_p alone decides the voltage far from the surface.
    let highest =
        |commands: &[clutch_log::CommandRecord]| commands.iter().map(|c| c.demand).fold(0.0, f64::max);
    assert!(highest(&read.commands[..from]) != highest(&read.commands[from..]));
    replays_identically(&log);
    forgotten(&log);
}

#[test]
fn changes_one_after_the_other_certified_or_not_are_replayed() {
    let _alone = alone();
    let log = folder("live-two-gains").join("run.mcap");
    let allowed = ["--set", "safety.live_gains=true", "--uncertified"];
    let begin = ["loop", "--duration", "60", "--log", log.to_str().unwrap()];
    let viewed = Viewed::start(&[&begin[..], &allowed].concat());
    let mut events = viewed.events();
    assert_eq!(events.next().unwrap().0, "run");
    for (change, verdict) in [
        ("law.smc.kp_v&value=4", "certified as sampled: "),
        ("law.smc.kp_v&value=400", "UNCERTIFIED, as asked: "),
        ("law.smc.kd_v_s_rad&value=390", "UNCERTIFIED, as asked: "),
    ] {
        let (status, text) = viewed.post(&format!("/set?key={change}"));
        assert_eq!(status, 200, "{change}: {text}");
        assert!(text.starts_with(verdict), "{change}: {text}");
        assert!(events.any(|(kind, note)| kind == "note" && !note["gain"].is_null()), "{change} is in force");
        std::thread::sleep(Duration::from_millis(200));
    }
    assert_eq!(viewed.post("/stop").0, 200);
    let (code, out) = viewed.done();
    assert_eq!(code, Some(4), "{out}");
    assert!(out.contains("gains were changed 3 times while it ran"), "{out}");
    let changes = read_log(&log).changes;
    let bounded: Vec<bool> = changes.iter().map(|change| change.error_bound.is_finite()).collect();
    assert_eq!(bounded, [true, false, false]);
    replays_identically(&log);
}

/// Without its change the log does not replay: the change is what explains it.
fn forgotten(log: &Path) {
    let without = log.with_file_name("without.mcap");
    let mut read = read_log(log);
    read.changes.clear();
    let mut writer = clutch_log::LogWriter::create(&without, &read.header).unwrap();
    for (sample, command) in read.samples.iter().zip(&read.commands) {
        writer.write(&clutch_log::Record::Sample(*sample)).unwrap();
        writer.write(&clutch_log::Record::Command(*command)).unwrap();
    }
    for event in &read.events {
        writer.write(&clutch_log::Record::Event(*event)).unwrap();
    }
    writer.finish().unwrap();
    let done = crate::harness::run(&["replay", without.to_str().unwrap()]);
    assert_eq!(done.code, Some(3), "{}", done.out);
}

#[test]
fn an_image_on_its_emulated_board_is_seen_as_its_log_has_it() {
    let Some(image) = image("mps2-controller") else { return };
    let _beside = beside_others();
    let log = folder("live-hil").join("run.mcap");
    let (image, path) = (image.to_str().unwrap(), log.to_str().unwrap());
    let hil = ["hil", "board_smc_2", "--image", image, "--set", "run.duration_s=2", "--log", path];
    let viewed = Viewed::start(&hil);
    let begun = std::time::Instant::now();
    let all: Vec<(String, Value)> = viewed.events().collect();
    assert_eq!(viewed.done().0, Some(0));
    assert!(begun.elapsed() > Duration::from_millis(1900), "no faster than a clock");
    assert_eq!((all[0].0.as_str(), all.last().unwrap().0.as_str()), ("run", "end"));
    let frames: Vec<Value> = all.iter().filter(|(kind, _)| kind == "frame").map(|(_, f)| f.clone()).collect();
    let volts = column(&frames, "/volts/low");
    let read = read_log(&log);
    assert_eq!(volts.len(), read.commands.len());
    assert!(read.commands.iter().zip(&volts).all(|(c, v)| (c.voltage - v).abs() < 1e-4));
    replays_identically(&log);
}

#[test]
fn runs_in_computed_time_hear_the_button() {
    let Some(image) = image("mps2-controller") else { return };
    let _beside = beside_others();
    let hil = ["hil", "board_smc_2", "--image", image.to_str().unwrap(), "--set", "run.duration_s=60"];
    let folder = folder("live-identify");
    let identify = ["identify", "--log", folder.to_str().unwrap()];
    for args in [&hil[..], &identify] {
        let viewed = Viewed::start(args);
        let mut events = viewed.events();
        assert!(events.any(|(kind, f)| kind == "frame" && f["state"] == "Running"), "{args:?}");
        let begun = std::time::Instant::now();
        assert_eq!(viewed.post("/stop").0, 200);
        let (ended, out) = viewed.done();
        assert!(begun.elapsed() < Duration::from_secs(10), "{args:?}");
        assert_eq!(ended, Some(4), "{args:?}: {out}");
        assert!(out.contains("stopped by the operator") && !out.contains("FAULT"), "{args:?}: {out}");
    }
    // The part that was stopped is kept.
    replays_identically(&folder.join("releases.mcap"));
}
