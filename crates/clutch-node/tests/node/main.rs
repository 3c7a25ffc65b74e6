//! The nodes by the rules of docs/wire.md, one at a time and in conversation. One program: each further one is linked for
//! as long as its tests are compiled.
#![allow(missing_docs, reason = "the tests' names say what holds")]
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests fail by panics")]

mod alone;
mod board;
mod board_controller;
mod board_program;
mod controller;
mod controller_lockstep;
mod desk;
mod hardware;
mod limits;
mod one_chip;
mod settings;
