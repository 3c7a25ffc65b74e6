//! The functions that a simulator calls. A function that these units do not have answers with an error; the standard wants the
//! function all the same.
#![allow(non_snake_case, reason = "the names are the standard's")]

use crate::instance::{Instance, Kept, LogMessage, Status};
use crate::variables::Part;
use std::ffi::{CStr, c_char, c_void};
use std::path::PathBuf;
use std::slice::from_raw_parts;

type Reference = u32;

/// A text of the simulator's.
unsafe fn text<'a>(pointer: *const c_char) -> Option<&'a str> {
    if pointer.is_null() {
        return None;
    }
    // SAFETY: the simulator's texts end with a zero.
    unsafe { CStr::from_ptr(pointer) }.to_str().ok()
}

/// A list of the simulator's.
unsafe fn list<'a, T>(pointer: *const T, count: usize) -> &'a [T] {
    if count == 0 || pointer.is_null() {
        return &[];
    }
    // SAFETY: the simulator says how many there are.
    unsafe { from_raw_parts(pointer, count) }
}

#[unsafe(no_mangle)]
pub(crate) extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

#[unsafe(no_mangle)]
pub(crate) extern "C" fn fmi3SetDebugLogging(
    _: *mut Instance,
    _: u8,
    _: usize,
    _: *const *const c_char,
) -> Status {
    Status::Ok
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi3InstantiateCoSimulation(
    _name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: u8,
    _logging: u8,
    _event_mode: u8,
    _early_return: u8,
    _required: *const Reference,
    _required_count: usize,
    environment: *mut c_void,
    log: LogMessage,
    _intermediate: *const c_void,
) -> *mut Instance {
    // SAFETY: the simulator's texts.
    let (token, resources) =
        unsafe { (text(token).unwrap_or_default(), text(resources).unwrap_or_default()) };
    match Part::ALL.into_iter().find(|part| part.token() == token) {
        Some(part) => {
            Box::into_raw(Box::new(Instance::new(part, PathBuf::from(resources), environment, log)))
        }
        None => {
            let wanted = Part::ALL.map(Part::token).join(" or ");
            let none = Instance::new(Part::Rig, PathBuf::new(), environment, log);
            none.fail(&format!("instantiationToken = {token}: expected {wanted}"));
            std::ptr::null_mut()
        }
    }
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi3FreeInstance(instance: *mut Instance) {
    if !instance.is_null() {
        // SAFETY: it came from the instantiation, and nobody uses it any more.
        drop(unsafe { Box::from_raw(instance) });
    }
}

/// The instance behind a call.
unsafe fn of<'a>(instance: *mut Instance) -> Option<&'a mut Instance> {
    // SAFETY: it came from the instantiation.
    unsafe { instance.as_mut() }
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi3EnterInitializationMode(
    instance: *mut Instance,
    _tolerance_defined: u8,
    _tolerance: f64,
    start: f64,
    _stop_defined: u8,
    _stop: f64,
) -> Status {
    // SAFETY: the simulator's.
    let Some(instance) = (unsafe { of(instance) }) else { return Status::Error };
    let begun = instance.initialise(start);
    instance.told(begun)
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi3Reset(instance: *mut Instance) -> Status {
    // SAFETY: the simulator's.
    let Some(instance) = (unsafe { of(instance) }) else { return Status::Error };
    instance.reset();
    Status::Ok
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi3DoStep(
    instance: *mut Instance,
    now: f64,
    step: f64,
    _final: u8,
    event: *mut bool,
    terminate: *mut bool,
    early: *mut bool,
    last: *mut f64,
) -> Status {
    // SAFETY: the simulator's.
    let Some(instance) = (unsafe { of(instance) }) else { return Status::Error };
    let stepped = instance.step(now, step);
    let reached = if stepped.is_ok() { now + step } else { now };
    // SAFETY: the simulator's places for them.
    unsafe {
        for place in [event, terminate, early] {
            if !place.is_null() {
                place.write(false);
            }
        }
        if !last.is_null() {
            last.write(reached);
        }
    }
    instance.told(stepped)
}

/// Refusal of a list of values.
const FEWER: &str = "fewer values than variables";

/// Reads variables.
unsafe fn get<T>(
    instance: *mut Instance,
    (references, count): (*const Reference, usize),
    (values, values_count): (*mut T, usize),
    mut value: impl FnMut(&mut Instance, Reference) -> Result<T, String>,
) -> Status {
    // SAFETY: the simulator's.
    let Some(instance) = (unsafe { of(instance) }) else { return Status::Error };
    if values_count < count || (count > 0 && values.is_null()) {
        return instance.fail(FEWER);
    }
    // SAFETY: the simulator says how many there are.
    for (i, reference) in unsafe { list(references, count) }.iter().enumerate() {
        match value(instance, *reference) {
            // SAFETY: there is room for as many.
            Ok(value) => unsafe { values.add(i).write(value) },
            Err(why) => return instance.fail(&why),
        }
    }
    Status::Ok
}

/// Writes variables.
unsafe fn set<T>(
    instance: *mut Instance,
    (references, count): (*const Reference, usize),
    (values, values_count): (*const T, usize),
    mut take: impl FnMut(&mut Instance, Reference, &T) -> Result<(), String>,
) -> Status {
    // SAFETY: the simulator's.
    let Some(instance) = (unsafe { of(instance) }) else { return Status::Error };
    // SAFETY: the simulator says how many there are.
    let (references, values) = unsafe { (list(references, count), list(values, values_count)) };
    if values.len() < references.len() {
        return instance.fail(FEWER);
    }
    let taken = references.iter().zip(values).try_for_each(|(r, value)| take(instance, *r, value));
    instance.told(taken)
}

/// The function by which a simulator reads variables of a type.
macro_rules! getter {
    ($name:ident, $type:ty, $value:expr) => {
        #[unsafe(no_mangle)]
        pub(crate) unsafe extern "C" fn $name(
            instance: *mut Instance,
            references: *const Reference,
            count: usize,
            values: *mut $type,
            values_count: usize,
        ) -> Status {
            // SAFETY: the simulator's.
            unsafe { get(instance, (references, count), (values, values_count), $value) }
        }
    };
}

/// The function by which it writes them.
macro_rules! setter {
    ($name:ident, $type:ty, $take:expr) => {
        #[unsafe(no_mangle)]
        pub(crate) unsafe extern "C" fn $name(
            instance: *mut Instance,
            references: *const Reference,
            count: usize,
            values: *const $type,
            values_count: usize,
        ) -> Status {
            // SAFETY: the simulator's.
            unsafe { set(instance, (references, count), (values, values_count), $take) }
        }
    };
}

getter!(fmi3GetFloat64, f64, |unit, r| unit.real(r));
getter!(fmi3GetInt32, i32, |unit, r| unit.whole(r));
getter!(fmi3GetBoolean, bool, |unit, r| unit.truth(r));
getter!(fmi3GetString, *const c_char, |unit, r| unit.lent_text(r));
setter!(fmi3SetFloat64, f64, |unit, r, value| unit.set_real(r, *value));
setter!(fmi3SetInt32, i32, |unit, r, value| unit.set_whole(r, *value));
setter!(fmi3SetString, *const c_char, take_text);

fn take_text(unit: &mut Instance, reference: Reference, value: &*const c_char) -> Result<(), String> {
    // SAFETY: the simulator's text.
    let text = unsafe { text(*value) }.ok_or("a text that is none, or not UTF-8")?;
    unit.set_text(reference, text)
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi3GetFMUState(instance: *mut Instance, state: *mut *mut Kept) -> Status {
    // SAFETY: the simulator's.
    let Some(instance) = (unsafe { of(instance) }) else { return Status::Error };
    if state.is_null() {
        return instance.fail("no place for the state");
    }
    // SAFETY: the simulator's place for it, which holds null or a state of ours.
    unsafe {
        if (*state).is_null() {
            *state = Box::into_raw(Box::new(instance.kept.clone()));
        } else {
            (**state).clone_from(&instance.kept);
        }
    }
    Status::Ok
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi3SetFMUState(instance: *mut Instance, state: *mut Kept) -> Status {
    // SAFETY: the simulator's.
    let (Some(instance), Some(state)) = (unsafe { (of(instance), state.as_ref()) }) else {
        return Status::Error;
    };
    let restored = instance.restore(state);
    instance.told(restored)
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi3FreeFMUState(_: *mut Instance, state: *mut *mut Kept) -> Status {
    // SAFETY: the simulator's place for a state of ours.
    unsafe {
        if !state.is_null() && !(*state).is_null() {
            drop(Box::from_raw(*state));
            *state = std::ptr::null_mut();
        }
    }
    Status::Ok
}

/// Calls that change nothing here.
macro_rules! nothing {
    ($($name:ident)+) => {
        $(#[unsafe(no_mangle)]
        pub(crate) extern "C" fn $name(_: *mut Instance) -> Status {
            Status::Ok
        })+
    };
}

nothing!(fmi3ExitInitializationMode fmi3Terminate fmi3EnterStepMode);

/// Functions of the standard that these units do not have. A caller hands over more than the instance, which is his to clear
/// away.
macro_rules! missing {
    ($($name:ident)+) => {
        $(#[unsafe(no_mangle)]
        unsafe extern "C" fn $name(instance: *mut Instance) -> Status {
            // SAFETY: the simulator's.
            let Some(instance) = (unsafe { of(instance) }) else { return Status::Error };
            instance.fail(concat!(stringify!($name), ": this unit does not have it"))
        })+
    };
}

missing!(fmi3EnterEventMode fmi3EnterConfigurationMode fmi3ExitConfigurationMode fmi3EvaluateDiscreteStates
    fmi3UpdateDiscreteStates fmi3GetFloat32 fmi3GetInt8 fmi3GetUInt8 fmi3GetInt16 fmi3GetUInt16 fmi3GetUInt32
    fmi3GetInt64 fmi3GetUInt64 fmi3GetBinary fmi3GetClock fmi3SetFloat32 fmi3SetInt8 fmi3SetUInt8 fmi3SetInt16
    fmi3SetUInt16 fmi3SetUInt32 fmi3SetInt64 fmi3SetUInt64 fmi3SetBoolean fmi3SetBinary fmi3SetClock
    fmi3GetNumberOfVariableDependencies fmi3GetVariableDependencies fmi3SerializedFMUStateSize
    fmi3SerializeFMUState fmi3DeserializeFMUState fmi3GetDirectionalDerivative fmi3GetAdjointDerivative
    fmi3GetIntervalDecimal fmi3GetIntervalFraction fmi3GetShiftDecimal fmi3GetShiftFraction
    fmi3SetIntervalDecimal fmi3SetIntervalFraction fmi3SetShiftDecimal fmi3SetShiftFraction
    fmi3EnterContinuousTimeMode fmi3CompletedIntegratorStep fmi3SetTime fmi3SetContinuousStates
    fmi3GetContinuousStateDerivatives fmi3GetEventIndicators fmi3GetContinuousStates
    fmi3GetNominalsOfContinuousStates fmi3GetNumberOfEventIndicators fmi3GetNumberOfContinuousStates
    fmi3GetOutputDerivatives fmi3ActivateModelPartition);

/// Interfaces that these units do not have.
macro_rules! no_instance {
    ($($name:ident)+) => {
        $(#[unsafe(no_mangle)]
        extern "C" fn $name() -> *mut Instance {
            std::ptr::null_mut()
        })+
    };
}

no_instance!(fmi3InstantiateModelExchange fmi3InstantiateScheduledExecution);
