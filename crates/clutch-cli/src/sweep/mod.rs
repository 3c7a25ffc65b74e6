//! `clutch sweep`.

#[cfg(feature = "parquet")]
mod columns;

use crate::args::ScenarioArgs;
use crate::map;
use crate::output::{Exit, new_file, tell, to_write, with_progress};
use crate::signals::stop_flag;
use anyhow::{Context, bail, ensure};
use clap::Args;
use clutch_sim::Keep;
use clutch_sim::metrics::{Detected, Metrics, figure_columns};
use clutch_sim::progress::{Progress, Report};
use clutch_sim::scenario::{CERTIFIED, Table, Value, written_value};
use clutch_sim::sweep::{Row, Sweep};
use clutch_sim::{Scenario, ScenarioError};
use std::borrow::Cow;
use std::fmt::{Display, Write as _};
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Read, Write};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Runs a scenario with many values of its keys, and writes the figures of each run as a row of a table.
///
/// Each --over is a key with its values; together they are a grid, of which the last key runs fastest. Rows are written in
/// their order, every second or so: what stops early goes on with --resume.
#[derive(Args)]
#[command(
    after_help = "Example:\n  clutch sweep pd_2 --over law.pd.kp_v_rad=500:5000:50 \\\n      --over law.pd.kd_v_s_rad=5,10,20,50 \
    --seeds 10 --out pd.csv\n\n\
    Columns are the keys in the units of their names, then figures in SI units and radians (docs/scenario.md), `certified_continuous_time`, \
    and `error`, the reason where a row is refused."
)]
pub(crate) struct SweepVerb {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// A key and its values: LOW:HIGH:NUMBER, evenly spaced in ratio from LOW above 0, else in difference (of a key that takes
    /// whole numbers, rounded to them), or a list. May be given several times.
    #[arg(long, value_name = "KEY=VALUES", value_parser = over, required = true)]
    over: Vec<Over>,
    /// Runs each row with the seeds 1 to N.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    seeds: Option<u64>,
    /// The table, by its ending: Parquet where the command is built with it, which is made at the end, of a CSV beside it; else
    /// CSV.
    #[arg(long, value_parser = to_write(), value_name = "FILE")]
    out: PathBuf,
    /// Goes on with a file that an earlier sweep of the same rows has begun.
    #[arg(long)]
    resume: bool,
    /// Threads; as many as the machine runs at once unless given.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
}

/// Most rows between two times that the file is written.
const CHUNK: u64 = 65_536;
/// Time between two of them, s.
const PAUSE_S: f64 = 1.0;
/// Rows of the whole grid that are tried where the first are all refused.
const TRIED: u64 = 256;
/// More rows than anybody waits for.
const MOST: u64 = 1_000_000_000;
/// Longest line of a file that an earlier sweep has begun, bytes.
const LONGEST: u64 = 1 << 20;
/// The key of `--seeds`.
const SEED: &str = "run.seed";

/// A key and its values.
#[derive(Clone, Debug)]
struct Over {
    key: String,
    values: Values,
    /// Made from LOW:HIGH:NUMBER.
    spread: bool,
}

impl Over {
    /// A key that takes whole numbers has those of a range, each once.
    fn whole(mut self, scenario: &Scenario) -> Self {
        if let (true, Values::Listed(list)) =
            (self.spread && scenario.takes_whole(&self.key), &mut self.values)
        {
            let numbers = list.iter().filter_map(|listed| listed.value.as_float());
            let mut whole: Vec<i64> = numbers.map(|x| x.round() as i64).collect();
            whole.dedup();
            *list = whole.into_iter().map(|n| Listed::from(Value::Integer(n))).collect();
        }
        self
    }
}

#[derive(Clone, Debug)]
enum Values {
    Listed(Vec<Listed>),
    /// 1 to n.
    Seeds(u64),
}

/// A value, and its text in the file.
#[derive(Clone, Debug)]
struct Listed {
    value: Value,
    text: String,
}

impl From<Value> for Listed {
    fn from(value: Value) -> Self {
        let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        Listed { value, text }
    }
}

impl Values {
    fn len(&self) -> u64 {
        match self {
            Values::Listed(list) => list.len() as u64,
            Values::Seeds(n) => *n,
        }
    }

    fn at(&self, i: u64) -> Value {
        match self {
            Values::Listed(list) => list[i as usize].value.clone(),
            Values::Seeds(_) => Value::Integer(i as i64 + 1),
        }
    }

    fn text(&self, i: u64) -> Cow<'_, str> {
        match self {
            Values::Listed(list) => Cow::Borrowed(&list[i as usize].text),
            Values::Seeds(_) => Cow::Owned((i + 1).to_string()),
        }
    }

    /// True if each value is such a one.
    #[cfg(feature = "parquet")]
    fn all(&self, is: fn(&Value) -> bool) -> bool {
        match self {
            Values::Listed(list) => list.iter().all(|listed| is(&listed.value)),
            Values::Seeds(_) => is(&self.at(0)),
        }
    }
}

fn over(text: &str) -> Result<Over, String> {
    let (key, list) = text.split_once('=').ok_or("expected KEY=VALUES, as law.pd.kp_v_rad=500:5000:50")?;
    let spread = list.contains(':') && !list.contains(['{', '[', '"']);
    let values: Vec<Value> = if spread {
        map::values(list)?.0.into_iter().map(Value::Float).collect()
    } else {
        items(list).into_iter().map(|item| value(item.trim())).collect::<Result<_, _>>()?
    };
    let values = Values::Listed(values.into_iter().map(Listed::from).collect());
    Ok(Over { key: key.trim().to_owned(), values, spread })
}

/// The parts of a list between commas that stand in no table, array or text.
fn items(list: &str) -> Vec<&str> {
    let (mut depth, mut quoted, mut from, mut parts) = (0_i32, false, 0, Vec::new());
    for (i, c) in list.char_indices() {
        match c {
            '"' => quoted = !quoted,
            '{' | '[' if !quoted => depth += 1,
            '}' | ']' if !quoted => depth -= 1,
            ',' if !quoted && depth == 0 => {
                parts.push(&list[from..i]);
                from = i + 1;
            }
            _ => {}
        }
    }
    parts.push(&list[from..]);
    parts
}

fn value(text: &str) -> Result<Value, String> {
    let value = written_value(text).filter(|_| !text.is_empty());
    value.ok_or_else(|| format!("`{text}`: expected numbers, words or tables with a comma between them"))
}

/// The rows of a sweep by their number.
struct Grid {
    origin: String,
    base: Table,
    axes: Vec<Over>,
    rows: u64,
}

impl Grid {
    fn new(
        origin: String,
        scenario: &Scenario,
        mut axes: Vec<Over>,
        seeds: Option<u64>,
    ) -> anyhow::Result<Self> {
        if let Some(n) = seeds {
            axes.push(Over { key: SEED.to_owned(), values: Values::Seeds(n), spread: false });
        }
        let axes: Vec<Over> = axes.into_iter().map(|axis| axis.whole(scenario)).collect();
        for (i, axis) in axes.iter().enumerate() {
            let twice = axes[..i].iter().any(|other| other.key == axis.key);
            ensure!(!twice, "{}: named twice; name a key once, with all of its values", axis.key);
        }
        let rows = axes.iter().try_fold(1_u64, |n, axis| n.checked_mul(axis.values.len()));
        match rows {
            Some(rows) if rows <= MOST => Ok(Grid { origin, base: scenario.given(), axes, rows }),
            _ => bail!("--over: the grid has more than {MOST} rows; give fewer values"),
        }
    }

    /// The values of each key, and the place of a row's among them; of the keys the last runs fastest.
    fn places(&self, row: u64) -> impl Iterator<Item = (&Values, u64)> {
        let mut rows = self.rows;
        self.axes.iter().map(move |axis| {
            let n = axis.values.len();
            rows /= n;
            (&axis.values, row / rows % n)
        })
    }

    fn header(&self) -> anyhow::Result<Vec<u8>> {
        let mut line = Line::new();
        self.axes.iter().try_for_each(|axis| line.cell(&axis.key))?;
        figure_columns(&Metrics::default(), &Detected::default())
            .try_for_each(|(name, _)| line.cell(name))?;
        line.cell(CERTIFIED)?;
        line.cell("error")?;
        line.end()
    }

    /// The values of a row as the file has them.
    fn keys_of(&self, row: u64) -> impl Iterator<Item = Cow<'_, str>> {
        self.places(row).map(|(values, i)| values.text(i))
    }

    /// Some rows, in their order.
    fn sweep(&self, rows: impl Iterator<Item = u64>) -> anyhow::Result<Sweep> {
        let keys = self.axes.iter().map(|axis| axis.key.clone()).collect();
        let values = |row| self.places(row).map(|(values, i)| values.at(i)).collect();
        let values = rows.map(values).collect();
        Ok(Sweep::new(&self.origin, self.base.clone(), keys, values)?)
    }

    /// True if one of some rows all over the grid is a scenario.
    fn any_runs(&self) -> anyhow::Result<bool> {
        let tried = self.rows.min(TRIED);
        // By the golden section: evenly all over the grid, and a row of each value of a short axis is among them.
        let golden = (self.rows as f64 * 0.618_034) as u64;
        let step = (golden..).find(|step| gcd(*step, self.rows) == 1).unwrap_or(1);
        let sweep = self.sweep((0..tried).map(|i| i * step % self.rows))?;
        Ok((0..sweep.len()).any(|row| sweep.scenario(row).is_ok_and(|scenario| scenario.plan().is_ok())))
    }

    /// A row of the file.
    fn line(&self, row: u64, outcome: &Result<Row, ScenarioError>) -> anyhow::Result<Vec<u8>> {
        let mut line = Line::new();
        self.keys_of(row).try_for_each(|text| line.cell(text))?;
        let (metrics, detected) = match outcome {
            Ok(row) => (row.run.metrics, row.run.detected),
            Err(_) => Default::default(),
        };
        for (_, figure) in figure_columns(&metrics, &detected) {
            match figure.filter(|_| outcome.is_ok()) {
                Some(figure) => line.cell(figure)?,
                None => line.cell("")?,
            }
        }
        match outcome {
            Ok(row) => line.cell(row.certified).and_then(|()| line.cell(""))?,
            // A record is a line.
            Err(e) => line.cell("").and_then(|()| line.cell(e.to_string().replace('\n', " ")))?,
        }
        line.end()
    }

    /// Runs some rows; of a sweep that is stopped the first that have ended.
    fn run(
        &self,
        rows: std::ops::Range<u64>,
        threads: usize,
        stop: &AtomicBool,
        progress: Report<'_>,
    ) -> anyhow::Result<Vec<Ended>> {
        let first = rows.start;
        let sweep = self.sweep(rows)?;
        let found: Mutex<Vec<Option<Ended>>> =
            Mutex::new(std::iter::repeat_with(|| None).take(sweep.len()).collect());
        sweep.run(threads, Keep::Figures, stop, &|i, outcome| {
            let line = self.line(first + i as u64, &outcome);
            if let Ok(mut found) = found.lock() {
                found[i] = Some(Ended { line, refusal: outcome.err() });
            }
            if progress(Progress { total: self.rows, finished: 1 }).is_break() {
                stop.store(true, Ordering::Relaxed);
            }
        });
        Ok(found.into_inner().unwrap_or_default().into_iter().map_while(|row| row).collect())
    }
}

/// Greatest common divisor.
fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// A row that has ended.
struct Ended {
    /// Its line of the file.
    line: anyhow::Result<Vec<u8>>,
    /// The reason, if it was refused.
    refusal: Option<ScenarioError>,
}

/// A line of CSV.
struct Line {
    cells: csv::Writer<Vec<u8>>,
    /// The text of a cell.
    text: String,
}

impl Line {
    /// Bytes of most lines.
    const USUAL: usize = 1024;

    fn new() -> Self {
        let cells = csv::WriterBuilder::new().buffer_capacity(Line::USUAL).from_writer(Vec::new());
        Line { cells, text: String::new() }
    }

    fn cell(&mut self, cell: impl Display) -> anyhow::Result<()> {
        self.text.clear();
        write!(self.text, "{cell}")?;
        Ok(self.cells.write_field(&self.text)?)
    }

    fn end(mut self) -> anyhow::Result<Vec<u8>> {
        self.cells.write_record(None::<&[u8]>)?;
        Ok(self.cells.into_inner()?)
    }
}

/// A file that rows are added to, how many it has, and how many of them are refused.
struct Begun {
    file: File,
    rows: u64,
    refused: u64,
}

/// True if a line of the file is of a row that was refused: its last column has the reason.
fn is_refused(line: &[u8]) -> bool {
    !line.ends_with(b",\n")
}

impl SweepVerb {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        let scenario = self.scenario.load()?;
        let origin = self.scenario.scenario.to_string_lossy().into_owned();
        let cores = || std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        let threads = self.threads.map_or_else(cores, NonZeroUsize::get);
        let (out, resume) = (lines_of(&self.out)?, self.resume);
        let grid = Grid::new(origin, &scenario, self.over, self.seeds)?;
        let stop = stop_flag()?;
        let begun = if resume && out.exists() {
            go_on(&grid, &out, threads, &stop)?
        } else {
            Some(begin(&grid, &out)?)
        };
        let Some(Begun { mut file, rows: before, mut refused }) = begun else {
            tell(&format!("{}: as it was; stopped: --resume goes on\n", out.display()))?;
            return Ok(Exit::Stopped);
        };
        let wrong = || format!("{}: cannot be written", out.display());
        // At first, and at least: each thread has a vector's rows.
        let least = (8 * threads as u64).min(CHUNK);
        let (mut rows, mut chunk) = (before, least);
        let done = with_progress("rows", |progress| -> anyhow::Result<bool> {
            if before > 0 {
                let _ = progress(Progress { total: grid.rows, finished: before });
            }
            while rows < grid.rows {
                let next = rows..(rows + chunk).min(grid.rows);
                let begun = Instant::now();
                let found = grid.run(next.clone(), threads, &stop, progress)?;
                if rows == 0
                    && let Some(Some(first)) = found.first().map(|row| &row.refusal)
                    && found.iter().all(|row| row.refusal.is_some())
                    && !grid.any_runs()?
                {
                    drop(std::fs::remove_file(&out));
                    let of = if found.len() as u64 == grid.rows {
                        ""
                    } else {
                        ", nor of others all over the grid,"
                    };
                    bail!("none of the first {} rows{of} is a scenario that runs: {first}", found.len());
                }
                let ended = found.len() as u64;
                let mut text = Vec::new();
                for row in found {
                    refused += u64::from(row.refusal.is_some());
                    text.extend(row.line?);
                }
                file.write_all(&text).and_then(|()| file.flush()).with_context(wrong)?;
                rows += ended;
                if rows < next.end {
                    return Ok(false);
                }
                let growth = (PAUSE_S / begun.elapsed().as_secs_f64().max(1e-3)).clamp(0.25, 4.0);
                chunk = ((chunk as f64 * growth) as u64).clamp(least, CHUNK);
            }
            Ok(true)
        })?;
        let made = if done { &self.out } else { &out };
        #[cfg(feature = "parquet")]
        if done && out != self.out {
            grid.convert(&scenario, &out, &self.out)?;
            drop(std::fs::remove_file(&out)); // every row of it is in the other
        }
        let mut text = format!("{rows} of {} rows in {}", grid.rows, made.display());
        if before > 0 {
            text += &format!(", {before} of them from before");
        }
        if refused > 0 {
            text += &format!("; {refused} refused, with the reason in the column error");
        }
        if !done {
            text += "; stopped: --resume goes on";
        }
        tell(&(text + "\n"))?;
        Ok(if done { Exit::Done } else { Exit::Stopped })
    }
}

/// The file that rows are added to as they come: the table itself, or of one that ends with its last row a CSV beside it.
fn lines_of(out: &Path) -> anyhow::Result<PathBuf> {
    let ends_with = |kind: &str| out.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(kind));
    if ends_with("csv") {
        return Ok(out.to_owned());
    }
    ensure!(ends_with("parquet"), "{}: expected a name that ends with .csv or .parquet", out.display());
    ensure!(
        cfg!(feature = "parquet"),
        "{}: this command is built without Parquet, which the released one has; name a file that ends with .csv",
        out.display()
    );
    new_file(out)?;
    Ok(out.with_extension("parquet.part.csv"))
}

/// A new file.
fn begin(grid: &Grid, out: &Path) -> anyhow::Result<Begun> {
    let wrong = || format!("{}: cannot be written", out.display());
    if out.exists() {
        bail!("{}: is there already; --resume goes on with it, or name another file", out.display());
    }
    let mut file = OpenOptions::new().write(true).create_new(true).open(out).with_context(wrong)?;
    file.write_all(&grid.header()?).with_context(wrong)?;
    Ok(Begun { file, rows: 0, refused: 0 })
}

/// A file of the same sweep: each row has the values that this one gives it, and its last whole row, run again, comes out the same.
/// None if it is stopped meanwhile.
fn go_on(grid: &Grid, out: &Path, threads: usize, stop: &AtomicBool) -> anyhow::Result<Option<Begun>> {
    let name = out.display();
    let wrong = || format!("{}: cannot be read", out.display());
    let header = grid.header()?;
    let mut reader = BufReader::new(File::open(out).with_context(wrong)?);
    let (mut last, mut length, mut lines, mut refused) = (Vec::new(), 0, 0_u64, 0);
    loop {
        let mut next = Vec::new();
        reader.by_ref().take(LONGEST).read_until(b'\n', &mut next).with_context(wrong)?;
        ensure!(
            (next.len() as u64) < LONGEST,
            "{name}: has a line of more than {LONGEST} bytes; name another file"
        );
        if next.last() != Some(&b'\n') {
            break; // the end, or a row that a kill has cut off
        }
        if lines == 0 && next != header {
            bail!("{name}: has other columns than this sweep; name another file");
        }
        if lines > 0 && lines <= grid.rows {
            let mut begins = Line::new();
            grid.keys_of(lines - 1).try_for_each(|text| begins.cell(text))?;
            let mut begins = begins.end()?;
            begins.pop();
            begins.push(b',');
            ensure!(
                next.starts_with(&begins),
                "{name}: its row {lines} has other values than this sweep gives it, {}; name another file",
                grid.keys_of(lines - 1).collect::<Vec<_>>().join(", ")
            );
            refused += u64::from(is_refused(&next));
        }
        length += next.len() as u64;
        lines += 1;
        last = next;
    }
    let rows = lines.saturating_sub(1);
    ensure!(lines > 0, "{name}: has no header of a sweep; name another file");
    ensure!(rows <= grid.rows, "{name}: has {rows} rows, and this sweep {}; name another file", grid.rows);
    if rows > 0 {
        let again = grid.run(rows - 1..rows, threads, stop, clutch_sim::progress::UNWATCHED)?;
        if again.is_empty() {
            return Ok(None); // stopped
        }
        let again: Vec<Vec<u8>> = again.into_iter().map(|row| row.line).collect::<anyhow::Result<_>>()?;
        let same = again == [last];
        ensure!(
            same,
            "{name}: its row {rows} is not what this sweep gives: it is of another scenario, other values or another version \
             of clutch; name another file"
        );
    }
    let wrong = || format!("{}: cannot be written", out.display());
    let file = OpenOptions::new().append(true).open(out).with_context(wrong)?;
    file.set_len(length).with_context(wrong)?;
    Ok(Some(Begun { file, rows, refused }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(text: &str) -> Vec<Value> {
        let values = over(text).unwrap().values;
        (0..values.len()).map(|i| values.at(i)).collect()
    }

    #[test]
    fn values_are_ranges_or_lists_of_numbers_words_and_tables() {
        assert_eq!(list("a.b=1,2.5, x"), [Value::Integer(1), Value::Float(2.5), Value::String("x".into())]);
        assert_eq!(list("a=1:100:3"), [1.0, 10.0, 100.0].map(Value::Float));
        assert_eq!(list("a=-5:5:3"), [-5.0, 0.0, 5.0].map(Value::Float));
        // The ends as they are written, and neighbours apart.
        assert_eq!(list("a=1:99.96:2"), [1.0, 99.96].map(Value::Float));
        assert_eq!(list("a=10001:10009:3"), [10001.0, 10005.0, 10009.0].map(Value::Float));
        let laws = list("law={ pd = { kp_v_rad = 1.0, kd_v_s_rad = 2.0 } },{ smc = {} }");
        assert_eq!(laws.len(), 2, "{laws:?}");
        assert_eq!(list("a=\"x,y\",z").len(), 2);
        for wrong in ["a", "a=", "a=1,,2", "a=1:2", "a=2:1:3", "a=0:inf:3", "a=x y"] {
            assert!(over(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_row_is_what_the_command_runs_with_its_values_set_on_another_rig_too() {
        let name = Path::new("pd_2");
        let scenario = Scenario::load(name, &[("run.duration_s".into(), "1.5".into())]).unwrap();
        let axes =
            ["rig.base=paper,bench", "run.engine=auto,dormand_prince", "rig.encoder.quantised=true,false"];
        let axes: Vec<Over> = axes.map(|text| over(text).unwrap()).into();
        let grid = Grid::new("pd_2".into(), &scenario, axes, None).unwrap();
        let sweep = grid.sweep(0..grid.rows).unwrap();
        for row in 0..grid.rows {
            let mut set = vec![("run.duration_s".to_owned(), "1.5".to_owned())];
            let values = grid.keys_of(row).map(|text| text.into_owned());
            set.extend(grid.axes.iter().map(|axis| axis.key.clone()).zip(values));
            let alone = Scenario::load(name, &set).unwrap();
            assert_eq!(sweep.scenario(row as usize).unwrap().canonical(), alone.canonical(), "{set:?}");
        }
    }

    #[test]
    fn a_range_of_a_key_that_takes_whole_numbers_is_of_them() {
        let scenario = Scenario::load(Path::new("smc_2"), &[]).unwrap();
        let texts = |of: &str| -> Vec<String> {
            let grid = Grid::new("smc_2".into(), &scenario, vec![over(of).unwrap()], None).unwrap();
            (0..grid.rows)
                .flat_map(|row| grid.keys_of(row).map(Cow::into_owned).collect::<Vec<_>>())
                .collect()
        };
        assert_eq!(texts("rig.encoder.counts_per_rev=1000:20000:4"), ["1000", "2714", "7368", "20000"]);
        assert_eq!(texts("rig.delay_ticks=1:3:9"), ["1", "2", "3"]);
        // A list is as it is written, and so is a range of another key.
        assert_eq!(texts("rig.delay_ticks=1,1.5"), ["1", "1.5"]);
        assert_eq!(texts("law.smc.kp_v=1:2:3"), ["1.0", "1.414", "2.0"]);
    }

    #[test]
    fn a_grid_of_which_one_value_of_a_key_runs_is_seen_to_run() {
        let scenario = Scenario::load(Path::new("pd_2"), &[]).unwrap();
        for (good, n) in [("5,-1,-2", 150), ("-2,5,-1", 150), ("-2,-1,5", 150), ("-1,-2,-3,-4,5", 300)] {
            let kd = over(&format!("law.pd.kd_v_s_rad={good}")).unwrap();
            let kp = over(&format!("law.pd.kp_v_rad=1:100:{n}")).unwrap();
            for axes in [vec![kd.clone(), kp.clone()], vec![kp, kd]] {
                assert!(
                    Grid::new("pd_2".into(), &scenario, axes, None).unwrap().any_runs().unwrap(),
                    "{good}"
                );
            }
        }
    }

    #[test]
    fn the_last_key_runs_fastest() {
        let axes = vec![over("a=1,2").unwrap(), over("b=3,4,5").unwrap()];
        let grid = Grid { origin: String::new(), base: Table::new(), axes, rows: 6 };
        let rows: Vec<Vec<i64>> = (0..6)
            .map(|row| grid.places(row).filter_map(|(values, i)| values.at(i).as_integer()).collect())
            .collect();
        assert_eq!(rows, [[1, 3], [1, 4], [1, 5], [2, 3], [2, 4], [2, 5]]);
    }
}
