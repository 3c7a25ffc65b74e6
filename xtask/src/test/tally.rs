//! Tests that were counted, and the time of each stage of them.

use anyhow::Result;
use std::time::Instant;

/// A stage, and the figures at its begin.
struct Stage {
    name: &'static str,
    begin: Instant,
    /// Processors' time that ended programs had taken, s.
    processor: f64,
}

/// A test that failed, and the end of what it said.
struct Failure {
    name: String,
    said: Vec<String>,
}

impl Failure {
    fn new(name: &str, said: &str) -> Failure {
        let mut failure = Failure { name: name.to_owned(), said: Vec::new() };
        said.lines().for_each(|line| failure.says(line));
        failure
    }

    fn says(&mut self, line: &str) {
        self.said.push(line.to_owned());
        if self.said.len() > SAID {
            self.said.remove(0);
        }
    }
}

/// Lines of a failed test's message that are repeated at the end, the last ones.
const SAID: usize = 40;

pub(super) struct Tally {
    passed: u64,
    failed: u64,
    skipped: u64,
    failures: Vec<Failure>,
    /// The failed test whose message the lines that are read belong to.
    speaks: Option<usize>,
    begin: Instant,
    stage: Option<Stage>,
    /// Name, time and processors' time of the stages that have ended, s.
    times: Vec<(&'static str, f64, f64)>,
    /// Rows of the table of [`Tally::end`] of tests that ran beside these.
    beside: Vec<String>,
}

/// Before the name of each test that failed.
const FAILED: &str = "failed: ";

/// Before each line that it said.
const SAYS: &str = "    | ";

/// Head of the table of stages.
fn head() -> String {
    format!("{:>8} {:>10}  stage", "time", "processors")
}

impl Tally {
    pub(super) fn new() -> Tally {
        Tally {
            passed: 0,
            failed: 0,
            skipped: 0,
            failures: Vec::new(),
            speaks: None,
            begin: Instant::now(),
            stage: None,
            times: Vec::new(),
            beside: Vec::new(),
        }
    }

    /// Reads the closing lines of libtest (`test result: ok. 3 passed; 0 failed; …`) and of
    /// pytest (`3 passed, 1 skipped in 2.1s`), the names of the failed tests
    /// (`test NAME ... FAILED`, `FAILED NAME - why`) and libtest's messages (behind `---- NAME stdout ----`).
    pub(super) fn read(&mut self, line: &str) {
        let message = line.strip_prefix("---- ").and_then(|l| l.strip_suffix(" stdout ----"));
        if let Some(name) = line.strip_prefix("test ").and_then(|l| l.strip_suffix(" ... FAILED")) {
            self.failures.push(Failure::new(name, ""));
        } else if line.starts_with("FAILED ") || line.starts_with("ERROR ") {
            self.failures.push(Failure::new(line, ""));
        } else if let Some(name) = message {
            self.speaks = self.failures.iter().rposition(|failure| failure.name == name);
        } else if line == "failures:" {
            self.speaks = None;
        } else if let Some(failure) = self.speaks.and_then(|k| self.failures.get_mut(k)) {
            failure.says(line);
        }
        let closing = line.starts_with("test result:") || (line.contains(" in ") && line.contains("passed"));
        if !closing {
            return;
        }
        self.count(line);
    }

    /// `3 passed, 0 failed, …`
    fn count(&mut self, line: &str) {
        let words: Vec<&str> = line.split([' ', ';', ',', '=']).filter(|w| !w.is_empty()).collect();
        for pair in words.windows(2) {
            let [count, word] = pair else { continue };
            let Ok(count) = count.parse::<u64>() else { continue };
            match *word {
                "passed" => self.passed += count,
                "failed" | "errors" | "error" => self.failed += count,
                "ignored" | "skipped" => self.skipped += count,
                _ => {}
            }
        }
    }

    pub(super) fn check(&mut self, name: &str, holds: bool) {
        self.check_seen(name, (holds, String::new()));
    }

    /// As [`Tally::check`], of a program that ran unseen: its output is shown if it failed.
    pub(super) fn check_quiet(&mut self, name: &str, (holds, text): (bool, String)) {
        if !holds {
            println!("{text}");
        }
        self.check_seen(name, (holds, text));
    }

    /// As [`Tally::check`], of a program whose output has been shown.
    pub(super) fn check_seen(&mut self, name: &str, (holds, text): (bool, String)) {
        println!("{name}: {}", if holds { "ok" } else { "FAILED" });
        if holds {
            self.passed += 1;
        } else {
            self.failed += 1;
            self.failures.push(Failure::new(name, &text));
        }
    }

    /// Adds the end of another run of tests, as [`Tally::end`] printed it.
    pub(super) fn add(&mut self, ended_well: bool, text: &str) {
        let before = self.failed;
        let mut lines = text.lines().rev();
        if let Some(counts) = lines.next() {
            self.count(counts);
        }
        for line in text.lines() {
            if let Some(name) = line.strip_prefix(FAILED) {
                self.failures.push(Failure::new(name, ""));
            } else if let (Some(said), Some(failure)) = (line.strip_prefix(SAYS), self.failures.last_mut()) {
                failure.says(said);
            }
        }
        let rows =
            text.lines().skip_while(|line| *line != head()).skip(1).take_while(|line| !line.is_empty());
        self.beside.extend(rows.map(str::to_owned));
        if !ended_well && self.failed == before {
            self.check("the tests beside come to their end", false);
        }
    }

    pub(super) fn skip(&mut self, count: u64) {
        self.skipped += count;
    }

    /// Ends the stage that runs, and begins another.
    pub(super) fn stage(&mut self, name: &'static str) {
        self.end_stage();
        println!("\n=== {name}");
        self.stage = Some(Stage { name, begin: Instant::now(), processor: processor_s() });
    }

    fn end_stage(&mut self) {
        if let Some(Stage { name, begin, processor }) = self.stage.take() {
            self.times.push((name, begin.elapsed().as_secs_f64(), processor_s() - processor));
        }
    }

    /// Ends a run of tests: the failed ones, the time of each stage, the counts; an error if any failed.
    pub(super) fn end(mut self, sound: bool) -> Result<()> {
        self.end_stage();
        let sound = sound && self.failed == 0;
        println!("\n{}", head());
        let all = ("all", self.begin.elapsed().as_secs_f64(), self.times.iter().map(|t| t.2).sum());
        for (name, time, processor) in self.times.iter().chain([&all]) {
            println!("{:>8} {:>10}  {name}", minutes(*time), minutes(*processor));
        }
        if !self.beside.is_empty() {
            println!("of that beside tests and wheel:");
            self.beside.iter().for_each(|row| println!("{row}"));
        }
        println!();
        for Failure { name, said } in &self.failures {
            println!("{FAILED}{name}");
            said.iter().for_each(|line| println!("{SAYS}{line}"));
        }
        if !sound {
            println!("tests failed; all that they said is above");
        }
        println!("{} passed, {} failed, {} skipped", self.passed, self.failed, self.skipped);
        if sound { Ok(()) } else { std::process::exit(1) }
    }
}

/// Seconds as minutes and seconds.
fn minutes(seconds: f64) -> String {
    let whole = seconds.round().max(0.0);
    format!("{}:{:02}", (whole / 60.0).floor(), whole % 60.0)
}

/// Processors' time that ended programs of this one, and theirs, took, s; 0 where the system does not say.
fn processor_s() -> f64 {
    /// Linux counts in these for programs, whatever it counts in for itself.
    const TICKS_PER_S: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name stands in brackets and may hold anything. `cutime` and `cstime` are the 16th and 17th values.
    let values = stat.rsplit_once(')').map_or("", |(_, rest)| rest).split_ascii_whitespace();
    values.skip(13).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / TICKS_PER_S
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_test_keeps_what_it_said() {
        let mut tally = Tally::new();
        let libtest = "test a::b ... FAILED\ntest c ... ok\n\nfailures:\n\n---- a::b stdout ----\nthread panicked:\n1 != 2\n\nfailures:\n    a::b\n\ntest result: FAILED. 1 passed; 1 failed; 0 ignored";
        libtest.lines().for_each(|line| tally.read(line));
        tally
            .check_seen("budgets", (false, (0..=SAID).fold(String::new(), |text, k| format!("{text}{k}\n"))));
        assert_eq!((tally.passed, tally.failed), (1, 2));
        let [test, budgets] = &tally.failures[..] else { panic!("{} failures", tally.failures.len()) };
        assert_eq!(
            (test.name.as_str(), test.said.join(" ")),
            ("a::b", "thread panicked: 1 != 2 ".to_owned())
        );
        // The end of a long message is what matters.
        assert_eq!((budgets.said.len(), budgets.said[0].as_str()), (SAID, "1"));

        // And those of the tests beside, from their text.
        let beside = format!("{FAILED}fuzzing\n{SAYS}panicked\n1 passed, 1 failed, 0 skipped");
        tally.add(false, &beside);
        let last = tally.failures.last().expect("three");
        assert_eq!((last.name.as_str(), &last.said[..]), ("fuzzing", &["panicked".to_owned()][..]));
        assert_eq!((tally.passed, tally.failed), (2, 3));
    }
}
