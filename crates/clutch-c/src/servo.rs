//! The servo by itself: counts and target in, code for the converter out. No check, no safe state.

use crate::law::{clutch_command, clutch_tick};
use crate::memory::{clutch_result, input, kept, object, outcome, output, room};
use crate::path::clutch_target;
use crate::settings::{build, clutch_misfit, clutch_run};
use clutch_core::law::{LawState, LawTerms};
use clutch_core::{Counts, Dac, Servo, ServoOutput, ServoState};

/// The output of a period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct clutch_output {
    /// The law's input.
    pub tick: clutch_tick,
    /// The law's answer.
    pub command: clutch_command,
    /// Voltage that the code stands for, V.
    pub voltage: f32,
    /// Code for the converter.
    pub code: u16,
}

impl clutch_output {
    pub(crate) fn of(output: &ServoOutput<f32, LawTerms<f32>>, dac: &Dac<f32>) -> clutch_output {
        clutch_output {
            tick: clutch_tick::of(&output.tick),
            command: clutch_command::of(&output.command),
            voltage: dac.volts(output.code),
            code: output.code.0,
        }
    }
}

/// A servo and its state.
pub(crate) struct Kept {
    servo: Servo<f32>,
    /// None until it has been started.
    state: Option<ServoState<f32, LawState<f32>>>,
}

/// Memory of a servo.
#[repr(C)]
pub struct clutch_servo {
    opaque: [u64; 224],
}

kept!(clutch_servo, Kept, b"cl_servo");

/// Builds the servo of a run.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_servo_build(
    servo: *mut clutch_servo,
    run: *const clutch_run,
    misfit: *mut clutch_misfit,
) -> clutch_result {
    // SAFETY: the caller's promise.
    unsafe { build(servo, run, misfit, |built, _| Ok(Kept { servo: built.servo, state: None })) }
}

/// Starts it at `counts`, with `applied` volts at the converter and a shaft that moves with the target.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_servo_start(
    servo: *mut clutch_servo,
    counts: i32,
    target: *const clutch_target,
    applied: f32,
) -> clutch_result {
    outcome(|| {
        // SAFETY: the caller's promise.
        let (kept, target) = unsafe { (object::<Kept>(servo)?, input(target)?) };
        kept.state = Some(kept.servo.start(Counts(counts), &target.target(), applied));
        Ok(())
    })
}

/// One period. `CLUTCH_WRONG_STATE` before the start.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_servo_tick(
    servo: *mut clutch_servo,
    counts: i32,
    target: *const clutch_target,
    out: *mut clutch_output,
) -> clutch_result {
    outcome(|| {
        room(out)?;
        // SAFETY: the caller's promise.
        let (kept, target) = unsafe { (object::<Kept>(servo)?, input(target)?) };
        let state = kept.state.as_mut().ok_or(clutch_result::CLUTCH_WRONG_STATE)?;
        let ticked = kept.servo.tick(state, Counts(counts), &target.target());
        // SAFETY: the caller's promise.
        unsafe { output(out, clutch_output::of(&ticked, kept.servo.dac())) }
    })
}
