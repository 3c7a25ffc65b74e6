//! Rules of docs/wire.md, one by one, checked on the board in C alone.

use super::compare::{Event, Shown, in_c};
use super::compiled;
use clutch_node::BoardParams;
use clutch_wire::{
    Actuate, Arm, BoardState, Configure, Message, ResetCause, STATUS_ENCODER_FAULT, STATUS_LATE, Stop, encode,
};

const BOARD: BoardParams = BoardParams {
    board: 1,
    boot: 9,
    counts_per_rev: 20_000,
    dac_bits: 12,
    dac_lowest_mv: 0,
    dac_highest_mv: 10_000,
    period_min_us: 500,
    period_max_us: 10_000,
    watchdog_max_us: 100_000,
    boot_code: 1844,
    started_by: ResetCause::Power,
    brown_out_low: false,
};

const RUN: Configure = Configure {
    run: 1,
    config: 5,
    period_us: 1000,
    watchdog_us: 3000,
    safe_kind: 0,
    hold_code: 2000,
    release_code: 10,
    ramp_step: 100 << 16,
    hold_periods: 2,
};

fn frame(now: u32, message: Message) -> Event {
    Event::Bytes { now, bytes: encode(&message).as_bytes().to_vec() }
}

fn tick(now: u32) -> Event {
    Event::Tick { now, counts: 0, faults: 0 }
}

fn actuate(now: u32, sequence: u16, code: u16) -> Event {
    frame(now, Message::Actuate(Actuate { run: 1, sequence, code, valid_us: 2000 }))
}

/// Power-up, `Configure`, `Arm`, one sample at time 0 answered with `code` at 300 µs.
fn running(configure: Configure, code: u16) -> Vec<Event> {
    vec![
        Event::Power(BOARD),
        frame(0, Message::Configure(configure)),
        frame(0, Message::Arm(Arm { run: 1, config: 5, boot: 9 })),
        tick(0),
        actuate(300, 0, code),
    ]
}

/// The states of the board in C after each of the events that follow those of `before`.
fn shown(before: Vec<Event>, after: Vec<Event>) -> Option<Vec<Shown>> {
    // A program of its own for each test: they run at the same time.
    let name = format!("board_c_rules_{}", std::thread::current().name()?.replace("::", "_"));
    let program = compiled(&name, &["examples/board-c/board.c", "tests/board_c/driver.c"])?;
    let start = before.len();
    let events: Vec<Event> = before.into_iter().chain(after).collect();
    let all = in_c(&program, &events);
    assert_eq!(all[start - 1].messages().len(), 0, "nothing answers an Actuate");
    Some(all[start..].to_vec())
}

fn codes(shown: &[Shown]) -> Vec<u16> {
    shown.iter().map(|s| s.code).collect()
}

#[test]
fn the_first_code_that_is_applied_starts_the_run() {
    let Some(s) = shown(running(RUN, 700), vec![tick(1000)]) else { return };
    assert_eq!((s[0].code, s[0].state), (700, BoardState::Running as u8));
}

#[test]
fn a_code_that_comes_after_the_watchdog_time_is_not_applied_though_nobody_looked() {
    let late = Actuate { run: 1, sequence: 0, code: 99, valid_us: u16::MAX };
    // A fresh sample answered late: only the watchdog forbids it.
    let late = Actuate { sequence: 1, ..late };
    let after = vec![tick(1000), frame(3300, Message::Actuate(late))];
    let Some(s) = shown(running(RUN, 700), after) else { return };
    assert_eq!((s[1].code, s[1].state), (2000, BoardState::Faulted as u8));
    let [Message::Fault(fault)] = s[1].messages()[..] else { panic!("{s:?}") };
    assert_eq!((fault.cause, fault.value, fault.time_us, fault.sequence), (1, 3000, 3300, 1));
}

#[test]
fn a_code_one_microsecond_before_the_watchdog_time_is_applied() {
    let just = Message::Actuate(Actuate { run: 1, sequence: 1, code: 99, valid_us: u16::MAX });
    let Some(s) = shown(running(RUN, 700), vec![tick(1000), frame(3299, just)]) else { return };
    assert_eq!((s[1].code, s[1].state), (99, BoardState::Running as u8));
}

#[test]
fn a_configure_that_is_repeated_is_answered_whatever_its_other_fields_say() {
    let again = Configure { period_us: 0, safe_kind: 9, ..RUN };
    let before = vec![Event::Power(BOARD), frame(0, Message::Configure(RUN)), tick(0), actuate(1, 0, 3)];
    let Some(s) = shown(before, vec![frame(5, Message::Configure(again)), tick(1000)]) else { return };
    assert!(matches!(s[0].messages()[..], [Message::Configured(_)]), "{s:?}");
    assert_eq!((s[0].period_us, s[0].configurations), (1000, 1));
    let [Message::Sample(sample)] = s[1].messages()[..] else { panic!("{s:?}") };
    assert_eq!(sample.sequence, 1, "the samples go on as before");
}

#[test]
fn a_new_run_starts_with_a_clean_slate() {
    let late = Message::Actuate(Actuate { run: 1, sequence: 0, code: 1, valid_us: 0 });
    let second = Configure { run: 2, ..RUN };
    let answer = Message::Actuate(Actuate { run: 2, sequence: 0, code: 55, valid_us: 2000 });
    let after = vec![
        tick(1000),
        actuate(1100, 1, 800),
        tick(2000),
        frame(2100, late),
        frame(2200, Message::Stop(Stop { run: 1, reason: 0 })),
        frame(2300, Message::Configure(second)),
        frame(2400, Message::Arm(Arm { run: 2, config: 5, boot: 9 })),
        tick(3000),
        frame(3100, answer),
    ];
    let Some(s) = shown(running(RUN, 700), after) else { return };
    let [Message::Sample(sample)] = s[7].messages()[..] else { panic!("{s:?}") };
    assert_eq!((sample.sequence, sample.status & STATUS_LATE), (0, 0));
    assert_eq!(
        (s[8].code, s[8].configurations),
        (55, 2),
        "sequence 0 is not older than that of the last run"
    );
}

#[test]
fn each_safe_output_takes_one_step_a_period() {
    let ticks = || vec![tick(1000), tick(2000), tick(3300), tick(4300), tick(5300)];
    for (kind, expected) in [
        (0, [700, 700, 2000, 2000, 2000]),
        (1, [700, 700, 800, 900, 1000]),
        (2, [700, 700, 10, 10, 10]),
        (3, [700, 700, 2000, 2000, 10]),
    ] {
        let Some(s) = shown(running(Configure { safe_kind: kind, ..RUN }, 700), ticks()) else { return };
        assert_eq!(codes(&s), expected, "kind {kind}");
    }
}

#[test]
fn the_safe_output_goes_on_in_ready_with_the_fields_of_the_run_that_ended() {
    // It held at 2000. The next run's ramp and its short hold must not let go before consent.
    for (kind, hold_periods) in [(1, 2), (3, 0)] {
        let next = Configure { run: 2, safe_kind: kind, hold_periods, hold_code: 5, ..RUN };
        let after = vec![
            frame(400, Message::Stop(Stop { run: 1, reason: 0 })),
            tick(1000),
            frame(1100, Message::Configure(next)),
            tick(1200),
            tick(2200),
            frame(2300, Message::Arm(Arm { run: 2, config: 5, boot: 9 })),
            tick(3200),
        ];
        let Some(s) = shown(running(RUN, 700), after) else { return };
        assert_eq!(codes(&s), [2000; 7], "kind {kind}");
    }
    // A ramp that is under way reaches its end, whatever comes next.
    let ramp = Configure { safe_kind: 1, hold_code: 1000, ..RUN };
    let after = vec![
        frame(400, Message::Stop(Stop { run: 1, reason: 0 })),
        frame(500, Message::Configure(Configure { run: 2, ..RUN })),
        tick(1000),
        tick(2000),
        tick(3000),
    ];
    let Some(s) = shown(running(ramp, 700), after) else { return };
    assert_eq!(codes(&s), [800, 800, 900, 1000, 1000]);
}

#[test]
fn a_ramp_whose_step_is_a_hair_longer_than_the_way_does_not_go_beyond() {
    let ramp = Configure { safe_kind: 1, hold_code: 600, ramp_step: (100 << 16) + 1, ..RUN };
    let after = vec![frame(400, Message::Stop(Stop { run: 1, reason: 0 })), tick(1000)];
    let Some(s) = shown(running(ramp, 700), after) else { return };
    assert_eq!(codes(&s), [600, 600]);
}

#[test]
fn a_broken_encoder_takes_the_same_steps_as_the_watchdog() {
    let broken = Event::Tick { now: 1000, counts: 0, faults: STATUS_ENCODER_FAULT };
    let holds = Configure { safe_kind: 3, ..RUN };
    let Some(s) = shown(running(holds, 700), vec![broken, tick(2000), tick(3000)]) else { return };
    assert_eq!(codes(&s), [2000, 2000, 10]);
    let [Message::Fault(fault), Message::Sample(sample)] = s[0].messages()[..] else { panic!("{s:?}") };
    assert_eq!((fault.cause, sample.status), (2, BoardState::Faulted as u8 | STATUS_ENCODER_FAULT));
}

#[test]
fn only_the_last_eight_samples_can_be_answered() {
    for (behind, code) in [(7, 800), (8, 700)] {
        let long = Configure { watchdog_us: 50_000, ..RUN };
        let mut after: Vec<Event> = (1..=20).map(|k| tick(k * 1000)).collect();
        let answer = Actuate { run: 1, sequence: 20 - behind, code: 800, valid_us: u16::MAX };
        after.push(frame(20_100, Message::Actuate(answer)));
        after.push(tick(21_000));
        let Some(s) = shown(running(long, 700), after) else { return };
        assert_eq!(s[20].code, code, "{behind} behind");
        let [Message::Sample(sample)] = s[21].messages()[..] else { panic!("{s:?}") };
        assert_eq!(sample.status & STATUS_LATE != 0, code == 700);
    }
}

#[test]
fn parameters_that_make_no_sense_are_named_and_nothing_is_put_out() {
    let bad = [
        (BoardParams { dac_bits: 0, ..BOARD }, "dac_bits"),
        (BoardParams { dac_bits: 17, ..BOARD }, "dac_bits"),
        (BoardParams { boot_code: 4096, ..BOARD }, "boot_code"),
        (BoardParams { dac_highest_mv: 0, ..BOARD }, "dac_highest_mv"),
        (BoardParams { period_min_us: 0, ..BOARD }, "period_min_us"),
        (BoardParams { period_min_us: 10_001, ..BOARD }, "period_min_us"),
        (BoardParams { watchdog_max_us: 999, ..BOARD }, "watchdog_max_us"),
    ];
    let name = "board_c_rules_parameters";
    let sources = ["examples/board-c/board.c", "tests/board_c/driver.c"];
    let Some(program) = compiled(name, &sources) else { return };
    for (params, field) in bad {
        let s = in_c(&program, &[Event::Power(params)]);
        let text = String::from_utf8(s[0].bytes.clone()).expect("ASCII");
        assert!(text.starts_with(field), "{field}: {text}");
        assert_eq!(s[0].code, u16::MAX, "{field}: the driver's own mark is still there");
    }
}
