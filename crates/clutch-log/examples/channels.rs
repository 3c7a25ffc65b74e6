//! Prints the channels of docs/log.md; a test holds the page against them.
//!
//! `cargo run -p clutch-log --example channels`

fn main() {
    print!("{}", clutch_log::channel_table());
}
