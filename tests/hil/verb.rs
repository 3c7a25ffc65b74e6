//! `clutch hil`: its exit codes, and the replay of the log of a fault.

use crate::{beside, clutch, scratch, shown};
use clutch_sim::scenario::BUILT_IN;
use clutch_tests::command;
use clutch_tests::firmware::image;
use serde_json::Value;

#[test]
fn however_a_run_on_the_board_ends_its_exit_code_says_so_and_its_log_replays() {
    let Some(image) = image("mps2-controller") else { return };
    command();
    let _beside = beside();
    let board = BUILT_IN.iter().find(|b| b.name == "board_smc_2").expect("it is built in");
    let ramp = scratch("ramp.toml");
    let hold = "[safety.on_fault.hold]\nvolts_v = 4.5";
    assert!(board.toml.contains(hold), "{}", board.toml);
    let text = board.toml.replace(hold, "[safety.on_fault.ramp]\nvolts_v = 4.5\nrate_v_s = 2.0");
    std::fs::write(&ramp, text).expect("room for it");
    let ramp = ramp.to_str().expect("a path");
    for (name, scenario, fault, cause) in [
        ("done", board.name, None, "Done"),
        ("lossy", board.name, Some("drop:at=1,p=0.2,way=up"), "Board"),
        ("silent", board.name, Some("silence:at=1"), "Silence"),
        ("encoder lost", board.name, Some("loss:at=1"), "Board"),
        ("frozen", board.name, Some("freeze:at=1"), "StandStill"),
        ("frozen, with a ramp", ramp, Some("freeze:at=1"), "StandStill"),
        ("watchdog", board.name, Some("silence:at=1,way=down"), "Board"),
    ] {
        let file = scratch(&format!("ends {name}.mcap"));
        let log = file.to_str().expect("a path");
        let mut run = vec!["hil", scenario, "--image", image.to_str().expect("a path")];
        run.extend(["--set", "run.duration_s=3", "--log", log, "--json"]);
        run.extend(fault.iter().flat_map(|f| ["--fault", f]));
        let done = clutch(&run);
        let (code, state) = if fault.is_some() { (3, "Faulted") } else { (0, "Holding") };
        assert_eq!(done.status.code(), Some(code), "{name}: {}", shown(&done));
        let report: Value = serde_json::from_slice(&done.stdout).expect("JSON");
        assert_eq!((&report["state"], &report["cause"]), (&state.into(), &cause.into()), "{name}: {report}");
        let replayed = clutch(&["replay", log]);
        assert_eq!(replayed.status.code(), Some(0), "{name}: {}", shown(&replayed));
        assert!(shown(&replayed).contains("identical"), "{name}: {}", shown(&replayed));
    }
}
