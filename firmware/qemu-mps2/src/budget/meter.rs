//! Counts the instructions of a call, and prints the counts.

use core::arch::asm;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use semihosting::sys::arm_compat::sys_writec;

/// SysTick ticks of 40 ns in ten instructions of 128 ns (`-icount shift=7`).
const TICKS_PER_TEN: u32 = 32;
/// Counted, but not of the callee: the call, and one of the two reads of the clock.
const AROUND: u32 = 2;
/// The timer counts down through 24 bits.
const WRAP: u32 = 0x00ff_ffff;

/// Starts the clock.
pub fn start() -> Option<()> {
    let mut timer = cortex_m::Peripherals::take()?.SYST;
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(WRAP);
    timer.clear_current();
    timer.enable_counter();
    Some(())
}

/// Instructions from the entry of `function` to its return, both included.
///
/// # Safety
/// `function` is a function of the C calling convention whose arguments are the first words of
/// `arguments`, and whose result, if any, is in registers.
pub unsafe fn instructions(function: usize, arguments: [usize; 3]) -> u32 {
    let [a, b, c] = arguments;
    let (before, after): (u32, usize);
    // SAFETY: a call as its caller vouches for; the timer may be read at any time.
    unsafe {
        asm!(
            "ldr r4, [r5]",
            "blx r8",
            "ldr r8, [r5]",
            in("r5") &raw const (*SYST::PTR).cvr,
            out("r4") before,
            inout("r8") function => after,
            inout("r0") a => _,
            inout("r1") b => _,
            inout("r2") c => _,
            // Not `clobber_abi`: that names registers which this FPU lacks, and the compiler warns.
            out("r3") _, out("r12") _, out("lr") _,
            out("d0") _, out("d1") _, out("d2") _, out("d3") _,
            out("d4") _, out("d5") _, out("d6") _, out("d7") _,
        );
    }
    between(before, after as u32).wrapping_sub(AROUND)
}

/// Instructions between two readings of the timer.
pub fn between(before: u32, after: u32) -> u32 {
    let ticks = before.wrapping_sub(after) & WRAP;
    ticks.wrapping_mul(10).wrapping_add(TICKS_PER_TEN / 2) / TICKS_PER_TEN
}

/// The counts of one function.
pub struct Tally {
    name: &'static str,
    calls: u32,
    least: u32,
    sum: u64,
    most: u32,
}

impl Tally {
    /// Nothing called yet.
    pub fn new(name: &'static str) -> Tally {
        Tally { name, calls: 0, least: u32::MAX, sum: 0, most: 0 }
    }

    /// One call.
    pub fn add(&mut self, instructions: u32) {
        self.calls = self.calls.wrapping_add(1);
        self.least = self.least.min(instructions);
        self.most = self.most.max(instructions);
        self.sum = self.sum.wrapping_add(u64::from(instructions));
    }

    /// Prints the line.
    pub fn print(&self) {
        let mean = self.sum.checked_div(u64::from(self.calls)).unwrap_or(0);
        text(self.name);
        for number in [self.calls, self.least, mean as u32, self.most] {
            sys_writec(b' ');
            decimal(number);
        }
        sys_writec(b'\n');
    }
}

/// Prints a name and a number.
pub fn line(name: &str, number: u32) {
    text(name);
    sys_writec(b' ');
    decimal(number);
    sys_writec(b'\n');
}

/// Not `println!`: that has paths to a panic, and this image links only without.
fn text(text: &str) {
    text.bytes().for_each(sys_writec);
}

fn decimal(number: u32) {
    let mut unit = 1_000_000_000;
    while unit > 1 && number < unit {
        unit /= 10;
    }
    while unit > 0 {
        sys_writec(b'0' + (number / unit % 10) as u8);
        unit /= 10;
    }
}
