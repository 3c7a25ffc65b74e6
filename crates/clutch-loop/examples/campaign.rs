//! The fault campaign, with as many seeds as you like; prints the table of `docs/safety.md`. With an image of the
//! emulated board the controller is that board, and what breaks the controller from within is left out.
//!
//! `cargo run --release -p clutch-loop --example campaign -- [SEEDS [FIRST [IMAGE]]]`

use clutch_core::supervisor::Checks;
use clutch_loop::campaign::{Table, runs};
use clutch_loop::qemu_board::QemuBoard;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let seeds = args.next().map_or(Ok(12), |s| s.parse())?;
    let first = args.next().map_or(Ok(1), |s| s.parse())?;
    let image = args.next().map(PathBuf::from);
    let (mut table, mut count, mut failures) = (Table::default(), 0, 0);
    for run in runs(first, seeds).filter(|run| image.is_none() || run.is_outside()) {
        let outcome = match &image {
            None => run.run(Checks::ALL, false)?,
            Some(image) => run.run_on(QemuBoard::start(image)?)?,
        };
        table.add(&run, &outcome);
        count += 1;
        if let Some(what) = run.judge(&outcome) {
            failures += 1;
            eprintln!("FAILED: {}: {what}", run.name());
        }
    }
    print!("{table}");
    eprintln!("seeds {first} to {}: {count} runs, {failures} failures", first + seeds - 1);
    if failures > 0 { Err("the campaign failed".into()) } else { Ok(()) }
}
