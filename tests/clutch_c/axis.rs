//! An axis of libclutch, sample by sample, against the simulation that gave the counts.

use clutch::*;
use clutch_core::Micros;
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_settings::Settings;
use clutch_sim::run::{Keep, Trace, simulate_watched};
use clutch_sim::{Scenario, progress::UNWATCHED};
use std::mem::MaybeUninit;
use std::path::Path;
use std::ptr::null;

/// A scenario of a brake in single precision, its settings as C has them, and its simulation.
pub(super) fn scenario(set: &[(&str, &str)]) -> (Vec<clutch_setting>, Trace) {
    built_in("board_smc_2", set)
}

fn built_in(name: &str, set: &[(&str, &str)]) -> (Vec<clutch_setting>, Trace) {
    let mut set: Vec<(String, String)> =
        set.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    set.push(("sampling.scalar".to_owned(), "f32".to_owned()));
    if cfg!(miri) {
        // Short, where each step is interpreted.
        set.extend(
            [("run.duration_s", "0.2"), ("run.settle_s", "0")].map(|(k, v)| (k.to_owned(), v.to_owned())),
        );
    }
    let scenario = Scenario::load(Path::new(name), &set).unwrap();
    let run = BuiltRun::new(&scenario, 0).unwrap();
    let settings = from_scenario::settings(&scenario, &run, Micros(0), run.ticks).unwrap();
    (list(&settings), simulate_watched::<f32>(&scenario.spec(), Keep::Trace, UNWATCHED).unwrap().trace)
}

fn list(settings: &Settings) -> Vec<clutch_setting> {
    let mut list = Vec::new();
    settings.each(|key, value| list.push(clutch_setting { key, value }));
    list
}

/// A run on a ramp, as C has it.
pub(super) fn run(settings: &[clutch_setting]) -> clutch_run {
    clutch_run { settings: settings.as_ptr(), settings_count: settings.len(), knots: null(), knots_count: 0 }
}

/// Builds an axis.
pub(super) fn build(
    axis: &mut MaybeUninit<clutch_axis>,
    settings: &[clutch_setting],
) -> (clutch_result, clutch_misfit) {
    let (run, mut misfit) = (run(settings), MaybeUninit::uninit());
    // SAFETY: the memory is there for the time of the call.
    unsafe {
        let result = clutch_axis_build(axis.as_mut_ptr(), &raw const run, misfit.as_mut_ptr());
        (result, misfit.assume_init())
    }
}

/// One sample of a board that drives.
pub(super) fn sample(axis: &mut MaybeUninit<clutch_axis>, period: u32, counts: i32) -> clutch_cycle {
    let sample = clutch_sample {
        sequence: period as u16,
        board: CLUTCH_BOARD_DRIVING,
        encoder_fault: 0,
        converter_fault: 0,
        command_late: 0,
        superseded: 0,
        time_us: period.wrapping_mul(1000),
        counts,
        lateness_us: 0,
    };
    let mut cycle = MaybeUninit::uninit();
    // SAFETY: the memory is there for the time of the call.
    unsafe {
        assert_eq!(
            clutch_axis_sample(axis.as_mut_ptr(), &raw const sample, cycle.as_mut_ptr()),
            clutch_result::CLUTCH_OK
        );
        cycle.assume_init()
    }
}

pub(super) fn state(axis: &mut MaybeUninit<clutch_axis>) -> (u8, u8, u16) {
    let (mut state, mut cause, mut code) = (0, 0, 0);
    // SAFETY: the memory is there for the time of the call.
    let told = unsafe { clutch_axis_state(axis.as_mut_ptr(), &raw mut state, &raw mut cause, &raw mut code) };
    assert_eq!(told, clutch_result::CLUTCH_OK);
    (state, cause, code)
}

const RUNNING: u8 = 3;
const HOLDING: u8 = 4;
const RELEASED: u8 = 5;
const FAULTED: u8 = 6;
const DONE: u8 = 15;

#[test]
fn an_axis_answers_as_the_simulation_did_and_ends_in_its_safe_state() {
    let (settings, trace) = scenario(&[]);
    let mut axis = MaybeUninit::uninit();
    assert_eq!(build(&mut axis, &settings).0, clutch_result::CLUTCH_OK);
    // SAFETY: it has been built.
    assert_eq!(unsafe { clutch_axis_consent(axis.as_mut_ptr(), 2970) }, clutch_result::CLUTCH_OK);
    let last = trace.counts.len() - 1;
    for (tick, counts) in trace.counts.iter().enumerate() {
        let cycle = sample(&mut axis, tick as u32, *counts);
        assert_eq!((cycle.tick, cycle.state, cycle.answered), (tick as u64, RUNNING, 1), "tick {tick}");
        assert_eq!(cycle.code, trace.code[tick], "tick {tick}");
        assert_eq!(f64::from(cycle.output.tick.error), trace.measured_error[tick], "tick {tick}");
        if tick < last {
            assert_eq!(state(&mut axis), (RUNNING, 0, cycle.code));
        }
    }
    // 4.5 V of ±10 V in 12 bit.
    let held = 2970;
    assert_eq!(state(&mut axis), (HOLDING, DONE, held));
    let after = sample(&mut axis, last as u32 + 1, trace.counts[last]);
    assert_eq!((after.answered, after.state, after.code), (0, HOLDING, held));
}

/// To and fro, with voltages of both signs; its safe state is 0 V, the middle code.
#[test]
fn a_motor_axis_answers_as_the_simulation_did_and_is_released() {
    let (settings, trace) = built_in("motor_pid", &[]);
    let released = 2048;
    let mut axis = MaybeUninit::uninit();
    assert_eq!(build(&mut axis, &settings).0, clutch_result::CLUTCH_OK);
    // SAFETY: it has been built.
    assert_eq!(unsafe { clutch_axis_consent(axis.as_mut_ptr(), released) }, clutch_result::CLUTCH_OK);
    for (tick, counts) in trace.counts.iter().enumerate() {
        let cycle = sample(&mut axis, tick as u32, *counts);
        assert_eq!((cycle.state, cycle.answered, cycle.code), (RUNNING, 1, trace.code[tick]), "tick {tick}");
    }
    if !cfg!(miri) {
        let (least, most) = (trace.code.iter().min().unwrap(), trace.code.iter().max().unwrap());
        assert!(*least < released && *most > released, "{least} to {most}");
    }
    assert_eq!(state(&mut axis), (RELEASED, DONE, released));
}

#[test]
fn a_shaft_that_jumps_and_a_silence_end_in_the_safe_state() {
    let (settings, trace) = scenario(&[]);
    for silent in [false, true] {
        let mut axis = MaybeUninit::uninit();
        build(&mut axis, &settings);
        // SAFETY: it has been built.
        unsafe { clutch_axis_consent(axis.as_mut_ptr(), 2970) };
        for tick in 0..100 {
            sample(&mut axis, tick, trace.counts[tick as usize]);
        }
        if silent {
            // SAFETY: it has been built.
            unsafe { clutch_axis_silence(axis.as_mut_ptr(), 3) };
        } else {
            for tick in 100..110 {
                sample(&mut axis, tick, trace.counts[99] + 5000 * (tick as i32 - 99));
            }
        }
        let (now, cause, code) = state(&mut axis);
        assert_eq!((now, code), (FAULTED, 2970));
        // Jump, silence.
        assert_eq!(cause, if silent { 11 } else { 5 });
        let mut volts = 0.0;
        // SAFETY: it has been built.
        unsafe { clutch_axis_volts(axis.as_mut_ptr(), code, &raw mut volts) };
        assert!((volts - 4.5).abs() < 0.005, "{volts} V");
        // Without an acknowledgement there is no new consent.
        // SAFETY: it has been built.
        unsafe {
            assert_eq!(clutch_axis_consent(axis.as_mut_ptr(), code), clutch_result::CLUTCH_WRONG_STATE);
            assert_eq!(clutch_axis_acknowledge(axis.as_mut_ptr()), clutch_result::CLUTCH_OK);
            assert_eq!(clutch_axis_acknowledge(axis.as_mut_ptr()), clutch_result::CLUTCH_WRONG_STATE);
            assert_eq!(clutch_axis_consent(axis.as_mut_ptr(), code), clutch_result::CLUTCH_OK);
        }
    }
}

#[test]
fn a_safe_state_that_is_a_ramp_reaches_its_voltage_with_samples_and_without() {
    let ramp = ("safety.on_fault", "{ramp={rate_v_s=20.0,volts_v=4.5}}");
    let (settings, trace) = scenario(&[ramp]);
    for with_samples in [true, false] {
        let mut axis = MaybeUninit::uninit();
        assert_eq!(build(&mut axis, &settings).0, clutch_result::CLUTCH_OK);
        // SAFETY: it has been built.
        unsafe { clutch_axis_consent(axis.as_mut_ptr(), 2970) };
        for tick in 0..100 {
            sample(&mut axis, tick, trace.counts[tick as usize]);
        }
        // SAFETY: it has been built.
        unsafe { clutch_axis_stop(axis.as_mut_ptr()) };
        let (_, _, first) = state(&mut axis);
        // 20 V/s are 0.02 V or 4.1 codes a period.
        for period in 100..400 {
            if with_samples {
                assert_eq!(sample(&mut axis, period, trace.counts[99]).answered, 0);
            } else {
                // SAFETY: it has been built.
                unsafe { clutch_axis_silence(axis.as_mut_ptr(), period - 99) };
            }
        }
        let (now, cause, code) = state(&mut axis);
        assert_eq!((now, cause, code), (HOLDING, 14, 2970), "from {first}");
        assert!(first < 2900, "the ramp began at {first}");
    }
}

#[test]
fn a_sample_without_a_place_for_its_answer_changes_nothing() {
    let (settings, _) = scenario(&[]);
    let mut axis = MaybeUninit::uninit();
    build(&mut axis, &settings);
    // SAFETY: it has been built; the pointer that is none is what is tested.
    unsafe {
        clutch_axis_consent(axis.as_mut_ptr(), 2970);
        let before = state(&mut axis);
        let sample: clutch_sample = std::mem::zeroed();
        let told = clutch_axis_sample(axis.as_mut_ptr(), &raw const sample, std::ptr::null_mut());
        assert_eq!(told, clutch_result::CLUTCH_BAD_POINTER);
        assert_eq!(state(&mut axis), before);
    }
}
