//! The loop of the program: it alone owns node and hardware. Periods and bytes reach it one after the other, so nothing
//! is shared and nothing locks.

use crate::board::Board;
use clutch_node::{Role, receive, tick};

/// Bytes that are processed at a time: the longest wait of a period.
const CHUNK: usize = 32;

/// Period until a host has configured one, µs.
const BOOT_PERIOD_US: u32 = 1000;

/// Runs a role, for ever.
pub fn run(role: &mut impl Role, mut board: Board) -> ! {
    let mut bytes = [0; CHUNK];
    loop {
        // In this order: a period that is due takes precedence over waiting bytes.
        if board.begins(role.period_us().unwrap_or(BOOT_PERIOD_US)) {
            tick(role, &mut board);
        } else {
            let count = board.bytes(&mut bytes);
            receive(role, &mut board, bytes.get(..count).unwrap_or(&[]));
        }
    }
}
