//! Python's classes: `python/clutch/_tables.py`.

use super::classes::{Class, name, union};
use super::places::{Place, default_at, join};
use clutch_core::params::{ChoiceInfo, Info, Kind, Nested, Row, TableInfo, UNITS};
use clutch_sim::scenario::describe::{
    Entry, capital, default_option, description, entries, paragraphs, table_is_required,
};

/// Columns of a line.
const WIDTH: usize = 120;
/// Columns of a line of text.
const TEXT: usize = 110;

/// A parameter that no object has: an object of the rig has every value, so that its base says nothing.
const HIDDEN: (&str, &str) = ("RigParams", "base");
/// A parameter that a file must have and an object makes up.
const MADE_UP: (&str, &str, &str, &str) =
    ("ScenarioParams", "name", "\"\"", " By default the law's and the path's name.");

const HEAD: &str = r#""""Tables of a scenario as frozen dataclasses: written by `cargo xtask generate` from the declarations in Rust.

The native module, which holds the physics, checks the ranges.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from clutch import _mixins
from clutch._record import _Params

"#;

/// The module.
pub(crate) fn module(classes: &[Class<'_>], places: &[Place]) -> String {
    let mut out = HEAD.to_owned();
    let mut names: Vec<&str> = classes.iter().map(|class| class.name.as_str()).collect();
    names.retain(|name| !name.starts_with('_'));
    names.sort_unstable();
    out +=
        &format!("__all__ = [\n{}]\n", names.iter().map(|n| format!("    \"{n}\",\n")).collect::<String>());
    out += "\n#: Units by the endings of keys, metrics and columns.\nUNITS = {\n";
    for unit in UNITS.iter().filter(|unit| !unit.suffix.is_empty()) {
        out += &format!("    \"{}\": \"{}\",\n", unit.suffix, unit.text);
    }
    out += "}\n";
    out += "\n#: Units of a scenario's keys; empty for what has none.\nKEYS = {\n";
    for (key, row) in places.iter().flat_map(rows) {
        out += &format!("    \"{key}\": \"{}\",\n", row.unit.text);
    }
    out += "}\n";
    let mut written = Vec::new();
    for class in classes {
        write(class, classes, &mut written, &mut out);
    }
    out
}

/// The parameters of a table, by their keys in a file.
fn rows(place: &Place) -> Vec<(String, &'static Row)> {
    let row = |entry| match entry {
        Entry::Row(row, _) => Some((join(&place.key, row.key), row)),
        Entry::Below(_) => None,
    };
    entries(place.table).into_iter().filter_map(row).collect()
}

/// Writes a class after those that it is made of.
fn write(class: &Class<'_>, classes: &[Class<'_>], written: &mut Vec<String>, out: &mut String) {
    if written.contains(&class.name) {
        return;
    }
    written.push(class.name.clone());
    for entry in entries(class.place.table) {
        let Entry::Below(nested) = entry else { continue };
        for part in parts(nested, classes) {
            write(part, classes, written, out);
        }
        if let Info::Choice(choice) = nested.info
            && !written.iter().any(|name| name == union(choice))
        {
            written.push(union(choice).to_owned());
            let names: Vec<&str> =
                parts(nested, classes).into_iter().map(|part| part.name.as_str()).collect();
            *out += &format!("\n\n{}", union_of(union(choice), &names));
        }
    }
    *out += &format!("\n\n{}", class_of(class, classes));
}

/// The classes that may stand at a key.
fn parts<'a>(nested: &Nested, classes: &'a [Class<'a>]) -> Vec<&'a Class<'a>> {
    let of = |table: &'static TableInfo, option| {
        let place = Place { key: String::new(), table, option };
        let name = name(&place);
        classes.iter().find(|class| class.name == name)
    };
    match nested.info {
        Info::Table(table) => of(table, None).into_iter().collect(),
        Info::Choice(choice) => {
            choice.options.iter().filter_map(|option| of(option.table, Some((choice, option)))).collect()
        }
    }
}

fn union_of(name: &str, of: &[&str]) -> String {
    let line = format!("{name} = {}\n", of.join(" | "));
    if line.trim_end().chars().count() <= WIDTH {
        return line;
    }
    format!("{name} = (\n    {}\n)\n", of.join("\n    | "))
}

fn class_of(class: &Class<'_>, classes: &[Class<'_>]) -> String {
    let place = class.place;
    let base = class.mixin.as_ref().map_or("_Params".to_owned(), |mixin| format!("_mixins.{mixin}"));
    let mut text =
        format!("@dataclass(frozen=True, kw_only=True, repr=False)\nclass {}({base}):\n", class.name);
    let fields: Vec<Field> =
        entries(place.table).into_iter().filter_map(|entry| field(entry, place, classes)).collect();
    text += &docstring(class, &fields);
    if !place.key.is_empty() {
        text += &format!("\n    _key: ClassVar[str] = \"{}\"\n", place.key);
    }
    if !fields.is_empty() {
        text.push('\n');
    }
    for field in fields {
        let default = field.default.map_or(String::new(), |default| format!(" = {default}"));
        text += &format!("    {}: {}{default}\n", field.name, field.kind);
    }
    text
}

/// A field of a class.
struct Field {
    name: &'static str,
    /// Its type.
    kind: String,
    /// Its default, as code.
    default: Option<String>,
    /// Its type and its default for people.
    told: String,
    text: String,
}

fn field(entry: Entry, place: &Place, classes: &[Class<'_>]) -> Option<Field> {
    let table = place.table.name;
    match entry {
        Entry::Row(row, _) if (table, row.key) == HIDDEN => None,
        Entry::Row(row, of) => {
            let mut field = row_field(row, of, &default_at(&join(&place.key, row.key), row));
            if (table, row.key) == (MADE_UP.0, MADE_UP.1) {
                field.default = Some(MADE_UP.2.to_owned());
                field.text += MADE_UP.3;
            }
            Some(field)
        }
        Entry::Below(nested) => Some(nested_field(nested, classes)),
    }
}

fn row_field(row: &'static Row, of: &TableInfo, default: &str) -> Field {
    let (kind, told) = match row.kind {
        Kind::Real => ("float".to_owned(), "float".to_owned()),
        Kind::Whole => ("int".to_owned(), "int".to_owned()),
        Kind::Switch => ("bool".to_owned(), "bool".to_owned()),
        Kind::Text => ("str".to_owned(), "str".to_owned()),
        Kind::Points => ("Sequence[tuple[float, float]]".to_owned(), "sequence of (float, float)".to_owned()),
        Kind::Word(words) => {
            let words: Vec<String> = words.iter().map(|word| format!("\"{}\"", word.name)).collect();
            let words = words.join(", ");
            (format!("Literal[{words}]"), format!("{{{words}}}"))
        }
    };
    let default = match default {
        "" if row.optional => Some("None".to_owned()),
        "" => None,
        default => Some(literal(row, default)),
    };
    let optional = default.as_deref() == Some("None");
    let told = if optional { format!("{told} or None") } else { told };
    let told = default.as_ref().map_or(told.clone(), |default| format!("{told}, default {default}"));
    let kind = if optional { format!("{kind} | None") } else { kind };
    Field { name: row.key, kind, default, told, text: description(row, of) }
}

/// A default as code.
fn literal(row: &Row, default: &str) -> String {
    match row.kind {
        Kind::Real => default.parse::<f64>().map_or(default.to_owned(), |x| format!("{x:?}")),
        Kind::Switch => capital(default),
        _ => default.to_owned(),
    }
}

fn nested_field(nested: &'static Nested, classes: &[Class<'_>]) -> Field {
    let parts = parts(nested, classes);
    let names: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
    let kind = match nested.info {
        Info::Table(_) => names.join(""),
        Info::Choice(choice) => union(choice).to_owned(),
    };
    let told = match names.split_last() {
        Some((last, [])) => (*last).to_owned(),
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => kind.clone(),
    };
    let text = paragraphs(nested.doc).join(" ");
    if nested.optional {
        let told = format!("{told} or None, default None");
        return Field {
            name: nested.key,
            kind: format!("{kind} | None"),
            default: Some("None".into()),
            told,
            text,
        };
    }
    // A rig whose base says nothing has all that it needs.
    let whole = !table_is_required(nested) || nested.info.table().is_some_and(|table| table.name == HIDDEN.0);
    let first = default_option(nested.info).map_or(Some(0), |key| option_at(nested, key));
    let default = first.and_then(|i| names.get(i)).filter(|_| whole);
    Field {
        name: nested.key,
        kind,
        text: default.map_or(text.clone(), |name| format!("{text} By default `{name}()`.")),
        default: default.map(|name| format!("field(default_factory={name})")),
        told,
    }
}

fn option_at(nested: &Nested, key: &str) -> Option<usize> {
    let Info::Choice(ChoiceInfo { options, .. }) = nested.info else { return None };
    options.iter().position(|option| option.key == key)
}

fn docstring(class: &Class<'_>, fields: &[Field]) -> String {
    let paragraphs = paragraphs(class.place.doc());
    let mut text = String::new();
    for (i, paragraph) in paragraphs.iter().enumerate() {
        let quotes = if i == 0 { "\"\"\"" } else { "" };
        text += &wrapped(&format!("{quotes}{paragraph}"), 4);
        text.push('\n');
    }
    if !fields.is_empty() {
        text += "    Parameters\n    ----------\n";
        for field in fields {
            text += &format!("    {} : {}\n{}", field.name, field.told, wrapped(&field.text, 8));
        }
        text += "\n    Raises\n    ------\n    ParamError\n        A value out of range; its `field` and `value` say which.\n\n";
    }
    let example = example(class, fields);
    if !example.is_empty() {
        text += "    Examples\n    --------\n";
        let imported = example.replacen(">>> ", ">>> import clutch\n>>> ", 1);
        for line in imported.lines() {
            text += if line.is_empty() { "\n".to_owned() } else { format!("    {line}\n") }.as_str();
        }
    }
    format!("{}\n    \"\"\"\n", text.trim_end())
}

/// The example that is known, or one that shows a first default.
fn example(class: &Class<'_>, fields: &[Field]) -> String {
    let name = &class.name;
    match fields.first() {
        _ if !class.example.is_empty() => class.example.to_owned(),
        _ if fields.iter().any(|field| field.default.is_none()) => String::new(),
        None => format!(">>> clutch.{name}()\n{name}()"),
        Some(first) => {
            let shown = first.default.as_deref().unwrap_or_default().replace('"', "'");
            format!(">>> clutch.{name}().{}\n{shown}", first.name)
        }
    }
}

/// A text in lines, indented.
fn wrapped(text: &str, indent: usize) -> String {
    let margin = " ".repeat(indent);
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let line = lines.last_mut().filter(|line| {
            line.is_empty() || indent + line.chars().count() + 1 + word.chars().count() <= TEXT
        });
        match line {
            Some(line) if line.is_empty() => *line = word.to_owned(),
            Some(line) => *line += &format!(" {word}"),
            None => lines.push(word.to_owned()),
        }
    }
    lines.iter().map(|line| format!("{margin}{line}\n")).collect()
}
