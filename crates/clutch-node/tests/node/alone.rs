//! A controller without a host: consent by a button, its end, faults; codes are those of any other supervisor's.

use crate::desk::{BOARD, PATHS, Plan};
use crate::hardware::{Desk, Done};
use clutch_core::law::{Pd, PdParams};
use clutch_core::reference::{Interpolation, Knot, OneKind, Ramp, Reference, ReferenceParams, Table};
use clutch_core::supervisor::{BoardMode, Cause, Sample, State};
use clutch_core::{
    BeginningAt, Counts, DacCode, Encoder, FixedCounts, Micros, ParamError, Planned, SafeState, Servo,
    SupervisorState, Target,
};
use clutch_node::{Alone, AloneMisfit, AloneRun, BoardParams, ResetCause};
use core::mem::take;

const BOOT_CODE: u16 = BOARD.boot_code;

type OnRamp = Alone<Pd<f32>, Ramp<f32>>;

fn run(plan: &Plan) -> AloneRun<Pd<f32>, Ramp<f32>> {
    let ReferenceParams::Ramp(path) = plan.reference else { panic!("a ramp") };
    AloneRun {
        servo: plan.servo,
        law: PdParams::default(),
        supervisor: plan.limits,
        bounds: plan.bounds,
        path,
        start: plan.start,
        ticks: plan.ticks,
        watchdog: plan.watchdog,
    }
}

/// Counts of a shaft that is driven, period by period: 54 °/s, not quite evenly.
const STEPS: [i32; 4] = [3, 2, 4, 3];

/// A controller and its board, whose shaft moves once it is driven.
struct Bench {
    alone: OnRamp,
    desk: Desk,
    pressed: bool,
    /// The code that is out.
    code: u16,
    /// Periods in which the shaft has moved.
    moved: usize,
}

impl Bench {
    fn new(plan: &Plan) -> Bench {
        Bench::on(plan, &BOARD)
    }

    fn on(plan: &Plan, board: &BoardParams) -> Bench {
        let alone = Alone::new(&run(plan), board).unwrap();
        Bench { alone, desk: Desk { counts: 70, ..Desk::default() }, pressed: false, code: 0, moved: 0 }
    }

    /// A run that has gone on for some periods, with the button let go.
    fn running(plan: &Plan) -> Bench {
        let mut bench = Bench::new(plan);
        bench.pass(1000);
        bench.press(25);
        assert_eq!(bench.state(), (State::Running, Cause::None));
        bench
    }

    fn driving(&self) -> bool {
        matches!(self.alone.state().state(), State::Armed | State::Running)
    }

    /// Periods; the code of the last.
    fn pass(&mut self, periods: u32) -> u16 {
        for _ in 0..periods {
            if self.driving() {
                self.desk.counts += STEPS[self.moved % STEPS.len()];
                self.moved += 1;
            }
            self.desk.now_us += u64::from(self.alone.period_us() - self.desk.takes_us);
            self.alone.tick(&mut self.desk, self.pressed);
            // One code, and only then the watchdog.
            match take(&mut self.desk.done)[..] {
                [Done::Sampled, Done::PutOut(code), Done::FedWatchdog] => self.code = code,
                ref done => panic!("{done:?}"),
            }
        }
        self.code
    }

    /// A press of some periods, and the button let go for long.
    fn press(&mut self, periods: u32) {
        self.pressed = true;
        self.pass(periods);
        self.pressed = false;
        self.pass(20);
    }

    fn state(&self) -> (State, Cause) {
        (self.alone.state().state(), self.alone.state().cause())
    }
}

#[test]
fn nothing_but_a_press_after_the_button_was_let_go_begins_a_run() {
    let mut bench = Bench::new(&Plan::new());
    // Held at power-up, for ever.
    bench.pressed = true;
    assert_eq!(bench.pass(5000), BOOT_CODE);
    assert_eq!(bench.state(), (State::Ready, Cause::None));
    // Let go, and a contact that bounces for 15 ms at a time.
    bench.pressed = false;
    bench.pass(100);
    for _ in 0..50 {
        bench.pressed = true;
        bench.pass(15);
        bench.pressed = false;
        bench.pass(1);
    }
    assert_eq!((bench.state(), bench.code), ((State::Ready, Cause::None), BOOT_CODE));
    // The twentieth period of a press; the sample of that very period is the first that is answered.
    bench.pass(20);
    bench.pressed = true;
    bench.pass(19);
    assert_eq!(bench.state().0, State::Ready);
    bench.pass(1);
    assert_eq!((bench.state().0, bench.alone.state().tick()), (State::Running, 0));
    // The press goes on, the run too.
    bench.pass(60);
    assert_eq!((bench.state().0, bench.alone.state().tick()), (State::Running, 60));
}

/// The same samples, given to a supervisor with the law of the list.
#[test]
fn its_codes_are_those_of_a_supervisor_with_the_law_of_the_list() {
    for start in [0, 4711] {
        let plan = Plan { start: FixedCounts(start), ticks: 300, ..Plan::new() };
        let mut bench = Bench::new(&plan);
        bench.pass(1000);
        bench.pressed = true;
        bench.pass(19);
        let servo = Servo::<f32>::new(&plan.servo).unwrap();
        let supervisor = plan.supervisor();
        let path = Reference::new(&plan.reference, plan.start, Encoder::PAPER, servo.period()).unwrap();
        let path = |tick| path.at(tick);
        let mut state = SupervisorState::default();
        supervisor.connect(&mut state);
        supervisor.arm(&mut state, DacCode(BOOT_CODE));
        let mut codes = std::collections::BTreeSet::new();
        for tick in 0..300 {
            bench.pass(1);
            let counts = Counts(bench.desk.counts);
            let sample = Sample {
                sequence: tick,
                time: Micros(bench.desk.now_us as u32),
                counts,
                board: BoardMode::Driving,
                ..Sample::default()
            };
            let origin = FixedCounts::from_counts(if tick == 0 { i64::from(counts.0) } else { 70 });
            let planned = BeginningAt { planned: &path, origin };
            let cycle = supervisor.sample(&servo, &mut state, &sample, planned);
            let answer = cycle.answer.unwrap_or_else(|| panic!("tick {tick}: {cycle:?}")).0;
            codes.insert(answer);
            if tick < 299 {
                assert_eq!(bench.code, answer, "tick {tick} from {start}");
            }
        }
        assert!(codes.len() > 20, "{} codes", codes.len());
        // After the last tick the safe output holds.
        assert_eq!(bench.state(), (State::Holding, Cause::Done));
        assert_eq!(bench.code, supervisor.safe_codes().hold.0);
    }
}

#[test]
fn a_press_ends_a_run_at_once_and_a_long_and_a_short_one_begin_another() {
    let mut bench = Bench::running(&Plan::new());
    let hold = Plan::new().supervisor().safe_codes().hold.0;
    bench.pressed = true;
    assert_eq!(bench.pass(1), hold);
    assert_eq!(bench.state(), (State::Holding, Cause::Operator));
    // That press is used up, however long it lasts.
    bench.pass(5000);
    bench.pressed = false;
    bench.pass(30);
    assert_eq!(bench.state().0, State::Holding);
    bench.press(999);
    assert_eq!(bench.state().0, State::Holding);
    bench.press(1000);
    assert_eq!((bench.state().0, bench.code), (State::Ready, hold));
    // From where the shaft is by now.
    bench.pass(1000);
    let here = i64::from(bench.desk.counts);
    bench.press(25);
    assert_eq!((bench.state().0, bench.alone.origin()), (State::Running, FixedCounts::from_counts(here)));
}

#[test]
fn presses_in_a_hurry_end_a_run_and_begin_none() {
    let mut bench = Bench::running(&Plan::new());
    for _ in 0..10 {
        bench.press(100);
        assert_eq!(bench.state(), (State::Holding, Cause::Operator));
    }
    // Nor after an acknowledgement that was as hurried.
    bench.press(1000);
    bench.press(100);
    assert_eq!(bench.state().0, State::Ready);
}

#[test]
fn a_contact_that_stays_closed_ends_the_run_that_it_began() {
    let mut plan = Plan::new();
    // The shaft of this desk is not what the law wants for so long.
    plan.limits.limits.saturation_time = 60.0;
    let mut bench = Bench::new(&plan);
    bench.pass(1000);
    bench.pressed = true;
    bench.pass(1999);
    assert_eq!(bench.state().0, State::Running);
    bench.pass(1);
    assert_eq!(bench.state(), (State::Holding, Cause::Operator));
    bench.pass(5000);
    assert_eq!(bench.state().0, State::Holding);
}

#[test]
fn a_press_ends_a_run_5_ms_after_the_one_that_began_it() {
    let mut bench = Bench::new(&Plan::new());
    bench.pass(1000);
    bench.pressed = true;
    bench.pass(30);
    for (let_go, ends) in [(4, false), (5, true)] {
        bench.pressed = false;
        bench.pass(let_go);
        bench.pressed = true;
        bench.pass(1);
        assert_eq!(bench.state().0 == State::Holding, ends, "let go for {let_go} ms");
    }
}

#[test]
fn a_fault_latches_and_its_lamp_counts_the_cause() {
    let mut bench = Bench::running(&Plan::new());
    assert!(bench.alone.lamp());
    bench.desk.encoder_fault = true;
    bench.pass(1);
    bench.desk.encoder_fault = false;
    assert_eq!(bench.state(), (State::Faulted, Cause::Board));
    assert!(!bench.alone.lamp());
    // 12 of 0.4 s each, and a pause: as many in the same time behind them.
    let all = (2 * Cause::Board as u32 + 2) * 200;
    assert_eq!([flashes(&mut bench, all), flashes(&mut bench, all)], [Cause::Board as u32; 2]);
    assert_eq!(bench.state().0, State::Faulted);
    bench.press(1000);
    assert_eq!(bench.state(), (State::Ready, Cause::None));
    // One each 2.2 s.
    assert_eq!(flashes(&mut bench, 22_000), 10);
}

/// The flashes of the lamp in some periods.
fn flashes(bench: &mut Bench, periods: u32) -> u32 {
    let (mut lit, mut count) = (bench.alone.lamp(), 0);
    for _ in 0..periods {
        bench.pass(1);
        count += u32::from(lit && !bench.alone.lamp());
        lit = bench.alone.lamp();
    }
    count
}

/// A run is not begun again in a state that hides why the last one broke off.
#[test]
fn a_program_that_begins_anew_after_a_fault_begins_as_faulted() {
    for (started_by, state) in [
        (ResetCause::Power, State::Ready),
        (ResetCause::Pin, State::Ready),
        (ResetCause::Watchdog, State::Faulted),
        (ResetCause::Fault, State::Faulted),
        (ResetCause::Clock, State::Faulted),
    ] {
        let mut bench = Bench::on(&Plan::new(), &BoardParams { started_by, ..BOARD });
        assert_eq!(bench.pass(1000), BOOT_CODE, "{started_by:?}");
        assert_eq!(bench.state().0, state, "{started_by:?}");
        bench.press(25);
        assert_eq!(bench.state().0 == State::Running, state == State::Ready, "{started_by:?}");
    }
}

/// The machine that the board is built into decides until a run has begun: not the safe state of a run that nobody asked for.
#[test]
fn a_fault_before_consent_leaves_the_boot_code() {
    for on_fault in [SafeState::ramp(2.0, 8.0), SafeState::Release, SafeState::hold_then_release(5.0, 0.1)] {
        let mut plan = Plan::new();
        plan.limits.on_fault = on_fault;
        let mut bench = Bench::new(&plan);
        bench.pass(50);
        bench.desk.encoder_fault = true;
        for _ in 0..500 {
            assert_eq!(bench.pass(1), BOOT_CODE, "{on_fault:?}");
        }
        assert_eq!(bench.state(), (State::Faulted, Cause::Board));
    }
}

/// A ramp goes on to its end, and a brake that is to let go after a time does, although somebody has acknowledged the end.
#[test]
fn a_safe_state_goes_on_through_an_acknowledgement() {
    for (on_fault, ends_at) in [
        (SafeState::ramp(0.2, 9.0), 9.0),
        (SafeState::ramp(0.2, 0.5), 0.5),
        (SafeState::hold_then_release(5.0, 4.0), 0.0),
    ] {
        let mut plan = Plan::new();
        plan.limits.on_fault = on_fault;
        let mut bench = Bench::running(&plan);
        let volts = |code: u16| f32::from(code) * 20.0 / 4096.0 - 10.0;
        let begin = volts(bench.code);
        bench.pressed = true;
        let first = volts(bench.pass(1));
        // One step, not two: 0.2 mV of a ramp, or the voltage that holds.
        let of_ramp = if matches!(on_fault, SafeState::Ramp(_)) { begin } else { 5.0 };
        assert!((first - of_ramp).abs() < 0.006, "{on_fault:?}: {begin} V, {first} V");
        bench.pressed = false;
        bench.pass(30);
        bench.press(1000);
        assert_eq!(bench.state().0, State::Ready, "{on_fault:?}");
        assert!((volts(bench.code) - ends_at).abs() > 1.0, "{on_fault:?}: it is still on its way");
        let end = volts(bench.pass(40_000));
        assert!((end - ends_at).abs() < 0.006, "{on_fault:?}: {end} V");
        assert_eq!(bench.state().0, State::Ready, "{on_fault:?}");
    }
}

#[test]
fn a_law_that_gives_no_codes_is_ended_by_the_watchdog() {
    let mut plan = Plan::new();
    // A count that no shaft can have does not end control, and is not answered.
    plan.limits.limits.jumps = 128;
    let mut bench = Bench::running(&plan);
    let before = bench.code;
    for _ in 0..2 {
        bench.desk.counts += 5000;
        assert_eq!(bench.pass(1), before, "the code stays");
    }
    bench.desk.counts += 5000;
    let hold = plan.supervisor().safe_codes().hold.0;
    assert_eq!(bench.pass(1), hold);
    assert_eq!(bench.state(), (State::Faulted, Cause::Board));
}

#[test]
fn answers_that_are_too_late_end_a_run() {
    let plan = Plan::new();
    let mut bench = Bench::running(&plan);
    bench.desk.takes_us = plan.limits.limits.deadline.0;
    bench.pass(40);
    assert_eq!(bench.state().0, State::Running);
    bench.desk.takes_us += 1;
    bench.pass(40);
    assert_eq!(bench.state(), (State::Faulted, Cause::Deadline));
}

/// Times of 32 bits and numbers of 16, each beyond its end in a run; and other periods than a millisecond.
#[test]
fn a_run_goes_on_where_its_numbers_begin_anew() {
    for (period_us, periods) in [(500, 70_000), (1000, 70_000), (4000, 2000)] {
        let mut plan = Plan::new();
        plan.servo.period = Micros(period_us);
        plan.watchdog = Micros(3 * period_us);
        plan.limits.limits.saturation_time = 60.0;
        plan.reference = ReferenceParams::ramp(54.0_f32.to_radians() * 1000.0 / period_us as f32);
        plan.limits.limits.following_error = 1.0;
        let mut bench = Bench::new(&plan);
        bench.desk.now_us = (1 << 32) - 2_500_000;
        bench.pass(2_000_000 / period_us);
        bench.press(20_000 / period_us);
        bench.pass(periods);
        assert_eq!(bench.state(), (State::Running, Cause::None), "{period_us} µs");
        assert!(bench.desk.now_us > 1 << 32, "{period_us} µs");
        bench.pressed = true;
        bench.pass(1);
        assert_eq!(bench.state(), (State::Holding, Cause::Operator), "{period_us} µs");
    }
}

#[test]
fn a_run_of_another_board_is_refused() {
    let of = |board: BoardParams| Alone::new(&run(&Plan::new()), &board).err();
    assert_eq!(of(BOARD), None);
    let refused = of(BoardParams { counts_per_rev: 8000, ..BOARD });
    assert_eq!(refused, Some(AloneMisfit::Encoder(8000)));
    for board in [
        BoardParams { dac_bits: 16, ..BOARD },
        BoardParams { dac_lowest_mv: 0, ..BOARD },
        BoardParams { dac_highest_mv: 10_023, ..BOARD },
    ] {
        assert_eq!(of(board), Some(AloneMisfit::Converter), "{board:?}");
    }
    // 0.4 mV are below what a board says of itself.
    let mut trimmed = run(&Plan::new());
    trimmed.servo.dac.highest = 10.0004;
    assert_eq!(Alone::new(&trimmed, &BOARD).err(), None);
    for watchdog in [1999, 30_001] {
        let mut run = run(&Plan::new());
        run.watchdog = Micros(watchdog);
        assert_eq!(Alone::new(&run, &BOARD).err(), Some(AloneMisfit::Watchdog(Micros(watchdog))));
    }
    assert!(matches!(of(BoardParams { boot_code: 4096, ..BOARD }), Some(AloneMisfit::Board(_))));
    let slow = of(BoardParams { period_min_us: 2000, ..BOARD });
    assert_eq!(slow, Some(AloneMisfit::Period(Micros(1000))));
    let mut law = run(&Plan::new());
    law.law.kp = -1.0;
    let refused = Alone::new(&law, &BOARD).err();
    assert!(matches!(refused, Some(AloneMisfit::Run(ParamError { value: -1.0, .. }))), "{refused:?}");
    // Beyond what the converter gives: nothing clips unseen.
    let mut servo = run(&Plan::new());
    servo.servo.output.highest = 12.0;
    assert!(matches!(Alone::new(&servo, &BOARD).err(), Some(AloneMisfit::Run(_))));
}

/// Each kind by itself has the targets of the path that may be any.
#[test]
fn a_path_of_one_kind_is_the_path_that_could_be_any() {
    fn same<P: OneKind<f32>>(one: &P, any: &ReferenceParams<'static, f32>) {
        let period = Micros(1000);
        let any = Reference::new(any, FixedCounts(0), Encoder::PAPER, period).unwrap();
        let one = one.path(Encoder::PAPER, period).unwrap();
        let targets = |tick: u64| -> (Target<f32>, Target<f32>) { (one.target(tick), any.at(tick)) };
        for tick in (0..3000).step_by(7) {
            let (one, any) = targets(tick);
            assert_eq!(one, any, "tick {tick}");
        }
    }
    const KNOTS: &[Knot] = &[
        Knot { time_us: 100_000, position: FixedCounts(7 << 16) },
        Knot { time_us: 900_000, position: FixedCounts(1000 << 16) },
        Knot { time_us: 2_000_000, position: FixedCounts(1100 << 16) },
    ];
    let mut kinds = 0;
    let ramp = ReferenceParams::ramp(0.3);
    let table = Table { knots: KNOTS, interpolation: Interpolation::Cubic };
    for any in PATHS.iter().chain([&ramp, &ReferenceParams::Table(table)]) {
        match any {
            ReferenceParams::Ramp(p) => same(p, any),
            ReferenceParams::Trapezoid(p) => same(p, any),
            ReferenceParams::JerkLimited(p) => same(p, any),
            ReferenceParams::MinimumJerk(p) => same(p, any),
            ReferenceParams::Sine(p) => same(p, any),
            ReferenceParams::Chirp(p) => same(p, any),
            ReferenceParams::Table(p) => same(p, any),
            ReferenceParams::Hold => {}
        }
        kinds += 1;
    }
    assert_eq!(kinds, 7);
    same(&Ramp { rate: 0.0 }, &ReferenceParams::Hold);
    assert!(Ramp { rate: f32::NAN }.path(Encoder::PAPER, Micros(1000)).is_err());
    assert!(Ramp { rate: 1.0_f32 }.path(Encoder::PAPER, Micros(0)).is_err());
    let empty = Table { knots: &[], interpolation: Interpolation::Linear };
    assert!(OneKind::<f32>::path(&empty, Encoder::PAPER, Micros(1000)).is_err());
}
