//! The controller: handshake, one answer per batch, stop until the board has heard.

use crate::desk::BOARD;
use clutch_core::law::{LawParams, LawTerms, PdParams};
use clutch_core::supervisor::{Arrival, Cause, State};
use clutch_core::{
    Bounds, Counts, DacCode, Encoder, FixedCounts, Micros, PlantParams, SafeState, Servo, ServoParams,
    Supervisor, SupervisorParams, Target, Tolerances,
};
use clutch_node::{
    BoardNode, BoardParams, ControllerNode, ControllerParams, Ending, LinkCounts, Notice, Outbox,
};
use clutch_wire::{
    Actuate, Arm, Armed, BoardFault, BoardState, Configure, Configured, Decoder, Discover, Fault, FrameError,
    Hello, Message, Ping, Pong, Refused, ResetCause, SCHEMA, STATUS_ENCODER_FAULT, STATUS_LATE, SafeKind,
    Sample, Stop, StopReason, Stopped, VERSION, encode,
};
use proptest::prelude::*;

const RUN: u16 = 5;
const CONFIG: u64 = 0xfeed;
const PARAMS: ControllerParams = ControllerParams {
    run: RUN,
    config: CONFIG,
    boot: 1,
    watchdog: Micros(3000),
    valid: Micros(2000),
    silence: Micros(3000),
};
/// 5 V.
const SAFE: u16 = 3072;

/// One count a period, 18 °/s, from position 0 on.
fn path(tick: u64) -> Target<f64> {
    let velocity = 1000.0 * Encoder::PAPER.radians_per_count::<f64>();
    Target { position: FixedCounts::from_counts(tick as i64), velocity, acceleration: 0.0 }
}

/// A controller on a desk; frames in, frames and notices out.
struct Desk {
    node: ControllerNode<f64>,
    line: Decoder,
    /// ns
    now: u64,
    /// Number of the next sample, and the counts of the first one.
    sequence: u16,
    origin: i32,
    notices: Vec<Notice<f64, LawTerms<f64>>>,
}

fn heard(out: &mut Outbox) -> Vec<Message> {
    let mut decoder = Decoder::new();
    let frames = out.as_bytes().iter().filter_map(|b| decoder.push(*b)).map(Result::unwrap).collect();
    out.clear();
    frames
}

impl Desk {
    fn with(params: ControllerParams, on_fault: SafeState) -> Desk {
        let servo = ServoParams::paper(LawParams::Pd(PdParams::default()));
        let paper = Bounds::around(&PlantParams::default(), &Tolerances::default()).unwrap();
        // The shaft of these tests has no physics.
        let bounds = Bounds { drive_torque: clutch_core::Interval { low: 0.0005, high: 10.0 }, ..paper };
        let supervisor = Supervisor::new(&SupervisorParams::new(on_fault), &servo, &bounds).unwrap();
        let node = ControllerNode::new(params, Servo::new(&servo).unwrap(), supervisor);
        Desk { node, line: Decoder::new(), now: 1_000_000_000, sequence: 0, origin: 700, notices: Vec::new() }
    }

    fn new() -> Desk {
        Desk::with(PARAMS, SafeState::hold(5.0))
    }

    fn ready() -> Desk {
        let mut desk = Desk::new();
        desk.asks(|node, out| node.configure(DacCode(2048), out));
        assert_eq!(desk.reads(&[CONFIGURED]), []);
        assert_eq!(desk.state(), State::Ready);
        desk
    }

    fn armed() -> Desk {
        let mut desk = Desk::ready();
        assert_eq!(desk.reads(&[ARMED]), []);
        assert_eq!(desk.state(), State::Armed);
        desk
    }

    fn running() -> Desk {
        let mut desk = Desk::armed();
        for _ in 0..5 {
            desk.cycles();
        }
        desk
    }

    fn asks(&mut self, f: impl FnOnce(&mut ControllerNode<f64>, &mut Outbox)) -> Vec<Message> {
        let mut out = Outbox::default();
        f(&mut self.node, &mut out);
        heard(&mut out)
    }

    fn reads_bytes(&mut self, bytes: &[u8]) -> Vec<Message> {
        let mut out = Outbox::default();
        let notices = &mut self.notices;
        notices.clear();
        self.node.receive(self.now, &mut self.line, bytes, &path, &mut out, &mut |n| notices.push(n));
        heard(&mut out)
    }

    /// One read from the line.
    fn reads(&mut self, messages: &[Message]) -> Vec<Message> {
        let bytes: Vec<u8> = messages.iter().flat_map(|m| encode(m).as_bytes().to_vec()).collect();
        self.reads_bytes(&bytes)
    }

    fn polls(&mut self) -> Vec<Message> {
        let mut out = Outbox::default();
        let notices = &mut self.notices;
        notices.clear();
        self.node.poll(self.now, &mut out, &mut |n| notices.push(n));
        heard(&mut out)
    }

    /// The next sample of a shaft that follows the path.
    fn fresh(&mut self, state: BoardState) -> Sample {
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        let counts = self.origin + i32::from(sequence);
        Sample { run: RUN, sequence, time_us: u32::from(sequence) * 1000, counts, status: state as u8 }
    }

    /// A period in which a sample is read and answered.
    #[track_caller]
    fn cycles(&mut self) {
        self.now += 1_000_000;
        let sample = self.fresh(BoardState::Running);
        let sent = self.reads(&[Message::Sample(sample)]);
        let [Message::Actuate(answer)] = sent[..] else { panic!("one answer was to come, not {sent:?}") };
        assert_eq!((answer.run, answer.sequence), (RUN, sample.sequence));
        assert_eq!(self.state(), State::Running);
    }

    fn state(&self) -> State {
        self.node.state().state()
    }
}

const CONFIGURED: Message = Message::Configured(Configured { run: RUN, config: CONFIG, boot: 1 });
const ARMED: Message = Message::Armed(Armed { run: RUN, config: CONFIG });

fn stop(reason: StopReason) -> [Message; 1] {
    [Message::Stop(Stop { run: RUN, reason: reason as u8 })]
}

#[test]
fn another_power_up_than_that_of_the_hello_is_not_believed() {
    let mut desk = Desk::new();
    desk.asks(|node, out| node.configure(DacCode(2048), out));
    let other = Message::Configured(Configured { run: RUN, config: CONFIG, boot: 2 });
    assert_eq!(desk.reads(&[other]), []);
    assert_eq!(desk.state(), State::Disconnected);
    assert!(matches!(desk.notices.last(), Some(Notice::OtherBoot(m)) if m.boot == 2));
}

#[test]
fn the_handshake_leads_from_discover_to_the_first_answer() {
    let mut desk = Desk::new();
    let sent = desk.asks(|node, out| node.discover(9, out));
    assert_eq!(sent, [Message::Discover(Discover { nonce: 9, version: VERSION, schema: SCHEMA })]);
    let sent = desk.asks(|node, out| node.configure(DacCode(2300), out));
    let expected = Configure {
        run: RUN,
        config: CONFIG,
        period_us: 1000,
        watchdog_us: 3000,
        safe_kind: SafeKind::Hold as u8,
        hold_code: SAFE,
        release_code: 2048,
        ramp_step: 0,
        hold_periods: 0,
    };
    assert_eq!(sent, [Message::Configure(expected)]);
    assert_eq!(desk.state(), State::Disconnected, "asking is not having");
    assert_eq!(desk.reads(&[CONFIGURED]), []);
    assert!(matches!(desk.notices[..], [Notice::Configured]));
    for _ in 0..3 {
        let sample = desk.fresh(BoardState::Ready);
        assert_eq!(desk.reads(&[Message::Sample(sample)]), [], "samples before consent are not answered");
    }
    let sent = desk.asks(|node, out| node.arm(out));
    assert_eq!(sent, [Message::Arm(Arm { run: RUN, config: CONFIG, boot: 1 })]);
    assert_eq!(desk.state(), State::Ready);
    assert_eq!(desk.reads(&[ARMED]), []);
    assert_eq!((desk.state(), desk.node.state().code()), (State::Armed, DacCode(2300)));
    let sample = desk.fresh(BoardState::Armed);
    let sent = desk.reads(&[Message::Sample(sample)]);
    // On the path and at its first tick: nothing to brake, 0 V.
    let answer = Actuate { run: RUN, sequence: 3, code: 2048, valid_us: 2000 };
    assert_eq!(sent, [Message::Actuate(answer)]);
    assert_eq!(desk.node.origin(), FixedCounts::from_counts(703), "the path begins where the shaft is");
    assert_eq!(desk.state(), State::Running);
}

#[test]
fn each_safe_state_is_told_to_the_board_in_codes() {
    for (state, kind, hold, ramp_step, hold_periods) in [
        (SafeState::hold(5.0), SafeKind::Hold, SAFE, 0, 0),
        (SafeState::ramp(1000.0, 5.0), SafeKind::Ramp, SAFE, 13_421_772, 0),
        (SafeState::Release, SafeKind::Release, 2048, 0, 0),
        (SafeState::hold_then_release(5.0, 2.0), SafeKind::HoldThenRelease, SAFE, 0, 2000),
    ] {
        let sent = Desk::with(PARAMS, state).asks(|node, out| node.configure(DacCode(0), out));
        let [Message::Configure(m)] = sent[..] else { panic!("{sent:?}") };
        assert_eq!((m.safe_kind, m.hold_code, m.release_code), (kind as u8, hold, 2048), "{state:?}");
        assert_eq!((m.ramp_step, m.hold_periods), (ramp_step, hold_periods), "{state:?}");
    }
}

#[test]
fn what_was_said_of_another_run_or_configuration_is_not_taken() {
    for (run, config) in [(4, CONFIG), (RUN, 1)] {
        let mut desk = Desk::new();
        assert_eq!(desk.reads(&[Message::Configured(Configured { run, config, boot: 1 })]), []);
        assert_eq!(desk.state(), State::Disconnected);
        let mut desk = Desk::ready();
        assert_eq!(desk.reads(&[Message::Armed(Armed { run, config })]), []);
        assert_eq!(desk.state(), State::Ready);
    }
    let mut desk = Desk::running();
    let fault = Fault { run: 4, sequence: 0, time_us: 0, cause: BoardFault::Watchdog as u8, value: 0 };
    let others = [
        Message::Fault(fault),
        Message::Stopped(Stopped { run: 4, reason: 0, code: 0 }),
        Message::Pong(Pong { run: 4, nonce: 0, time_us: 0 }),
    ];
    assert_eq!(desk.reads(&others), []);
    assert!(desk.notices.is_empty(), "{:?}", desk.notices);
    assert_eq!(desk.state(), State::Running);
}

#[test]
fn samples_of_another_run_are_counted_and_nothing_else() {
    let mut desk = Desk::running();
    let before = *desk.node.state();
    let foreign = Sample { run: 4, counts: 1_000_000, ..desk.fresh(BoardState::Faulted) };
    assert_eq!(desk.reads(&[Message::Sample(foreign)]), []);
    assert_eq!(*desk.node.state(), before);
    assert_eq!(desk.node.counts(), &LinkCounts { received: 5, foreign: 1, ..LinkCounts::default() });
    assert!(desk.notices.is_empty());
}

#[test]
fn only_the_newest_sample_of_a_batch_is_answered_and_all_feed_the_law() {
    let (mut desk, mut plain) = (Desk::running(), Desk::running());
    let samples = [(); 3].map(|()| Message::Sample(desk.fresh(BoardState::Running)));
    let sent = desk.reads(&samples);
    let [Message::Actuate(answer)] = sent[..] else { panic!("{sent:?}") };
    assert_eq!(answer.sequence, 7);
    let arrivals: Vec<_> = desk
        .notices
        .iter()
        .map(|n| match n {
            Notice::Cycle(n) => (n.cycle.arrival, n.superseded, n.cycle.answer.is_some()),
            other => panic!("{other:?}"),
        })
        .collect();
    let (late, fresh) = ((Arrival::Late, true, false), (Arrival::Fresh, false, true));
    assert_eq!(arrivals, [late, late, fresh]);
    assert_eq!((desk.node.counts().late, desk.node.counts().received), (2, 8));
    for _ in 0..3 {
        plain.cycles();
    }
    assert_eq!(answer.code, plain.node.state().code().0, "the law has seen the same samples");
}

#[test]
fn an_older_sample_behind_a_newer_one_is_not_answered_and_does_not_stop_its_answer() {
    let mut desk = Desk::running();
    let (old, new) = (desk.fresh(BoardState::Running), desk.fresh(BoardState::Running));
    let sent = desk.reads(&[Message::Sample(new), Message::Sample(old)]);
    assert!(matches!(sent[..], [Message::Actuate(a)] if a.sequence == new.sequence), "{sent:?}");
    assert_eq!(desk.node.counts().reordered, 1);
    assert_eq!(desk.reads(&[Message::Sample(new)]), []);
    assert_eq!(desk.node.counts().duplicated, 1);
}

#[test]
fn a_sample_cut_anywhere_is_answered_when_its_last_byte_comes() {
    for cut in 1..20 {
        let mut desk = Desk::running();
        let frame = encode(&Message::Sample(desk.fresh(BoardState::Running)));
        assert_eq!(desk.reads_bytes(&frame.as_bytes()[..cut]), []);
        assert_eq!(desk.reads_bytes(&frame.as_bytes()[cut..]).len(), 1, "cut at {cut}");
    }
}

#[test]
fn a_sample_before_consent_and_one_after_it_may_come_in_one_read() {
    let mut desk = Desk::ready();
    let before = Message::Sample(desk.fresh(BoardState::Ready));
    let after = Message::Sample(desk.fresh(BoardState::Armed));
    let sent = desk.reads(&[before, ARMED, after]);
    assert!(matches!(sent[..], [Message::Actuate(a)] if a.sequence == 1), "{sent:?}");
    assert_eq!(desk.state(), State::Running);
}

#[test]
fn a_fault_is_told_to_the_board_until_it_no_longer_drives() {
    let mut desk = Desk::running();
    let mut bad = desk.fresh(BoardState::Running);
    bad.status |= STATUS_ENCODER_FAULT;
    assert_eq!(desk.reads(&[Message::Sample(bad)]), stop(StopReason::Fault));
    assert_eq!((desk.state(), desk.node.state().cause()), (State::Faulted, Cause::Board));
    // The stop was lost: the board drives on.
    for state in [BoardState::Running, BoardState::Armed, BoardState::Running] {
        let sample = desk.fresh(state);
        assert_eq!(desk.reads(&[Message::Sample(sample)]), stop(StopReason::Fault));
    }
    for state in [BoardState::Faulted, BoardState::Stopped, BoardState::Ready] {
        let sample = desk.fresh(state);
        assert_eq!(desk.reads(&[Message::Sample(sample)]), [], "{state:?}: the board has heard");
    }
    assert_eq!(desk.node.state().code(), DacCode(SAFE));
}

#[test]
fn an_orderly_end_is_told_until_heard_and_nothing_is_answered_any_more() {
    for (reason, cause) in [(StopReason::Done, Cause::Done), (StopReason::Operator, Cause::Operator)] {
        let mut desk = Desk::running();
        assert_eq!(desk.asks(|node, out| node.stop(reason, out)), stop(reason));
        assert_eq!((desk.state(), desk.node.state().cause()), (State::Holding, cause));
        for _ in 0..3 {
            let sample = desk.fresh(BoardState::Running);
            assert_eq!(desk.reads(&[Message::Sample(sample)]), stop(reason));
        }
        let stopped = Stopped { run: RUN, reason: reason as u8, code: SAFE };
        let sample = desk.fresh(BoardState::Stopped);
        assert_eq!(desk.reads(&[Message::Stopped(stopped), Message::Sample(sample)]), []);
        assert!(matches!(desk.notices[0], Notice::Stopped(s) if s == stopped));
        desk.now += 1_000_000_000;
        assert_eq!((desk.node.poll_at(), desk.polls()), (None, vec![]), "nothing is awaited");
    }
}

#[test]
fn silence_is_noticed_in_its_nanosecond_and_told_once() {
    let mut desk = Desk::running();
    let last = desk.now;
    assert_eq!(desk.node.poll_at(), Some(last + 3_000_000));
    desk.now = last + 2_999_999;
    assert_eq!(desk.polls(), []);
    assert_eq!(desk.state(), State::Running);
    desk.now = last + 3_000_000;
    assert_eq!(desk.polls(), stop(StopReason::Fault));
    assert!(
        matches!(desk.notices[..], [Notice::Ended(Ending { cause: Cause::Silence, .. })]),
        "{:?}",
        desk.notices
    );
    assert_eq!((desk.state(), desk.node.state().code()), (State::Faulted, DacCode(SAFE)));
    for _ in 0..3 {
        desk.now += 3_000_000;
        assert_eq!(desk.polls(), []);
        assert!(desk.notices.is_empty());
    }
    let sample = desk.fresh(BoardState::Running);
    let sent = desk.reads(&[Message::Sample(sample)]);
    assert_eq!(sent, stop(StopReason::Fault), "a board that is back and drives is told again");
}

#[test]
fn there_is_no_silence_before_the_first_sample_but_after_it_there_is_also_without_consent() {
    let mut desk = Desk::ready();
    desk.now += 60_000_000_000;
    assert_eq!((desk.node.poll_at(), desk.polls()), (None, vec![]));
    let sample = desk.fresh(BoardState::Ready);
    desk.reads(&[Message::Sample(sample)]);
    desk.now += 3_000_000;
    assert_eq!(desk.polls(), stop(StopReason::Fault));
    assert_eq!(desk.node.state().cause(), Cause::Silence);
}

#[test]
fn a_board_that_went_safe_by_itself_ends_control() {
    let mut desk = Desk::running();
    let fault = Fault { run: RUN, sequence: 4, time_us: 7, cause: BoardFault::Watchdog as u8, value: 3000 };
    assert_eq!(desk.reads(&[Message::Fault(fault)]), stop(StopReason::Fault));
    let [Notice::BoardFault(told), Notice::Ended(Ending { cause: Cause::Board, .. })] = desk.notices[..]
    else {
        panic!("{:?}", desk.notices)
    };
    assert_eq!(told, fault);
    assert_eq!(desk.state(), State::Faulted);
    // The frame may be lost: the state in the samples says the same.
    let mut desk = Desk::running();
    let sample = desk.fresh(BoardState::Faulted);
    assert_eq!(desk.reads(&[Message::Sample(sample)]), stop(StopReason::Fault));
    assert_eq!(desk.node.state().cause(), Cause::Board);
}

#[test]
fn a_board_that_started_anew_ends_control() {
    let mut desk = Desk::running();
    let sample = desk.fresh(BoardState::Boot);
    assert_eq!(desk.reads(&[Message::Sample(sample)]), stop(StopReason::Fault));
    assert_eq!((desk.state(), desk.node.state().cause()), (State::Faulted, Cause::Board));
}

#[test]
fn the_line_cut_while_running_is_a_fault() {
    let mut desk = Desk::running();
    desk.node.disconnect();
    assert_eq!((desk.state(), desk.node.state().cause()), (State::Faulted, Cause::Silence));
    let mut desk = Desk::ready();
    desk.node.disconnect();
    assert_eq!(desk.state(), State::Disconnected);
}

#[test]
fn the_time_that_an_answer_took_is_held_against_the_next_sample_only() {
    let mut desk = Desk::running();
    desk.node.answered(Micros(501));
    let samples = [(); 2].map(|()| Message::Sample(desk.fresh(BoardState::Running)));
    desk.reads(&samples);
    let told: Vec<_> = desk
        .notices
        .iter()
        .map(|n| if let Notice::Cycle(n) = n { n.lateness } else { panic!("{n:?}") })
        .collect();
    assert_eq!(told, [Micros(501), Micros(0)]);
    assert_eq!(desk.node.state().deadline_misses(), 1);
}

#[test]
fn a_code_that_the_board_had_to_refuse_counts_as_late() {
    let mut desk = Desk::running();
    for n in 1..=26 {
        let mut sample = desk.fresh(BoardState::Running);
        sample.status |= STATUS_LATE;
        let sent = desk.reads(&[Message::Sample(sample)]);
        assert_eq!(sent == stop(StopReason::Fault), n == 26, "late code {n}");
    }
    assert_eq!(desk.node.state().cause(), Cause::Late);
}

#[test]
fn a_frame_that_is_not_whole_is_counted_and_told_and_the_next_one_is_read() {
    let mut desk = Desk::running();
    let mut bytes = encode(&Message::Sample(desk.fresh(BoardState::Running))).as_bytes().to_vec();
    bytes[8] ^= 0x40;
    bytes.extend(encode(&Message::Sample(desk.fresh(BoardState::Running))).as_bytes());
    let sent = desk.reads_bytes(&bytes);
    assert!(matches!(sent[..], [Message::Actuate(a)] if a.sequence == 6), "{sent:?}");
    assert!(matches!(desk.notices[0], Notice::BadFrame(FrameError::Crc { .. } | FrameError::Cobs)));
    assert_eq!((desk.node.counts().bad_frames, desk.node.state().lost()), (1, 1));
}

#[test]
fn answers_of_the_board_are_passed_on() {
    let mut desk = Desk::new();
    let sent = desk.asks(|node, out| node.ping(8, out));
    assert_eq!(sent, [Message::Ping(Ping { run: RUN, nonce: 8 })]);
    let refused = Refused { request: 2, reason: 6, value: 100 };
    let pong = Pong { run: RUN, nonce: 8, time_us: 5 };
    let Message::Hello(hello) = hello() else { unreachable!() };
    assert_eq!(desk.reads(&[Message::Refused(refused), Message::Pong(pong), Message::Hello(hello)]), []);
    let [Notice::Refused(r), Notice::Pong(8, 5), Notice::Hello(h)] = desk.notices[..] else {
        panic!("{:?}", desk.notices)
    };
    assert_eq!((r, h), (refused, hello));
}

fn hello() -> Message {
    Message::Hello(Hello {
        nonce: 1,
        version: VERSION,
        schema: SCHEMA,
        board: 0,
        boot: 1,
        counts_per_rev: 20_000,
        dac_bits: 12,
        dac_lowest_mv: -10_000,
        dac_highest_mv: 10_000,
        period_min_us: 100,
        period_max_us: 10_000,
        watchdog_max_us: 10_000,
        boot_code: SAFE,
        started_by: ResetCause::Power as u8,
        warnings: 0,
        state: 0,
        run: 0,
        config: 0,
    })
}

#[test]
fn a_validity_that_the_wire_cannot_carry_is_the_longest_that_it_can() {
    let mut desk = Desk::with(ControllerParams { valid: Micros(70_000), ..PARAMS }, SafeState::Release);
    desk.reads(&[CONFIGURED, ARMED]);
    let sample = desk.fresh(BoardState::Armed);
    let sent = desk.reads(&[Message::Sample(sample)]);
    assert!(matches!(sent[..], [Message::Actuate(a)] if a.valid_us == u16::MAX), "{sent:?}");
}

#[test]
fn the_controllers_own_words_come_back_and_are_told_as_an_echo() {
    let mut desk = Desk::new();
    let mut words = desk.asks(|node, out| node.discover(1, out));
    words.extend(desk.asks(|node, out| node.configure(DacCode(0), out)));
    words.extend(desk.asks(|node, out| node.arm(out)));
    assert_eq!(desk.reads(&words), []);
    assert!(matches!(desk.notices[..], [Notice::Echo, Notice::Echo, Notice::Echo]), "{:?}", desk.notices);
    assert_eq!(desk.state(), State::Disconnected);
}

#[test]
fn controller_and_board_run_a_thousand_cycles_and_end_as_told() {
    for reason in [StopReason::Done, StopReason::Fault] {
        let mut desk = Desk::new();
        let params = BoardParams {
            board: 0,
            boot: 1,
            period_min_us: 100,
            watchdog_max_us: 10_000,
            boot_code: SAFE,
            ..BOARD
        };
        let mut board = BoardNode::new(&params).unwrap();
        let (mut line, mut up, mut down) = (Decoder::new(), Outbox::default(), Outbox::default());
        desk.node.discover(1, &mut down);
        desk.node.configure(board.code(), &mut down);
        for k in 0..1000_u32 {
            let now_us = k * 1000;
            board.receive(now_us, &mut line, down.as_bytes(), &mut up);
            down.clear();
            board.sample(now_us, Counts(k as i32), false, false, &mut up);
            desk.now = u64::from(now_us) * 1000;
            desk.node.receive(desk.now, &mut desk.line, up.as_bytes(), &path, &mut down, &mut |_| {});
            up.clear();
            if k == 3 {
                desk.node.arm(&mut down);
            }
            if k > 5 {
                assert_eq!(
                    (desk.state(), board.state()),
                    (State::Running, BoardState::Running),
                    "period {k}"
                );
            }
            board.receive(now_us + 200, &mut line, down.as_bytes(), &mut up);
            down.clear();
            if k > 5 {
                assert_eq!(board.code(), desk.node.state().code());
            }
        }
        let end = if reason == StopReason::Fault {
            // The controller falls silent: the board ends it, and the controller hears of it.
            board.poll(1_001_200, &mut up);
            assert_eq!(board.state(), BoardState::Running);
            board.poll(1_002_200, &mut up);
            desk.node.receive(desk.now, &mut desk.line, up.as_bytes(), &path, &mut down, &mut |_| {});
            (State::Faulted, BoardState::Faulted)
        } else {
            desk.node.stop(reason, &mut down);
            board.receive(1_000_000, &mut line, down.as_bytes(), &mut up);
            (State::Holding, BoardState::Stopped)
        };
        assert_eq!((desk.state(), board.state()), end);
        assert_eq!((board.code(), desk.node.state().code()), (DacCode(SAFE), DacCode(SAFE)));
    }
}

fn any_sample() -> impl Strategy<Value = Message> {
    let run = prop_oneof![20 => Just(RUN), 1 => any::<u16>()];
    let sequence = prop_oneof![8 => 0..30_u16, 1 => any::<u16>()];
    let counts = prop_oneof![8 => 695..730_i32, 1 => any::<i32>()];
    let status = prop_oneof![8 => Just(BoardState::Running as u8), 1 => any::<u8>()];
    (run, sequence, counts, status, any::<u32>()).prop_map(|(run, sequence, counts, status, time_us)| {
        Message::Sample(Sample { run, sequence, time_us, counts, status })
    })
}

fn any_bytes() -> impl Strategy<Value = Vec<u8>> {
    let frame = |m: Message| encode(&m).as_bytes().to_vec();
    prop_oneof![
        2 => prop::collection::vec(any::<u8>(), 0..80),
        8 => any_sample().prop_map(frame),
        2 => Just(frame(CONFIGURED)),
        2 => Just(frame(ARMED)),
        1 => any::<(u8, u32)>().prop_map(move |(cause, value)| {
            frame(Message::Fault(Fault { run: RUN, sequence: 0, time_us: 0, cause, value }))
        }),
        1 => Just(frame(hello())),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, ..ProptestConfig::default() })]

    /// A frame in order, one in disorder, garbage: cut into reads of any length.
    #[test]
    fn whatever_comes_the_controller_lives_and_sends_codes_of_its_run_within_the_limits(
        pieces in prop::collection::vec(any_bytes(), 0..60),
        cuts in prop::collection::vec((1..60_usize, 0..4_000_000_u64), 1..40),
        wild in any::<bool>(),
        numbers: [u64; 3],
    ) {
        let mut desk = Desk::armed();
        let target = |tick: u64| if wild && tick > 3 {
            Target {
                position: FixedCounts(numbers[0] as i64),
                velocity: f64::from_bits(numbers[1]),
                acceleration: f64::from_bits(numbers[2]),
            }
        } else {
            path(tick)
        };
        // A good start, so that most cases have a run to spoil.
        let mut bytes: Vec<u8> = Vec::new();
        for _ in 0..5 {
            bytes.extend(encode(&Message::Sample(desk.fresh(BoardState::Running))).as_bytes());
        }
        bytes.extend(pieces.concat());
        let (mut rest, mut out) = (&bytes[..], Outbox::default());
        let mut answers = 0;
        for (length, passed) in cuts.iter().cycle() {
            let (read, more) = rest.split_at((*length).min(rest.len()));
            desk.node.receive(desk.now, &mut desk.line, read, &target, &mut out, &mut |_| {});
            desk.now += passed;
            desk.node.poll(desk.now, &mut out, &mut |_| {});
            for sent in heard(&mut out) {
                match sent {
                    Message::Actuate(a) => {
                        answers += 1;
                        prop_assert_eq!((a.run, a.valid_us), (RUN, 2000));
                        prop_assert!((2048..=4095).contains(&a.code), "{:?}", a);
                    }
                    Message::Stop(s) => {
                        prop_assert_eq!(s, Stop { run: RUN, reason: StopReason::Fault as u8 });
                        prop_assert_eq!(desk.state(), State::Faulted);
                    }
                    other => prop_assert!(false, "{:?}", other),
                }
            }
            if desk.state() == State::Faulted {
                prop_assert_eq!(desk.node.state().code(), DacCode(SAFE));
            }
            prop_assert_eq!(out.dropped(), 0);
            rest = more;
            if rest.is_empty() {
                break;
            }
        }
        prop_assert!(answers <= desk.node.counts().received);
    }
}

/// Periods of a running board until its clock is found out; `told` is the time of a sequence number (µs), `every` the time
/// from one sample to the next by the host's clock (ns).
fn clock_seen(told: impl Fn(u32) -> u32, every: u64) -> Option<u32> {
    let mut desk = Desk::running();
    (0..2000).find(|_| {
        desk.now += every;
        let mut sample = desk.fresh(BoardState::Running);
        sample.time_us = told(u32::from(sample.sequence));
        desk.reads(&[Message::Sample(sample)]);
        let sent = desk.polls();
        let ended = desk.state() == State::Faulted;
        if ended {
            assert_eq!(desk.node.state().cause(), Cause::Clock);
            let told = desk.notices.iter().any(|n| matches!(n, Notice::Ended(e) if e.cause == Cause::Clock));
            assert!(
                !told || sent == stop(StopReason::Fault),
                "the board hears of what the host's clock shows"
            );
        }
        ended
    })
}

#[test]
fn a_board_whose_time_does_not_pass_with_its_periods_is_found_out_and_a_sound_one_is_not() {
    const PERIOD: u64 = 1_000_000;
    assert_eq!(clock_seen(|k| k * 1000, PERIOD), None);
    // From anywhere, beyond the end of its counter, and with jitter.
    assert_eq!(clock_seen(|k| (k * 1000).wrapping_sub(5000), PERIOD), None);
    assert_eq!(clock_seen(|k| k * 1000 + (k * 7919) % 300, PERIOD), None);
    type Lie = fn(u32) -> u32;
    let lies: [(&str, Lie); 6] = [
        ("frozen", |_| 4000),
        ("half as fast", |k| 500 * k),
        ("twice as fast", |k| 2000 * k),
        ("12 times as fast", |k| 12_000 * k),
        ("backwards", |k| 0_u32.wrapping_sub(1000 * k)),
        ("random", |k| k.wrapping_mul(2_654_435_761)),
    ];
    for (name, lie) in lies {
        let seen = clock_seen(lie, PERIOD);
        assert!(seen.is_some_and(|k| k < 60), "{name}: {seen:?}");
    }
}

#[test]
fn a_board_whose_periods_are_not_those_of_the_hosts_clock_is_found_out() {
    // 83 µs for 1 ms are 12 times as fast; 10 % and 50 % more.
    for (every, most) in [(83_000, 40), (500_000, 80), (900_000, 700), (1_100_000, 700), (1_500_000, 80)] {
        let seen = clock_seen(|k| k * 1000, every);
        assert!(seen.is_some_and(|k| k < most), "{every} ns: {seen:?}");
    }
    assert_eq!(clock_seen(|k| k * 1000, 1_040_000), None);
    assert_eq!(clock_seen(|k| k * 1000, 960_000), None);
}
