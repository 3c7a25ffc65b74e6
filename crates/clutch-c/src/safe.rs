//! The safe state, code by code: for a watchdog that has to go there without an axis.

use crate::memory::{clutch_result, input, kept, object, outcome, output, put, room};
use clutch_core::{DacCode, SafeCodes, SafeKind, SafeRun};

/// A safe state in the converter's codes. `clutch_axis_safe` gives that of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct clutch_safe_codes {
    /// One of `CLUTCH_SAFE_*`.
    pub kind: u8,
    /// Code that holds.
    pub hold: u16,
    /// Code that lets go.
    pub release: u16,
    /// Step of a ramp, 2^-16 codes per period.
    pub ramp_step: u32,
    /// Periods of holding before letting go.
    pub hold_periods: u32,
}

/// Holds at once.
pub const CLUTCH_SAFE_HOLD: u8 = 0;
/// Goes to holding at a rate.
pub const CLUTCH_SAFE_RAMP: u8 = 1;
/// Lets go at once.
pub const CLUTCH_SAFE_RELEASE: u8 = 2;
/// Holds, then lets go.
pub const CLUTCH_SAFE_HOLD_THEN_RELEASE: u8 = 3;

impl clutch_safe_codes {
    pub(crate) fn of(codes: &SafeCodes) -> clutch_safe_codes {
        let kind = match codes.kind {
            SafeKind::Hold => CLUTCH_SAFE_HOLD,
            SafeKind::Ramp => CLUTCH_SAFE_RAMP,
            SafeKind::Release => CLUTCH_SAFE_RELEASE,
            SafeKind::HoldThenRelease => CLUTCH_SAFE_HOLD_THEN_RELEASE,
        };
        let SafeCodes { hold, release, ramp_step, hold_periods, .. } = *codes;
        clutch_safe_codes { kind, hold: hold.0, release: release.0, ramp_step, hold_periods }
    }

    /// A kind that is none holds: the brake's side that is safe under a load.
    fn codes(&self) -> SafeCodes {
        SafeCodes {
            kind: match self.kind {
                CLUTCH_SAFE_RAMP => SafeKind::Ramp,
                CLUTCH_SAFE_RELEASE => SafeKind::Release,
                CLUTCH_SAFE_HOLD_THEN_RELEASE => SafeKind::HoldThenRelease,
                _ => SafeKind::Hold,
            },
            hold: DacCode(self.hold),
            release: DacCode(self.release),
            ramp_step: self.ramp_step,
            hold_periods: self.hold_periods,
        }
    }
}

/// Memory of a safe state under way.
#[repr(C)]
pub struct clutch_safe_run {
    opaque: [u64; 4],
}

kept!(clutch_safe_run, SafeRun, b"cl_safe ");

/// Begins at the code that the converter has now.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_safe_begin(run: *mut clutch_safe_run, present: u16) -> clutch_result {
    outcome(|| {
        room(run)?;
        // SAFETY: there is room for it.
        unsafe { put(run, SafeRun::begin(DacCode(present))) };
        Ok(())
    })
}

/// The code of the next period; the first one is the safe state's own already.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_safe_next(
    run: *mut clutch_safe_run,
    codes: *const clutch_safe_codes,
    code: *mut u16,
) -> clutch_result {
    outcome(|| {
        room(code)?;
        // SAFETY: the caller's promise.
        let (run, codes) = unsafe { (object::<SafeRun>(run)?, input(codes)?) };
        // SAFETY: the caller's promise.
        unsafe { output(code, run.next(&codes.codes()).0) }
    })
}
