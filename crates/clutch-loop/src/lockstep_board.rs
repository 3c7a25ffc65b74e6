//! A board controller that is asked in lockstep, and one in this process.

use clutch_node::controller_lockstep::{Exchange, answer};
use clutch_node::{BoardController, BoardControllerParams, Lines};

/// A board that answers in lockstep.
pub trait LockstepBoard {
    /// A request, and the answer; or why there is none.
    ///
    /// # Errors
    /// In words.
    fn exchange(&mut self, request: &Exchange<'_>) -> Result<Exchange<'_>, String>;
}

/// The board's state machine in this process: what an image runs, compiled for this machine.
pub struct InProcessBoard {
    node: BoardController,
    lines: Lines,
}

impl Default for InProcessBoard {
    fn default() -> Self {
        let node = BoardController::new(BoardControllerParams { board: 1, boot: 1, clock_hz: 0 });
        InProcessBoard { node, lines: Lines::default() }
    }
}

impl LockstepBoard for InProcessBoard {
    fn exchange(&mut self, request: &Exchange<'_>) -> Result<Exchange<'_>, String> {
        Ok(answer(&mut self.node, request, &mut self.lines))
    }
}
