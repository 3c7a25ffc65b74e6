//! Prints what is made from the table of messages: the C header, test vectors, the tables of docs/wire.md. `cargo xtask
//! generate` puts them into the tree; a test compares.
//!
//! `cargo run -p clutch-wire --example table -- header`
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
        _ => return Err("expected one of: header, vectors, markdown".into()),
    }
    Ok(())
}
