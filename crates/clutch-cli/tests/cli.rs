//! The command as a user meets it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

fn clutch(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_clutch")).args(args).output().expect("the command starts")
}

fn out(o: &Output) -> String {
    String::from_utf8(o.stdout.clone()).expect("UTF-8")
}

fn err(o: &Output) -> String {
    String::from_utf8(o.stderr.clone()).expect("UTF-8")
}

/// True if a terminal of 80 columns holds the text; a file's name may be as long as it is.
fn narrow(text: &str) -> bool {
    text.lines().filter(|line| !line.starts_with("wrote ")).all(|line| line.chars().count() <= 80)
}

/// A folder of this test's own.
fn folder(name: &str) -> PathBuf {
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&dir); // there is none the first time
    std::fs::create_dir_all(&dir).expect("a folder for the test");
    dir
}

#[test]
fn the_help_of_every_verb_has_an_example() {
    for verb in [
        &["--help"][..],
        &["sim", "--help"],
        &["compare", "--help"],
        &["sweep", "--help"],
        &["scenario", "--help"],
        &["scenario", "list", "--help"],
        &["scenario", "show", "--help"],
        &["scenario", "new", "--help"],
        &["certify", "--help"],
        &["map", "--help"],
        &["reproduce", "--help"],
        &["loop", "--help"],
        &["identify", "--help"],
        &["tune", "--help"],
        &["daq", "--help"],
        &["replay", "--help"],
        &["log", "info", "--help"],
        &["log", "recover", "--help"],
        &["log", "export", "--help"],
        &["referee", "--help"],
        &["completion", "--help"],
        &["man", "--help"],
    ] {
        let o = clutch(verb);
        assert!(o.status.success());
        let text = out(&o).replace("Examples:", "Example:");
        assert!(text.contains("Example:\n  clutch "), "{verb:?}:\n{}", out(&o));
        // The line of usage is clap's, which does not break it.
        let long = text.lines().find(|line| line.chars().count() > 80 && !line.starts_with("Usage:"));
        assert_eq!(long, None, "{verb:?}: a line is longer than a terminal");
    }
}

#[test]
fn a_file_that_is_not_there_is_named_with_what_to_do() {
    let o = clutch(&["sim", "missing.toml"]);
    assert_eq!(o.status.code(), Some(1));
    assert!(err(&o).starts_with("clutch: missing.toml: no such file"), "{}", err(&o));
    assert!(err(&o).contains("clutch scenario new FILE"));
    assert!(out(&o).is_empty());
}

#[test]
fn a_folder_or_bytes_instead_of_a_scenario_are_named() {
    let dir = folder("not_text");
    let o = clutch(&["sim", dir.to_str().unwrap()]);
    assert_eq!(o.status.code(), Some(1));
    assert!(err(&o).contains("not_text"), "{}", err(&o));
    let file = dir.join("bytes.toml");
    std::fs::write(&file, [0xff, 0xfe, 0x00]).unwrap();
    let o = clutch(&["sim", file.to_str().unwrap()]);
    assert!(err(&o).contains("expected TOML in UTF-8"), "{}", err(&o));
}

#[test]
fn a_bad_value_names_file_key_value_and_expectation_and_nothing_is_printed_as_a_result() {
    let o = clutch(&["sim", "smc_2", "--set", "rig.inertia_kg_m2=-1"]);
    assert_eq!(o.status.code(), Some(1));
    assert_eq!(
        err(&o),
        "clutch: smc_2: rig.inertia_kg_m2 = -1: expected a finite number above 0 kg m² whose inverse is finite, too\n"
    );
    assert!(out(&o).is_empty());
}

#[test]
fn a_command_line_that_is_not_understood_exits_with_64() {
    for args in [&["simulate"][..], &["sim"], &["sim", "smc_2", "--set", "kp"]] {
        let o = clutch(args);
        assert_eq!(o.status.code(), Some(64), "{args:?}");
        assert!(!err(&o).is_empty());
    }
    let o = clutch(&["sim", "smc_2", "--live=80x"]);
    assert_eq!(o.status.code(), Some(64));
    assert!(
        err(&o).contains("invalid value '80x' for '--live[=<PORT>]': expected a port from 1 to 65535"),
        "{}",
        err(&o)
    );
}

#[test]
fn sim_keeps_the_verdicts_apart_and_says_of_what_each_speaks() {
    let o = clutch(&["sim", "smc_2"]);
    for line in [
        "gains, continuous time: certified for its bounds (exact sensor)",
        "gains, as sampled: error bound not looked for: `clutch certify --sampled` does",
        "gains, as sampled: linearly stable: spectral radius 0.948, 0.948, 0.948 with the",
        "sticks: not excluded, neither by a bound nor by stability",
    ] {
        assert!(out(&o).lines().any(|l| l == line), "{line}\nis not in\n{}", out(&o));
    }
    // A delay is covered by the certificate as sampled alone.
    let delayed = ["smc_2", "--set", "rig.delay_ticks=1"];
    let o = clutch(&[&["sim"], &delayed[..]].concat());
    let lines = [
        "gains, continuous time: certified for the model, not for this rig: see `clutch\n    certify`\n",
        "gains, as sampled: linearly stable: spectral radius 0.997",
    ];
    assert!(lines.iter().all(|line| out(&o).contains(line)), "{}", out(&o));
    let told =
        "outside these bounds; in continuous time not covered:\n  delay is 1 tick of 1000 µs, bounds none\n";
    let o = clutch(&[&["certify"], &delayed[..]].concat());
    assert!(out(&o).contains(told), "{}", out(&o));
    // Of a law without a certificate as sampled nothing is said but that, and of sticks.
    let o = clutch(&["sim", "motor_pid"]);
    assert_eq!(out(&o).matches("gains, as sampled: ").count(), 1, "{}", out(&o));
    assert!(out(&o).contains("sticks: not excluded"), "{}", out(&o));
}

#[test]
fn certify_exits_with_0_for_certified_and_2_for_not() {
    let o = clutch(&["certify", "smc_2"]);
    assert_eq!(o.status.code(), Some(0));
    let text = out(&o);
    for words in [
        "K_p required",
        "2.2624",
        "worst corner",
        "margin",
        "(26)",
        "-0.96027",
        "\ncontinuous time: certified",
    ] {
        assert!(text.contains(words), "lacks {words}:\n{text}");
    }
    let bounds = [
        "--set",
        "bounds.friction_percent=20",
        "--set",
        "bounds.brake_gain_percent=20",
        "--set",
        "bounds.drive_torque_percent=10",
    ];
    let o = clutch(&[&["certify", "smc_2"][..], &bounds].concat());
    assert_eq!(o.status.code(), Some(2));
    assert!(out(&o).contains("continuous time: NOT certified: K_p is too small"), "{}", out(&o));
}

#[test]
fn json_is_all_that_standard_output_holds() {
    for (args, key) in [
        (&["sim", "smc_2", "--json"][..], "/metrics/max_error_rad"),
        (&["certify", "smc_2", "--json"], "/ahead/kp_required_v"),
    ] {
        let o = clutch(args);
        let value: serde_json::Value = serde_json::from_slice(&o.stdout).expect("only JSON");
        assert!(value.pointer(key).is_some_and(|v| v.is_number()), "{args:?} {value}");
        assert!(err(&o).is_empty());
    }
}

#[test]
fn a_run_writes_its_samples_and_its_figure() {
    let dir = folder("sim");
    let (csv, svg, png) = (dir.join("run.csv"), dir.join("run.svg"), dir.join("run.png"));
    let o = clutch(&["sim", "smc_2", "--csv", csv.to_str().unwrap(), "--plot", svg.to_str().unwrap()]);
    assert!(o.status.success(), "{}", err(&o));
    let rows = std::fs::read_to_string(&csv).unwrap();
    assert!(rows.starts_with("time_s,target_position_rad,"));
    assert_eq!(rows.lines().count(), 5001);
    assert!(std::fs::read_to_string(&svg).unwrap().contains("</svg>"));
    assert!(clutch(&["sim", "smc_2", "--plot", png.to_str().unwrap()]).status.success());
    assert!(std::fs::read(&png).unwrap().starts_with(b"\x89PNG"));
    let o = clutch(&["sim", "smc_2", "--plot", "run.jpg"]);
    assert_eq!(o.status.code(), Some(1));
    assert!(err(&o).contains("run.jpg") && err(&o).contains(".svg or .png"), "{}", err(&o));
    let o = clutch(&["sim", "smc_2", "--csv", "no/such/folder/run.csv"]);
    assert!(err(&o).starts_with("clutch: no/such/folder/run.csv: cannot be written"), "{}", err(&o));
}

/// Texts and curves of a drawing.
fn drawing(svg: &Path) -> (Vec<String>, usize) {
    let text = std::fs::read_to_string(svg).expect("a drawing");
    let document = roxmltree::Document::parse(&text).expect("well-formed");
    let texts =
        document.descendants().filter(|n| n.is_text()).filter_map(|n| n.text().map(|t| t.trim().to_owned()));
    let bands = document.descendants().filter(|n| {
        n.has_tag_name("polygon") && n.attribute("opacity").is_some_and(|o| o.starts_with("0.2"))
    });
    (texts.filter(|t| !t.is_empty()).collect(), bands.count())
}

#[test]
fn a_run_is_drawn_closely_around_a_stick_and_whole_as_an_envelope() {
    let svg = folder("sim_plot").join("run.svg");
    let o = clutch(&["sim", "bench_pd_2", "--plot", svg.to_str().unwrap()]);
    assert!(o.status.success(), "{}", err(&o));
    assert!(out(&o).lines().last().is_some_and(|l| l == format!("wrote {}", svg.display())), "{}", out(&o));
    let (texts, bands) = drawing(&svg);
    for text in
        ["position (counts)", "velocity (°/s)", "error (°)", "voltage (V)", "path", "at rest", "the window"]
    {
        assert!(texts.iter().any(|t| t == text), "lacks {text}: {texts:?}");
    }
    assert!(texts.iter().any(|t| t.starts_with("216 ms around the stick at ")), "{texts:?}");
    assert_eq!(bands, 2, "error and voltage");
    // A run that does not stick is shown around its largest error.
    assert!(clutch(&["sim", "bench_glide_2", "--plot", svg.to_str().unwrap()]).status.success());
    let (texts, _) = drawing(&svg);
    assert!(texts.iter().any(|t| t.contains("around the largest error, at ")), "{texts:?}");
}

#[test]
fn runs_are_compared_in_a_table_of_80_columns_and_on_common_axes() {
    let svg = folder("compare").join("laws.svg");
    let two = ["bench_pd_2", "bench_smc_2"];
    let o = clutch(&[&["compare"][..], &two, &["--plot", svg.to_str().unwrap()]].concat());
    let text = out(&o);
    assert!(o.status.success(), "{}", err(&o));
    assert!(narrow(&text), "{text}");
    let cells = |name: &str| {
        let line = text.lines().find(|l| l.trim_start().starts_with(name)).expect(name);
        line.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
    };
    // The figures of `clutch sim`.
    for (column, name) in two.iter().enumerate() {
        let one = out(&clutch(&["sim", name]));
        let line = one.lines().find(|l| l.trim_start().starts_with("max |error|")).expect("a figure");
        assert_eq!(line.split_whitespace().nth(2), cells("max |error|").get(2 + column).map(String::as_str));
    }
    assert_eq!(cells("A "), ["A", "B"]);
    let (texts, bands) = drawing(&svg);
    assert_eq!(bands, 4);
    let path = texts.iter().filter(|t| *t == "path").count();
    assert_eq!(path, 2, "one path in each of two panels: {texts:?}");
    for law in ["A: PD at 2 °/s, bench", "B: SMC at 2 °/s, bench"] {
        assert_eq!(texts.iter().filter(|t| *t == law).count(), 4, "{texts:?}");
    }

    let set = ["--set", "reference.ramp.rate_deg_s=6", "--json"];
    let all = ["pd_2", "smc_2", "ctc_2", "bench_pid_2", "observer_smc_2"];
    let o = clutch(&[&["compare"][..], &all, &set].concat());
    let value: serde_json::Value = serde_json::from_slice(&o.stdout).expect("only JSON");
    let runs = value["runs"].as_array().expect("runs");
    assert_eq!(runs.len(), 5);
    for run in runs {
        let rate = run["path"]["highest_velocity_rad_s"].as_f64().expect("a rate");
        assert!((rate.to_degrees() - 6.0).abs() < 1e-9, "{rate}");
    }
    assert!(value["window"]["from_s"].as_f64() < value["window"]["to_s"].as_f64());
    let text = out(&clutch(&[&["compare"][..], &all].concat()));
    assert!(narrow(&text) && text.matches("max |error|").count() == 2, "five columns are two tables: {text}");

    assert_eq!(clutch(&["compare", "pd_2"]).status.code(), Some(64));
    let o = clutch(&[&["compare"][..], &["pd_2"; 8]].concat());
    assert!(err(&o).contains("8 scenarios: expected 2 to 7"), "{}", err(&o));
}

#[test]
fn what_every_built_in_run_prints_fits_a_terminal() {
    let list = out(&clutch(&["scenario", "list"]));
    for name in list.lines().filter_map(|line| line.split_whitespace().next()) {
        let text = out(&clutch(&["sim", name]));
        assert!(narrow(&text), "{text}");
        let bars = text.lines().skip_while(|l| !l.contains("|error| of the whole run")).nth(1).expect("bars");
        assert!(bars.trim().chars().all(|c| ('▁'..='█').contains(&c)) && bars.contains('█'), "{text}");
    }
}

#[test]
fn a_quiet_command_tells_nothing_but_what_was_asked_for() {
    let svg = folder("quiet").join("run.svg");
    let o = clutch(&["--quiet", "sim", "smc_2", "--plot", svg.to_str().unwrap()]);
    assert!(o.status.success() && out(&o).is_empty() && err(&o).is_empty(), "{}{}", out(&o), err(&o));
    assert!(svg.exists());
    assert!(out(&clutch(&["sim", "smc_2", "--json", "-q"])).starts_with('{'));
    assert!(out(&clutch(&["scenario", "list", "-q"])).contains("smc_2"));
    assert!(err(&clutch(&["-q", "sim", "missing.toml"])).contains("no such file"));
    // A remark is; the image is missed after it.
    let hil = ["hil", "board_smc_2", "--image", "none.elf"];
    assert!(err(&clutch(&hil)).starts_with("note: "), "{}", err(&clutch(&hil)));
    let o = clutch(&[&hil[..], &["-q"]].concat());
    assert!(o.status.code() == Some(1) && err(&o).starts_with("clutch: "), "{}", err(&o));
    // The message that nothing was started is no chatter.
    let refused = clutch(&["-q", "loop", "board_smc_2", "--set", "law.smc.kp_v=1"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        out(&refused).contains("--uncertified runs it all the same"),
        "{}{}",
        out(&refused),
        err(&refused)
    );
}

/// Output of a command on a terminal, made by `script`; none where that program is missing.
fn on_a_terminal(command: &str, environment: &[(&str, &str)]) -> Option<String> {
    on_a_terminal_in(Path::new("."), command, environment)
}

/// The same in a folder.
fn on_a_terminal_in(folder: &Path, command: &str, environment: &[(&str, &str)]) -> Option<String> {
    let line = format!("'{}' {command}", env!("CARGO_BIN_EXE_clutch"));
    let mut script = Command::new("script");
    // Terminals of CI are taken for ones with colour, whatever TERM says.
    script
        .current_dir(folder)
        .args(["-qec", &line, "/dev/null"])
        .env_remove("NO_COLOR")
        .env_remove("CI")
        .env("TERM", "xterm-256color");
    script.envs(environment.iter().copied());
    let o = script.output().ok()?;
    Some(out(&o))
}

#[test]
fn verdicts_have_colours_on_a_terminal_alone() {
    let escape = '\u{1b}';
    assert!(!out(&clutch(&["sim", "bench_pd_2"])).contains(escape), "no terminal");
    let Some(text) = on_a_terminal("sim bench_pd_2", &[]) else {
        eprintln!("skipped: no program `script`");
        return;
    };
    assert!(text.contains(&format!("{escape}[1m{escape}[31mUNSTABLE{escape}[0m")), "{text:?}");
    for plain in [("NO_COLOR", "1"), ("TERM", "dumb")] {
        let text = on_a_terminal("sim bench_pd_2", &[plain]).expect("it was there");
        assert!(text.contains("UNSTABLE") && !text.contains(&format!("{escape}[31m")), "{plain:?}: {text:?}");
    }
}

#[test]
fn a_simulated_board_that_cannot_begin_says_why() {
    for (command, why) in [
        (
            "loop board_smc_2 --fault dac-stuck:at=0,volts=99",
            "fault dac-stuck = 99: expected a voltage that the scenario's converter has, V",
        ),
        (
            "loop motor_pid --uncertified --fault contact:at=0,factor=0.5",
            "expected a brake that lets go at 0 V",
        ),
    ] {
        let words: Vec<&str> = command.split(' ').collect();
        let o = Command::new(env!("CARGO_BIN_EXE_clutch")).args(&words).output().expect("the command starts");
        assert!(!o.status.success() && err(&o).contains(why), "{command}: {}", err(&o));
    }
}

#[test]
fn errors_fit_a_terminal_and_are_for_a_program_as_they_were() {
    let dir = folder("terminal");
    std::fs::write(dir.join("mine.toml"), format!("name = \"{}\" x\n", "long ".repeat(30))).unwrap();
    let (mut folded, mut shown) = (0, 0);
    for command in [
        "sim smc_2 --set rig.inertia_kg_m2=-1",
        "sim smc_2 --set rig.friction.mu_static=0.25",
        "sim smc_2 --set reference.ramp.rate_rad_s=0.035",
        "sim missing.toml",
        "sim mine.toml",
        "map bench_pd_2 --x law.pd.kp_v_rad=2:1:3",
        "loop --fault Freeze:at=1",
        "loop --port tcp://nowhere --update-rate 3",
        "hil --image none.elf --fault reset:at=1 --chip-fault hang:at=1",
        "tune minimum_jerk --rates 2",
        "identify --port /dev/none --log logs",
        "log info mine.toml",
    ] {
        let words: Vec<&str> = command.split(' ').collect();
        let mut piped = Command::new(env!("CARGO_BIN_EXE_clutch"));
        let piped = piped.args(&words).current_dir(&dir).output().expect("the command starts");
        let piped = out(&piped) + &err(&piped);
        let Some(text) = on_a_terminal_in(&dir, command, &[]) else {
            eprintln!("skipped: no program `script`");
            return;
        };
        let text = anstream::adapter::strip_str(&text).to_string();
        let flat = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(flat(&text), flat(&piped), "{command}");
        let source =
            |line: &&str| line.trim_start_matches(|c: char| c == ' ' || c.is_ascii_digit()).starts_with('|');
        let prose: Vec<&str> = text.lines().filter(|line| !source(line)).collect();
        assert!(narrow(&prose.join("\n")), "{command}:\n{text}");
        folded += usize::from(text.lines().count() > piped.lines().count());
        shown += text.lines().filter(source).filter(|line| line.chars().count() > 80).count();
    }
    // The line of the file, and the mark below its end.
    assert!(folded >= 8 && shown == 2, "{folded} were longer than a terminal, {shown} lines of a file");
}

#[test]
fn what_is_refused_for_its_gains_is_told_in_80_columns() {
    let weak = ["--set", "law.smc.kp_v=1"];
    for verb in [
        &["loop", "board_smc_2"][..],
        &["hil", "board_smc_2", "--image", "none.elf"],
        &["scenario", "header", "board_smc_2"],
    ] {
        let o = clutch(&[verb, &weak].concat());
        assert_eq!(o.status.code(), Some(2), "{verb:?}: {}", err(&o));
        assert!(narrow(&out(&o)) && out(&o).contains("not certified"), "{verb:?}:\n{}", out(&o));
    }
}

#[test]
fn a_name_in_other_letters_is_recognised() {
    for (args, meant) in [
        (&["sim", "SMC_2"][..], "did you mean smc_2?"),
        (&["scenario", "show", "Bench_PD_2"], "did you mean bench_pd_2?"),
        (&["sim", "smc_2", "--set", "law.smc.KP_V=3"], "did you mean kp_v?"),
        (&["sim", "smc_2", "--set", "law.smc.Kp=3"], "did you mean kp_v?"),
        (&["sim", "smc_2", "--set", "RUN.seed=3"], "did you mean run?"),
        (&["sim", "smc_2", "--set", "rig.base=Bench"], "did you mean bench?"),
    ] {
        let o = clutch(args);
        assert_eq!(o.status.code(), Some(1), "{args:?}");
        assert!(err(&o).contains(meant), "{args:?}: {}", err(&o));
    }
    for (verb, meant) in [("SIM", "sim"), ("Reproduce", "reproduce"), ("sweeep", "sweep")] {
        let o = clutch(&[verb]);
        assert_eq!(o.status.code(), Some(64));
        assert!(err(&o).contains(&format!("similar subcommand exists: '{meant}'")), "{}", err(&o));
    }
    for (args, code, meant) in [
        (&["friction", "plot", "Lugre"][..], 1, "did you mean lugre?"),
        (&["friction", "plot", "lugr"], 1, "did you mean lugre?"),
        (&["referee", "p3"], 1, "did you mean P3"),
        (&["referee", "--show", "p3"], 1, "did you mean P3"),
        (&["referee", "P3", "--engine", "System"], 64, "did you mean system?"),
        (&["loop", "--fault", "Freeze:at=1"], 64, "did you mean freeze?"),
        (&["loop", "--fault", "freeze:AT=1"], 64, "did you mean at?"),
        (&["hil", "--image", "nucleo-daq", "--chip-fault", "Hang"], 64, "did you mean hang?"),
        (&["hil", "--image", "Mps2-Controller"], 1, "did you mean mps2-controller?"),
        (&["hil", "--image", "nucleo-dac"], 1, "did you mean nucleo-daq?"),
        (&["sim", "smc_2", "--SET", "a=1"], 64, "similar argument exists: '--set'"),
        (&["log", "export", "run.mcap", "--Channel", "sample"], 64, "similar argument exists: '--channel'"),
        (&["--QUIET", "sim", "smc_2"], 64, "similar argument exists: '--quiet'"),
        (
            &["log", "export", "r.mcap", "--out", "r.csv", "--channel", "TRUTH"],
            64,
            "similar value exists: 'truth'",
        ),
    ] {
        let o = clutch(args);
        assert_eq!(o.status.code(), Some(code), "{args:?}: {}", err(&o));
        assert!(err(&o).contains(meant), "{args:?}: {}", err(&o));
    }
}

#[test]
fn a_new_scenario_never_overwrites_a_file() {
    let file = folder("new").join("mine.toml");
    let name = file.to_str().unwrap();
    assert!(clutch(&["scenario", "new", name, "--from", "bench_pd_2"]).status.success());
    assert!(clutch(&["sim", name]).status.success());
    let before = std::fs::read(&file).unwrap();
    let o = clutch(&["scenario", "new", name]);
    assert_eq!(o.status.code(), Some(1));
    assert!(err(&o).contains("cannot be created"), "{}", err(&o));
    assert_eq!(std::fs::read(&file).unwrap(), before);
    let o = clutch(&["scenario", "show", "nothing"]);
    assert!(err(&o).contains("expected one of: pd_2"), "{}", err(&o));
}

#[test]
fn a_path_that_a_brake_cannot_follow_is_said_in_words() {
    let o = clutch(&["sim", "minimum_jerk", "--set", "reference.minimum_jerk.duration_s=0.4"]);
    assert_eq!(o.status.code(), Some(1));
    assert!(
        err(&o).contains("reference.minimum_jerk: a brake cannot follow the path from t = "),
        "{}",
        err(&o)
    );
}

#[test]
fn a_file_that_cannot_be_written_is_refused_before_the_search() {
    let dir = folder("no_room");
    let file = dir.join("missing").join("a.toml");
    let file = file.to_str().unwrap();
    for args in [
        ["tune", "pd_2", "--out", file],
        ["tune", "pd_2", "--save", dir.to_str().unwrap()],
        ["identify", "board_smc_2", "--out", file],
        ["map", "pd_2", "--html", file],
    ] {
        let o = clutch(&args);
        assert_eq!(o.status.code(), Some(1), "{args:?}");
        assert!(err(&o).contains(": cannot be written: it"), "{args:?}: {}", err(&o));
        assert!(out(&o).is_empty(), "{args:?}");
    }
}

#[test]
fn a_dash_is_no_file() {
    for words in [
        &["sim", "smc_2", "--csv", "-"][..],
        &["sweep", "smc_2", "--over", "run.seed=1,2", "--out", "-"],
        &["loop", "board_smc_2", "--log", "-"],
        &["certify", "pd_2", "--sampled", "--save", "-"],
        &["log", "recover", "run.mcap", "-"],
    ] {
        let o = clutch(words);
        let said = err(&o);
        assert_eq!(o.status.code(), Some(64), "{words:?}: {said}");
        assert!(said.contains("expected a name: this result does not go to standard output"), "{said}");
    }
}

#[test]
fn reproduce_names_a_folder_that_it_cannot_make() {
    let dir = folder("reproduce");
    let file = dir.join("a_file");
    std::fs::write(&file, "x").unwrap();
    let o = clutch(&["reproduce", "--out", file.join("below").to_str().unwrap()]);
    assert_eq!(o.status.code(), Some(1));
    assert!(err(&o).contains("a_file/below: cannot be made"), "{}", err(&o));
}

#[test]
fn the_report_begins_with_three_sentences_and_the_figures_and_prints_80_columns() {
    let dir = folder("report");
    let o = clutch(&["reproduce", "--out", dir.to_str().unwrap()]);
    assert!(o.status.success(), "{}", err(&o));
    let lines = out(&o);
    assert!(narrow(lines.split("figures, table3.csv").next().unwrap()), "{lines}");
    let page = std::fs::read_to_string(dir.join("report.html")).unwrap();
    let at = |text: &str| page.find(text).expect(text);
    let (figures, claims) = (at("<h2 id=\"figures\">"), at("<h2 id=\"claims\">"));
    assert_eq!(page[..figures].matches("<p class=\"lead\">").count(), 3);
    assert!(at("<svg") > figures && at("<svg") < claims);
    // The sentences say what was computed.
    let report = std::fs::read_to_string(dir.join("report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let slowest = &report["table3"][2];
    for (name, after) in
        [("pd_cycles_per_s", " times a second under PD"), ("reduction_percent", " % less, where")]
    {
        let told = format!("{:.1}{after}", slowest[name].as_f64().unwrap());
        assert!(page[..figures].contains(&told), "lacks {told}");
    }
    for name in ["laws", "fig8", "fig9", "fig10"] {
        assert!(std::fs::read(dir.join(name).with_extension("png")).unwrap().starts_with(b"\x89PNG"));
        drawing(&dir.join(name).with_extension("svg"));
        assert!(page.contains(&format!("<figure id=\"figure-{name}\">")));
    }
}

#[test]
fn the_errors_that_the_docs_show_are_the_errors_that_come() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/scenario.md");
    let page = std::fs::read_to_string(page).unwrap();
    let mut checked = 0;
    for block in page.split("```text\n").skip(1) {
        let block = block.split("```").next().unwrap();
        for example in block.split("$ clutch ").skip(1) {
            let (command, shown) = example.split_once('\n').unwrap();
            let shown = shown.trim();
            if !shown.starts_with("clutch: ") {
                continue;
            }
            let line = format!("'{}' {command}", env!("CARGO_BIN_EXE_clutch"));
            let o = Command::new("sh").args(["-c", &line]).current_dir(folder("docs")).output().unwrap();
            assert_eq!(err(&o).trim(), shown, "$ clutch {command}");
            checked += 1;
        }
    }
    assert!(checked >= 10, "{checked}");
}

/// docs/axis.md: the evening with a geared motor.
#[test]
fn the_runs_of_the_motor_that_the_docs_show_are_the_runs_that_come() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/axis.md");
    let page = std::fs::read_to_string(page).unwrap();
    let mut checked = 0;
    for example in page.split("$ clutch sim ").skip(1) {
        let example = example.split("```").next().unwrap().replace("\\\n", " ");
        let (command, shown) = example.split_once('\n').unwrap();
        let line = format!("'{}' sim {command}", env!("CARGO_BIN_EXE_clutch"));
        let o = Command::new("sh").args(["-c", &line]).output().unwrap();
        match shown.trim().strip_prefix("…\n") {
            None => assert_eq!(out(&o).trim(), shown.trim(), "$ clutch sim {command}"),
            Some(part) => assert!(out(&o).contains(part), "$ clutch sim {command}\n{}", out(&o)),
        }
        checked += 1;
    }
    for row in page.lines().filter(|line| line.starts_with("| `motor_")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let run: serde_json::Value =
            serde_json::from_str(&out(&clutch(&["sim", cells[1].trim_matches('`'), "--json"]))).unwrap();
        for (cell, metric, factor) in [
            (cells[3], "max_error_rad", 1.0_f64.to_degrees()),
            (cells[4], "rms_error_rad", 1.0_f64.to_degrees()),
            (cells[5], "stick_slip_cycles_per_s", 1.0),
        ] {
            let shown = cell.trim_end_matches(" cycles/s").trim_end_matches('°');
            let decimals = shown.split_once('.').map_or(0, |(_, d)| d.len());
            let is = run["metrics"][metric].as_f64().unwrap() * factor;
            assert_eq!(format!("{is:.decimals$}"), shown, "{row}: {metric}");
        }
        checked += 1;
    }
    assert_eq!(checked, 9);
}

/// The same page: its file in full, and the figures within its sentences.
#[test]
fn the_file_and_the_sentences_of_the_motors_evening_are_what_comes() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/axis.md");
    let page = std::fs::read_to_string(page).unwrap();
    let words = page.split_whitespace().collect::<Vec<_>>().join(" ");
    let told = |args: &[&str]| -> serde_json::Value {
        serde_json::from_str(&out(&clutch(&[args, &["--json"]].concat()))).unwrap()
    };
    let file = folder("evening").join("motor.toml");
    std::fs::write(&file, page.split("```toml\n").nth(1).unwrap().split("```").next().unwrap()).unwrap();
    let typed = told(&["sim", file.to_str().unwrap()]);
    assert_eq!(typed["metrics"], told(&["sim", "motor_pid"])["metrics"]);

    let largest = |args: &[&str]| told(args)["metrics"]["max_error_rad"].as_f64().unwrap().to_degrees();
    let known = largest(&["sim", "motor_ctc"]);
    let low = largest(&["sim", "motor_ctc", "--set", "model.actuator.motor.preload_nm=0.2"]);
    let sentence = format!("its largest error grows from {known:.3}° to {low:.3}°");
    assert!(words.contains(&sentence), "lacks: {sentence}");

    let names = ["motor_pid", "motor_pid_coulomb", "motor_smc", "motor_ctc", "motor_glide"];
    let proven = names.map(|name| told(&["certify", name]));
    assert_eq!(
        proven.each_ref().map(|p| p["certified_continuous_time"] == true),
        [false, false, true, false, false]
    );
    let bound = proven[2]["layer"]["error_bound_rad"].as_f64().unwrap().to_degrees();
    let sentence = format!("certified, for an error below {bound:.2}°");
    assert!(words.contains(&sentence), "lacks: {sentence}");
}

#[test]
fn no_file_is_written_over_another_of_the_same_command() {
    let file = folder("same").join("mine.toml");
    let name = file.to_str().unwrap();
    assert!(clutch(&["scenario", "new", name]).status.success());
    let before = std::fs::read(&file).unwrap();
    let o = clutch(&["sim", name, "--csv", name]);
    assert_eq!(o.status.code(), Some(1));
    assert!(err(&o).contains("named twice"), "{}", err(&o));
    assert_eq!(std::fs::read(&file).unwrap(), before);
    assert!(err(&clutch(&["sim", "smc_2", "--csv", "x.svg", "--plot", "x.svg"])).contains("named twice"));
}

#[test]
fn the_referee_prints_a_table_of_80_columns_and_fails_where_a_case_is_missed() {
    let o = clutch(&["referee", "P3", "X1"]);
    assert_eq!(o.status.code(), Some(0), "{}", err(&o));
    assert!(out(&o).contains("P3  A brake that closes at 0.1 s stops a sliding mass"), "{}", out(&o));
    assert!(narrow(&out(&o)), "{}", out(&o));
    // Three engines, with names that --engine takes.
    let o = out(&clutch(&["referee", "A1"]));
    assert!(o.contains("  system  dormand_prince  exact_flow\n") && narrow(&o), "{o}");
    let text = out(&clutch(&["referee", "--show", "P3"]));
    let file = folder("referee").join("mine.toml");
    std::fs::write(&file, text.replace("value = 1.1", "value = 1.2")).expect("the folder is there");
    let o = clutch(&["referee", file.to_str().expect("UTF-8"), "--engine", "system"]);
    assert_eq!(o.status.code(), Some(1));
    assert!(out(&o).contains("-1e-1 !"), "{}", out(&o));
    // No engine that was asked takes it.
    assert_eq!(clutch(&["referee", "L1", "--engine", "system"]).status.code(), Some(1));
    let o = clutch(&["referee", "P9"]);
    assert_eq!(o.status.code(), Some(1));
    assert!(err(&o).starts_with("clutch: P9: no such file, and no built-in case"), "{}", err(&o));
}

#[cfg(unix)]
#[test]
fn an_export_that_is_stopped_leaves_no_file() {
    let dir = folder("stopped_export");
    let (log, table) = (dir.join("run.mcap"), dir.join("run.csv"));
    let log = log.to_str().expect("UTF-8");
    let long = ["sim", "smc_2", "-q", "--set", "run.duration_s=60", "--log", log];
    assert!(clutch(&long).status.success());
    for _ in 0..20 {
        let mut export = Command::new(env!("CARGO_BIN_EXE_clutch"))
            .args(["log", "export", log, "--out", table.to_str().expect("UTF-8")])
            .stdout(Stdio::piped())
            .spawn()
            .expect("the command starts");
        while !table.exists() && export.try_wait().expect("a child").is_none() {
            std::thread::yield_now();
        }
        let id = export.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().expect("the program kill").success());
        let o = export.wait_with_output().expect("a child");
        if o.status.code() == Some(4) {
            assert!(out(&o).starts_with("stopped; ") && !table.exists(), "{}", out(&o));
            return;
        }
        // The signal came too late.
        assert_eq!(o.status.code(), Some(0), "{}", out(&o));
        std::fs::remove_file(&table).expect("a whole table");
    }
    panic!("no export was stopped");
}

#[test]
fn figures_of_a_surface_are_not_given_of_a_law_without_one() {
    for (name, has) in [("smc_2", true), ("bench_glide_2", false)] {
        let text = out(&clutch(&["certify", name]));
        for row in ["valid up to an error rate of", "sliding surface: slope f", "layer around it"] {
            assert_eq!(text.contains(row), has, "{name}: {row}:\n{text}");
        }
    }
}

#[test]
fn tuning_prints_who_lost_and_why_in_80_columns_and_writes_what_the_other_verbs_take() {
    let dir = folder("tune");
    let file = |name: &str| dir.join(name).to_str().unwrap().to_owned();
    let (tuned, proof, page) = (file("tuned.toml"), file("proof.json"), file("tuned.html"));
    let files = ["--out", &tuned, "--save", &proof, "--html", &page];
    let o = clutch(&[&["tune", "board_smc_2", "--candidates", "2"][..], &files].concat());
    let text = out(&o);
    assert!(o.status.success(), "{}", err(&o));
    assert!(narrow(&text), "{text}");
    for words in [
        "glide in a shell: chosen",
        "PD: rougher",
        "accepted: 10 starts from rest",
        "inside a certified shell: |e| stays",
    ] {
        let flat = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(flat.contains(words), "lacks {words}:\n{text}");
    }
    let page = std::fs::read_to_string(page).unwrap();
    assert!(page.contains("<svg") && page.contains("law.glide.kp_1_s"));
    let checked = clutch(&["certify", &tuned, "--check", &proof]);
    assert!(checked.status.success(), "{}{}", out(&checked), err(&checked));
    assert!(clutch(&["sim", &tuned]).status.success());

    // Nothing certified: nothing is given out, and the last line names what limits.
    let lag = ["--set", "rig.actuator_time_constant_s=0.001", "--candidates", "1", "--out", &tuned];
    let o = clutch(&[&["tune", "board_smc_2"][..], &lag].concat());
    assert_eq!(o.status.code(), Some(2), "{}", out(&o));
    assert!(out(&o).contains("no gains are given out") && out(&o).contains("--uncertified"), "{}", out(&o));
    assert!(err(&o).contains("not written"), "{}", err(&o));
    let o = clutch(&["tune", "minimum_jerk", "--rates", "2"]);
    assert!(err(&o).contains("rates = 2: expected none, as [reference.minimum_jerk]"), "{}", err(&o));
}

#[test]
fn a_motor_axis_is_tuned_and_its_proof_and_its_voltages_go_with_it() {
    let dir = folder("tune_motor");
    let file = |name: &str| dir.join(name).to_str().unwrap().to_owned();
    let (tuned, proof, brake) = (file("tuned.toml"), file("proof.json"), file("brake.toml"));
    let ramp = ["--set", "reference={ramp={rate_deg_s=2.0}}", "--candidates", "2"];
    let o = clutch(&[&["tune", "motor_pid"][..], &ramp, &["--out", &tuned, "--save", &proof]].concat());
    let text = out(&o);
    assert!(o.status.success() && narrow(&text), "{}{text}", err(&o));
    let flat = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for words in ["output.lowest_v = -0.597", "output.highest_v = 3", "k_t 0.05 N m/V", "volts -0.597 … 3"]
    {
        assert!(flat.contains(words), "lacks {words}:\n{text}");
    }
    let checked = clutch(&["certify", &tuned, "--check", &proof]);
    assert!(checked.status.success(), "{}{}", out(&checked), err(&checked));
    let told = out(&checked).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(told.contains("|e| stays below"), "{told}");
    // Another output is another loop.
    let wide = clutch(&["certify", &tuned, "--check", &proof, "--set", "output.highest_v=2.5"]);
    assert!(!wide.status.success(), "{}", out(&wide));
    // A brake's rig file is none of a motor, and the other way round.
    let o = clutch(&["identify", "board_smc_2", "--out", &brake]);
    assert!(o.status.success(), "{}", err(&o));
    for verb in ["tune", "certify", "sim"] {
        let o = clutch(&[verb, "motor_pid", "--identified", &brake]);
        assert!(
            err(&o).contains("rig.actuator = motor: expected a brake, as the rig file was identified with"),
            "{verb}: {}",
            err(&o)
        );
    }
    // Along its own path nothing is certified, and the reason is told once.
    let o = clutch(&["tune", "motor_pid", "--candidates", "1", "--set", "run.duration_s=4"]);
    let text = out(&o);
    assert_eq!(o.status.code(), Some(2), "{text}");
    let flat = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        flat.contains(
            "no law is certified here: the sampled-data certificate does not cover a path that is no ramp"
        ),
        "{text}"
    );
    assert!(flat.contains("sticks do not count") && narrow(&text), "{text}");
}

#[test]
fn the_map_has_80_columns_a_legend_and_the_cause_of_each_cell() {
    let dir = folder("map");
    let (svg, html) = (dir.join("map.svg"), dir.join("map.html"));
    let files = ["--plot", svg.to_str().unwrap(), "--html", html.to_str().unwrap()];
    let gains = ["--x", "law.pd.kp_v_rad=500:20000:14", "--y", "law.pd.kd_v_s_rad=25,50"];
    let few = ["--rates", "2,6,20", "--discs", "2"];
    let o = clutch(&[&["map", "bench_pd_2"][..], &gains, &few, &files].concat());
    let text = out(&o);
    assert!(o.status.success(), "{}", err(&o));
    assert!(narrow(&text), "{text}");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "PD at 2 °/s, bench: lowest rate without a stick, °/s");
    let row = lines.iter().find(|line| line.starts_with("     50 ")).expect(&text);
    // Fourteen cells of five columns, the last but for its end.
    assert_eq!(row.chars().count(), 8 + 14 * 5, "{row}");
    assert!(row.ends_with("█ --U"), "{row}");
    for words in [
        "   2.0  lowest rate",
        "    --  at every rate",
        "     U  Unstable:",
        "     J  Jolt:",
        "runs on discs 1 to 2",
    ] {
        assert!(text.contains(words), "lacks {words}:\n{text}");
    }
    let svg = std::fs::read_to_string(svg).unwrap();
    assert!(svg.starts_with("<svg") && svg.contains("--U") && svg.contains("law.pd.kd_v_s_rad"));
    let page = std::fs::read_to_string(html).unwrap();
    assert!(page.contains("<svg") && page.contains("U Unstable") && page.contains("rig.delay_ticks"));
}

#[test]
fn a_map_as_json_has_the_evidence_and_with_one_key_it_is_against_rates() {
    let few = ["--rates", "2,20", "--discs", "2", "--json"];
    let gains = ["--x", "law.pd.kp_v_rad=5000", "--y", "law.pd.kd_v_s_rad=50"];
    let o = clutch(&[&["map", "bench_pd_2"][..], &gains, &few].concat());
    let whole: serde_json::Value = serde_json::from_slice(&o.stdout).expect("JSON alone");
    let cell = &whole["map"]["cells"][0][0];
    assert_eq!((&cell["rate_deg_s"], &cell["cause"]), (&20.0.into(), &"sampled_loop".into()), "{whole}");
    assert_eq!((&cell["below"]["rate_deg_s"], &cell["below"]["failing"]), (&2.0.into(), &"sticks".into()));
    let radius = cell["evidence"]["spectral_radius"].as_f64().unwrap();
    assert!((radius - 1.0227).abs() < 1e-4, "{radius}");
    let o = clutch(&[&["map", "bench_pd_2", "--x", "law.pd.kd_v_s_rad=50,100"][..], &few].concat());
    let whole: serde_json::Value = serde_json::from_slice(&o.stdout).expect("JSON alone");
    let column = &whole["map"]["columns"][0]["rates"];
    let discs = |rate: usize| column[rate]["failures"].as_array().map(Vec::len);
    assert_eq!((discs(0), discs(1)), (Some(2), Some(0)), "{whole}");
    assert_eq!(column[0]["evidence"]["causes"][0], "sampled_loop");
}

#[test]
fn a_map_that_cannot_be_is_refused_by_key_value_and_expectation() {
    for (args, code, said) in [
        (&["--x", "kp"][..], 64, "expected KEY=VALUES"),
        (&["--x", "law.pd.kp_v_rad=1:2"], 64, "1:2: expected LOW:HIGH:NUMBER"),
        (&["--x", "law.pd.kp_v_rad=2:1:3"], 64, "2:1:3: expected LOW < HIGH and 2 to 1000 values"),
        (&["--x", "law.pd.kp_v_rad=a,b"], 64, "a,b: expected LOW:HIGH:NUMBER"),
        (&["--y", "law.pd.kp_v_rad=1,2"], 64, "--x"),
        (&["--discs", "-1"], 64, "-1"),
        (&["--discs", "0"], 1, "bench_pd_2: discs = 0: expected a whole number from 1 to 10000"),
        (&["--rates", "0,1"], 1, "bench_pd_2: rates = 0: expected finite numbers above 0 °/s"),
        (&["--x", "law.pd.kp_v_rad=-5"], 1, "bench_pd_2: law.pd.kp_v_rad = -5: expected"),
        (&["--x", "law.pd.kp=5"], 1, "kp_v_rad"),
        (&["--plot", "map.pdf"], 1, "map.pdf: the name of a figure must end in .svg or .png"),
    ] {
        let o = clutch(&[&["map", "bench_pd_2"][..], args].concat());
        assert_eq!(o.status.code(), Some(code), "{args:?}: {}", err(&o));
        assert!(err(&o).contains(said), "{args:?}: {}", err(&o));
        assert!(out(&o).is_empty(), "{args:?}");
    }
    let o = clutch(&["map", "minimum_jerk"]);
    assert!(err(&o).contains("minimum_jerk: reference: expected a ramp"), "{}", err(&o));
}

#[test]
fn a_rig_is_identified_and_its_file_is_what_other_verbs_take() {
    let dir = folder("identified");
    let path = |name: &str| dir.join(name).display().to_string();
    let (rig, logs) = (path("rig.toml"), path("logs"));
    let hold = ["--set", "safety.on_fault.hold.volts_v=9.9"];
    let o = clutch(
        &[&["identify", "board_smc_2", "--set", "rig.base=bench", "--out", &rig, "--log", &logs][..], &hold]
            .concat(),
    );
    assert_eq!(o.status.code(), Some(0), "{}", err(&o));
    assert!(out(&o).contains("T/J  ") && out(&o).contains("  lag  "), "{}", out(&o));
    assert!(out(&o).ends_with(&format!("\nwrote {rig}\n")), "{}", out(&o));
    assert!(narrow(&err(&o)), "{}", err(&o));
    // All that is printed fits a terminal.
    assert!(narrow(&out(&o)), "{}", out(&o));

    let o = clutch(&[&["certify", "board_smc_2", "--json", "--identified", &rig][..], &hold].concat());
    let certificate: serde_json::Value = serde_json::from_slice(&o.stdout).expect("JSON");
    let inertia = &certificate["bounds"]["inertia_kg_m2"];
    // As a ratio to the model's torque: J T_model/T of the rig.
    let truth = 0.0017 * 0.2 / 0.2094;
    let ends = [inertia[0].as_f64(), inertia[1].as_f64()].map(Option::unwrap);
    assert!(ends[0] < truth && truth < ends[1] && ends[1] / ends[0] < 1.03, "{truth}: {inertia}");

    // What was found of a delay is that of the certificate, or nothing is certified.
    let found: toml::Table = std::fs::read_to_string(&rig).unwrap().parse().unwrap();
    let with_a_delay = |from: f64, to: f64| {
        let mut file = found.clone();
        let of = file["identified"]["delay_s"].as_table_mut().unwrap();
        for (key, value) in [("low", from), ("value", 0.5 * (from + to)), ("high", to)] {
            of.insert(key.to_owned(), toml::Value::Float(value));
        }
        let written = path("delayed.toml");
        std::fs::write(&written, file.to_string()).unwrap();
        written
    };
    let delayed = with_a_delay(0.00095, 0.00109);
    let unfolded = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let refusal = "rig.delay_ticks = 0: expected 1: the rig file has a delay of 0.95 to 1.09 ms";
    for verb in [&["certify", "--sampled"][..], &["loop"]] {
        let o = clutch(&[verb, &["board_smc_2", "--identified", &delayed], &hold].concat());
        assert_eq!(o.status.code(), Some(1), "{}", out(&o));
        assert!(unfolded(&err(&o)).contains(refusal), "{}", err(&o));
    }
    let none = ["--set", "rig.delay_ticks=0", "--set", "law.glide.filter.delay_ticks=0"];
    let o = clutch(&[&["sim", "bench_glide_2", "--identified", &delayed][..], &none].concat());
    let told = unfolded(&err(&o));
    assert!(o.status.success() && told.contains(refusal), "{told}");
    assert!(told.contains("law.glide.filter.delay_ticks = 0: expected 1"), "{told}");
    let one = [&hold[..], &["--set", "rig.delay_ticks=1"]].concat();
    let o = clutch(&[&["certify", "board_smc_2", "--sampled", "--identified", &delayed], &one[..]].concat());
    assert!(out(&o).contains("1 tick of delay") && !err(&o).contains("rig file"), "{}", err(&o));
    let between = with_a_delay(0.0012, 0.0014);
    let o = clutch(&[&["certify", "board_smc_2", "--sampled", "--identified", &between], &one[..]].concat());
    assert!(unfolded(&err(&o)).contains("which is no whole number of periods"), "{}", err(&o));

    // The logs give the same, and one of them what it can.
    let o = clutch(&["identify", "--json", "--from", &format!("{logs}/releases.mcap")]);
    let told: serde_json::Value = serde_json::from_slice(&o.stdout).expect("JSON");
    let pull = &told["parameters"]["pull_rad_s2"];
    let truth = 0.2094 * 9.81 * 0.024 / 0.0017;
    assert!(pull["low"].as_f64() < Some(truth) && Some(truth) < pull["high"].as_f64(), "{pull}");
    assert!(told["parameters"]["hold_v"]["refused"].is_string(), "{told}");

    // The same logs are not those of a heavier rig; the mass has its radius.
    let same = ["releases", "ride_5", "ride_20"].map(|part| format!("{logs}/{part}.mcap"));
    let same: Vec<&str> = same.iter().map(String::as_str).collect();
    let from = [&["identify", "--from"][..], &same, &["--loaded"], &same].concat();
    let o = clutch(&[&from[..], &["--mass", "0.06", "--radius", "0.024", "--json"]].concat());
    let told: serde_json::Value = serde_json::from_slice(&o.stdout).expect("JSON");
    let why = told["separate"]["inertia_kg_m2"]["refused"].as_str().unwrap_or_default();
    assert!(why.contains("a heavier mass"), "{told}");
    let o = clutch(&[&from[..], &["--mass", "-1", "--radius", "0.024"]].concat());
    assert!(err(&o).contains("mass = -1: expected a number above 0, in kg"), "{}", err(&o));

    let missing = path("none.toml");
    let o = clutch(&["certify", "board_smc_2", "--identified", &missing]);
    assert_eq!(o.status.code(), Some(1));
    assert!(err(&o).contains("none.toml: cannot be read"), "{}", err(&o));
}

#[test]
fn a_motor_axis_is_identified_and_its_file_is_taken() {
    let dir = folder("identified_motor");
    let path = |name: &str| dir.join(name).display().to_string();
    let (rig, map) = (path("rig.toml"), path("map.toml"));
    let o = clutch(&["identify", "motor_smc", "--set", "rig.base=bench", "--out", &rig, "--map", &map]);
    assert_eq!(o.status.code(), Some(0), "{}", err(&o));
    assert!(out(&o).contains("J/K  ") && out(&o).contains("T_s/K backwards  "), "{}", out(&o));
    assert!(narrow(&out(&o)) && narrow(&err(&o)), "{}{}", out(&o), err(&o));
    let o = clutch(&["certify", "motor_smc", "--json", "--identified", &rig]);
    let certificate: serde_json::Value = serde_json::from_slice(&o.stdout).expect("JSON");
    let inertia = &certificate["bounds"]["inertia_kg_m2"];
    let ends = [inertia[0].as_f64(), inertia[1].as_f64()].map(Option::unwrap);
    assert!(ends[0] < 0.0017 && 0.0017 < ends[1] && ends[1] / ends[0] < 1.1, "{inertia}");
    let o = clutch(&["sim", "motor_pid", "--identified", &rig, "--map", &map, "--json"]);
    assert_eq!(o.status.code(), Some(0), "{}", err(&o));
    let o = clutch(&["identify", "motor_pid", "--fastest", "1"]);
    assert!(err(&o).contains("fastest = 1 °/s: expected 15 to 3600 °/s"), "{}", err(&o));
}

#[test]
fn identify_asks_for_consent_on_a_board_and_names_what_it_cannot_read() {
    let dir = folder("identify_refuses");
    let logs = dir.join("logs").display().to_string();
    let o = clutch(&["identify", "--port", "/dev/none", "--log", &logs]);
    assert_eq!(o.status.code(), Some(1));
    assert!(err(&o).contains("--uncertified is your consent"), "{}", err(&o));
    // An experiment's logs are never written over, whatever the board.
    std::fs::create_dir_all(dir.join("logs")).expect("a folder");
    std::fs::write(dir.join("logs/ride_5.mcap"), "a ride").expect("a file");
    let o = clutch(&["identify", "board_smc_2", "--log", &logs]);
    assert_eq!(o.status.code(), Some(1));
    assert!(err(&o).contains("holds logs already, as ride_5.mcap; name another folder"), "{}", err(&o));
    assert_eq!(std::fs::read_to_string(dir.join("logs/ride_5.mcap")).expect("it is there"), "a ride");
    let table = dir.join("t.csv");
    std::fs::write(&table, "n,u\n0,4.5\n1,4.5\n").expect("a file");
    let table = table.display().to_string();
    let o = clutch(&["identify", "--from", &table]);
    assert_eq!(o.status.code(), Some(1));
    assert!(err(&o).contains("has no column \"counts\": expected one of: n, u"), "{}", err(&o));
    let o = clutch(&["identify", "--from", &table, "--columns", "n,u"]);
    assert_eq!(o.status.code(), Some(1), "two samples show nothing");
    assert!(
        out(&o).contains("T/J: not determined; no release: 0 V for 30 ms from rest determines it"),
        "{}",
        out(&o)
    );
    std::fs::write(dir.join("x.mcap"), b"no log").expect("a file");
    let o = clutch(&["identify", "--from", &dir.join("x.mcap").display().to_string()]);
    assert_eq!(o.status.code(), Some(1));
    assert!(err(&o).contains("x.mcap"), "{}", err(&o));
}

#[test]
fn a_map_of_one_ride_makes_the_next_smoother_and_one_of_another_disc_is_dropped() {
    let dir = folder("friction_map");
    let path = |name: &str| dir.join(name).display().to_string();
    let (ride, map, second) = (path("ride.mcap"), path("map.toml"), path("second.mcap"));
    let o = clutch(&["sim", "bench_glide_2", "--set", "run.duration_s=8.0", "--log", &ride]);
    assert_eq!(o.status.code(), Some(0), "{}", err(&o));
    let o = clutch(&["identify", "bench_glide_2", "--from", &ride, "--map", &map]);
    assert_eq!(o.status.code(), Some(0), "{}", err(&o));
    assert!(out(&o).ends_with(&format!("\nwrote {map}\n")), "{}", out(&o));

    let sim = |more: &[&str]| {
        let slow = ["sim", "bench_glide_2", "--json", "--set", "reference.ramp.rate_deg_s=1.5"];
        let o = clutch(&[&slow[..], &["--set", "run.start_counts=40.0"], more].concat());
        serde_json::from_slice::<serde_json::Value>(&o.stdout).unwrap_or_else(|_| panic!("{}", err(&o)))
    };
    let rms = |told: &serde_json::Value| told["metrics"]["rms_error_rad"].as_f64().expect("a figure");
    let (without, with) = (sim(&[]), sim(&["--map", &map, "--log", &second]));
    assert!(without["friction_map"].is_null());
    assert!(with["friction_map"]["drove"].as_f64() > Some(0.8), "{with}");
    assert!(rms(&with) < 0.5 * rms(&without), "{} with the map, {} without", rms(&with), rms(&without));
    let other = sim(&["--map", &map, "--set", "run.seed=2"]);
    assert!(other["friction_map"]["dropped_s"].as_f64() < Some(1.0), "{other}");
    let alone = sim(&["--set", "run.seed=2"]);
    assert!(rms(&other) < 1.1 * rms(&alone), "{} with another's map, {} without", rms(&other), rms(&alone));

    // A file of before versions were stated is of the first; one of a later is refused.
    let text = std::fs::read_to_string(&map).expect("the map");
    assert_eq!(text.matches("\nversion = 1\n").count(), 1, "{text}");
    let of = |name: &str, version: &str| {
        std::fs::write(path(name), text.replace("version = 1\n", version)).expect("a file");
        path(name)
    };
    assert_eq!(sim(&["--map", &of("older.toml", "")])["metrics"], with["metrics"]);
    let o = clutch(&["sim", "bench_glide_2", "--map", &of("later.toml", "version = 2\nwaves = 340\n")]);
    assert_eq!(o.status.code(), Some(1));
    assert!(
        err(&o).contains("later.toml: friction_map.version = 2: expected a whole number from 1 to 1"),
        "{}",
        err(&o)
    );

    // The log has the map, and so has its replay.
    let o = clutch(&["replay", &second]);
    assert_eq!(o.status.code(), Some(0), "{}{}", out(&o), err(&o));

    let o = clutch(&["sim", "bench_pd_2", "--map", &map]);
    assert!(err(&o).contains("note: law.pd takes no map of the disc"), "{}", err(&o));
    let words = err(&o).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.ends_with("changes nothing; one that does: glide"), "{words}");
    let o = clutch(&["sim", "bench_glide_2", "--map", &ride]);
    assert_eq!(o.status.code(), Some(1));
    assert!(err(&o).contains("ride.mcap: cannot be read"), "{}", err(&o));
    let empty = path("empty.toml");
    std::fs::write(&empty, "x = 1\n").expect("a file");
    let o = clutch(&["sim", "bench_glide_2", "--map", &empty]);
    assert!(err(&o).contains("empty.toml: has no table [friction_map]; expected a file of"), "{}", err(&o));
    let o = clutch(&["identify", "board_smc_2", "--from", &path("none.mcap"), "--map", &map]);
    assert_eq!(o.status.code(), Some(1));
}

/// `clutch sweep` of 24 rows of 1.2 s each into a file of a folder.
fn sweep<'a>(file: &'a str, more: &[&'a str]) -> Output {
    let args = ["sweep", "pd_2", "--set", "run.duration_s=1.2", "--over", "law.pd.kp_v_rad=500:5000:4"];
    let over = ["--over", "law.pd.kd_v_s_rad=10,20,30", "--seeds", "2", "--out", file];
    clutch(&[&args[..], &over, more].concat())
}

#[test]
fn a_sweep_writes_for_each_row_what_sim_says_of_it() {
    let file = folder("sweep").join("a.csv");
    let name = file.to_str().expect("UTF-8");
    let o = sweep(name, &[]);
    assert!(o.status.success(), "{}", err(&o));
    assert!(out(&o).starts_with("24 of 24 rows in "), "{}", out(&o));
    let text = std::fs::read_to_string(&file).expect("a file");
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().expect("a header");
    let rows: Vec<_> = lines.collect();
    assert_eq!(rows.len(), 24);
    let at = |name: &str| header.iter().position(|column| *column == name).expect(name);
    for row in [0, 7, 23] {
        let set = |i: usize| format!("{}={}", header[i], rows[row][i]);
        let keys = [set(0), set(1), set(2), "run.duration_s=1.2".to_owned()];
        let keys = keys.iter().flat_map(|key| ["--set", key]).collect::<Vec<_>>();
        let o = clutch(&[&["sim", "pd_2", "--json"][..], &keys].concat());
        let alone: serde_json::Value = serde_json::from_str(&out(&o)).expect("JSON");
        for figure in ["max_error_rad", "rms_error_rad", "stick_slip_cycles_per_s", "jerk_rms_rad_s3"] {
            let found: f64 = rows[row][at(figure)].parse().expect("a number");
            assert_eq!(alone["metrics"][figure].as_f64(), Some(found), "{figure} of row {row}");
        }
    }
}

#[test]
fn a_sweep_that_was_cut_off_goes_on_and_ends_with_the_same_file() {
    let dir = folder("sweep_resumed");
    let (whole, cut) = (dir.join("whole.csv"), dir.join("cut.csv"));
    let (whole_name, cut_name) = (whole.to_str().expect("UTF-8"), cut.to_str().expect("UTF-8"));
    assert!(sweep(whole_name, &[]).status.success());
    let text = std::fs::read(&whole).expect("a file");
    // Within the header, after it, within a row, after one, at the end.
    let ends: Vec<usize> =
        text.iter().enumerate().filter(|(_, b)| **b == b'\n').map(|(i, _)| i + 1).collect();
    for length in [ends[0], ends[0] + 5, ends[3], ends[7] - 1, text.len() - 1, text.len()] {
        std::fs::write(&cut, &text[..length]).expect("a file");
        let o = sweep(cut_name, &["--resume"]);
        assert!(o.status.success(), "{length} bytes: {}", err(&o));
        assert!(std::fs::read(&cut).expect("a file") == text, "{length} bytes: another file");
    }
    for (bytes, expected) in [
        (&text[..10], "has no header of a sweep"),
        (&b"a,b\n1,2\n"[..], "has other columns"),
        (&[&text[..], &text[ends[0]..]].concat(), "has 48 rows, and this sweep 24"),
    ] {
        std::fs::write(&cut, bytes).expect("a file");
        let o = sweep(cut_name, &["--resume"]);
        assert_eq!(o.status.code(), Some(1));
        assert!(err(&o).contains(expected), "{}", err(&o));
        assert!(std::fs::read(&cut).expect("a file") == bytes, "a file that is refused stays as it is");
    }
    std::fs::write(&cut, &text[..ends[5]]).expect("a file");
    let other = sweep(cut_name, &["--resume", "--set", "rig.delay_ticks=1"]);
    assert!(err(&other).contains("its row 5 is not what this sweep gives"), "{}", err(&other));
    let again = sweep(whole_name, &[]);
    assert!(err(&again).contains("is there already; --resume goes on with it"), "{}", err(&again));
}

#[test]
fn rows_of_two_sweeps_are_not_mixed_and_those_that_were_refused_stay_counted() {
    let dir = folder("sweep_mixed");
    let file = dir.join("rows.csv");
    let name = file.to_str().expect("UTF-8");
    let run = |over: &str, more: &[&str]| {
        let args = ["sweep", "pd_2", "--set", "run.duration_s=1.2", "--over", over, "--out", name];
        clutch(&[&args[..], more].concat())
    };
    assert!(run("law.pd.kp_v_rad=1000,-1,2000", &[]).status.success());
    // The last row is the same in both.
    let o = run("law.pd.kp_v_rad=9000,-1,2000,3000", &["--resume"]);
    assert_eq!(o.status.code(), Some(1));
    assert!(err(&o).contains("its row 1 has other values than this sweep gives it, 9000;"), "{}", err(&o));
    let o = run("law.pd.kp_v_rad=1000,-1,2000,3000", &["--resume"]);
    assert!(
        out(&o).contains("4 of 4 rows") && out(&o).contains("3 of them from before; 1 refused"),
        "{}",
        out(&o)
    );
}

#[test]
fn a_grid_of_which_one_half_is_refused_runs_the_other() {
    let dir = folder("sweep_half");
    let file = dir.join("half.csv");
    let gains = ["--over", "law.pd.kd_v_s_rad=-1,5", "--over", "law.pd.kp_v_rad=1:100:200"];
    let o = clutch(
        &[
            &["sweep", "pd_2", "--set", "run.duration_s=1.01"][..],
            &gains,
            &["--out", file.to_str().expect("UTF-8")],
        ]
        .concat(),
    );
    assert!(out(&o).contains("400 of 400 rows") && out(&o).contains("200 refused"), "{}{}", out(&o), err(&o));
    let many = file.with_extension("many.csv");
    let many = ["--seeds", "1000000001", "--out", many.to_str().expect("UTF-8")];
    let o = clutch(&[&["sweep", "pd_2", "--over", "law.pd.kp_v_rad=1,2"][..], &many].concat());
    assert!(err(&o).contains("the grid has more than 1000000000 rows"), "{}", err(&o));
    let other = dir.join("half.xlsx");
    let o =
        clutch(&["sweep", "pd_2", "--over", "law.pd.kp_v_rad=1,2", "--out", other.to_str().expect("UTF-8")]);
    assert!(err(&o).contains("half.xlsx: expected a name that ends with .csv or .parquet"), "{}", err(&o));
    assert!(!other.exists());
}

#[test]
fn rows_that_a_sweep_refuses_say_why_and_a_sweep_without_any_other_leaves_no_file() {
    let dir = folder("sweep_refused");
    let (file, none) = (dir.join("some.csv"), dir.join("none.csv"));
    let args = |file: &Path, over: &'static str| {
        clutch(&[
            "sweep",
            "pd_2",
            "--set",
            "run.duration_s=1.2",
            "--over",
            over,
            "--out",
            file.to_str().expect("UTF-8"),
        ])
    };
    let o = args(&file, "law.pd.kp_v_rad=1000,-1,2000");
    assert!(o.status.success(), "{}", err(&o));
    assert!(out(&o).contains("1 refused, with the reason in the column error"), "{}", out(&o));
    let text = std::fs::read_to_string(&file).expect("a file");
    assert!(text.lines().nth(2).is_some_and(|row| row.contains("law.pd.kp_v_rad = -1")), "{text}");
    let o = args(&none, "law.pd.kp=1,2");
    assert_eq!(o.status.code(), Some(1));
    assert!(err(&o).contains("none of the first 2 rows is a scenario that runs: "), "{}", err(&o));
    assert!(err(&o).contains("did you mean kp_v_rad?"), "{}", err(&o));
    assert!(!none.exists());
}

/// The verbs, as the help lists them.
fn verbs() -> Vec<String> {
    let help = out(&clutch(&["--help"]));
    let (_, list) = help.split_once("Commands:\n").expect("a list of verbs");
    let list = list.lines().take_while(|line| !line.is_empty());
    let names = list.filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    names.filter(|name| !name.is_empty() && *name != "help").map(str::to_owned).collect()
}

#[test]
fn every_shell_completes_every_verb_and_bash_can_read_its_script() {
    let verbs = verbs();
    assert!(verbs.len() >= 18 && verbs.iter().any(|verb| verb == "completion"), "{verbs:?}");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let o = clutch(&["--quiet", "completion", shell]);
        assert!(o.status.success(), "{}", err(&o));
        let script = out(&o);
        let words: Vec<&str> =
            script.split(|c: char| !(c.is_alphanumeric() || c == '-' || c == '_')).collect();
        for word in verbs.iter().map(String::as_str).chain(["--quiet", "--resume"]) {
            // fish writes an option without its hyphens.
            let found =
                words.contains(&word) || (shell == "fish" && words.contains(&word.trim_start_matches('-')));
            assert!(found, "{shell} does not know {word}");
        }
        if shell == "bash" {
            let file = folder("completion").join("clutch.bash");
            std::fs::write(&file, &script).expect("a file");
            let read = Command::new("bash").arg("-n").arg(&file).output().expect("bash");
            assert!(read.status.success() && read.stderr.is_empty(), "{}", err(&read));
        }
    }
    assert_eq!(clutch(&["completion", "csh"]).status.code(), Some(64));
}

#[test]
fn the_manual_has_a_page_for_every_verb() {
    let dir = folder("man").join("man1");
    let name = dir.to_str().expect("UTF-8");
    for _ in 0..2 {
        // The second time over the first, as an upgrade does.
        let o = clutch(&["--quiet", "man", "--out", name]);
        assert!(o.status.success() && out(&o).is_empty(), "{}{}", out(&o), err(&o));
    }
    let page = |name: &str| std::fs::read_to_string(dir.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    let start = page("clutch.1");
    for verb in verbs() {
        let text = page(&format!("clutch-{verb}.1"));
        for part in
            [format!(".TH clutch-{verb} 1 "), ".SH NAME".into(), ".SH SYNOPSIS".into(), ".SH OPTIONS".into()]
        {
            assert!(text.contains(&part), "{verb}: no {part}:\n{text}");
        }
        assert!(start.contains(&format!("clutch\\-{verb}(1)")), "clutch.1 does not name {verb}");
    }
    assert!(page("clutch-log-export.1").contains("\\-\\-channel"));
    let o = clutch(&["man", "--out", dir.join("clutch.1").to_str().expect("UTF-8")]);
    assert_eq!(o.status.code(), Some(1));
    assert!(err(&o).contains("clutch.1: pages cannot be written"), "{}", err(&o));
}

/// Columns and rows of a table.
fn rows_of(file: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let text = std::fs::read_to_string(file).expect("a table");
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    (lines.next().expect("a header"), lines.collect())
}

#[test]
fn a_table_of_a_log_reads_back_as_the_logs_records_bit_for_bit() {
    use clutch_log::{InChannel, Kind, Limits, Value, names::name_of};

    fn compare<R: InChannel>(records: &[R], terms: &[String], file: &Path) {
        let (header, rows) = rows_of(file);
        let columns = R::CHANNEL.columns(terms);
        let names: Vec<&str> =
            ["time_s"].into_iter().chain(columns.iter().map(|(name, _)| name.as_str())).collect();
        assert_eq!(header, names);
        assert_eq!(rows.len(), records.len());
        for (row, record) in rows.iter().zip(records) {
            let time: f64 = row[0].parse().expect("a time");
            assert_eq!((time * 1e9).round() as u64, record.time_ns());
            let values: Vec<Value> = record.values().collect();
            assert_eq!(row.len(), 1 + values.len());
            for ((text, value), (name, kind)) in row[1..].iter().zip(values).zip(&columns) {
                let same = match (value, kind) {
                    (Value::Real(x), _) => {
                        text.parse::<f64>().is_ok_and(|found| found.to_bits() == x.to_bits())
                    }
                    (Value::Flag(x), _) => *text == u8::from(x).to_string(),
                    (Value::Whole(x), Kind::Enum(_, names)) => text == name_of(names, x as u8),
                    (Value::Whole(x), _) => text.parse() == Ok(x),
                };
                assert!(same, "{name}: {text} for {value:?}");
            }
        }
    }

    let dir = folder("log_export");
    let path = |name: &str| dir.join(name).display().to_string();
    let log = path("run.mcap");
    let o = clutch(&["sim", "smc_2", "--set", "run.duration_s=1.2", "--log", &log]);
    assert!(o.status.success(), "{}", err(&o));
    let read = clutch_log::read(&log, &Limits::default()).expect("a log");
    assert!(read.samples.len() > 900 && read.truths.len() > 900 && !read.header.term_names.is_empty());
    for channel in ["sample", "command", "truth"] {
        let table = dir.join(format!("{channel}.csv"));
        let o =
            clutch(&["log", "export", &log, "--channel", channel, "--out", table.to_str().expect("UTF-8")]);
        assert_eq!(o.status.code(), Some(0), "{}", err(&o));
        assert!(narrow(&out(&o)) && out(&o).contains(" rows\nwrote "), "{}", out(&o));
        match channel {
            "sample" => compare(&read.samples, &read.header.term_names, &table),
            "command" => compare(&read.commands, &read.header.term_names, &table),
            _ => compare(&read.truths, &read.header.term_names, &table),
        }
    }

    // A file that is there stays; a channel that is no table is refused, and nothing is left behind.
    let before = std::fs::read(dir.join("command.csv")).expect("a table");
    let again = clutch(&["log", "export", &log, "--out", &path("command.csv")]);
    assert_eq!(again.status.code(), Some(1));
    assert!(err(&again).contains("command.csv: exists already"), "{}", err(&again));
    assert!(std::fs::read(dir.join("command.csv")).expect("a table") == before);
    // Another form is another program's, which is named; Parquet where the command is built without it.
    for name in if cfg!(feature = "parquet") { &["run.arrow"][..] } else { &["run.arrow", "run.parquet"] } {
        let arrow = clutch(&["log", "export", &log, "--out", &path(name)]);
        let advice = format!("clutch.read_log({log:?}).export({:?}, \"command\")", path(name));
        assert!(arrow.status.code() == Some(1) && err(&arrow).contains(&advice), "{}", err(&arrow));
    }
    let other = clutch(&["log", "export", &log, "--out", &path("run.xlsx")]);
    assert!(err(&other).contains("run.xlsx: expected a name that ends with .csv"), "{}", err(&other));
    let none = clutch(&["log", "export", &path("sample.csv"), "--out", &path("none.csv")]);
    assert_eq!(none.status.code(), Some(1), "{}", out(&none));
    assert!(!dir.join("none.csv").exists() && !dir.join("run.parquet").exists());
    let other = clutch(&["log", "export", &log, "--channel", "commands", "--out", &path("none.csv")]);
    assert_eq!(other.status.code(), Some(64));

    // A log that was cut gives its part.
    let bytes = std::fs::read(&log).expect("a log");
    std::fs::write(path("cut.mcap"), &bytes[..bytes.len() * 3 / 4]).expect("a file");
    let o = clutch(&["-q", "log", "export", &path("cut.mcap"), "--out", &path("cut.csv")]);
    assert_eq!(o.status.code(), Some(5), "{}", err(&o));
    let (_, part) = rows_of(&dir.join("cut.csv"));
    let (_, whole) = rows_of(&dir.join("command.csv"));
    assert!(!part.is_empty() && part.len() < whole.len() && part == whole[..part.len()]);
}
