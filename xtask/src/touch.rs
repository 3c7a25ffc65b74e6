//! `cargo xtask touch`: where a fact of each kind is written.

use crate::product::{File, trees};
use anyhow::Result;
use std::collections::BTreeMap;

/// A fact that the product has already stands for the next one of its kind: where its names are is what a new
/// one would have to touch.
struct Fact {
    kind: &'static str,
    of: &'static str,
    /// Its identifiers, whole words. No other fact has one of them, at any revision that is counted.
    names: &'static [&'static str],
}

const FACTS: &[Fact] = &[
    Fact { kind: "a law's parameter", of: "outer gain of CTC", names: &["outer_gain"] },
    Fact {
        kind: "a law",
        of: "SMC with the sign function",
        names: &["smc_sign", "SmcSign", "SmcSignParams", "SmcSignFile"],
    },
    Fact {
        kind: "a law with memory and further terms",
        of: "PID",
        names: &["Pid", "PidParams", "PidState", "PidTerms", "\"pid\"", "law.pid"],
    },
    Fact {
        kind: "a friction model",
        of: "elasto-plastic",
        names: &["elasto_plastic", "ElastoPlastic", "ElastoPlasticParams", "ElastoPlasticFriction"],
    },
    Fact { kind: "a field of the log", of: "frames refused, of a link record", names: &["rejected_frames"] },
    Fact { kind: "a metric", of: "integral of the error's magnitude", names: &["iae_rad_s", "IAE"] },
];

/// Places by file: lines of code with one of the names.
fn places<'a>(fact: &Fact, files: &'a [File]) -> BTreeMap<&'a str, usize> {
    let names = |line: &str| fact.names.iter().any(|name| has_word(line, name));
    let count = |file: &'a File| (file.path.as_str(), file.code.iter().filter(|line| names(line)).count());
    files.iter().map(count).filter(|(_, count)| *count > 0).collect()
}

fn has_word(line: &str, word: &str) -> bool {
    let part_of_a_name = |c: char| c.is_alphanumeric() || c == '_';
    let (begins, ends) = (word.starts_with(part_of_a_name), word.ends_with(part_of_a_name));
    line.match_indices(word).any(|(at, _)| {
        let before = line[..at].chars().next_back().is_some_and(part_of_a_name);
        let after = line[at + word.len()..].chars().next().is_some_and(part_of_a_name);
        !(begins && before || ends && after)
    })
}

/// "3 files, 5 + 4 places": those in the file with the most, and those in the others.
fn cell(places: &BTreeMap<&str, usize>) -> String {
    let (all, most) = (places.values().sum::<usize>(), places.values().max().copied().unwrap_or(0));
    match places.len() {
        0 => "does not exist".to_owned(),
        1 => format!("1 file, {all} places"),
        n => format!("{n} files, {most} + {} places", all - most),
    }
}

/// Prints the table of touched files and places; with `list` also each file.
pub(crate) fn print(revisions: &[String], list: bool) -> Result<()> {
    let trees = trees(revisions)?;
    println!(
        "A fact that exists stands for the next one of its kind. Counted are the files and the lines of product \
         code in which one of its identifiers stands as a whole word: declarations and uses alike, so that each \
         number is rather too high. Product code is what the crates, the firmware and the Python package run, \
         and the built-in rigs and scenarios; comments, docstrings, tests, examples, prose and generated files \
         are not counted. “5 + 4 places” are five in the file with the most, the fact's own, and four in the others.\n"
    );
    let heads: Vec<_> = trees.iter().map(|(name, _)| name.as_str()).collect();
    println!("| what is added | counted | {} |", heads.join(" | "));
    println!("|---|---|{}", "---|".repeat(heads.len()));
    for fact in FACTS {
        let cells: Vec<_> = trees.iter().map(|(_, files)| cell(&places(fact, files))).collect();
        println!("| {} | {} | {} |", fact.kind, fact.of, cells.join(" | "));
    }
    if list {
        for fact in FACTS {
            println!("\n{}: {}", fact.kind, fact.names.join(", "));
            for (name, files) in &trees {
                for (path, count) in places(fact, files) {
                    println!("  {name} {count:4} {path}");
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_a_whole_word() {
        assert!(has_word("let boundary = 1;", "boundary"));
        assert!(has_word("p.boundary", "boundary"));
        assert!(!has_word("boundary_rad_s", "boundary"));
        assert!(!has_word("inverse_boundary", "boundary"));
        assert!(has_word("inverse_boundary * boundary", "boundary"));
        assert!(has_word("case \"pid\":", "\"pid\""));
    }

    #[test]
    fn places_are_lines_by_file_and_the_fact_has_one_of_its_own() {
        let file = |path: &str, code: &[&str]| File {
            path: path.to_owned(),
            code: code.iter().map(|line| (*line).to_owned()).collect(),
        };
        let files = [
            file("a.rs", &["iae_rad_s: iae_rad_s,", "other", "IAE"]),
            file("b.py", &["x = m.iae_rad_s"]),
            file("c.rs", &["piae_rad_s"]),
        ];
        let metric = FACTS.iter().find(|f| f.kind == "a metric").unwrap();
        let found = places(metric, &files);
        assert_eq!(found.into_iter().collect::<Vec<_>>(), [("a.rs", 2), ("b.py", 1)]);
        assert_eq!(cell(&places(metric, &files)), "2 files, 2 + 1 places");
        assert_eq!(cell(&places(metric, &files[..1])), "1 file, 2 places");
        assert_eq!(cell(&places(metric, &[])), "does not exist");
    }
}
