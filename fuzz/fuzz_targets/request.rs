//! A browser's request to the live view. Nothing panics; a head that has been taken is taken in the same way with any
//! bytes behind it; and nobody gets anything whose bytes do not hold the token.
#![no_main]

use libfuzzer_sys::fuzz_target;
use request::{Gate, asked};

// The file alone: its crate brings simulator and loop, which take minutes to build.
#[allow(dead_code, reason = "the server of its crate uses the rest")]
#[path = "../../crates/clutch-live/src/request.rs"]
mod request;

const TOKEN: &str = "2f9c1e";

fuzz_target!(|data: &[u8]| {
    let gate = Gate { port: 4242, token: TOKEN.to_owned() };
    let answer = asked(data, &gate);
    let Ok(Some(_)) = answer else { return };
    assert!(data.windows(TOKEN.len()).any(|bytes| bytes == TOKEN.as_bytes()));
    let more = [data, b"\0\r\n\r\nGET"].concat();
    assert_eq!(asked(&more, &gate), answer);
});
