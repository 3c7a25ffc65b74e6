//! Objects in memory of the caller's: no allocation, and no layout that C could depend on.

use core::mem::MaybeUninit;

/// The outcome of a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub enum clutch_result {
    /// Done.
    CLUTCH_OK = 0,
    /// A pointer is null, or not aligned for what it points to. Nothing has been done.
    CLUTCH_BAD_POINTER = 1,
    /// The object has not been built, or its memory was overwritten. Nothing has been done.
    CLUTCH_NOT_BUILT = 2,
    /// The settings make no run; `clutch_misfit` says why. Nothing has been built.
    CLUTCH_MISFIT = 3,
    /// Not in this state. Nothing has been done.
    CLUTCH_WRONG_STATE = 4,
}

/// An object behind a mark that says that it was built.
#[repr(C)]
pub(crate) struct Marked<T> {
    mark: u64,
    object: T,
}

/// An object that C holds as memory of a fixed size.
pub(crate) trait Kept: Sized {
    /// The memory, as C declares it.
    type Memory;
    /// A number of its own for each kind of object.
    const MARK: u64;
}

/// Keeps an object in a memory; it does not compile if the object does not fit.
macro_rules! kept {
    ($memory:ident, $object:ty, $mark:literal) => {
        impl $crate::memory::Kept for $object {
            type Memory = $memory;
            const MARK: u64 = u64::from_le_bytes(*$mark);
        }

        const _: () = assert!(
            size_of::<$crate::memory::Marked<$object>>() <= size_of::<$memory>()
                && align_of::<$crate::memory::Marked<$object>>() <= align_of::<$memory>(),
            concat!("the memory of ", stringify!($memory), " is too small")
        );
    };
}
pub(crate) use kept;

/// Puts an object into its memory, for which there is room.
pub(crate) unsafe fn put<T: Kept>(memory: *mut T::Memory, object: T) {
    // SAFETY: the memory is large enough and aligned; that it is the caller's own is his promise.
    unsafe { memory.cast::<Marked<T>>().write(Marked { mark: T::MARK, object }) };
}

/// The object in a memory.
pub(crate) unsafe fn object<'a, T: Kept>(memory: *mut T::Memory) -> Result<&'a mut T, clutch_result> {
    room(memory)?;
    // SAFETY: as above; the mark is a number, whatever the memory holds.
    let mark = unsafe { (&raw const (*memory.cast::<Marked<MaybeUninit<T>>>()).mark).read() };
    if mark != T::MARK {
        return Err(clutch_result::CLUTCH_NOT_BUILT);
    }
    // SAFETY: only `put` writes the mark, with an object behind it.
    Ok(unsafe { &mut (*memory.cast::<Marked<T>>()).object })
}

/// A value of C's to read.
pub(crate) unsafe fn input<'a, T>(pointer: *const T) -> Result<&'a T, clutch_result> {
    room(pointer.cast_mut())?;
    // SAFETY: that it points to such a value is the caller's promise.
    Ok(unsafe { &*pointer })
}

/// A list of C's to read; an empty one may have no address.
pub(crate) unsafe fn list<'a, T>(pointer: *const T, count: usize) -> Result<&'a [T], clutch_result> {
    if count == 0 {
        return Ok(&[]);
    }
    if pointer.is_null() || !pointer.is_aligned() || count > isize::MAX as usize / size_of::<T>() {
        return Err(clutch_result::CLUTCH_BAD_POINTER);
    }
    // SAFETY: that there are so many is the caller's promise.
    Ok(unsafe { core::slice::from_raw_parts(pointer, count) })
}

/// Looks at a place for a value before anything is done.
pub(crate) fn room<T>(pointer: *mut T) -> Result<(), clutch_result> {
    if pointer.is_null() || !pointer.is_aligned() { Err(clutch_result::CLUTCH_BAD_POINTER) } else { Ok(()) }
}

/// Hands a value to C.
pub(crate) unsafe fn output<T>(pointer: *mut T, value: T) -> Result<(), clutch_result> {
    room(pointer)?;
    // SAFETY: that there is room for it is the caller's promise.
    unsafe { pointer.write(value) };
    Ok(())
}

/// The outcome of a call whose steps may fail.
pub(crate) fn outcome(steps: impl FnOnce() -> Result<(), clutch_result>) -> clutch_result {
    match steps() {
        Ok(()) => clutch_result::CLUTCH_OK,
        Err(result) => result,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fits_closely<T: Kept>() {
        let (needed, given) = (size_of::<Marked<T>>(), size_of::<T::Memory>());
        assert!(5 * given <= 8 * needed.max(20), "{given} bytes for {needed}");
    }

    #[test]
    fn no_memory_is_much_larger_than_its_object() {
        fits_closely::<crate::path::Planned>();
        fits_closely::<crate::servo::Kept>();
        fits_closely::<crate::law::Kept>();
        fits_closely::<crate::axis::Kept>();
        fits_closely::<clutch_core::SafeRun>();
        fits_closely::<crate::stick_slip::Kept>();
    }
}
