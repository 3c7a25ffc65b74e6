//! The `clutch` command: see `clutch --help`.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(clutch_cli::main(std::env::args_os()))
}
