//! A simulator's calls, from Rust: what Miri can follow (docs/proof.md). fmpy's are in python/tests/test_fmu.py.

use crate::fmi3::*;
use crate::instance::{Instance, Status};
use crate::variables::{self as is, Part};
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_void};
use std::ptr::{null, null_mut};

/// Messages of units.
type Said = RefCell<Vec<String>>;

/// Keeps what a unit says.
extern "C" fn keep(said: *mut c_void, _: Status, _: *const c_char, text: *const c_char) {
    // SAFETY: the environment of the test's own, and a text.
    let (said, text) = unsafe { (&*said.cast::<Said>(), CStr::from_ptr(text)) };
    said.borrow_mut().push(text.to_string_lossy().into_owned());
}

fn instance(token: &str, said: &Said) -> *mut Instance {
    let token = CString::new(token).unwrap();
    let environment = (&raw const *said).cast_mut().cast();
    // SAFETY: all that it reads is there for the time of the call.
    unsafe {
        fmi3InstantiateCoSimulation(
            c"one".as_ptr(),
            token.as_ptr(),
            c"".as_ptr(),
            0,
            0,
            0,
            0,
            null(),
            0,
            environment,
            Some(keep),
            null(),
        )
    }
}

/// A unit on a short run of a built-in scenario.
fn begun(part: Part, said: &Said) -> *mut Instance {
    let unit = instance(&part.token(), said);
    let set = "run.duration_s=0.01;run.settle_s=0";
    let texts = [c"smc_2".to_owned(), CString::new(set).unwrap()];
    let pointers = texts.each_ref().map(|text| text.as_ptr());
    // SAFETY: as above; the unit lives.
    unsafe {
        assert!(!unit.is_null());
        assert_eq!(
            fmi3SetString(unit, [is::SCENARIO, is::SET].as_ptr(), 2, pointers.as_ptr(), 2),
            Status::Ok
        );
        assert_eq!(fmi3EnterInitializationMode(unit, 0, 0.0, 0.0, 0, 0.0), Status::Ok, "{said:?}");
        assert_eq!(fmi3ExitInitializationMode(unit), Status::Ok);
        let mut lent = [null()];
        assert_eq!(fmi3GetString(unit, [is::SET].as_ptr(), 1, lent.as_mut_ptr(), 1), Status::Ok);
        assert_eq!(CStr::from_ptr(lent[0]).to_str(), Ok(set));
    }
    unit
}

fn step(unit: *mut Instance, now: f64) -> (Status, f64) {
    let (mut event, mut terminate, mut early, mut last) = (true, true, true, -1.0);
    // SAFETY: as above.
    let status = unsafe {
        fmi3DoStep(unit, now, 0.001, 0, &raw mut event, &raw mut terminate, &raw mut early, &raw mut last)
    };
    assert_eq!([event, terminate, early], [false; 3]);
    (status, last)
}

fn real(unit: *mut Instance, reference: u32) -> f64 {
    let mut value = f64::NAN;
    // SAFETY: as above.
    let read = unsafe { fmi3GetFloat64(unit, &raw const reference, 1, &raw mut value, 1) };
    assert_eq!(read, Status::Ok);
    value
}

#[test]
fn units_take_turns_and_go_back_to_a_state() {
    let said = Said::default();
    let (law, rig) = (begun(Part::Law, &said), begun(Part::Rig, &said));
    let turn = |period: u32| {
        let now = f64::from(period) * 0.001;
        let mut counts = 0;
        // SAFETY: both live.
        unsafe {
            assert_eq!(fmi3GetInt32(rig, [is::COUNTS].as_ptr(), 1, &raw mut counts, 1), Status::Ok);
            assert_eq!(fmi3SetInt32(law, [is::COUNTS].as_ptr(), 1, &raw const counts, 1), Status::Ok);
            assert_eq!(step(law, now), (Status::Ok, now + 0.001));
            let volts = real(law, is::VOLTAGE);
            assert_eq!(fmi3SetFloat64(rig, [is::VOLTAGE].as_ptr(), 1, &raw const volts, 1), Status::Ok);
        }
        assert_eq!(step(rig, now), (Status::Ok, now + 0.001));
        (real(rig, is::POSITION), real(law, is::ERROR))
    };
    turn(0);
    let mut kept = [null_mut(), null_mut()];
    // SAFETY: both live, the places are empty.
    unsafe {
        assert_eq!(fmi3GetFMUState(law, &raw mut kept[0]), Status::Ok);
        assert_eq!(fmi3GetFMUState(rig, &raw mut kept[1]), Status::Ok);
    }
    let first: Vec<_> = (1..4).map(turn).collect();
    // SAFETY: as above; the states are theirs.
    unsafe {
        assert_eq!(fmi3SetFMUState(law, kept[0]), Status::Ok);
        assert_eq!(fmi3SetFMUState(rig, kept[1]), Status::Ok);
        // A state of the other unit is none of its own.
        assert_eq!(fmi3SetFMUState(rig, kept[0]), Status::Error);
    }
    assert_eq!((1..4).map(turn).collect::<Vec<_>>(), first);
    assert_eq!(said.borrow().len(), 1, "{said:?}");
    // SAFETY: nobody uses them any more.
    unsafe {
        for state in &mut kept {
            assert_eq!(fmi3FreeFMUState(law, state), Status::Ok);
            assert!(state.is_null());
        }
        fmi3FreeInstance(law);
        fmi3FreeInstance(rig);
        fmi3FreeInstance(null_mut());
    }
}

#[test]
fn what_a_simulator_must_not_do_is_refused_with_a_reason() {
    let said = Said::default();
    assert!(instance("{another}", &said).is_null());
    let rig = begun(Part::Rig, &said);
    let mut values = [0.0; 1];
    let unknown = [99, is::TIME];
    // SAFETY: as above; a list that is shorter than said is what is tested, and not read.
    unsafe {
        assert_eq!(fmi3GetFloat64(rig, unknown.as_ptr(), 1, values.as_mut_ptr(), 1), Status::Error);
        assert_eq!(fmi3GetFloat64(rig, unknown.as_ptr(), 2, values.as_mut_ptr(), 1), Status::Error);
        assert_eq!(fmi3SetFloat64(rig, unknown[1..].as_ptr(), 1, values.as_ptr(), 1), Status::Error);
        assert_eq!(fmi3SetString(rig, [is::SET].as_ptr(), 1, &null(), 1), Status::Error);
        assert_eq!(fmi3GetFMUState(rig, null_mut()), Status::Error);
        assert_eq!(fmi3Reset(rig), Status::Ok);
        assert_eq!(step(rig, 0.0), (Status::Error, 0.0));
        fmi3FreeInstance(rig);
        for reason in [
            "instantiationToken",
            "no variable 99",
            "fewer values",
            "expected an input",
            "a text that is none",
            "no place",
            "before initialisation",
        ] {
            assert!(said.borrow().iter().any(|text| text.contains(reason)), "{reason}: {said:?}");
        }
        assert_eq!(fmi3Reset(null_mut()), Status::Error);
    }
}
