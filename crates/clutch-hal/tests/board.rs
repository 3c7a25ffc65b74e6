//! A board of mocked parts: what goes to each of them.
#![allow(missing_docs, reason = "the tests' names say what holds")]
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests fail by panics")]
#![allow(clippy::std_instead_of_core, clippy::alloc_instead_of_core, reason = "it runs on the host")]

use clutch_core::{Counts, DacCode};
use clutch_hal::{Board, Clock, CoarsePwm, Converter, Line, Pwm, Quadrature, SpiDac, SpiKind, Watchdog};
use clutch_node::{BoardParams, DaqBoard, Hardware, ResetCause, receive, tick};
use clutch_wire::{Configure, Decoder, Discover, Message, SCHEMA, VERSION, encode};
use embedded_hal_mock::eh1::pwm::{Mock as PwmMock, Transaction as Duty};
use embedded_hal_mock::eh1::spi::{Mock as SpiMock, Transaction as Spi};
use std::cell::{Cell, RefCell};
use std::convert::Infallible;
use std::rc::Rc;

#[test]
fn a_pulse_is_as_long_as_its_code_and_the_code_above_the_last_one_has_no_end() {
    // 12 bit on a timer of 4096, 5000 and 65535 steps.
    for (steps, pulses) in [
        (4096, [(0, 0), (1, 1), (2047, 2047), (4095, 4095)]),
        (5000, [(0, 0), (1, 1), (2048, 2500), (4095, 4999)]),
        (65535, [(0, 0), (1, 16), (2048, 32768), (4095, 65519)]),
    ] {
        let mut expected = vec![Duty::max_duty_cycle(steps)];
        for (_, duty) in pulses {
            expected.extend([Duty::max_duty_cycle(steps), Duty::set_duty_cycle(duty)]);
        }
        expected.extend([Duty::max_duty_cycle(steps), Duty::set_duty_cycle(steps)]);
        let mut timer = PwmMock::new(&expected);
        let mut pwm = Pwm::new(timer.clone(), 12).unwrap();
        for (code, _) in pulses {
            assert!(pwm.put(DacCode(code)));
        }
        assert!(pwm.put(DacCode(4096)));
        timer.done();
    }
}

#[test]
fn a_timer_that_is_too_coarse_is_no_converter() {
    for (steps, bits) in [(4095, 12), (511, 9), (1000, 0), (u16::MAX, 16)] {
        let mut timer = PwmMock::new(&[Duty::max_duty_cycle(steps)]);
        assert_eq!(Pwm::new(timer.clone(), bits).unwrap_err(), CoarsePwm { steps, bits });
        timer.done();
    }
    assert_eq!(
        CoarsePwm { steps: 4095, bits: 12 }.to_string(),
        "a period of 4095 steps: expected at least 2^12, one for each code of 12 bits"
    );
}

#[test]
fn each_converter_gets_the_words_of_its_sheet_and_no_code_reconfigures_it() {
    let sent = |kind, code, bytes: &[u8]| {
        let mut bus =
            SpiMock::new(&[Spi::transaction_start(), Spi::write_vec(bytes.to_vec()), Spi::transaction_end()]);
        assert!(SpiDac::new(bus.clone(), kind).put(DacCode(code)));
        bus.done();
    };
    sent(SpiKind::Mcp4921, 0x0abc, &[0x3a, 0xbc]);
    sent(SpiKind::Mcp4921, 0xffff, &[0x3f, 0xff]);
    sent(SpiKind::Mcp4821, 0x0abc, &[0x1a, 0xbc]);
    sent(SpiKind::Dac8551, 0xabcd, &[0x00, 0xab, 0xcd]);
}

/// A port that takes some bytes at a time.
#[derive(Clone, Default)]
struct Port {
    written: Rc<RefCell<Vec<u8>>>,
    room: Rc<Cell<usize>>,
    coming: Rc<RefCell<Vec<u8>>>,
}

impl embedded_io::ErrorType for Port {
    type Error = Infallible;
}

impl embedded_io::Write for Port {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let count = bytes.len().min(self.room.get());
        self.room.set(self.room.get() - count);
        self.written.borrow_mut().extend(&bytes[..count]);
        Ok(count)
    }
    fn flush(&mut self) -> Result<(), Infallible> {
        unreachable!("nobody waits")
    }
}

impl embedded_io::WriteReady for Port {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.room.get() > 0)
    }
}

impl embedded_io::Read for Port {
    fn read(&mut self, room: &mut [u8]) -> Result<usize, Infallible> {
        let mut coming = self.coming.borrow_mut();
        assert!(!coming.is_empty(), "a read that would wait");
        let count = room.len().min(coming.len());
        room[..count].copy_from_slice(&coming[..count]);
        coming.drain(..count);
        Ok(count)
    }
}

impl embedded_io::ReadReady for Port {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.coming.borrow().is_empty())
    }
}

#[test]
fn a_line_takes_frames_whole_or_not_at_all_and_never_waits() {
    let port = Port::default();
    let mut line = Line::<_, 8>::new(port.clone());
    assert!(line.offer(b"123456"), "into the buffer");
    assert!(!line.offer(b"7890"), "the first ones are still there");
    port.room.set(4);
    line.pump();
    assert_eq!(*port.written.borrow(), b"1234");
    assert!(!line.offer(b"7890"));
    port.room.set(4);
    assert!(line.offer(b"7890"));
    assert_eq!(*port.written.borrow(), b"12345678");
    port.room.set(100);
    line.pump();
    assert_eq!(*port.written.borrow(), b"1234567890");
    assert!(!line.offer(b"too much room"), "more than its room");
    assert_eq!(line.take(&mut [0; 4]), b"");
    port.coming.borrow_mut().extend(b"commands");
    assert_eq!(line.take(&mut [0; 5]), b"comma");
    assert_eq!(line.take(&mut [0; 5]), b"nds");
}

#[derive(Clone, Default)]
struct Parts {
    counts: Rc<Cell<i32>>,
    codes: Rc<RefCell<Vec<u16>>>,
    broken: Rc<Cell<bool>>,
    fed: Rc<Cell<u32>>,
    now: Rc<Cell<u64>>,
}

impl Quadrature for Parts {
    fn counts(&mut self) -> Counts {
        Counts(self.counts.get())
    }
}

impl Converter for Parts {
    fn put(&mut self, code: DacCode) -> bool {
        self.codes.borrow_mut().push(code.0);
        !self.broken.get()
    }
}

impl Clock for Parts {
    fn now_us(&self) -> u64 {
        self.now.get()
    }
}

impl Watchdog for Parts {
    fn feed(&mut self) {
        self.fed.set(self.fed.get() + 1);
    }
}

#[test]
fn a_role_runs_on_it_and_a_converter_that_fails_is_told() {
    let (parts, port) = (Parts::default(), Port::default());
    port.room.set(usize::MAX);
    let boot = DacCode(1844);
    let line = Line::<_>::new(port.clone());
    let mut board = Board::new(parts.clone(), parts.clone(), line, parts.clone(), parts.clone(), boot);
    assert_eq!(*parts.codes.borrow(), [1844], "the brake is on before anything else");
    let params = BoardParams {
        board: 7,
        boot: 9,
        counts_per_rev: 20_000,
        dac_bits: 12,
        dac_lowest_mv: 0,
        dac_highest_mv: 10_000,
        period_min_us: 500,
        period_max_us: 10_000,
        watchdog_max_us: 100_000,
        boot_code: boot.0,
        started_by: ResetCause::Power,
        brown_out_low: false,
    };
    let mut role = DaqBoard::new(&params).unwrap();
    let mut decoder = Decoder::new();
    let mut told = || -> Vec<Message> {
        let bytes = std::mem::take(&mut *port.written.borrow_mut());
        bytes.iter().filter_map(|byte| decoder.push(*byte)?.ok()).collect()
    };
    let discover = Discover { nonce: 5, version: VERSION, schema: SCHEMA };
    let configure = Configure {
        run: 1,
        config: 2,
        period_us: 1000,
        watchdog_us: 3000,
        safe_kind: 0,
        hold_code: 1844,
        release_code: 0,
        ramp_step: 0,
        hold_periods: 0,
    };
    for message in [Message::Discover(discover), Message::Configure(configure)] {
        port.coming.borrow_mut().extend(encode(&message).as_bytes());
    }
    let mut room = [0; 32];
    loop {
        let bytes = board.line.take(&mut room).to_vec();
        if bytes.is_empty() {
            break;
        }
        receive(&mut role, &mut board, &bytes);
    }
    let said = told();
    assert!(
        matches!(said[..], [Message::Hello(hello), Message::Configured(_)] if hello.board == 7),
        "{said:?}"
    );
    parts.counts.set(-12);
    for period in 1..=2 {
        parts.now.set(1000 * period);
        tick(&mut role, &mut board);
    }
    assert_eq!(parts.fed.get(), 2);
    assert!(told().iter().any(|m| matches!(m, Message::Sample(s) if s.counts == -12 && s.status & clutch_wire::STATUS_DAC_FAULT == 0)));
    parts.broken.set(true);
    for period in 3..=4 {
        parts.now.set(1000 * period);
        tick(&mut role, &mut board);
    }
    assert!(board.converter_fault());
    assert!(
        told()
            .iter()
            .any(|m| matches!(m, Message::Sample(s) if s.status & clutch_wire::STATUS_DAC_FAULT != 0))
    );
}
