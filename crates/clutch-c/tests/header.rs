//! The committed header is that of these sources.
#![allow(missing_docs, reason = "the tests' names say what holds")]
#![allow(clippy::expect_used, reason = "tests fail by panics")]
#![allow(clippy::std_instead_of_core, clippy::alloc_instead_of_core, reason = "it runs on the host")]

#[path = "../examples/header/header.rs"]
#[allow(unreachable_pub, reason = "the example's own")]
mod header;

#[test]
fn the_header_is_that_of_these_sources_and_plain_ascii() {
    let committed = include_str!("../include/clutch.h");
    assert!(
        committed == header::text(),
        "include/clutch.h is another: `cargo run -p clutch-c --example header > crates/clutch-c/include/clutch.h`"
    );
    let strange: Vec<char> = committed.chars().filter(|c| !c.is_ascii()).collect();
    assert!(strange.is_empty(), "not ASCII: {strange:?}");
}
