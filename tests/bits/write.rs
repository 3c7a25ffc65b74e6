//! Writes the runs of the test of equal bits to a folder, for another machine to repeat; prints the table
//! of `docs/bits.md`.
//!
//! `cargo run --release -p clutch-tests --example bits -- FOLDER`

use clutch_tests::bits::{Run, Wrong, table, write};

fn main() -> Result<(), Wrong> {
    let folder = std::env::args_os().nth(1).ok_or("usage: bits FOLDER")?;
    let runs = Run::all()?;
    write(&runs, folder.as_ref())?;
    print!("{}", table(&runs));
    Ok(())
}
