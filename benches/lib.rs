//! Benchmarks, and their helpers: `cargo xtask bench`.

pub mod machine_code;
