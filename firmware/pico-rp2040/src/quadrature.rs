//! The encoder: a program for one of the chip's input and output machines (PIO), which sees every edge of both signals.

use rp_pac as pac;

/// The first instructions are a table, entered at `4 · before + now`: the state of B and A before, and now.
///
/// | passes | clocks |
/// |---|---|
/// | neither changed; one changed, counts rise; they fall; both changed | 8; 9; 10; 10 |
///
/// Edges that are ten clocks apart are therefore never missed, and both signals that change within one pass are seen as
/// such: 12.5 million counts a second at 125 MHz.
const PROGRAM: [u16; 28] = {
    const LOST: u16 = 16;
    const DOWN: u16 = 18;
    const UP: u16 = 20;
    const TELL: u16 = 21;
    const LOOK: u16 = 24;
    let (same, up, down, lost) = (jmp(TELL), jmp(UP), jmp(DOWN), jmp(LOST));
    let program = [
        // now: 00, 01, 10, 11
        same,
        up,
        down,
        lost, // before: 00
        down,
        same,
        lost,
        up, // 01
        up,
        lost,
        same,
        down, // 10
        lost,
        down,
        up,
        same, // 11
        // LOST: tells the processor, by flag 0.
        0xc000, // irq 0
        jmp(TELL),
        // DOWN, UP: a counter for each direction, since there is no instruction that counts up. Each jump leads to
        // the instruction after it, so that it does not matter whether it is taken.
        jmp_y_dec(DOWN + 1),
        jmp(TELL),
        jmp_x_dec(TELL),
        // TELL: both counters' lower halves; dropped while the processor has not taken what was told before.
        shift_in(2, 16), // y
        shift_in(1, 16), // x
        0x8000,          // push noblock
        // LOOK, with nothing shifted in: the state before, the state now, and to the table.
        shift_in(7, 2), // osr
        shift_in(0, 2), // pins
        mov(7, 6),      // osr, isr
        mov(5, 6),      // pc, isr
    ];
    assert!(program.len() as u16 == LOOK + 4);
    program
};

/// The last instruction; the first follows it.
const LAST: u8 = PROGRAM.len() as u8 - 1;
const LOOK: u8 = LAST - 3;

// The instructions of the machine that the program uses, as the chip's manual encodes them. The crate that assembles
// whole programs brings a parser generator and sixty crates along.

const fn jmp(to: u16) -> u16 {
    to
}

const fn jmp_x_dec(to: u16) -> u16 {
    2 << 5 | to
}

const fn jmp_y_dec(to: u16) -> u16 {
    4 << 5 | to
}

const fn shift_in(source: u16, bits: u16) -> u16 {
    0x4000 | source << 5 | bits
}

const fn mov(to: u16, from: u16) -> u16 {
    0xa000 | to << 5 | from
}

/// Waits for a word: each costs the processor more than a clock, and a pass takes ten at most.
const PATIENCE: u32 = 16;

/// The encoder on two pins side by side.
pub(crate) struct Quadrature {
    raw: u16,
    silent: bool,
}

impl Quadrature {
    /// Starts at A's pin; B is on the next one.
    pub(crate) fn start(a: u8) -> Quadrature {
        let (pio, machine) = (pac::PIO0, pac::PIO0.sm(0));
        const { assert!(PROGRAM.len() <= 32, "the machine's memory") };
        for (at, instruction) in (0..32).zip(&PROGRAM) {
            pio.instr_mem(at).write(|w| w.set_instr_mem(*instruction));
        }
        machine.clkdiv().write(|w| w.set_int(1));
        machine.execctrl().write(|w| {
            w.set_wrap_top(LAST);
            w.set_wrap_bottom(LOOK);
        });
        // Bits are shifted in from the right, so that the newest are the lowest.
        machine.shiftctrl().write(|w| {
            w.set_in_shiftdir(false);
            w.set_out_shiftdir(true);
        });
        machine.pinctrl().write(|w| w.set_in_base(a));
        // The state before the first pass is the one now.
        machine.instr().write(|w| w.set_instr(mov(7, 0)));
        machine.instr().write(|w| w.set_instr(jmp(LOOK.into())));
        pio.ctrl().write(|w| w.set_sm_enable(1));
        let mut encoder = Quadrature { raw: 0, silent: false };
        encoder.read();
        encoder
    }

    /// The counts now, the lower 16 bits.
    pub(crate) fn read(&mut self) -> u16 {
        // Told before: four words at most.
        for _ in 0..pac::PIO0.flevel().read().rx0() {
            let _ = pac::PIO0.rxf(0).read();
        }
        self.silent = true;
        for _ in 0..PATIENCE {
            if pac::PIO0.fstat().read().rxempty() & 1 == 0 {
                let told = pac::PIO0.rxf(0).read();
                self.raw = ((told >> 16) as u16).wrapping_sub(told as u16);
                self.silent = false;
                break;
            }
        }
        self.raw
    }

    /// True if both signals have changed at once, so that counts may be lost, ever since the start; or if the machine
    /// stands still.
    pub(crate) fn fault(&self) -> bool {
        self.silent || pac::PIO0.irq().read().irq() & 1 != 0
    }
}
