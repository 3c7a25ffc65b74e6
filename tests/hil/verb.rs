//! `clutch hil`: its exit codes, and the replay of the log of a fault.

use crate::{beside, clutch, scratch, shown};
use clutch_sim::scenario::BUILT_IN;
use clutch_tests::command;
use clutch_tests::firmware::image;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

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

/// The command and an image as an archive lays them beside each other, in `commands` and `images` of an empty folder.
fn laid(name: &str, commands: &str, images: &str, image: &Path) -> PathBuf {
    let whole = scratch(name);
    let _ = std::fs::remove_dir_all(&whole); // of a test before
    let (commands, images) = (whole.join(commands), whole.join(images));
    for folder in [&commands, &images, &whole.join("empty")] {
        std::fs::create_dir_all(folder).expect("a folder");
    }
    std::fs::copy(command(), commands.join("clutch")).expect("room for the command");
    std::fs::copy(image, images.join("mps2-controller")).expect("room for the image");
    whole
}

/// A short run by the command in a folder, from the empty one beside it.
fn from_outside(whole: &Path, commands: &str) -> Command {
    let mut run = Command::new(whole.join(commands).join("clutch"));
    run.args(["hil", "board_smc_2", "--set", "run.duration_s=2", "--json"]);
    run.current_dir(whole.join("empty")).stdin(Stdio::null()).env_remove("CLUTCH_IMAGES");
    run
}

#[test]
fn outside_of_a_checkout_the_image_beside_the_command_runs_and_without_one_all_places_are_named() {
    let Some(image) = image("mps2-controller") else { return };
    let _beside = beside();
    let ran = |done: &Output| {
        assert_eq!(done.status.code(), Some(0), "{}", shown(done));
        let report: Value = serde_json::from_slice(&done.stdout).expect("JSON");
        assert_eq!((&report["cause"], report["ticks"].as_u64()), (&"Done".into(), Some(2001)), "{report}");
    };
    for (name, commands) in [("unpacked", ""), ("installed", "bin")] {
        let whole = laid(name, commands, "share/clutch/images", &image);
        ran(&from_outside(&whole, commands).output().expect("the command starts"));
        // Images that somebody names are taken alone, be there others or not.
        let elsewhere = whole.join("elsewhere");
        let named = || from_outside(&whole, commands).env("CLUTCH_IMAGES", &elsewhere).output();
        let refused = named().expect("the command starts");
        assert_eq!(refused.status.code(), Some(1), "{}", shown(&refused));
        let missing = elsewhere.join("mps2-controller").display().to_string();
        assert!(shown(&refused).contains(&missing), "{}", shown(&refused));
        std::fs::rename(whole.join("share/clutch/images"), &elsewhere).expect("a folder");
        ran(&named().expect("the command starts"));

        let none = from_outside(&whole, commands).output().expect("the command starts");
        assert_eq!(none.status.code(), Some(1), "{}", shown(&none));
        let text = shown(&none);
        let place = whole.join(commands).join("share/clutch/images/mps2-controller");
        let above = whole.join(commands).join("../share/clutch/images/mps2-controller");
        let built = "target/firmware/thumbv7em-none-eabihf/release/mps2-controller";
        for place in [built, place.to_str().expect("a path"), above.to_str().expect("a path")] {
            assert!(text.contains(place), "no {place} in: {text}");
        }
        assert!(text.contains("cargo xtask firmware build") && text.contains("CLUTCH_IMAGES"), "{text}");
    }
}

/// The commands of a page's block behind a comment that says where they are run: here.
fn block_that_names_this_file(page: &str) -> Vec<&str> {
    let here = "tests/hil/verb.rs -->\n```sh\n";
    let (_, block) = page.split_once(here).expect("a block that names this file");
    let (block, _) = block.split_once("```\n").expect("its end");
    block.lines().collect()
}

/// The page docs/start/embedded.md, followed: its images are built, and its commands run in this tree as they stand there.
#[test]
fn the_page_for_an_embedded_engineer_is_true() {
    // Without these nothing can be followed.
    let (Some(_), Some(_)) = (image("mps2-controller"), image("nucleo-controller")) else { return };
    let lines = block_that_names_this_file(include_str!("../../docs/start/embedded.md"));
    let (build, runs) = lines.split_first().expect("commands");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let _beside = beside();
    assert_eq!(*build, "cargo xtask firmware build");
    let mut words = build.split(' ').skip(1);
    let built =
        Command::new(env!("CARGO")).args(&mut words).current_dir(&root).output().expect("cargo starts");
    assert!(built.status.success(), "{build}: {}", shown(&built));
    assert!(runs.iter().any(|line| line.contains("examples/nucleo_smc_2.toml --image nucleo-controller")));
    for line in runs {
        let args = line.strip_prefix("clutch ").expect("a verb of the command");
        let mut run = Command::new(command());
        run.args(args.split(' ')).arg("--json").current_dir(&root).env_remove("CLUTCH_IMAGES");
        let done = run.stdin(Stdio::null()).output().expect("the command starts");
        assert_eq!(done.status.code(), Some(0), "{line}: {}", shown(&done));
        let report: Value = serde_json::from_slice(&done.stdout).expect("JSON");
        assert_eq!(report["cause"], "Done", "{line}: {report}");
    }
}

/// A run without a host: figures, codes beside this machine's, what the lamp says, and what such an image cannot have.
#[test]
fn a_run_without_a_host_is_told_and_ends_with_its_exit_code() {
    if image("nucleo-alone").is_none() {
        return;
    }
    let _beside = beside();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let run = |more: &[&str]| {
        let mut hil = Command::new(command());
        hil.args(["hil", "examples/nucleo_smc_2.toml", "--image", "nucleo-alone"]).args(more);
        hil.current_dir(&root).env_remove("CLUTCH_IMAGES").stdin(Stdio::null()).output().expect("it starts")
    };
    for (more, code, words) in [
        (&[][..], 0, "each code is that of the scenario's controller"),
        (&["--chip-fault", "converter-stuck:at=0.3"], 3, "the lamp flashes 12 times, Board"),
        (&["--set", "run.duration_s=2"], 1, "the image has a longer run"),
        (&["--log", "run.mcap"], 1, "has no line to a host"),
        (&["--fault", "silence:at=1"], 1, "has no line to a host"),
    ] {
        let done = run(more);
        let text = shown(&done).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(done.status.code() == Some(code) && text.contains(words), "{more:?}: {text}");
    }
    let report: Value = serde_json::from_slice(&run(&["--json"]).stdout).expect("JSON");
    assert_eq!((&report["differs_at_tick"], &report["flashes"]), (&Value::Null, &Value::from(1)));
    assert_eq!((&report["ticks"], &report["goes_on"]), (&Value::from(10_000), &Value::from(false)));
}
