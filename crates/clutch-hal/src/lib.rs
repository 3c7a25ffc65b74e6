#![doc = include_str!("../README.md")]
#![no_std]

mod board;
mod converter;
mod line;

pub use board::{Board, Clock, Quadrature, Watchdog};
pub use converter::{CoarsePwm, Converter, Pwm, SpiDac, SpiKind};
pub use line::Line;
