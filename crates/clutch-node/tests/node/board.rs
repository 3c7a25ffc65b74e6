//! The board by the rules of docs/wire.md: what each frame does in each state, and its watchdog.

use crate::desk::{BOARD, CONFIG};
use clutch_core::{Counts, DacCode};
use clutch_node::{BoardMisfit, BoardNode, BoardParams, Outbox};
use clutch_wire::{
    Actuate, Arm, Armed, BoardFault, BoardState, Configure, Configured, Decoder, Discover, Fault, Message,
    Ping, Pong, Refusal, Refused, ResetCause, SCHEMA, STATUS_DAC_FAULT, STATUS_ENCODER_FAULT, STATUS_LATE,
    SafeKind, Sample, Stop, StopReason, Stopped, VERSION, WARNING_BROWN_OUT, encode,
};
use proptest::prelude::*;

const PARAMS: BoardParams = BoardParams { started_by: ResetCause::Watchdog, brown_out_low: true, ..BOARD };
const HOLD: u16 = 3072;
const RELEASE: u16 = 2048;
const CONFIGURE: Configure = Configure {
    run: 5,
    config: CONFIG,
    period_us: 1000,
    watchdog_us: 3000,
    safe_kind: SafeKind::Hold as u8,
    hold_code: HOLD,
    release_code: RELEASE,
    ramp_step: 6_553_600,
    hold_periods: 2,
};
const ARM: Arm = Arm { run: 5, config: CONFIG, boot: 9 };

/// A board on a desk: frames and times in, frames out.
struct Bench {
    board: BoardNode,
    line: Decoder,
    /// The board's clock, µs.
    now: u32,
}

fn frames(out: &mut Outbox) -> Vec<Message> {
    let mut decoder = Decoder::new();
    let heard = out.as_bytes().iter().filter_map(|b| decoder.push(*b)).map(Result::unwrap).collect();
    out.clear();
    heard
}

impl Bench {
    fn boot() -> Bench {
        Bench { board: BoardNode::new(&PARAMS).unwrap(), line: Decoder::new(), now: 1_000_000 }
    }

    fn ready() -> Bench {
        Bench::configured(CONFIGURE)
    }

    fn configured(m: Configure) -> Bench {
        let mut bench = Bench::boot();
        let configured = Configured { run: m.run, config: m.config, boot: 9 };
        assert_eq!(bench.hears(Message::Configure(m)), [Message::Configured(configured)]);
        bench
    }

    fn arm(mut self) -> Bench {
        assert_eq!(self.hears(Message::Arm(ARM)), [Message::Armed(Armed { run: 5, config: CONFIG })]);
        self
    }

    fn armed() -> Bench {
        Bench::ready().arm()
    }

    /// With the code 2500, which answers sample 0, at the time of that sample.
    fn running() -> Bench {
        let mut bench = Bench::armed();
        bench.samples();
        bench.takes(0, 2500);
        bench
    }

    fn hears(&mut self, message: Message) -> Vec<Message> {
        let mut out = Outbox::default();
        self.board.receive(self.now, &mut self.line, encode(&message).as_bytes(), &mut out);
        frames(&mut out)
    }

    fn polls(&mut self) -> Vec<Message> {
        let mut out = Outbox::default();
        self.board.poll(self.now, &mut out);
        frames(&mut out)
    }

    /// All frames of a period.
    fn period(&mut self, encoder_fault: bool, converter_fault: bool) -> Vec<Message> {
        let mut out = Outbox::default();
        self.board.sample(self.now, Counts(-7), encoder_fault, converter_fault, &mut out);
        frames(&mut out)
    }

    /// A period in which nothing but the sample is sent.
    fn samples(&mut self) -> Sample {
        match self.period(false, false)[..] {
            [Message::Sample(sample)] => sample,
            ref other => panic!("a sample was to come, not {other:?}"),
        }
    }

    fn actuates(&mut self, sequence: u16, code: u16, valid_us: u16) -> Vec<Message> {
        self.hears(Message::Actuate(Actuate { run: 5, sequence, code, valid_us }))
    }

    /// Takes a code without a word.
    #[track_caller]
    fn takes(&mut self, sequence: u16, code: u16) {
        assert_eq!(self.actuates(sequence, code, 2000), []);
        assert_eq!((self.state(), self.code()), (BoardState::Running, code));
    }

    fn state(&self) -> BoardState {
        self.board.state()
    }

    fn code(&self) -> u16 {
        self.board.code().0
    }
}

fn refused(request: u8, reason: Refusal, value: u32) -> [Message; 1] {
    [Message::Refused(Refused { request, reason: reason as u8, value })]
}

#[test]
fn at_power_up_the_output_is_the_boards_own_and_nothing_is_sent() {
    let mut bench = Bench::boot();
    assert_eq!((bench.state(), bench.code()), (BoardState::Boot, PARAMS.boot_code));
    assert_eq!((bench.board.period_us(), bench.board.watchdog_at()), (None, None));
    for _ in 0..5 {
        bench.now += 1_000_000;
        assert_eq!(bench.period(false, false), []);
        assert_eq!(bench.polls(), []);
    }
    assert_eq!((bench.state(), bench.code()), (BoardState::Boot, PARAMS.boot_code));
}

#[test]
fn a_board_that_cannot_be_is_named() {
    for (bad, misfit) in [
        (BoardParams { dac_bits: 0, ..PARAMS }, BoardMisfit::DacBits(0)),
        (BoardParams { dac_bits: 17, ..PARAMS }, BoardMisfit::DacBits(17)),
        (BoardParams { dac_highest_mv: -10_000, ..PARAMS }, BoardMisfit::DacHighest(-10_000)),
        (BoardParams { boot_code: 4096, ..PARAMS }, BoardMisfit::BootCode(4096)),
        (BoardParams { period_min_us: 0, ..PARAMS }, BoardMisfit::PeriodMin(0)),
        (BoardParams { period_max_us: 499, ..PARAMS }, BoardMisfit::PeriodMin(500)),
        (BoardParams { watchdog_max_us: 999, ..PARAMS }, BoardMisfit::WatchdogMax(999)),
    ] {
        assert_eq!(BoardNode::new(&bad).unwrap_err(), misfit);
    }
    assert!(BoardNode::new(&BoardParams { dac_bits: 16, boot_code: u16::MAX, ..PARAMS }).is_ok());
    // With one period alone.
    assert!(BoardNode::new(&BoardParams { period_max_us: 500, ..PARAMS }).is_ok());
}

#[test]
fn discover_is_answered_in_every_state_and_changes_nothing() {
    let ask = Message::Discover(Discover { nonce: 77, version: VERSION, schema: SCHEMA });
    for mut bench in [Bench::boot(), Bench::ready(), Bench::armed(), Bench::running()] {
        let (state, code) = (bench.state(), bench.code());
        let run = if state == BoardState::Boot { 0 } else { 5 };
        let heard = bench.hears(ask);
        let [Message::Hello(hello)] = heard[..] else { panic!("{heard:?}") };
        assert_eq!((hello.nonce, hello.version, hello.schema), (77, VERSION, SCHEMA));
        assert_eq!((hello.started_by, hello.warnings), (ResetCause::Watchdog as u8, WARNING_BROWN_OUT));
        assert_eq!((hello.board, hello.boot, hello.boot_code), (42, 9, PARAMS.boot_code));
        assert_eq!((hello.state, hello.run), (state as u8, run));
        assert_eq!(hello.config, if run == 0 { 0 } else { CONFIG });
        assert_eq!((bench.state(), bench.code()), (state, code));
    }
}

#[test]
fn another_version_is_refused_before_another_schema() {
    let mut bench = Bench::boot();
    for (version, schema, reason, value) in [
        (VERSION + 1, SCHEMA, Refusal::Version, u32::from(VERSION)),
        (0, 0, Refusal::Version, u32::from(VERSION)),
        (VERSION, SCHEMA ^ (1 << 63), Refusal::Schema, SCHEMA as u32),
    ] {
        let heard = bench.hears(Message::Discover(Discover { nonce: 1, version, schema }));
        assert_eq!(heard, refused(Discover::KIND, reason, value));
    }
}

#[test]
fn configure_is_refused_by_the_first_check_that_fails() {
    let mut bad = CONFIGURE;
    let mut check = |change: &dyn Fn(&mut Configure), reason, value| {
        // Each one is made wrong on top of the ones before; the newest comes first in the order.
        change(&mut bad);
        let mut bench = Bench::boot();
        assert_eq!(bench.hears(Message::Configure(bad)), refused(Configure::KIND, reason, value));
        assert_eq!((bench.state(), bench.code()), (BoardState::Boot, PARAMS.boot_code));
    };
    check(&|m| m.release_code = 4096, Refusal::Safe, u32::from(SafeKind::Hold as u8));
    check(&|m| (m.release_code, m.hold_code) = (0, 4096), Refusal::Safe, 0);
    check(&|m| m.safe_kind = 4, Refusal::Safe, 4);
    check(&|m| m.watchdog_us = 30_001, Refusal::Watchdog, 30_001);
    check(&|m| m.watchdog_us = 1999, Refusal::Watchdog, 1999);
    check(&|m| m.period_us = 10_001, Refusal::Period, 10_001);
    check(&|m| m.period_us = 499, Refusal::Period, 499);
    let again = |bench: &mut Bench| bench.hears(Message::Configure(Configure { config: 1, ..bad }));
    assert_eq!(again(&mut Bench::ready()), refused(Configure::KIND, Refusal::Run, 5), "the run is spent");
    for mut bench in [Bench::armed(), Bench::running()] {
        let state = bench.state();
        assert_eq!(again(&mut bench), refused(Configure::KIND, Refusal::State, state as u32));
        assert_eq!(bench.state(), state);
    }
}

#[test]
fn the_edges_of_each_range_are_accepted() {
    for m in [
        Configure { period_us: 500, watchdog_us: 1000, ..CONFIGURE },
        Configure { period_us: 10_000, watchdog_us: 20_000, ..CONFIGURE },
        Configure { watchdog_us: 30_000, hold_code: 4095, release_code: 4095, ..CONFIGURE },
        Configure { run: 0, ..CONFIGURE },
    ] {
        let bench = Bench::configured(m);
        assert_eq!((bench.state(), bench.board.period_us()), (BoardState::Ready, Some(m.period_us)));
    }
}

#[test]
fn a_watchdog_of_more_than_a_hundred_periods_is_refused() {
    let params = BoardParams { watchdog_max_us: 10_000_000, ..PARAMS };
    let mut bench = Bench { board: BoardNode::new(&params).unwrap(), ..Bench::boot() };
    let m = Configure { period_us: 1000, watchdog_us: 100_001, ..CONFIGURE };
    let heard = bench.hears(Message::Configure(m));
    assert_eq!(heard, refused(Configure::KIND, Refusal::Watchdog, 100_001));
    let heard = bench.hears(Message::Configure(Configure { watchdog_us: 100_000, ..m }));
    assert!(matches!(heard[..], [Message::Configured(_)]), "{heard:?}");
}

#[test]
fn a_ramp_that_never_arrives_is_refused() {
    let m = Configure { safe_kind: SafeKind::Ramp as u8, ramp_step: 0, ..CONFIGURE };
    let heard = Bench::boot().hears(Message::Configure(m));
    assert_eq!(heard, refused(Configure::KIND, Refusal::Safe, SafeKind::Ramp as u32));
}

#[test]
fn configuring_starts_the_samples_at_0_and_leaves_the_output() {
    let mut bench = Bench::ready();
    for sequence in 0..20 {
        bench.now += 1000;
        let expected =
            Sample { run: 5, sequence, time_us: bench.now, counts: -7, status: BoardState::Ready as u8 };
        assert_eq!(bench.samples(), expected);
        assert_eq!(bench.code(), PARAMS.boot_code);
    }
    assert_eq!(bench.board.watchdog_at(), None, "nothing is watched before consent");
}

#[test]
fn the_same_configure_again_is_an_answer_that_was_lost() {
    let mut bench = Bench::ready();
    bench.samples();
    let again = Configured { run: 5, config: CONFIG, boot: 9 };
    assert_eq!(bench.hears(Message::Configure(CONFIGURE)), [Message::Configured(again)]);
    assert_eq!(bench.samples().sequence, 1, "nothing has changed");
}

#[test]
fn consent_needs_the_run_and_the_configuration_that_were_configured() {
    let mut bench = Bench::ready();
    let heard = bench.hears(Message::Arm(Arm { run: 6, config: 0, boot: 9 }));
    assert_eq!(heard, refused(Arm::KIND, Refusal::Run, 5));
    let heard = bench.hears(Message::Arm(Arm { run: 5, config: CONFIG ^ 1, boot: 9 }));
    assert_eq!(heard, refused(Arm::KIND, Refusal::Config, CONFIG as u32));
    assert_eq!(bench.state(), BoardState::Ready);
    for boot in [0, 8, 10, u32::MAX] {
        let heard = bench.hears(Message::Arm(Arm { boot, ..ARM }));
        assert_eq!(heard, refused(Arm::KIND, Refusal::Boot, 0));
        assert_eq!(bench.state(), BoardState::Ready);
    }
    let bench = bench.arm();
    assert_eq!((bench.state(), bench.code()), (BoardState::Armed, PARAMS.boot_code), "the output stays");
}

#[test]
fn consent_is_taken_in_ready_only() {
    let mut stopped = Bench::running();
    stopped.hears(Message::Stop(Stop { run: 5, reason: 0 }));
    let mut faulted = Bench::running();
    faulted.hears(Message::Stop(Stop { run: 5, reason: 2 }));
    for mut bench in [Bench::boot(), Bench::running(), stopped, faulted] {
        let state = bench.state();
        assert_eq!(bench.hears(Message::Arm(ARM)), refused(Arm::KIND, Refusal::State, state as u32));
        assert_eq!(bench.state(), state);
    }
}

#[test]
fn a_sample_waits_for_its_answer_once_there_is_consent() {
    let mut bench = Bench::ready();
    bench.samples();
    assert_eq!(bench.board.unanswered(), None, "nothing is asked for");
    let mut bench = bench.arm();
    assert_eq!(bench.board.unanswered(), None, "the last one came before");
    let Sample { sequence, .. } = bench.samples();
    assert_eq!(bench.board.unanswered(), Some(sequence));
    bench.takes(sequence, 2000);
    assert_eq!(bench.board.unanswered(), None);
}

#[test]
fn consent_twice_does_not_feed_the_watchdog() {
    let mut bench = Bench::armed();
    let at = bench.board.watchdog_at();
    bench.now += 2500;
    assert_eq!(bench.hears(Message::Arm(ARM)).len(), 1);
    assert_eq!(bench.board.watchdog_at(), at);
}

#[test]
fn the_first_code_starts_the_run_and_a_code_before_consent_is_ignored() {
    let mut bench = Bench::ready();
    bench.samples();
    assert_eq!(bench.actuates(0, 2500, 2000), []);
    assert_eq!((bench.state(), bench.code()), (BoardState::Ready, PARAMS.boot_code));
    assert_eq!(bench.samples().status, BoardState::Ready as u8, "it is not late either");
    let mut bench = bench.arm();
    bench.takes(1, 2600);
}

#[test]
fn a_code_above_the_converters_top_is_refused() {
    let mut bench = Bench::running();
    bench.samples();
    assert_eq!(bench.actuates(1, 4096, 2000), refused(Actuate::KIND, Refusal::Code, 4096));
    assert_eq!(bench.code(), 2500);
    bench.takes(1, 4095);
}

#[test]
fn a_code_is_as_old_as_it_may_be_and_a_microsecond_more_is_late() {
    for (age, valid_us, applied) in [(1500, 1500, true), (1501, 1500, false), (0, 0, true), (1, 0, false)] {
        let mut bench = Bench::running();
        bench.samples();
        bench.now += age;
        assert_eq!(bench.actuates(1, 2600, valid_us), []);
        assert_eq!(bench.code() == 2600, applied, "{age} µs of {valid_us} µs");
        let flag = bench.samples().status & STATUS_LATE != 0;
        assert_eq!(flag, !applied, "the next sample says so");
        assert_eq!(bench.samples().status, BoardState::Running as u8, "and only the next");
    }
}

#[test]
fn a_code_answers_one_of_the_last_eight_samples() {
    for (behind, applied) in [(7, true), (8, false), (1000, false)] {
        let mut bench = Bench::armed();
        for _ in 0..10 {
            bench.samples();
        }
        assert_eq!(bench.actuates(9_u16.wrapping_sub(behind), 2600, u16::MAX), []);
        assert_eq!(bench.code() == 2600, applied, "{behind} samples behind");
        assert_eq!(bench.samples().status & STATUS_LATE == 0, applied);
    }
    let mut bench = Bench::armed();
    assert_eq!(bench.actuates(0, 2600, u16::MAX), []);
    assert_eq!(bench.code(), PARAMS.boot_code, "a sample that was not taken cannot be answered");
    bench.samples();
    assert_eq!(bench.actuates(1, 2600, u16::MAX), []);
    assert_eq!(bench.code(), PARAMS.boot_code);
}

#[test]
fn a_code_that_comes_twice_or_was_overtaken_changes_nothing() {
    let mut bench = Bench::running();
    bench.samples();
    bench.samples();
    bench.takes(2, 2600);
    let fed = bench.board.watchdog_at();
    bench.now += 100;
    for sequence in [2, 1, 0] {
        assert_eq!(bench.actuates(sequence, 2700, 2000), []);
        assert_eq!((bench.code(), bench.board.watchdog_at()), (2600, fed), "answer to sample {sequence}");
    }
    assert_eq!(bench.samples().status & STATUS_LATE, 0, "nor is it late");
}

#[test]
fn a_code_of_another_run_is_ignored() {
    let mut bench = Bench::running();
    bench.samples();
    let other = Actuate { run: 4, sequence: 1, code: 2600, valid_us: 2000 };
    assert_eq!(bench.hears(Message::Actuate(other)), []);
    assert_eq!(bench.code(), 2500);
}

#[test]
fn codes_are_taken_across_the_wrap_of_the_sequence() {
    let mut bench = Bench::armed();
    for k in 0..66_000_u32 {
        bench.now = bench.now.wrapping_add(1000);
        let sample = bench.samples();
        assert_eq!(sample.sequence, k as u16);
        bench.takes(sample.sequence, 2048 + (k % 1000) as u16);
    }
}

#[test]
fn the_watchdog_bites_in_its_very_microsecond() {
    for mut bench in [Bench::armed(), Bench::running()] {
        let (since, code) = (bench.now, bench.code());
        assert_eq!(bench.board.watchdog_at(), Some(since + 3000));
        bench.now = since + 2999;
        assert_eq!((bench.polls(), bench.code()), (vec![], code));
        bench.now = since + 3000;
        let heard = bench.polls();
        let [Message::Fault(fault)] = heard[..] else { panic!("{heard:?}") };
        assert_eq!((fault.cause, fault.value), (BoardFault::Watchdog as u8, 3000));
        assert_eq!((fault.run, fault.time_us), (5, since + 3000));
        assert_eq!((bench.state(), bench.code()), (BoardState::Faulted, HOLD));
        assert_eq!(bench.board.watchdog_at(), None);
    }
}

#[test]
fn a_sample_or_a_frame_finds_the_watchdogs_time_gone_by_itself() {
    let mut bench = Bench::running();
    bench.now += 3000;
    assert_eq!(bench.period(false, false).len(), 2, "a fault and a sample");
    assert_eq!((bench.state(), bench.code()), (BoardState::Faulted, HOLD));

    let mut bench = Bench::running();
    bench.samples();
    bench.now += 3000;
    bench.actuates(1, 2600, u16::MAX);
    let now = (bench.state(), bench.code());
    assert_eq!(now, (BoardState::Faulted, HOLD), "a code that comes then does not undo it");
}

#[test]
fn a_fault_is_latched_told_once_and_samples_go_on() {
    let mut bench = Bench::running();
    bench.now += 3000;
    assert_eq!(bench.polls().len(), 1);
    for sequence in 1..50 {
        bench.now += 1000;
        assert_eq!(bench.polls(), []);
        let sample = bench.samples();
        assert_eq!((sample.sequence, sample.status), (sequence, BoardState::Faulted as u8));
        assert_eq!(bench.actuates(sequence, 2600, 2000), []);
        assert_eq!(bench.hears(Message::Arm(ARM)), refused(Arm::KIND, Refusal::State, 5));
        let stop = Message::Stop(Stop { run: 5, reason: StopReason::Done as u8 });
        let stopped = Stopped { run: 5, reason: StopReason::Done as u8, code: HOLD };
        assert_eq!(bench.hears(stop), [Message::Stopped(stopped)]);
        let same = bench.hears(Message::Configure(CONFIGURE));
        assert_eq!(same, refused(Configure::KIND, Refusal::Run, 5), "the same run does not come back");
        assert_eq!((bench.state(), bench.code()), (BoardState::Faulted, HOLD));
    }
}

#[test]
fn codes_feed_the_watchdog_and_late_ones_do_not() {
    let mut bench = Bench::running();
    for sequence in 1..100 {
        bench.now += 1000;
        bench.samples();
        bench.takes(sequence, 2600);
    }
    let since = bench.now;
    for sequence in 100..102 {
        bench.now += 1000;
        bench.samples();
        bench.now += 10;
        assert_eq!(bench.actuates(sequence, 2700, 9), []);
    }
    assert_eq!(bench.board.watchdog_at(), Some(since + 3000));
}

#[test]
fn the_clock_wraps_and_the_watchdog_neither_bites_nor_sleeps() {
    let mut bench = Bench::boot();
    bench.now = u32::MAX - 10_499;
    bench.hears(Message::Configure(CONFIGURE));
    let mut bench = bench.arm();
    for sequence in 0..21 {
        assert_eq!(bench.samples().time_us, bench.now);
        bench.takes(sequence, 2600);
        bench.now = bench.now.wrapping_add(1000);
        assert_eq!(bench.polls(), []);
    }
    assert!(bench.now < 11_000, "the clock has wrapped");

    // And silence that goes across the wrap.
    let mut bench = Bench::boot();
    bench.now = u32::MAX - 1499;
    bench.hears(Message::Configure(CONFIGURE));
    let mut bench = bench.arm();
    bench.now = bench.now.wrapping_add(2999);
    assert_eq!((bench.polls(), bench.now), (vec![], 1499));
    bench.now += 1;
    assert_eq!(bench.polls().len(), 1);
    assert_eq!((bench.state(), bench.code()), (BoardState::Faulted, HOLD));
}

#[test]
fn an_answer_across_the_wrap_of_the_clock_is_as_old_as_it_is() {
    for (age, applied) in [(2000, true), (2001, false)] {
        let mut bench = Bench::boot();
        bench.now = u32::MAX - 999;
        bench.hears(Message::Configure(CONFIGURE));
        let mut bench = bench.arm();
        bench.samples();
        bench.now = bench.now.wrapping_add(age);
        assert_eq!(bench.actuates(0, 2600, 2000), []);
        assert_eq!(bench.code() == 2600, applied, "{age} µs");
    }
}

#[test]
fn a_stop_ends_in_the_safe_output_and_a_fault_of_the_host_is_latched_as_one() {
    for (reason, state) in [
        (StopReason::Done, BoardState::Stopped),
        (StopReason::Operator, BoardState::Stopped),
        (StopReason::Fault, BoardState::Faulted),
    ] {
        for mut bench in [Bench::armed(), Bench::running()] {
            let reason = reason as u8;
            let heard = bench.hears(Message::Stop(Stop { run: 5, reason }));
            assert_eq!(heard, [Message::Stopped(Stopped { run: 5, reason, code: HOLD })]);
            assert_eq!((bench.state(), bench.code()), (state, HOLD));
            bench.now += 1_000_000;
            assert_eq!(bench.polls(), [], "nothing is watched any more");
            assert_eq!(bench.samples().status, state as u8);
        }
    }
}

#[test]
fn a_stop_of_another_run_or_before_a_run_changes_nothing() {
    let mut bench = Bench::running();
    assert_eq!(bench.hears(Message::Stop(Stop { run: 4, reason: 0 })), []);
    assert_eq!((bench.state(), bench.code()), (BoardState::Running, 2500));
    assert_eq!(Bench::boot().hears(Message::Stop(Stop { run: 0, reason: 0 })), []);
    let mut bench = Bench::ready();
    let stopped = Stopped { run: 5, reason: 1, code: PARAMS.boot_code };
    assert_eq!(bench.hears(Message::Stop(Stop { run: 5, reason: 1 })), [Message::Stopped(stopped)]);
    assert_eq!((bench.state(), bench.code()), (BoardState::Ready, PARAMS.boot_code));
}

#[test]
fn an_encoder_or_converter_that_fails_is_a_fault_while_the_board_drives() {
    for (encoder, converter, cause, flags) in [
        (true, false, BoardFault::Encoder, STATUS_ENCODER_FAULT),
        (false, true, BoardFault::Converter, STATUS_DAC_FAULT),
        (true, true, BoardFault::Encoder, STATUS_ENCODER_FAULT | STATUS_DAC_FAULT),
    ] {
        for mut bench in [Bench::armed(), Bench::running()] {
            let heard = bench.period(encoder, converter);
            let [Message::Fault(Fault { cause: told, .. }), Message::Sample(sample)] = heard[..] else {
                panic!("{heard:?}")
            };
            assert_eq!(told, cause as u8);
            assert_eq!(sample.status, BoardState::Faulted as u8 | flags);
            assert_eq!((bench.state(), bench.code()), (BoardState::Faulted, HOLD));
        }
        let mut bench = Bench::ready();
        let heard = bench.period(encoder, converter);
        let [Message::Sample(sample)] = heard[..] else { panic!("{heard:?}") };
        assert_eq!(sample.status, BoardState::Ready as u8 | flags, "before consent it is only said");
    }
}

#[test]
fn each_safe_output_takes_one_step_when_it_begins_and_one_with_each_sample() {
    // 100 codes a step.
    for (kind, codes) in [
        (SafeKind::Hold, [3072, 3072, 3072, 3072]),
        (SafeKind::Ramp, [2600, 2700, 2800, 2900]),
        (SafeKind::Release, [2048, 2048, 2048, 2048]),
        (SafeKind::HoldThenRelease, [3072, 3072, 2048, 2048]),
    ] {
        type Begin = fn(&mut Bench);
        let begins: [(&str, Begin); 4] = [
            ("a stop", |b| drop(b.hears(Message::Stop(Stop { run: 5, reason: 2 })))),
            ("the watchdog", |b| {
                b.now += 3000;
                b.polls();
            }),
            ("the watchdog, seen with a sample", |b| {
                b.now += 3000;
                b.period(false, false);
            }),
            ("the encoder", |b| drop(b.period(true, false))),
        ];
        for (name, begin) in begins {
            let mut bench = Bench::configured(Configure { safe_kind: kind as u8, ..CONFIGURE }).arm();
            bench.samples();
            bench.takes(0, 2500);
            begin(&mut bench);
            let mut seen = [bench.code(); 4];
            for code in &mut seen[1..] {
                bench.polls();
                bench.samples();
                *code = bench.code();
            }
            assert_eq!(seen, codes, "{kind:?} after {name}");
        }
    }
}

#[test]
fn a_new_run_needs_a_new_number_and_begins_anew() {
    for reason in [StopReason::Done, StopReason::Fault] {
        let mut bench = Bench::running();
        for _ in 0..10 {
            bench.samples();
        }
        bench.hears(Message::Stop(Stop { run: 5, reason: reason as u8 }));
        for config in [CONFIG, 1] {
            let old = Message::Configure(Configure { config, ..CONFIGURE });
            assert_eq!(bench.hears(old), refused(Configure::KIND, Refusal::Run, 5));
        }
        let new = Message::Configure(Configure { run: 6, ..CONFIGURE });
        let configured = Configured { run: 6, config: CONFIG, boot: 9 };
        assert_eq!(bench.hears(new), [Message::Configured(configured)]);
        assert_eq!((bench.state(), bench.code()), (BoardState::Ready, HOLD), "the safe output stays");
        assert_eq!(bench.hears(Message::Arm(ARM)), refused(Arm::KIND, Refusal::Run, 6));
        assert_eq!(bench.hears(Message::Arm(Arm { run: 6, ..ARM })).len(), 1);
        // Frames of the old run that are on the line reach nobody.
        assert_eq!(bench.actuates(0, 2600, u16::MAX), []);
        // By number the last sample before 0 is 65535, in whose place the old run's is kept.
        for sequence in [65_535, 65_530, 1] {
            let early = Actuate { run: 6, sequence, code: 2600, valid_us: u16::MAX };
            assert_eq!(bench.hears(Message::Actuate(early)), []);
        }
        assert_eq!(bench.code(), HOLD, "nor do the old run's samples count as taken");
        let sample = bench.samples();
        assert_eq!((sample.run, sample.sequence), (6, 0));
        let first = Actuate { run: 6, sequence: 0, code: 2600, valid_us: 0 };
        assert_eq!(bench.hears(Message::Actuate(first)), []);
        assert_eq!((bench.state(), bench.code()), (BoardState::Running, 2600));
    }
}

#[test]
fn a_ping_is_answered_with_the_boards_clock_in_every_state() {
    for mut bench in [Bench::boot(), Bench::ready(), Bench::armed(), Bench::running()] {
        let pong = Pong { run: 3, nonce: 8, time_us: bench.now };
        assert_eq!(bench.hears(Message::Ping(Ping { run: 3, nonce: 8 })), [Message::Pong(pong)]);
    }
}

#[test]
fn the_boards_own_words_come_back_and_are_ignored() {
    let mut bench = Bench::running();
    let sample = bench.samples();
    for echo in [
        Message::Sample(sample),
        Message::Armed(Armed { run: 5, config: CONFIG }),
        Message::Stopped(Stopped { run: 5, reason: 0, code: 0 }),
        Message::Refused(Refused { request: 1, reason: 1, value: 0 }),
        Message::Pong(Pong { run: 5, nonce: 1, time_us: 0 }),
    ] {
        assert_eq!(bench.hears(echo), []);
    }
    assert_eq!((bench.state(), bench.code()), (BoardState::Running, 2500));
}

#[test]
fn a_frame_cut_anywhere_is_taken_when_its_last_byte_comes() {
    let code = encode(&Message::Actuate(Actuate { run: 5, sequence: 1, code: 2600, valid_us: 2000 }));
    let code = code.as_bytes();
    for cut in 0..code.len() {
        let (mut bench, mut out) = (Bench::running(), Outbox::default());
        bench.samples();
        bench.board.receive(bench.now, &mut bench.line, &code[..cut], &mut out);
        assert_eq!(bench.code(), 2500, "{cut} bytes of {}", code.len());
        bench.board.receive(bench.now, &mut bench.line, &code[cut..], &mut out);
        assert_eq!(bench.code(), 2600, "cut at {cut}");
    }
}

#[derive(Clone, Debug)]
enum Input {
    Bytes(Vec<u8>),
    Frame(Message),
    Answer(u16),
    Sample(i32, u8),
    Poll,
}

fn any_frame() -> impl Strategy<Value = Message> {
    let near = || prop_oneof![6 => 0..12_u16, 1 => any::<u16>()];
    let run = || prop_oneof![4 => Just(5_u16), 2 => 4..8_u16, 1 => any::<u16>()];
    let config = || prop_oneof![4 => Just(CONFIG), 1 => any::<u64>()];
    let code = || prop_oneof![4 => 0..4200_u16, 1 => any::<u16>()];
    prop_oneof![
        (any::<u32>(), 0..3_u8).prop_map(|(nonce, version)| Message::Discover(Discover {
            nonce,
            version,
            schema: SCHEMA
        })),
        (run(), config(), 0..12_000_u32, 0..40_000_u32, (0..5_u8, code(), code()), any::<[u32; 2]>())
            .prop_map(|(run, config, period_us, watchdog_us, (safe_kind, hold_code, release_code), more)| {
                let [ramp_step, hold_periods] = more;
                Message::Configure(Configure {
                    run,
                    config,
                    period_us,
                    watchdog_us,
                    safe_kind,
                    hold_code,
                    release_code,
                    ramp_step,
                    hold_periods,
                })
            }),
        (run(), config()).prop_map(|(run, config)| Message::Arm(Arm { run, config, boot: 9 })),
        (run(), near(), code(), any::<u16>()).prop_map(|(run, sequence, code, valid_us)| {
            Message::Actuate(Actuate { run, sequence, code, valid_us })
        }),
        (run(), 0..4_u8).prop_map(|(run, reason)| Message::Stop(Stop { run, reason })),
        (run(), any::<u32>()).prop_map(|(run, nonce)| Message::Ping(Ping { run, nonce })),
    ]
}

fn input() -> impl Strategy<Value = Input> {
    prop_oneof![
        1 => prop::collection::vec(any::<u8>(), 0..80).prop_map(Input::Bytes),
        3 => any_frame().prop_map(Input::Frame),
        2 => Just(Input::Frame(Message::Arm(ARM))),
        4 => (0..4200_u16).prop_map(Input::Answer),
        6 => (any::<i32>(), 0..40_u8).prop_map(|(counts, fault)| Input::Sample(counts, fault)),
        1 => Just(Input::Poll),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, ..ProptestConfig::default() })]

    #[test]
    fn whatever_comes_the_board_lives_and_its_code_is_one_of_the_converter(
        inputs in prop::collection::vec((input(), 0..1500_u32), 1..200),
        start: u32,
    ) {
        let mut bench = Bench::boot();
        bench.now = start;
        let mut out = Outbox::default();
        bench.hears(Message::Configure(CONFIGURE));
        let mut newest = 0;
        for (input, passed) in inputs {
            bench.now = bench.now.wrapping_add(passed);
            let (state, code, fed) = (bench.state(), bench.code(), bench.board.watchdog_at());
            let mut stepped = false;
            match input {
                Input::Bytes(bytes) => bench.board.receive(bench.now, &mut bench.line, &bytes, &mut out),
                Input::Frame(frame) => bench.board.receive(bench.now, &mut bench.line, encode(&frame).as_bytes(), &mut out),
                Input::Answer(code) => {
                    let frame = Message::Actuate(Actuate { run: 5, sequence: newest, code, valid_us: 2000 });
                    bench.board.receive(bench.now, &mut bench.line, encode(&frame).as_bytes(), &mut out);
                }
                Input::Sample(counts, fault) => {
                    bench.board.sample(bench.now, Counts(counts), fault == 1, fault == 2, &mut out);
                    stepped = true;
                }
                Input::Poll => bench.board.poll(bench.now, &mut out),
            }
            for frame in frames(&mut out) {
                if let Message::Sample(sample) = frame {
                    newest = sample.sequence;
                }
            }
            prop_assert_eq!(out.dropped(), 0);
            prop_assert!(bench.board.code() <= DacCode(4095));
            let driving = |state| matches!(state, BoardState::Armed | BoardState::Running);
            if let Some(at) = fed && bench.now.wrapping_sub(at) < 1 << 31 {
                prop_assert!(!driving(bench.state()), "silent for too long and still {:?}", bench.state());
            }
            if matches!(state, BoardState::Stopped | BoardState::Faulted) {
                let left = [state, BoardState::Ready].contains(&bench.state());
                prop_assert!(left, "{:?} → {:?}", state, bench.state());
            }
            if !driving(state) && !driving(bench.state()) && !stepped {
                prop_assert_eq!(bench.code(), code, "the output changes by a run or by a step only");
            }
        }
    }
}
