//! Controller, encoder and converter on one chip.

use crate::board::{BoardMisfit, BoardNode, BoardParams};
use crate::board_controller::{BoardController, BoardControllerParams};
use crate::board_program::Role;
use crate::outbox::{Mail, Outbox, Sink};
use clutch_core::{Counts, DacCode, Micros};
use clutch_wire::{Actuate, BoardState, Message};

/// Messages of the board that are heard after bytes of the host. A handshake has two; more would mean a livelock; the
/// remainder waits for the next call.
const MOST_HEARD: u32 = 8;

/// A [`BoardController`] that drives a [`BoardNode`] in the same memory. They exchange messages by value, without
/// frames, and a code is out before anything else follows from its sample. Times are the chip's clock since power-up,
/// µs.
#[derive(Clone, Debug)]
pub struct OneChip {
    controller: BoardController,
    board: BoardNode,
    /// Messages of the board, to the controller.
    up: Mail,
    to_host: Outbox,
}

/// The way from the controller to the board: a message is heard, and its code out, before the controller goes on.
struct ToBoard<'a, F> {
    board: &'a mut BoardNode,
    up: &'a mut Mail,
    now_us: u32,
    put_out: &'a mut F,
    /// A code was put out.
    out: bool,
}

impl<F: FnMut(DacCode)> ToBoard<'_, F> {
    /// Puts out the code that the board has.
    // A function of its own in machine code: on the path from a sample to its code there is nothing else to put out.
    #[cold]
    #[inline(never)]
    fn put_out(&mut self) {
        self.out = true;
        (self.put_out)(self.board.code());
    }
}

impl<F: FnMut(DacCode)> Sink for ToBoard<'_, F> {
    fn push(&mut self, message: &Message) {
        self.board.hear(self.now_us, message, self.up);
        self.put_out();
    }

    // A function of its own in machine code, too: the bound of the path from a sample to its code leads through it.
    #[inline(never)]
    fn actuate(&mut self, answer: &Actuate) {
        self.board.obey(self.now_us, answer, self.up);
        self.out = true;
        (self.put_out)(self.board.code());
    }
}

impl OneChip {
    /// A chip at power-up.
    ///
    /// # Errors
    /// Those of [`BoardParams::check`].
    pub fn new(controller: BoardControllerParams, board: &BoardParams) -> Result<Self, BoardMisfit> {
        board.check()?;
        Ok(OneChip::of(controller, board))
    }

    /// The same where [`BoardParams::check`] has passed: made in the place where it is to be, and not on the stack before.
    #[inline]
    #[must_use]
    pub fn of(controller: BoardControllerParams, board: &BoardParams) -> Self {
        OneChip {
            controller: BoardController::new(controller),
            board: BoardNode::of(board),
            up: Mail::default(),
            to_host: Outbox::new(),
        }
    }

    /// Looks at the clock.
    pub fn poll(&mut self, now_us: u64, put_out: &mut impl FnMut(DacCode)) {
        let OneChip { controller, board, up, to_host } = self;
        let daq = &mut ToBoard { board, up, now_us: now_us as u32, put_out, out: false };
        controller.poll(now_us.saturating_mul(1000), to_host, daq);
        let before = self.board.code();
        self.board.poll(now_us as u32, &mut self.up);
        if self.board.code() != before {
            put_out(self.board.code());
        }
        self.settle(now_us, put_out);
    }

    /// The controller hears what the board has to say.
    fn settle(&mut self, now_us: u64, put_out: &mut impl FnMut(DacCode)) {
        for _ in 0..MOST_HEARD {
            let Some(message) = self.up.take() else { return };
            let OneChip { controller, board, up, to_host } = self;
            let daq = &mut ToBoard { board, up, now_us: now_us as u32, put_out, out: false };
            let drove = controller.driving();
            controller.hear(&message, to_host, daq);
            controller.follow(now_us.saturating_mul(1000), drove, to_host, daq);
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
}

/// The board as controller: it closes the loop by itself.
impl Role for OneChip {
    /// Frame by frame: what the board answers to one is heard before the next.
    fn receive(&mut self, now_us: u64, bytes: &[u8], put_out: &mut impl FnMut(DacCode)) {
        for frame in bytes.split_inclusive(|byte| *byte == 0) {
            let OneChip { controller, board, up, to_host } = self;
            let daq = &mut ToBoard { board, up, now_us: now_us as u32, put_out, out: false };
            controller.host(now_us.saturating_mul(1000), frame, to_host, daq);
            self.settle(now_us, put_out);
        }
        put_out(self.board.code());
    }

    fn sample(
        &mut self,
        now_us: u64,
        counts: Counts,
        encoder_fault: bool,
        converter_fault: bool,
        put_out: &mut impl FnMut(DacCode),
    ) {
        let (fault, sample) = self.board.begin_period(now_us as u32, counts, encoder_fault, converter_fault);
        let OneChip { controller, board, up, to_host } = self;
        let daq = &mut ToBoard { board, up, now_us: now_us as u32, put_out, out: false };
        // The safe output goes on by itself; under control the sample's answer is the next code.
        if !daq.board.driving() {
            daq.put_out();
        }
        let (now_ns, drove) = (now_us.saturating_mul(1000), controller.driving());
        if let Some(fault) = fault {
            controller.hear(&Message::Fault(fault), to_host, daq);
        }
        if let Some(sample) = sample {
            controller.sample(now_ns, &sample, to_host, daq);
        }
        // A sample that is not answered leaves the code as it is.
        if !daq.out {
            daq.put_out();
        }
        controller.follow(now_ns, drove, to_host, daq);
        controller.poll(now_ns, to_host, daq);
        // One a period: that it has stopped, or that it refuses. Its consequences come a period later.
        if let Some(message) = daq.up.take() {
            controller.hear(&message, to_host, daq);
        }
    }

    fn period_us(&self) -> Option<u32> {
        self.board.period_us()
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.to_host
    }

    fn answered(&mut self, cycles: u32, lateness: Micros) {
        self.controller.spent(cycles);
        self.controller.answered(lateness);
    }
}
