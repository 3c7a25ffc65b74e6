//! Writes what follows from the declarations of parameters and is kept in the tree: Python's classes, the tables of
//! documentation, the schema of scenario files.
//!
//! `cargo xtask generate [--check]`

mod classes;
mod pages;
mod places;
mod python;

use std::path::Path;

fn main() -> Result<(), String> {
    let check = match std::env::args().skip(1).collect::<Vec<_>>().as_slice() {
        [] => false,
        [flag] if flag == "--check" => true,
        other => return Err(format!("{other:?}: expected nothing or --check")),
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let places = places::places();
    let classes = classes::classes(&places)?;
    let schema = format!("{:#}\n", clutch_sim::scenario::schema());
    let mut made =
        vec![("python/clutch/_tables.py", python::module(&classes)), ("docs/scenario.schema.json", schema)];
    for (page, sections) in [
        ("docs/scenario.md", &pages::keys as &dyn Fn(&_, &_) -> _),
        ("docs/notation.md", &pages::symbols),
        ("docs/api.md", &|page, places| pages::references(page, places, &classes)),
    ] {
        let text = read(&root.join(page))?;
        made.push((page, sections(&text, &places).map_err(|e| format!("{page}: {e}"))?));
    }
    let mut stale = Vec::new();
    for (name, text) in made {
        let path = root.join(name);
        if read(&path).unwrap_or_default() == text {
            continue;
        }
        if check {
            stale.push(name);
        } else {
            std::fs::write(&path, text).map_err(|e| format!("{name}: {e}"))?;
            println!("wrote {name}");
        }
    }
    match stale.as_slice() {
        [] => Ok(()),
        names => {
            Err(format!("not what the declarations give: {}; run `cargo xtask generate`", names.join(", ")))
        }
    }
}

fn read(path: &Path) -> Result<String, String> {
    std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))
}
