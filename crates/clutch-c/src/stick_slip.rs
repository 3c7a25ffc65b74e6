//! Sticks that the encoder shows.

use crate::memory::{clutch_result, kept, object, outcome, output, room};
use crate::settings::{build, clutch_misfit, clutch_run};
use clutch_core::{Counts, StickSlip, StickSlipParams, StickSlipState};

/// Sticks that the encoder has shown so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct clutch_sticks {
    /// True while the shaft seems to stick.
    pub stuck: bool,
    /// Largest step after a stick, counts.
    pub stair: u32,
    /// Stick-slip cycles.
    pub cycles: u64,
    /// Ticks stuck.
    pub stuck_ticks: u64,
}

/// A detector and its state.
pub(crate) struct Kept {
    detector: StickSlip<f32>,
    state: StickSlipState<f32>,
}

/// Memory of a detector of stick-slip.
#[repr(C)]
pub struct clutch_stick_slip {
    opaque: [u64; 16],
}

kept!(clutch_stick_slip, Kept, b"cl_stick");

/// Builds a detector for the encoder and the period of a run.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_stick_slip_build(
    detector: *mut clutch_stick_slip,
    run: *const clutch_run,
    misfit: *mut clutch_misfit,
) -> clutch_result {
    // SAFETY: the caller's promise.
    unsafe {
        build(detector, run, misfit, |built, _| {
            let (encoder, period) = (built.servo.encoder(), built.servo.period());
            let own = StickSlip::new(&StickSlipParams::default(), encoder, period)?;
            Ok(Kept { detector: own, state: StickSlipState::default() })
        })
    }
}

/// One period: the counts, and the velocity of the target (rad/s).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_stick_slip_update(
    detector: *mut clutch_stick_slip,
    counts: i32,
    target_velocity: f32,
    sticks: *mut clutch_sticks,
) -> clutch_result {
    outcome(|| {
        room(sticks)?;
        // SAFETY: the caller's promise.
        let kept = unsafe { object::<Kept>(detector)? };
        kept.detector.update(&mut kept.state, Counts(counts), target_velocity);
        let s = &kept.state;
        let seen = clutch_sticks {
            stuck: s.stuck(),
            stair: s.stair(),
            cycles: s.cycles(),
            stuck_ticks: s.stuck_ticks(),
        };
        // SAFETY: the caller's promise.
        unsafe { output(sticks, seen) }
    })
}
