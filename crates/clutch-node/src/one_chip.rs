//! Controller, encoder and converter on one chip.

use crate::board::{BoardMisfit, BoardNode, BoardParams};
use crate::board_controller::{BoardController, BoardControllerParams, Outboxes};
use crate::outbox::Outbox;
use clutch_core::{Counts, DacCode, Micros};
use clutch_wire::BoardState;

/// Rounds of frames to and fro within one call. A handshake takes two; more rounds would mean a livelock; the
/// remainder waits for the next call.
const ROUNDS: u32 = 4;

/// An [`BoardController`] that drives a [`BoardNode`] in the same memory. Both speak as over a line, so that
/// what was shown for one is shown for the other. Times are the chip's clock since power-up, µs.
#[derive(Clone, Debug)]
pub struct OneChip {
    controller: BoardController,
    board: BoardNode,
    outboxes: Outboxes,
    up: Outbox,
}

impl OneChip {
    /// A chip at power-up.
    ///
    /// # Errors
    /// Those of [`BoardParams::check`].
    pub fn new(controller: BoardControllerParams, board: &BoardParams) -> Result<Self, BoardMisfit> {
        Ok(OneChip {
            controller: BoardController::new(controller),
            board: BoardNode::new(board)?,
            outboxes: Outboxes::default(),
            up: Outbox::default(),
        })
    }

    /// A sampling period begins: the encoder's counts, and what the chip sees of its hardware. The code
    /// that the converter is to give now.
    pub fn sample(
        &mut self,
        now_us: u64,
        counts: Counts,
        encoder_fault: bool,
        converter_fault: bool,
    ) -> DacCode {
        self.board.sample(now_us as u32, counts, encoder_fault, converter_fault, &mut self.up);
        self.settle(now_us);
        self.poll(now_us);
        self.board.code()
    }

    /// Bytes from the host.
    pub fn host(&mut self, now_us: u64, bytes: &[u8]) {
        self.controller.host(now_us.saturating_mul(1000), bytes, &mut self.outboxes);
        self.settle(now_us);
    }

    /// Looks at the clock.
    pub fn poll(&mut self, now_us: u64) {
        self.controller.poll(now_us.saturating_mul(1000), &mut self.outboxes);
        self.board.poll(now_us as u32, &mut self.up);
        self.settle(now_us);
    }

    /// Frames between the two, until neither has more to say.
    fn settle(&mut self, now_us: u64) {
        for _ in 0..ROUNDS {
            if self.up.is_empty() && self.outboxes.daq.is_empty() {
                return;
            }
            self.controller.daq(now_us.saturating_mul(1000), self.up.as_bytes(), &mut self.outboxes);
            self.up.clear();
            self.board.receive(now_us as u32, self.outboxes.daq.as_bytes(), &mut self.up);
            self.outboxes.daq.clear();
        }
    }

    /// The code that the converter is to give now.
    #[must_use]
    pub fn code(&self) -> DacCode {
        self.board.code()
    }

    /// The board's state.
    #[must_use]
    pub fn state(&self) -> BoardState {
        self.board.state()
    }

    /// The sampling period, µs; none before one was configured.
    #[must_use]
    pub fn period_us(&self) -> Option<u32> {
        self.board.period_us()
    }

    /// Frames for the host.
    pub fn to_host(&mut self) -> &mut Outbox {
        &mut self.outboxes.host
    }

    /// Clock cycles that the last tick took.
    pub fn spent(&mut self, cycles: u32) {
        self.controller.spent(cycles);
    }

    /// Reports how long the last answer took, from sample to converter.
    pub fn answered(&mut self, lateness: Micros) {
        self.controller.answered(lateness);
    }
}
