//! The boards' own images on the models of their chips: they behave like the simulation, bit for bit, and what breaks on
//! the chip ends as docs/firmware.md says.

use crate::{beside, equal, on, simulate};
use clutch_core::supervisor::{Cause, State};
use clutch_loop::chip_board::{
    AloneReport, AloneSession, ChipBoard, ChipEnd, ChipFault, ChipFaultKind, ChipKind, ChipOptions,
    ChipReport, ChipRole, ChipSession,
};
use clutch_loop::lockstep_board::InProcessBoard;
use clutch_loop::lockstep_session::LockstepOptions;
use clutch_loop::virtual_time::{VirtualBoard, VirtualReport};
use clutch_node::Outbox;
use clutch_sim::{Metrics, Scenario};
use clutch_tests::firmware::image;
use clutch_wire::{
    BoardState, Decoder, Discover, Hello, Message, ResetCause, SCHEMA, VERSION, WARNING_BROWN_OUT, encode,
};
use std::path::Path;

const IMAGES: [(&str, ChipRole); 3] = [
    ("nucleo-controller", ChipRole::Controller),
    ("nucleo-daq", ChipRole::Daq),
    ("pico-controller", ChipRole::Controller),
];
/// The other role of the Pico, on the same board: it is the one that gets many bytes.
const PICO_DAQ: (&str, ChipRole) = ("pico-daq", ChipRole::Daq);

/// True for an image of the Pico.
fn pico(image: &str) -> bool {
    image.starts_with("pico-")
}

/// Those of some faults that the chip of an image can have.
fn could_be<const N: usize>(image: &str, faults: [ChipFaultKind; N]) -> impl Iterator<Item = ChipFaultKind> {
    let chip = ChipKind::of(Path::new(image)).expect("an image's chip");
    faults.into_iter().filter(move |fault| chip.has(*fault))
}

/// `BOOT_CODE` of the images.
const BOOT_CODE: u16 = 1844;

/// A law at 2 °/s, on the rig that the images are made for; the safe output is `BOOT_CODE`'s, 1844 · 10 V / 4096.
fn scenario(law: &str, duration: f64) -> Scenario {
    let text = format!(
        "name = \"{law} at 2 °/s\"\n[rig]\nbase = \"paper\"\nencoder.counts_per_rev = 20000\ndac.bits = 12\n\
         dac.lowest_v = 0.0\ndac.highest_v = 10.0\n[law.{law}]\n[reference.ramp]\nrate_deg_s = 2.0\n\
         [sampling]\nscalar = \"f32\"\n[run]\nduration_s = {duration:?}\nsettle_s = 0.1\n\
         start = \"rest\"\n\
         [safety]\nreason = \"a weight drives the shaft\"\n[safety.on_fault.hold]\nvolts_v = 4.501953125\n\
         [safety.limits]\nfollowing_error_deg = 5.0\n"
    );
    Scenario::parse(law, &text, &[]).expect("a scenario")
}

fn session(scenario: &Scenario, role: ChipRole, chip: ChipOptions) -> ChipSession {
    let options = LockstepOptions { uncertified: true, seed: 1, ..LockstepOptions::default() };
    ChipSession::new(scenario.clone(), options, chip, role).expect("a session")
}

fn figures_and_codes_are_the_simulations(name: &str, role: ChipRole, law: &str) {
    let Some(image) = image(name) else { return };
    let _beside = beside();
    let scenario = scenario(law, 2.0);
    let chip = ChipOptions { record: true, ..ChipOptions::default() };
    let report = session(&scenario, role, chip).run(&image).expect("the chip runs");
    equal(&format!("{law} on {name}"), &report.ran, &simulate(&scenario));
    assert_eq!(
        (report.chip.resets, report.chip.dead, report.chip.floating),
        (0, false, false),
        "{law} on {name}"
    );
    assert_eq!(report.ran.standing.cause, Cause::Done, "{law} on {name}");
}

#[test]
fn pd_on_the_chip_is_the_simulation_bit_for_bit() {
    figures_and_codes_are_the_simulations("nucleo-controller", ChipRole::Controller, "pd");
}

#[test]
fn ctc_on_the_chip_is_the_simulation_bit_for_bit() {
    figures_and_codes_are_the_simulations("nucleo-controller", ChipRole::Controller, "ctc");
}

#[test]
fn smc_on_the_chip_is_the_simulation_bit_for_bit() {
    figures_and_codes_are_the_simulations("nucleo-controller", ChipRole::Controller, "smc");
}

#[test]
fn laws_on_a_core_without_floating_point_are_the_simulation_bit_for_bit() {
    for law in ["pd", "smc"] {
        figures_and_codes_are_the_simulations("pico-controller", ChipRole::Controller, law);
    }
    figures_and_codes_are_the_simulations(PICO_DAQ.0, PICO_DAQ.1, "smc");
}

/// Without it the flash's waits come in full, and both estimates are one.
#[test]
fn the_prefetch_of_the_flash_is_on_in_the_images_of_the_nucleo() {
    for (name, role) in [IMAGES[0], IMAGES[1]] {
        let Some(image) = image(name) else { return };
        let _beside = beside();
        let file = std::env::temp_dir().join(format!("clutch-{}-{name}.json", std::process::id()));
        let chip = ChipOptions { count: Some(file.clone()), ..ChipOptions::default() };
        let report = session(&scenario("smc", 0.2), role, chip).run(&image).expect("the chip runs");
        std::fs::remove_file(&file).expect("the counts are there");
        let counted = report.chip.counted.expect("instructions are counted");
        let mean = |key: &str| counted["period"][key]["mean"].as_f64().expect("a number");
        let (best, without) = (mean("estimated_us"), mean("estimated_us_without_prefetch"));
        assert!(0.0 < best && best < 0.8 * without, "{name}: {best} µs, {without} µs without");
        // The servo is a part of the way from the sample to the converter.
        let of = |key: &str| counted[key]["instructions"]["mean"].as_f64();
        if role == ChipRole::Controller {
            let (servo, all) = (of("servo").expect("a servo"), of("sample_to_converter").expect("a way"));
            assert!(50.0 < servo && servo < 0.5 * all, "{name}: {servo} of {all} instructions");
        }
    }
}

/// A law with memory begins with the voltage that the brake has: on a board its power-up output, in the simulation
/// what holds the shaft at rest; and so does an actuator with a lag. The same node on this machine begins as the chip
/// does.
fn commands_are_those_of_the_same_node_in_this_process(name: &str, law: &str, scenario: &Scenario) {
    let Some(image) = image(name) else { return };
    let _beside = beside();
    let chip = ChipOptions { record: true, ..ChipOptions::default() };
    let report = session(scenario, ChipRole::Controller, chip).run(&image).expect("the chip runs");
    let here = on(scenario, InProcessBoard::default(), 3000);
    assert_eq!(here.present, BOOT_CODE, "{law}: the output at the start");
    assert_eq!(report.ran.metrics, here.metrics, "{law}: the figures differ");
    let (_, theirs) = report.ran.samples_and_commands();
    let (_, ours) = here.samples_and_commands();
    let ticks = (scenario.ticks() as usize)..;
    assert!(theirs.get(ticks).is_some_and(|rest| !rest.is_empty()), "{law}: {} ticks", theirs.len());
    for (theirs, ours) in theirs.iter().zip(&ours) {
        assert_eq!(theirs, ours, "{law}: tick {}", ours.tick);
    }
}

#[test]
fn pid_on_the_chip_is_the_same_node_in_this_process_bit_for_bit() {
    commands_are_those_of_the_same_node_in_this_process("nucleo-controller", "pid", &scenario("pid", 2.0));
}

#[test]
fn super_twisting_on_the_chip_is_the_same_node_in_this_process_bit_for_bit() {
    commands_are_those_of_the_same_node_in_this_process(
        "nucleo-controller",
        "super_twisting",
        &scenario("super_twisting", 2.0),
    );
}

/// The filter behind a PWM is a lag of the actuator, and the answer takes part of a period.
#[test]
fn the_example_of_the_pico_is_the_same_node_in_this_process_bit_for_bit() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/pico_smc_2.toml");
    let text = std::fs::read_to_string(&file).expect("the example");
    // The safe output is BOOT_CODE's, as above.
    let set = ["run.duration_s=2", "safety.on_fault.hold.volts_v=4.501953125"];
    let set = set.map(|set| set.split_once('=').map(|(key, value)| (key.to_owned(), value.to_owned())));
    let set: Vec<_> = set.into_iter().flatten().collect();
    let scenario = Scenario::parse("pico_smc_2", &text, &set).expect("a scenario");
    commands_are_those_of_the_same_node_in_this_process("pico-controller", "smc", &scenario);
}

#[test]
fn a_law_on_this_machine_through_the_chip_is_the_simulation_bit_for_bit() {
    figures_and_codes_are_the_simulations("nucleo-daq", ChipRole::Daq, "smc");
}

/// The run that nucleo-alone has compiled in, and its faults.
fn without_a_host(image: &Path, faults: Vec<ChipFault>) -> (Scenario, AloneReport) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/nucleo_smc_2.toml");
    let scenario = Scenario::load(&file, &[]).expect("the example");
    let session = AloneSession::new(scenario.clone(), false, faults, None).expect("a session");
    (scenario, session.run(image).expect("the chip runs"))
}

#[test]
fn a_controller_without_a_host_is_the_simulation_bit_for_bit() {
    let Some(image) = image("nucleo-alone") else { return };
    let _beside = beside();
    let (scenario, ran) = without_a_host(&image, Vec::new());
    let simulated = simulate(&scenario);
    assert_eq!(ran.codes, simulated.trace.code);
    assert_eq!((ran.codes.len(), ran.differs(), ran.done(), ran.goes_on), (10_000, None, true, false));
    assert_eq!((ran.flashes, ran.fault(), ran.chip.resets, ran.chip.dead), (1, None, 0, false));
    let figures = Metrics { stick_time_fraction: simulated.metrics.stick_time_fraction, ..ran.metrics };
    assert_eq!(figures, simulated.metrics);
    assert!((ran.metrics.stick_time_fraction - simulated.metrics.stick_time_fraction).abs() < 1e-12);
    // 4.5 V of 10 V: the safe state of the scenario, not the code of power-up.
    assert_eq!(ran.chip.code, 1843);
}

#[test]
fn a_chip_without_a_host_that_breaks_ends_control_at_once_and_its_lamp_says_why() {
    let Some(image) = image("nucleo-alone") else { return };
    let _beside = beside();
    let broken = |kind| {
        let (_, ran) = without_a_host(&image, vec![ChipFault { kind, at: Some(0.3) }]);
        assert!(!ran.done(), "{kind:?}");
        let ticks = 300..=303;
        assert!(ticks.contains(&ran.codes.len()), "{kind:?}: control ended after {} ticks", ran.codes.len());
        assert!(ran.differs().is_none_or(|tick| tick >= 300), "{kind:?}: {:?}", ran.differs());
        ran
    };
    // The handlers are those of the other images, where each is tried.
    use ChipFaultKind::{ConverterStuck, Hang, Panic, SupplyLow, Undefined};
    for kind in [Undefined, Panic] {
        let ran = broken(kind);
        // The program begins anew as Faulted.
        assert_eq!((ran.chip.resets, ran.flashes, ran.chip.code), (1, 12, BOOT_CODE), "{kind:?}");
    }
    for kind in [SupplyLow, ConverterStuck] {
        let ran = broken(kind);
        let code = if kind == ConverterStuck { ran.codes[299] } else { 1843 };
        assert_eq!((ran.chip.resets, ran.fault(), ran.chip.code), (0, Some(Cause::Board), code), "{kind:?}");
    }
    // The lamp stays lit until the watchdog resets the chip.
    let (_, ran) = without_a_host(&image, vec![ChipFault { kind: Hang, at: Some(0.3) }]);
    assert_eq!((ran.chip.resets, ran.done(), ran.flashes, ran.chip.code), (1, false, 12, BOOT_CODE));
}

/// A scenario with other numbers than the image's, and one that is shorter.
#[test]
fn a_chip_without_a_host_that_has_another_run_is_told() {
    let Some(image) = image("nucleo-alone") else { return };
    let _beside = beside();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/nucleo_smc_2.toml");
    let run = |key: &str, value: &str| {
        let scenario = Scenario::load(&file, &[(key.to_owned(), value.to_owned())]).expect("the example");
        AloneSession::new(scenario, true, Vec::new(), None)
            .expect("a session")
            .run(&image)
            .expect("the chip runs")
    };
    let other = run("law.smc.kp_v", "2.9");
    assert!(other.done() && other.differs().is_some_and(|tick| tick < 100), "{:?}", other.differs());
    let shorter = run("run.duration_s", "3");
    assert_eq!(
        (shorter.goes_on, shorter.done(), shorter.differs(), shorter.ticks),
        (true, false, None, 3000)
    );
    let longer = run("run.duration_s", "11");
    assert_eq!((longer.goes_on, longer.done(), longer.differs(), longer.flashes), (false, false, None, 1));
}

/// A run in which something breaks on the chip; `at` s after arming, or at power-up.
fn broken(image: &Path, role: ChipRole, kind: ChipFaultKind, at: Option<f64>) -> ChipReport {
    let chip = ChipOptions { faults: vec![ChipFault { kind, at }], ..ChipOptions::default() };
    session(&scenario("smc", 0.5), role, chip).run(image).expect("the chip runs")
}

/// Ends of control and of the board: state of the supervisor, cause, state of the board.
fn ends(ran: &VirtualReport) -> (State, Cause, Option<BoardState>) {
    (ran.standing.state, ran.standing.cause, ran.board)
}

#[test]
fn a_program_that_cannot_go_on_is_reset_into_its_boot_code() {
    for (name, role) in IMAGES {
        let Some(image) = image(name) else { return };
        let _beside = beside();
        use ChipFaultKind::{Hang, Nmi, Panic, StackOverflow, Undefined, Unexpected};
        for kind in could_be(name, [Hang, Undefined, Nmi, Unexpected, StackOverflow, Panic]) {
            let what = format!("{kind:?} on {name}");
            let ChipReport { ran, chip: ChipEnd { resets, dead, floating, .. } } =
                broken(&image, role, kind, Some(0.3));
            let expected = (State::Faulted, Cause::Silence, Some(BoardState::Boot));
            assert_eq!((ends(&ran), resets), (expected, 1), "{what}");
            assert_eq!((dead, floating, ran.last_code), (false, false, BOOT_CODE), "{what}");
            // The watchdog was fed in the period before; its clock counts 80 of 32 kHz / 4, or 10 000 of 6.5 MHz / 12.
            let safe = ran.safe.expect("a safe output") - ran.hit.expect("a fault");
            let within = if pico(name) { 0.017..=0.019 } else { 0.008..=0.011 };
            assert!(within.contains(&safe), "{what}: the reset came after {safe} s");
        }
    }
}

/// A chip in the middle of a run, with a code that is not the one of power-up.
fn running(image: &Path, role: ChipRole) -> (ChipBoard, u64) {
    let chip = ChipOptions { until: Some(0.05), ..ChipOptions::default() };
    let (_, board) = session(&scenario("smc", 1.5), role, chip).run_board(image).expect("the chip runs");
    assert_ne!(board.code().0, BOOT_CODE);
    let now_ns = board.next_ns().expect("it has a next period");
    (board, now_ns)
}

#[test]
fn a_fault_handler_puts_the_boot_code_out_at_once() {
    for (name, role) in IMAGES {
        let Some(image) = image(name) else { return };
        let _beside = beside();
        // A crystal that stops is an NMI, too, by the clock security.
        use ChipFaultKind::{Crystal, Nmi, Panic, StackOverflow, Undefined, Unexpected};
        for kind in could_be(name, [Undefined, Nmi, Unexpected, Crystal, StackOverflow, Panic]) {
            let (mut board, now_ns) = running(&image, role);
            board.inject(kind);
            board.step(now_ns - 1, &mut Outbox::default()).expect("the chip runs");
            assert_eq!((board.code().0, board.resets()), (BOOT_CODE, 0), "{kind:?} on {name}");
            // The Pico's clock that has stopped calls an interrupt, and its switch falls back. A panic is no exception.
            let elsewhere = matches!(kind, Unexpected | Panic) || pico(name) && kind == Crystal;
            assert_eq!((board.in_fault(), board.floating()), (!elsewhere, pico(name)), "{kind:?} on {name}");
            // The guard ends a stack that grows without an end, before it is in the statics.
            assert_eq!(board.guarded(), kind == StackOverflow, "{kind:?} on {name}");
        }
        // One that hangs puts out what it did last, until the watchdog.
        let (mut board, now_ns) = running(&image, role);
        let last = board.code();
        board.inject(ChipFaultKind::Hang);
        board.step(now_ns - 1, &mut Outbox::default()).expect("the chip runs");
        assert_eq!((board.code(), board.dead(), board.resets()), (last, true, 0), "{name}");
    }
}

/// Words of the chip of itself, to whoever asks.
fn hello(board: &mut ChipBoard, now_ns: u64) -> Option<Hello> {
    let ask = Message::Discover(Discover { nonce: 5, version: VERSION, schema: SCHEMA });
    let mut out = Outbox::default();
    board.receive(now_ns, encode(&ask).as_bytes(), &mut out).expect("the chip runs");
    let mut decoder = Decoder::new();
    let said = out.as_bytes().iter().filter_map(|byte| decoder.push(*byte)).filter_map(Result::ok);
    said.filter_map(|message| if let Message::Hello(hello) = message { Some(hello) } else { None }).last()
}

fn started_by(board: &mut ChipBoard, now_ns: u64) -> Option<ResetCause> {
    ResetCause::from_u8(hello(board, now_ns)?.started_by)
}

#[test]
fn a_board_whose_brown_out_level_is_too_low_says_so() {
    for (name, role) in IMAGES.into_iter().filter(|(name, _)| !pico(name)) {
        let Some(image) = image(name) else { return };
        let _beside = beside();
        for (fault, warnings) in [(None, 0), (Some(ChipFaultKind::BrownOutLow), WARNING_BROWN_OUT)] {
            let faults = fault.map(|kind| ChipFault { kind, at: None }).into_iter().collect();
            let chip = ChipOptions { faults, until: Some(0.01), ..ChipOptions::default() };
            let session = session(&scenario("smc", 1.5), role, chip);
            let (_, mut board) = session.run_board(&image).expect("the chip runs");
            let now_ns = board.next_ns().expect("it has a next period");
            let hello = hello(&mut board, now_ns - 1).expect("a hello");
            assert_eq!(hello.warnings, warnings, "{name}");
        }
    }
}

#[test]
fn a_board_says_why_it_started() {
    for (name, role) in IMAGES {
        let Some(image) = image(name) else { return };
        let _beside = beside();
        let (mut board, now_ns) = running(&image, role);
        assert_eq!(started_by(&mut board, now_ns - 1), Some(ResetCause::Power), "{name}");
        use ChipFaultKind::{Crystal, Hang, Nmi, Panic, StackOverflow, Undefined, Unexpected};
        for kind in could_be(name, [Hang, Undefined, Nmi, Unexpected, StackOverflow, Panic, Crystal]) {
            let cause = match kind {
                Hang => ResetCause::Watchdog,
                Crystal => ResetCause::Clock,
                _ => ResetCause::Fault,
            };
            let (mut board, mut now_ns) = running(&image, role);
            board.inject(kind);
            while board.resets() == 0 {
                now_ns += 500_000;
                board.step(now_ns, &mut Outbox::default()).expect("the chip runs");
            }
            // A crystal that comes again, and 5 ms for the start.
            board.mend();
            let asked = (1..=20).find_map(|k| started_by(&mut board, now_ns + k * 1_000_000));
            assert_eq!(asked, Some(cause), "{kind:?} on {name}");
        }
    }
}

#[test]
fn a_converter_that_does_not_follow_ends_the_run() {
    for (name, role) in IMAGES {
        let Some(image) = image(name) else { return };
        let _beside = beside();
        let ChipReport { ran, chip: ChipEnd { resets, dead, .. } } =
            broken(&image, role, ChipFaultKind::ConverterStuck, Some(0.3));
        assert_eq!(ends(&ran), (State::Faulted, Cause::Board, Some(BoardState::Faulted)), "{name}");
        assert_eq!((resets, dead), (0, false), "{name}");
    }
}

#[test]
fn an_amplifier_that_does_not_follow_ends_the_run_where_its_voltage_is_read_back() {
    for (name, role) in IMAGES.into_iter().filter(|(name, _)| !pico(name)) {
        let wired = format!("{name}-read-back");
        let (Some(bare), Some(with)) = (image(name), image(&wired)) else { return };
        // Without a fault it is as any other.
        figures_and_codes_are_the_simulations(&wired, role, "smc");
        let _beside = beside();
        let ChipReport { ran, chip: ChipEnd { resets, .. } } =
            broken(&with, role, ChipFaultKind::Amplifier, Some(0.3));
        assert_eq!(ends(&ran), (State::Faulted, Cause::Board, Some(BoardState::Faulted)), "{name}");
        assert_eq!(resets, 0, "{name}");
        // Three voltages in a row that are off, the first of which a period later.
        let safe = ran.safe.expect("a safe output") - ran.hit.expect("a fault");
        assert!((0.003..=0.0045).contains(&safe), "{name}: the safe output came after {safe} s");
        // Elsewhere the shaft's motion shows it, later.
        let ChipReport { ran: later, .. } = broken(&bare, role, ChipFaultKind::Amplifier, Some(0.3));
        let standing = (later.standing.state, later.standing.cause);
        assert_eq!(standing, (State::Faulted, Cause::TooFast), "{name}");
        assert!(later.safe.expect("a safe output") - later.hit.expect("a fault") > 2.0 * safe, "{name}");
    }
}

#[test]
fn a_supply_that_is_too_low_for_the_converter_ends_the_run() {
    for (name, role) in IMAGES.into_iter().filter(|(name, _)| !pico(name)) {
        let Some(image) = image(name) else { return };
        let _beside = beside();
        let ChipReport { ran, chip: ChipEnd { resets, .. } } =
            broken(&image, role, ChipFaultKind::SupplyLow, Some(0.3));
        assert_eq!(ends(&ran), (State::Faulted, Cause::Board, Some(BoardState::Faulted)), "{name}");
        assert_eq!(resets, 0, "{name}");
    }
}

#[test]
fn an_encoder_whose_signals_change_both_at_once_ends_the_run() {
    for (name, role) in IMAGES.into_iter().filter(|(name, _)| pico(name)) {
        let Some(image) = image(name) else { return };
        let _beside = beside();
        let ChipReport { ran, chip: ChipEnd { resets, .. } } =
            broken(&image, role, ChipFaultKind::EncoderSkip, Some(0.3));
        assert_eq!(ends(&ran), (State::Faulted, Cause::Board, Some(BoardState::Faulted)), "{name}");
        assert_eq!(resets, 0, "{name}");
    }
}

#[test]
fn a_crystal_that_stops_leads_to_a_reset_and_then_to_what_the_wiring_holds() {
    for (name, role) in IMAGES {
        let Some(image) = image(name) else { return };
        let _beside = beside();
        let ChipReport { ran, chip: ChipEnd { resets, dead, floating, .. } } =
            broken(&image, role, ChipFaultKind::Crystal, Some(0.3));
        assert_eq!(ends(&ran), (State::Faulted, Cause::Silence, Some(BoardState::Boot)), "{name}");
        assert_eq!((resets, dead, floating), (1, true, true), "{name}");
    }
}

#[test]
fn a_crystal_that_never_starts_leaves_the_output_to_the_wiring() {
    for (name, role) in IMAGES {
        let Some(image) = image(name) else { return };
        let _beside = beside();
        let ChipReport { ran, chip: ChipEnd { resets, dead, floating, .. } } =
            broken(&image, role, ChipFaultKind::Crystal, None);
        assert_eq!(ends(&ran), (State::Disconnected, Cause::None, Some(BoardState::Boot)), "{name}");
        assert_eq!((resets, dead, floating), (0, true, true), "{name}");
    }
}

#[test]
fn an_overrun_of_the_line_costs_one_frame() {
    for (name, role) in IMAGES.into_iter().chain([PICO_DAQ]) {
        let Some(image) = image(name) else { return };
        let _beside = beside();
        let ChipReport { ran, chip: ChipEnd { resets, .. } } =
            broken(&image, role, ChipFaultKind::Overrun, Some(0.3));
        assert_eq!(ends(&ran), (State::Holding, Cause::Done, Some(BoardState::Stopped)), "{name}");
        assert_eq!((resets, ran.unanswered), (0, 0), "{name}");
    }
}
