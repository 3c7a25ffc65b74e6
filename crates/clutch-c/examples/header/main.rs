//! Prints the C header. It is committed; a test compares it with the present output.
//!
//! ```sh
//! cargo run -p clutch-c --example header > crates/clutch-c/include/clutch.h
//! ```
#![allow(clippy::expect_used, reason = "a developer's tool")]
#![allow(clippy::std_instead_of_core, clippy::alloc_instead_of_core, reason = "it runs on the host")]

pub(crate) mod header;

fn main() {
    print!("{}", header::text());
}
