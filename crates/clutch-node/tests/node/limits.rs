//! Every setting of a run, as it comes over the wire: below, at and above its limits, and as no number. A value out of
//! range is refused, and the host's words on it have key, value and unit; one in range is taken, or a relation with
//! other settings speaks against it.

use crate::desk::{PATHS, Plan, paper};
use clutch_core::law::{LawParams, OutputParams, PdParams};
use clutch_core::params::{Conversion, KG_M2, Kind, NM, NM_S_RAD, NM_V, Range, Row, Unit};
use clutch_core::reference::{Interpolation, Knot, ReferenceParams, Table};
use clutch_core::{
    ActuatorParams, BothActuator, Bounds, BrakeGeometry, FixedCounts, FrictionParams, MotorActuator,
    PlantParams, SafeState, ServoParams, SupervisorParams, Tolerances,
};
use clutch_settings::{Declared, MAX_KNOTS, Misfit, Refusing, SETTINGS, Setting, Settings};
use std::collections::BTreeSet;

const KNOTS: [Knot; 3] = [
    Knot { time_us: 0, position: FixedCounts(0) },
    Knot { time_us: 300_000, position: FixedCounts(400 << 16) },
    Knot { time_us: 900_000, position: FixedCounts(800 << 16) },
];

/// Settings that no plan takes at an end of their range, where a relation is narrower: 0, or the smallest number above it,
/// gives no brake gain, no step of the converter, no count, no period, a level of friction below another, a path without an end.
const RELATED: &[&str] = &[
    "model.actuator.geometry.inner_radius_m",
    "model.actuator.geometry.torque_constant_nm_a",
    "model.actuator.geometry.pad_area_m2",
    "model.actuator.geometry.lever_area_m2",
    "model.actuator.geometry.armature_resistance_ohm",
    "model.actuator.geometry.contact_radius_m",
    "model.friction.coulomb.mu_static",
    "model.friction.elasto_plastic.mu_static",
    "model.friction.elasto_plastic.mu_dynamic",
    "law.pid.tracking_time_s",
    "safety.on_fault.ramp.rate_v_s",
    "safety.on_fault.hold_then_release.after_s",
    "safety.limits.jump_deg",
    "safety.limits.saturation_time_s",
    "reference.trapezoid.speed_deg_s",
    "reference.trapezoid.acceleration_deg_s2",
    "reference.jerk_limited.speed_deg_s",
    "reference.jerk_limited.acceleration_deg_s2",
    "reference.jerk_limited.jerk_deg_s3",
    "reference.chirp.duration_s",
];

/// A plan for each option of each choice; every one of them is a run that a board takes.
fn plans() -> Vec<Plan> {
    let laws = LawParams::all().map(|law| Plan { servo: paper(law), ..Plan::new() });
    let safe = [SafeState::ramp(100.0, 5.5), SafeState::Release, SafeState::hold_then_release(5.0, 1.5)]
        .map(|on_fault| Plan { limits: SupervisorParams::new(on_fault), ..Plan::new() });
    let table = ReferenceParams::Table(Table { knots: &KNOTS, interpolation: Interpolation::Linear });
    let paths = [ReferenceParams::Hold, table].into_iter().chain(PATHS);
    let paths = paths.map(|reference| Plan { reference, ..Plan::new() });
    let frictions =
        FrictionParams::all().map(|friction| around(PlantParams { friction, ..PlantParams::default() }));
    let actuators: [ActuatorParams<f32>; 3] = [
        ActuatorParams::Geometry(BrakeGeometry {
            inner_radius: 0.05,
            torque_constant: 0.03,
            pad_area: 1e-4,
            lever_area: 1e-4,
            armature_resistance: 1.0,
            contact_radius: 0.01,
        }),
        MotorActuator { gain: 0.05, preload: 0.3, load_share: 0.5 }.into(),
        BothActuator { brake_gain: 0.14, motor_gain: 0.05, preload: 0.3 }.into(),
    ];
    let actuators = actuators.map(|actuator| around(PlantParams { actuator, ..PlantParams::default() }));
    laws.into_iter().chain(safe).chain(paths).chain(frictions).chain(actuators).collect()
}

/// A plan for a shaft that is known exactly, with an output stage that its actuator takes.
fn around(model: PlantParams<f32>) -> Plan {
    let servo = paper(LawParams::Pd(PdParams::default()));
    let two_sided = model.actuator.kind().two_sided();
    let output = OutputParams { lowest: -10.0, on_invalid: 0.0, ..servo.output };
    let output = if two_sided { output } else { servo.output };
    let bounds = Bounds::around(&model, &Tolerances::default()).unwrap();
    Plan { servo: ServoParams { model, output, ..servo }, bounds, ..Plan::new() }
}

/// The settings of a plan, one of them with another value.
fn with(plan: &Plan, key: u16, value: u64) -> Settings {
    let mut settings = plan.settings();
    assert!(settings.set(key, value));
    settings
}

/// Values of a setting, as they go over the wire.
struct Values {
    /// Out of its range, none of its list, or more than its type holds.
    wrong: Vec<u64>,
    /// In its range.
    good: Vec<u64>,
}

/// Values at the limits of a setting, beside them, and some that no setting has.
fn values(setting: &Setting) -> Values {
    match setting.declared {
        Declared::Choice(choice) => of_a_list(choice.options.len()),
        Declared::Row(row, _) => match row.kind {
            Kind::Real => real(row),
            Kind::Whole => whole(row, setting.name.to_string() == "ticks"),
            Kind::Word(words) => of_a_list(words.len()),
            Kind::Switch => of_a_list(2),
            // Their number; that there is one at all is a matter of a relation.
            Kind::Points => Values {
                wrong: vec![MAX_KNOTS as u64 + 1, 1 << 32, u64::MAX],
                good: vec![0, 1, KNOTS.len() as u64],
            },
            Kind::Text => panic!("a board reads no texts"),
        },
    }
}

fn of_a_list(places: usize) -> Values {
    let places = places as u64;
    let wrong = vec![places, u32::MAX.into(), 1 << 32, u64::MAX, bits(f32::NAN)];
    Values { wrong, good: (0..places).collect() }
}

fn bits(x: f32) -> u64 {
    x.to_bits().into()
}

fn real(row: &Row) -> Values {
    let Range { low, low_in, high, high_in, divides } = row.range;
    let mut wrong = vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let mut good = Vec::new();
    let end = |x: f64| si(&row.unit, x) as f32;
    for (end, taken, outwards) in [
        (end(low), low_in, f32::next_down as fn(f32) -> f32),
        (end(high), high_in, f32::next_up as fn(f32) -> f32),
    ] {
        if !end.is_finite() {
            continue;
        }
        wrong.push(outwards(end));
        let within = -outwards(-end);
        match (taken, divides) {
            (true, _) => good.extend([end, within]),
            // Too small to divide by.
            (false, true) => {
                wrong.extend([end, within, 1e-39]);
                good.push(f32::MIN_POSITIVE);
            }
            (false, false) => {
                wrong.push(end);
                good.push(within);
            }
        }
    }
    let all = |x: Vec<f32>| x.into_iter().map(bits).collect();
    Values { wrong: all(wrong), good: all(good) }
}

/// A whole number; `all` is true if it may have any of 64 bits.
fn whole(row: &Row, all: bool) -> Values {
    if all {
        assert_eq!(row.range, Range::ANY);
        return Values { wrong: vec![], good: vec![0, 1 << 32, u64::MAX, bits(f32::NAN)] };
    }
    let low = if row.range.low.is_finite() { row.range.low as u64 } else { 0 };
    let high = if row.range.high.is_finite() { row.range.high as u64 } else { u32::MAX.into() };
    assert!(row.range == Range::ANY || (row.range.low_in && row.range.high_in), "{row:?}");
    let mut wrong = vec![1 << 32, (1 << 32) + low, u64::MAX];
    wrong.extend(low.checked_sub(1));
    // A real number in its place is a whole one.
    let reals = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 2.5].map(bits);
    wrong.extend(reals.into_iter().chain([high + 1]).filter(|n| *n > high));
    Values { wrong, good: vec![low, high] }
}

/// A key's number in SI.
fn si(unit: &Unit, x: f64) -> f64 {
    match unit.conversion {
        Conversion::None => x,
        Conversion::Degrees => x.to_radians(),
        Conversion::Percent => x / 100.0,
    }
}

/// A value in the unit of its key.
fn shown(setting: &Setting, value: u64) -> String {
    let Declared::Row(row, _) = setting.declared else { return value.to_string() };
    let of_key = |x: f32| match row.unit.conversion {
        Conversion::None => x,
        Conversion::Degrees => f64::from(x).to_degrees() as f32,
        Conversion::Percent => (f64::from(x) * 100.0) as f32,
    };
    match row.kind {
        Kind::Real => of_key(f32::from_bits(value as u32)).to_string(),
        Kind::Points => format!("{value} points"),
        _ => value.to_string(),
    }
}

/// Units of the bounds that are intervals: both ends of one have that of its key.
const OF_INTERVALS: &[(&str, &Unit)] = &[
    ("bounds.inertia_kg_m2.", &KG_M2),
    ("bounds.drive_torque_nm.", &NM),
    ("bounds.viscous_damping_nm_s_rad.", &NM_S_RAD),
    ("bounds.brake_gain_nm_v.", &NM_V),
    ("bounds.motor_gain_nm_v.", &NM_V),
];

/// The unit of a setting's value.
fn unit<'a>(setting: &Setting, row: &'a Row) -> &'a Unit {
    let name = setting.name.to_string();
    OF_INTERVALS.iter().find(|(interval, _)| name.starts_with(interval)).map_or(&row.unit, |(_, unit)| unit)
}

/// The range of a setting in words, unit included.
fn range(setting: &Setting) -> String {
    match setting.declared {
        Declared::Row(row, _) => row.range.words(row.kind, unit(setting, row), false).to_string(),
        Declared::Choice(choice) => {
            let options: Vec<&str> = choice.options.iter().map(|option| option.key).collect();
            format!("one of: {}", options.join(", "))
        }
    }
}

/// The misfit, and the host's words on the board's refusal.
fn refusal(settings: &Settings) -> (Misfit, String) {
    let misfit = settings.build().unwrap_err();
    let lacks = !matches!(misfit, Misfit::Unfit { .. });
    (misfit, Refusing { settings, bits: misfit.bits(), lacks }.to_string())
}

/// A value out of range is refused, and told with key, value and unit; what is otherwise.
fn is_refused(plan: &Plan, setting: &Setting, value: u64) -> Result<(), String> {
    let Setting { key, name, declared, .. } = *setting;
    let told = format!("{name} = {}", shown(setting, value));
    let settings = with(plan, key, value);
    if settings.build().is_ok() {
        return Err(format!("{told}: taken"));
    }
    let (misfit, text) = refusal(&settings);
    let kind = if let Declared::Row(row, _) = declared { Some(row.kind) } else { None };
    let lacks = match (misfit, kind) {
        (Misfit::Unfit { key: of, relation: 0, .. }, Some(Kind::Real | Kind::Whole)) if of == key => "",
        // A whole number may be more than its type holds; a place in a list has no range.
        (Misfit::Unknown(of), kind) if of == key && kind != Some(Kind::Real) => {
            " the board lacks it, or knows no such value:"
        }
        _ => return Err(format!("{told}: {misfit:?}, {text}")),
    };
    if text != format!("{told}:{lacks} expected {}", range(setting)) {
        return Err(format!("{told}: {text}"));
    }
    match declared {
        // A list's number of points has no unit.
        Declared::Row(row, _) if row.kind != Kind::Points && !text.contains(unit(setting, row).text) => {
            Err(format!("{told}: {text}: without {}", unit(setting, row).text))
        }
        _ => Ok(()),
    }
}

/// A value in range is taken (true); or a relation is told, or what is now chosen lacks its settings (false).
fn is_taken(plan: &Plan, setting: &Setting, value: u64) -> Result<bool, String> {
    let settings = with(plan, setting.key, value);
    let Err(misfit) = settings.build() else { return Ok(true) };
    let text = refusal(&settings).1;
    let told = format!("{} = {}: {text}", setting.name, shown(setting, value));
    let relation = match misfit {
        Misfit::Missing(key) => {
            let of = Setting::of(key).map_or(String::new(), |of| of.name.to_string());
            let points = matches!(setting.declared, Declared::Row(row, _) if row.kind == Kind::Points);
            let below = of.starts_with(&format!("{}.", setting.name));
            return if points || below { Ok(false) } else { Err(told) };
        }
        Misfit::Unfit { key, relation, .. } => match Setting::of(key).map(|of| of.declared) {
            Some(Declared::Row(_, table)) => table.relations.get(usize::from(relation).wrapping_sub(1)),
            _ => None,
        },
        Misfit::Unknown(_) => None,
    };
    match relation {
        Some(relation) if text.ends_with(relation.expected) => Ok(false),
        _ => Err(told),
    }
}

#[test]
fn each_setting_is_refused_out_of_its_range_and_taken_within_it() {
    let (mut reached, mut taken, mut bad) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    for plan in plans() {
        plan.settings().build().unwrap();
        // The points of a table are no settings by themselves.
        for setting in plan.pairs().into_iter().filter_map(|(key, _)| Setting::of(key)) {
            let Values { wrong, good } = values(&setting);
            bad.extend(wrong.iter().filter_map(|value| is_refused(&plan, &setting, *value).err()));
            for value in good {
                match is_taken(&plan, &setting, value) {
                    Ok(true) => _ = taken.insert((setting.key, value)),
                    Ok(false) => {}
                    Err(told) => _ = bad.insert(told),
                }
            }
            reached.insert(setting.key);
        }
    }
    assert!(bad.is_empty(), "{bad:#?}");
    let left_out: Vec<String> =
        Setting::all().filter(|s| !reached.contains(&s.key)).map(|s| s.name.to_string()).collect();
    assert!(left_out.is_empty(), "no plan has {left_out:?}");
    assert_eq!(reached.len(), SETTINGS);
    // Settings that no plan takes at an end of their range: a relation with others is narrower there, whatever they are.
    let related: Vec<String> = Setting::all()
        .filter(|s| {
            let good = values(s).good;
            !good.is_empty() && !good.iter().any(|value| taken.contains(&(s.key, *value)))
        })
        .map(|s| s.name.to_string())
        .collect();
    assert_eq!(related, RELATED);
}
