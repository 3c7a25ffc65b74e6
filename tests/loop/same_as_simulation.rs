//! The loop over a real line does what the simulation of the same scenario does.
//!
//! The band: RMS error within 10 %, largest error within 0.02°, stick-slip as the encoder shows it
//! within 20 % and 4 cycles/s. The simulation applies a code at once, a board some microseconds
//! later, and the two see other errors (true, measured): that is what the band is for.

use crate::harness::{Board, alone, folder, read_log, replays_identically, run, unless_held_up};
use serde_json::Value;

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

/// Three figures of a summary: RMS and largest error, °; stick-slip seen by the encoder, cycles/s.
fn figures(summary: &Value, stick_slip: &Value) -> [f64; 3] {
    let of = |key: &str| summary["metrics"][key].as_f64().expect("a figure").to_degrees();
    [of("rms_error_rad"), of("max_error_rad"), stick_slip.as_f64().expect("a figure")]
}

fn ten_seconds_agree(name: &str, listen: &[&str]) {
    let _alone = alone();
    let folder = folder(name);
    let scenario = folder.join("pd.toml");
    std::fs::write(&scenario, PD).unwrap();
    let scenario = scenario.to_str().unwrap();
    let log = folder.join("run.mcap");

    let sim = run(&["sim", scenario, "--set", SMOOTHED, "--json"]).expect(0).json();
    let simulated = figures(&sim, &sim["detected"]["stick_slip_cycles_per_s"]);

    let board = Board::start(&[&[scenario, "--set", SMOOTHED, "--patient"], listen].concat());
    let report = unless_held_up(name, || {
        let log = log.to_str().unwrap();
        let args = [
            "loop",
            scenario,
            "--set",
            SMOOTHED,
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
        // Half a second is how long a patient board waits.
        let longest = report["cycle"]["max_us"].as_f64().unwrap_or(f64::INFINITY);
        if longest > 400e3 {
            return Err(format!("one cycle took {longest} µs"));
        }
        let _ = done.expect(0);
        Ok(report)
    });
    let looped = figures(&report, &report["stick_slip_cycles_per_s"]);
    println!("RMS °, max °, stick-slip cycles/s: simulated {simulated:?}, looped {looped:?}");

    assert_eq!(report["samples"]["lost"], 0, "{report:#}");
    assert_eq!(report["samples"]["duplicated"], 0, "{report:#}");
    assert_eq!(report["samples"]["reordered"], 0, "{report:#}");
    assert_eq!(report["bad_frames"], 0, "{report:#}");
    assert_eq!(report["log_dropped"], 0, "{report:#}");
    assert_eq!(report["board_safe"], true, "{report:#}");
    assert_eq!(report["ticks"], 10_000, "{report:#}");
    let band = [0.1 * simulated[0], 0.02, 0.2 * simulated[2] + 4.0];
    for ((what, band), (a, b)) in ["RMS error", "largest error", "stick-slip seen by the encoder"]
        .into_iter()
        .zip(band)
        .zip(simulated.into_iter().zip(looped))
    {
        assert!((a - b).abs() <= band, "{what}: simulated {a}, looped {b}, band ±{band}");
    }
    // Not two figures of nothing: the shaft followed its path, with an error.
    assert!(looped[0] > 0.001 && looped[1] < 0.2, "{looped:?}");

    let logged = read_log(&log);
    assert!(logged.complete, "{:?}", logged.end);
    assert!(logged.commands.len() >= 10_000, "{}", logged.commands.len());
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
