//! The real-time loop over a serial line, and the simulated board.

pub mod campaign;
pub mod control_loop;
pub mod faults;
pub mod faulty_line;
pub mod from_scenario;
pub mod lockstep_host;
pub mod port;
pub mod preflight;
pub mod qemu_board;
pub mod realtime;
pub mod replay;
pub mod sim_board;
pub mod sim_board_server;
pub mod station;
pub mod to_log;
pub mod virtual_time;
