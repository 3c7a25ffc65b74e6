//! The campaign with one check at a time taken out of the code: each has to turn it red.
//!
//! The product has no switch for that. A copy of the tree gets one, in the place of each check, and is built once; the number
//! of the check that is off is read from the environment.

use crate::run::{cargo, program, root};
use anyhow::{Context, Result, ensure};
use std::fmt::Write as _;
use std::path::Path;

/// A check: its name, its file, its code, and that code with `OFF` where it does not count.
struct Ablation(&'static str, &'static str, &'static str, &'static str);

const SUPERVISOR: &str = "crates/clutch-core/src/supervisor/mod.rs";
const ENVELOPE: &str = "crates/clutch-core/src/supervisor/envelope.rs";
const BOARD: &str = "crates/clutch-node/src/board.rs";
const CONTROLLER: &str = "crates/clutch-node/src/controller.rs";
const FRAME: &str = "crates/clutch-wire/src/frame.rs";

/// Every check that is taken out.
const ABLATIONS: &[Ablation] = &[
    Ablation(
        "a board that says it does not drive",
        SUPERVISOR,
        "} else if commanding && sample.board != BoardMode::Driving {",
        "} else if commanding && sample.board != BoardMode::Driving && !OFF {",
    ),
    Ablation(
        "a board that does not drive when control is to begin",
        SUPERVISOR,
        "let commanding = matches!(s.state, State::Armed | State::Running);",
        "let commanding = matches!(s.state, State::Armed | State::Running) && !(OFF && s.state == State::Armed);",
    ),
    Ablation(
        "a board that says its encoder is broken",
        SUPERVISOR,
        "if sample.encoder_fault ||",
        "if sample.encoder_fault && !OFF ||",
    ),
    Ablation(
        "a board that says its converter is broken",
        SUPERVISOR,
        "|| sample.converter_fault {",
        "|| sample.converter_fault && !OFF {",
    ),
    Ablation(
        "good samples after one that was refused",
        SUPERVISOR,
        "s.recovering = l.good_samples;",
        "s.recovering = if OFF { 0 } else { l.good_samples };",
    ),
    Ablation(
        "samples twice or out of order",
        SUPERVISOR,
        "if count >= self.limits.disorder {",
        "if count >= self.limits.disorder && !OFF {",
    ),
    Ablation("samples lost too often", SUPERVISOR, "if count >= l.lost {", "if count >= l.lost && !OFF {"),
    Ablation(
        "samples or codes late too often",
        SUPERVISOR,
        "if count >= l.late {",
        "if count >= l.late && !OFF {",
    ),
    Ablation(
        "samples that a newer one has overtaken, among those that are late",
        SUPERVISOR,
        "if sample.superseded ||",
        "if sample.superseded && !OFF ||",
    ),
    Ablation(
        "codes that the board found too old, among those that are late",
        SUPERVISOR,
        "|| sample.command_late {",
        "|| sample.command_late && !OFF {",
    ),
    Ablation(
        "answers late too often",
        SUPERVISOR,
        "if s.overrun.mark(s.periods) >= l.overruns {",
        "if s.overrun.mark(s.periods) >= l.overruns && !OFF {",
    ),
    Ablation(
        "board's time against its periods",
        SUPERVISOR,
        "if let Some(off) = s.pace.pass(expected, passed, self.limits.clock_slack_us) {",
        "if let Some(off) = s.pace.pass(expected, passed, self.limits.clock_slack_us) && !OFF {",
    ),
    Ablation(
        "board's periods against the host's clock",
        "crates/clutch-node/src/board_pace.rs",
        "self.off.get_or_insert(off);",
        "if !OFF { self.off.get_or_insert(off); }",
    ),
    Ablation(
        "growth of the jump that is allowed",
        SUPERVISOR,
        "allowed: self.limits.jump.saturating_mul(periods.saturating_add(7)) / 8,",
        "allowed: self.limits.jump.saturating_mul(if OFF { 8 } else { periods.saturating_add(7) }) / 8,",
    ),
    Ablation(
        "bridging of missed periods",
        SUPERVISOR,
        "for step in 1..steps {",
        "for step in 1..if OFF { 1 } else { steps } {",
    ),
    Ablation("counts against dead reckoning", SUPERVISOR, "if off > allowed {", "if off > allowed && !OFF {"),
    Ablation(
        "target against the last one",
        SUPERVISOR,
        "let plausible = self.limits.believes(",
        "let plausible = OFF || self.limits.believes(",
    ),
    Ablation("numbers of the law", SUPERVISOR, "if !finite(out) {", "if !finite(out) && !OFF {"),
    Ablation(
        "following error",
        SUPERVISOR,
        "if error > l.following_error + l.following_time",
        "if !OFF && error > l.following_error + l.following_time",
    ),
    Ablation(
        "time at a limit of the voltage",
        SUPERVISOR,
        "if s.saturated >= l.saturation_cycles {",
        "if s.saturated >= l.saturation_cycles && !OFF {",
    ),
    Ablation(
        "counts against the slowest and the fastest shaft",
        SUPERVISOR,
        "if let Some((cause, counts)) = l.envelope.judge(&mut s.envelope, losses, moved, periods) {",
        "if let Some((cause, counts)) = l.envelope.judge(&mut s.envelope, losses, moved, periods) && !OFF {",
    ),
    Ablation(
        "way over several samples",
        ENVELOPE,
        "self.velocity = self.velocity.min(velocity);",
        "if !OFF { self.velocity = self.velocity.min(velocity); }",
    ),
    Ablation(
        "silence",
        CONTROLLER,
        "self.supervisor.silence(&mut self.state, u32::MAX);",
        "if !OFF { self.supervisor.silence(&mut self.state, u32::MAX); }",
    ),
    Ablation(
        "silence that shows by the samples themselves",
        SUPERVISOR,
        "if lost >= l.silence_cycles {",
        "if lost >= l.silence_cycles && !OFF {",
    ),
    Ablation(
        "run of a sample",
        CONTROLLER,
        "if sample.run != self.params.run {",
        "if sample.run != self.params.run && !OFF {",
    ),
    Ablation(
        "stop sent after a fault",
        CONTROLLER,
        "        self.stopping = Some(reason);\n",
        "        self.stopping = Some(reason);\n        if OFF { return; }\n",
    ),
    Ablation(
        "stop sent again until the board has heard it",
        CONTROLLER,
        "if seen.board == BoardMode::Driving {",
        "if seen.board == BoardMode::Driving && !OFF {",
    ),
    Ablation(
        "board: code above the top",
        BOARD,
        "if m.code > self.params.top() {",
        "if m.code > self.params.top() && !OFF {",
    ),
    Ablation(
        "board: code that answers a sample again",
        BOARD,
        "if self.answered.is_some_and(|last|",
        "if !OFF && self.answered.is_some_and(|last|",
    ),
    Ablation(
        "board: code that is too old",
        BOARD,
        "if now_us.wrapping_sub(time) <= u32::from(m.valid_us) =>",
        "if OFF || now_us.wrapping_sub(time) <= u32::from(m.valid_us) =>",
    ),
    Ablation(
        "board: code that answers a sample whose time is no longer known",
        BOARD,
        "taken.filter(|_| usize::from(behind) < RECENT)",
        "taken.filter(|_| usize::from(behind) < RECENT || OFF)",
    ),
    Ablation(
        "board: code of another run",
        BOARD,
        "Message::Actuate(m) if m.run == self.run",
        "Message::Actuate(m) if (m.run == self.run || OFF)",
    ),
    Ablation(
        "board: code after a fault or a stop",
        BOARD,
        "&& self.driving() => self.actuate(",
        "&& (self.driving() || OFF) => self.actuate(",
    ),
    Ablation(
        "board: watchdog",
        BOARD,
        "let silent = now_us.wrapping_sub(self.fed_us);",
        "if OFF { self.fed_us = now_us; }\n        let silent = now_us.wrapping_sub(self.fed_us);",
    ),
    Ablation(
        "board: its own encoder",
        BOARD,
        "if self.driving() && (encoder_fault || converter_fault) {",
        "if self.driving() && (encoder_fault || converter_fault) && !OFF {",
    ),
    Ablation(
        "board: safe output",
        BOARD,
        "        self.code = self.safe_run.next(&self.ending);\n        self.safe_under_way",
        "        if !OFF { self.code = self.safe_run.next(&self.ending); }\n        self.safe_under_way",
    ),
    Ablation("checksum of a frame", FRAME, "if expected != computed {", "if expected != computed && !OFF {"),
    Ablation(
        "kind of a frame: all its bits",
        FRAME,
        "let (expected, computed) =",
        "let kind = if OFF { kind & 0x8f } else { kind };\n    let (expected, computed) =",
    ),
    Ablation("length of a frame", FRAME, "if length != body.len() {", "if length != body.len() && !OFF {"),
];

/// The switch, and the place where it is read.
const SWITCH: &[(&str, &str, &str)] = &[
    (
        "crates/clutch-core/src/lib.rs",
        "\nmod actuator;\n",
        "\nextern crate self as clutch_core;\nmod actuator;\n\
         /// Number of the check that is off.\n\
         pub static ABLATED: core::sync::atomic::AtomicUsize = core::sync::atomic::AtomicUsize::new(0);\n\
         /// True if it is this one.\npub fn ablated(n: usize) -> bool {\n    \
         ABLATED.load(core::sync::atomic::Ordering::Relaxed) == n\n}\n",
    ),
    (
        "crates/clutch-loop/examples/campaign.rs",
        "fn main() -> Failure {\n",
        "fn main() -> Failure {\n    let off = std::env::var(\"ABLATED\").map_or(Ok(0), |n| n.parse())?;\n    \
         clutch_core::ABLATED.store(off, std::sync::atomic::Ordering::Relaxed);\n",
    ),
];

/// Takes each check out in turn; an error if the campaign does not miss it. Writes the table of docs/safety.md.
pub(crate) fn all(runs: u64) -> Result<()> {
    let copy = root().join("target/ablated");
    if copy.exists() {
        std::fs::remove_dir_all(&copy)?;
    }
    let listed = ["ls-files", "-z", "--cached", "--others", "--exclude-standard"];
    let (done, tree) = program("git").args(listed).silently()?;
    ensure!(done, "git ls-files: {tree}");
    // Files that are deleted, and not yet committed so, are listed, too.
    for file in tree.split('\0').filter(|f| !f.is_empty() && root().join(f).is_file()) {
        let to = copy.join(file);
        std::fs::create_dir_all(to.parent().unwrap_or(&copy))?;
        let bytes = std::fs::read(root().join(file)).with_context(|| file.to_owned())?;
        match String::from_utf8(bytes) {
            Ok(text) => std::fs::write(to, patched(file, text)?)?,
            Err(other) => std::fs::write(to, other.as_bytes())?,
        }
    }
    let example = ["build", "--release", "--package", "clutch-loop", "--example", "campaign"];
    // Not in the folder of this tree: cargo takes the two for one.
    let target = root().join("target/ablations");
    cargo(example).within(&copy).env("CARGO_TARGET_DIR", &target).run()?;
    let built = target.join("release/examples/campaign");
    let (none, text) = until(&built, 0, runs)?;
    ensure!(none, "with every check the campaign fails: {text}");
    let mut table = String::from("| check taken out | first run that fails | because |\n|---|---|---|\n");
    let mut unseen = Vec::new();
    for (Ablation(name, ..), n) in ABLATIONS.iter().zip(1..) {
        let (none, text) = until(&built, n, runs)?;
        let line = text.lines().next().unwrap_or_default();
        // A failure begins with the seed of its run; a program that breaks off has seen none.
        ensure!(none || line.starts_with(|c: char| c.is_ascii_digit()), "without {name}: {text}");
        println!("without {name}: {}", if none { "nothing fails" } else { line });
        if none {
            unseen.push(*name);
        }
        let (run, why) = line.split_once(": ").unwrap_or((line, ""));
        writeln!(table, "| {name} | {run} | {why} |")?;
    }
    ensure!(unseen.is_empty(), "in {runs} runs nothing misses: {}", unseen.join("; "));
    crate::write_between("docs/safety.md", "ablations", table.trim())
}

/// A file with the switches in the places of its checks.
fn patched(file: &str, mut text: String) -> Result<String> {
    for (Ablation(name, of, old, new), n) in ABLATIONS.iter().zip(1..) {
        if *of == file {
            ensure!(
                text.matches(old).count() == 1,
                "the check \"{name}\" is not, or not once, in {file}: {old}"
            );
            text = text.replace(old, &new.replace("OFF", &format!("clutch_core::ablated({n})")));
        }
    }
    for (of, old, new) in SWITCH {
        if *of == file {
            ensure!(text.matches(old).count() == 1, "{file} has not, or not once: {old}");
            text = text.replace(old, new);
        }
    }
    Ok(text)
}

/// Runs without the check of that number, until one fails; true if none does.
fn until(built: &Path, check: usize, runs: u64) -> Result<(bool, String)> {
    program(built).args(["until", &runs.to_string()]).env("ABLATED", check.to_string()).silently()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn read(file: &str) -> String {
        std::fs::read_to_string(root().join(file)).unwrap_or_else(|e| panic!("{file}: {e}"))
    }

    #[test]
    fn each_check_that_is_taken_out_is_once_in_its_file() {
        for Ablation(name, file, old, new) in ABLATIONS {
            assert_eq!(read(file).matches(old).count(), 1, "{name}: in {file}: {old}");
            assert!(new.contains("OFF"), "{name}: nothing switches it off: {new}");
        }
        for (file, old, _) in SWITCH {
            assert_eq!(read(file).matches(old).count(), 1, "in {file}: {old}");
        }
        // One after another, too: no switch hides the check of another.
        let files = ABLATIONS.iter().map(|a| a.1).chain(SWITCH.iter().map(|s| s.0));
        for file in files.collect::<BTreeSet<_>>() {
            let text = patched(file, read(file)).unwrap_or_else(|e| panic!("{e}"));
            assert!(!text.contains("OFF "), "{file} has a switch that was not put in");
        }
    }

    #[test]
    fn the_published_table_has_these_checks_and_no_others() {
        let page = read("docs/safety.md");
        let between = |from: &str, to: &str| page.split_once(from).and_then(|(_, rest)| rest.split_once(to));
        let (table, _) = between("<!-- ablations:begin -->", "<!-- ablations:end -->").expect("a table");
        let rows: Vec<&str> =
            table.lines().filter_map(|row| row.strip_prefix("| ")?.split(" | ").next()).skip(1).collect();
        let names: Vec<&str> = ABLATIONS.iter().map(|a| a.0).collect();
        assert_eq!(rows, names);
    }
}
