//! Targets along a path.

use crate::memory::{clutch_result, kept, object, outcome, output};
use crate::settings::{Knots, build, clutch_misfit, clutch_run, fixed};
use clutch_core::Target;
use clutch_settings::Path;

/// The target of a shaft.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct clutch_target {
    /// Position, 2^-16 counts.
    pub position_x65536: i64,
    /// Velocity, rad/s.
    pub velocity: f32,
    /// Acceleration, rad/s^2.
    pub acceleration: f32,
}

impl clutch_target {
    pub(crate) fn of(target: &Target<f32>) -> clutch_target {
        clutch_target {
            position_x65536: target.position.0,
            velocity: target.velocity,
            acceleration: target.acceleration,
        }
    }

    pub(crate) fn target(&self) -> Target<f32> {
        Target {
            position: fixed(self.position_x65536),
            velocity: self.velocity,
            acceleration: self.acceleration,
        }
    }
}

/// A path and its points.
#[derive(Clone, Copy)]
pub(crate) struct Planned {
    pub(crate) path: Path,
    pub(crate) knots: Knots,
}

impl Planned {
    pub(crate) fn at(&self, tick: u64) -> Target<f32> {
        self.path.target(self.knots.get(), tick)
    }
}

/// Memory of a path.
#[repr(C)]
pub struct clutch_path {
    opaque: [u64; 64],
}

kept!(clutch_path, Planned, b"cl_path ");

/// Builds the path of a run. The points of a table are borrowed: they stay where they are.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_path_build(
    path: *mut clutch_path,
    run: *const clutch_run,
    misfit: *mut clutch_misfit,
) -> clutch_result {
    // SAFETY: the caller's promise.
    unsafe { build(path, run, misfit, |built, knots| Ok(Planned { path: built.path, knots })) }
}

/// The target at a tick. The path begins within the count 0: add the counts of your start, times 65536, to its position.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_path_at(
    path: *mut clutch_path,
    tick: u64,
    target: *mut clutch_target,
) -> clutch_result {
    outcome(|| {
        // SAFETY: the caller's promise.
        let planned = unsafe { object::<Planned>(path)? };
        // SAFETY: the caller's promise.
        unsafe { output(target, clutch_target::of(&planned.at(tick))) }
    })
}
