//! Product code at a revision: what is counted as such, without tests, comments and what is generated.

use crate::run::program;
use anyhow::{Result, bail};

/// Product code: folder below the root, with one name where the star is; endings of its files.
const PRODUCT: &[(&str, &[&str])] = &[
    ("crates/*/src/", &["rs"]),
    // Rigs and scenarios that are built in.
    ("crates/clutch-sim/rigs/", &["toml"]),
    ("crates/clutch-sim/scenarios/", &["toml"]),
    ("firmware/*/src/", &["rs"]),
    ("firmware/shared/", &["rs"]),
    ("python/clutch/", &["py"]),
];

/// The part of it that tests and measures only.
const TESTS: &[&str] = &[
    "/tests.rs",
    "/tests/",
    "firmware/qemu-mps2/src/bin/bits.rs",
    "firmware/qemu-mps2/src/bin/budget.rs",
    "firmware/qemu-mps2/src/budget/",
];

/// The files that a verb or an example of a crate writes, and the command that does so. A product file among them
/// counts as generated from the revision on at which its head says so.
pub(crate) const GENERATED: &[(&str, &str)] = &[
    ("python/clutch/_clutch.pyi", "cargo xtask stubs"),
    ("python/clutch/_metrics.py", "cargo xtask generate"),
    ("python/clutch/_tables.py", "cargo xtask generate"),
    ("docs/scenario.schema.json", "cargo xtask generate"),
    ("firmware/nucleo-g474re/src/alone_run.rs", "clutch scenario rust"),
    ("crates/clutch-wire/include/clutch_wire.h", "cargo xtask generate"),
    ("crates/clutch-c/include/clutch.h", "cargo xtask generate"),
    ("tests/wire/vectors.csv", "cargo xtask generate"),
];

/// A file of product code.
pub(crate) struct File {
    pub(crate) path: String,
    /// Its code, line by line: without comments and tests, and without lines of which nothing is left.
    pub(crate) code: Vec<String>,
}

impl File {
    /// The crate or other part that it belongs to.
    pub(crate) fn part(&self) -> &str {
        let mut names = self.path.split('/');
        match (names.next(), names.next()) {
            (Some("crates"), Some(name)) => name,
            (Some(first), _) => first,
            (None, _) => "",
        }
    }
}

/// The product code of each revision, under the name that `git` gives it in short.
pub(crate) fn trees(revisions: &[String]) -> Result<Vec<(String, Vec<File>)>> {
    let tree = |revision: &String| {
        let name = git(&["rev-parse", "--short", "--verify", &format!("{revision}^{{commit}}")])?;
        Ok((name.trim().to_owned(), files(revision)?))
    };
    revisions.iter().map(tree).collect()
}

fn files(revision: &str) -> Result<Vec<File>> {
    let paths = git(&["ls-tree", "-r", "--name-only", revision])?;
    let mut files = Vec::new();
    for path in paths.lines().filter(|p| is_product(p)) {
        let text = git(&["show", &format!("{revision}:{path}")])?;
        if !is_generated(path, &text) {
            files.push(File { path: path.to_owned(), code: code(path, &text) });
        }
    }
    Ok(files)
}

fn git(args: &[&str]) -> Result<String> {
    let (done, text) = program("git").args(args).silently()?;
    if !done {
        bail!("git {}: {text}", args.join(" "));
    }
    Ok(text)
}

pub(crate) fn is_product(path: &str) -> bool {
    let lies_in = |folder: &str| match folder.split_once('*') {
        None => path.starts_with(folder),
        Some((before, after)) => {
            let name = path.strip_prefix(before).and_then(|rest| rest.split_once('/'));
            name.is_some_and(|(_, rest)| format!("/{rest}").starts_with(after))
        }
    };
    let ending = path.rsplit_once('.').map_or("", |(_, ending)| ending);
    PRODUCT.iter().any(|(folder, endings)| lies_in(folder) && endings.contains(&ending))
        && !TESTS.iter().any(|test| path.contains(test))
}

fn is_generated(path: &str, text: &str) -> bool {
    let listed = GENERATED.iter().any(|(generated, _)| *generated == path);
    let says = |line: &str| {
        ["enerated", "ritten by `cargo", "ritten by `clutch"].iter().any(|words| line.contains(words))
    };
    listed && text.lines().take(12).any(says)
}

fn code(path: &str, text: &str) -> Vec<String> {
    let bare = match path.rsplit_once('.') {
        Some((_, "rs")) => without_tests(&without_comments(text)),
        Some((_, "py")) => without_docstrings(text),
        _ => without_hashes(text),
    };
    bare.lines().map(|line| line.trim().to_owned()).filter(|line| !line.is_empty()).collect()
}

/// Rust without comments, line by line as it was.
fn without_comments(text: &str) -> String {
    let (mut out, mut rest) = (String::new(), text);
    while let Some(c) = rest.chars().next() {
        let taken = if rest.starts_with("//") {
            let line = rest.find('\n').unwrap_or(rest.len());
            rest = &rest[line..];
            continue;
        } else if rest.starts_with("/*") {
            let end = rest.find("*/").map_or(rest.len(), |at| at + 2);
            out.extend(rest[..end].chars().filter(|c| *c == '\n'));
            rest = &rest[end..];
            continue;
        } else {
            literal(rest).unwrap_or(c.len_utf8())
        };
        out.push_str(&rest[..taken]);
        rest = &rest[taken..];
    }
    out
}

/// The length of the string or character of Rust that the text begins with.
fn literal(text: &str) -> Option<usize> {
    if let Some(raw) = text.strip_prefix('r') {
        let hashes = raw.len() - raw.trim_start_matches('#').len();
        let end = format!("\"{}", "#".repeat(hashes));
        let body = raw[hashes..].strip_prefix('"')?;
        return body.find(&end).map(|at| 1 + hashes + 1 + at + end.len());
    }
    if text.starts_with('"') {
        let mut escaped = false;
        for (at, c) in text.char_indices().skip(1) {
            match c {
                _ if escaped => escaped = false,
                '\\' => escaped = true,
                '"' => return Some(at + 1),
                _ => {}
            }
        }
        return Some(text.len());
    }
    // A lifetime has no second quote where a character has one.
    let body = text.strip_prefix('\'')?;
    let within =
        if body.starts_with('\\') { body[2..].find('\'')? + 2 } else { body.chars().next()?.len_utf8() };
    body[within..].starts_with('\'').then_some(1 + within + 1)
}

/// Rust without what is compiled for tests only: each `#[cfg(test)]` and the item that it is on.
fn without_tests(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(at) = rest.find("#[cfg(test)]") {
        out.push_str(&rest[..at]);
        let after = &rest[at + "#[cfg(test)]".len()..];
        rest = &after[item(after)..];
    }
    out + rest
}

/// The length of the item that a text begins with: to its semicolon or its last brace.
fn item(text: &str) -> usize {
    let (mut depth, mut at) = (0_usize, 0);
    while let Some(c) = text[at..].chars().next() {
        let length = literal(&text[at..]).unwrap_or(c.len_utf8());
        at += length;
        match c {
            '{' | '(' | '[' => depth += 1,
            ')' | ']' => depth = depth.saturating_sub(1),
            '}' => {
                depth = depth.saturating_sub(1);
                if depth == 0 {
                    return at;
                }
            }
            ';' if depth == 0 => return at,
            _ => {}
        }
    }
    at
}

/// Python without comments and docstrings.
fn without_docstrings(text: &str) -> String {
    let mut out = String::new();
    let mut within = false;
    for line in text.lines() {
        let trimmed = line.trim_start();
        let quotes = line.matches("\"\"\"").count();
        if !within && quotes > 0 && trimmed.trim_start_matches(['r', 'f']).starts_with("\"\"\"") {
            within = quotes == 1;
            continue;
        }
        if within {
            within = quotes == 0;
            continue;
        }
        out.push_str(without_hash(line));
        out.push('\n');
    }
    out
}

fn without_hashes(text: &str) -> String {
    text.lines().map(without_hash).collect::<Vec<_>>().join("\n")
}

/// A line without its comment. A hash within quotes is none.
fn without_hash(line: &str) -> &str {
    let mut quote = None;
    for (at, c) in line.char_indices() {
        match (quote, c) {
            (None, '#') => return &line[..at],
            (None, '"' | '\'') => quote = Some(c),
            (Some(q), c) if q == c => quote = None,
            _ => {}
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn product_is_what_a_crate_or_the_package_runs() {
        for path in
            ["crates/clutch-sim/src/run.rs", "python/clutch/gym.py", "firmware/nucleo-g474re/src/pins.rs"]
        {
            assert!(is_product(path), "{path}");
        }
        for path in [
            "crates/clutch-sim/examples/generate/metrics.rs",
            "crates/clutch-core/src/supervisor/tests.rs",
            "crates/clutch-node/tests/node/board.rs",
            "python/clutch/_clutch.pyi",
            "python/tests/test_run.py",
            "docs/conf.py",
            "xtask/src/main.rs",
        ] {
            assert!(!is_product(path), "{path}");
        }
    }

    #[test]
    fn code_of_rust_is_without_comments_and_tests() {
        let text = "//! A file.\nlet a = \"// none\"; // one\n/* two\nthree */ let b = '\"';\n\n\
                    #[cfg(test)]\nmod tests {\n    fn f() { let s = \"}\"; }\n}\nfn g<'a>() {}\n\
                    #[cfg(test)]\nuse x::y;\nlet r = r#\"a \" // b\"#;\n";
        let bare = ["let a = \"// none\";", "let b = '\"';", "fn g<'a>() {}", "let r = r#\"a \" // b\"#;"];
        assert_eq!(code("a.rs", text), bare);
    }

    #[test]
    fn code_of_python_is_without_comments_and_docstrings() {
        let text = "\"\"\"A module.\"\"\"\n\ndef f():\n    \"\"\"Of f.\n\n    More.\n    \"\"\"\n    return \"#1\"  # one\n";
        assert_eq!(code("a.py", text), ["def f():", "return \"#1\""]);
        assert_eq!(code("a.toml", "# a rig\nmass = 1 # kg\n"), ["mass = 1"]);
    }

    #[test]
    fn a_file_counts_as_generated_once_its_head_says_so() {
        assert!(is_generated("python/clutch/_metrics.py", "\"\"\"Figures. Generated by an example.\"\"\"\n"));
        assert!(is_generated(
            "python/clutch/_tables.py",
            "\"\"\"Tables: written by `cargo xtask x`.\"\"\"\n"
        ));
        assert!(!is_generated("python/clutch/_tables.py", "\"\"\"Tables.\"\"\"\n"));
        assert!(!is_generated("python/clutch/_run.py", "\"\"\"Generated.\"\"\"\n"));
    }
}
