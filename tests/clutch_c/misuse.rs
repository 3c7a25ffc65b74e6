//! A caller's mistakes: each is told, and nothing is touched.

use crate::axis::{build, run, scenario};
use clutch::*;
use clutch_settings::Setting;
use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};

fn key(name: &str) -> u16 {
    Setting::all().find(|s| s.name.to_string() == name).unwrap_or_else(|| panic!("no setting {name}")).key
}

#[test]
fn settings_that_make_no_run_are_named() {
    let (settings, _) = scenario(&[]);
    let gain = key("law.smc.kp_v");
    let at = settings.iter().position(|s| s.key == gain).unwrap();
    let with = |change: &dyn Fn(&mut Vec<clutch_setting>)| {
        let mut settings = settings.clone();
        change(&mut settings);
        let mut axis = MaybeUninit::zeroed();
        let (result, misfit) = build(&mut axis, &settings);
        assert_eq!(result, clutch_result::CLUTCH_MISFIT);
        // Nothing was built.
        // SAFETY: it is zeros.
        assert_eq!(unsafe { clutch_axis_stop(axis.as_mut_ptr()) }, clutch_result::CLUTCH_NOT_BUILT);
        (misfit.kind, misfit.key, misfit.value)
    };
    assert_eq!(with(&|s| s.retain(|s| s.key != gain)), (CLUTCH_MISFIT_MISSING, gain, 0.0));
    assert_eq!(with(&|s| s[at].value = (-1.0_f32).to_bits().into()), (CLUTCH_MISFIT_UNFIT, gain, -1.0));
    let law = key("law");
    assert_eq!(
        with(&|s| s.iter_mut().find(|s| s.key == law).unwrap().value = 99),
        (CLUTCH_MISFIT_UNKNOWN, law, 0.0)
    );
    assert_eq!(with(&|s| s.swap(at, at + 1)), (CLUTCH_MISFIT_ORDER, gain, 0.0));
    assert_eq!(with(&|s| s.insert(at, s[at])), (CLUTCH_MISFIT_ORDER, gain, 0.0));
    let (result, misfit) = build(&mut MaybeUninit::zeroed(), &settings);
    assert_eq!((result, misfit.kind), (clutch_result::CLUTCH_OK, CLUTCH_MISFIT_NONE));
}

#[test]
fn a_path_from_a_table_says_which_point_it_lacks() {
    let (mut settings, _) = scenario(&[]);
    // A ramp becomes a table of three points.
    let (path, ramp) = (key("reference"), key("reference.ramp.rate_deg_s"));
    let Some(clutch_settings::Declared::Choice(choice)) = Setting::of(path).map(|s| s.declared) else {
        panic!("a path is a choice")
    };
    let place = choice.options.iter().position(|o| o.key == "table").unwrap() as u64;
    settings.retain(|s| s.key != ramp);
    settings.iter_mut().find(|s| s.key == path).unwrap().value = place;
    for setting in Setting::all().filter(|s| s.name.to_string().starts_with("reference.table.")) {
        let value = if setting.kind().to_string() == "points" { 3 } else { 0 };
        settings.push(clutch_setting { key: setting.key, value });
    }
    settings.sort_by_key(|s| s.key);
    let knot = |n: u64| clutch_knot { time_us: 100_000 * n, position_x65536: 65_536 * 10 * n.cast_signed() };
    let knots = [knot(0), knot(1), knot(2)];
    let mut path = MaybeUninit::uninit();
    let mut misfit = MaybeUninit::uninit();
    let mut built = |count: usize| {
        let run = clutch_run { knots: knots.as_ptr(), knots_count: count, ..run(&settings) };
        // SAFETY: the memory is there for the time of the call.
        unsafe {
            let result = clutch_path_build(path.as_mut_ptr(), &raw const run, misfit.as_mut_ptr());
            (result, misfit.assume_init())
        }
    };
    let (result, why) = built(2);
    assert_eq!((result, why.kind, why.key), (clutch_result::CLUTCH_MISFIT, CLUTCH_MISFIT_MISSING, 0x1004));
    assert_eq!(built(3).0, clutch_result::CLUTCH_OK);
    let mut target = MaybeUninit::uninit();
    // SAFETY: it has been built.
    let target = unsafe {
        assert_eq!(clutch_path_at(path.as_mut_ptr(), 150, target.as_mut_ptr()), clutch_result::CLUTCH_OK);
        target.assume_init()
    };
    // Halfway between the points 1 and 2, at 100 counts/s; the path begins within the count 0.
    assert_eq!(target.position_x65536 >> 16, 15);
}

#[test]
fn null_and_misaligned_pointers_and_memory_that_was_not_built_are_refused() {
    let (settings, _) = scenario(&[]);
    let run = run(&settings);
    let no_settings = clutch_run { settings: null(), settings_count: 3, ..run };
    let no_knots = clutch_run { knots_count: 3, ..run };
    let endless = clutch_run { settings_count: usize::MAX, ..run };
    let run = &raw const run;
    let mut room = [0_u64; 1000];
    let axis = room.as_mut_ptr().cast::<clutch_axis>();
    let odd = axis.wrapping_byte_add(4);
    let bad = clutch_result::CLUTCH_BAD_POINTER;
    // SAFETY: pointers that are none are what is tested; the others have their memory.
    unsafe {
        assert_eq!(clutch_axis_build(null_mut(), run, null_mut()), bad);
        assert_eq!(clutch_axis_build(odd, run, null_mut()), bad);
        assert_eq!(clutch_axis_build(axis, null(), null_mut()), bad);
        for run in [no_settings, no_knots, endless] {
            assert_eq!(clutch_axis_build(axis, &raw const run, null_mut()), bad);
        }
        assert_eq!(clutch_axis_stop(null_mut()), bad);
        assert_eq!(clutch_axis_stop(axis), clutch_result::CLUTCH_NOT_BUILT);
        assert_eq!(clutch_axis_build(axis, run, null_mut()), clutch_result::CLUTCH_OK);
        assert_eq!(clutch_axis_sample(axis, null(), null_mut()), bad);
        assert_eq!(clutch_axis_safe(axis, null_mut()), bad);
        assert_eq!(clutch_axis_stop(axis), clutch_result::CLUTCH_OK);
        // An object of another kind.
        let mut command = MaybeUninit::uninit();
        let told = clutch_law_update(axis.cast(), null(), command.as_mut_ptr());
        assert_eq!(told, clutch_result::CLUTCH_NOT_BUILT);
    }
}

#[test]
fn a_servo_that_was_not_started_answers_nothing_and_a_law_alone_answers_as_within_it() {
    let (settings, trace) = scenario(&[]);
    let run = run(&settings);
    let (mut servo, mut law) = (MaybeUninit::uninit(), MaybeUninit::uninit());
    let (mut out, mut command) =
        (MaybeUninit::<clutch_output>::uninit(), MaybeUninit::<clutch_command>::uninit());
    let target =
        clutch_target { position_x65536: i64::from(trace.counts[0]) << 16, velocity: 0.0, acceleration: 0.0 };
    // SAFETY: the memory is there for the time of the calls.
    unsafe {
        let built = clutch_servo_build(servo.as_mut_ptr(), &raw const run, null_mut());
        assert_eq!(built, clutch_result::CLUTCH_OK);
        let early = clutch_servo_tick(servo.as_mut_ptr(), 0, &raw const target, out.as_mut_ptr());
        assert_eq!(early, clutch_result::CLUTCH_WRONG_STATE);
        clutch_servo_start(servo.as_mut_ptr(), trace.counts[0], &raw const target, 4.5);
        clutch_law_build(law.as_mut_ptr(), &raw const run, null_mut());
        let rest =
            clutch_tick { error: 0.0, error_rate: 0.0, target_velocity: 0.0, target_acceleration: 0.0 };
        clutch_law_start(law.as_mut_ptr(), &raw const rest, 4.5);
        for moved in [0, 1, 3, 2] {
            let counts = trace.counts[0] + moved;
            clutch_servo_tick(servo.as_mut_ptr(), counts, &raw const target, out.as_mut_ptr());
            let seen = out.assume_init();
            let answered = clutch_law_update(law.as_mut_ptr(), &raw const seen.tick, command.as_mut_ptr());
            assert_eq!(answered, clutch_result::CLUTCH_OK);
            assert_eq!(command.assume_init(), seen.command);
        }
    }
}

#[test]
fn a_number_of_a_list_is_changed_by_its_key() {
    let (mut settings, _) = scenario(&[]);
    let (gain, count) = (key("law.smc.kp_v"), settings.len());
    // SAFETY: the list is there for the time of the calls.
    unsafe {
        assert_eq!(clutch_settings_real(settings.as_mut_ptr(), count, gain, 4.0), clutch_result::CLUTCH_OK);
        let other = key("law.pd.kp_v_rad");
        assert_eq!(
            clutch_settings_real(settings.as_mut_ptr(), count, other, 4.0),
            clutch_result::CLUTCH_WRONG_STATE
        );
    }
    assert_eq!(settings.iter().find(|s| s.key == gain).unwrap().value, u64::from(4.0_f32.to_bits()));
}

#[test]
fn a_safe_state_goes_on_code_by_code_without_its_axis() {
    let (settings, _) = scenario(&[]);
    let mut axis = MaybeUninit::uninit();
    build(&mut axis, &settings);
    let (mut codes, mut run, mut code) =
        (MaybeUninit::<clutch_safe_codes>::uninit(), MaybeUninit::uninit(), 0);
    // SAFETY: the memory is there for the time of the calls.
    unsafe {
        clutch_axis_safe(axis.as_mut_ptr(), codes.as_mut_ptr());
        let mut codes = codes.assume_init();
        assert_eq!((codes.kind, codes.hold), (CLUTCH_SAFE_HOLD, 2970));
        codes = clutch_safe_codes { kind: CLUTCH_SAFE_HOLD_THEN_RELEASE, hold_periods: 2, ..codes };
        clutch_safe_begin(run.as_mut_ptr(), 4000);
        let mut seen = Vec::new();
        for _ in 0..4 {
            clutch_safe_next(run.as_mut_ptr(), &raw const codes, &raw mut code);
            seen.push(code);
        }
        assert_eq!(seen, [2970, 2970, 2048, 2048]);
    }
}
