//! Whole conversations: a host, a board in the controller role, and encoder and converter.

use crate::desk::{
    self, ALIVE_NS, BOARD, BOARD_CONTROLLER, BOARD_SILENCE_NS, CONFIG, Desk, MS, Plan, frames, key, paper,
    words,
};
use clutch_core::law::{LawParams, Limit, SmcParams};
use clutch_core::reference::{Interpolation, Knot, ReferenceParams, Table};
use clutch_core::supervisor::{Arrival, Cause, State};
use clutch_core::{FixedCounts, LimitParams, Micros, SafeState, Servo, SupervisorParams};
use clutch_node::{BoardController, Ending, HostNode, Lines, Notice, Outbox};
use clutch_settings::{MAX_KNOTS, SETTINGS, SETTINGS_HASH};
use clutch_wire::{
    Arm, Armed, BoardFault, BoardState, Configure, Configured, ControllerHello, Decoder, Discover, Message,
    Ping, Refusal, Refused, SCHEMA, Set, Stop, StopReason, Stopped, Taken, VERSION, encode,
};
use proptest::prelude::*;

fn refused(request: u8, reason: Refusal, value: u32) -> [Message; 1] {
    [Message::Refused(Refused { request, reason: reason as u8, value })]
}

const fn knot(time_us: u64, counts: i64) -> Knot {
    Knot { time_us, position: FixedCounts(counts << 16) }
}

fn discover() -> Message {
    Message::Discover(Discover { nonce: 11, version: VERSION, schema: SCHEMA })
}

fn configure(plan: &Plan) -> Configure {
    plan.control().configuration()
}

// Discovery of controller and board.

#[test]
fn discover_is_answered_by_the_controller_and_then_by_its_board() {
    let mut desk = Desk::new(Plan::new());
    let heard = desk.says(discover());
    let [Message::ControllerHello(controller), Message::Hello(hello)] = heard[..] else {
        panic!("{heard:?}")
    };
    let expected = ControllerHello {
        nonce: 11,
        version: VERSION,
        schema: SCHEMA,
        settings: SETTINGS_HASH,
        board: BOARD_CONTROLLER.board,
        boot: BOARD_CONTROLLER.boot,
        clock_hz: BOARD_CONTROLLER.clock_hz,
        knots: MAX_KNOTS as u16,
        state: State::Disconnected as u8,
        run: 0,
        config: 0,
    };
    assert_eq!(controller, expected);
    assert_eq!((hello.nonce, hello.board, hello.boot_code), (11, BOARD.board, BOARD.boot_code));
    assert!(matches!(desk.notices[..], [Notice::ControllerHello(_), Notice::Hello(_)]), "{:?}", desk.notices);
    assert_eq!(desk.host.controller(), Some(&expected));
    // Also in the middle of a run, which goes on.
    let mut desk = Desk::running(Plan::new());
    let heard = desk.says(discover());
    let [Message::ControllerHello(controller), Message::Hello(hello)] = heard[..] else {
        panic!("{heard:?}")
    };
    assert_eq!((controller.state, controller.run, controller.config), (State::Running as u8, 5, CONFIG));
    assert_eq!((hello.state, hello.run), (BoardState::Running as u8, 5));
    desk.follows(5);
    assert_eq!(desk.board_controller.state(), State::Running);
}

#[test]
fn another_version_or_schema_is_refused_and_not_passed_on() {
    for (version, schema, reason, value) in [
        (VERSION + 1, SCHEMA, Refusal::Version, u32::from(VERSION)),
        (VERSION, SCHEMA ^ 1, Refusal::Schema, SCHEMA as u32),
    ] {
        let mut desk = Desk::new(Plan::new());
        let heard = desk.says(Message::Discover(Discover { nonce: 1, version, schema }));
        assert_eq!(heard, refused(Discover::KIND, reason, value), "and no Hello");
    }
}

// Settings and Configure.

/// The answer to Configure of the planned run, when other settings were sent.
fn answer_to(plan: &Plan, pairs: &[(u16, u64)]) -> Vec<Message> {
    let mut desk = Desk::new(*plan);
    desk.says(discover());
    desk.uploads(pairs);
    let heard = desk.asks(|host, out| host.configure(out));
    let taken = matches!(heard[..], [Message::Configured(_)]);
    assert_eq!(desk.board.state() == BoardState::Boot, !taken, "the board hears of it only if it is a run");
    heard
}

fn changed(plan: &Plan, name: &str, value: u64) -> Vec<(u16, u64)> {
    let mut pairs = plan.pairs();
    pairs.iter_mut().filter(|(k, _)| *k == key(name)).for_each(|(_, v)| *v = value);
    pairs
}

#[test]
fn settings_that_make_no_run_are_refused_with_the_reason() {
    let plan = Plan::new();
    let configured = Configured { run: 5, config: CONFIG, boot: BOARD_CONTROLLER.boot };
    assert_eq!(answer_to(&plan, &plan.pairs()), [Message::Configured(configured)]);
    let request = Configure::KIND;
    for missing in [0, 30, plan.pairs().len() - 1] {
        let mut pairs = plan.pairs();
        let (key, _) = pairs.remove(missing);
        assert_eq!(answer_to(&plan, &pairs), refused(request, Refusal::Setting, key.into()));
    }
    let no_law = LawParams::<f32>::all().len() as u64;
    for (name, kind) in [("law", no_law), ("safety.on_fault", 4), ("reference", 8)] {
        let heard = answer_to(&plan, &changed(&plan, name, kind));
        assert_eq!(heard, refused(request, Refusal::Setting, key(name).into()));
    }
    let knots: [Knot; 2] = [knot(0, 0), knot(1_000_000, 16)];
    let reference =
        ReferenceParams::Table(Table { knots: knots.to_vec().leak(), interpolation: Interpolation::Cubic });
    let with_table = Plan { reference, ..plan };
    let heard = answer_to(&with_table, &changed(&with_table, "reference.table.points_s_deg", 3));
    assert_eq!(heard, refused(request, Refusal::Setting, 0x1004));
    for (name, value) in [("model.inertia_kg_m2", -2.5_f32), ("reference.ramp.rate_deg_s", f32::INFINITY)] {
        let heard = answer_to(&plan, &changed(&plan, name, value.to_bits().into()));
        assert_eq!(heard, refused(request, Refusal::Unfit, u32::from(key(name))), "{name}");
    }
    // A condition between several is reported by its number.
    let heard = answer_to(&plan, &changed(&plan, "output.on_invalid_v", 10.5_f32.to_bits().into()));
    assert_eq!(heard, refused(request, Refusal::Unfit, 2 << 16 | u32::from(key("output.on_invalid_v"))));
}

#[test]
fn configure_has_to_say_what_the_settings_say() {
    let plan = Plan::new();
    for (name, value) in [("sampling.period_us", 2000), ("times.watchdog_us", 4000), ("safety.on_fault", 2)] {
        let heard = answer_to(&plan, &changed(&plan, name, value));
        assert_eq!(heard, refused(Configure::KIND, Refusal::Differs, 0), "{name}");
    }
    let heard = answer_to(&plan, &changed(&plan, "safety.on_fault.hold.volts_v", 6.0_f32.to_bits().into()));
    assert_eq!(heard, refused(Configure::KIND, Refusal::Differs, 0));
    // Settings that encoder and converter need not know cannot differ.
    let heard = answer_to(&plan, &changed(&plan, "law.pd.kp_v_rad", 1.0_f32.to_bits().into()));
    assert!(matches!(heard[..], [Message::Configured(_)]), "{heard:?}");
}

#[test]
fn without_encoder_and_converter_nothing_is_configured() {
    let plan = Plan::new();
    let mut desk = Desk::new(plan);
    desk.uploads(&plan.pairs());
    let heard = desk.asks(|host, out| host.configure(out));
    assert_eq!(heard, refused(Configure::KIND, Refusal::NoBoard, 0));
    desk.says(discover());
    assert!(matches!(desk.asks(|host, out| host.configure(out))[..], [Message::Configured(_)]));
}

#[test]
fn what_the_board_cannot_do_the_host_hears_from_the_board() {
    let watchdog = Micros(BOARD.watchdog_max_us + 1);
    let plan = Plan { watchdog, ..Plan::new() };
    let mut desk = Desk::new(plan);
    desk.says(discover());
    desk.uploads(&plan.pairs());
    let heard = desk.asks(|host, out| host.configure(out));
    assert_eq!(heard, refused(Configure::KIND, Refusal::Watchdog, watchdog.0));
    assert_eq!(
        (desk.board_controller.state(), desk.host.standing().state),
        (State::Disconnected, State::Disconnected)
    );
}

#[test]
fn a_setting_that_is_not_known_is_refused_and_changes_nothing() {
    let plan = Plan::new();
    let mut desk = Desk::new(plan);
    desk.says(discover());
    desk.uploads(&plan.pairs());
    // Whichever run it is said to be for.
    for run in [5, 6] {
        for key in [SETTINGS as u16, 0x0fff, 0x1000 + 2 * MAX_KNOTS as u16, u16::MAX] {
            let heard = desk.says(Message::Set(Set { run, key, value: 1 }));
            assert_eq!(heard, refused(Set::KIND, Refusal::Setting, key.into()));
        }
    }
    assert!(matches!(desk.asks(|host, out| host.configure(out))[..], [Message::Configured(_)]));
}

#[test]
fn a_number_that_the_parameters_type_does_not_hold_makes_no_run() {
    let plan = Plan::new();
    let real = u64::from(1.5_f32.to_bits());
    for (name, value) in [
        ("sampling.period_us", (1 << 32) + 1000),
        ("rig.dac.bits", 256 + 12),
        ("law.pd.kp_v_rad", 1 << 32 | real),
    ] {
        let heard = answer_to(&plan, &changed(&plan, name, value));
        assert_eq!(heard, refused(Configure::KIND, Refusal::Setting, key(name).into()), "{name}");
    }
}

#[test]
fn the_first_setting_of_another_run_forgets_those_before() {
    let plan = Plan::new();
    let mut desk = Desk::new(plan);
    desk.says(discover());
    desk.uploads(&plan.pairs());
    let (first, value) = plan.pairs()[0];
    let heard = desk.says(Message::Set(Set { run: 6, key: first, value }));
    assert_eq!(heard, [Message::Taken(Taken { run: 6, key: first, value })]);
    let heard = desk.says(Message::Configure(configure(&plan)));
    assert_eq!(heard, refused(Configure::KIND, Refusal::Run, 6), "run 5 is forgotten");
    let heard = desk.says(Message::Configure(Configure { run: 6, ..configure(&plan) }));
    assert_eq!(heard, refused(Configure::KIND, Refusal::Setting, plan.pairs()[1].0.into()));
}

#[test]
fn while_it_drives_neither_settings_nor_configure_are_taken() {
    for periods in [0, 5] {
        let mut desk = Desk::ready(Plan::new());
        desk.arms();
        desk.follows(periods);
        let state = desk.board_controller.state();
        let reason = (Refusal::State, state as u32);
        for run in [5, 6] {
            let heard = desk.says(Message::Set(Set { run, key: 0, value: 1000 }));
            assert_eq!(heard, refused(Set::KIND, reason.0, reason.1));
        }
        let heard = desk.says(Message::Configure(configure(&desk.plan)));
        assert_eq!(heard, refused(Configure::KIND, reason.0, reason.1));
        desk.follows(5);
        assert_eq!(desk.board_controller.state(), State::Running, "{:?}", desk.host.standing());
    }
}

#[test]
fn a_setting_behind_configure_takes_the_configuration_back() {
    let mut desk = Desk::ready(Plan::new());
    desk.follows(2);
    let (key, value) = desk.plan.pairs()[0];
    // Consent was to what was configured.
    desk.uploads(&[(key, value)]);
    assert_eq!(desk.board_controller.state(), State::Disconnected);
    let heard = desk.asks(|host, out| host.arm(out));
    assert_eq!(heard, refused(Arm::KIND, Refusal::Run, 0));
    assert_eq!(desk.board.state(), BoardState::Ready);
}

#[test]
fn a_setting_while_consent_is_on_its_way_lets_the_boards_watchdog_bite() {
    let mut desk = Desk::ready(Plan::new());
    let mut arm = Lines::default();
    desk.board_controller.host(
        desk.now_ns,
        encode(&Message::Arm(Arm { run: 5, config: CONFIG, boot: BOARD_CONTROLLER.boot })).as_bytes(),
        &mut arm.host,
        &mut arm.daq,
    );
    let (key, value) = desk.plan.pairs()[0];
    desk.uploads(&[(key, value)]);
    desk.board.receive(desk.now_us(), &mut desk.line, arm.daq.as_bytes(), &mut desk.up);
    assert_eq!((desk.settle(), desk.board.state()), (vec![], BoardState::Armed), "nobody drives it");
    desk.follows(4);
    assert_eq!(desk.board.state(), BoardState::Faulted);
}

#[test]
fn consent_needs_the_run_and_the_configuration_that_were_configured() {
    let mut desk = Desk::new(Plan::new());
    let heard = desk.says(Message::Arm(Arm { run: 5, config: CONFIG, boot: BOARD_CONTROLLER.boot }));
    assert_eq!(heard, refused(Arm::KIND, Refusal::Run, 0));
    let mut desk = Desk::ready(Plan::new());
    for (run, config) in [(6, CONFIG), (5, CONFIG ^ 1)] {
        let heard = desk.says(Message::Arm(Arm { run, config, boot: BOARD_CONTROLLER.boot }));
        assert_eq!(heard, refused(Arm::KIND, Refusal::Run, 5));
    }
    // The boot number of encoder and converter, for one, is not the controller's.
    for boot in [0, BOARD.boot] {
        let heard = desk.says(Message::Arm(Arm { run: 5, config: CONFIG, boot }));
        assert_eq!(heard, refused(Arm::KIND, Refusal::Boot, 0));
    }
    assert_eq!(desk.board.state(), BoardState::Ready);
    assert_eq!(
        desk.says(Message::Arm(Arm { run: 5, config: CONFIG, boot: BOARD_CONTROLLER.boot })),
        [Message::Armed(Armed { run: 5, config: CONFIG })]
    );
}

// A run.

#[track_caller]
fn told_the_same(desk: &mut Desk) -> usize {
    let (told, expected) = desk.cycles();
    let (told, expected) = (words(&told), words(&expected));
    for (told, expected) in told.iter().zip(&expected) {
        assert_eq!(told, expected);
    }
    assert_eq!(told.len(), expected.len());
    let (told, state) = (desk.host.standing(), desk.twin.state());
    assert_eq!((told.state, told.cause, told.tick), (state.state(), state.cause(), state.tick()));
    assert_eq!(told.value.to_bits(), state.value().to_bits());
    assert_eq!((desk.host.origin(), told.untold), (desk.twin.origin(), 0));
    expected.len()
}

#[test]
fn the_host_is_told_of_each_sample_all_that_a_controller_of_its_own_would_know() {
    for law in LawParams::<f32>::all() {
        let start = FixedCounts((1000 << 16) + 777);
        let mut plan = Plan { servo: paper(law), start, ..Plan::new() };
        // Under a law that never brakes the desk's uneven shaft is none that drag alone slows down.
        plan.bounds.drive_torque.low = -10.0;
        let mut desk = Desk::ready(plan);
        desk.follows(4);
        desk.arms();
        assert_eq!(told_the_same(&mut desk), 0, "before consent nothing is told");
        for k in 0..200 {
            let lateness = Micros(100 + k % 7);
            desk.board_controller.answered(lateness);
            desk.twin.answered(lateness);
            desk.follows(1);
        }
        assert_eq!(told_the_same(&mut desk), 200);
        // Two at once: the first is overtaken.
        desk.samples();
        desk.samples();
        desk.settle();
        assert_eq!(told_the_same(&mut desk), 2);
        // One twice, one lost.
        desk.samples();
        let frame = desk.up;
        desk.settle();
        desk.up.append(frame.as_bytes());
        desk.settle();
        desk.samples();
        desk.up.clear();
        desk.follows(3);
        assert_eq!(told_the_same(&mut desk), 5);
        assert_eq!(desk.board_controller.state(), State::Running, "{law:?}: {:?}", desk.host.standing());
        // And one that ends it.
        desk.faulty(true, false);
        desk.settle();
        desk.follows(3);
        assert_eq!(told_the_same(&mut desk), 4);
        assert_eq!(desk.host.standing().state, State::Faulted);
    }
}

#[test]
fn each_check_that_ends_control_is_told_with_what_it_saw() {
    let new = Plan::new().limits;
    for (cause, limits) in [
        (
            Cause::FollowingError,
            SupervisorParams {
                limits: LimitParams { following_error: 0.002, following_time: 0.0, ..new.limits },
                ..new
            },
        ),
        (
            Cause::Saturation,
            SupervisorParams { limits: LimitParams { saturation_time: 0.01, ..new.limits }, ..new },
        ),
        (
            Cause::StandStill,
            SupervisorParams { limits: LimitParams { following_error: 0.2, ..new.limits }, ..new },
        ),
        (Cause::Jump, new),
    ] {
        let mut desk = Desk::ready(Plan { limits, watchdog: Micros(10_000), ..Plan::new() });
        desk.arms();
        desk.follows(10);
        // Away from its path, not at all, or as no shaft can.
        desk.speed = match cause {
            Cause::StandStill => 0,
            Cause::Jump => 1000,
            _ => 5,
        };
        while desk.board_controller.driving() {
            desk.follows(1);
        }
        let samples = told_the_same(&mut desk);
        assert!(samples > 10, "{cause:?} after {samples} samples: {:?}", desk.host.standing());
        let (told, counts, rejected) =
            (desk.host.standing(), desk.twin.counts(), desk.twin.state().rejected());
        assert_eq!((told.state, told.cause), (State::Faulted, cause));
        assert_eq!((told.rejected, desk.host.counts()), (rejected, counts), "the line's counts come too");
        assert_ne!(told.value, 0.0);
    }
}

#[test]
fn a_fault_before_consent_is_told_with_its_sample() {
    let mut desk = Desk::ready(Plan::new());
    desk.follows(3);
    desk.faulty(true, false);
    desk.settle();
    assert_eq!(told_the_same(&mut desk), 1);
    assert_eq!((desk.host.standing().state, desk.host.standing().cause), (State::Faulted, Cause::Board));
}

#[test]
fn the_path_begins_at_the_count_on_which_the_run_begins() {
    let desk = Desk::running(Plan::new());
    assert_eq!(desk.host.origin(), desk.twin.origin());
    assert_ne!(desk.host.origin(), FixedCounts(0));
}

#[test]
fn clock_cycles_are_told_with_the_sample_after_and_only_with_it() {
    let mut desk = Desk::running(Plan::new());
    desk.cycles();
    desk.board_controller.spent(4321);
    desk.follows(2);
    let cycles: Vec<u32> =
        desk.cycles().0.iter().map(|n| if let Notice::Cycle(c) = n { c.cycles } else { 0 }).collect();
    assert_eq!(cycles, [4321, 0]);
}

#[test]
fn a_run_ends_by_itself_after_its_ticks_and_the_host_is_told_once() {
    for ticks in [1, 2, 50] {
        let mut desk = Desk::ready(Plan { ticks, ..Plan::new() });
        desk.arms();
        desk.follows(ticks as u32 - 1);
        assert!(desk.board_controller.driving() && desk.board.state() != BoardState::Stopped);
        assert!(desk.ends().is_empty());
        desk.follows(1);
        let told = *desk.host.standing();
        assert_eq!((desk.board_controller.state(), told.state), (State::Holding, State::Holding));
        assert_eq!((told.cause, told.tick), (Cause::Done, ticks - 1));
        assert_eq!(desk.board.state(), BoardState::Stopped);
        desk.follows(20);
        assert_eq!(desk.ends(), [Cause::Done]);
        assert_eq!(desk.board.code(), desk.plan.supervisor().safe_codes().hold);
        assert_eq!(desk.host.counts().received, ticks, "the counts of the line came with the end");
        assert_eq!(desk.board_controller.poll_at(), None, "nothing is awaited");
    }
}

#[test]
fn the_host_may_stop_it_and_is_told_as_often_as_it_asks() {
    for (reason, cause) in [(StopReason::Done, Cause::Done), (StopReason::Operator, Cause::Operator)] {
        let mut desk = Desk::running(Plan::new());
        let heard = desk.asks(|host, out| host.stop(reason, out));
        assert!(matches!(heard[..], [Message::Ended(_), Message::Link(_), Message::Stopped(_)]), "{heard:?}");
        assert_eq!((desk.host.standing().state, desk.host.standing().cause), (State::Holding, cause));
        assert_eq!((desk.board.state(), desk.ends()), (BoardState::Stopped, vec![cause]));
        let heard = desk.says(Message::Stop(Stop { run: 5, reason: reason as u8 }));
        let code = desk.plan.supervisor().safe_codes().hold.0;
        assert_eq!(heard, [Message::Stopped(Stopped { run: 5, reason: reason as u8, code })]);
        desk.follows(5);
        assert_eq!(desk.ends(), [cause]);
    }
}

#[test]
fn the_host_asks_for_the_end_until_it_hears_of_it() {
    let mut desk = Desk::running(Plan::new());
    desk.host.stop(StopReason::Operator, &mut Outbox::default()); // lost on the way
    desk.follows((ALIVE_NS / MS) as u32 + 1);
    assert_eq!((desk.board_controller.state(), desk.ends()), (State::Holding, vec![Cause::Operator]));
}

#[test]
fn a_board_that_falls_silent_ends_in_a_fault_of_which_the_host_hears() {
    let mut desk = Desk::running(Plan::new());
    let at = desk.board_controller.poll_at().unwrap();
    assert_eq!(at, desk.now_ns + 3 * MS);
    desk.passes(at - desk.now_ns - 1);
    assert_eq!(desk.board_controller.state(), State::Running);
    let heard = desk.passes(1);
    assert!(matches!(heard[..2], [Message::Ended(_), Message::Link(_)]), "{heard:?}");
    assert_eq!((desk.board_controller.state(), desk.host.standing().state), (State::Faulted, State::Faulted));
    assert_eq!((desk.host.standing().cause, desk.ends()), (Cause::Silence, vec![Cause::Silence]));
    desk.passes(1000 * MS);
    assert_eq!(desk.ends(), [Cause::Silence], "told once");
}

#[test]
fn a_board_whose_watchdog_bit_ends_in_a_fault_of_which_the_host_hears() {
    let mut desk = Desk::running(Plan { silence: Micros(8000), ..Plan::new() });
    desk.now_ns += 3 * MS;
    desk.board.poll(desk.now_us(), &mut desk.up);
    let heard = desk.settle();
    assert!(matches!(heard[0], Message::Fault(m) if m.cause == BoardFault::Watchdog as u8), "{heard:?}");
    assert_eq!((desk.host.standing().state, desk.host.standing().cause), (State::Faulted, Cause::Board));
    assert_eq!(desk.ends(), [Cause::Board]);
}

#[test]
fn a_host_that_falls_silent_ends_the_run_in_the_safe_state() {
    let plan = Plan { host_silence: Micros(50_000), ..Plan::new() };
    let mut desk = Desk::running(plan);
    // The host's pings keep it going.
    desk.follows(500);
    assert_eq!(desk.board_controller.state(), State::Running);
    desk.host_alive = false;
    desk.says(Message::Ping(Ping { run: 5, nonce: 1 }));
    desk.follows(49);
    assert_eq!(desk.board_controller.state(), State::Running);
    desk.follows(1);
    assert_eq!((desk.board_controller.state(), desk.board.state()), (State::Holding, BoardState::Stopped));
    assert_eq!((desk.host.standing().cause, desk.ends()), (Cause::Operator, vec![Cause::Operator]));
}

#[test]
fn a_run_that_does_not_need_its_host_goes_on_without() {
    let mut desk = Desk::running(Plan::new());
    desk.host_alive = false;
    desk.follows(5000);
    assert_eq!((desk.board_controller.state(), desk.board.state()), (State::Running, BoardState::Running));
}

#[test]
fn bytes_that_are_no_frame_are_no_sign_of_a_host() {
    let mut desk = Desk::running(Plan { host_silence: Micros(50_000), ..Plan::new() });
    desk.host_alive = false;
    for _ in 0..60 {
        desk.to_board.append(&[0, 3, 7, 7, 0]);
        desk.follows(1);
    }
    assert_eq!(desk.board_controller.state(), State::Holding);
}

#[test]
fn for_the_host_a_board_that_says_nothing_more_has_ended() {
    let mut desk = Desk::running(Plan::new());
    let told = desk.now_ns;
    let mut ended = Vec::new();
    let mut out = Outbox::default();
    while ended.is_empty() {
        desk.now_ns = desk.host.poll_at().unwrap();
        out.clear();
        desk.host.poll(desk.now_ns, &mut out, &mut |n| ended.push((desk.now_ns - told, n)));
    }
    assert!(
        matches!(ended[..], [(BOARD_SILENCE_NS, Notice::Ended(Ending { cause: Cause::Silence, .. }))]),
        "{ended:?}"
    );
    assert_eq!(desk.host.standing().state, State::Faulted);
    // It may hear all the same: it is asked to stop, until it says that it has.
    for _ in 0..3 {
        let asked = frames(out.as_bytes());
        let stop = Message::Stop(Stop { run: 5, reason: StopReason::Operator as u8 });
        assert!(asked.contains(&stop), "{asked:?}");
        desk.now_ns = desk.host.poll_at().unwrap();
        out.clear();
        desk.host.poll(desk.now_ns, &mut out, &mut |n| ended.push((desk.now_ns - told, n)));
    }
    assert_eq!(ended.len(), 1, "told once: {ended:?}");
    let stopped = Message::Stopped(Stopped { run: 5, reason: 2, code: 3072 });
    let path = |_| clutch_core::Target::default();
    desk.host.receive(desk.now_ns, encode(&stopped).as_bytes(), &path, &mut |_| ());
    assert_eq!(desk.host.poll_at(), None);
}

#[test]
fn a_host_does_not_believe_a_configuration_of_another_power_up_than_that_of_the_hello() {
    let plan = Plan::new();
    let heard = Desk::new(plan).says(discover());
    let hello = heard.iter().find(|m| matches!(m, Message::ControllerHello(_))).unwrap();
    let configured =
        |boot| Message::Configured(Configured { run: plan.run, config: configure(&plan).config, boot });
    let (right, wrong) = (BOARD_CONTROLLER.boot, BOARD_CONTROLLER.boot.wrapping_add(1));
    // Nor one of whom nobody has heard.
    for (met, boot, believed) in [(true, right, true), (true, wrong, false), (false, right, false)] {
        let (mut host, mut notices) = (plan.host(), Vec::new());
        for message in [met.then_some(hello), Some(&configured(boot))].into_iter().flatten() {
            host.receive(0, encode(message).as_bytes(), &plan.path(), &mut |n| notices.push(n));
        }
        let other = matches!(notices.last(), Some(Notice::OtherBoot(m)) if m.boot == boot);
        let ready = host.standing().state == State::Ready;
        assert_eq!((ready, other), (believed, !believed), "{met}, {boot}: {notices:?}");
    }
}

#[test]
fn frames_of_another_run_are_ignored() {
    let mut desk = Desk::running(Plan::new());
    for message in [
        Message::Stop(Stop { run: 6, reason: StopReason::Operator as u8 }),
        Message::Ping(Ping { run: 6, nonce: 1 }),
    ] {
        assert_eq!(desk.says(message), []);
    }
    desk.follows(5);
    assert_eq!(desk.board_controller.state(), State::Running);
    // And by a host that waits for another run.
    let (mut other, mut notices) = (Plan { run: 6, ..desk.plan }.host(), Vec::new());
    other.receive(desk.now_ns, &desk.sent, &desk.plan.path(), &mut |n| notices.push(n));
    assert!(
        notices.iter().all(|n| matches!(n, Notice::ControllerHello(_) | Notice::Hello(_))),
        "{notices:?}"
    );
    assert_eq!(other.standing().state, State::Disconnected);
}

#[test]
fn a_ping_is_answered_with_the_boards_clock() {
    let mut desk = Desk::running(Plan::new());
    desk.asks(|host, out| host.ping(99, out));
    let at = desk.now_us();
    assert!(matches!(desk.notices.last(), Some(Notice::Pong(99, time)) if *time == at));
}

#[test]
fn a_host_that_shows_that_it_lives_pings_with_numbers_that_nobody_asks_the_clock_with() {
    let mut desk = Desk::running(Plan::new());
    let mut numbers = Vec::new();
    for _ in 0..3 {
        desk.now_ns = desk.host.poll_at().unwrap();
        let mut out = Outbox::default();
        desk.host.poll(desk.now_ns, &mut out, &mut |n| panic!("{n:?}"));
        let [Message::Ping(ping)] = frames(out.as_bytes())[..] else {
            panic!("{:?}", frames(out.as_bytes()))
        };
        assert_eq!(ping.run, 5);
        numbers.push(ping.nonce);
    }
    // Whoever asks counts from below: the answer to a sign of life is none to that.
    assert!(numbers[0] >= 0x8000_0000, "{numbers:x?}");
    assert_eq!((numbers[1], numbers[2]), (numbers[0] + 1, numbers[0] + 2));
}

#[test]
fn how_it_ended_and_what_the_line_has_carried_is_told_whichever_end_it_was() {
    for encoder_fault in [false, true] {
        let mut desk = Desk::running(Plan::new());
        desk.samples();
        desk.up.clear();
        desk.follows(2);
        if encoder_fault {
            desk.faulty(true, false);
            desk.settle();
        } else {
            desk.asks(|host, out| host.stop(StopReason::Operator, out));
        }
        let (told, counts) = (desk.host.standing(), desk.twin.counts());
        assert_eq!((told.lost, desk.host.counts().received), (1, counts.received), "{encoder_fault}");
    }
}

#[test]
fn what_the_line_has_carried_is_told_each_second() {
    let mut desk = Desk::running(Plan::new());
    desk.samples();
    desk.up.clear();
    desk.follows(985);
    assert_eq!((desk.host.standing().lost, desk.host.counts().received), (0, 0));
    desk.follows(15);
    assert_eq!(desk.host.standing().lost, 1);
    assert!(desk.host.counts().received.abs_diff(1000) < 8, "{:?}", desk.host.counts());
}

// Frames that get lost on the way to the host.

/// A host's view of frames: how often it was told of a sample, and where it thinks control stands.
fn replay(desk: &Desk, bytes: &[u8]) -> (Vec<desk::Heard>, HostNode) {
    let (mut host, mut notices) = (desk.plan.host(), Vec::new());
    host.receive(0, bytes, &desk.plan.path(), &mut |n| notices.push(n));
    (notices, host)
}

fn bytes(frames: &[Message]) -> Vec<u8> {
    frames.iter().flat_map(|m| encode(m).as_bytes().to_vec()).collect()
}

proptest! {
    #[test]
    fn telemetry_that_got_lost_is_counted_one_by_one_and_a_lost_sample_is_not(
        lost in prop::collection::btree_set(1_usize..95, 0..60),
    ) {
        let mut desk = Desk::ready(Plan::new());
        desk.follows(1);
        desk.arms();
        desk.follows(50);
        desk.samples();
        desk.up.clear();
        desk.follows(50);
        let (all, _) = replay(&desk, &desk.sent);
        let mut telemetry = 0;
        let mut kept = frames(&desk.sent);
        kept.retain(|m| {
            telemetry += usize::from(matches!(m, Message::Telemetry(_)));
            !(matches!(m, Message::Telemetry(_)) && lost.contains(&telemetry))
        });
        let (some, host) = replay(&desk, &bytes(&kept));
        prop_assert_eq!(host.standing().untold, lost.len() as u64);
        prop_assert_eq!(some.len() + lost.len(), all.len());
        // The frames that did come are as they were sent.
        let (some, all) = (words(&some), words(&all));
        prop_assert!(some.iter().all(|n| all.contains(n)));
        prop_assert_eq!(host.standing().tick, desk.twin.state().tick());
    }

    #[test]
    fn a_spoilt_byte_on_the_way_to_the_host_costs_its_frame_and_a_spoilt_end_the_next_one_with_it(place: usize, bits in 1_u8..=255) {
        let mut desk = Desk::running(Plan::new());
        desk.follows(10);
        let (good, _) = replay(&desk, &desk.sent);
        let mut spoilt = desk.sent.clone();
        let place = place % spoilt.len();
        let frames = if spoilt[place] == 0 { 2 } else { 1 };
        spoilt[place] ^= bits;
        let (heard, _) = replay(&desk, &spoilt);
        let bad = heard.iter().filter(|n| matches!(n, Notice::BadFrame(_))).count();
        let heard: Vec<_> = heard.into_iter().filter(|n| !matches!(n, Notice::BadFrame(_))).collect();
        prop_assert!(bad <= 2, "one frame, or both halves of one: {}", bad);
        prop_assert!(heard.len() + frames >= good.len(), "{} of {}", heard.len(), good.len());
    }

    #[test]
    fn a_spoilt_byte_on_the_way_to_the_board_costs_its_frame_and_a_spoilt_end_the_next_one_with_it(place: usize, bits in 1_u8..=255) {
        let plan = Plan::new();
        let sets: Vec<Message> =
            plan.pairs().iter().map(|(key, value)| Message::Set(Set { run: 5, key: *key, value: *value })).collect();
        let mut line = bytes(&sets);
        let place = place % line.len();
        let lost = if line[place] == 0 { 2 } else { 1 };
        line[place] ^= bits;
        let (mut board_controller, mut lines, mut taken) = (BoardController::new(BOARD_CONTROLLER), Lines::default(), Vec::new());
        for byte in line {
            board_controller.host(0, &[byte], &mut lines.host, &mut lines.daq);
            taken.extend(frames(&desk::drain(&mut lines.host)));
        }
        prop_assert!(taken.len() + lost >= sets.len());
        for m in taken {
            let Message::Taken(m) = m else { panic!("{m:?}") };
            prop_assert!(plan.pairs().contains(&(m.key, m.value)), "{m:?}");
        }
    }
}

#[test]
fn a_host_that_missed_the_first_answered_sample_knows_where_the_path_began_all_the_same() {
    let mut desk = Desk::ready(Plan { start: FixedCounts(40_000), ..Plan::new() });
    desk.follows(2);
    desk.arms();
    desk.follows(30);
    let (all, _) = replay(&desk, &desk.sent);
    let kept: Vec<Message> = frames(&desk.sent)
        .into_iter()
        .filter(|m| !matches!(m, Message::Telemetry(t) if t.states & 0x0f == State::Armed as u8))
        .collect();
    let (some, host) = replay(&desk, &bytes(&kept));
    assert_eq!((host.origin(), host.standing().untold), (desk.twin.origin(), 1));
    assert_eq!(
        words(&some),
        words(&all).into_iter().filter(|w| !w.contains("from: Armed")).collect::<Vec<_>>()
    );
}

// One run after the other.

#[test]
fn a_second_run_is_like_the_first_after_whichever_end() {
    for (fault, asked_again) in [(false, true), (true, true), (false, false), (true, false)] {
        let mut desk = Desk::running(Plan::new());
        if fault {
            desk.faulty(false, true);
            desk.settle();
            assert_eq!(desk.board_controller.state(), State::Faulted);
        } else {
            desk.asks(|host, out| host.stop(StopReason::Operator, out));
        }
        desk.follows(3);
        let heard = desk.asks(|host, out| host.arm(out));
        let state = if fault { State::Faulted } else { State::Holding };
        assert_eq!(heard, refused(Arm::KIND, Refusal::State, state as u32), "a run is over once");
        let servo = paper(LawParams::Smc(SmcParams::default()));
        desk.next(Plan { run: 6, servo, ticks: 100, ..Plan::new() });
        if asked_again {
            desk.says(discover());
        }
        desk.configures();
        desk.follows(3);
        desk.arms();
        desk.follows(99);
        assert_eq!(told_the_same(&mut desk), 99, "after a fault: {fault}, asked: {asked_again}");
        desk.follows(1);
        assert_eq!((desk.host.standing().state, desk.host.standing().cause), (State::Holding, Cause::Done));
    }
}

#[test]
fn the_same_run_is_not_run_twice() {
    let mut desk = Desk::running(Plan::new());
    desk.asks(|host, out| host.stop(StopReason::Operator, out));
    let heard = desk.asks(|host, out| host.configure(out));
    assert_eq!(heard, refused(Configure::KIND, Refusal::Run, 5));
    assert_eq!(desk.board.state(), BoardState::Stopped);
}

// The last word.

#[test]
fn there_is_a_last_word_exactly_while_it_drives_and_it_makes_the_board_safe() {
    let on_fault = SafeState::hold(6.0);
    let plan = Plan { limits: SupervisorParams::new(on_fault), ..Plan::new() };
    assert!(Desk::new(plan).board_controller.last_word().is_none());
    let mut desk = Desk::ready(plan);
    assert!(desk.board_controller.last_word().is_none());
    desk.arms();
    for periods in [0, 1, 5] {
        desk.follows(periods);
        assert!(desk.board_controller.driving());
        let (word, mut board) = (desk.board_controller.last_word().unwrap(), desk.board.clone());
        board.receive(desk.now_us(), &mut Decoder::new(), word.as_bytes(), &mut Outbox::default());
        assert_eq!((board.state(), board.code()), (BoardState::Faulted, plan.supervisor().safe_codes().hold));
    }
    desk.asks(|host, out| host.stop(StopReason::Operator, out));
    assert!(desk.board_controller.last_word().is_none());
    let mut desk = Desk::running(plan);
    desk.faulty(true, false);
    desk.settle();
    assert!(desk.board_controller.last_word().is_none());
}

#[test]
fn a_sample_that_was_overtaken_is_told_with_what_the_law_made_of_it() {
    let mut desk = Desk::running(Plan::new());
    desk.cycles();
    desk.samples();
    desk.samples();
    desk.settle();
    let (told, _) = desk.cycles();
    let [Notice::Cycle(first), Notice::Cycle(_)] = &told[..] else { panic!("{told:?}") };
    assert_eq!((first.cycle.arrival, first.superseded, first.cycle.answer), (Arrival::Late, true, None));
    let output = first.cycle.output.unwrap();
    assert_eq!(output.code, desk.host.servo().dac().code(output.command.voltage));
    assert_ne!((output.code, output.command.limit), (first.cycle.code, Limit::Invalid));
}

/// Telemetry that comes by the host's clock more slowly, or faster, than the periods that it tells of.
#[test]
fn a_board_whose_periods_are_not_those_of_the_hosts_clock_is_given_up() {
    // ns that pass beside each period of 1 ms.
    for (more, most) in [(0, None), (40_000, None), (100_000, Some(700)), (11_000_000, Some(10))] {
        let mut desk = Desk::ready(Plan::new());
        desk.arms();
        let seen = (0..1500).find(|_| {
            desk.follows(1);
            // Only the host's clock goes on: the board's periods are as they were.
            desk.host_later_ns += more;
            desk.host.standing().cause == Cause::Clock
        });
        assert_eq!(seen.is_some(), most.is_some(), "{more} ns: {seen:?}, {:?}", desk.host.standing());
        assert!(seen <= most, "{more} ns: {seen:?}");
    }
}

/// A simulated board may wait: whoever gives it more than two seconds before its silence counts, gives its clock four times as
/// long.
#[test]
fn a_board_that_may_be_silent_for_long_may_be_slow_for_as_long() {
    let plan = Plan::new();
    // Periods of 12 ms in place of 1 ms: a second of them is 11 s late.
    for (silent_ms, from, to) in [(2000, 1, 10), (2001, 720, 760), (2400, 870, 910), (5500, 1500, 1500)] {
        let mut desk = Desk::new(plan);
        let servo = Servo::new(&plan.servo).unwrap();
        desk.host = HostNode::new(servo, configure(&plan), ALIVE_NS, silent_ms * MS);
        desk.asks(|host, out| host.discover(7, out));
        desk.configures();
        desk.arms();
        let seen = (0..1500).find(|_| {
            desk.follows(1);
            desk.host_later_ns += 11 * MS;
            desk.host.standing().cause == Cause::Clock
        });
        assert!((from..=to).contains(&seen.unwrap_or(1500)), "{silent_ms} ms: {seen:?}");
    }
}
