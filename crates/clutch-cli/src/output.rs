//! The results of verbs: text, files, an exit code.

use crate::plot::{self, Figure};
use anstream::adapter::strip_str;
use anstyle::{AnsiColor, Style};
use anyhow::Context;
use clap::Args;
use clap::builder::{PathBufValueParser, TypedValueParser};
use clutch_core::params::UNITS;
use clutch_log::printable;
use clutch_sim::progress::Report;
use indicatif::{ProgressBar, ProgressStyle};
use std::borrow::Cow;
use std::io::{ErrorKind, IsTerminal, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Columns of a terminal.
pub(crate) const WIDTH: usize = 80;

/// True if the command line has `--quiet`.
static QUIET: AtomicBool = AtomicBool::new(false);

/// Sets whether a text is printed that was not asked for in so many words.
pub(crate) fn set_quiet(quiet: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
}

pub(crate) fn quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// The end of a verb, if it was not an error.
pub(crate) enum Exit {
    /// Exit code 0.
    Done,
    /// Exit code 2.
    NotCertified,
    /// Exit code 1, though everything ran.
    Failed,
    /// Exit code 3.
    Fault,
    /// Exit code 4.
    Stopped,
    /// Exit code 5: done, but the log is not whole.
    Incomplete,
}

/// Version and commit, as logs have them.
pub const BUILD: &str = env!("CLUTCH_BUILD");

/// Says that nothing was started, and what to do.
#[cfg(target_os = "linux")]
pub(crate) fn not_certified(refusal: &clutch_loop::clearance::ClearanceError, file: &Path) -> String {
    use clutch_loop::clearance::{ClearanceError, Lack};
    let unstable = matches!(refusal, ClearanceError::NotCertified { lack: Lack::Unstable(_), .. });
    let other = if unstable {
        "smaller gains, or a velocity that smooths less, make it stable;"
    } else {
        "--certificate takes a proof of the sampled loop, which `clutch certify --sampled --save` and `clutch tune --save` write;"
    };
    let advice =
        format!("`clutch certify {}` says why; {other} --uncertified runs it all the same.", file.display());
    paragraph(&refusal.to_string()) + &paragraph(&advice)
}

/// A record of runs is never written over: it may be the only one.
pub(crate) fn new_file(path: &Path) -> anyhow::Result<()> {
    if path.exists() {
        anyhow::bail!("{}: exists already; name a new file", path.display());
    }
    Ok(())
}

/// A file or folder to write, of a command line: not the dash by which other commands mean standard output.
pub(crate) fn to_write() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| {
        if path.as_os_str() == "-" {
            Err("expected a name: this result does not go to standard output")
        } else {
            Ok(path)
        }
    })
}

/// Refuses files that cannot be written: before a long run, not after. A file that stands there is not touched.
pub(crate) fn check_files<'a>(files: impl IntoIterator<Item = &'a PathBuf>) -> anyhow::Result<()> {
    for file in files {
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
        if folder.is_some_and(|folder| !folder.is_dir()) {
            anyhow::bail!("{}: cannot be written: its folder does not exist", file.display());
        }
        if file.is_dir() {
            anyhow::bail!("{}: cannot be written: it is a folder", file.display());
        }
        let closed = file.metadata().is_ok_and(|found| found.permissions().readonly());
        if closed {
            anyhow::bail!("{}: cannot be written: it is read-only", file.display());
        }
    }
    Ok(())
}

/// A verdict as a paragraph of at most 80 columns, its further lines indented.
pub(crate) fn paragraph(text: &str) -> String {
    flow("", text, 4)
}

/// A text beside a head, as a name in a list; further lines stand below the text.
pub(crate) fn beside(head: &str, text: &str) -> String {
    flow(head, text, head.chars().count() + 1)
}

fn flow(head: &str, text: &str, indent: usize) -> String {
    let mut out = head.to_owned();
    let mut column = columns(head);
    for word in kept_whole(text) {
        let length = columns(&word);
        if column > 0 && column + 1 + length > WIDTH {
            out += &format!("\n{:1$}", "", indent);
            column = indent;
        } else if column > 0 {
            out.push(' ');
            column += 1;
        }
        out += &word;
        column += length;
    }
    out.push('\n');
    out
}

/// The words of a text, a number with its unit as one.
fn kept_whole(text: &str) -> Vec<String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let mut kept = Vec::new();
    let mut rest = &words[..];
    while let [word, behind @ ..] = rest {
        let number = word.trim_start_matches(['(', '±', '<', '≥', '≤']).parse::<f64>().is_ok();
        let unit = if number { unit_at(behind) } else { 0 };
        kept.push(rest[..=unit].join(" "));
        rest = &behind[unit..];
    }
    kept
}

/// The number of words, from the first on, that are a unit; punctuation may follow the last.
fn unit_at(words: &[&str]) -> usize {
    let is = |unit: &str| {
        let parts: Vec<&str> = unit.split(' ').collect();
        let there = words.get(..parts.len())?;
        let (last, before) = there.split_last()?;
        let whole = last.trim_end_matches([',', ';', '.', ':', ')', ']']);
        (before == &parts[..before.len()] && [whole, last].contains(parts.last()?)).then_some(parts.len())
    };
    UNITS.iter().filter(|unit| !unit.text.is_empty()).filter_map(|unit| is(unit.text)).max().unwrap_or(0)
}

/// Columns of a text, which may have colours.
fn columns(text: &str) -> usize {
    strip_str(text).to_string().chars().count()
}

/// A text in whose lines a terminal of 80 columns breaks no word. Shorter ones stay as they are, and so does a file's line
/// that an error shows.
pub(crate) fn folded(text: &str) -> String {
    let fold = |line: &str| {
        if columns(line) <= WIDTH || shows_source(line) {
            return format!("{line}\n");
        }
        let words = line.trim_start();
        let indent = line.chars().count() - words.chars().count();
        // The space before the first word is put there with it.
        flow(&" ".repeat(indent.saturating_sub(1)), words, indent + 4)
    };
    text.lines().map(fold).collect()
}

/// True for a line that shows a place in a file, as errors of TOML do: `3 | kp_v = `, `  |        ^`.
fn shows_source(line: &str) -> bool {
    line.trim_start().trim_start_matches(|c: char| c.is_ascii_digit()).trim_start().starts_with('|')
}

/// The begin of an error: who says it.
pub(crate) const SPEAKER: &str = "clutch:";

/// Prints an error; a terminal gets it in lines of its own. Other readers may look for a line as it is.
pub(crate) fn complain(text: &str) {
    let text = shown(text);
    let text = if std::io::stderr().is_terminal() { folded(&text) } else { format!("{text}\n") };
    let text = match text.strip_prefix(SPEAKER) {
        Some(rest) => format!("{BAD}{SPEAKER}{BAD:#}{rest}"),
        None => text,
    };
    let _ = anstream::stderr().write_all(text.as_bytes()); // nobody is left to receive it
}

/// Prints why a command line is not understood, as [`complain`] does.
pub(crate) fn complain_of(line: &clap::Error) {
    let _ = if std::io::stderr().is_terminal() {
        anstream::stderr().write_all(folded(&line.render().ansi().to_string()).as_bytes())
    } else {
        line.print()
    };
}

/// Prints a remark on standard error, unless the command is to be quiet.
pub(crate) fn remark(text: &str) {
    if !quiet() {
        let _ = std::io::stderr().write_all(shown(text).as_bytes()); // a terminal that has gone away
    }
}

/// Runs long work under a progress bar; the bar shows on a terminal only.
pub(crate) fn with_progress<T>(unit: &str, work: impl FnOnce(Report<'_>) -> T) -> T {
    let style = ProgressStyle::with_template(&format!(
        "{{wide_bar}} {{human_pos}}/{{human_len}} {unit}, {{eta}} left"
    ));
    let bar = if quiet() { ProgressBar::hidden() } else { ProgressBar::no_length() };
    let bar = bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let result = work(&|p| {
        // Work that comes in parts tells the total of each as it begins; a run within one tells none.
        if p.total > 0 {
            if p.finished == 0 && bar.position() > 0 {
                bar.set_position(0);
            }
            bar.set_length(p.total);
        }
        bar.inc(p.finished);
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    result
}

/// Text for a terminal: names from files of others may hold what it would obey.
pub(crate) fn shown(text: &str) -> Cow<'_, str> {
    printable(text, &['\n', '\t'])
}

/// Prints to standard output what was asked for. A reader that has gone away (`| head`) is not an error.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(shown(text).as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other.context("standard output"),
    }
}

/// Prints a text for a reader, unless the command is to be quiet.
pub(crate) fn tell(text: &str) -> anyhow::Result<()> {
    if quiet() { Ok(()) } else { warn(text) }
}

/// Prints what a reader must know, as that nothing was started: verdicts in colour on a terminal that shows colours and
/// where NO_COLOR is not set.
pub(crate) fn warn(text: &str) -> anyhow::Result<()> {
    // Foreign escapes are taken out before ours are put in.
    let text = coloured(&shown(text));
    // On anything else the escapes are left out again.
    let mut out = anstream::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other.context("standard output"),
    }
}

/// The result as JSON, which is all that standard output then holds, or as a text.
pub(crate) fn report(
    as_json: bool,
    json: impl FnOnce() -> anyhow::Result<String>,
    text: impl FnOnce() -> String,
) -> anyhow::Result<()> {
    if as_json { print(&json()?) } else { tell(&text()) }
}

const BAD: Style = AnsiColor::Red.on_default().bold();
const KNOWN: Style = AnsiColor::Yellow.on_default();
const GOOD: Style = AnsiColor::Green.on_default();

/// Words of verdicts. The first that stands at a place counts.
const VERDICTS: &[(&str, Style)] = &[
    ("FAULT", BAD),
    ("DRIFT", BAD),
    ("NOT certified", BAD),
    ("not certified", BAD),
    ("UNCERTIFIED", BAD),
    ("UNSTABLE", BAD),
    ("does not hold", BAD),
    ("documented deviation", KNOWN),
    ("cannot tell", KNOWN),
    ("certified for the model", KNOWN),
    ("linearly stable", GOOD),
    ("certified", GOOD),
    ("holds", GOOD),
    ("identical", GOOD),
];

/// The text with its verdicts in their colours.
pub(crate) fn coloured(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 64);
    let mut done = 0;
    let first = |from: usize| {
        let places =
            VERDICTS.iter().filter_map(|(word, style)| Some((verdict_at(text, from, word)?, word, *style)));
        places.min_by_key(|(at, ..)| *at)
    };
    while let Some((at, word, style)) = first(done) {
        out += &format!("{}{style}{word}{style:#}", &text[done..at]);
        done = at + word.len();
    }
    out + &text[done..]
}

/// Place, from one on, of a word that is no part of a longer one, as a name, and is a verdict: what follows a colon, stands in
/// a cell, or begins a line that goes on no other. “The motor holds” is none, “NOT” is one anywhere.
fn verdict_at(text: &str, from: usize, word: &str) -> Option<usize> {
    let part = |c: char| c.is_alphanumeric() || "_-./`".contains(c);
    let given = |before: &str| {
        let said = before.trim_end();
        let gap = &before[said.len()..];
        said.is_empty()
            || said.ends_with(':')
            || gap.ends_with('\n')
            || (gap.len() > 1 && !gap.contains('\n'))
    };
    let is = |at: &usize| {
        let before = &text[..*at];
        !before.ends_with(part)
            && !text[*at + word.len()..].starts_with(part)
            && (given(before) || word.contains(char::is_uppercase) || word.starts_with("not"))
    };
    text[from..].match_indices(word).map(|(at, _)| from + at).find(is)
}

/// The lines that name the files that were written.
pub(crate) fn wrote(files: &[&Path]) -> String {
    files.iter().map(|file| format!("wrote {}\n", file.display())).collect()
}

/// Bars of one line, the higher the larger the value; the highest stands for `most`.
pub(crate) fn bars(values: &[f64], most: f64) -> String {
    const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let last = BARS.len() - 1;
    let bar = |x: &f64| {
        let share = if most > 0.0 { x / most } else { 0.0 };
        BARS[((share * BARS.len() as f64) as usize).min(last)]
    };
    values.iter().map(bar).collect()
}

/// Writes a file; errors name it.
pub(crate) fn write(path: &Path, bytes: impl AsRef<[u8]>) -> anyhow::Result<()> {
    std::fs::write(path, bytes).with_context(|| format!("{}: cannot be written", path.display()))
}

/// Forms in which a result is given: a text on standard output, unless another is asked for.
#[derive(Args)]
pub(crate) struct Forms {
    /// Prints the result as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
    /// Draws the result.
    #[arg(long, value_parser = to_write(), value_name = "FILE.svg|png")]
    plot: Option<PathBuf>,
    /// Writes the result as a page, with the picture and every parameter.
    #[arg(long, value_parser = to_write(), value_name = "FILE.html")]
    html: Option<PathBuf>,
}

impl Forms {
    /// Refuses a picture's file that cannot be drawn, and files that cannot be written: before a long run, not after.
    pub(crate) fn check(&self) -> anyhow::Result<()> {
        self.plot.as_deref().map_or(Ok(()), |file| plot::figure_format(file).map(drop))?;
        check_files(self.plot.iter().chain(&self.html))
    }

    /// True if standard output is to hold JSON alone.
    pub(crate) fn json(&self) -> bool {
        self.json
    }

    /// Writes and prints what is asked for; nothing else is made.
    pub(crate) fn give(
        &self,
        figure: impl FnOnce() -> anyhow::Result<Figure>,
        page: impl FnOnce(&Figure) -> anyhow::Result<String>,
        json: impl FnOnce() -> anyhow::Result<String>,
        text: impl FnOnce() -> String,
    ) -> anyhow::Result<()> {
        if self.plot.is_some() || self.html.is_some() {
            let figure = figure()?;
            if let Some(file) = &self.plot {
                figure.save(file)?;
            }
            if let Some(file) = &self.html {
                write(file, page(&figure)?)?;
            }
        }
        let files: Vec<&Path> =
            [&self.plot, &self.html].into_iter().flatten().map(PathBuf::as_path).collect();
        report(self.json, json, || text() + &wrote(&files))
    }
}

/// Pretty JSON with a line end.
pub(crate) fn json(value: &impl serde::Serialize) -> anyhow::Result<String> {
    Ok(serde_json::to_string_pretty(value)? + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_have_a_colour_and_names_that_hold_their_words_have_none() {
        let text = "gains: NOT certified; `clutch certify not_certified.toml`, as certified-2";
        let shown = coloured(text);
        assert_eq!(strip_str(&shown).to_string(), text);
        assert_eq!(shown, text.replace("NOT certified", &format!("{BAD}NOT certified{BAD:#}")));
        assert_eq!(coloured("UNCERTIFIED, then: certified").matches('\u{1b}').count(), 4 + 1);
        for cell in
            ["  ≤ 0.12   holds", "identical over 3 ticks", "sampled:\n    certified", "error:  certified"]
        {
            assert!(coloured(cell).contains('\u{1b}'), "{cell}");
        }
        for word in ["the delay holds lag", "inside a certified shell", "inside a\n    certified shell"] {
            assert_eq!(coloured(word), word);
        }
    }

    #[test]
    fn no_line_is_longer_than_80_columns_unless_a_word_is() {
        let words = "seven by seven ".repeat(20);
        let text = paragraph(&words);
        assert!(text.lines().all(|l| l.chars().count() <= WIDTH) && text.lines().count() == 4, "{text}");
        assert!(text.lines().skip(1).all(|l| l.starts_with("    s") || l.starts_with("    b")), "{text}");
        let listed = beside("A8                ", &words);
        assert!(listed.starts_with("A8                 seven by"), "{listed}");
        assert!(
            listed.lines().skip(1).all(|l| l.starts_with(&format!("{:19}", "")) && !l.ends_with(' ')),
            "{listed}"
        );
        assert!(listed.lines().all(|l| l.chars().count() <= WIDTH));
        assert_eq!(
            listed.split_whitespace().skip(1).collect::<Vec<_>>(),
            words.split_whitespace().collect::<Vec<_>>()
        );
        for (unit, head) in [("0.14 N m/V]", 72), ("(1000 µs,", 75), ("±76.485 %", 74), ("0.5 N m.", 76)] {
            let text = paragraph(&format!("{} {unit} or so", "w".repeat(head)));
            assert!(text.lines().nth(1).is_some_and(|l| l.starts_with(&format!("    {unit}"))), "{text}");
        }
        assert_eq!(kept_whole("3 N in 2 parts, 4 m s"), ["3", "N", "in", "2", "parts,", "4 m", "s"]);
        let long = "w".repeat(100);
        assert_eq!(paragraph(&long), long.clone() + "\n");
        assert_eq!(paragraph(&format!("about {long}")), format!("about\n    {long}\n"));
        assert_eq!(paragraph(""), "\n");
    }

    #[test]
    fn an_error_is_folded_between_words_and_what_it_shows_of_a_file_is_not() {
        let long = "a key that was not expected ".repeat(5);
        let source = format!("12 | kp_v = \"{long}\"");
        let text = format!("clutch: {long}\n{source}\n   |        ^\n  {long}\nshort,   and as it is");
        let told = folded(&text);
        let lines: Vec<&str> = told.lines().collect();
        assert!(lines.contains(&source.as_str()) && lines.contains(&"short,   and as it is"), "{told}");
        assert!(lines.iter().all(|l| l.chars().count() <= WIDTH || *l == source), "{told}");
        assert!(lines[1].starts_with("    ") && !lines[1].starts_with("     "), "{told}");
        let indented = lines.iter().position(|l| l.starts_with("  a key")).expect("the indented line");
        assert!(lines[indented + 1].starts_with("      ") && !lines[indented + 1].starts_with("       "));
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(words(&told), words(&text));
        // Colours take no columns.
        let red = format!("{BAD}red{BAD:#} ").repeat(20);
        assert_eq!(folded(&red), format!("{red}\n"));
    }

    #[test]
    fn bars_rise_with_the_value() {
        assert_eq!(bars(&[0.0, 0.2, 0.5, 0.99, 1.0, 1.0], 1.0), "▁▂▅███");
        assert_eq!(bars(&[0.0, 0.0], 0.0), "▁▁");
    }
}
