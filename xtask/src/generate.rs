//! `cargo xtask generate`: writes what follows from declarations and is kept in the tree.

use crate::run::{cargo, root};
use anyhow::{Context, Result, bail};

/// The print of a package's example, and the file that has it.
struct Printed {
    package: &'static str,
    example: &'static str,
    args: &'static [&'static str],
    file: &'static str,
    /// Name of the markers around it, where the file has more.
    markers: Option<&'static str>,
}

const fn printed(
    (package, example, args): (&'static str, &'static str, &'static [&'static str]),
    file: &'static str,
    markers: Option<&'static str>,
) -> Printed {
    Printed { package, example, args, file, markers }
}

const PRINTED: &[Printed] = &[
    printed(("clutch-wire", "table", &["header"]), "crates/clutch-wire/include/clutch_wire.h", None),
    printed(("clutch-wire", "table", &["vectors"]), "tests/wire/vectors.csv", None),
    printed(("clutch-wire", "table", &["markdown"]), "docs/wire.md", Some("table")),
    printed(("clutch-settings", "settings", &[]), "docs/wire.md", Some("settings")),
    printed(("clutch-log", "channels", &[]), "docs/log.md", Some("channels")),
    printed(("clutch-c", "header", &[]), "crates/clutch-c/include/clutch.h", None),
];

/// Writes each file that is not what its declarations give; with `check` it fails instead.
pub(crate) fn run(check: bool) -> Result<()> {
    let of_parameters = ["run", "--package", "clutch-sim", "--example", "generate", "--"];
    cargo(of_parameters).args(check.then_some("--check")).run()?;
    let mut stale = Vec::new();
    for Printed { package, example, args, file: name, markers } in PRINTED {
        let run = ["run", "--quiet", "--package", package, "--example", example, "--"];
        let text = String::from_utf8(cargo(run).args(*args).output()?)?;
        let file = root().join(name);
        let old = std::fs::read_to_string(&file).with_context(|| file.display().to_string())?;
        let new = match markers {
            None => text,
            Some(markers) => between(&old, markers, &text).with_context(|| (*name).to_owned())?,
        };
        if new == old {
            continue;
        }
        if check {
            stale.push(*name);
        } else {
            std::fs::write(&file, new)?;
            println!("wrote {name}");
        }
    }
    if !stale.is_empty() {
        bail!("not what the declarations give: {}; run `cargo xtask generate`", stale.join(", "));
    }
    Ok(())
}

/// A page with a text between its markers of that name.
pub(crate) fn between(page: &str, name: &str, text: &str) -> Result<String> {
    let (begin, end) = (format!("<!-- {name}:begin -->"), format!("<!-- {name}:end -->"));
    let split = page.split_once(&begin).and_then(|(head, rest)| Some((head, rest.split_once(&end)?.1)));
    let (head, tail) = split.with_context(|| format!("the page has lost the markers of its {name}"))?;
    Ok(format!("{head}{begin}\n{}\n{end}{tail}", text.trim_end()))
}
