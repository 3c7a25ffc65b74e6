//! The loop over a real line gives the figures of the simulation of the same scenario.
//!
//! The band: RMS error within 10 %, largest error within 0.02° (a count has 0.018°), stick-slip as
//! the encoder shows it within 20 % and 4 cycles/s. The simulation applies a code at once, a board
//! some microseconds later: the band allows for that. Both errors are as the law saw them, from the
//! encoder; the summary of `clutch sim` has the true ones, which lie half a count beside.

use crate::harness::{Board, alone, folder, read_log, replays_identically, run, unless_held_up};
use clutch_log::CommandSource;
use std::path::Path;

/// J2: the PD law at 2 °/s with a smoothed velocity.
const PD: &str = r#"
name = "PD at 2 °/s on a board"

[rig]
base = "paper"

[law.pd]
kp_v_rad = 5000.0
kd_v_s_rad = 50.0

[reference.ramp]
rate_deg_s = 2.0

[run]
duration_s = 10.0
start = "rest"

[safety]
reason = "a weight drives the shaft"

[safety.on_fault.hold]
volts_v = 4.5
"#;
const SMOOTHED: &str = "velocity.smoothed_derivative.smoothing=0.5";

/// RMS and largest error as the law saw it, °, after the settling time of a second.
fn errors(log: &Path) -> [f64; 2] {
    let read = read_log(log);
    assert!(read.complete, "{:?}", read.tail);
    let law = CommandSource::Law as u8;
    let settled = read.commands.iter().filter(|c| c.source == law && (1000..10_000).contains(&c.tick));
    let errors: Vec<f64> = settled.map(|c| c.error.to_degrees()).collect();
    assert!(errors.len() >= 8_990, "{} errors", errors.len());
    let square = errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
    [square.sqrt(), errors.iter().fold(0.0, |most, e| e.abs().max(most))]
}

/// The first figure of a loop that lies beyond the band about the simulation's.
fn beyond(simulated: [f64; 3], looped: [f64; 3]) -> Option<String> {
    let band = [0.1 * simulated[0], 0.02, 0.2 * simulated[2] + 4.0];
    let names = ["RMS error", "largest error", "stick-slip seen by the encoder"];
    let each = names.into_iter().zip(band).zip(simulated.into_iter().zip(looped));
    let apart = |((what, band), (a, b)): ((&str, f64), (f64, f64))| {
        let within = (a - b).abs() <= band;
        (!within).then(|| format!("{what}: simulated {a}, looped {b}, band ±{band}"))
    };
    each.into_iter().find_map(apart)
}

fn ten_seconds_agree(name: &str, listen: &[&str]) {
    let _alone = alone();
    let folder = folder(name);
    let scenario = folder.join("pd.toml");
    std::fs::write(&scenario, PD).unwrap();
    let scenario = scenario.to_str().unwrap();
    let log = folder.join("run.mcap");

    let reference = folder.join("simulation.mcap");
    let args = ["sim", scenario, "--set", SMOOTHED, "--json", "--log", reference.to_str().unwrap()];
    let sim = run(&args).expect(0).json();
    let [rms, largest] = errors(&reference);
    let simulated = [rms, largest, sim["detected"]["stick_slip_cycles_per_s"].as_f64().unwrap()];

    let board = Board::start(&[&[scenario, "--set", SMOOTHED, "--patient"], listen].concat());
    let report = unless_held_up(name, || {
        let _ = std::fs::remove_file(&log); // of an attempt that the machine spoiled
        let log = log.to_str().unwrap();
        let args = [
            "loop",
            scenario,
            "--set",
            SMOOTHED,
            "--patient",
            "--port",
            &board.port,
            "--duration",
            "10",
            "--log",
            log,
            "--json",
        ];
        let done = run(&args);
        let report = done.json();
        // A machine that stalled for so long proves nothing about the loop.
        let longest = report["cycle"]["max_us"].as_f64().unwrap_or(f64::INFINITY);
        if longest > 400e3 {
            return Err(format!("one cycle took {longest} µs"));
        }
        let _ = done.expect(0);
        let [rms, largest] = errors(Path::new(log));
        let looped = [rms, largest, report["metrics"]["stick_slip_cycles_per_s"].as_f64().unwrap()];
        println!("RMS °, max °, stick-slip cycles/s: simulated {simulated:?}, looped {looped:?}");
        let apart = beyond(simulated, looped);
        match apart {
            // Nor does one that stalled for less, where its figures are others.
            Some(apart) if longest > 50e3 => Err(format!("one cycle took {longest} µs, and {apart}")),
            _ => Ok((report, looped, apart)),
        }
    });
    let (report, looped, apart) = report;
    let [rms, largest, _] = looped;

    assert_eq!(report["samples"]["lost"], 0, "{report:#}");
    assert_eq!(report["samples"]["duplicated"], 0, "{report:#}");
    assert_eq!(report["samples"]["reordered"], 0, "{report:#}");
    assert_eq!(report["bad_frames"], 0, "{report:#}");
    assert_eq!(report["log_dropped"], 0, "{report:#}");
    assert_eq!(report["board_safe"], true, "{report:#}");
    assert_eq!(report["ticks"], 10_000, "{report:#}");
    assert_eq!(apart, None);
    // The figures are not empty: the shaft followed its path, with an error.
    assert!(looped[0] > 0.001 && looped[1] < 0.2, "{looped:?}");

    // The summary has the same figures as the log.
    for (key, logged) in [("rms_error_rad", rms), ("max_error_rad", largest)] {
        let told = report["metrics"][key].as_f64().unwrap().to_degrees();
        assert!((told - logged).abs() < 1e-3 * logged, "{key}: summary {told}°, log {logged}°");
    }
    replays_identically(&log);
    let said = board.end();
    assert!(said.contains("Stopped"), "{said}");
}

#[test]
fn ten_seconds_over_a_pseudo_terminal_agree_with_the_simulation_and_lose_no_sample() {
    ten_seconds_agree("j2-pty", &[]);
}

#[test]
fn ten_seconds_over_tcp_agree_with_the_simulation_and_lose_no_sample() {
    ten_seconds_agree("j2-tcp", &["--listen", "tcp://127.0.0.1:0"]);
}

#[test]
fn a_run_with_a_map_of_the_disc_replays_as_it_was() {
    let _alone = alone();
    let name = "mapped";
    let folder = folder(name);
    let file = |name: &str| folder.join(name).display().to_string();
    let (scenario, ride, map) = (file("glide.toml"), file("ride.mcap"), file("map.toml"));
    let text = PD
        .replace("base = \"paper\"", "base = \"bench\"")
        .replace("[law.pd]\nkp_v_rad = 5000.0\nkd_v_s_rad = 50.0", "[law.glide.filter]\ndelay_ticks = 1")
        .replace("volts_v = 4.5", "volts_v = 9.9");
    std::fs::write(&scenario, text).unwrap();
    let _ = run(&["sim", &scenario, "--log", &ride]).expect(0);
    let _ = run(&["identify", &scenario, "--from", &ride, "--map", &map]).expect(0);

    let board = Board::start(&[&scenario, "--patient"]);
    let log = folder.join("run.mcap");
    unless_held_up(name, || {
        let _ = std::fs::remove_file(&log); // of an attempt that the machine spoiled
        let log = log.to_str().unwrap();
        let port = ["--patient", "--uncertified", "--port", &board.port, "--log", log];
        let done =
            run(&[&["loop", &scenario, "--map", &map, "--duration", "4", "--json"][..], &port].concat());
        let report = done.json();
        if report["cycle"]["max_us"].as_f64().unwrap_or(f64::INFINITY) > 400e3 {
            return Err("a cycle took too long".to_owned());
        }
        let _ = done.expect(0);
        Ok(())
    });
    let read = read_log(&log);
    let map = read.header.term_names.iter().position(|name| name == "map").expect("the term");
    let drove = read.commands.iter().filter(|c| c.terms.get(map).copied() == Some(2.0)).count();
    assert!(drove > 2000, "the map drove for {drove} ms");
    replays_identically(&log);
    let _ = board.end();
}
