//! The board: clocks, encoder, converter, serial line, watchdog. For another board, write another
//! such file.

use crate::read_back::ReadBack;
use crate::stack_guard::guard_stack;
use clutch_core::{Counts, DacCode};
use clutch_node::{BoardParams, Hardware, ResetCause, WideCounter};
use core::future::poll_fn;
use core::task::Poll;
use cortex_m::peripheral::DWT;
use embassy_stm32::dac::{self, DacChannel, Value};
use embassy_stm32::gpio::Pull;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::flash::vals::Latency;
use embassy_stm32::pac::timer::vals::{FilterValue, Urs};
use embassy_stm32::rcc::{AHBPrescaler, Hse, HseMode, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::qei::{self, Qei};
use embassy_stm32::usart::{self, RxDma, TxDma, Uart};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{dma, interrupt, pac, peripherals, uid};
use embassy_sync::waitqueue::AtomicWaker;
use embassy_time::Instant;
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

/// True if the brake's voltage comes back to PA0 by a divider of the amplifier's gain: docs/firmware.md. A voltage that does
/// not follow the converter then ends a run.
pub const READ_BACK: bool = false;

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
    started_by: ResetCause::Unknown,
    brown_out_low: false,
};
const _: () = assert!(PARAMS.check().is_ok(), "a number above is out of range: see BoardParams::check");

/// Baud rate of the debugger's serial port, which is the host's.
const BAUD: u32 = 921_600;

/// Time without a completed period after which the program is reset, µs. The clock of this watchdog
/// may be off by several percent; two of the longest periods are far within.
pub const WATCHDOG_US: u32 = 10_000;

/// Threshold of the supply monitor, by the chip's list: 2.9 V.
const SUPPLY_2_9_V: u8 = 6;

/// A note of [`stop`], and below it the reason: other contents of the register are none.
const NOTED: u32 = 0xC10C_5E00;

/// The DMA channels of the line, from 0; room for the frames of one period to the host, and for 11 ms from it.
const TO_HOST: usize = 0;
const FROM_HOST: usize = 1;
const LINE: usize = 512;
const RING: usize = 1024;

/// The core's clock, Hz.
pub const CLOCK_HZ: u32 = 170_000_000;

/// The clock that the library is told of, and leaves the core with: half of it. The maker wants a microsecond there on the
/// way from below 80 MHz to above, which the library does not give: [`full_speed`] does. The library's results from
/// it, for the timer of its time, for the line and for the converter, are set right by hand.
const LIBRARY_HZ: u32 = CLOCK_HZ / 2;

/// Level of the supply below which the chip is to be in reset, by its option bytes: 2.8 V.
const BROWN_OUT_2_8_V: u8 = 4;

/// Priority of the control task.
pub const CONTROL: Priority = Priority::P6;

/// Below it: bytes come and go by DMA, and the line's interrupt only wakes the task that reads them.
const SERIAL: Priority = Priority::P7;

/// The hardware as the node sees it.
pub struct Board<const READ_BACK: bool> {
    encoder: Qei<'static, peripherals::TIM3>,
    counter: WideCounter,
    converter: DacChannel<'static, Blocking>,
    told: DacCode,
    watchdog: IndependentWatchdog<'static, peripherals::IWDG>,
    line: ToHost,
    /// Its serial number.
    pub board: u32,
    /// A different number at each power-up.
    pub boot: u32,
    started_by: ResetCause,
    read_back: Option<ReadBack>,
}

/// For a program that cannot continue: puts the safe output out, notes the reason for the program that starts next, and
/// waits for the reset. Trusts none of the contents of memory.
pub fn stop(cause: ResetCause) -> ! {
    cortex_m::interrupt::disable();
    pac::DAC1.dhr12r(0).write(|w| w.set_dhr(BOOT_CODE.0));
    pac::TAMP.bkpr(0).write(|w| w.set_bkp(NOTED | cause as u32));
    loop {
        cortex_m::asm::nop();
    }
}

/// The reason why the program starts, from the chip's flags, which are cleared for the next time: they add up. A reset by
/// the watchdog may have a reason that [`stop`] has noted. From then on [`stop`] can note one: its register outlives a
/// reset, and takes writes once it is told to.
fn started_by() -> ResetCause {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    pac::RCC.apb1enr1().modify(|w| {
        w.set_pwren(true);
        w.set_rtcapben(true);
    });
    pac::PWR.cr1().modify(|w| w.set_dbp(true));
    let note = pac::TAMP.bkpr(0).read().bkp();
    pac::TAMP.bkpr(0).write(|w| w.set_bkp(0));
    // Each reset of the chip's own pulls its reset pin, too: that flag comes last.
    if flags.borrstf() {
        ResetCause::Power
    } else if flags.iwdgrstf() || flags.wwdgrstf() {
        match note ^ NOTED {
            n if n == ResetCause::Fault as u32 => ResetCause::Fault,
            n if n == ResetCause::Clock as u32 => ResetCause::Clock,
            _ => ResetCause::Watchdog,
        }
    } else if flags.sftrstf() || flags.oblrstf() {
        ResetCause::Software
    } else if flags.pinrstf() && !flags.lpwrrstf() {
        ResetCause::Pin
    } else {
        ResetCause::Unknown
    }
}

/// From half of the clock, where the library has left the core, to all of it.
fn full_speed() {
    // The flash's wait states for the clock that comes, first.
    pac::FLASH.acr().modify(|w| w.set_latency(Latency::WS4));
    while pac::FLASH.acr().read().latency() != Latency::WS4 {}
    // A microsecond at least: the clocks are those of the half.
    cortex_m::asm::delay(LIBRARY_HZ / 1_000_000);
    pac::RCC.cfgr().modify(|w| w.set_hpre(AHBPrescaler::DIV1));
    // The library's time: its divider takes effect with an update, which is to be no overflow.
    let time = pac::TIM5;
    time.psc().write_value((CLOCK_HZ / 1_000_000 - 1) as u16);
    time.cr1().modify(|w| w.set_urs(Urs::COUNTER_ONLY));
    time.egr().write(|w| w.set_ug(true));
    time.cr1().modify(|w| w.set_urs(Urs::ANY_EVENT));
}

/// Starts the board, its output first.
pub fn start<const READ_BACK: bool>() -> (Board<READ_BACK>, Line) {
    let mut config = embassy_stm32::Config::default();
    guard_stack();
    let started_by = started_by();
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
    config.rcc.ahb_pre = AHBPrescaler::DIV2;
    let p = embassy_stm32::init(config);
    full_speed();

    // Without the chip's output buffer, which reaches neither 0 V nor the top: 0.2 V at the pin would
    // be 0.6 V at a brake that is to let go. Until the write the code is 0, for some clocks.
    let mut converter = DacChannel::new_blocking(p.DAC1, p.PA4);
    converter.set_mode(dac::Mode::NormalExternalUnbuffered);
    pac::DAC1.mcr().modify(|w| w.set_hfsel(0b10)); // its bus is above 160 MHz
    converter.enable();
    converter.set(Value::Bit12Right(BOOT_CODE.0));
    let mut watchdog = IndependentWatchdog::new(p.IWDG, WATCHDOG_US);
    watchdog.unleash();
    // Only now, when its handler has a converter to write and a watchdog to wait for: a crystal that stops calls the
    // NMI, and the chip goes on with its internal oscillator.
    pac::RCC.cr().modify(|w| w.set_csson(true));
    // Each line of flash is fetched before it is asked for: four wait states less on a straight path.
    pac::FLASH.acr().modify(|w| w.set_prften(true));
    // The supply is the converter's reference: a fall below 2.9 V shows in `converter_fault`.
    pac::PWR.cr2().modify(|w| {
        w.set_pls(SUPPLY_2_9_V);
        w.set_pvde(true);
    });

    let pins = qei::Config { ch1_pull: Pull::Up, ch2_pull: Pull::Up, ..qei::Config::default() };
    let encoder = Qei::new(p.TIM3, p.PA6, p.PA7, pins);
    // A level counts when it has lasted 64 clocks, 0.38 µs: at 200 000 counts/s one has 5 µs.
    pac::TIM3.ccmr_input(0).modify(|w| [0, 1].map(|n| w.set_icf(n, FilterValue::FDTS_DIV8_N8)));

    let mut line = usart::Config::default();
    line.baudrate = BAUD / (CLOCK_HZ / LIBRARY_HZ);
    let line = Uart::new_blocking(p.LPUART1, p.PA3, p.PA2, line);
    let core = cortex_m::Peripherals::take();
    let (Ok(line), Some(mut core), Some(boot)) = (line, core, random()) else { stop(ResetCause::Fault) };
    // Pins and baud rate stay; the bytes are the DMA's.
    core::mem::forget(line);
    let to_host = ToHost::new(TxDma::<peripherals::LPUART1>::request(&*p.DMA1_CH1));
    let from_host = Line::new(RxDma::<peripherals::LPUART1>::request(&*p.DMA1_CH2));
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();

    let board = serial_number();
    let counter = WideCounter::new(encoder.count());
    let board = Board {
        encoder,
        counter,
        converter,
        told: BOOT_CODE,
        watchdog,
        line: to_host,
        board,
        boot,
        started_by,
        read_back: READ_BACK.then(ReadBack::start),
    };
    (board, from_host)
}

/// The line to the host: frames leave it by DMA, without an interrupt and without the processor.
struct ToHost {
    words: &'static mut [u32; LINE / 4],
}

impl ToHost {
    fn new(request: dma::Request) -> ToHost {
        static WORDS: ConstStaticCell<[u32; LINE / 4]> = ConstStaticCell::new([0; LINE / 4]);
        pac::DMAMUX1.ccr(TO_HOST).write(|w| w.set_dmareq_id(request));
        pac::LPUART1.cr3().modify(|w| w.set_dmat(true));
        let channel = pac::DMA1.ch(TO_HOST);
        channel.par().write_value(pac::LPUART1.tdr().as_ptr() as u32);
        channel.cr().write(|w| {
            w.set_dir(pac::bdma::vals::Dir::FROM_MEMORY);
            w.set_minc(true);
        });
        ToHost { words: WORDS.take() }
    }

    /// True if it takes the frames; false while it is still sending earlier ones.
    fn send(&mut self, frames: &[u8]) -> bool {
        let channel = pac::DMA1.ch(TO_HOST);
        if frames.len() > LINE {
            return false;
        }
        // An error of the transfer switches the channel off: the rest of those frames is given up.
        if channel.cr().read().en() && channel.ndtr().read().ndt() != 0 {
            return false;
        }
        // Word by word: a copy of so many bytes as only the frames know would be bounded by that from any place to any.
        let (words, rest) = frames.as_chunks();
        for (to, from) in self.words.iter_mut().zip(words) {
            // SAFETY: of a reference; volatile, so that it stays a loop over words.
            unsafe { (&raw mut *to).write_volatile(u32::from_le_bytes(*from)) };
        }
        if let Some(to) = self.words.get_mut(words.len()) {
            let byte = |k: usize| rest.get(k).map_or(0, |byte| u32::from(*byte) << (8 * k));
            *to = byte(0) | byte(1) | byte(2);
        }
        channel.cr().modify(|w| w.set_en(false));
        channel.mar().write_value(self.words.as_ptr() as u32);
        channel.ndtr().write(|w| w.set_ndt(frames.len() as u16));
        // The bytes are in memory before the transfer begins.
        cortex_m::asm::dmb();
        channel.cr().modify(|w| w.set_en(true));
        true
    }
}

/// Bytes from the host: the DMA puts them into a ring for ever, also after an error of the line, which costs the frame
/// that it falls into and no other.
pub struct Line {
    ring: *const [u8; RING],
    /// The place of the next byte to be read.
    at: usize,
}

// SAFETY: the ring is read by this one alone; the DMA writes it.
unsafe impl Send for Line {}

/// Wakes the control task: the host has paused.
static PAUSED: AtomicWaker = AtomicWaker::new();

#[interrupt]
fn LPUART1() {
    // The flags of pauses and of errors: noise and a wrong stop bit show in a frame's checksum.
    pac::LPUART1.icr().write(|w| {
        w.set_idle(true);
        w.set_ore(true);
        w.set_ne(true);
        w.set_fe(true);
        w.set_pe(true);
    });
    PAUSED.wake();
}

impl Line {
    fn new(request: dma::Request) -> Line {
        static BYTES: ConstStaticCell<[u8; RING]> = ConstStaticCell::new([0; RING]);
        let ring: *const [u8; RING] = BYTES.take();
        pac::DMAMUX1.ccr(FROM_HOST).write(|w| w.set_dmareq_id(request));
        let channel = pac::DMA1.ch(FROM_HOST);
        channel.par().write_value(pac::LPUART1.rdr().as_ptr() as u32);
        channel.mar().write_value(ring as u32);
        channel.ndtr().write(|w| w.set_ndt(RING as u16));
        channel.cr().write(|w| {
            w.set_minc(true);
            w.set_circ(true);
            w.set_en(true);
        });
        pac::LPUART1.cr3().modify(|w| w.set_dmar(true));
        pac::LPUART1.cr1().modify(|w| w.set_idleie(true));
        interrupt::LPUART1.set_priority(SERIAL);
        // SAFETY: its handler shares nothing but the waker.
        unsafe { interrupt::LPUART1.enable() };
        Line { ring, at: 0 }
    }

    /// Waits for bytes, and moves as many as there are, and fit, to `bytes`; their number. A reader that is more than the
    /// ring behind gets later ones in their place; the checksums of the frames show it.
    pub async fn read(&mut self, bytes: &mut [u8]) -> usize {
        poll_fn(|context| {
            // First: a pause between the look and the wait wakes, too.
            PAUSED.register(context.waker());
            let end = RING - usize::from(pac::DMA1.ch(FROM_HOST).ndtr().read().ndt());
            let waiting = (end + RING - self.at) % RING;
            let count = waiting.min(bytes.len());
            for byte in &mut bytes[..count] {
                // SAFETY: a byte of the ring, which the DMA may write at any time and has written here.
                *byte = unsafe { self.ring.cast::<u8>().add(self.at).read_volatile() };
                self.at = (self.at + 1) % RING;
            }
            if count > 0 { Poll::Ready(count) } else { Poll::Pending }
        })
        .await
    }
}

impl<const READ_BACK: bool> Board<READ_BACK> {
    /// The board's parameters. They are constants, not a field: the compiler then does their
    /// checks, and no `f64` of an error's value is left in the image.
    #[must_use]
    pub fn params(&self) -> BoardParams {
        let brown_out_low = pac::FLASH.optr().read().bor_lev() < BROWN_OUT_2_8_V;
        BoardParams {
            board: self.board,
            boot: self.boot,
            started_by: self.started_by,
            brown_out_low,
            ..PARAMS
        }
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

impl<const READ_BACK: bool> Hardware for Board<READ_BACK> {
    fn now_us(&self) -> u64 {
        Instant::now().as_micros()
    }

    fn counts(&mut self) -> Counts {
        self.counter.read(self.encoder.count())
    }

    /// The bare pins cannot distinguish a broken wire from a shaft at rest. A receiver with a fault output
    /// would be read here.
    fn encoder_fault(&self) -> bool {
        false
    }

    /// Its output register has another code: a converter that was reset or lost its clock. Or the supply, its
    /// reference, is too low. The pin's voltage is seen where it is read back.
    fn converter_fault(&self) -> bool {
        let strays = READ_BACK && self.read_back.as_ref().is_some_and(|it| it.strays(self.told));
        strays || self.converter.read() != self.told.0 || pac::PWR.sr2().read().pvdo()
    }

    // A function of its own in machine code, too: the bound of the path from a sample to its code ends with it.
    #[inline(never)]
    fn put_out(&mut self, code: DacCode) {
        // Not the driver's function, which has a path to a panic: the node gives codes that the converter has.
        pac::DAC1.dhr12r(0).write(|w| w.set_dhr(code.0));
        self.told = code;
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.pet();
    }

    fn send(&mut self, frames: &[u8]) -> bool {
        self.line.send(frames)
    }

    fn cycles(&self) -> u32 {
        DWT::cycle_count()
    }
}
