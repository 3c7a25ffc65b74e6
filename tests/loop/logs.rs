//! Logs of simulations and loops: replayed, compared, damaged, cut short.

use crate::harness::{
    alone, beside_others, clutch, flat, folder, program, read_log, replays_identically, run, start,
};
use clutch_log::{CommandRecord, LogWriter, Record, channel_table};
use clutch_sim::Scenario;
use clutch_sim::progress::UNWATCHED;
use clutch_sim::scenario::BUILT_IN;
use std::path::{Path, PathBuf};
use std::process::Command;

#[test]
fn the_docs_have_the_channel_table_of_the_code() {
    let docs = include_str!("../../docs/log.md");
    assert!(docs.contains(channel_table().trim_end()), "docs/log.md lacks:\n{}", channel_table());
}

/// Logs that commit 7612aad wrote, before each parameter was declared once.
const FORMER: [&str; 4] = ["pd_2", "ctc_2", "smc_2", "bench_smc_2"];

#[test]
fn a_former_log_replays_identically_under_its_own_scenario_and_under_todays() {
    for name in FORMER {
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("loop/former").join(name).with_extension("mcap");
        let log = read_log(&path);
        assert!(log.samples.len() == 100 && log.commands.len() == 100, "{name}");
        let built_in = BUILT_IN.iter().find(|built_in| built_in.name == name).unwrap();
        let replayed = |set: &[(&str, &str)]| {
            let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
            let scenario = Scenario::parse(name, built_in.toml, &set).unwrap();
            clutch_loop::replay::replay(&log, &scenario, UNWATCHED).unwrap()
        };
        let run_of = [("run.duration_s", "0.1"), ("run.settle_s", "0.02")];
        let replay = replayed(&run_of);
        assert_eq!(replay.commands.len(), 100, "{name}");
        for (logged, again) in log.commands.iter().zip(&replay.commands) {
            // A law may have had a term more: PD its demand.
            let common = again.terms.len().min(logged.terms.len());
            let bits = |c: &CommandRecord| {
                let target = [c.target_position, c.target_velocity, c.target_acceleration];
                let law = [c.voltage, c.demand, c.error, c.error_rate];
                let reals = target.iter().chain(&law).chain(&c.terms[..common]);
                (c.tick, c.code, c.limit, reals.map(|x| x.to_bits()).collect::<Vec<_>>())
            };
            assert_eq!(bits(logged), bits(again), "{name}");
        }
        // Another filter gives other bits.
        let other = replayed(&[run_of[0], run_of[1], ("velocity.smoothed_derivative.smoothing", "0.7")]);
        assert!(other.first.is_some(), "{name}");
        // Its own scenario has the keys of that version.
        let again = run(&["replay", path.to_str().unwrap()]);
        assert!(again.expect(0).out.contains("identical over 100 ticks"), "{name}");
    }
}

#[test]
fn the_log_of_every_simulation_with_an_encoder_replays_identically() {
    let _guard = beside_others();
    let folder = folder("sim-logs");
    let mut replayed = 0;
    for built_in in BUILT_IN {
        let scenario = Scenario::parse(built_in.name, built_in.toml, &[]).unwrap();
        let log = folder.join(format!("{}.mcap", built_in.name));
        let path = log.to_str().unwrap();
        let _ = run(&["sim", built_in.name, "--log", path]).expect(0);
        let read = read_log(&log);
        assert!(read.complete && read.commands.len() as u64 == scenario.ticks(), "{}", built_in.name);
        if scenario.spec().rig.encoder.quantised {
            replays_identically(&log);
            replayed += 1;
        } else {
            let _ = run(&["replay", path]).expect(1).says(&["ideal sensor", "cannot be replayed"]);
        }
    }
    assert!(replayed >= 3, "{replayed}");
}

/// Half a second of the loop on a simulated board.
fn short_loop(log: &Path) {
    let args = [
        "loop",
        "board_smc_2",
        "--duration",
        "0.5",
        "--set",
        "run.settle_s=0",
        "--log",
        log.to_str().unwrap(),
    ];
    let _ = run(&args).expect(0).prints(&["the path is done"]);
}

#[test]
fn other_parameters_are_compared_and_drawn() {
    let _alone = alone();
    let folder = folder("replay-set");
    let (log, plot) = (folder.join("run.mcap"), folder.join("compare.svg"));
    short_loop(&log);
    replays_identically(&log);
    let path = log.to_str().unwrap();
    let args = ["replay", path, "--set", "law.smc.kp_v=4", "--plot", plot.to_str().unwrap()];
    let done =
        run(&args).expect(0).prints(&["with other parameters, open loop", "RMS difference of the voltage"]);
    let row = done.out.lines().find(|l| l.contains("ticks with another code")).expect("the row");
    let other: u64 = row.split_whitespace().last().and_then(|n| n.parse().ok()).expect("a number");
    assert!(other > 100, "{}", done.out);
    let svg = std::fs::read_to_string(&plot).unwrap();
    assert!(svg.starts_with("<svg") || svg.contains("<svg "), "{}", &svg[..100.min(svg.len())]);
    assert!(svg.contains("replayed"));
    let _ = run(&["replay", path, "--set", "law.smc.kp=4"]).expect(1).says(&["unknown key"]);
}

#[test]
fn one_changed_count_is_found_with_its_tick_and_field() {
    let _alone = alone();
    let folder = folder("replay-damaged");
    let (log, damaged) = (folder.join("run.mcap"), folder.join("damaged.mcap"));
    short_loop(&log);
    let read = read_log(&log);
    let at = 300;
    let tick = read.samples[at].tick;
    let mut header = read.header.clone();
    header.extra.sort();
    let mut writer = LogWriter::create(&damaged, &header).unwrap();
    let mut events = read.events.iter().peekable();
    for (i, (sample, command)) in read.samples.iter().zip(&read.commands).enumerate() {
        while let Some(event) = events.next_if(|event| event.time_ns < sample.time_ns) {
            writer.write(&Record::Event(*event)).unwrap();
        }
        let mut sample = *sample;
        sample.counts += i32::from(i == at);
        writer.write(&Record::Sample(sample)).unwrap();
        writer.write(&Record::Command(*command)).unwrap();
    }
    for event in events {
        writer.write(&Record::Event(*event)).unwrap();
    }
    let _ = writer.finish().unwrap();
    let found = run(&["replay", damaged.to_str().unwrap()]).expect(3);
    let found = found.prints(&[&format!("differs: tick {tick}, "), "logged ", "replayed "]);
    let field = found.out.split(&format!("tick {tick}, ")).nth(1).and_then(|t| t.split(':').next());
    assert!(
        // The state, where the envelope knows that the shaft cannot be a count further.
        ["state", "limit", "code", "voltage_v", "demand_v", "error_rad"].contains(&field.unwrap()),
        "the first field that a count reaches: {}",
        found.out
    );
}

/// A log of a simulation, with a byte of the chunk changed that lies in the middle of the file.
fn with_a_damaged_chunk(folder: &Path) -> (PathBuf, u64) {
    let (log, damaged) = (folder.join("run.mcap"), folder.join("damaged.mcap"));
    let _ = run(&["sim", "pd_2", "--log", log.to_str().unwrap()]).expect(0);
    let ticks = read_log(&log).commands.len() as u64;
    let mut bytes = std::fs::read(&log).unwrap();
    let (mut at, middle) = (8, bytes.len() / 2);
    // A record is its kind, its length and its bytes; that of a chunk is 6.
    loop {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        if bytes[at] == 6 && at > middle {
            bytes[at + 9 + length / 2] ^= 0x10;
            break;
        }
        at += 9 + length;
    }
    std::fs::write(&damaged, bytes).unwrap();
    (damaged, ticks)
}

#[test]
fn a_damaged_chunk_is_a_gap_and_no_difference() {
    let _guard = beside_others();
    let folder = folder("gap");
    let (damaged, ticks) = with_a_damaged_chunk(&folder);
    let recovered = folder.join("recovered.mcap");
    let _ = run(&["log", "recover", damaged.to_str().unwrap(), recovered.to_str().unwrap()]).expect(0);
    let _ = run(&["log", "info", damaged.to_str().unwrap()]).expect(5).prints(&["2 damaged places", "chunk"]);
    for log in [&damaged, &recovered] {
        let done = run(&["replay", log.to_str().unwrap()]).expect(5);
        let done = done.prints(&["a gap: ", "ticks behind it are not comparable", "identical over "]);
        assert!(!done.out.contains("differs"), "{}", done.out);
        let number = |line: &str| -> u64 {
            let line = done.out.lines().find(|l| l.contains(line)).expect("the line");
            line.split_whitespace().find_map(|word| word.parse().ok()).expect("a number")
        };
        let (before, behind) = (number("identical over"), number("a gap"));
        assert!(
            before > ticks / 3 && behind > ticks / 4 && before + behind < ticks,
            "{before} {behind} {ticks}"
        );
    }
    let _ = run(&["log", "info", recovered.to_str().unwrap()]).expect(0).prints(&["damaged at byte"]);
    let done = run(&["replay", damaged.to_str().unwrap(), "--set", "law.pd.kp_v_rad=200"]).expect(5);
    let _ = done.prints(&["not comparable", "with other parameters"]);
}

#[test]
fn names_from_elsewhere_do_not_reach_the_terminal_as_commands() {
    let _guard = beside_others();
    let log = folder("names").join("run.mcap");
    let header = clutch_log::Header {
        scenario_name: "\x1b[2J\nrun.mcap: complete".into(),
        port: "\u{9b}31m".into(),
        extra: vec![("board\r".into(), "\u{202e}x\x07".into())],
        ..clutch_log::Header::default()
    };
    let _ = LogWriter::create(&log, &header).unwrap().finish().unwrap();
    let done = run(&["log", "info", log.to_str().unwrap()]).expect(0);
    assert!(done.out.contains("\\u{1b}[2J\\nrun.mcap"), "{}", done.out);
    let done_too = run(&["sim", "a\x1b[2Jb"]).expect(1);
    for text in [done.out, done_too.err] {
        assert!(!text.contains(|c: char| c != '\n' && (c.is_control() || c == '\u{202e}')), "{text:?}");
    }
}

#[test]
fn summary_and_log_tell_how_late_wake_ups_were() {
    let _alone = alone();
    let log = folder("wake").join("run.mcap");
    let path = log.to_str().unwrap();
    let args = ["loop", "--pace=clock", "--duration=0.5", "--set=run.settle_s=0", "--json", "--log", path];
    let told = run(&args).expect(0).json();
    let (count, most) = (told["wake"]["count"].as_u64().unwrap(), told["wake"]["max_us"].as_f64().unwrap());
    let late: Vec<u32> = read_log(&log).samples.iter().map(|sample| sample.wake_us).collect();
    // No clock wakes a thread before its time, and none in less than no time.
    assert!(count >= 400 && late.iter().filter(|us| **us > 0).count() > late.len() / 2, "{count}: {late:?}");
    assert!(late.iter().all(|us| f64::from(*us) <= most), "{most}: {late:?}");
    // With the board's samples, and a board whose clock waits for this machine, nothing can be measured.
    let args = ["loop", "--duration=0.5", "--set=run.settle_s=0"];
    let _ = run(&args).expect(0).prints(&["wake-up late by p50 / p99 / p99.9 / max", "not measured"]);
}

#[test]
fn a_scenario_without_end_is_refused() {
    let _guard = beside_others();
    let _ = run(&["sim", "/dev/zero"]).expect(1).says(&["/dev/zero", "more than 16 MiB"]);
    for option in ["--map", "--identified"] {
        let refused = run(&["sim", "bench_glide_2", option, "/dev/zero"]).expect(1);
        let _ = refused.says(&["/dev/zero: cannot be read", "more than 16 MiB"]);
    }
}

/// The checks of every run with a log that was cut short.
#[track_caller]
fn cut_short(out: &str, err: &str) {
    // Lines are folded, where depends on the log's path.
    let out = flat(out);
    assert!(out.contains("the path is done"), "{out}\n{err}");
    assert!(out.contains("no space for the log"), "{out}\n{err}");
    assert!(err.contains("the log has ended early; the loop continues"), "{out}\n{err}");
}

#[test]
fn a_log_that_may_not_grow_ends_and_the_loop_goes_on() {
    let _alone = alone();
    let log = folder("file-size").join("run.mcap");
    // 64 blocks of 512 or 1024 bytes: the header fits, two seconds do not.
    let mut command = Command::new("sh");
    command.args(["-c", "ulimit -f 64; exec \"$@\"", "sh"]).arg(program());
    command.args(["loop", "board_smc_2", "--duration", "2", "--log"]).arg(&log);
    let done = start(command).done().expect(5);
    cut_short(&done.out, &done.err);
    let read = read_log(&log);
    assert!(!read.complete && read.samples.len() > 50 && read.samples.len() < 1990, "{}", read.samples.len());
    let _ =
        run(&["replay", log.to_str().unwrap()]).expect(5).prints(&["the log ended early", "identical over "]);
    let saved = log.with_file_name("saved.mcap");
    // Half a copy is not kept: it would be in the way of the next attempt.
    let mut command = Command::new("sh");
    command.args(["-c", "ulimit -f 8; exec \"$@\"", "sh"]).arg(program());
    command.args(["log", "recover"]).args([&log, &saved]);
    let _ = start(command).done().expect(1).says(&["saved.mcap", "is removed again"]);
    assert!(!saved.exists());
    let _ =
        start(clutch(&["log", "recover", log.to_str().unwrap(), saved.to_str().unwrap()])).done().expect(0);
    assert!(read_log(&saved).complete);
}

#[test]
fn a_full_disk_ends_the_log_and_the_loop_goes_on() {
    let _alone = alone();
    let folder = folder("disk-full");
    // A separate disk, visible only to these processes.
    let mount = "mount -t tmpfs -o size=64k none \"$1\"";
    let may = Command::new("unshare").args(["-m", "sh", "-c", mount, "sh"]).arg(&folder).output();
    if !may.is_ok_and(|done| done.status.success()) {
        println!("skipped: this user may not mount a disk of his own");
        return;
    }
    let script = format!(
        "{mount} && \"$2\" loop board_smc_2 --duration 2 --log \"$1/run.mcap\"; code=$?; \
         \"$2\" log info \"$1/run.mcap\"; exit $code"
    );
    let mut command = Command::new("unshare");
    command.args(["-m", "sh", "-c", &script, "sh"]).arg(&folder).arg(program());
    let done = start(command).done().expect(5);
    cut_short(&done.out, &done.err);
    assert!(done.out.contains("/sample"), "{}", done.out);
}
