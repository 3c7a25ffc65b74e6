//! The layouts for viewers of logs, held against logs that the command writes: of a simulation, and of a loop.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use clutch_log::{CHANNELS, Info, Kind, Limits};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

const FOXGLOVE: &str = include_str!("../../../examples/layouts/foxglove.json");
const PLOTJUGGLER_SIM: &str = include_str!("../../../examples/layouts/plotjuggler_sim.xml");
const PLOTJUGGLER_LOOP: &str = include_str!("../../../examples/layouts/plotjuggler_loop.xml");

/// The contents of a log of `board_smc_2` that a verb of the command writes for a test.
fn log_of(verb: &str, test: &str, options: &[&str]) -> Info {
    let log = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("layouts_{test}_{verb}.mcap"));
    let _ = std::fs::remove_file(&log); // of an earlier call
    let mut command = Command::new(env!("CARGO_BIN_EXE_clutch"));
    command.args([verb, "board_smc_2", "--log"]).arg(&log).args(options);
    let done = command.output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let info = clutch_log::info(&log, &Limits::default()).unwrap();
    assert!(info.complete);
    info
}

fn of_a_simulation(test: &str) -> Info {
    log_of("sim", test, &[])
}

fn of_a_loop(test: &str) -> Info {
    log_of("loop", test, &["--duration", "1.5", "--set", "run.settle_s=0"])
}

/// The type of the field `topic` + `separator` + its name, none of a topic alone. Fails unless logs can have it.
#[track_caller]
fn kind(path: &str, separator: char) -> Option<Kind> {
    let (topic, field) = split(path, separator);
    let channel = CHANNELS.iter().find(|channel| channel.topic == topic);
    let channel = channel.unwrap_or_else(|| panic!("{path}: logs have no {topic}"));
    // The law's terms have names of their own.
    let known = &channel.fields[..channel.fields.len() - channel.terms];
    let known = |name: &str| known.iter().find(|f| f.name == name).map(|f| f.kind);
    field.map(|field| known(field).unwrap_or_else(|| panic!("{path}: {topic} has no {field}")))
}

/// Topic and field of a path.
fn split(path: &str, separator: char) -> (&str, Option<&str>) {
    path[1..]
        .split_once(separator)
        .map_or((path, None), |(topic, field)| (&path[..=topic.len()], Some(field)))
}

/// True if a line can be drawn of it: there are two messages.
fn is_drawn(path: &str, separator: char, log: &Info) -> bool {
    let topic = split(path, separator).0;
    log.channels.iter().any(|channel| channel.topic == topic && channel.records >= 2)
}

/// Texts under this key, wherever they stand.
fn texts<'a>(json: &'a Value, key: &str, found: &mut Vec<&'a str>) {
    match json {
        Value::Object(map) => {
            found.extend(map.get(key).and_then(Value::as_str));
            map.values().for_each(|value| texts(value, key, found));
        }
        Value::Array(values) => values.iter().for_each(|value| texts(value, key, found)),
        _ => {}
    }
}

#[test]
fn foxgloves_layout_draws_both_kinds_of_log() {
    let layout: Value = serde_json::from_str(FOXGLOVE).unwrap();
    let logs = [of_a_simulation("foxglove"), of_a_loop("foxglove")];
    for (name, panel) in layout["configById"].as_object().unwrap() {
        // Each viewer looks for a panel's title under a key of its own.
        let title = panel["foxglovePanelTitle"].as_str().unwrap_or_else(|| panic!("{name} has no title"));
        assert_eq!(panel["lichtblickPanelTitle"], title);

        let mut paths = Vec::new();
        texts(panel, "value", &mut paths);
        texts(panel, "topicPath", &mut paths);
        assert!(!paths.is_empty(), "{name}");
        for path in &paths {
            let kind = kind(path, '.');
            let words = matches!(kind, Some(Kind::Enum(..) | Kind::String));
            assert!(!(name.starts_with("Plot!") && words), "{path} is no number");
            // Nobody changes a parameter, and a run from start to end has no event but its own.
            let drawn = logs.iter().any(|log| is_drawn(path, '.', log));
            assert!(drawn || ["/parameters", "/event"].contains(path), "{path}: in neither log");
        }
        // A curve of a loop alone or of a simulation alone stands beside those of both, or alone.
        let in_both = paths.iter().filter(|path| logs.iter().all(|log| is_drawn(path, '.', log)));
        let curves = in_both.count();
        match name.as_str() {
            "Plot!position" | "Plot!voltage" => assert_eq!(curves, 2, "{name}"),
            "Plot!error" => assert_eq!(curves, 1),
            "Plot!latency" | "StateTransitions!state" => assert_eq!(curves, 3, "{name}"),
            _ => {}
        }
    }

    // Each panel stands somewhere, and each that stands somewhere is there.
    let panels: BTreeSet<&str> =
        layout["configById"].as_object().unwrap().keys().map(String::as_str).collect();
    let mut placed = Vec::new();
    texts(&layout["layout"], "first", &mut placed);
    texts(&layout["layout"], "second", &mut placed);
    assert_eq!(placed.len(), panels.len());
    assert_eq!(placed.into_iter().collect::<BTreeSet<_>>(), panels);
}

/// PlotJuggler complains of each curve that a log has not, and loads an enum's names as text, which is no curve.
#[track_caller]
fn plotjuggler_finds(layout: &str, log: &Info) {
    let layout = roxmltree::Document::parse(layout).unwrap();
    let curves = layout.descendants().filter(|node| node.has_tag_name("curve"));
    let curves: Vec<&str> = curves.map(|node| node.attribute("name").unwrap()).collect();
    for curve in &curves {
        let kind = kind(curve, '/').unwrap_or_else(|| panic!("{curve} has no field"));
        assert!(!matches!(kind, Kind::Enum(..) | Kind::String), "{curve} is no number");
        assert!(is_drawn(curve, '/', log), "{curve}: none in\n{log}");
    }
    for path in ["/command/target_position_rad", "/sample/position_rad"] {
        assert!(curves.contains(&path), "{path}");
    }
    for splitter in layout.descendants().filter(|node| node.has_tag_name("DockSplitter")) {
        let areas = splitter.children().filter(|node| node.has_tag_name("DockArea")).count();
        assert_eq!(splitter.attribute("count").unwrap(), areas.to_string());
        assert_eq!(splitter.attribute("sizes").unwrap().split(';').count(), areas);
    }
}

#[test]
fn plotjugglers_layout_for_a_simulation_finds_each_curve_in_one() {
    plotjuggler_finds(PLOTJUGGLER_SIM, &of_a_simulation("plotjuggler"));
}

#[test]
fn plotjugglers_layout_for_a_loop_finds_each_curve_in_one() {
    plotjuggler_finds(PLOTJUGGLER_LOOP, &of_a_loop("plotjuggler"));
}
