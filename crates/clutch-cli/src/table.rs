//! Plain tables for a terminal.

use clutch_sim::metrics::Figure;
pub(crate) use clutch_sim::number;
use comfy_table::{CellAlignment, ColumnConstraint, ContentArrangement, Table, TableStyle, Width};

/// Rows of name, value and unit, under a title.
pub(crate) fn quantities(title: &str, rows: &[(&str, String, &str)]) -> String {
    let mut table = Table::new();
    table.load_style(TableStyle::new()).set_content_arrangement(ContentArrangement::Disabled);
    for (name, value, unit) in rows {
        table.add_row(vec![format!("  {name}"), value.clone(), (*unit).to_owned()]);
    }
    if let Some(column) = table.column_mut(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    if let Some(column) = table.column_mut(0) {
        column.set_constraint(ColumnConstraint::LowerBoundary(Width::Fixed(38)));
    }
    let mut text = format!("{title}\n");
    for line in table.to_string().lines() {
        text += line.trim_end();
        text.push('\n');
    }
    text
}

/// Columns of numbers beside one another in a terminal.
const BESIDE: usize = 3;

/// Rows of name, a value in each column, and unit; columns beyond three stand below.
pub(crate) fn columns(heads: &[String], rows: &[(&str, Vec<String>, &str)]) -> String {
    let mut text = String::new();
    for from in (0..heads.len()).step_by(BESIDE) {
        let these = from..heads.len().min(from + BESIDE);
        let line = |name: &str, cells: &[String], unit: &str| {
            let cells: String = cells.iter().map(|cell| format!(" {cell:>11}")).collect();
            format!("   {name:<30}{cells}  {unit}").trim_end().to_owned() + "\n"
        };
        text += &line("", &heads[these.clone()], "");
        rows.iter().for_each(|(name, cells, unit)| text += &line(name, &cells[these.clone()], unit));
    }
    text
}

/// A figure as a row of [`quantities`]: in words, its value, its unit.
pub(crate) fn row<M>(figure: &Figure<M>, m: &M) -> (&'static str, String, &'static str) {
    (figure.label, figure.shown(m).map_or("–".to_owned(), number), figure.shown_unit)
}
