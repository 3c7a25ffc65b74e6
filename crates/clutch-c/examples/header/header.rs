//! The header: types and functions from the sources of this crate, names of numbers from their declarations.

use cbindgen::{Builder, Config, Language, Style};
use clutch_core::params::Kind;
use clutch_core::supervisor::{Arrival, Cause, State};
use clutch_settings::{Declared, SETTINGS_HASH, Setting};
use std::fmt::{Debug, Write as _};
use std::path::Path;

const HEAD: &str = "\
/* libclutch: slow, smooth motion of shafts restrained by friction. Written by `cargo run -p clutch-c --example header`.
 *
 * Units are SI and radians; positions are in 2^-16 counts of the encoder. A call never allocates, never blocks and never ends
 * the program. Objects live in memory of yours, and one is not used by two threads at once.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */";

/// The header.
pub(crate) fn text() -> String {
    let config = Config {
        language: Language::C,
        style: Style::Type,
        cpp_compat: true,
        header: Some(HEAD.to_owned()),
        include_guard: Some("CLUTCH_H".to_owned()),
        no_includes: true,
        sys_includes: ["stdbool.h", "stddef.h", "stdint.h"].map(String::from).to_vec(),
        after_includes: Some(numbers()),
        usize_is_size_t: true,
        line_length: 120,
        ..Config::default()
    };
    let mut builder = Builder::new().with_config(config);
    for file in ["memory", "settings", "path", "law", "servo", "stick_slip", "safe", "axis"] {
        builder = builder.with_src(Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("src/{file}.rs")));
    }
    let mut text = Vec::new();
    builder.generate().expect("the sources of this crate").write(&mut text);
    String::from_utf8(text).expect("UTF-8")
}

/// States, causes, fates of samples; keys of settings with their choices.
fn numbers() -> String {
    let mut out = String::new();
    enumerated(&mut out, "States of control.", "STATE", State::from_u8);
    enumerated(&mut out, "Causes of the end of control.", "CAUSE", Cause::from_u8);
    enumerated(&mut out, "Fates of a sample.", "ARRIVAL", Arrival::from_u8);
    let _ = writeln!(
        out,
        "\n/* The meaning of the keys of a list of settings: compare it with clutch_settings_hash(). */\n\
         #define CLUTCH_SETTINGS_HASH UINT64_C({SETTINGS_HASH:#018x})\n\n\
         /* Settings: those of the options that are chosen are needed; others are not looked at. */\nenum {{"
    );
    for setting in Setting::all() {
        let name = setting.constant();
        let unit =
            if setting.unit().is_empty() { String::new() } else { format!(", {}", ascii(setting.unit())) };
        let _ = writeln!(out, "    CLUTCH_KEY_{name} = {}, /* {}{unit} */", setting.key, setting.kind());
    }
    out += "};\n\n/* Values of settings that are choices. */\nenum {\n";
    for setting in Setting::all() {
        let words: Vec<&str> = match setting.declared {
            Declared::Choice(choice) => choice.options.iter().map(|option| option.key).collect(),
            Declared::Row(row, _) => match row.kind {
                Kind::Word(words) => words.iter().map(|word| word.name).collect(),
                _ => continue,
            },
        };
        let name = setting.constant();
        for (value, word) in words.iter().enumerate() {
            let _ = writeln!(out, "    CLUTCH_{name}_{} = {value},", screaming(word));
        }
    }
    out + "};\n"
}

fn enumerated<E: Debug>(out: &mut String, title: &str, prefix: &str, of: fn(u8) -> Option<E>) {
    let _ = writeln!(out, "\n/* {title} */\nenum {{");
    for (number, named) in (0..=u8::MAX).filter_map(|number| of(number).map(|named| (number, named))) {
        let mut name = String::new();
        for c in format!("{named:?}").chars() {
            if c.is_uppercase() && !name.is_empty() {
                name.push('_');
            }
            name.extend(c.to_uppercase());
        }
        let _ = writeln!(out, "    CLUTCH_{prefix}_{name} = {number},");
    }
    *out += "};\n";
}

/// A word as the end of a constant's name.
fn screaming(key: &str) -> String {
    key.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' }).collect()
}

/// A unit as any compiler reads it.
fn ascii(unit: &str) -> String {
    let plain = [
        ("²", "^2"),
        ("³", "^3"),
        ("⁻¹⁶", "^-16"),
        ("√(", "sqrt("),
        ("√s", "sqrt(s)"),
        ("Ω", "Ohm"),
        ("µ", "u"),
        ("·", " "),
    ];
    plain.iter().fold(unit.to_owned(), |text, (from, to)| text.replace(from, to))
}
