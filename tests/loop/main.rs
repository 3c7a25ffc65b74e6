//! `clutch loop` against a board in another process, over a real pseudo-terminal and over TCP.
//!
//! A busy machine must not fail these tests. Boards are patient where timing is not the subject;
//! where it is, the boards' own clocks are judged, and a run that the machine itself held up is
//! repeated a few times and reported.

mod crash;
mod endings;
mod faults;
mod harness;
mod live;
mod logs;
mod ports;
mod refusals;
mod same_as_simulation;
mod start;
mod strangers;
mod system_calls;
