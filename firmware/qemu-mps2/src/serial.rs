//! Two UARTs and a clock: a board like any other.

use crate::last_word;
use clutch_core::Micros;
use clutch_node::{BoardController, Outbox};
use clutch_wire::Decoder;
use core::ptr::{read_volatile, write_volatile};
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{NVIC, SYST};
use cortex_m_rt::exception;
use heapless::spsc::Queue;

/// Core and peripheral clock, Hz.
const CLOCK_HZ: u32 = 25_000_000;

/// A CMSDK UART: its registers' address and the number of its receive interrupt.
#[derive(Clone, Copy)]
struct Uart {
    base: usize,
    irq: u16,
}

/// The host's line.
const HOST: Uart = Uart { base: 0x4000_4000, irq: 0 };
/// The line of encoder and converter.
const DAQ: Uart = Uart { base: 0x4000_5000, irq: 2 };

const DATA: usize = 0x0;
const STATE: usize = 0x4;
const CTRL: usize = 0x8;
const INTCLR: usize = 0xc;
const BAUDDIV: usize = 0x10;
const TX_FULL: u32 = 1;
const RX_FULL: u32 = 2;
const ENABLE_TX: u32 = 1;
const ENABLE_RX: u32 = 2;
const ENABLE_RX_INTERRUPT: u32 = 8;
const CLEAR_RX: u32 = 2;

// SAFETY: the numbers are those of this machine's interrupts.
unsafe impl InterruptNumber for Uart {
    fn number(self) -> u16 {
        self.irq
    }
}

impl Uart {
    fn read(self, register: usize) -> u32 {
        // SAFETY: the registers of this machine's UART, which nothing else uses.
        unsafe { read_volatile((self.base + register) as *const u32) }
    }

    fn write(self, register: usize, value: u32) {
        // SAFETY: as above.
        unsafe { write_volatile((self.base + register) as *mut u32, value) }
    }

    fn enable(self) {
        self.write(BAUDDIV, 16);
        self.write(CTRL, ENABLE_TX | ENABLE_RX | ENABLE_RX_INTERRUPT);
        // A byte that came before wakes the emulator's main loop only now.
        let _ = self.read(DATA);
        // SAFETY: the handler is there, and shares with this code only what is made for it.
        unsafe { NVIC::unmask(self) };
    }

    fn send(self, bytes: &[u8]) {
        for byte in bytes {
            while self.read(STATE) & TX_FULL != 0 {}
            self.write(DATA, u32::from(*byte));
        }
    }

    fn flush(self, out: &mut Outbox) {
        self.send(out.as_bytes());
        out.clear();
    }
}

/// Bytes from an interrupt to the loop.
struct Received(core::cell::UnsafeCell<Queue<u8, 1024>>);

// SAFETY: one handler puts in, one loop takes out with interrupts off.
unsafe impl Sync for Received {}

static FROM_HOST: Received = Received(core::cell::UnsafeCell::new(Queue::new()));
static FROM_DAQ: Received = Received(core::cell::UnsafeCell::new(Queue::new()));
static MILLIS: AtomicU32 = AtomicU32::new(0);

impl Received {
    /// Called in the handler. A byte without room is lost; its frame fails its check.
    fn take(&self, uart: Uart) {
        uart.write(INTCLR, CLEAR_RX);
        if uart.read(STATE) & RX_FULL != 0 {
            let byte = uart.read(DATA) as u8;
            // SAFETY: the loop does not touch it while a handler runs.
            let _ = unsafe { &mut *self.0.get() }.enqueue(byte);
        }
    }

    /// Called in the loop, with interrupts off.
    fn drain(&self, _: &cortex_m::interrupt::CriticalSection, bytes: &mut [u8; 64]) -> usize {
        // SAFETY: interrupts are off.
        let queue = unsafe { &mut *self.0.get() };
        let mut used = 0;
        for slot in bytes.iter_mut() {
            let Some(byte) = queue.dequeue() else { break };
            *slot = byte;
            used += 1;
        }
        used
    }
}

#[exception]
unsafe fn DefaultHandler(irq: i16) {
    match irq {
        0 => FROM_HOST.take(HOST),
        2 => FROM_DAQ.take(DAQ),
        _ => {}
    }
}

#[exception]
fn SysTick() {
    MILLIS.store(MILLIS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
}

/// The clock since power-up, µs.
struct Clock {
    seen: u32,
    wide: u64,
}

impl Clock {
    fn start() -> Clock {
        if let Some(mut core) = cortex_m::Peripherals::take() {
            core.SYST.set_clock_source(SystClkSource::Core);
            core.SYST.set_reload(CLOCK_HZ / 1000 - 1);
            core.SYST.clear_current();
            core.SYST.enable_counter();
            core.SYST.enable_interrupt();
        }
        Clock { seen: 0, wide: 0 }
    }

    fn now_us(&mut self) -> u64 {
        let narrow = loop {
            let before = MILLIS.load(Ordering::Relaxed);
            let left = SYST::get_current();
            if MILLIS.load(Ordering::Relaxed) == before {
                let within = (CLOCK_HZ / 1000 - 1).wrapping_sub(left) / (CLOCK_HZ / 1_000_000);
                break before.wrapping_mul(1000).wrapping_add(within);
            }
        };
        // The counter has begun anew and its interrupt has not been taken yet: until then, time
        // stands still.
        let passed = narrow.wrapping_sub(self.seen);
        if passed.cast_signed() > 0 {
            self.wide = self.wide.wrapping_add(u64::from(passed));
            self.seen = narrow;
        }
        self.wide
    }
}

/// The watchdog: once started, it resets a board that has not fed it for a second.
struct Watchdog;

impl Watchdog {
    const BASE: usize = 0x4000_8000;
    const LOAD: usize = 0x0;
    const CTRL: usize = 0x8;
    const INTCLR: usize = 0xc;

    fn register(offset: usize, value: u32) {
        // SAFETY: the registers of this machine's watchdog, which nothing else uses.
        unsafe { write_volatile((Self::BASE + offset) as *mut u32, value) }
    }

    fn start() -> Watchdog {
        // Its first timeout is an interrupt, the second a reset.
        Self::register(Self::LOAD, CLOCK_HZ / 2);
        Self::register(Self::CTRL, 3);
        Watchdog
    }

    fn feed(&mut self) {
        Self::register(Self::INTCLR, 1);
    }
}

/// The board's loop.
pub fn run(mut node: BoardController) -> ! {
    let mut clock = Clock::start();
    let mut watchdog = Watchdog::start();
    HOST.enable();
    DAQ.enable();
    let (mut outbox, mut to_daq, mut from_daq) = (Outbox::default(), Outbox::default(), Decoder::new());
    let (mut host, mut daq) = ([0; 64], [0; 64]);
    loop {
        let (host_bytes, daq_bytes) = cortex_m::interrupt::free(|cs| {
            let (a, b) = (FROM_HOST.drain(cs, &mut host), FROM_DAQ.drain(cs, &mut daq));
            if a == 0 && b == 0 {
                // Wakes for a masked interrupt, too: none is missed between the check and the
                // sleep.
                cortex_m::asm::wfi();
            }
            (a, b)
        });
        let arrived = clock.now_us();
        let now_ns = arrived.saturating_mul(1000);
        if daq_bytes > 0 {
            node.daq(now_ns, &mut from_daq, daq.get(..daq_bytes).unwrap_or(&[]), &mut outbox, &mut to_daq);
        }
        // The answer comes before anything else; a frame from the host to encoder and converter is
        // not an answer.
        let ticked = !to_daq.is_empty();
        DAQ.flush(&mut to_daq);
        if ticked {
            let late = clock.now_us().wrapping_sub(arrived);
            node.answered(Micros(u32::try_from(late).unwrap_or(u32::MAX)));
        }
        node.host(now_ns, host.get(..host_bytes).unwrap_or(&[]), &mut outbox, &mut to_daq);
        node.poll(now_ns, &mut outbox, &mut to_daq);
        DAQ.flush(&mut to_daq);
        // While it drives a shaft, only a completed tick shows that the board works.
        if ticked || !node.driving() {
            watchdog.feed();
        }
        HOST.flush(&mut outbox);
        last_word::prepare(node.last_word());
    }
}

/// The last frame of a processor that has failed, over a line that is open.
pub fn last_word(frame: &[u8]) {
    if DAQ.read(CTRL) & ENABLE_TX != 0 {
        DAQ.send(frame);
    }
}
