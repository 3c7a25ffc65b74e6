//! Benchmarks, and what they need: `cargo xtask bench`.

pub mod machine_code;
