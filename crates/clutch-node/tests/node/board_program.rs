//! The work of a board's program in each period and with each byte, and a counter of 16 bits.

use crate::hardware::{Desk, Done};
use clutch_core::{Counts, DacCode, Micros};
use clutch_node::{BoardParams, DaqBoard, Outbox, Role, WideCounter, receive, tick};
use clutch_wire::{Actuate, Arm, Configure, Message, ResetCause, SafeKind, Sample, encode};
use core::mem::take;
use proptest::prelude::*;

const BOOT_CODE: u16 = 1844;
const PARAMS: BoardParams = BoardParams {
    board: 42,
    boot: 9,
    counts_per_rev: 20_000,
    dac_bits: 12,
    dac_lowest_mv: 0,
    dac_highest_mv: 10_000,
    period_min_us: 500,
    period_max_us: 5000,
    watchdog_max_us: 100_000,
    boot_code: BOOT_CODE,
    started_by: ResetCause::Power,
    brown_out_low: false,
};
const CONFIGURE: Configure = Configure {
    run: 5,
    config: 7,
    period_us: 2000,
    watchdog_us: 6000,
    safe_kind: SafeKind::Hold as u8,
    hold_code: 3072,
    release_code: 0,
    ramp_step: 0,
    hold_periods: 0,
};

impl Desk {
    fn hears(&mut self, role: &mut impl Role, message: &Message) -> Vec<Done> {
        receive(role, self, encode(message).as_bytes());
        take(&mut self.done)
    }

    fn ticks(&mut self, role: &mut impl Role) -> Vec<Done> {
        tick(role, self);
        take(&mut self.done)
    }
}

fn driving() -> (DaqBoard, Desk) {
    let (mut board, mut desk) = (DaqBoard::new(&PARAMS).unwrap(), Desk::default());
    desk.hears(&mut board, &Message::Configure(CONFIGURE));
    desk.hears(&mut board, &Message::Arm(Arm { run: 5, config: 7, boot: 9 }));
    (board, desk)
}

#[test]
fn a_period_puts_its_code_out_before_it_feeds_the_watchdog_and_that_before_it_sends() {
    let (mut board, mut desk) = driving();
    (desk.now_us, desk.counts) = ((1 << 32) + 3000, -7);
    let sample = Sample { run: 5, sequence: 0, time_us: 3000, counts: -7, status: 2 };
    assert_eq!(
        desk.ticks(&mut board),
        [
            Done::Sampled,
            Done::PutOut(BOOT_CODE),
            Done::FedWatchdog,
            Done::Sent(vec![Message::Sample(sample)])
        ]
    );
}

#[test]
fn before_a_host_has_come_a_period_holds_the_power_up_output_feeds_the_watchdog_and_says_nothing() {
    let (mut board, mut desk) = (DaqBoard::new(&PARAMS).unwrap(), Desk::default());
    assert_eq!(board.period_us(), None);
    assert_eq!(desk.ticks(&mut board), [Done::Sampled, Done::PutOut(BOOT_CODE), Done::FedWatchdog]);
}

#[test]
fn a_code_from_the_host_goes_out_at_once_and_bytes_never_feed_the_watchdog() {
    let (mut board, mut desk) = driving();
    desk.ticks(&mut board);
    let code = Actuate { run: 5, sequence: 0, code: 2500, valid_us: 2000 };
    assert_eq!(desk.hears(&mut board, &Message::Actuate(code)), [Done::PutOut(2500)]);
    assert_eq!(board.period_us(), Some(2000));
}

#[test]
fn frames_wait_while_the_line_is_busy_and_none_is_sent_twice() {
    let (mut board, mut desk) = driving();
    desk.busy = true;
    assert_eq!(desk.ticks(&mut board), [Done::Sampled, Done::PutOut(BOOT_CODE), Done::FedWatchdog]);
    desk.busy = false;
    let sent = |done: &[Done]| match done {
        [.., Done::Sent(messages)] => messages.len(),
        _ => 0,
    };
    assert_eq!(sent(&desk.ticks(&mut board)), 2, "that of the period before, and its own");
    assert_eq!(sent(&desk.ticks(&mut board)), 1);
}

#[test]
fn a_fault_of_the_hardware_is_answered_with_the_safe_output_within_its_period() {
    let (mut board, mut desk) = driving();
    desk.encoder_fault = true;
    assert_eq!(desk.ticks(&mut board)[1], Done::PutOut(3072));
}

/// A role that has one code, 100, and keeps what it is told.
#[derive(Default)]
struct Clerk {
    outbox: Outbox,
    told: Vec<(u32, Micros)>,
}

impl Role for Clerk {
    fn receive(&mut self, _: u64, _: &[u8], put_out: &mut impl FnMut(DacCode)) {
        put_out(DacCode(100));
    }
    fn sample(&mut self, _: u64, _: Counts, _: bool, _: bool, put_out: &mut impl FnMut(DacCode)) {
        put_out(DacCode(100));
    }
    fn period_us(&self) -> Option<u32> {
        None
    }
    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }
    fn answered(&mut self, cycles: u32, lateness: Micros) {
        self.told.push((cycles, lateness));
    }
}

#[test]
fn the_role_is_told_what_a_period_took_up_to_its_code_also_when_the_clocks_wrap() {
    let mut desk = Desk { now_us: u64::from(u32::MAX) - 3, cycles: u32::MAX - 100, ..Desk::default() };
    let mut clerk = Clerk::default();
    desk.ticks(&mut clerk);
    desk.hears(&mut clerk, &Message::Arm(Arm { run: 5, config: 7, boot: 9 }));
    assert_eq!(clerk.told, [(1190, Micros(7))]);
}

proptest! {
    #[test]
    fn a_counter_of_16_bits_follows_every_walk_of_less_than_half_its_range_a_step(
        start: u16,
        steps in prop::collection::vec(any::<i16>(), 0..200),
    ) {
        let mut counter = WideCounter::new(start);
        let (mut raw, mut shaft) = (start, 0_i32);
        for step in steps {
            raw = raw.wrapping_add_signed(step);
            shaft += i32::from(step);
            prop_assert_eq!(counter.read(raw), Counts(shaft));
        }
    }
}
