//! The rows of a sweep as Parquet, made of the CSV to which they were written as they came.

use super::{Grid, Over};
use crate::columnar::{Column, Columnar, TOGETHER, field};
use crate::output::BUILD;
use anyhow::{Context, anyhow};
use arrow_schema::{DataType, Field};
use clutch_sim::Scenario;
use clutch_sim::metrics::{Detected, Metrics, figure_columns};
use clutch_sim::scenario::{CERTIFIED, Value};
use std::path::Path;
use std::str::FromStr;

/// Values of a column, as they are read. What a run may leave unknown, and a refused row always does, is null.
enum Cells {
    Whole(Vec<i64>),
    Real(Vec<f64>),
    Figure(Vec<Option<f64>>),
    Flag(Vec<Option<bool>>),
    Text(Vec<String>),
}

/// A cell of the CSV: none if it is empty; an error if it is no such value.
fn known<T: FromStr>(cell: &str) -> Result<Option<T>, T::Err> {
    if cell.is_empty() { Ok(None) } else { cell.parse().map(Some) }
}

impl Cells {
    /// Column of a key with these values.
    fn of(axis: &Over) -> Cells {
        let all = |is: fn(&Value) -> bool| axis.values.all(is);
        if all(|value| matches!(value, Value::Integer(_))) {
            Cells::Whole(Vec::new())
        } else if all(|value| matches!(value, Value::Integer(_) | Value::Float(_))) {
            Cells::Real(Vec::new())
        } else {
            Cells::Text(Vec::new())
        }
    }

    /// Takes a cell of the CSV; false if it is none of this column.
    fn push(&mut self, cell: &str) -> bool {
        match self {
            Cells::Whole(all) => cell.parse().map(|x| all.push(x)).is_ok(),
            Cells::Real(all) => cell.parse().map(|x| all.push(x)).is_ok(),
            Cells::Figure(all) => known(cell).map(|x| all.push(x)).is_ok(),
            Cells::Flag(all) => known(cell).map(|x| all.push(x)).is_ok(),
            Cells::Text(all) => {
                all.push(cell.to_owned());
                true
            }
        }
    }

    fn column(&self) -> Column<'_> {
        match self {
            Cells::Whole(all) => Column::Whole(all),
            Cells::Real(all) => Column::Real(all),
            Cells::Figure(all) => Column::KnownReal(all),
            Cells::Flag(all) => Column::KnownFlag(all),
            Cells::Text(all) => Column::Text(all.iter().map(String::as_str).collect()),
        }
    }

    fn clear(&mut self) {
        match self {
            Cells::Whole(all) => all.clear(),
            Cells::Real(all) => all.clear(),
            Cells::Figure(all) => all.clear(),
            Cells::Flag(all) => all.clear(),
            Cells::Text(all) => all.clear(),
        }
    }

    fn field(&self, name: &str, about: (&str, &str)) -> Field {
        let of = match self {
            Cells::Whole(_) => DataType::Int64,
            Cells::Real(_) | Cells::Figure(_) => DataType::Float64,
            Cells::Flag(_) => DataType::Boolean,
            Cells::Text(_) => DataType::Utf8,
        };
        field(name, of, about).with_nullable(matches!(self, Cells::Figure(_) | Cells::Flag(_)))
    }
}

impl Grid {
    /// The columns in the order of [`Grid::header`].
    fn columns(&self, scenario: &Scenario) -> Vec<(Field, Cells)> {
        let mut columns: Vec<(Field, Cells)> = Vec::new();
        let mut add = |name: &str, cells: Cells, about| columns.push((cells.field(name, about), cells));
        for axis in &self.axes {
            add(&axis.key, Cells::of(axis), (scenario.unit(&axis.key).unwrap_or_default(), ""));
        }
        let of_motion = Metrics::FIGURES.iter().map(|f| (f.name, (f.unit, f.label)));
        let about: Vec<_> =
            of_motion.chain(Detected::FIGURES.iter().map(|f| (f.name, (f.unit, f.label)))).collect();
        for (name, _) in figure_columns(&Metrics::default(), &Detected::default()) {
            let about =
                about.iter().find(|(figure, _)| *figure == name).map_or(("", ""), |(_, about)| *about);
            add(name, Cells::Figure(Vec::new()), about);
        }
        add(CERTIFIED, Cells::Flag(Vec::new()), ("", ""));
        add("error", Cells::Text(Vec::new()), ("", ""));
        columns
    }

    /// Makes the Parquet of the CSV; the file has its name only once it is whole.
    pub(super) fn convert(&self, scenario: &Scenario, lines: &Path, out: &Path) -> anyhow::Result<()> {
        let part = out.with_extension("parquet.part");
        drop(std::fs::remove_file(&part)); // of a conversion that was cut off
        let (fields, mut cells): (Vec<_>, Vec<_>) = self.columns(scenario).into_iter().unzip();
        let names: Vec<String> = fields.iter().map(|field| field.name().clone()).collect();
        let kept = [
            ("scenario", self.origin.clone()),
            ("version", BUILD.to_owned()),
            ("scenario.toml", scenario.canonical()),
        ];
        let kept = kept.map(|(key, text)| (key.to_owned(), text)).to_vec();
        let wrong = || format!("{}: cannot be written", out.display());
        let mut file = Columnar::begin(&part, fields, kept).with_context(wrong)?;
        let mut csv =
            csv::Reader::from_path(lines).with_context(|| format!("{}: cannot be read", lines.display()))?;
        let mut waiting = 0;
        for (row, record) in csv.records().enumerate() {
            for ((cells, cell), name) in cells.iter_mut().zip(&record?).zip(&names) {
                let told =
                    || anyhow!("{}: row {}, {name} = {cell}: is not of this sweep", lines.display(), row + 1);
                cells.push(cell).then_some(()).ok_or_else(told)?;
            }
            waiting += 1;
            if waiting == TOGETHER {
                file.rows(cells.iter().map(Cells::column)).with_context(wrong)?;
                cells.iter_mut().for_each(Cells::clear);
                waiting = 0;
            }
        }
        if waiting > 0 {
            file.rows(cells.iter().map(Cells::column)).with_context(wrong)?;
        }
        file.end().and_then(|()| std::fs::rename(&part, out)).with_context(wrong)
    }
}
