//! The line to the host: frames leave it by DMA, bytes come by interrupt.

use core::cell::UnsafeCell;
use cortex_m::interrupt::{CriticalSection, InterruptNumber};
use heapless::spsc::Queue;
use pac::interrupt;
use rp_pac as pac;

/// Room for the frames of one period to the host, and for 11 ms from it.
const TO_HOST: usize = 512;
const FROM_HOST: usize = 1024;

/// Bytes from the interrupt to the loop.
struct Received(UnsafeCell<Queue<u8, FROM_HOST>>);

// SAFETY: one handler puts in, one loop takes out with interrupts off.
unsafe impl Sync for Received {}

static RECEIVED: Received = Received(UnsafeCell::new(Queue::new()));

// Four bytes have come, or fewer and then a pause of 32 bits. A byte without room is lost, as one with a wrong stop bit
// is wrong: either shows in the checksum of its frame.
#[interrupt]
fn UART0_IRQ() {
    pac::UART0.uarticr().write(|w| w.set_oeic(true));
    while !pac::UART0.uartfr().read().rxfe() {
        let byte = pac::UART0.uartdr().read().data();
        // SAFETY: the loop does not touch it while a handler runs.
        let _ = unsafe { &mut *RECEIVED.0.get() }.enqueue(byte);
    }
}

/// Moves as many bytes as have come, and fit, to `bytes`; their number.
pub(crate) fn take(_: &CriticalSection, bytes: &mut [u8]) -> usize {
    // SAFETY: interrupts are off, and nothing else takes.
    let queue = unsafe { &mut *RECEIVED.0.get() };
    let mut count = 0;
    for slot in bytes {
        let Some(byte) = queue.dequeue() else { break };
        *slot = byte;
        count += 1;
    }
    count
}

/// The way to the host.
pub(crate) struct ToHost {
    bytes: [u8; TO_HOST],
}

impl ToHost {
    /// Starts the line, from a clock of so many hertz.
    pub(crate) fn start(clock_hz: u32, baud: u32) -> ToHost {
        let uart = pac::UART0;
        // The divider has six bits behind its point, and counts sixteen clocks.
        let divider = (clock_hz * 4 + baud / 2) / baud;
        uart.uartibrd().write(|w| w.set_baud_divint((divider >> 6) as u16));
        uart.uartfbrd().write(|w| w.set_baud_divfrac(divider as u8 & 63));
        uart.uartlcr_h().write(|w| {
            w.set_wlen(3); // eight bits
            w.set_fen(true);
        });
        uart.uartifls().write(|w| w.set_rxiflsel(0));
        uart.uartimsc().write(|w| {
            w.set_rxim(true);
            w.set_rtim(true);
        });
        uart.uartdmacr().write(|w| w.set_txdmae(true));
        uart.uartcr().write(|w| {
            w.set_uarten(true);
            w.set_txe(true);
            w.set_rxe(true);
        });
        unmask(pac::Interrupt::UART0_IRQ);
        ToHost { bytes: [0; TO_HOST] }
    }

    /// True if it takes the frames; false while it is still sending earlier ones.
    pub(crate) fn send(&mut self, frames: &[u8]) -> bool {
        let channel = pac::DMA.ch(0);
        // An error of the transfer ends it: the rest of those frames is given up.
        if channel.ctrl_trig().read().busy() {
            return false;
        }
        let Some(bytes) = self.bytes.get_mut(..frames.len()) else { return false };
        bytes.copy_from_slice(frames);
        channel.read_addr().write_value(bytes.as_ptr() as u32);
        channel.write_addr().write_value(pac::UART0.uartdr().as_ptr() as u32);
        channel.trans_count().write_value(bytes.len() as u32);
        // The bytes are in memory before the transfer begins.
        cortex_m::asm::dmb();
        channel.ctrl_trig().write(|w| {
            w.set_treq_sel(pac::dma::vals::TreqSel::UART0_TX);
            w.set_incr_read(true);
            w.set_chain_to(0); // to itself: to none
            w.set_read_error(true); // clears what may be left of the one before
            w.set_write_error(true);
            w.set_en(true);
        });
        true
    }
}

/// Lets an interrupt come.
pub(crate) fn unmask(interrupt: impl InterruptNumber) {
    // SAFETY: its handler is there, and shares with the rest only what is made for it.
    unsafe { cortex_m::peripheral::NVIC::unmask(interrupt) };
}
