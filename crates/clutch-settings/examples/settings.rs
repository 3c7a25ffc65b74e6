//! Prints the table of settings of docs/wire.md; a test holds the page against it.
//!
//! `cargo run -p clutch-settings --example settings`
#![allow(clippy::std_instead_of_core, clippy::alloc_instead_of_core, reason = "it runs on the host")]

use clutch_settings::{MAX_KNOTS, SETTINGS, SETTINGS_HASH, Setting};

fn main() {
    print!("{}", text());
}

/// The table, with what is said around it.
pub(crate) fn text() -> String {
    let mut out = format!(
        "{SETTINGS} settings, hash `{SETTINGS_HASH:#018x}`; at most {MAX_KNOTS} points of a table.\n\n\
         | key | setting | type | unit | meaning |\n|---|---|---|---|---|\n"
    );
    for s in Setting::all() {
        let unit = if s.unit().is_empty() { "–" } else { s.unit() };
        // Both ends of each interval say the same of themselves.
        let within = if s.name.to_string().starts_with("bounds.") { s.within } else { "" };
        let doc = format!("{within} {}", s.doc()).split_whitespace().collect::<Vec<_>>().join(" ");
        out += &format!("| {} | `{}` | `{}` | {unit} | {doc} |\n", s.key, s.name, s.kind());
    }
    out
}
