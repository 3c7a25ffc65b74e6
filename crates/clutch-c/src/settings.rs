//! A run as numbers, and what is wrong with them.

use crate::memory::{Kept, clutch_result, input, list, outcome, output, put, room};
use core::mem::offset_of;

use clutch_core::reference::Knot;
use clutch_core::{FixedCounts, ParamError};
use clutch_settings::{Built, MAX_KNOTS, Misfit, SETTINGS_HASH};

/// A number of a run, under its key. `clutch scenario header FILE` prints those of a scenario, in order of their keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct clutch_setting {
    /// One of `CLUTCH_KEY_*`.
    pub key: u16,
    /// A whole number, a switch (0 or 1), the place of a choice from 0, or the bits of a single-precision number in SI units.
    pub value: u64,
}

/// A point of a path that is a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct clutch_knot {
    /// Time since the start, us.
    pub time_us: u64,
    /// Position, 2^-16 counts.
    pub position_x65536: i64,
}

/// The reason why settings make no run.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct clutch_misfit {
    /// One of `CLUTCH_MISFIT_*`.
    pub kind: u8,
    /// The number, from 1, of the relation with other settings that does not hold; 0 for the number's own range.
    pub relation: u8,
    /// The key of the setting; from 4096 on that of a number of a table's points, two each; 65535 if it is no setting.
    pub key: u16,
    /// Its value, SI; 0 for a setting that is missing or unknown.
    pub value: f32,
}

/// The kind of a misfit: none.
pub const CLUTCH_MISFIT_NONE: u8 = 0;
/// A setting that is not in the list.
pub const CLUTCH_MISFIT_MISSING: u8 = 1;
/// A choice that is not known, or a number that the setting's type does not hold.
pub const CLUTCH_MISFIT_UNKNOWN: u8 = 2;
/// A number out of range.
pub const CLUTCH_MISFIT_UNFIT: u8 = 3;
/// Keys that do not ascend: two of one key, or a list out of order.
pub const CLUTCH_MISFIT_ORDER: u8 = 4;

/// The most points that a table may have.
pub const CLUTCH_MAX_KNOTS: usize = 256;
const _: () = assert!(CLUTCH_MAX_KNOTS == MAX_KNOTS);

impl clutch_misfit {
    const NONE: clutch_misfit =
        clutch_misfit { kind: CLUTCH_MISFIT_NONE, relation: 0, key: u16::MAX, value: 0.0 };

    fn of(misfit: Misfit) -> clutch_misfit {
        match misfit {
            Misfit::Missing(key) => clutch_misfit { kind: CLUTCH_MISFIT_MISSING, key, ..clutch_misfit::NONE },
            Misfit::Unknown(key) => clutch_misfit { kind: CLUTCH_MISFIT_UNKNOWN, key, ..clutch_misfit::NONE },
            Misfit::Unfit { key, relation, value } => {
                clutch_misfit { kind: CLUTCH_MISFIT_UNFIT, key, relation, value }
            }
        }
    }
}

/// Points of a path: borrowed from the caller, who keeps them where they are.
#[derive(Clone, Copy)]
pub(crate) struct Knots {
    first: *const clutch_knot,
    count: usize,
}

impl Knots {
    /// The points. A point has the layout of the core's.
    pub(crate) fn get(&self) -> &[Knot] {
        const {
            assert!(size_of::<Knot>() == size_of::<clutch_knot>());
            assert!(align_of::<Knot>() == align_of::<clutch_knot>());
            assert!(offset_of!(Knot, position) == offset_of!(clutch_knot, position_x65536));
        }
        if self.count == 0 {
            return &[];
        }
        // SAFETY: checked when the object was built, and the caller's promise since.
        unsafe { core::slice::from_raw_parts(self.first.cast::<Knot>(), self.count) }
    }
}

/// A run: its settings, in order of their keys, and the points of its path if that is a table.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct clutch_run {
    /// Its settings.
    pub settings: *const clutch_setting,
    /// Number of its settings.
    pub settings_count: usize,
    /// Points of its path; null if there are none.
    pub knots: *const clutch_knot,
    /// Number of these points.
    pub knots_count: usize,
}

/// Builds an object of a run into its memory. `misfit` may be null.
pub(crate) unsafe fn build<T: Kept>(
    memory: *mut T::Memory,
    run: *const clutch_run,
    misfit: *mut clutch_misfit,
    make: impl FnOnce(Built, Knots) -> Result<T, ParamError<f32>>,
) -> clutch_result {
    outcome(|| {
        room(memory)?;
        if !misfit.is_null() {
            room(misfit)?;
        }
        // SAFETY: the caller's promise.
        let made = unsafe { made(input(run)?, make)? };
        let why = made.as_ref().err().copied().unwrap_or(clutch_misfit::NONE);
        if !misfit.is_null() {
            // SAFETY: the caller's promise.
            unsafe { output(misfit, why)? };
        }
        // SAFETY: there is room for it.
        made.map(|object| unsafe { put(memory, object) }).map_err(|_| clutch_result::CLUTCH_MISFIT)
    })
}

unsafe fn made<T>(
    run: &clutch_run,
    make: impl FnOnce(Built, Knots) -> Result<T, ParamError<f32>>,
) -> Result<Result<T, clutch_misfit>, clutch_result> {
    // SAFETY: the caller's promise.
    let (settings, _) =
        unsafe { (list(run.settings, run.settings_count)?, list(run.knots, run.knots_count)?) };
    let knots = Knots { first: run.knots, count: run.knots_count };
    let mut pairs = settings.iter().zip(settings.iter().skip(1));
    if let Some((_, twice)) = pairs.find(|(a, b)| a.key >= b.key) {
        let (kind, key) = (CLUTCH_MISFIT_ORDER, twice.key);
        return Ok(Err(clutch_misfit { kind, key, ..clutch_misfit::NONE }));
    }
    let number = |key| {
        let at = settings.binary_search_by_key(&key, |setting| setting.key).ok()?;
        settings.get(at).map(|setting| setting.value)
    };
    // A value that is no setting has no key.
    let unfit = |e: ParamError<f32>| Misfit::Unfit { key: u16::MAX, relation: e.relation, value: e.value };
    Ok(Built::new(number, knots.get())
        .and_then(|built| make(built, knots).map_err(unfit))
        .map_err(clutch_misfit::of))
}

/// The hash of all keys with their types and units: equal to `CLUTCH_SETTINGS_HASH` of the header with which a list of settings
/// was compiled, or the list means something else to this library.
#[unsafe(no_mangle)]
pub extern "C" fn clutch_settings_hash() -> u64 {
    SETTINGS_HASH
}

/// Changes a real number of a list, SI. `CLUTCH_WRONG_STATE` if the list does not have the key.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_settings_real(
    settings: *mut clutch_setting,
    count: usize,
    key: u16,
    value: f32,
) -> clutch_result {
    // SAFETY: the caller's promise.
    unsafe { clutch_settings_number(settings, count, key, value.to_bits().into()) }
}

/// Changes a whole number, a switch or a choice of a list. A choice changes which other keys are needed.
/// `CLUTCH_WRONG_STATE` if the list does not have the key.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_settings_number(
    settings: *mut clutch_setting,
    count: usize,
    key: u16,
    value: u64,
) -> clutch_result {
    outcome(|| {
        // SAFETY: the caller's promise.
        let keys = unsafe { list(settings.cast_const(), count)? };
        let at =
            keys.iter().position(|setting| setting.key == key).ok_or(clutch_result::CLUTCH_WRONG_STATE)?;
        // SAFETY: it is within the list.
        unsafe { (*settings.add(at)).value = value };
        Ok(())
    })
}

/// A position as the core has it.
pub(crate) fn fixed(position_x65536: i64) -> FixedCounts {
    FixedCounts(position_x65536)
}
