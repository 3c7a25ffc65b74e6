//! The law by itself: errors in, voltage out.

use crate::memory::{clutch_result, input, kept, object, outcome, output, room};
use crate::settings::{build, clutch_misfit, clutch_run};
use clutch_core::law::{Command, ControlLaw, Law, LawState, LawTerms, MAX_TERMS, Terms, Tick};

/// The input of a law in each period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct clutch_tick {
    /// Target minus position, rad.
    pub error: f32,
    /// Its rate, rad/s.
    pub error_rate: f32,
    /// Velocity of the target, rad/s.
    pub target_velocity: f32,
    /// Acceleration of the target, rad/s^2.
    pub target_acceleration: f32,
}

impl clutch_tick {
    pub(crate) fn of(tick: &Tick<f32>) -> clutch_tick {
        clutch_tick {
            error: tick.error,
            error_rate: tick.error_rate,
            target_velocity: tick.target_velocity,
            target_acceleration: tick.target_acceleration,
        }
    }

    fn tick(&self) -> Tick<f32> {
        Tick {
            error: self.error,
            error_rate: self.error_rate,
            target_velocity: self.target_velocity,
            target_acceleration: self.target_acceleration,
        }
    }
}

/// The most terms that a law has.
pub const CLUTCH_MAX_TERMS: usize = 8;
const _: () = assert!(CLUTCH_MAX_TERMS == MAX_TERMS);

/// The answer of a law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct clutch_command {
    /// Voltage within the limits, V.
    pub voltage: f32,
    /// The limit that decided it: 0 none, the law did, 1 the lowest voltage, 2 the highest, 3 an invalid demand.
    pub limit: u8,
    /// Number of its terms.
    pub terms_count: u8,
    /// Its terms, for a log.
    pub terms: [f32; CLUTCH_MAX_TERMS],
}

impl clutch_command {
    pub(crate) fn of(command: &Command<f32, LawTerms<f32>>) -> clutch_command {
        let (values, mut terms) = (command.terms.values(), [0.0; CLUTCH_MAX_TERMS]);
        terms.iter_mut().zip(values).for_each(|(term, value)| *term = *value);
        clutch_command {
            voltage: command.voltage,
            limit: command.limit as u8,
            terms_count: values.len() as u8,
            terms,
        }
    }
}

/// A law and its state.
pub(crate) struct Kept {
    law: Law<f32>,
    state: LawState<f32>,
}

/// Memory of a law.
#[repr(C)]
pub struct clutch_law {
    opaque: [u64; 160],
}

kept!(clutch_law, Kept, b"cl_law  ");

/// Builds the law of a run, at rest.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_law_build(
    law: *mut clutch_law,
    run: *const clutch_run,
    misfit: *mut clutch_misfit,
) -> clutch_result {
    // SAFETY: the caller's promise.
    unsafe {
        build(law, run, misfit, |built, _| {
            let own = *built.servo.law();
            Ok(Kept { state: own.start(&Tick::default(), 0.0), law: own })
        })
    }
}

/// Starts it while the converter is at `applied` volts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_law_start(
    law: *mut clutch_law,
    tick: *const clutch_tick,
    applied: f32,
) -> clutch_result {
    outcome(|| {
        // SAFETY: the caller's promise.
        let (kept, tick) = unsafe { (object::<Kept>(law)?, input(tick)?) };
        kept.state = kept.law.start(&tick.tick(), applied);
        Ok(())
    })
}

/// One period. The law `glide` learns from the encoder's edges, which only a servo shows it: by itself it answers with its
/// belief.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_law_update(
    law: *mut clutch_law,
    tick: *const clutch_tick,
    command: *mut clutch_command,
) -> clutch_result {
    outcome(|| {
        room(command)?;
        // SAFETY: the caller's promise.
        let (kept, tick) = unsafe { (object::<Kept>(law)?, input(tick)?) };
        let answer = kept.law.update(&mut kept.state, &tick.tick());
        // SAFETY: the caller's promise.
        unsafe { output(command, clutch_command::of(&answer)) }
    })
}
