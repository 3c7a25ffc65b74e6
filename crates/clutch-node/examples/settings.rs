//! Prints the table of settings of docs/wire.md; a test holds the page against it.
//!
//! `cargo run -p clutch-node --example settings`
#![allow(clippy::std_instead_of_core, clippy::alloc_instead_of_core, reason = "it runs on the host")]

use clutch_node::{MAX_KNOTS, SETTINGS, SETTINGS_HASH};

fn main() {
    print!("{}", text());
}

/// The table, with what is said around it.
pub(crate) fn text() -> String {
    let mut out = format!(
        "{} settings, hash `{SETTINGS_HASH:#018x}`; at most {MAX_KNOTS} points of a table.\n\n\
         | key | setting | type | meaning |\n|---|---|---|---|\n",
        SETTINGS.len()
    );
    for s in SETTINGS {
        out += &format!("| {} | `{}` | `{}` | {} |\n", s.key, s.name, s.ty, s.doc.trim());
    }
    out
}
