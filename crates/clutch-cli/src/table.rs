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

/// A figure as a row of [`quantities`]: in words, its value, its unit.
pub(crate) fn row<M>(figure: &Figure<M>, m: &M) -> (&'static str, String, &'static str) {
    (figure.label, figure.shown(m).map_or("–".to_owned(), number), figure.shown_unit)
}
