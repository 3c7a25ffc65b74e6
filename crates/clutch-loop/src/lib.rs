//! The real-time loop over a serial line, and the simulated board.
//!
//! A file is named after the board or the host that it is about; without one of them in its name it is this machine's own part, as
//! controller or as host of one.
//!
//! | file | is |
//! |---|---|
//! | `from_scenario`, `build_error` | from a checked scenario to a run that is built; why it cannot be |
//! | `station` | this machine at its line: the controller, or the host of a board controller |
//! | `port`, `realtime` | the line's device; the machine's clock, priorities and memory |
//! | `preflight`, `board_clock` | what station and board say to each other before consent; the board's clock by this machine's |
//! | `session`, `summary` | a scenario and options in; refusals, events and a summary out |
//! | `release` | the test of encoder and brake that comes before a run |
//! | `control_loop` | the run on its control thread |
//! | `clearance`, `cause_words` | whether a scenario may run on a board; refusals and causes in words |
//! | `drift` | friction over load against the bounds, from counts and voltages |
//! | `log_thread`, `watch` | what runs beside it: the log; what may be seen of it |
//! | `onlooker`, `live_gains`, `tuning` | one that looks on while a run goes; gains that are changed meanwhile |
//! | `virtual_time`, `true_motion` | the same run with a computed clock; figures of the shaft's true motion in it |
//! | `sim_board`, `sim_board_server`, `sim_board_greeting` | a board on a rig, both simulated; the same in real time behind a port |
//! | `faults`, `faulty_line`, `campaign` | what breaks, a line on which it breaks, and the campaign over all of it |
//! | `healthy` | runs in which nothing breaks |
//! | `lockstep_board`, `lockstep_host`, `lockstep_session` | a board controller that is asked instead of keeping time, its host, and a session with it |
//! | `qemu_board` | such a board, emulated |
//! | `chip_board` | a board's own image on a register model of its chip |
//! | `to_log`, `replay` | what a log gets; a log's counts to the law again |
//! | `picture` | what of a log a picture shows |
//!
//! Ports, real time and emulators are of Linux; what computes its clock runs everywhere.

pub mod board_clock;
#[cfg(target_os = "linux")]
mod board_words;
pub mod build_error;
pub mod campaign;
pub mod cause_words;
#[cfg(target_os = "linux")]
pub mod chip_board;
pub mod clearance;
#[cfg(target_os = "linux")]
pub mod control_loop;
pub mod drift;
pub mod faults;
pub mod faulty_line;
pub mod from_scenario;
pub mod healthy;
pub mod live_gains;
pub mod lockstep_board;
pub mod lockstep_host;
#[cfg(target_os = "linux")]
pub mod lockstep_session;
pub mod log_thread;
pub mod onlooker;
pub mod picture;
#[cfg(target_os = "linux")]
pub mod port;
#[cfg(target_os = "linux")]
pub mod preflight;
#[cfg(target_os = "linux")]
pub mod qemu_board;
#[cfg(target_os = "linux")]
pub mod realtime;
pub mod release;
pub mod replay;
#[cfg(target_os = "linux")]
pub mod session;
pub mod sim_board;
#[cfg(target_os = "linux")]
mod sim_board_greeting;
#[cfg(target_os = "linux")]
pub mod sim_board_server;
pub mod station;
#[cfg(target_os = "linux")]
pub mod summary;
pub mod to_log;
mod true_motion;
#[cfg(target_os = "linux")]
mod tuning;
pub mod virtual_time;
pub mod watch;
