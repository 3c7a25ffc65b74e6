//! The figure of docs/smooth.md, laws against rates, by `cargo xtask smooth`.
//!
//! ```sh
//! cargo run --release --package clutch-sim --example smooth -- laws cells.json
//! cargo run --release --package clutch-cli --example laws_figure -- cells.json docs/figures/smooth.svg
//! ```

use anyhow::Context;
use clutch_cli::plot::{Cell, Cells, Figure, Panel};
use serde::Deserialize;
use std::path::Path;

/// Results of the example `smooth`, law by law and rate by rate.
#[derive(Deserialize)]
struct Found {
    laws: Vec<String>,
    rates_deg_s: Vec<f64>,
    cycles_per_s: Vec<Vec<f64>>,
    max_error_deg: Vec<Vec<f64>>,
    travel_v_s: Vec<Vec<f64>>,
    stuck_percent: Vec<Vec<f64>>,
}

/// A panel of the figure: its title, and the values between which its shade goes from light to dark, evenly in ratio.
struct Shown {
    title: &'static str,
    light: f64,
    dark: f64,
}

impl Shown {
    fn panel(&self, found: &Found, values: &[Vec<f64>]) -> Panel {
        let cell = |x: &f64| Cell {
            shade: (x.max(self.light) / self.light).ln() / (self.dark / self.light).ln(),
            text: number(*x),
        };
        Panel {
            title: self.title.to_owned(),
            x_label: "rate, °/s".to_owned(),
            cells: Some(Cells {
                columns: found.rates_deg_s.iter().map(f64::to_string).collect(),
                // From below.
                rows: found.laws.iter().rev().cloned().collect(),
                cells: values.iter().rev().flatten().map(cell).collect(),
            }),
            ..Panel::default()
        }
    }
}

/// Two digits, as many as there is room for.
fn number(x: f64) -> String {
    match x {
        0.0 => "0".to_owned(),
        x if x < 0.095 => format!("{x:.3}").trim_start_matches('0').to_owned(),
        x if x < 0.95 => format!("{x:.2}").trim_start_matches('0').to_owned(),
        x if x < 9.5 => format!("{x:.1}"),
        x => format!("{x:.0}"),
    }
}

fn main() -> anyhow::Result<()> {
    let mut args = std::env::args().skip(1);
    let (Some(from), Some(to)) = (args.next(), args.next()) else {
        anyhow::bail!("expected the cells, as JSON, and the name of the figure");
    };
    let text = std::fs::read_to_string(&from).with_context(|| format!("cannot read {from}"))?;
    let found: Found = serde_json::from_str(&text).with_context(|| format!("{from} holds no cells"))?;
    let shown = |title, light, dark| Shown { title, light, dark };
    let panels = vec![
        shown("stick-slip, cycles/s", 0.01, 41.0).panel(&found, &found.cycles_per_s),
        shown("largest error, °", 0.009, 1.5).panel(&found, &found.max_error_deg),
        shown("travel of the voltage, V/s", 10.0, 3000.0).panel(&found, &found.travel_v_s),
        shown("time stuck, %", 0.01, 100.0).panel(&found, &found.stuck_percent),
    ];
    let title = "Laws and rates on bench, 40 discs: from light, little, to dark, much".to_owned();
    Figure { title, columns: 2, panels, ..Figure::default() }.save(Path::new(&to))
}
