//! Controller, encoder and converter on one chip: the loop closes within a sample.

use crate::desk::{self, BOARD, BOARD_CONTROLLER, CONFIG, Plan, drain, frames, paper};
use clutch_core::law::LawParams;
use clutch_core::supervisor::{Cause, State};
use clutch_core::{Counts, Dac, DacCode, Encoder, LimitParams, Micros, Plant, PlantParams, SupervisorParams};
use clutch_node::{BoardMisfit, BoardParams, HostNode, Notice, OneChip, Outbox, Role};
use clutch_wire::{
    Actuate, Arm, Armed, BoardFault, BoardState, Configured, Decoder, Message, Sample, StopReason,
    TELEMETRY_ANSWERED, Telemetry, encode,
};

/// A shaft of the paper's, a tenth of a period at a time.
struct Shaft {
    plant: Plant<f64>,
    angle: f64,
    speed: f64,
}

impl Shaft {
    fn new() -> Shaft {
        let plant = Plant::new(&PlantParams::default()).unwrap();
        Shaft { plant, angle: 0.1, speed: 54.0_f64.to_radians() }
    }

    fn turns(&mut self, code: DacCode, seconds: f64) {
        let volts = Dac::new(&Plan::new().servo.dac).unwrap().volts(code);
        for _ in 0..10 {
            self.speed += self.plant.acceleration(self.speed, f64::from(volts)) * seconds / 10.0;
            self.speed = self.speed.max(0.0);
            self.angle += self.speed * seconds / 10.0;
        }
    }

    fn counts(&self) -> Counts {
        Counts((self.angle * Encoder::PAPER.counts_per_radian::<f64>()).floor() as i32)
    }
}

/// A chip that drives a shaft, and its host.
struct Bench {
    plan: Plan,
    chip: OneChip,
    host: HostNode,
    shaft: Shaft,
    now_us: u64,
    notices: Vec<desk::Heard>,
}

impl Bench {
    fn new(plan: Plan) -> Bench {
        let chip = OneChip::new(BOARD_CONTROLLER, &BOARD).unwrap();
        let host = plan.host();
        // The board's clock of 32 bits wraps on the way.
        let now_us = (1 << 32) - 500_000;
        Bench { plan, chip, host, shaft: Shaft::new(), now_us, notices: Vec::new() }
    }

    fn hears(&mut self) -> Vec<Message> {
        assert_eq!(self.chip.outbox().dropped(), 0);
        let bytes = drain(self.chip.outbox());
        let notices = &mut self.notices;
        self.host.receive(self.now_us * 1000, &bytes, &self.plan.path(), &mut |n| notices.push(n));
        frames(&bytes)
    }

    fn asks(&mut self, f: impl FnOnce(&mut HostNode, &mut Outbox)) -> Vec<Message> {
        let mut out = Outbox::default();
        f(&mut self.host, &mut out);
        self.chip.receive(self.now_us, out.as_bytes(), &mut |_| ());
        self.hears()
    }

    fn ready(plan: Plan) -> Bench {
        let mut bench = Bench::new(plan);
        assert_eq!((bench.chip.state(), bench.chip.period_us()), (BoardState::Boot, None));
        let heard = bench.asks(|host, out| host.discover(7, out));
        assert!(matches!(heard[..], [Message::ControllerHello(_), Message::Hello(_)]), "{heard:?}");
        for (key, value) in plan.pairs() {
            let heard = bench.asks(|host, out| host.set(key, value, out));
            assert!(matches!(heard[..], [Message::Taken(_)]), "{heard:?}");
        }
        let heard = bench.asks(|host, out| host.configure(out));
        let configured = Configured { run: plan.run, config: CONFIG, boot: BOARD_CONTROLLER.boot };
        assert_eq!(heard, [Message::Configured(configured)]);
        assert_eq!(bench.chip.period_us(), Some(plan.servo.period.0));
        bench
    }

    fn armed(plan: Plan) -> Bench {
        let mut bench = Bench::ready(plan);
        let heard = bench.asks(|host, out| host.arm(out));
        assert_eq!(heard, [Message::Armed(Armed { run: plan.run, config: CONFIG })]);
        bench
    }

    fn running(plan: Plan) -> Bench {
        let mut bench = Bench::armed(plan);
        for _ in 0..20 {
            bench.period();
        }
        assert_eq!(bench.chip.state(), BoardState::Running);
        bench
    }

    /// A period: the code, and what the host heard of it.
    fn period(&mut self) -> (DacCode, Vec<Message>) {
        self.period_with(false, false)
    }

    fn period_with(&mut self, encoder_fault: bool, converter_fault: bool) -> (DacCode, Vec<Message>) {
        self.now_us += 1000;
        let (mut codes, counts) = (Vec::new(), self.shaft.counts());
        self.chip.sample(self.now_us, counts, encoder_fault, converter_fault, &mut |code| codes.push(code));
        let code = self.chip.code();
        assert_eq!(codes.last(), Some(&code), "the converter has the last code");
        self.shaft.turns(code, 0.001);
        (code, self.hears())
    }
}

fn telemetry(heard: &[Message]) -> Telemetry {
    let told = heard.iter().find_map(|m| if let Message::Telemetry(t) = m { Some(*t) } else { None });
    told.unwrap_or_else(|| panic!("{heard:?}"))
}

#[test]
fn each_law_follows_the_path_on_one_chip() {
    let new = Plan::new().limits;
    // A law that only switches is always at a limit.
    let limits = SupervisorParams { limits: LimitParams { saturation_time: 10.0, ..new.limits }, ..new };
    for law in LawParams::<f32>::all().into_iter().filter(LawParams::follows) {
        let mut bench = Bench::armed(Plan { servo: paper(law), limits, ..Plan::new() });
        let (mut largest, mut begun) = (0.0_f32, 0);
        for period in 0..5000 {
            let (_, heard) = bench.period();
            let error = f32::from_bits(telemetry(&heard).error).abs();
            if period >= 1000 {
                largest = largest.max(error);
            }
            begun += usize::from(bench.chip.state() == BoardState::Running);
        }
        assert_eq!(begun, 5000, "{law:?}: {:?}", bench.host.standing());
        assert!(largest > 0.0 && largest < 0.2_f32.to_radians(), "{law:?}: {largest} rad");
        assert_eq!((bench.host.standing().state, bench.host.standing().tick), (State::Running, 4999));
    }
}

#[test]
fn the_code_that_a_sample_gives_is_the_laws_answer_to_that_sample() {
    let mut bench = Bench::armed(Plan::new());
    let (mut twin, path, mut out) = (bench.plan.control(), bench.plan.path(), Outbox::default());
    twin.configure(DacCode(BOARD.boot_code), &mut Outbox::default());
    let mut reads = |message: Message| {
        twin.receive(0, &mut Decoder::new(), encode(&message).as_bytes(), &path, &mut out, &mut |_| ());
        frames(&drain(&mut out))
    };
    reads(Message::Configured(Configured { run: 5, config: CONFIG, boot: BOARD.boot }));
    reads(Message::Armed(Armed { run: 5, config: CONFIG }));
    let mut codes = Vec::new();
    for sequence in 0..500 {
        let counts = bench.shaft.counts().0;
        let (code, heard) = bench.period();
        let told = telemetry(&heard);
        assert_eq!((told.sequence, told.counts, told.code), (sequence, counts, code.0));
        assert_eq!(told.time_us, bench.now_us as u32);
        assert_ne!(told.flags & TELEMETRY_ANSWERED, 0);
        let sample = Sample { run: 5, sequence, time_us: told.time_us, counts, status: told.status };
        let answer = Actuate { run: 5, sequence, code: code.0, valid_us: 2000 };
        assert_eq!(reads(Message::Sample(sample)), [Message::Actuate(answer)]);
        codes.push(code);
    }
    codes.dedup();
    assert!(codes.len() > 100, "the law has something to do");
}

#[test]
fn a_period_puts_one_code_out_the_answer_to_its_sample_or_where_there_is_none_the_one_before() {
    let mut bench = Bench::running(Plan::new());
    let mut puts = |off: i32| {
        let (before, counts) = (bench.chip.code(), Counts(bench.shaft.counts().0 + off));
        let mut codes = Vec::new();
        bench.now_us += 1000;
        bench.chip.sample(bench.now_us, counts, false, false, &mut |code| codes.push(code));
        (before, codes, bench.chip.code(), telemetry(&bench.hears()).flags & TELEMETRY_ANSWERED != 0)
    };
    let (before, codes, after, answered) = puts(0);
    assert_eq!((codes, answered), (vec![after], true));
    assert_ne!(before, after, "the shaft has moved");
    let (before, codes, after, answered) = puts(100_000);
    assert_eq!(
        (codes, after, answered),
        (vec![before], before, false),
        "no shaft turns by five turns in 1 ms"
    );
    let mut bench = Bench::ready(Plan::new());
    let mut codes = Vec::new();
    bench.chip.sample(bench.now_us, Counts(0), false, false, &mut |code| codes.push(code));
    assert_eq!(codes, [DacCode(BOARD.boot_code)]);
}

#[test]
fn before_consent_the_output_is_that_of_power_up() {
    let mut bench = Bench::new(Plan::new());
    let boot = DacCode(BOARD.boot_code);
    assert_eq!((bench.chip.code(), bench.period()), (boot, (boot, vec![])));
    let mut bench = Bench::ready(Plan::new());
    for _ in 0..10 {
        assert_eq!(bench.period(), (boot, vec![]), "and nothing is told");
    }
}

#[test]
fn a_sample_that_comes_late_finds_the_watchdogs_safe_output() {
    for (late_us, bites) in [(2999, false), (3000, true)] {
        let mut bench = Bench::running(Plan { silence: Micros(8000), ..Plan::new() });
        let safe = bench.plan.supervisor().safe_codes().hold;
        bench.now_us += late_us;
        bench.chip.poll(bench.now_us, &mut |_| ());
        assert_eq!(bench.chip.state() == BoardState::Faulted, bites, "{late_us} µs");
        assert_eq!(bench.chip.code() == safe, bites);
        let heard = bench.hears();
        let bitten = |m: &Message| matches!(m, Message::Fault(f) if f.cause == BoardFault::Watchdog as u8);
        assert_eq!(heard.iter().any(bitten), bites);
        let ends =
            bench.notices.iter().filter(|n| matches!(n, Notice::Ended(e) if e.cause == Cause::Board)).count();
        assert_eq!(ends, usize::from(bites));
        let counts = bench.shaft.counts();
        bench.chip.sample(bench.now_us, counts, false, false, &mut |_| ());
        let code = bench.chip.code();
        assert_eq!(code == safe, bites, "and stays there");
    }
}

#[test]
fn silence_of_the_encoder_ends_in_a_fault_also_before_the_watchdog_bites() {
    let mut bench = Bench::running(Plan { watchdog: Micros(20_000), ..Plan::new() });
    bench.now_us += 3000;
    bench.chip.poll(bench.now_us, &mut |_| ());
    bench.hears();
    assert_eq!(bench.chip.state(), BoardState::Faulted);
    assert_eq!((bench.host.standing().state, bench.host.standing().cause), (State::Faulted, Cause::Silence));
}

#[test]
fn a_fault_of_the_hardware_is_answered_with_the_safe_output_in_the_same_sample() {
    for (encoder, converter) in [(true, false), (false, true)] {
        let mut bench = Bench::running(Plan::new());
        let (code, heard) = bench.period_with(encoder, converter);
        assert_eq!(
            (code, bench.chip.state()),
            (bench.plan.supervisor().safe_codes().hold, BoardState::Faulted)
        );
        assert!(matches!(heard[0], Message::Fault(_)), "{heard:?}");
        assert_eq!(
            (bench.host.standing().state, bench.host.standing().cause),
            (State::Faulted, Cause::Board)
        );
    }
}

#[test]
fn a_run_on_one_chip_ends_by_itself_and_another_may_follow() {
    let mut bench = Bench::armed(Plan { ticks: 50, ..Plan::new() });
    for _ in 0..50 {
        bench.period();
    }
    assert_eq!((bench.host.standing().state, bench.host.standing().cause), (State::Holding, Cause::Done));
    assert_eq!(bench.chip.state(), BoardState::Stopped);
    assert_eq!(bench.chip.code(), bench.plan.supervisor().safe_codes().hold);
    let heard = bench.asks(|host, out| host.arm(out));
    assert!(matches!(heard[..], [Message::Refused(m)] if m.request == Arm::KIND), "{heard:?}");
    bench.plan = Plan { run: 6, ..Plan::new() };
    let met = *bench.host.controller().unwrap();
    bench.host = bench.plan.host();
    bench.host.meet(&met);
    for (key, value) in bench.plan.pairs() {
        bench.asks(|host, out| host.set(key, value, out));
    }
    bench.asks(|host, out| host.configure(out));
    bench.asks(|host, out| host.arm(out));
    bench.period();
    assert_eq!((bench.chip.state(), bench.host.standing().state), (BoardState::Running, State::Running));
    let heard = bench.asks(|host, out| host.stop(StopReason::Operator, out));
    assert!(heard.iter().any(|m| matches!(m, Message::Stopped(_))), "{heard:?}");
    assert_eq!(bench.chip.state(), BoardState::Stopped);
}

#[test]
fn without_its_host_the_chip_goes_to_the_safe_state() {
    let mut bench = Bench::running(Plan { host_silence: Micros(50_000), ..Plan::new() });
    for _ in 0..29 {
        bench.period();
    }
    assert_eq!(bench.chip.state(), BoardState::Running);
    bench.period();
    assert_eq!(bench.chip.state(), BoardState::Stopped);
    assert_eq!((bench.host.standing().state, bench.host.standing().cause), (State::Holding, Cause::Operator));
}

#[test]
fn how_long_a_period_took_is_told_with_the_next() {
    let mut bench = Bench::running(Plan::new());
    bench.chip.answered(777, Micros(42));
    let told = telemetry(&bench.period().1);
    assert_eq!((told.cycles, told.lateness_us), (777, 42));
    let told = telemetry(&bench.period().1);
    assert_eq!((told.cycles, told.lateness_us), (0, 0));
}

#[test]
fn a_chip_that_cannot_be_is_named() {
    let bad = BoardParams { dac_bits: 17, ..BOARD };
    assert_eq!(OneChip::new(BOARD_CONTROLLER, &bad).unwrap_err(), BoardMisfit::DacBits(17));
}
