//! Writes what follows from the declarations of parameters and figures and is kept in the tree: Python's classes, tables
//! of the documentation, the schema of scenario files. A test compares.
//!
//! `cargo xtask generate [--check]`

mod classes;
mod metrics;
mod pages;
mod places;
mod python;

use std::path::{Path, PathBuf};

fn main() -> Result<(), String> {
    let check = match std::env::args().skip(1).collect::<Vec<_>>().as_slice() {
        [] => false,
        [flag] if flag == "--check" => true,
        other => return Err(format!("{other:?}: expected nothing or --check")),
    };
    let stale = stale()?;
    if check && !stale.is_empty() {
        let names: Vec<&str> = stale.iter().map(|(name, _)| *name).collect();
        let names = names.join(", ");
        return Err(format!("not what the declarations give: {names}; run `cargo xtask generate`"));
    }
    for (name, text) in stale {
        std::fs::write(path(name), text).map_err(|e| format!("{name}: {e}"))?;
        println!("wrote {name}");
    }
    Ok(())
}

/// Files that are not what the declarations give, with what they should be.
pub(crate) fn stale() -> Result<Vec<(&'static str, String)>, String> {
    let mut all = made()?;
    all.retain(|(name, text)| read(name).unwrap_or_default() != *text);
    Ok(all)
}

fn made() -> Result<Vec<(&'static str, String)>, String> {
    let places = places::places();
    let classes = classes::classes(&places)?;
    let keys = pages::keys(&read("docs/scenario.md")?, &places)?;
    Ok(vec![
        ("python/clutch/_tables.py", python::module(&classes, &places)),
        ("python/clutch/_metrics.py", metrics::python()),
        ("docs/scenario.schema.json", format!("{:#}\n", clutch_sim::scenario::schema())),
        ("docs/scenario.md", metrics::page(&keys).ok_or("docs/scenario.md: no markers of metrics")?),
        ("docs/notation.md", pages::symbols(&read("docs/notation.md")?, &places)?),
        ("docs/api.md", pages::references(&read("docs/api.md")?, &places, &classes)?),
    ])
}

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(name)
}

fn read(name: &str) -> Result<String, String> {
    std::fs::read_to_string(path(name)).map_err(|e| format!("{name}: {e}"))
}
