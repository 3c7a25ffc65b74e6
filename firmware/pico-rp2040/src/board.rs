//! The board: clocks, converter, encoder, line, watchdog. For another board, write another such file.

use crate::line::{self, ToHost};
use crate::quadrature::Quadrature;
use crate::stack_guard::guard_stack;
use clutch_core::{Counts, DacCode};
use clutch_node::{BoardParams, Hardware, ResetCause, WideCounter};
use core::cell::Cell;
use core::sync::atomic::{AtomicBool, Ordering};
use pac::interrupt;
use rp_pac as pac;

/// OUTPUT WHEN NOBODY CONTROLS: at power-up, after a reset, in a fault handler. It is a property of the rig that the
/// board is built into. 4.5 V of 10 V holds the paper's weight; if a person moves the shaft and an open brake is safe,
/// set it to 0. THE SWITCH BEHIND THE FILTER MUST REST ON THE SAME VOLTAGE, since until this program has come that far
/// the pin is pulled low and the brake would let go: docs/firmware.md.
pub const BOOT_CODE: DacCode = DacCode(1844);

/// Counts per turn of the shaft, four for each line of the encoder.
const COUNTS_PER_REV: u32 = 20_000;

/// Voltage at the brake for code 0 and for code 4096, mV: 3.3 V times the driver's gain of 3.03.
/// Enter the values that you measure at the brake's terminals, here and in the scenario.
const DRIVER_MV: (i32, i32) = (0, 10_000);

/// Serial number of the board: the chip has none of its own. 0 and 1 are simulated boards.
const BOARD: u32 = 2040;

/// Parameters of the board, but for the number of the power-up.
const PARAMS: BoardParams = BoardParams {
    board: BOARD,
    boot: 0,
    counts_per_rev: COUNTS_PER_REV,
    dac_bits: 12,
    dac_lowest_mv: DRIVER_MV.0,
    dac_highest_mv: DRIVER_MV.1,
    period_min_us: 1000,
    period_max_us: 4000,
    watchdog_max_us: 100_000,
    boot_code: BOOT_CODE.0,
    started_by: ResetCause::Unknown,
    brown_out_low: false,
};
const _: () = assert!(PARAMS.check().is_ok(), "a number above is out of range: see BoardParams::check");

/// Baud rate of the line to the host.
const BAUD: u32 = 921_600;

/// Periods of 1 ms until the filter behind the converter's pin, 3.3 kΩ · 100 nF, is within 0.1 % of its voltage.
const FILTER_PERIODS: u32 = 3;

/// Pins, by their number on the chip. The converter's is output A of PWM slice 0.
const LINE: [usize; 2] = [0, 1];
const ENCODER_A: usize = 2;
const ENCODER_B: usize = 3;
const CONVERTER: usize = 16;
/// High: the switch connects filter and driver.
const CONNECTED: usize = 17;
/// High: the regulator of the 3.3 V, which is the converter's reference, does not save power, and has less ripple.
const REGULATOR: usize = 23;

/// The slices of the PWM: converter, clock, period.
const CODE: usize = 0;
const CLOCK: usize = 1;
const PERIOD: usize = 2;

/// The core's clock, Hz, and the crystal's, MHz.
const CORE_HZ: u32 = 125_000_000;
const CRYSTAL_MHZ: u32 = 12;

/// The clock that `cycles` counts, Hz: the core has no counter.
pub const CYCLES_HZ: u32 = 1_000_000;

/// The watchdog's time, as it counts: two for each tick (erratum E1), a tick for twelve clocks of the ring oscillator,
/// which has 1.8 to 12 MHz and usually 6.5. 10 ms at least, usually 18, 67 at most.
const WATCHDOG: u32 = 20_000;
const RING_CLOCKS: u16 = 12;

/// A note of [`stop`], and below it the reason: other contents of the register are none.
const NOTED: u32 = 0xC10C_5E00;

/// True when a period has begun that was not served.
static BEGUN: AtomicBool = AtomicBool::new(false);

#[interrupt]
fn PWM_IRQ_WRAP() {
    pac::PWM.intr().write(|w| w.0 = 1 << PERIOD);
    BEGUN.store(true, Ordering::Relaxed);
}

/// True once for each period that has begun; for several that have begun since, too.
fn begun() -> bool {
    let begun = BEGUN.load(Ordering::Relaxed);
    if begun {
        BEGUN.store(false, Ordering::Relaxed);
    }
    begun
}

/// The hardware as the node sees it.
pub struct Board {
    encoder: Quadrature,
    counter: WideCounter,
    line: ToHost,
    /// Time of the last look at the clock, µs; its lower 16 bits are the clock's.
    now_us: Cell<u64>,
    period_us: u32,
    told: DacCode,
    /// A different number at each power-up.
    boot: u32,
    started_by: ResetCause,
}

/// For a program that cannot continue: lets the switch fall back, puts the safe output out behind it, notes the reason
/// for the program that starts next, and waits for the reset. Trusts none of the contents of memory: it runs from flash.
#[unsafe(link_section = ".HardFault.stop")]
#[inline(never)]
pub fn stop(cause: ResetCause) -> ! {
    cortex_m::interrupt::disable();
    pac::SIO.gpio_out(0).value_clr().write_value(1 << CONNECTED);
    pac::PWM.ch(CODE).cc().write(|w| w.set_a(BOOT_CODE.0));
    pac::WATCHDOG.scratch0().write_value(NOTED | cause as u32);
    loop {
        cortex_m::asm::nop();
    }
}

/// The core at 125 MHz from the crystal: the host measures this clock, and an error of 1 % is too much. The reference
/// clock stays with the ring oscillator, so that the watchdog has a clock of its own.
fn start_clocks() {
    pac::XOSC.ctrl().write(|w| w.set_freq_range(pac::xosc::vals::CtrlFreqRange::_1_15MHZ));
    pac::XOSC.startup().write(|w| w.set_delay(282)); // times 256 clocks: 6 ms
    pac::XOSC.ctrl().modify(|w| w.set_enable(pac::xosc::vals::Enable::ENABLE));
    while !pac::XOSC.status().read().stable() {}
    let pll = pac::PLL_SYS;
    pll.cs().write(|w| w.set_refdiv(1));
    pll.fbdiv_int().write(|w| w.set_fbdiv_int(1500 / CRYSTAL_MHZ as u16));
    pll.pwr().modify(|w| {
        w.set_pd(false);
        w.set_vcopd(false);
    });
    while !pll.cs().read().lock() {}
    pll.prim().write(|w| {
        w.set_postdiv1(6);
        w.set_postdiv2(2);
    });
    pll.pwr().modify(|w| w.set_postdivpd(false));
    let clocks = pac::CLOCKS;
    clocks.clk_sys_ctrl().modify(|w| w.set_auxsrc(pac::clocks::vals::ClkSysCtrlAuxsrc::CLKSRC_PLL_SYS));
    clocks.clk_sys_ctrl().modify(|w| w.set_src(pac::clocks::vals::ClkSysCtrlSrc::CLKSRC_CLK_SYS_AUX));
    while clocks.clk_sys_selected().read() != 2 {}
    clocks.clk_peri_ctrl().write(|w| w.set_enable(true));
    // A clock that stands still for 255 of the ring oscillator's, some 40 µs, goes on from that oscillator, and calls
    // an interrupt that has no handler: `stop`. The maker means this for debugging; here a reset follows.
    clocks.clk_sys_resus_ctrl().write(|w| {
        w.set_timeout(255);
        w.set_enable(true);
    });
    clocks.inte().write(|w| w.set_clk_sys_resus(true));
    line::unmask(pac::Interrupt::CLOCKS_IRQ);
}

/// The reason why the program starts. A reset by the watchdog may have a reason that [`stop`] has noted, in a register
/// that outlives it. The cause of a reset of the whole chip is kept until the next such reset, so the watchdog comes first.
fn started_by() -> ResetCause {
    let (watchdog, chip) = (pac::WATCHDOG.reason().read(), pac::VREG_AND_CHIP_RESET.chip_reset().read());
    let note = pac::WATCHDOG.scratch0().read();
    pac::WATCHDOG.scratch0().write_value(0);
    if watchdog.timer() {
        match note ^ NOTED {
            n if n == ResetCause::Fault as u32 => ResetCause::Fault,
            n if n == ResetCause::Clock as u32 => ResetCause::Clock,
            _ => ResetCause::Watchdog,
        }
    } else if watchdog.force() || chip.had_psm_restart() {
        ResetCause::Software
    } else if chip.had_run() {
        ResetCause::Pin
    } else if chip.had_por() {
        ResetCause::Power
    } else {
        ResetCause::Unknown
    }
}

/// Starts the board, its output first.
pub fn start() -> Board {
    guard_stack();
    let started_by = started_by();
    // A debugger's reset leaves the clocks as they are: the core must not run from the PLL that is reset below.
    pac::CLOCKS.clk_sys_ctrl().modify(|w| w.set_src(pac::clocks::vals::ClkSysCtrlSrc::CLK_REF));
    while pac::CLOCKS.clk_sys_selected().read() != 1 {}
    let needed = |w: &mut pac::resets::regs::Peripherals, reset: bool| {
        w.set_io_bank0(reset);
        w.set_pads_bank0(reset);
        w.set_pll_sys(reset);
        w.set_pwm(reset);
        w.set_pio0(reset);
        w.set_dma(reset);
        w.set_uart0(reset);
    };
    pac::RESETS.reset().modify(|w| needed(w, true));
    pac::RESETS.reset().modify(|w| needed(w, false));
    let mut wanted = pac::resets::regs::Peripherals(0);
    needed(&mut wanted, true);
    while pac::RESETS.reset_done().read().0 & wanted.0 != wanted.0 {}
    start_clocks();

    let converter = pac::PWM.ch(CODE);
    converter.top().write(|w| w.set_top(4095));
    converter.cc().write(|w| w.set_a(BOOT_CODE.0));
    converter.csr().write(|w| w.set_en(true));
    function::<CONVERTER>(4);
    start_watchdog();
    for (slice, top) in [(pac::PWM.ch(CLOCK), u16::MAX), (pac::PWM.ch(PERIOD), 999)] {
        slice.div().write(|w| w.set_int((CORE_HZ / 1_000_000) as u8));
        slice.top().write(|w| w.set_top(top));
        slice.csr().write(|w| w.set_en(true));
    }

    for pad in [pac::PADS_BANK0.gpio(ENCODER_A), pac::PADS_BANK0.gpio(ENCODER_B)] {
        pad.modify(|w| {
            w.set_ie(true);
            w.set_pue(true);
            w.set_pde(false);
        });
    }
    function::<ENCODER_A>(6);
    function::<ENCODER_B>(6);
    function::<{ LINE[0] }>(2);
    function::<{ LINE[1] }>(2);
    let mut encoder = Quadrature::start(ENCODER_A as u8);
    let board = Board {
        counter: WideCounter::new(encoder.read()),
        encoder,
        line: ToHost::start(CORE_HZ, BAUD),
        now_us: Cell::new(0),
        period_us: 1000,
        told: BOOT_CODE,
        boot: random(),
        started_by,
    };
    pac::PWM.inte().write(|w| w.0 = 1 << PERIOD);
    line::unmask(pac::Interrupt::PWM_IRQ_WRAP);
    // Until the filter has the boot code's voltage, and the brake may see it.
    for _ in 0..FILTER_PERIODS {
        while !begun() {
            cortex_m::asm::wfi();
        }
    }
    pac::SIO.gpio_out(0).value_set().write_value(1 << CONNECTED | 1 << REGULATOR);
    pac::SIO.gpio_oe(0).value_set().write_value(1 << CONNECTED | 1 << REGULATOR);
    function::<CONNECTED>(5);
    function::<REGULATOR>(5);
    board
}

/// Connects a pin to a peripheral, by the number of the chip's table. The pin is known when it is compiled: no check of it is left.
fn function<const PIN: usize>(number: u8) {
    pac::IO_BANK0.gpio(PIN).ctrl().write(|w| w.set_funcsel(number));
}

fn start_watchdog() {
    // It resets everything but the oscillators.
    pac::PSM.wdsel().write(|w| w.0 = 0x1_fffc);
    pac::WATCHDOG.tick().write(|w| {
        w.set_cycles(RING_CLOCKS);
        w.set_enable(true);
    });
    pac::WATCHDOG.load().write(|w| w.set_load(WATCHDOG));
    // Not held by a debugger: a breakpoint is a reset.
    pac::WATCHDOG.ctrl().write(|w| w.set_enable(true));
}

/// A number from the noise of the ring oscillator: its bits alone are no good dice, so that many are mixed.
fn random() -> u32 {
    (0..1024_u32).fold(0x811c_9dc5, |mixed, _| {
        let bit = u32::from(pac::ROSC.randombit().read().randombit());
        (mixed ^ bit).wrapping_mul(0x0100_0193).rotate_left(5)
    })
}

impl Board {
    /// The board's parameters.
    #[must_use]
    pub fn params(&self) -> BoardParams {
        BoardParams { boot: self.boot, started_by: self.started_by, ..PARAMS }
    }

    /// True once for each period that has begun. The next ones take so long from now on.
    pub(crate) fn begins(&mut self, period_us: u32) -> bool {
        if period_us != self.period_us {
            self.period_us = period_us;
            pac::PWM.ch(PERIOD).top().write(|w| w.set_top((period_us - 1) as u16));
        }
        begun()
    }

    /// Moves bytes that have come to `bytes`; their number. Sleeps first if there is nothing to do.
    pub(crate) fn bytes(&mut self, bytes: &mut [u8]) -> usize {
        cortex_m::interrupt::free(|cs| {
            let count = line::take(cs, bytes);
            if count == 0 && !BEGUN.load(Ordering::Relaxed) {
                // Wakes for a masked interrupt, too: none is missed between the look and the sleep.
                cortex_m::asm::wfi();
            }
            count
        })
    }
}

impl Hardware for Board {
    fn now_us(&self) -> u64 {
        let before = self.now_us.get();
        let passed = pac::PWM.ch(CLOCK).ctr().read().ctr().wrapping_sub(before as u16);
        let now = before.wrapping_add(passed.into());
        self.now_us.set(now);
        now
    }

    fn counts(&mut self) -> Counts {
        self.counter.read(self.encoder.read())
    }

    /// Both signals changed within one look: counts may be lost. A broken wire is not seen: it is a shaft at rest.
    fn encoder_fault(&self) -> bool {
        self.encoder.fault()
    }

    /// Its register has another code, or its clock is not the crystal's any more. The pin's voltage is not seen.
    fn converter_fault(&self) -> bool {
        pac::PWM.ch(CODE).cc().read().a() != self.told.0 || !pac::PLL_SYS.cs().read().lock()
    }

    // A function of its own in machine code, too: the path from a sample to its code ends with it.
    #[inline(never)]
    fn put_out(&mut self, code: DacCode) {
        pac::PWM.ch(CODE).cc().write(|w| w.set_a(code.0));
        self.told = code;
    }

    fn feed_watchdog(&mut self) {
        pac::WATCHDOG.load().write(|w| w.set_load(WATCHDOG));
    }

    fn send(&mut self, frames: &[u8]) -> bool {
        self.line.send(frames)
    }

    fn cycles(&self) -> u32 {
        self.now_us() as u32
    }
}
