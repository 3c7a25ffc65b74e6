//! `clutch loop --board`: the emulated board in real time, on its serial lines over TCP, with the simulated
//! board as its encoder and converter.

use crate::{alone, clutch, scratch, shown};
use clutch_tests::command;
use clutch_tests::firmware::image;
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

/// A process that ends with the test.
struct Beside(Child);

impl Drop for Beside {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The simulated board on a TCP address.
fn rig() -> (Beside, String) {
    let mut child = Command::new(command())
        .args(["daq", "board_smc_2", "--patient", "--listen", "tcp://127.0.0.1:0"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let mut line = String::new();
    let out = child.stdout.take().expect("piped");
    BufReader::new(out).read_line(&mut line).expect("its address");
    (Beside(child), line.trim().trim_start_matches("tcp://").to_owned())
}

/// The emulated board, its host's line on a TCP address; without a rig its other line is open.
fn board(image: &PathBuf, rig: Option<&str>) -> (Beside, String) {
    let port = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a port").port();
    let address = format!("127.0.0.1:{port}");
    let rig = rig.map_or("null".to_owned(), |rig| format!("tcp:{rig},nodelay=on"));
    let folder = scratch("board");
    std::fs::create_dir_all(&folder).expect("a folder");
    let child = Command::new("qemu-system-arm")
        .args(["-machine", "mps2-an386", "-display", "none", "-monitor", "none", "-serial"])
        .arg(format!("tcp:{address},server=on,wait=off,nodelay=on"))
        .args(["-serial", &rig, "-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(image)
        .current_dir(folder)
        .stdin(Stdio::null())
        .spawn()
        .expect("the emulator starts");
    let end = std::time::Instant::now() + std::time::Duration::from_secs(20);
    // It listens before it runs; one connection after the other is served.
    while std::net::TcpStream::connect(&address).is_err() {
        assert!(std::time::Instant::now() < end, "the emulator does not listen");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    (Beside(child), format!("tcp://{address}"))
}

#[test]
fn a_board_that_closes_the_loop_is_set_up_armed_logged_and_stopped_over_a_line() {
    let Some(image) = image("mps2-controller") else { return };
    command();
    let _alone = alone();
    let (_rig, rig) = rig();
    let (_board, address) = board(&image, Some(&rig));
    let log = scratch("serial.mcap");
    let log = log.to_str().expect("a path");
    // A slow machine's late answers are not the subject. The emulator takes tens of microseconds for a byte:
    // at 1 kHz a slow machine would get ever later samples while the board is at rest and nothing waits for it. At 4 ms the
    // gains are no stable loop any more.
    let slow = [
        "--patient",
        "--uncertified",
        "--set",
        "safety.limits.deadline_us=1000000",
        "--set",
        "sampling.period_us=4000",
    ];
    let looped = |rest: &[&str]| {
        clutch(&[&["loop", "board_smc_2", "--board", &address, "--json"][..], &slow, rest].concat())
    };
    let done = looped(&["--duration", "3", "--log", log]);
    assert_eq!(done.status.code(), Some(0), "{}", shown(&done));
    let report: Value = serde_json::from_slice(&done.stdout).expect("JSON");
    assert_eq!(report["state"], "Holding", "{report}");
    assert_eq!(report["cause"], "Done", "{report}");
    assert_eq!(report["ticks"], 750, "{report}");
    assert_eq!(report["untold"], 0, "{report}");
    let replayed = clutch(&["replay", log]);
    assert_eq!(replayed.status.code(), Some(0), "{}", shown(&replayed));
    // One more if the board's safe state was still reported.
    assert!(shown(&replayed).contains("identical over 75"), "{}", shown(&replayed));
    // The same board again: a second run after the first, and a release test before it.
    let done = looped(&["--duration", "2", "--release-test", "always", "--release-deg", "0.5"]);
    assert_eq!(done.status.code(), Some(0), "a second run: {}", shown(&done));
    assert!(shown(&done).contains("0 V for 3 periods"), "{}", shown(&done));
}

#[test]
fn each_kind_of_board_tells_which_option_is_for_it() {
    let Some(image) = image("mps2-controller") else { return };
    command();
    let _alone = alone();
    let (_rig, rig) = rig();
    let done = clutch(&["loop", "board_smc_2", "--board", &format!("tcp://{rig}")]);
    assert_eq!(done.status.code(), Some(1), "{}", shown(&done));
    assert!(shown(&done).contains("use --port instead of --board"), "{}", shown(&done));
    let (_whole, address) = board(&image, Some(&rig));
    let done = clutch(&["loop", "board_smc_2", "--port", &address]);
    assert_eq!(done.status.code(), Some(1), "{}", shown(&done));
    assert!(shown(&done).contains("use --board instead of --port"), "{}", shown(&done));
    let (_alone, address) = board(&image, None);
    let done = clutch(&["loop", "board_smc_2", "--board", &address]);
    assert_eq!(done.status.code(), Some(1), "{}", shown(&done));
    assert!(shown(&done).contains("finds no encoder and converter"), "{}", shown(&done));
}
