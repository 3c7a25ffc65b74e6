//! The layouts for viewers of logs name channels and fields that logs have.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use clutch_log::CHANNELS;
use serde_json::Value;
use std::collections::BTreeSet;

const FOXGLOVE: &str = include_str!("../../../examples/layouts/foxglove.json");
const PLOTJUGGLER: &str = include_str!("../../../examples/layouts/plotjuggler.xml");

/// Fails unless a log has the field `topic` + `separator` + its name, or the topic if there is no name.
#[track_caller]
fn is_in_logs(path: &str, separator: char) {
    let (topic, field) = path[1..]
        .split_once(separator)
        .map_or((path, None), |(topic, field)| (&path[..=topic.len()], Some(field)));
    let channel = CHANNELS.iter().find(|channel| channel.topic == topic);
    let channel = channel.unwrap_or_else(|| panic!("{path}: logs have no {topic}"));
    if let Some(field) = field {
        // The law's terms have names of their own.
        let known = &channel.fields[..channel.fields.len() - channel.terms];
        assert!(known.iter().any(|f| f.name == field), "{path}: {topic} has no {field}");
    }
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
fn foxgloves_layout_names_what_logs_have() {
    let layout: Value = serde_json::from_str(FOXGLOVE).unwrap();
    let mut paths = Vec::new();
    texts(&layout, "value", &mut paths);
    texts(&layout, "topicPath", &mut paths);
    paths.iter().for_each(|path| is_in_logs(path, '.'));
    assert!(paths.len() >= 15, "{paths:?}");

    // Each viewer looks for a panel's title under a key of its own.
    for (name, panel) in layout["configById"].as_object().unwrap() {
        let title = panel["foxglovePanelTitle"].as_str().unwrap_or_else(|| panic!("{name} has no title"));
        assert_eq!(panel["lichtblickPanelTitle"], title);
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

#[test]
fn plotjugglers_layout_names_what_logs_have() {
    let layout = roxmltree::Document::parse(PLOTJUGGLER).unwrap();
    let curves: Vec<_> = layout.descendants().filter(|node| node.has_tag_name("curve")).collect();
    curves.iter().for_each(|curve| is_in_logs(curve.attribute("name").unwrap(), '/'));
    assert!(curves.len() >= 12);
    for splitter in layout.descendants().filter(|node| node.has_tag_name("DockSplitter")) {
        let areas = splitter.children().filter(|node| node.has_tag_name("DockArea")).count();
        assert_eq!(splitter.attribute("count").unwrap(), areas.to_string());
        assert_eq!(splitter.attribute("sizes").unwrap().split(';').count(), areas);
    }
}
