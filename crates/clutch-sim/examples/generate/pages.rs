//! The parts of documentation that follow from the declarations, between markers of the pages.
//!
//! `<!-- keys:begin rig model -->` … `<!-- keys:end -->` takes every table at and below `rig` and `model`, but for those
//! of which another marker of the page names a longer key; `.` is the file itself.

use super::classes::Class;
use super::places::{Place, default_at, join};
use clutch_core::params::{Info, Kind, Nested, Row};
use clutch_sim::scenario::describe::{
    Entry, default_option, entries, expected, meaning, paragraphs, row_is_required, table_is_required,
};

/// docs/scenario.md: what a file may have, and every key.
pub(crate) fn keys(page: &str, places: &[Place]) -> Result<String, String> {
    let page =
        fill(page, places, "tables", |found| found.first().map_or(String::new(), |file| tables_of(file)))?;
    fill(&page, places, "keys", |found| {
        let tables: Vec<String> = merged(found).iter().map(|(keys, place)| keys_of(keys, place)).collect();
        tables.join("\n\n")
    })
}

/// docs/notation.md: symbol, field, unit and key of each parameter.
pub(crate) fn symbols(page: &str, places: &[Place]) -> Result<String, String> {
    fill(page, places, "symbols", |found| {
        let mut lines = vec![
            "| symbol | name in code | unit | scenario key | meaning |".to_owned(),
            "|---|---|---|---|---|".to_owned(),
        ];
        for (keys, place) in merged(found) {
            lines.extend(symbols_of(&keys, place));
        }
        lines.join("\n")
    })
}

/// docs/api.md: the classes.
pub(crate) fn references(page: &str, places: &[Place], classes: &[Class<'_>]) -> Result<String, String> {
    fill(page, places, "classes", |found| {
        let here = |class: &&Class<'_>| found.iter().any(|place| place.key == class.place.key);
        let entry = |class: &Class<'_>| format!(".. autoclass:: clutch.{}\n   :members:", class.name);
        let entries: Vec<String> = classes.iter().filter(here).map(entry).collect();
        format!("```{{eval-rst}}\n{}\n```", entries.join("\n\n"))
    })
}

/// A page, each marker of that kind with its text.
fn fill(
    page: &str,
    places: &[Place],
    kind: &str,
    text: impl Fn(&[&Place]) -> String,
) -> Result<String, String> {
    let (begin, end) = (format!("<!-- {kind}:begin "), format!("<!-- {kind}:end -->"));
    let keys: Vec<Vec<&str>> = page
        .split(&begin)
        .skip(1)
        .map(|part| part.split(" -->").next().unwrap_or_default().split(' ').collect())
        .collect();
    // The marker that names most of a key.
    let home = |key: &str| {
        let named = |part: &str| part == "." || key == part || key.starts_with(&format!("{part}."));
        let length =
            |section: &Vec<&str>| section.iter().filter(|part| named(part)).map(|part| part.len()).max();
        let found = keys.iter().enumerate().filter_map(|(i, section)| Some((length(section)?, i)));
        found.max_by_key(|(length, _)| *length).map(|(_, i)| i)
    };
    let mut parts = page.split(&begin);
    let mut out = parts.next().unwrap_or_default().to_owned();
    for (i, part) in parts.enumerate() {
        let (_, tail) =
            part.split_once(&end).ok_or_else(|| format!("{begin}{}: no {end}", keys[i].join(" ")))?;
        let found: Vec<&Place> = places.iter().filter(|place| home(&place.key) == Some(i)).collect();
        if found.is_empty() {
            return Err(format!("{begin}{}: no such table", keys[i].join(" ")));
        }
        out += &format!("{begin}{} -->\n{}\n{end}{tail}", keys[i].join(" "), text(&found));
    }
    match places.iter().find(|place| !place.key.is_empty() && home(&place.key).is_none()) {
        Some(homeless) if kind != "tables" => Err(format!("no {begin}… takes {}", homeless.key)),
        _ => Ok(out),
    }
}

/// Places with one table and one kind of option are one, with several keys.
fn merged<'a>(found: &[&'a Place]) -> Vec<(Vec<&'a str>, &'a Place)> {
    let mut all: Vec<(Vec<&str>, &Place)> = Vec::new();
    for place in found {
        let option = |p: &Place| p.option.map(|(choice, option)| (choice.name, option.key));
        match all.iter_mut().find(|(_, p)| p.table.id == place.table.id && option(p) == option(place)) {
            Some((keys, _)) => keys.push(&place.key),
            None => all.push((vec![&place.key], place)),
        }
    }
    all
}

/// The tables of a file.
fn tables_of(place: &Place) -> String {
    let mut lines = vec!["| table | | |".to_owned(), "|---|---|---|".to_owned()];
    for entry in entries(place.table) {
        lines.push(match entry {
            Entry::Row(row, _) => {
                format!("| `{}` | {} | {} |", row.key, needed(row_is_required(row)), cell(&meaning(row)))
            }
            Entry::Below(nested) => {
                let text = cell(&paragraphs(nested.doc).join(" "));
                let needed = needed(table_is_required(nested));
                match nested.info {
                    Info::Table(_) => format!("| `[{}]` | {needed} | {text} |", nested.key),
                    Info::Choice(_) => {
                        let how = if needed.is_empty() { "at most one" } else { "required, exactly one" };
                        format!("| `[{}.…]` | {how} | {text} {} |", nested.key, options(nested))
                    }
                }
            }
        });
    }
    lines.join("\n")
}

fn needed(required: bool) -> &'static str {
    if required { "required" } else { "" }
}

/// Names of a choice's options.
fn options(nested: &Nested) -> String {
    let Info::Choice(choice) = nested.info else { return String::new() };
    let default = default_option(nested.info);
    let name = |key: &str| match default == Some(key) {
        true => format!("`{key}` (default)"),
        false => format!("`{key}`"),
    };
    choice.options.iter().map(|option| name(option.key)).collect::<Vec<_>>().join(", ")
}

/// Heading, text and keys of a table.
fn keys_of(keys: &[&str], place: &Place) -> String {
    let mut text = String::new();
    if !place.key.is_empty() {
        let names: Vec<String> = keys.iter().map(|key| format!("`[{key}]`")).collect();
        text = format!("**{}**: {}", names.join(", "), paragraphs(place.doc()).join("\n\n"));
    }
    let mut rows = Vec::new();
    for entry in entries(place.table) {
        if let Entry::Row(row, table) = entry {
            let symbol = code(row.symbol);
            let range = cell(&expected(row, table));
            let default = default(&join(&place.key, row.key), row);
            rows.push(format!(
                "| `{}` | {symbol} | {default} | {range} | {} |",
                row.key,
                cell(&meaning(row))
            ));
        }
    }
    if rows.is_empty() {
        return text;
    }
    let head = "| key | symbol | default | range | meaning |\n|---|---|---|---|---|";
    let gap = if text.is_empty() { "" } else { "\n\n" };
    format!("{text}{gap}{head}\n{}", rows.join("\n"))
}

/// A parameter's default as a page shows it.
fn default(key: &str, row: &Row) -> String {
    match (default_at(key, row).as_str(), row.kind) {
        ("", _) if row.optional => "none".to_owned(),
        ("", _) => "–".to_owned(),
        (text, Kind::Real) => match text.parse::<f64>() {
            Ok(number) => number.to_string().replace('-', "−"),
            Err(_) => text.to_owned(),
        },
        (text, Kind::Word(_)) => code(text),
        (text, _) => text.to_owned(),
    }
}

fn symbols_of(keys: &[&str], place: &Place) -> Vec<String> {
    let mut lines = Vec::new();
    for entry in entries(place.table) {
        let Entry::Row(row, table) = entry else { continue };
        let unit = if row.unit.si.is_empty() { "–" } else { row.unit.si };
        let keys: Vec<String> = keys.iter().map(|key| code(&join(key, row.key))).collect();
        let symbol = if row.symbol.is_empty() { "–".to_owned() } else { code(row.symbol) };
        let meaning = cell(&paragraphs(row.doc).join(" "));
        let (name, keys) = (format!("`{}::{}`", table.name, row.field), keys.join(", "));
        lines.push(format!("| {symbol} | {name} | {unit} | {keys} | {meaning} |"));
    }
    lines
}

fn code(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!("`{text}`") }
}

/// A text within a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}
