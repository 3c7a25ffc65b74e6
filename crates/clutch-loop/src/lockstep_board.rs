//! A board controller that is asked in lockstep: emulated, or in this process.

use crate::qemu_board::{QemuBoard, QemuSerialBoard};
use clutch_node::lockstep::{Exchange, answer};
use clutch_node::{BoardController, BoardControllerParams, Outboxes};

/// A board that answers in lockstep.
pub trait LockstepBoard {
    /// A request, and the answer; or why there is none.
    ///
    /// # Errors
    /// In words.
    fn exchange(&mut self, request: &Exchange<'_>) -> Result<Exchange<'_>, String>;
}

impl LockstepBoard for QemuBoard {
    fn exchange(&mut self, request: &Exchange<'_>) -> Result<Exchange<'_>, String> {
        QemuBoard::exchange(self, request).map_err(|e| e.to_string())
    }
}

impl LockstepBoard for QemuSerialBoard {
    fn exchange(&mut self, request: &Exchange<'_>) -> Result<Exchange<'_>, String> {
        QemuSerialBoard::exchange(self, request).map_err(|e| e.to_string())
    }
}

/// The board's state machine in this process: what an image runs, compiled for this machine.
pub struct InProcessBoard {
    node: BoardController,
    outboxes: Outboxes,
}

impl Default for InProcessBoard {
    fn default() -> Self {
        let node = BoardController::new(BoardControllerParams { board: 1, boot: 1, clock_hz: 0 });
        InProcessBoard { node, outboxes: Outboxes::default() }
    }
}

impl LockstepBoard for InProcessBoard {
    fn exchange(&mut self, request: &Exchange<'_>) -> Result<Exchange<'_>, String> {
        Ok(answer(&mut self.node, request, &mut self.outboxes))
    }
}
