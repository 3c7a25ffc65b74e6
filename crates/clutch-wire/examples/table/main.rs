//! Prints the files made from the table of messages. They are committed; a test compares them with
//! the present output.
//!
//! ```sh
//! cargo run -p clutch-wire --example table -- header > crates/clutch-wire/include/clutch_wire.h
//! cargo run -p clutch-wire --example table -- vectors > tests/wire/vectors.csv
//! cargo run -p clutch-wire --example table -- markdown docs/wire.md   # rewrites its tables
//! ```
#![allow(clippy::expect_used, clippy::indexing_slicing, reason = "a developer's tool, not the codec")]
#![allow(clippy::std_instead_of_core, clippy::alloc_instead_of_core, reason = "it runs on the host")]

pub(crate) mod header;
pub(crate) mod markdown;
pub(crate) mod vectors;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["header"] => print!("{}", header::text()),
        ["vectors"] => print!("{}", vectors::text()),
        ["markdown"] => print!("{}", markdown::tables()),
        ["markdown", path] => std::fs::write(path, markdown::replaced(&std::fs::read_to_string(path)?)?)?,
        _ => return Err("expected one of: header, vectors, markdown [FILE]".into()),
    }
    Ok(())
}
