//! Declarations at run time: what errors, editors and documents make of them.
#![allow(unreachable_pub, reason = "tables declare what others may take")]

use super::*;
use crate::law::{HoldParams, LawParams, PidParams};
use crate::reference::{Interpolation, Knot, ReferenceParams, Table as Points};
use crate::{
    ActuatorKind, ActuatorParams, Bounds, DacParams, FixedCounts, LimitParams, Micros, ParamError,
    PlantParams, SafeState, ServoParams, Tolerances, VelocityParams,
};
use std::format;
use std::string::{String, ToString};
use std::vec::Vec;

/// Counts what it is shown, and changes nothing but what it is told to.
#[derive(Default)]
struct Seen {
    reals: Vec<String>,
    others: usize,
    words: usize,
    tables: usize,
    /// True if a part that may be absent is to be there.
    present: Option<bool>,
    /// Option to choose.
    choose: Option<usize>,
}

impl<T: Real> Editor<T> for Seen {
    fn real<P: Table<T>>(&mut self, row: usize, value: &mut T) {
        self.reals.push(format!("{} = {value}", P::TABLE.rows.get(row).unwrap().field));
    }
    fn whole<P: Table<T>>(&mut self, _: usize, _: &mut u64) {
        self.others += 1;
    }
    fn switch<P: Table<T>>(&mut self, _: usize, _: &mut bool) {
        self.others += 1;
    }
    fn word<P: Table<T>>(&mut self, _: usize, _: &mut usize) {
        self.words += 1;
    }
    fn present<P: Table<T>>(&mut self, _: usize, present: bool) -> bool {
        self.present.unwrap_or(present)
    }
    fn choose<C: Choice<T>>(&mut self, chosen: usize) -> usize {
        self.choose.unwrap_or(chosen)
    }
    fn table<P: Table<T>>(&mut self, _: &P) {
        self.tables += 1;
    }
}

/// An editor that takes every default of the trait.
struct Nobody;

impl<T: Real> Editor<T> for Nobody {
    fn real<P: Table<T>>(&mut self, _: usize, _: &mut T) {}
    fn whole<P: Table<T>>(&mut self, _: usize, _: &mut u64) {}
    fn switch<P: Table<T>>(&mut self, _: usize, _: &mut bool) {}
    fn word<P: Table<T>>(&mut self, _: usize, _: &mut usize) {}
}

#[test]
fn who_only_looks_changes_nothing() {
    fn unchanged<P: Params<f64> + Clone + PartialEq + core::fmt::Debug>(p: &P) {
        let mut edited = p.clone();
        edited.edit(&mut Nobody);
        assert_eq!(&edited, p);
    }
    for law in LawParams::<f64>::all() {
        unchanged(&law);
    }
    unchanged(&PlantParams::<f64>::default());
    unchanged(&Kinds::<f64>::default());
    unchanged(&VelocityParams::<f64>::default());
    unchanged(&LimitParams::<f64>::default());
    unchanged(&SafeState::<f64>::hold_then_release(5.0, 0.5));
    unchanged(&Bounds::<f64>::around(&PlantParams::default(), &Tolerances::default()).unwrap());
    let knots = [Knot { time_us: 1000, position: FixedCounts(1) }];
    unchanged(&ReferenceParams::<f64>::Table(Points { knots: &knots, interpolation: Interpolation::Linear }));
}

#[test]
fn an_option_that_is_chosen_anew_has_its_defaults_or_nothing() {
    let pid = LawParams::<f64>::Pid(PidParams::default());
    let (place, mut law) = (pid.chosen(), LawParams::<f64>::Hold(HoldParams::default()));
    law.edit(&mut Seen { choose: Some(place), ..Seen::default() });
    assert_eq!((law.chosen(), law.name()), (place, "pid"));
    assert_eq!(law, pid, "with its defaults");
    // Without defaults it is no number, and refused.
    let mut safe = SafeState::<f64>::Release;
    safe.edit(&mut Seen { choose: Some(0), ..Seen::default() });
    assert!(safe.name() == "hold" && safe.check().is_err(), "{safe:?}");
    let mut same = pid;
    let mut seen = Seen { choose: Some(place), ..Seen::default() };
    same.edit(&mut seen);
    assert_eq!((same, seen.tables), (pid, 1));
    assert!(seen.reals.iter().any(|r| r == "kp = 1000"), "{:?}", seen.reals);
}

crate::params! {
    /// One of each kind.
    struct Kinds<T>: Default {
        /// A share.
        share: T = 25.0, "share_percent" "x" PERCENT, Range::within(0.0, 100.0);
        /// It may be absent.
        absent: Option<T>, "absent_v" "" V, Range::at_least(-2e6).below(1e7);
        /// It may be absent, and is 3 V by default.
        given: Option<T> = 3.0, "given_mv" "" MV, Range::ANY;
        /// On or off.
        on: bool = true, "on" "" NONE, Range::ANY;
        /// A word.
        kind: ActuatorKind = "motor", "kind" "" NONE, Range::ANY;
        /// Far.
        big: u32 = 5, "big" "" NONE, Range::at_least(2.0).up_to(3e9);
    }
}

#[test]
fn a_parameter_that_may_be_absent_is_there_when_it_is_asked_for() {
    let mut kinds = Kinds::<f64>::default();
    assert_eq!((kinds.absent, kinds.share, kinds.on, kinds.kind), (None, 0.25, true, ActuatorKind::Motor));
    assert_eq!(kinds.given, Some(3.0), "the struct's unit is the key's");
    let mut seen = Seen::default();
    kinds.edit(&mut seen);
    assert_eq!((kinds.absent, seen.reals.len(), seen.words, seen.others), (None, 2, 1, 2));
    kinds.edit(&mut Seen { present: Some(true), ..Seen::default() });
    assert!(kinds.absent.is_some_and(f64::is_nan), "there, and not a number yet");
    assert_eq!(kinds.check().unwrap_err().field(), "absent");
    kinds.absent = Some(-3e6);
    let error = kinds.check().unwrap_err();
    assert_eq!(
        error.to_string(),
        "absent = -3000000: expected a number of at least -2 000 000 and below 10 000 000 V"
    );
    kinds.absent = Some(1.5);
    assert!(kinds.check().is_ok());
    assert_eq!(kinds.cast::<f32>().absent, Some(1.5_f32));
    let cast = kinds.cast::<f32>();
    assert_eq!(
        (cast.share, cast.given, cast.on, cast.kind, cast.big),
        (0.25, Some(3.0), true, ActuatorKind::Motor, 5)
    );
    kinds.edit(&mut Seen { present: Some(false), ..Seen::default() });
    assert_eq!(kinds.absent, None);
    // Numbers as errors and tables show them.
    let numbers = [Leaf::<f64>::number(&Some(2.5)), Leaf::<f64>::number(&None::<f64>)];
    assert_eq!(numbers, [2.5, 0.0]);
    assert_eq!((Leaf::<f64>::number(&true), Leaf::<f64>::number(&ActuatorKind::Motor)), (1.0, 1.0));
}

crate::params! {
    /// Without defaults.
    struct Given<T> {
        /// A number.
        number: T, "number" "" NONE, Range::ANY;
        /// On or off.
        on: bool, "on" "" NONE, Range::ANY;
        /// A word.
        kind: ActuatorKind, "kind" "" NONE, Range::ANY;
        /// A whole number.
        whole: u32, "whole" "" NONE, Range::at_least(1.0);
        /// Absent.
        absent: Option<u8>, "absent" "" NONE, Range::ANY;
    }
}

#[test]
fn a_blank_table_has_nothing_that_could_be_taken_for_a_value() {
    let blank = Given::<f64>::blank();
    assert!(blank.number.is_nan() && !blank.on && blank.kind == ActuatorKind::Brake);
    assert_eq!((blank.whole, blank.absent), (0, None));
    assert_eq!(blank.check().unwrap_err().field(), "number");
    assert_eq!(blank.cast::<f32>().whole, 0);
    assert!(<&[Knot] as Leaf<f64>>::blank().is_empty());
}

#[test]
fn each_kind_of_value_has_its_words() {
    let words = |kind, range: Range, unit: &Unit, si| range.words(kind, unit, si).to_string();
    assert_eq!(words(Kind::Switch, Range::ANY, &NONE, false), "true or false");
    assert_eq!(
        words(Kind::Text, Range::ANY, &NONE, false),
        "a text in quotes, without line breaks and other control characters"
    );
    let row = Kinds::<f64>::TABLE.rows.get(4).unwrap();
    assert_eq!(words(row.kind, row.range, &row.unit, false), "one of: brake, motor, both");
    let points = "a list of at least one pair [s, °] of finite numbers, with times that rise";
    assert_eq!(words(Kind::Points, Range::ANY, &S_DEG, false), points);
    let from_0 = words(Kind::Points, Range::at_least(0.0), &S_DEG, false);
    assert_eq!(from_0, format!("{points} from 0 s on"));
    let angles = "a list of at least one pair [°, 1] of finite numbers, with angles that rise";
    let along = Unit { text: "°, 1", ..S_DEG };
    let turn = words(Kind::Points, Range::within(0.0, 360.0), &along, false);
    assert_eq!(turn, format!("{angles} from 0 to 360 °"));
    // 2⁶³ − 1 of a file is no number of 53 bits.
    let largest = words(Kind::Whole, Range::within(1.0, 9_223_372_036_854_775_808.0), &NONE, false);
    assert!(largest.ends_with(" to 9223372036854775807"), "{largest}");
    // The ends in the key's unit, or in the struct's.
    let range = Range::above(0.0).below(90.0);
    assert_eq!(words(Kind::Real, range, &DEG, false), "a number above 0 and below 90 °");
    assert_eq!(
        words(Kind::Real, Range::ANY.up_to(180.0), &DEG, true),
        format!("a finite number at most {} rad", core::f64::consts::PI)
    );
    let halves = words(Kind::Real, Range::within(-10_000.5, 10_000.0), &NONE, false);
    assert_eq!(halves, "a number from -10000.5 to 10 000");
    assert_eq!(words(Kind::Real, Range::within(0.0, 1.5e-3), &NONE, false), "a number from 0 to 0.0015");
    assert_eq!(
        words(Kind::Whole, Range::within(1.0, 1_002_003.0), &NONE, false),
        "a whole number from 1 to 1 002 003"
    );
}

#[test]
fn ends_belong_to_a_range_or_not() {
    for (range, low, high) in [
        (Range::within(-1.0, 2.0), true, true),
        (Range::above(-1.0).below(2.0), false, false),
        (Range::at_least(-1.0).below(2.0), true, false),
        (Range::above(-1.0).up_to(2.0), false, true),
    ] {
        assert_eq!((range.holds(&NONE, -1.0), range.holds(&NONE, 2.0)), (low, high), "{range:?}");
        assert!(range.holds(&NONE, -0.999_f32) && range.holds(&NONE, 1.999_f32));
        assert!(!range.holds(&NONE, -1.001_f32) && !range.holds(&NONE, 2.001_f32));
    }
    // The inverse of the least float is none.
    assert!(!Range::divisor().holds(&NONE, f64::MIN_POSITIVE / 1e9) && Range::divisor().holds(&NONE, 1e-300));
    for (range, low, high) in
        [(Range::within(2.0, 9.0), true, true), (Range::above(2.0).below(9.0), false, false)]
    {
        assert_eq!((range.holds_whole(2), range.holds_whole(9)), (low, high), "{range:?}");
        assert!(
            range.holds_whole(3) && range.holds_whole(8) && !range.holds_whole(1) && !range.holds_whole(10)
        );
    }
    assert!(
        Range::ANY.holds_whole(0) && Range::ANY.holds_whole(u64::MAX) && Range::at_least(0.0).holds_whole(0)
    );
}

#[test]
fn a_unit_goes_to_si_and_back_and_is_found_by_the_end_of_a_key() {
    for unit in UNITS {
        for x in [-3.0, 0.0, 0.25, 7200.0] {
            assert!((unit.from_si(unit.to_si(x)) - x).abs() < 1e-12 * (1.0 + x.abs()), "{unit:?}");
        }
        if !unit.suffix.is_empty() {
            assert_eq!(Unit::of_key(&format!("some_{}", unit.suffix)), Some(unit));
            assert_eq!(Unit::of_key(unit.suffix), Some(unit));
        }
    }
    assert_eq!((PERCENT.to_si(40.0), DEG.to_si(180.0), MS.to_si(3.0)), (0.4, core::f64::consts::PI, 3.0));
    // As people are shown it.
    assert_eq!((MS.factor(), MRAD_S.factor(), V.factor(), PERCENT.factor()), (1e3, 1e3, 1.0, 100.0));
    assert!((DEG.factor() - 180.0 / core::f64::consts::PI).abs() < 1e-12);
    // The longest one, and no part of a word.
    assert_eq!(Unit::of_key("kp_v_rad").map(|u| u.text), Some("V/rad"));
    assert_eq!((Unit::of_key("revs"), Unit::of_key("gain")), (None, None));
}

#[test]
fn every_table_is_found_by_its_number_and_every_field_by_its_name() {
    fn found<P: Params<f64>>() {
        fn below(info: &'static Info, all: &'static Info) {
            let tables: Vec<&TableInfo> = match info {
                Info::Table(table) => std::vec![table],
                Info::Choice(choice) => choice.options.iter().map(|o| o.table).collect(),
            };
            assert_eq!(info.table().is_some(), matches!(info, Info::Table(_)));
            for table in tables.into_iter().filter(|t| t.id != 0) {
                assert_eq!(all.find(table.id).map(|t| t.name), Some(table.name));
                assert_eq!(TableInfo::id_of(table.name), table.id);
                for (place, row) in table.rows.iter().enumerate() {
                    assert_eq!(usize::from(TableInfo::row_of(table.rows, row.field)), place);
                }
                for (place, nested) in table.nested.iter().enumerate() {
                    assert_eq!(table.below(nested.field), place);
                    below(nested.info, all);
                }
            }
        }
        below(&P::INFO, &P::INFO);
        assert!((&P::INFO as &'static Info).find(1).is_none());
    }
    found::<LawParams<f64>>();
    found::<PlantParams<f64>>();
    found::<Bounds<f64>>();
    assert_eq!(TableInfo::place(&["a", "bc", "b"], "b"), 2);
}

#[test]
#[should_panic(expected = "no such name")]
fn a_name_that_is_none_ends_the_search() {
    let _ = TableInfo::place(&["a", "bc"], "b");
}

#[test]
#[should_panic(expected = "no such name")]
fn a_field_that_is_none_ends_the_search() {
    let _ = TableInfo::row_of(Kinds::<f64>::TABLE.rows, "shar");
}

#[test]
#[should_panic(expected = "no such name")]
fn a_nested_table_that_is_none_ends_the_search() {
    let _ = <Kinds<f64> as Table<f64>>::TABLE.below("share");
}

#[test]
fn an_error_tells_field_value_and_range_in_either_scalar() {
    let p = DacParams { bits: 17, ..DacParams::<f64>::default() };
    let error = crate::Dac::new(&p).unwrap_err();
    assert_eq!(error.to_string(), "bits = 17: expected a whole number from 1 to 16 bits");
    let cast: ParamError<f32> = error.cast();
    assert_eq!((cast.to_string(), cast.field(), cast.value), (error.to_string(), "bits", 17.0_f32));
    assert_eq!(format!("{:?}", error.table), "DacParams");
    assert_eq!(error.table, cast.table);
    assert_eq!(error.table().map(|t| t.name), Some("DacParams"));
    assert_eq!(TableRef::of::<f64, DacParams<f64>>(), error.table);
    assert_ne!(TableRef::of::<f64, Kinds<f64>>(), error.table);
    // A row that a table does not have, as a foreign board might report it.
    let foreign = ParamError { row: 99, ..error };
    assert_eq!(foreign.to_string(), "row 99 of DacParams = 17: out of range");
    assert_eq!((foreign.field(), foreign.row()), ("", None));
    let error = ServoParams::<f64> { period: Micros(0), ..ServoParams::paper(LawParams::all()[0]) };
    assert_eq!(crate::Servo::new(&error).unwrap_err().field(), "period");
}

#[test]
fn actuators_of_each_kind_have_the_places_of_their_words() {
    assert_eq!(ActuatorKind::ALL.iter().map(|k| k.name()).collect::<Vec<_>>(), ["brake", "motor", "both"]);
    for kind in ActuatorKind::ALL {
        assert_eq!(ActuatorKind::named(kind.name()), Some(*kind));
    }
    assert_eq!(ActuatorKind::named("break"), None);
    assert_eq!(ActuatorParams::<f64>::default().kind(), ActuatorKind::Brake);
}

#[test]
fn points_are_counted_and_no_range_refuses_them() {
    let knots =
        [Knot { time_us: 0, position: FixedCounts(0) }, Knot { time_us: 1, position: FixedCounts(9) }];
    let points: &[Knot] = &knots;
    assert_eq!(Leaf::<f64>::number(&points), 2.0);
    assert_eq!(Leaf::<f64>::outside(&points, &Range::above(5.0), &S_DEG), None);
    assert_eq!(Leaf::<f64>::cast::<f32>(&points), points);
    assert!(<&[Knot] as Leaf<f64>>::of((), &S_DEG).is_empty());
}

#[test]
fn what_is_nested_is_checked_too() {
    let mut bounds = Bounds::<f64>::around(&PlantParams::default(), &Tolerances::default()).unwrap();
    assert!(Params::check(&bounds).is_ok());
    bounds.friction.low = f64::NAN;
    assert_eq!(Params::check(&bounds).unwrap_err().field(), "low");
}
