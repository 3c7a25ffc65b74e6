//! The rig as it is believed to be: what is simulated where the rig itself is to be spared.

use crate::Estimate;
use crate::rig_file::RigFile;
use clutch_core::friction::FrictionParams;
use clutch_core::{ActuatorKind, ActuatorParams, Interval};
use clutch_sim::drive::DriveParams;
use clutch_sim::rig::RigParams;
use clutch_sim::{Scenario, ScenarioError};
use toml::{Table, Value};

/// A scenario whose rig is its own belief.
#[derive(Clone, Debug)]
pub struct Believed {
    /// `[rig]` is `[model]`, with sensor, converter and torque noise of the scenario's rig; it begins at rest.
    pub scenario: Scenario,
    /// Reason why the delay found is no whole number of periods, which all that is certified assumes; none if it is one.
    pub delay_between: Option<String>,
    /// Corners of the bounds.
    pub corners: Vec<Corner>,
}

/// A corner of the bounds, as factors on the believed rig. Under a brake motion depends on T/J and T/(μ_d K), and little on
/// damping: the corners are those of the two ratios, and friction is the believed one. Of a motor, whose torque per volt is
/// known, they are those of load, inertia and friction.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Corner {
    /// On the torque of drive or load.
    pub torque: f64,
    /// On inertia and damping.
    pub inertia: f64,
    /// On the friction of a motor axis.
    pub friction: f64,
}

impl Corner {
    /// The rig as it is believed to be.
    pub const BELIEVED: Corner = Corner { torque: 1.0, inertia: 1.0, friction: 1.0 };

    /// The believed rig at this corner.
    pub fn apply(&self, rig: &mut RigParams) {
        match &mut rig.drive {
            DriveParams::Weight(weight) => weight.mass *= self.torque,
            DriveParams::Table(load) => {
                load.points.0.iter_mut().for_each(|(_, torque)| *torque *= self.torque)
            }
            _ => {}
        }
        rig.inertia *= self.inertia;
        rig.viscous_damping *= self.inertia;
        if let ActuatorParams::Motor(motor) = &mut rig.actuator {
            motor.preload *= self.friction;
            motor.load_share *= self.friction;
        }
    }
}

/// Stribeck velocity that is reckoned with where none is determined, rad/s: the largest of the rigs that identification was tried on.
const UNKNOWN_STRIBECK: f64 = 0.005;

/// Factor by which the best value of a brake's Stribeck velocity may be off: at 2 ms, where least is known of it, it was off by 2.06
/// at most on 12 rigs.
const OFF: f64 = 2.0;

/// Waves along the disc of a rig whose file has none: those of the rig `bench`.
const WAVES: [i64; 2] = [136, 544];
/// Waves of the believed disc: so few that all of them together, √8 of their root mean square, stay within the bounds that
/// three make.
const NUMBER: i64 = 4;

/// The scenario with the rig that it believes in; `file` is what was identified, which also gives delay and ripple: without
/// it these are those of the scenario's rig.
///
/// # Errors
/// The rig has a brake and a motor on one signal, or is refused.
pub fn believed(scenario: &Scenario, file: Option<&RigFile>) -> Result<Believed, ScenarioError> {
    let kind = scenario.spec().rig.actuator.kind();
    let refuse = |key: &str, value: &str, expected: &str| {
        Err(ScenarioError::value(scenario.name(), key, value, expected))
    };
    if kind == ActuatorKind::Both {
        return refuse("rig.actuator", kind.name(), "a brake or a motor, which can be identified and tuned");
    }
    if let Some(expected) = file.and_then(|file| file.expects_other_than(kind)) {
        return refuse("rig.actuator", kind.name(), &expected);
    }
    let mut table = scenario.table().clone();
    // Trials run on other discs.
    let _ = table.remove("friction_map");
    if let Some(file) = file {
        file.put_into(&mut table);
    }
    let told = Scenario::from_table(scenario.name(), table.clone(), &[])?;
    let spec = told.spec();
    if kind == ActuatorKind::Brake && spec.model.drive_torque <= 0.0 {
        return refuse(
            "model.drive_torque_nm",
            &spec.model.drive_torque.to_string(),
            "above 0: a shaft that is driven forwards",
        );
    }
    let period: f64 = spec.period.seconds();
    let mut delay_between = None;
    let mut set = vec![("run.start".to_owned(), Value::String("rest".to_owned()))];
    // A bound for one Stribeck velocity holds for all below it: the slow speeds are those of the largest.
    if let (Some(file), FrictionParams::Stribeck(_)) = (file, spec.model.friction) {
        let most = file.stribeck.map_or(UNKNOWN_STRIBECK, |stribeck| stribeck.high);
        let tried = match file.stribeck {
            // A motor's is rarely known but for its upper end, at which every law would be judged by a shaft that hardly is one.
            Some(v) if kind == ActuatorKind::Motor && v.low <= 0.0 && v.value > 0.0 => {
                (v.value * v.high).sqrt()
            }
            // Of a brake's the best value is rarely off by as much, however little is said of its upper end.
            Some(v) if kind == ActuatorKind::Brake && v.value > 0.0 => v.high.min(OFF * v.value),
            _ => most,
        };
        for (section, velocity) in [("model", most), ("rig", tried)] {
            let key = format!("{section}.friction.stribeck.stribeck_velocity_rad_s");
            set.push((key, Value::Float(velocity)));
        }
    }
    // A lag that may be none is believed to be none.
    let lag = file.and_then(|file| file.lag).map(Estimate::if_any);
    if let Some(delay) = file.and_then(|file| file.delay) {
        let delay = delay.less(lag.unwrap_or(0.0));
        let ticks = (delay.value / period).round();
        if !delay.holds(ticks * period) {
            delay_between = Some(format!(
                "the delay found, {:.2} … {:.2} ms, holds no whole number of periods",
                1e3 * delay.low,
                1e3 * delay.high
            ));
        }
        set.push(("rig.delay_ticks".to_owned(), Value::Integer(ticks as i64)));
    }
    let model = table_of(told.table(), "model");
    let mut rig = table_of(told.table(), "rig");
    for key in ["inertia_kg_m2", "viscous_damping_nm_s_rad", "friction", "actuator"] {
        if let Some(value) = model.get(key) {
            rig.insert(key.to_owned(), value.clone());
        }
    }
    if let Some(lag) = lag {
        rig.remove("actuator_time_constant_s");
        if lag > 0.0 {
            rig.insert("actuator_time_constant_s".to_owned(), Value::Float(lag));
        }
    }
    let torque = spec.model.drive_torque;
    let drive = if kind == ActuatorKind::Brake { weight(&spec.rig.drive, torque) } else { load(torque) };
    rig.insert("drive".to_owned(), Value::Table(drive));
    if let Some((file, ripple)) = file.and_then(|file| Some((file, file.ripple?))) {
        let band = file.waves.map_or_else(|| band(&rig), band_around);
        rig.insert("ripple".to_owned(), Value::Table(waves(band, ripple.value)));
        rig.remove("runout");
    }
    let mut table = told.table().clone();
    table.insert("rig".to_owned(), Value::Table(rig));
    let scenario = Scenario::from_table(scenario.name(), table, &set)?;
    let corners = corners(&scenario)?;
    Ok(Believed { scenario, delay_between, corners })
}

/// A weight that drives with that torque, N m, on the rig's own pulley where it has one.
fn weight(own: &DriveParams, torque: f64) -> Table {
    let (gravity, radius) = match own {
        DriveParams::Weight(w) => (w.gravity, w.pulley_radius),
        _ => (9.81, 0.024),
    };
    let rows =
        [("mass_kg", torque / (gravity * radius)), ("gravity_m_s2", gravity), ("pulley_radius_m", radius)];
    let rows = rows.into_iter().map(|(key, x)| (key.to_owned(), Value::Float(x))).collect();
    Table::from_iter([("weight".to_owned(), Value::Table(rows))])
}

/// A constant load, N m.
fn load(torque: f64) -> Table {
    let point = Value::Array(vec![Value::Float(0.0), Value::Float(torque)]);
    let rows = Table::from_iter([("points_s_nm".to_owned(), Value::Array(vec![point]))]);
    Table::from_iter([("table".to_owned(), Value::Table(rows))])
}

fn table_of(table: &Table, key: &str) -> Table {
    table.get(key).and_then(Value::as_table).cloned().unwrap_or_default()
}

/// Lowest and highest wave per turn, and the spacing of those between, which divides both.
type Band = [i64; 3];

/// Waves about as long as those that rides show: 4, 6, 8 and 10 sevenths of them.
fn band_around(waves: f64) -> Band {
    let spacing = ((2.0 * waves / (NUMBER + 3) as f64).round() as i64).max(1);
    [2 * spacing, (NUMBER + 1) * spacing, spacing]
}

/// Waves in the band of the rig's own, evenly spaced from the lowest on, as far as the spacing divides it; else the one at the
/// middle.
fn band(rig: &Table) -> Band {
    let own = rig.get("ripple").and_then(Value::as_table);
    let wave =
        |key: &str, default: i64| own.and_then(|t| t.get(key)).and_then(Value::as_integer).unwrap_or(default);
    let (lowest, highest) =
        (wave("lowest_waves_per_turn", WAVES[0]), wave("highest_waves_per_turn", WAVES[1]));
    let spacing = ((highest - lowest) / (NUMBER - 1)).max(1);
    if highest > lowest && spacing <= lowest {
        let lowest = (lowest / spacing).max(1) * spacing;
        [lowest, lowest + (NUMBER - 1) * spacing, spacing]
    } else {
        [((lowest + highest) / 2).max(1); 3]
    }
}

/// A disc with a ripple of that root mean square.
fn waves([lowest, highest, spacing]: Band, rms: f64) -> Table {
    let whole = [
        ("lowest_waves_per_turn", lowest),
        ("highest_waves_per_turn", highest),
        ("spacing_waves_per_turn", spacing),
    ];
    let mut table: Table = whole.into_iter().map(|(key, n)| (key.to_owned(), Value::Integer(n))).collect();
    // Friction does not reach 0.
    let most = 0.99 / (2.0 * NUMBER as f64).sqrt();
    table.insert("rms".to_owned(), Value::Float(rms.clamp(0.0, most)));
    table
}

/// Ratios known more closely than this, end from end, are taken for known: discs differ by more.
const NARROW: f64 = 0.01;

/// Both ends of what motion depends on; one where it is known.
fn corners(scenario: &Scenario) -> Result<Vec<Corner>, ScenarioError> {
    let bounds = scenario.plan()?.bounds;
    let model = scenario.spec().model;
    let shares = |i: &Interval, value: f64| [i.low / value, i.high / value];
    let inertia = shares(&bounds.inertia, model.inertia);
    let (friction, _) = scenario.params().bounds.friction_shares(0.0);
    let ends = |[low, high]: [f64; 2]| if high - low < NARROW { vec![1.0] } else { vec![low, high] };
    let mut torque = [1.0; 2];
    if model.drive_torque != 0.0 {
        // A load that acts backwards is negative at both ends.
        let [a, b] = shares(&bounds.drive_torque, model.drive_torque);
        torque = [a.min(b), a.max(b)];
    }
    if bounds.actuator == ActuatorKind::Motor {
        let gain = shares(&bounds.motor_gain, 0.5 * (bounds.motor_gain.low + bounds.motor_gain.high));
        // A load beside the friction counts by its share of that.
        let beside = bounds.friction_sliding.low * bounds.preload;
        if (torque[1] - torque[0]) * model.drive_torque.abs() < NARROW * beside {
            torque = [1.0; 2];
        }
        // Each counts over the torque per volt.
        let over = |[low, high]: [f64; 2]| ends([low / gain[1], high / gain[0]]);
        let mut corners = Vec::new();
        for torque in over(torque) {
            for inertia in over(inertia) {
                corners.extend(over(friction).into_iter().map(|friction| Corner {
                    torque,
                    inertia,
                    friction,
                }));
            }
        }
        return Ok(corners);
    }
    let middle = 0.5 * (bounds.brake_gain.low + bounds.brake_gain.high);
    let gain = shares(&bounds.brake_gain, middle);
    let pull = ends([torque[0] / inertia[1], torque[1] / inertia[0]]);
    let hold = ends([torque[0] / (friction[1] * gain[1]), torque[1] / (friction[0] * gain[0])]);
    let at = |pull: f64, hold: f64| Corner { torque: hold, inertia: hold / pull, friction: 1.0 };
    Ok(pull.into_iter().flat_map(|pull| hold.iter().map(move |hold| at(pull, *hold))).collect())
}
