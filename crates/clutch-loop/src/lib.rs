//! The real-time loop over a serial line, and the simulated board.

pub mod campaign;
pub mod daq;
pub mod emulated;
pub mod emulator;
pub mod end;
pub mod faults;
pub mod line;
pub mod port;
pub mod preflight;
pub mod realtime;
pub mod records;
pub mod replay;
pub mod run;
pub mod setup;
pub mod sim_board;
pub mod world;
