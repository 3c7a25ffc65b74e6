//! The same bits on every machine: more than a million ticks here and in two emulators. The wheel repeats them in
//! `python/tests/test_bits.py`.

mod machine;

use clutch_bits::{Job, Kind, RECORD};
use clutch_core::law::LawParams;
use clutch_core::params::Choice;
use clutch_core::reference::ReferenceParams;
use clutch_tests::bits::{Run, fields, first_difference, table, value};
use machine::Machine;
use std::sync::LazyLock;

/// The runs, simulated once for all tests.
static ALL: LazyLock<Vec<Run>> = LazyLock::new(|| Run::all().expect("the scenarios are right"));

#[test]
fn more_than_a_million_ticks_have_every_law_and_path_and_no_number_that_is_none() {
    let ticks: u32 = ALL.iter().map(|run| run.job.ticks).sum();
    assert_eq!(ticks, 1_650_000);
    let laws: Vec<usize> = ALL.iter().map(|run| Choice::<f64>::chosen(&run.law)).collect();
    let paths: Vec<usize> = ALL.iter().map(|run| run.path).collect();
    let kinds = <LawParams as Choice<f64>>::CHOICE.options.len();
    assert!((0..kinds).all(|law| laws.contains(&law)), "laws {laws:?}");
    // All that move.
    let kinds = <ReferenceParams<'_> as Choice<f64>>::CHOICE.options.len();
    assert!((1..kinds).all(|path| paths.contains(&path)), "paths {paths:?}");
    for run in ALL.iter() {
        for (tick, record) in run.records.chunks_exact(RECORD).enumerate() {
            for (field, _, bytes) in fields(record).filter(|(_, kind, _)| *kind == Kind::F32) {
                let real = f32::from_le_bytes(bytes.try_into().unwrap());
                assert!(real.is_finite(), "{}, tick {tick}: {field} is {real}", run.name);
            }
        }
    }
}

#[test]
fn every_run_of_pd_and_ctc_on_a_brake_sticks_and_slips() {
    let brakes = |run: &&Run| !run.name.starts_with("motor") && !run.name.starts_with("both");
    for run in ALL.iter().filter(|run| matches!(run.law, LawParams::Pd(_) | LawParams::Ctc(_))).filter(brakes)
    {
        let (cycles, seconds) = (run.cycles(), u64::from(run.job.ticks) / 1000);
        assert!(cycles >= 2 * seconds, "{}: {cycles} stick-slip cycles in {seconds} s", run.name);
    }
}

#[test]
fn the_counts_given_back_to_the_law_give_the_simulations_outputs() {
    for run in ALL.iter() {
        let (trace, name) = (&run.trace, run.name);
        for (tick, record) in run.records.chunks_exact(RECORD).enumerate() {
            let simulated = [
                ("target_counts_x65536", trace.target_fixed[tick].0 as f64),
                ("target_velocity", trace.target_velocity[tick]),
                ("target_acceleration", trace.target_acceleration[tick]),
                ("error", trace.measured_error[tick]),
                ("error_rate", trace.error_rate[tick]),
                ("demand", trace.demand[tick]),
                ("voltage", trace.voltage[tick]),
                ("code", trace.code[tick].into()),
                ("limit", f64::from(trace.limit[tick] as u8)),
            ];
            for (i, (_, values)) in trace.terms.iter().enumerate() {
                assert_eq!(
                    value(record, &format!("term_{i}")),
                    Some(values[tick]),
                    "{name}, tick {tick}, term {i}"
                );
            }
            for (field, simulated) in simulated {
                assert_eq!(value(record, field), Some(simulated), "{name}, tick {tick}, {field}");
            }
        }
    }
}

#[test]
fn the_hashes_are_those_of_the_page() {
    let page = include_str!("../../docs/bits.md");
    let block = page.split("<!-- bits:begin -->").nth(1).and_then(|p| p.split("<!-- bits:end -->").next());
    let block = block.expect("the markers of the table in docs/bits.md").trim();
    assert_eq!(
        block,
        table(&ALL).trim(),
        "docs/bits.md has another table: `cargo run --release -p clutch-tests --example bits -- FOLDER` prints it"
    );
}

#[test]
fn the_emulated_board_gives_the_same_bits() {
    let Some(board) = machine::board() else { return };
    assert_same(&board);
}

#[test]
fn an_emulated_processor_of_64_bit_gives_the_same_bits() {
    let Some(arm64) = machine::arm64() else { return };
    assert_same(&arm64);
}

fn assert_same(machine: &Machine) {
    let inputs: Vec<u8> = ALL.iter().flat_map(|run| run.input(run.job)).collect();
    let (hashes, _) = machine.run("same", &inputs);
    assert_eq!(hashes.len(), ALL.len(), "{hashes:08x?}");
    let wrong: Vec<String> = ALL
        .iter()
        .zip(hashes)
        .filter(|(run, hash)| run.hash != *hash)
        .map(|(run, _)| format!("{}: {}", run.name, told(machine, run, run.job)))
        .collect();
    assert!(wrong.is_empty(), "{} differs:\n{}", machine.name, wrong.join("\n"));
}

#[test]
fn one_bit_that_a_machine_spoils_is_found_and_named() {
    for machine in [machine::board(), machine::arm64()].iter().flatten() {
        assert_found(machine);
    }
}

fn assert_found(machine: &Machine) {
    let run = ALL.iter().find(|run| run.name == "pd_table_cubic").unwrap();
    let spoiled = Job { spoil: Some((31_415, lowest_bit("error_rate"))), ..run.job };
    let (hashes, _) = machine.run("spoiled", &run.input(spoiled));
    assert_ne!(hashes, [run.hash]);
    let told = told(machine, run, spoiled);
    assert!(told.starts_with("tick 31415, error_rate: "), "{told}");
    let first = Job { spoil: Some((0, lowest_bit("target_counts_x65536"))), ..run.job };
    let told = self::told(machine, run, first);
    assert!(told.starts_with("tick 0, target_counts_x65536: "), "{told}");
}

/// The first bit of a field within a record.
fn lowest_bit(name: &str) -> u32 {
    let before = clutch_bits::FIELDS.iter().take_while(|field| field.name != name);
    before.map(|field| 8 * field.kind.size() as u32).sum()
}

/// Runs once more with every record written, and reports the first that differs.
fn told(machine: &Machine, run: &Run, job: Job) -> String {
    let (_, theirs) = machine.run(&format!("told-{}", run.name), &run.input(Job { dump: true, ..job }));
    match first_difference(&run.records, &theirs) {
        Some(difference) => difference.to_string(),
        None => "the hash differs, and no record does".to_owned(),
    }
}
