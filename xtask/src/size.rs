//! `cargo xtask size`: lines of product code.

use crate::product::trees;
use anyhow::Result;
use std::collections::BTreeMap;

/// Prints the lines of product code by crate.
pub(crate) fn print(revisions: &[String]) -> Result<()> {
    let trees = trees(revisions)?;
    println!(
        "Lines of product code: neither blank nor comment, without tests, examples, prose and generated files; of \
         the built-in rigs and scenarios, the lines of TOML.\n"
    );
    let mut parts: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (i, (_, files)) in trees.iter().enumerate() {
        for file in files {
            let counts = parts.entry(file.part()).or_insert_with(|| vec![0; trees.len()]);
            counts[i] += file.code.len();
        }
    }
    let all = (0..trees.len()).map(|i| parts.values().map(|counts| counts[i]).sum()).collect();
    parts.insert("~", all); // sorts behind every name
    let heads: Vec<_> = trees.iter().map(|(name, _)| name.as_str()).collect();
    let change = trees.len() > 1;
    println!("| part | {} |{}", heads.join(" | "), if change { " change |" } else { "" });
    println!("|---|{}", "---|".repeat(heads.len() + usize::from(change)));
    for (part, counts) in parts {
        let name = if part == "~" { "all" } else { part };
        let cells: Vec<_> = counts.iter().map(ToString::to_string).collect();
        let change = match (counts.first(), counts.last()) {
            (Some(first), Some(last)) if change => format!(" {:+} |", *last as i64 - *first as i64),
            _ => String::new(),
        };
        println!("| {name} | {} |{change}", cells.join(" | "));
    }
    Ok(())
}
