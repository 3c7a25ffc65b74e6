//! The board: clocks, encoder, converter, serial line, watchdog. For another board, write another
//! such file.

use clutch_core::{Counts, DacCode};
use clutch_node::{BoardParams, Hardware, WideCounter};
use cortex_m::peripheral::DWT;
use embassy_futures::poll_once;
use embassy_stm32::dac::{self, DacChannel, Value};
use embassy_stm32::gpio::Pull;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::timer::vals::FilterValue;
use embassy_stm32::rcc::{Hse, HseMode, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::qei::{self, Qei};
use embassy_stm32::usart::{self, BufferedUart, BufferedUartRx, BufferedUartTx};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{bind_interrupts, interrupt, pac, peripherals, uid};
use embassy_time::Instant;
use embedded_io_async::Write;
use static_cell::ConstStaticCell;

/// OUTPUT WHEN NOBODY CONTROLS: at power-up, after a reset, in a fault handler. It is a property of
/// the rig that the board is built into. 4.5 V of 10 V holds the paper's weight; if a person moves the shaft
/// and an open brake is safe, set it to 0. THE PULL AT THE DRIVER'S INPUT MUST GIVE THE SAME VOLTAGE, since
/// until this program runs the pin floats: docs/firmware.md.
pub const BOOT_CODE: DacCode = DacCode(1844);

/// Counts per turn of the shaft, four for each line of the encoder.
const COUNTS_PER_REV: u32 = 20_000;

/// Voltage at the brake for code 0 and for code 4096, mV: 3.3 V times the driver's gain of 3.03.
/// Enter the values that you measure at the brake's terminals, here and in the scenario.
const DRIVER_MV: (i32, i32) = (0, 10_000);

/// Parameters of the board, but for those that each has of its own: serial number, and number of the power-up.
const PARAMS: BoardParams = BoardParams {
    board: 0,
    boot: 0,
    counts_per_rev: COUNTS_PER_REV,
    dac_bits: 12,
    dac_lowest_mv: DRIVER_MV.0,
    dac_highest_mv: DRIVER_MV.1,
    period_min_us: 500,
    period_max_us: 4000,
    watchdog_max_us: 100_000,
    boot_code: BOOT_CODE.0,
};
const _: () = assert!(PARAMS.check().is_ok(), "a number above is out of range: see BoardParams::check");

/// Baud rate of the debugger's serial port, which is the host's.
const BAUD: u32 = 921_600;

/// Time without a completed period after which the program is reset, µs. The clock of this watchdog
/// may be off by several percent; two of the longest periods are far within.
const WATCHDOG_US: u32 = 10_000;

/// The core's clock, Hz.
pub const CLOCK_HZ: u32 = 170_000_000;

/// Priority of the control task.
pub const CONTROL: Priority = Priority::P6;

/// Above it: the line's own buffer of 8 bytes lasts 87 µs, and a period of the controller may take
/// about as long. Each byte takes its interrupt's time from the period in turn.
const SERIAL: Priority = Priority::P5;

bind_interrupts!(struct Irqs {
    LPUART1 => usart::BufferedInterruptHandler<peripherals::LPUART1>;
});

/// Bytes from the host.
pub type Line = BufferedUartRx<'static>;

/// The hardware as the node sees it.
pub struct Board {
    encoder: Qei<'static, peripherals::TIM3>,
    counter: WideCounter,
    converter: DacChannel<'static, Blocking>,
    told: DacCode,
    watchdog: IndependentWatchdog<'static, peripherals::IWDG>,
    line: BufferedUartTx<'static>,
    /// Its serial number.
    pub board: u32,
    /// A different number at each power-up.
    pub boot: u32,
}

/// For a program that cannot continue: puts the safe output out and waits for the reset. Trusts none of the contents
/// of memory.
pub fn stop() -> ! {
    cortex_m::interrupt::disable();
    pac::DAC1.dhr12r(0).write(|w| w.set_dhr(BOOT_CODE.0));
    loop {
        cortex_m::asm::nop();
    }
}

/// Starts the board, its output first.
pub fn start() -> (Board, Line) {
    let mut config = embassy_stm32::Config::default();
    // The crystal, not the internal oscillator: the host measures this clock, and an error of 1 %
    // is too much.
    config.rcc.hse = Some(Hse { freq: Hertz(24_000_000), mode: HseMode::Oscillator });
    config.rcc.pll = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV6,
        mul: PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(PllRDiv::DIV2),
    });
    config.rcc.sys = Sysclk::PLL1_R;
    config.rcc.boost = true;
    let p = embassy_stm32::init(config);

    // Without the chip's output buffer, which reaches neither 0 V nor the top: 0.2 V at the pin would
    // be 0.6 V at a brake that is to let go. Until the write the code is 0, for some clocks.
    let mut converter = DacChannel::new_blocking(p.DAC1, p.PA4);
    converter.set_mode(dac::Mode::NormalExternalUnbuffered);
    converter.enable();
    converter.set(Value::Bit12Right(BOOT_CODE.0));
    let mut watchdog = IndependentWatchdog::new(p.IWDG, WATCHDOG_US);
    watchdog.unleash();

    let pins = qei::Config { ch1_pull: Pull::Up, ch2_pull: Pull::Up, ..qei::Config::default() };
    let encoder = Qei::new(p.TIM3, p.PA6, p.PA7, pins);
    // A level counts when it has lasted 64 clocks, 0.38 µs: at 200 000 counts/s one has 5 µs.
    pac::TIM3.ccmr_input(0).modify(|w| [0, 1].map(|n| w.set_icf(n, FilterValue::FDTS_DIV8_N8)));

    static TO_HOST: ConstStaticCell<[u8; 1024]> = ConstStaticCell::new([0; 1024]);
    static FROM_HOST: ConstStaticCell<[u8; 1024]> = ConstStaticCell::new([0; 1024]);
    let mut line = usart::Config::default();
    line.baudrate = BAUD;
    interrupt::LPUART1.set_priority(SERIAL);
    let line = BufferedUart::new(p.LPUART1, p.PA3, p.PA2, TO_HOST.take(), FROM_HOST.take(), Irqs, line);
    let core = cortex_m::Peripherals::take();
    let (Ok(line), Some(mut core), Some(boot)) = (line, core, random()) else { stop() };
    let (to_host, from_host) = line.split();
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();

    let board = serial_number();
    let counter = WideCounter::new(encoder.count());
    let board = Board { encoder, counter, converter, told: BOOT_CODE, watchdog, line: to_host, board, boot };
    (board, from_host)
}

impl Board {
    /// The board's parameters. They are constants, not a field: the compiler then does their
    /// checks, and no `f64` of an error's value is left in the image.
    #[must_use]
    pub fn params(&self) -> BoardParams {
        BoardParams { board: self.board, boot: self.boot, ..PARAMS }
    }
}

/// A number of the chip's noise source: the second, since its manual wants the first discarded.
/// None if none comes within some milliseconds. embassy's driver would try again for ever, on a
/// finite stack.
fn random() -> Option<u32> {
    pac::RCC.ahb2enr().modify(|w| w.set_rngen(true));
    pac::RNG.cr().write(|w| w.set_rngen(true));
    let ready = (0..50_000).filter(|_| pac::RNG.sr().read().drdy());
    ready.map(|_| pac::RNG.dr().read()).nth(1)
}

/// The chip's 96 bits in 32; 0 and 1 are taken by the simulated boards.
fn serial_number() -> u32 {
    let [a, b, c] = [0, 4, 8].map(|at| {
        let id = uid::uid();
        u32::from_le_bytes([id[at], id[at + 1], id[at + 2], id[at + 3]])
    });
    (a ^ b ^ c).max(2)
}

impl Hardware for Board {
    fn now_us(&self) -> u64 {
        Instant::now().as_micros()
    }

    fn counts(&mut self) -> Counts {
        self.counter.read(self.encoder.count())
    }

    /// The bare pins cannot tell a broken wire from a shaft at rest. A receiver with a fault output
    /// would be read here.
    fn encoder_fault(&self) -> bool {
        false
    }

    /// Its output register has another code: a converter that was reset or lost its clock. The
    /// pin's voltage is not seen.
    fn converter_fault(&self) -> bool {
        self.converter.read() != self.told.0
    }

    fn put_out(&mut self, code: DacCode) {
        self.converter.set(Value::Bit12Right(code.0));
        self.told = code;
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.pet();
    }

    fn send(&mut self, frames: &[u8]) {
        // One poll: all of it if there is room now, and nothing otherwise. No interrupt in between:
        // one that sends the last byte while the write checks for any would leave the transmitter
        // asleep with these.
        let _ = cortex_m::interrupt::free(|_| poll_once(self.line.write(frames)));
    }

    fn cycles(&self) -> u32 {
        DWT::cycle_count()
    }
}
